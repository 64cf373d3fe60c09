"""Robots on position servos share their load as the criterion of their stiffnesses says."""

import numpy as np
import pinocchio as pin
import pytest
import scipy.linalg
from support.commands import copsense as command
from support.servos import ServoRobot

import copsense
from copsense import Criterion, check_sensitivity, minimum_torque, solve_equilibrium
from copsense.criterion_text import criterion_from_text
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.stiffness import command_preload, critical_stiffness, stiffness
from copsense.terms import PreloadTerm, TorqueTerm

GROUPS = "stiffness:hip=4000,ankle=1000,rest=2000"
SOLES = (2834.0, 709.0, 3000.0)  # Nm/rad about x, y, z
ON_SOLES = [np.inf, np.inf, np.inf, *SOLES]


@pytest.fixture(scope="module")
def apart(icub):
    """Distance of the feet [m]."""
    return float(np.ptp([place.translation[1] for place in icub.placements]))


@pytest.fixture(scope="module")
def leaning(icub):
    return copsense.lateral_sweep(icub, -4e-3, 4e-3, 3)


def share_of_moment(stance, tangent, criterion, apart):
    """alpha: the part of the CoM's moment that moves as load from foot to foot."""
    forces, _ = solve_equilibrium(stance, criterion).derivative(tangent[:, None])
    return stance.unstack(forces)[0, 2, 0] / stance.robot.weight * apart


def by_part(robot):
    parts = {"hip": 4000.0, "ankle": 1000.0}
    return np.array(
        [next((k for p, k in parts.items() if p in n), 2000.0) for n in robot.joint_names]
    )


# Published in the theory of this robot: 0.493, 0.784.
@pytest.mark.parametrize(
    ("joints", "sole", "expected", "within"),
    [(2000.0, None, 0.4937, 3e-4), (GROUPS, None, 0.7848, 3e-4), (2000.0, SOLES, 0.6199, 1e-3)],
    ids=["alike", "by part", "soft soles"],
)
def test_servos_in_simulation_share_the_load_as_their_stiffness(
    icub, leaning, apart, joints, sole, expected, within
):
    numbers = by_part(icub.robot) if joints == GROUPS else joints
    robot = ServoRobot(icub, numbers, sole)
    seconds = 0.5 if sole is None else 0.8
    (a, y_a), (b, y_b) = (robot.settle(leaning.stances[i].q, seconds) for i in (0, 2))
    measured = apart * (b - a) / (y_b - y_a)
    criterion = stiffness(numbers, None if sole is None else ON_SOLES)
    found = share_of_moment(icub, leaning.tangents[1], criterion, apart)
    assert found == pytest.approx(expected, abs=1e-4)
    assert measured == pytest.approx(found, abs=within)


def test_a_foot_commanded_lower_in_simulation_carries_what_the_preload_says(icub):
    place = icub.placements[0]
    lower = pin.SE3(place.rotation, place.translation - [0.0, 0.0, 1e-3])
    low = copsense.solve_posture(icub, targets=[lower, icub.placements[1]]).stance.q
    measured, _ = ServoRobot(icub, 2000.0).settle(low, 0.5, where=icub.q)
    preload = {"l_sole": [0.0, 0.0, -1e-3, 0.0, 0.0, 0.0]}
    found = solve_equilibrium(icub, stiffness(2000.0, preload=preload))
    share = found.wrenches[0, 2] / icub.robot.weight
    assert share == pytest.approx(0.807, abs=1e-3)
    assert measured == pytest.approx(share, abs=4e-3)


def test_preload_of_a_command_counts_only_what_no_base_motion_makes_up_for(icub):
    criterion = stiffness(2000.0)
    plain = solve_equilibrium(icub, criterion)
    base = icub.unstack(icub.jacobian[:, :6] @ [1e-3, 2e-3, -1e-3, 1e-3, 2e-3, 3e-3])
    moved = solve_equilibrium(icub, stiffness(2000.0, preload=base))
    np.testing.assert_allclose(moved.forces, plain.forces, rtol=0, atol=1e-9)
    off = command_preload(icub, {"l_hip_roll": 1e-3})
    felt = solve_equilibrium(icub, stiffness(2000.0, preload=off))
    assert np.abs(felt.forces - plain.forces).max() > 1.0
    # By least energy, written apart: over f = f_0 + N z, J_b' N = 0.
    J, N = icub.jacobian, np.linalg.svd(icub.jacobian[:, :6].T)[2][6:].T
    f0 = np.linalg.lstsq(J[:, :6].T, icub.gravity[:6])[0]
    A, e = J[:, 6:].T, icub.stack(off)
    tau0 = icub.gravity[6:] - A @ f0
    z = np.linalg.solve(N.T @ A.T @ A @ N / 2000, N.T @ (A.T @ tau0 / 2000 - e))
    np.testing.assert_allclose(felt.forces, f0 + N @ z, rtol=0, atol=1e-8)


def test_joints_alike_share_as_minimum_torque_whatever_their_stiffness(icub):
    expected = solve_equilibrium(icub, minimum_torque())
    for k in (1.0, 300.0, 2e4):
        found = solve_equilibrium(icub, stiffness(k))
        np.testing.assert_allclose(found.forces, expected.forces, rtol=0, atol=1e-8)


