"""The laws of balance and of the derivatives, on other robots and on uneven ground."""

import numpy as np
import pytest
from support.differences import derivative_errors
from support.grounds import off_centre, on_tilted_planes, with_hand

import copsense

IMBALANCE = 1e-10  # of the weight
RELATIVE = 1e-7

BIPEDS = ("talos", "romeo", "g1", "human", "iCubGenova02", "iCubLisboa01", "iCubNancy01")
QUADRUPEDS = ("solo12", "anymal_c", "go2")
WRENCH, TORQUE = copsense.minimum_wrench(1.0), copsense.minimum_torque()
CRITERIA = {
    "minimum wrench": WRENCH,
    "minimum torque": TORQUE,
    "mixed": copsense.mixed((WRENCH, 1e-2), (TORQUE, 1.0)),
    "inverse inertia": copsense.weighted_torque("inverse inertia"),
    "tangential, then torque": copsense.minimum_tangential(TORQUE),
}
each_criterion = pytest.mark.parametrize("criterion", CRITERIA)


def check_laws(stance, criterion):
    found = copsense.solve_equilibrium(stance, criterion)
    assert found.residual() < IMBALANCE * stance.robot.weight
    errors = derivative_errors(stance, criterion)
    assert max(errors.values()) < RELATIVE, errors


def plane_offsets(stance):
    """Height over its plane and sine of the angle to its normal, largest of all contacts."""
    heights, tilts = [], []
    for contact, place in zip(stance.contacts, stance.placements, strict=True):
        normal = np.array(contact.plane.normal)
        heights.append(abs(normal @ (place.translation - contact.plane.point)))
        tilts.append(np.linalg.norm(np.cross(place.rotation[:, 2], normal)))
    return max(heights), max(tilts)


@each_criterion
@pytest.mark.parametrize("name", BIPEDS + QUADRUPEDS)
def test_balance_and_sensitivity_hold_for_every_robot(stance_of, name, criterion):
    check_laws(off_centre(stance_of(name)), CRITERIA[criterion])


@each_criterion
@pytest.mark.parametrize("name", QUADRUPEDS)
def test_balance_and_sensitivity_hold_for_point_feet_on_tilted_planes(stance_of, name, criterion):
    stance = on_tilted_planes(stance_of(name), tilt=0.3, step=0.05)
    assert max(plane_offsets(stance)) < 1e-10
    normals = np.array([contact.plane.normal for contact in stance.contacts])
    assert np.linalg.matrix_rank(normals, tol=1e-3) == 3
    check_laws(off_centre(stance), CRITERIA[criterion])


@each_criterion
@pytest.mark.parametrize("name", ["icub", "talos", "g1"])
def test_balance_and_sensitivity_hold_for_soles_on_tilted_planes(stance_of, name, criterion):
    stance = on_tilted_planes(stance_of(name), tilt=0.15, step=0.03, seed=2)
    assert max(plane_offsets(stance)) < 1e-10
    check_laws(off_centre(stance), CRITERIA[criterion])


# Without tangential forces a wall cannot be leant on, so that criterion unloads the hand.
@pytest.mark.parametrize("criterion", [name for name in CRITERIA if "tangential" not in name])
@pytest.mark.parametrize("normal", [(-1, 0.2, 0.1), (0, 0, 1)], ids=["wall", "table"])
def test_balance_and_sensitivity_hold_with_a_hand_on_a_wall_or_table(icub, normal, criterion):
    stance = with_hand(off_centre(icub), "l_hand", normal)
    assert stance.jacobian.shape == (15, 29)
    assert stance.rank == 15
    check_laws(stance, CRITERIA[criterion])


def test_a_point_foot_has_its_centre_of_pressure_at_its_origin_for_ever(stance_of):
    found = copsense.cop_sensitivity(off_centre(stance_of("solo12")), TORQUE)
    assert not np.any(found.cop)
    assert not np.any(found.matrix)
    assert np.all(np.isinf(found.com_travel))


def test_a_hand_takes_load_off_the_feet(icub):
    # On a table, pushing up; the feet and the hand together carry the weight.
    stance = with_hand(icub, "l_hand", (0, 0, 1))
    feet = copsense.solve_equilibrium(icub, WRENCH).world_wrenches
    three = copsense.solve_equilibrium(stance, WRENCH).world_wrenches
    assert three[2, 2] > 0
    assert three[:2, 2].sum() < feet[:, 2].sum()
    assert three[:, 2].sum() == pytest.approx(icub.robot.weight, rel=1e-10)
