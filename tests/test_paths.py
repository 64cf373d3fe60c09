"""Paths: on the constraint manifold, with the tangent of the very curve they sample."""

import numpy as np
import pinocchio as pin
import pytest
from support import walkers
from support.differences import largest_error

import copsense
import copsense.path
from copsense.posture import contact_error

MET = 1e-12  # m, rad


def contacts_moved(path, stance):
    return max(np.abs(contact_error(s, stance.placements)).max() for s in path.stances)


def tangent_error(sweep_at, value, tangent, h=1e-3):
    """Error of a tangent against differences of the path itself, solved at its neighbours."""
    q = {k: sweep_at(value + k * h) for k in (-2, -1, 0, 1, 2)}
    at = {k: pin.difference(q[0].robot.model, q[0].q, stance.q) for k, stance in q.items()}
    numeric = (8 * (at[1] - at[-1]) - (at[2] - at[-2])) / (12 * h)
    return largest_error(tangent[:, None], numeric[:, None])


def test_lateral_sweep_moves_the_com_alone(icub, lateral_path):
    assert lateral_path.coordinate == "com_y"
    assert lateral_path.unit == "m"
    assert len(lateral_path) == 15
    assert not lateral_path.failures
    assert contacts_moved(lateral_path, icub) < MET
    coms = np.array([stance.com for stance in lateral_path.stances])
    np.testing.assert_allclose(coms[:, 1], np.linspace(-0.07, 0.07, 15), rtol=0, atol=MET)
    feet = np.mean([place.translation[0] for place in icub.placements])
    np.testing.assert_allclose(coms[:, 0], feet, rtol=0, atol=MET)
    assert np.ptp(coms[:, 2]) > 1e-3  # the height is free, and takes its freedom


@pytest.mark.parametrize("row", [0, 4, 7, 12])
def test_lateral_tangent_is_the_derivative_of_the_path(icub, lateral_path, row):
    stance, tangent = lateral_path.stances[row], lateral_path.tangents[row]

    def at(y):
        return copsense.lateral_sweep(icub, y, y, 1).stances[0]

    assert tangent_error(at, lateral_path.values[row], tangent) < 1e-7
    assert np.abs(stance.jacobian @ tangent).max() < 1e-12
    np.testing.assert_allclose(stance.com_jacobian[:2] @ tangent, [0, 1], rtol=0, atol=1e-12)
    rates = lateral_path.joint_rates("l_hip_roll")
    assert rates[row] == tangent[stance.robot.velocity_index("l_hip_roll")]


def test_a_posture_of_a_sweep_does_not_depend_on_the_others(icub, lateral_path):
    # Each is nearest to the stance given, not to its neighbour on the way.
    alone = copsense.lateral_sweep(icub, 0.07, 0.07, 1)
    np.testing.assert_allclose(alone.stances[0].q, lateral_path.stances[-1].q, rtol=0, atol=1e-10)
    np.testing.assert_allclose(alone.tangents[0], lateral_path.tangents[-1], rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("name", "joint", "start", "stop"),
    [
        ("icub", "l_knee", -0.5, -0.1),
        ("icub", "torso_roll", -0.2, 0.2),
        ("solo12", "FL_HFE", 0.6, 1),
    ],
)
def test_joint_sweep_moves_the_joint_and_no_contact(stance_of, name, joint, start, stop):
    stance = stance_of(name)
    path = copsense.joint_sweep(stance, joint, start, stop, 5)
    assert (path.coordinate, path.unit) == (joint, "rad")
    assert not path.failures
    assert contacts_moved(path, stance) < MET
    angles = [s.robot.joint_position(s.q, joint) for s in path.stances]
    np.testing.assert_allclose(angles, np.linspace(start, stop, 5), rtol=0, atol=MET)
    np.testing.assert_allclose(path.joint_rates(joint), 1.0, rtol=0, atol=1e-12)

    def at(angle):
        return copsense.joint_sweep(stance, joint, angle, angle, 1).stances[0]

    for row in (1, 4):
        assert tangent_error(at, path.values[row], path.tangents[row]) < 1e-7


@pytest.mark.parametrize(
    ("name", "start", "stop", "free"), [("com_x", -0.03, 0.02, "z"), ("com_z", 0.5, 0.53, "")]
)
def test_a_com_sweep_moves_the_com_along_its_axis_alone(icub, name, start, stop, free):
    path = copsense.path.com_sweep(icub, name, start, stop, 4)
    assert (path.coordinate, path.unit, dict(path.failures)) == (name, "m", {})
    assert contacts_moved(path, icub) < MET
    axis = "xyz".index(name[-1])
    coms = np.array([stance.com for stance in path.stances])
    np.testing.assert_allclose(coms[:, axis], np.linspace(start, stop, 4), rtol=0, atol=MET)
    middle = np.mean([place.translation for place in icub.placements], axis=0)
    for other in {0, 1} - {axis}:
        np.testing.assert_allclose(coms[:, other], middle[other], rtol=0, atol=MET)
    assert (np.ptp(coms[:, 2]) > 1e-4) == (free == "z" or name == "com_z")

    def at(value):
        return copsense.path.com_sweep(icub, name, value, value, 1).stances[0]

    # The knees bend fast near their straight end: steps finer than elsewhere.
    assert tangent_error(at, path.values[1], path.tangents[1], h=3e-4) < 1e-7
    np.testing.assert_allclose(
        path.stances[1].com_jacobian[axis] @ path.tangents[1], 1.0, rtol=0, atol=1e-12
    )


