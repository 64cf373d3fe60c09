"""Postures: constraints met to rounding, the cost at its least, the tangent exact."""

import numpy as np
import pinocchio as pin
import pytest
from support.differences import largest_error
from support.grounds import off_centre, on_tilted_planes, with_hand

import copsense
from copsense.posture import contact_error
from copsense.posture_system import supporting_joints

MET = 1e-12  # m, rad
COST = copsense.posture.PostureCost(base_rotation=7.0, supporting=2.0, free=11.0)
CENTRE_COST = copsense.posture.PostureCost()


def requests(stance):
    """Name -> what to ask of a posture near a stance."""
    x, y, z = stance.com
    return {
        "com y": {"com": (None, y + 0.02, None)},
        "com": {"com": (x + 0.01, y - 0.03, z - 0.02)},
        "joint": {"joints": {"l_knee": -0.4}},
        "joints and com": {
            "joints": {"torso_roll": 0.1, "r_shoulder_roll": 0.6},
            "com": (x, y + 0.01, None),
        },
    }


def constraint_errors(posture, stance, request):
    """Errors of contacts, CoM and joints, from placements and angles read afresh."""
    here = posture.stance
    errors = [contact_error(here, stance.placements)]
    errors += [
        [here.com[i] - wanted]
        for i, wanted in enumerate(request.get("com", ()))
        if wanted is not None
    ]
    errors += [
        [here.robot.joint_position(here.q, joint) - angle]
        for joint, angle in request.get("joints", {}).items()
    ]
    return np.concatenate(errors)


@pytest.mark.parametrize("name", ["com y", "com", "joint", "joints and com"])
def test_constraints_are_met_within_1e_12(icub, name):
    request = requests(icub)[name]
    posture = copsense.solve_posture(icub, **request)
    assert np.abs(constraint_errors(posture, icub, request)).max() < MET


def cost_of(stance, reference, weights):
    """1/2 sum w deviation^2, from logarithms and angles, without the package's derivatives."""
    turn = pin.Quaternion(reference.q[3:7]).matrix().T @ pin.Quaternion(stance.q[3:7]).matrix()
    legs = supporting_joints(stance)[6:] > 0
    joints = (
        np.where(legs, weights.supporting, weights.free) * (stance.q[7:] - reference.q[7:]) ** 2
    )
    return 0.5 * (weights.base_rotation * pin.log3(turn) @ pin.log3(turn) + joints.sum())


@pytest.mark.parametrize("weights", [CENTRE_COST, COST], ids=["default", "other"])
@pytest.mark.parametrize("name", ["com y", "com", "joint", "joints and com"])
def test_no_perturbation_that_meets_the_constraints_lowers_the_cost(icub, name, weights):
    request = requests(icub)[name]
    posture = copsense.solve_posture(icub, cost=weights, **request)
    best = cost_of(posture.stance, icub, weights)
    assert best > 1e-6  # there was something to do
    rng = np.random.default_rng(9)
    for size in (1e-3, 1e-2, 1e-1):
        for _ in range(5):
            other = perturbed(posture.stance, icub, request, size * rng.standard_normal(29))
            assert cost_of(other, icub, weights) > best


def perturbed(stance, start, request, displacement):
    """A nearby stance that meets the same request: Newton on the constraints, any way there."""
    joints = request.get("joints", {})
    axes = [i for i, wanted in enumerate(request.get("com", ())) if wanted is not None]
    q = pin.integrate(stance.robot.model, stance.q, displacement)
    for _ in range(20):
        here = stance.at(q, check=False)
        error = constraint_errors(
            copsense.posture.Posture(here, np.zeros((29, 0)), 0), start, request
        )
        if np.abs(error).max() < 1e-13:
            break
        columns = [here.robot.velocity_index(joint) for joint in joints]
        C = np.vstack([here.jacobian, here.com_jacobian[axes], np.eye(29)[columns]])
        q = pin.integrate(stance.robot.model, q, -np.linalg.pinv(C) @ error)
    assert np.abs(error).max() < 1e-12
    return here


