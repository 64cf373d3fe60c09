"""Motions of several joints that nothing holds: they hang, and what stands on them follows."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from support.driven_robots import hand_in_hand

import copsense
from copsense import Drives, Limits, Load
from copsense.drives import Coupling
from copsense.errors import UnbalancedError
from copsense.freedom import hanging_notes
from copsense.posture import solve_posture

RATIO = 0.6
LIMITS = Limits(friction=0.5, cop_margin=0.032, torque=60.0)
CRITERION = copsense.minimum_torque()


@pytest.fixture(scope="module")
def tied():
    """The iCub with one elbow tied to the other, and no motor on either; something in a hand."""
    model = copsense.load_robot("icub")
    motors = tuple(n for n in model.dof_names if "elbow" not in n)
    drives = Drives(motors=motors, couplings=(Coupling("r_elbow", of="l_elbow", ratio=RATIO),))
    stance = copsense.load_stance("icub", drives=drives)
    held = stance.with_loads([Load("l_hand", (2.0, 3.0, -6.0))])
    return solve_posture(held, com=(0.005, 0.02, None)).stance


def demand(stance, q):
    """u' N of the tied elbows by their own weights and the load, apart."""
    model, data = stance.robot.model, stance.robot.model.createData()
    weight = pin.computeGeneralizedGravity(model, data, q)
    pin.computeJointJacobians(model, data, q)
    hand = stance.robot.frame_id("l_hand")
    J = pin.computeFrameJacobian(model, data, q, hand, pin.LOCAL_WORLD_ALIGNED)
    N = weight - J[:3].T @ [2.0, 3.0, -6.0]
    left, right = (stance.robot.velocity_index(f"{side}_elbow") for side in "lr")
    return N[left] + RATIO * N[right]


def test_tied_joints_hang_together_where_their_moments_balance(tied):
    left, right = (tied.robot.velocity_index(f"{side}_elbow") for side in "lr")
    (motion,) = tied.hanging_motions.T
    assert motion[right] == pytest.approx(RATIO * motion[left], rel=1e-12)
    assert np.delete(motion, [left, right]) == pytest.approx(np.zeros(27), abs=1e-12)
    assert abs(demand(tied, tied.q)) < 1e-9
    (note,) = hanging_notes(tied)
    assert "would fall" not in note
    assert note.startswith("No motor holds l_elbow, r_elbow: they hang where gravity and springs ")


def test_admissible_motions_leave_it_at_rest_by_differences(tied):
    model, h = tied.robot.model, 1e-4
    lively = np.eye(model.nv)[tied.robot.velocity_index("l_elbow")]
    sizes = []
    for v in [*tied.admissible_motions.T, lively]:
        there = [demand(tied, pin.integrate(model, tied.q, k * h * v)) for k in (-2, -1, 1, 2)]
        sizes.append(abs(8 * (there[2] - there[1]) - (there[3] - there[0])) / (12 * h))
    assert max(sizes[:-1]) < 1e-8
    assert sizes[-1] > 0.1


@pytest.mark.parametrize("limits", [None, LIMITS], ids=["", "within"])
def test_sensitivities_are_finite_differences(tied, limits):
    found = copsense.solve_equilibrium(tied, CRITERION, limits)
    if limits:
        assert [limit.weak for limit in found.active] == [False] * len(found.active) != []
    Z = tied.admissible_motions
    rates, _ = found.derivative(Z)
    for v, rate in zip(Z.T[::5], rates.T[::5], strict=True):
        h, forces = 2e-3, []
        for k in (-2, -1, 1, 2):
            there = copsense.posture.retract(tied, k * h * v)
            forces.append(copsense.solve_equilibrium(there, CRITERION, limits).forces)
        moved = (8 * (forces[2] - forces[1]) - (forces[3] - forces[0])) / (12 * h)
        m = len(tied.row_names)
        assert np.abs(moved - rate)[:m].max() < 1e-7 * tied.robot.weight


def test_a_closed_chain_without_motors_hangs_and_sensitivities_are_differences():
    stance = hand_in_hand()
    assert stance.hanging_motions.shape[1] == 5
    assert np.abs(stance.hanging_balance).max() < 1e-10
    copsense.check_sensitivity(stance, CRITERION)


def test_what_cannot_hang_is_named_before_any_limit_is_blamed(tied):
    bent = pin.integrate(
        tied.robot.model, tied.q, 0.3 * tied.hanging_motions[:, 0] / abs(tied.hanging_motions).max()
    )
    off = tied.at(bent)
    for limits in (None, LIMITS, Limits(torque=0.01)):
        with pytest.raises(UnbalancedError, match=r"l_elbow lacks .*r_elbow lacks") as error:
            copsense.solve_equilibrium(off, CRITERION, limits)
        lacking = error.value.lacking
        left, right = lacking["l_elbow"], lacking["r_elbow"]
        assert left + RATIO * right == pytest.approx(demand(off, off.q), rel=1e-9)


def test_cassies_leaf_springs_bend_until_clamps_there_would_carry_nothing():
    straight = copsense.load_stance("cassie")
    drives, (x, y, _) = straight.robot.drives, straight.com
    free = copsense.Stance(
        straight.robot.with_drives(replace(drives, couplings=())), straight.q, straight.contacts
    )
    assert free.hanging_motions.shape[1] == 2
    loose = solve_posture(free, com=(x, y, None)).stance
    leaves = {j: loose.robot.joint_position(loose.q, j) for j in drives.springs}
    assert np.degrees(sorted(leaves.values())) == pytest.approx(
        [-2.06, -2.05, -1.36, -1.35], abs=0.01
    )
    clamps = tuple(replace(c, offset=leaves[c.joint]) for c in drives.couplings)
    clamped = copsense.Stance(
        straight.robot.with_drives(replace(drives, couplings=clamps)), loose.q, straight.contacts
    )
    criterion = copsense.minimum_torque(tie_break=copsense.minimum_wrench(1.0))
    held = copsense.solve_equilibrium(clamped, criterion)
    clamp = [abs(v) for name, v in held.loop_forces.items() if name.startswith("coupling")]
    before = copsense.solve_equilibrium(straight, criterion).loop_forces
    assert max(clamp) < 0.02 * max(abs(before[f"coupling of {j}"]) for j in leaves)
    found = copsense.solve_equilibrium(loose, criterion)
    assert found.residual() < 1e-6 * loose.robot.weight