def test_a_com_sweep_holds_what_it_is_told_to_hold(icub):
    path = copsense.path.com_sweep(icub, "com_y", 0.0, 0.02, 2, held={"com_z": 0.52, "com_x": 0.01})
    coms = np.array([stance.com for stance in path.stances])
    np.testing.assert_allclose(coms, [[0.01, 0, 0.52], [0.01, 0.02, 0.52]], rtol=0, atol=MET)


def test_a_com_sweep_leaves_alone_what_the_contacts_hold_fast():
    # Legs that only pitch: no motion moves the CoM sideways, and it is not in the middle.
    text = walkers.walker(walkers.PITCH_ONLY, trunk=(0.0, 0.01, 0.2))
    with pytest.warns(UserWarning, match="not over the middle"):
        stance = copsense.load_stance(
            text, contacts=["l_foot", "r_foot"], contact_at="sole", posture=walkers.bent()
        )
    path = copsense.path.com_sweep(stance, "com_z", stance.com[2] - 0.02, stance.com[2], 2)
    assert not path.failures
    assert [s.com[1] for s in path.stances] == pytest.approx([stance.com[1]] * 2, abs=1e-9)


@pytest.mark.parametrize(
    ("name", "coordinate", "held", "said"),
    [
        ("icub", "com_w", {}, "com_x, com_y"),
        ("icub", "com_y", {"com": 0.1}, "com_x"),
        ("icub", "com_y", {"com_y": 0.1}, "both swept and held"),
        ("icub", "com_y", {"com_x": np.nan}, "com_x"),
        ("four_bar", "com_x", {}, "lives in a plane"),
    ],
)
def test_a_com_sweep_rejects_what_cannot_be_meant(stance_of, name, coordinate, held, said):
    with pytest.raises(copsense.CopsenseError, match=said):
        copsense.path.com_sweep(stance_of(name), coordinate, 0.0, 0.1, 2, held=held)


def test_a_posture_out_of_reach_is_a_failure_and_the_others_stand(icub):
    path = copsense.lateral_sweep(icub, -0.9, 0.9, 7)
    assert sorted(path.failures) == [0, 1, 5, 6]
    for i, reason in path.failures.items():
        assert f"CoM y = {path.values[i]:g} m" in reason
        assert not np.any(path.tangents[i])
    assert [path.stances[i].com[1] for i in (2, 3, 4)] == pytest.approx([-0.3, 0, 0.3], abs=MET)


def test_progress_is_told_of_each_posture_once(icub):
    steps = []
    copsense.lateral_sweep(icub, -0.02, 0.02, 4, progress=steps.append)
    copsense.joint_sweep(icub, "l_knee", -0.3, -0.2, 3, progress=steps.append)
    assert steps == [1] * 7


def test_path_through_configurations_keeps_them_and_has_admissible_tangents(icub, lateral_path):
    path = copsense.path_through(icub, [s.q for s in lateral_path.stances])
    assert (path.coordinate, path.unit) == ("index", "1")
    np.testing.assert_array_equal(path.values, np.arange(15))
    spacing = 0.01  # m of CoM y between neighbours
    for here, there, tangent, exact in zip(
        path.stances, lateral_path.stances, path.tangents, lateral_path.tangents, strict=True
    ):
        np.testing.assert_allclose(here.q, there.q, rtol=0, atol=1e-15)
        assert np.abs(here.jacobian @ tangent).max() < 1e-12
        # As near to the curve's own tangent as the list is fine.
        assert np.abs(tangent / spacing - exact).max() < 0.05 * np.abs(exact).max()


def test_path_through_rejects_a_moved_contact_and_projects_on_request(icub, lateral_path):
    moved = [q + 1e-4 * (np.arange(30) == 9) for q in (s.q for s in lateral_path.stances[:3])]
    with pytest.raises(copsense.CopsenseError, match=r"configuration 0.*project=True"):
        copsense.path_through(icub, moved)
    path = copsense.path_through(icub, moved, project=True)
    assert contacts_moved(path, icub) < MET
    for here, given in zip(path.stances, moved, strict=True):
        assert 0 < np.abs(pin.difference(icub.robot.model, given, here.q)).max() < 1e-3


def test_a_bad_configuration_of_a_list_is_a_failure_if_asked(icub, lateral_path):
    rows = [s.q.copy() for s in lateral_path.stances[:4]]
    rows[1][10] += 0.01  # a leg's joint: the foot is no more where it was
    rows[2][9] = np.nan
    path = copsense.path_through(icub, rows, strict=False)
    assert list(path.failures) == [1, 2]
    assert "configuration 1 has a contact" in path.failures[1]
    assert "not finite" in path.failures[2] or "finite" in path.failures[2]
    assert len(path) == 4