def test_derivatives_and_limits_know_soles_and_preload(icub):
    preload = {"l_sole": [0.0, 1e-4, -1e-4, 1e-4, 0.0, 0.0]}
    criterion = stiffness({"*hip*": 4000.0, "*": 2000.0}, ON_SOLES, preload)
    check_sensitivity(icub, criterion)
    limits = copsense.Limits(cop_margin=0.0)
    found = solve_equilibrium(icub, criterion, limits)
    assert found.optimality() < 1e-9
    again = Criterion.from_dict(criterion.to_dict())
    assert again == criterion
    assert hash(again) == hash(criterion)


def test_critical_stiffness_is_where_the_robot_falls_in_simulation(icub):
    critical = critical_stiffness(icub, stiffness(1.0))
    assert critical == pytest.approx(131, abs=1)
    assert critical_stiffness(icub, stiffness(262.0)) == pytest.approx(critical / 262.0)
    found, Z = solve_equilibrium(icub, minimum_torque()), icub.admissible_motions
    A = Z.T @ icub.balance_derivative(found.forces) @ Z
    fall = Z @ scipy.linalg.eigh((A + A.T) / 2, Z[6:].T @ Z[6:])[1][:, 0]
    fall /= np.abs(fall).max()
    start = copsense.posture.retract(icub, 2e-3 * fall).q
    for k, grows in ((0.84 * critical, True), (1.15 * critical, False)):
        held = np.array(icub.q)
        held[7:] += found.torques / k  # so that the posture is an equilibrium
        robot = ServoRobot(icub, k, damping=0.01)
        robot.settle(held, 0.3, where=start, at_rest=False)
        left = (robot.positions - icub.q[7:]) @ fall[6:] / (fall[6:] @ fall[6:]) / 2e-3
        assert (left > 1.03) if grows else (left < 0.97)


def test_soft_soles_make_a_robot_fall_that_stiff_joints_cannot_hold(icub):
    rigid = critical_stiffness(icub, stiffness(1000.0))
    soft = critical_stiffness(icub, stiffness(1000.0, ON_SOLES))
    assert rigid < soft < 1.0
    # m g h = 177 Nm/rad on two feet of 80 each.
    too_soft = [np.inf, np.inf, np.inf, np.inf, 80.0, np.inf]
    assert critical_stiffness(icub, stiffness(1000.0, too_soft)) == np.inf
    with pytest.raises(InvalidInputError, match="every joint a stiffness"):
        critical_stiffness(icub, stiffness({"l_knee": 100.0}))


def test_the_command_line_names_stiffnesses(icub):
    named = criterion_from_text(GROUPS)
    alike = stiffness({"*hip*": 4000.0, "*ankle*": 1000.0, "*": 2000.0}, name=GROUPS)
    assert named == alike
    soles = criterion_from_text("stiffness:2000,mx=2834,my=709")
    expected = stiffness(2000.0, [np.inf, np.inf, np.inf, 2834.0, 709.0, np.inf])
    a, b = (solve_equilibrium(icub, c).forces for c in (soles, expected))
    np.testing.assert_allclose(a, b, rtol=0, atol=1e-9)
    data = command("analyse", "icub", "--criterion", GROUPS, "--json").json
    gain = data["criteria"][GROUPS]["contacts"]["l_sole"]["load_gain"][1]
    assert gain * 0.14 == pytest.approx(0.785, abs=0.01)
    failed = command("analyse", "icub", "--criterion", "stiffness:hip=stiff")
    assert failed.code != 0
    assert "'hip=stiff'" in failed.err
    assert "Traceback" not in failed.err


@pytest.mark.parametrize(
    "text", ["stiffness", "stiffness:", "stiffness:mx=3", "stiffness:a=1,a=2", "stiffness:-3"]
)
def test_texts_that_are_no_stiffness_are_rejected(text):
    with pytest.raises(InvalidInputError, match="stiffness"):
        criterion_from_text(text)


def test_weights_by_pattern_are_said_where_they_overlap_or_fit_nothing(icub):
    with pytest.raises(InvalidInputError, match="both fit"):
        solve_equilibrium(icub, stiffness({"*hip*": 1.0, "*_roll": 2.0, "*": 1.0}))
    with pytest.raises(UnknownNameError, match="hop"):
        solve_equilibrium(icub, stiffness({"*hop*": 1.0, "*": 1.0}))
    own = stiffness({"*hip*": 1.0, "l_hip_roll": 4.0, "*": 2.0}).terms[0]
    assert isinstance(own, TorqueTerm)
    W = Criterion("own", (own,)).at(icub).torque.diagonal()
    names = icub.robot.torque_names
    assert W[names.index("l_hip_roll")] == 0.25
    assert W[names.index("r_hip_roll")] == 1.0
    assert W[names.index("l_knee")] == 0.5
    with pytest.raises(UnknownNameError, match="contact"):
        solve_equilibrium(icub, Criterion("a", (own, PreloadTerm({"hand": np.zeros(6)}))))
    with pytest.raises(InvalidInputError, match="Give positive numbers"):
        stiffness(0.0)
