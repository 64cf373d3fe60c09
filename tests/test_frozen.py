"""What the package hands out cannot be changed by accident, and reads well."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import copsense
from copsense import rigid_body
from copsense.limits import Limits


def handed_out(value):
    """Every array among an object's public attributes, by name."""
    for name in {*dir(type(value)), *vars(value)}:
        if name.startswith("_"):
            continue
        found = getattr(value, name)
        for part in found if isinstance(found, tuple) else (found,):
            if isinstance(part, np.ndarray):
                yield name, part


@pytest.mark.parametrize("limits", [None, Limits(torque="model")], ids=["free", "within limits"])
def test_arrays_that_are_handed_out_are_read_only(icub, limits):
    equilibrium = copsense.solve_equilibrium(icub, copsense.minimum_torque(), limits)
    sensitivity = copsense.cop_sensitivity(icub, copsense.minimum_torque(), limits)
    for value in (icub.robot, icub, equilibrium, sensitivity):
        names = {name for name, _ in handed_out(value)}
        assert names, value
        writeable = {name for name, array in handed_out(value) if array.flags.writeable}
        assert not writeable, f"{type(value).__name__}: {writeable}"


def test_an_answer_does_not_change_what_the_next_one_is(icub):
    before = copsense.solve_equilibrium(icub, copsense.minimum_torque()).wrenches.copy()
    with pytest.raises(ValueError, match="read-only"):
        icub.gravity[2] += 100.0
    with pytest.raises(ValueError, match="read-only"):
        icub.jacobian[:] = 0.0
    np.testing.assert_array_equal(
        copsense.solve_equilibrium(icub, copsense.minimum_torque()).wrenches, before
    )


def test_what_a_caller_gives_is_copied(icub):
    q = np.array(icub.q)
    stance = icub.at(q)
    q[0] += 1.0
    np.testing.assert_array_equal(stance.q, icub.q)


@pytest.mark.parametrize("limits", [None, Limits()], ids=["free", "within limits"])
def test_results_read_in_a_few_lines(icub, limits):
    found = copsense.solve_equilibrium(icub, copsense.minimum_torque(), limits)
    assert "icub" in repr(icub.robot)
    assert "l_sole (surface)" in repr(icub)
    assert "minimum-torque on 'icub'; load l_sole 50.0%" in repr(found)
    posture = copsense.solve_posture(icub, com=(None, 0.01, None))
    path = copsense.lateral_sweep(icub, -0.01, 0.01, 3)
    assert "com_y" in repr(path)
    for value in (icub.robot, icub, found, posture, path):
        assert len(repr(value)) < 400


def test_a_path_gives_its_stances_with_their_tangents(icub):
    path = copsense.lateral_sweep(icub, -0.01, 0.01, 3)
    pairs = list(path)
    assert [stance for stance, _ in pairs] == list(path.stances)
    np.testing.assert_array_equal([tangent for _, tangent in pairs], path.tangents)


def test_a_ready_model_is_the_way_in(icub):
    stance = copsense.Stance.from_model(icub.robot.model, icub.q, ["l_sole", icub.contacts[1]])
    assert stance.robot.model is not icub.robot.model
    given, found = (
        copsense.solve_equilibrium(s, copsense.minimum_torque()).wrenches for s in (icub, stance)
    )
    np.testing.assert_allclose(found, given, rtol=0, atol=1e-10)


def test_threads_that_share_a_robot_do_not_share_working_memory(icub):
    path = copsense.lateral_sweep(icub, -0.03, 0.03, 8)
    configurations = [stance.q for stance in path.stances] * 8

    def gradient(q):
        return copsense.cop_sensitivity(icub.at(q), copsense.minimum_torque()).gradient

    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(gradient, configurations))
    for q, given in zip(configurations, found, strict=True):
        np.testing.assert_array_equal(given, gradient(q))


def test_what_a_robot_keeps_is_made_once(icub, monkeypatch):
    """Names of 400 frames, and the memory that Pinocchio works in, are not made at each posture."""
    criteria = (copsense.minimum_torque(), copsense.minimum_wrench(1.0))
    for criterion in criteria:  # the first time they are
        copsense.cop_sensitivity(icub, criterion)
    robot = icub.robot
    assert robot.frame_names is robot.frame_names
    assert robot.torque_names is robot.torque_names
    made = []
    monkeypatch.setattr(rigid_body._Scratch, "__init__", lambda memory, of: made.append(of))
    for criterion in criteria:
        copsense.cop_sensitivity(icub.at(icub.q), criterion).com_travel  # noqa: B018
    assert not made