@pytest.mark.parametrize("name", ["com y", "com", "joint", "joints and com"])
def test_tangents_are_the_derivatives_of_the_posture_by_the_request(icub, name):
    request = requests(icub)[name]
    posture = copsense.solve_posture(icub, **request)
    com, joints = list(request.get("com", (None,) * 3)), dict(request.get("joints", {}))
    changes = [("com", i) for i, wanted in enumerate(com) if wanted is not None]
    changes += [("joint", joint) for joint in joints]
    assert posture.tangents.shape == (29, len(changes))
    # In the height the path bends most: at a millimetre the differences still err by 1e-6.
    h, model = 2.5e-4, icub.robot.model
    numeric = []
    for kind, which in changes:
        at = {}
        for k in (-2, -1, 1, 2):
            moved_com, moved_joints = list(com), dict(joints)
            if kind == "com":
                moved_com[which] += k * h
            else:
                moved_joints[which] += k * h
            there = copsense.solve_posture(icub, com=moved_com, joints=moved_joints)
            at[k] = pin.difference(model, posture.stance.q, there.stance.q)
        numeric.append((8 * (at[1] - at[-1]) - (at[2] - at[-2])) / (12 * h))
    assert largest_error(posture.tangents, np.array(numeric).T) < 1e-7
    assert np.abs(posture.stance.jacobian @ posture.tangents).max() < 1e-12


def test_a_stance_is_its_own_nearest_posture(icub):
    # Newton takes a step or so to see it; nothing moves.
    posture = copsense.solve_posture(icub, com=tuple(icub.com), reference=icub.q)
    np.testing.assert_allclose(posture.stance.q, icub.q, rtol=0, atol=1e-12)


def test_feet_go_where_they_are_sent(icub):
    moves = [pin.SE3(np.eye(3), np.array([0.05, 0.02, 0.01])), pin.SE3.Identity()]
    targets = [move * place for move, place in zip(moves, icub.placements, strict=True)]
    moved = copsense.solve_posture(icub, targets=targets).stance
    assert np.abs(contact_error(moved, targets)).max() < MET


def test_out_of_reach_says_what_remains(icub):
    with pytest.raises(copsense.CopsenseError, match=r"CoM y = 0\.5 m.*remains"):
        copsense.solve_posture(icub, com=(None, 0.5, None))


GROUNDS = {
    "level": lambda stance: off_centre(stance),
    "tilted": lambda stance: on_tilted_planes(stance, tilt=0.15, step=0.03),
    "hand": lambda stance: with_hand(off_centre(stance), "l_hand", (-1, 0.2, 0.1)),
}


@pytest.mark.parametrize(
    ("name", "ground"), [("icub", g) for g in GROUNDS] + [("solo12", "level"), ("solo12", "tilted")]
)
def test_retract_keeps_the_contacts_and_is_first_order_exact(stance_of, name, ground):
    stance = GROUNDS[ground](stance_of(name))
    model, Z = stance.robot.model, stance.admissible_motions
    direction = Z @ np.random.default_rng(2).standard_normal(Z.shape[1])
    direction /= np.abs(direction).max()
    left = []
    for t in (4e-3, 2e-3, 1e-3):
        moved = copsense.posture.retract(stance, t * direction)
        assert np.abs(contact_error(moved, stance.placements)).max() < MET
        gone = pin.difference(model, stance.q, moved.q)
        left.append(np.abs(gone - t * direction).max())
    # What is left is of second order: a quarter for half the way.
    assert left[0] < 10 * 4e-3**2
    np.testing.assert_allclose(np.array(left[:-1]) / left[1:], 4.0, rtol=0.05)
    np.testing.assert_allclose(
        copsense.posture.retract(stance, 0 * direction).q, stance.q, rtol=0, atol=1e-13
    )
