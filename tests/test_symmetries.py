"""Mass, mirror, world and contact frames: what changes with them, and what must not."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from support.grounds import off_centre
from support.models import FLIP, base_pose, mirrored, scaled, stance_with, take_apart

import copsense

EXACT = 1e-9
WRENCH, TORQUE = copsense.minimum_wrench(0.7), copsense.minimum_torque()
CRITERIA = {
    "minimum wrench": WRENCH,
    "minimum torque": TORQUE,
    "inverse inertia": copsense.weighted_torque("inverse inertia"),
    "tangential, then torque": copsense.minimum_tangential(TORQUE),
    "mixed": copsense.mixed((WRENCH, 0.1), (TORQUE, 1.0)),
}
each_criterion = pytest.mark.parametrize("criterion", CRITERIA)


@pytest.fixture(scope="module")
def posture(lateral_path):
    return off_centre(lateral_path.stances[10])


def same(given, expected):
    np.testing.assert_allclose(given, expected, rtol=0, atol=EXACT * np.abs(expected).max())


def turn(angle):
    return pin.rpy.rpyToMatrix(0.0, 0.0, angle)


@each_criterion
def test_mass_scales_wrenches_and_torques_and_moves_no_cop(posture, criterion):
    factor = 3.7
    bodies = scaled(take_apart(posture.robot.model), factor)
    heavy = stance_with(posture, bodies, base_pose(posture))
    light = copsense.cop_sensitivity(posture, CRITERIA[criterion])
    found = copsense.cop_sensitivity(heavy, CRITERIA[criterion])
    assert heavy.robot.weight == pytest.approx(factor * posture.robot.weight, rel=1e-12)
    same(found.equilibrium.wrenches, factor * light.equilibrium.wrenches)
    same(found.equilibrium.torques, factor * light.equilibrium.torques)
    for what in ("cop", "gradient", "com_gain", "load_gain", "com_travel", "worst_case_gain"):
        same(getattr(found, what), getattr(light, what))


@each_criterion
def test_mirror_image_has_mirrored_results(posture, criterion):
    found = copsense.cop_sensitivity(posture, CRITERIA[criterion])
    image = copsense.cop_sensitivity(mirrored(posture), CRITERIA[criterion])
    side = np.array([1.0, -1.0])
    # A moment is perpendicular to a plane in which it turns: it mirrors with the other sign.
    wrench = np.concatenate([np.diag(FLIP), -np.diag(FLIP)])
    velocity = np.concatenate([wrench, np.ones(23)])
    same(image.equilibrium.wrenches, found.equilibrium.wrenches * wrench)
    same(image.equilibrium.torques, found.equilibrium.torques)
    same(image.cop, found.cop * side)
    same(image.gradient, found.gradient * side[:, None] * velocity)
    same(image.com_gain, found.com_gain * side[:, None] * side)
    same(image.load_gain, found.load_gain * side)
    same(image.com_travel, found.com_travel)


def test_icub_is_symmetric_to_a_tenth_of_a_per_cent(lateral_path):
    # Its links' masses are not quite: this is the model's asymmetry, far over rounding.
    shares = []
    for stance in (lateral_path.stances[2], lateral_path.stances[-3]):
        found = copsense.solve_equilibrium(stance, TORQUE)
        shares.append(found.wrenches[:, 2] / stance.robot.weight)
    assert 1e-6 < np.abs(shares[0] - shares[1][::-1]).max() < 1e-3


@each_criterion
@pytest.mark.parametrize("name", ["icub", "solo12"])
def test_world_may_turn_about_the_vertical_and_shift(stance_of, name, criterion):
    stance = off_centre(stance_of(name))
    move = pin.SE3(turn(1.1), np.array([0.7, -2.0, 0.4]))
    q = stance.q.copy()
    q[:7] = pin.SE3ToXYZQUAT(move * base_pose(stance))
    here = copsense.cop_sensitivity(stance, CRITERIA[criterion])
    there = copsense.cop_sensitivity(stance.at(q), CRITERIA[criterion])
    R = move.rotation
    world = here.equilibrium.world_wrenches.reshape(-1, 2, 3) @ R.T
    same(there.equilibrium.world_wrenches, world.reshape(-1, 6))
    same(there.equilibrium.torques, here.equilibrium.torques)
    same(there.load_gain, here.load_gain @ R[:2, :2].T)
    if name == "icub":  # soles take their axes with them; CoM x and y are the world's
        same(there.equilibrium.wrenches, here.equilibrium.wrenches)
        same(there.cop, here.cop)
        same(there.gradient, here.gradient)
        same(there.com_gain, here.com_gain @ R[:2, :2].T)
        same(there.com_travel, here.com_travel)


def world_cops(found):
    """Centres of pressure and gains in world axes."""
    placements = found.equilibrium.stance.placements
    cops = [
        place.act(np.append(cop, 0.0)) for place, cop in zip(placements, found.cop, strict=True)
    ]
    gains = [p.rotation[:2, :2] @ g for p, g in zip(placements, found.com_gain, strict=True)]
    return np.array(cops), np.array(gains)


@each_criterion
def test_yaw_of_contact_frames_leaves_cops_where_they_are_in_the_world(posture, criterion):
    turned = [
        replace(c, rotation=c.rotation @ turn(angle), polygon=c.polygon @ turn(angle)[:2, :2])
        for c, angle in zip(posture.contacts, (0.5, -2.0), strict=True)
    ]
    found = copsense.cop_sensitivity(posture, CRITERIA[criterion])
    other = copsense.cop_sensitivity(posture.with_contacts(turned), CRITERIA[criterion])
    for given, expected in zip(world_cops(other), world_cops(found), strict=True):
        same(given, expected)
    same(other.equilibrium.torques, found.equilibrium.torques)
    same(other.load_gain, found.load_gain)
    same(other.com_travel, found.com_travel)


def test_minimum_torque_does_not_care_where_on_the_sole_the_frame_is(posture):
    # The minimum wrench does: its moments are about the frames' origins.
    moved = [
        replace(c, offset=offset, polygon=c.polygon - np.array(offset)[:2])
        for c, offset in zip(posture.contacts, [(0.05, 0.01, 0), (-0.03, 0.02, 0)], strict=True)
    ]
    found = copsense.cop_sensitivity(posture, TORQUE)
    other = copsense.cop_sensitivity(posture.with_contacts(moved), TORQUE)
    for given, expected in zip(world_cops(other), world_cops(found), strict=True):
        same(given, expected)
    same(other.com_travel, found.com_travel)
    wrenches = [
        copsense.cop_sensitivity(posture.with_contacts(contacts), WRENCH)
        for contacts in (posture.contacts, moved)
    ]
    assert np.abs(np.subtract(*[world_cops(w)[0] for w in wrenches])).max() > 1e-4
