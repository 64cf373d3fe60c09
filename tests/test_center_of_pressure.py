"""Centres of pressure of contacts and of the whole robot, on level, tilted and several planes."""

import numpy as np
import pytest
from support.grounds import off_centre, on_tilted_planes, with_hand
from support.loads import CRITERIA, criteria

import copsense
from copsense import Plane

RNG_PLANES = 20


def random_planes(seed):
    rng = np.random.default_rng(seed)
    for _ in range(RNG_PLANES):
        point, slope = rng.uniform(-1, 1, 3), rng.uniform(-0.8, 0.8, 2)
        yield Plane(tuple(map(float, point)), (float(slope[0]), float(slope[1]), 1.0))


def test_cop_is_on_the_plane_and_has_no_tipping_moment():
    rng = np.random.default_rng(1)
    for plane in random_planes(2):
        f, m = rng.standard_normal((2, 3))
        p = copsense.cop.center_of_pressure(f, m, plane)
        n = np.array(plane.normal)
        assert n @ (p - plane.point) == pytest.approx(0, abs=1e-12 * np.abs(p).max())
        left = m - np.cross(p, f)  # about p: along the normal alone
        assert np.abs(np.cross(n, left)).max() < 1e-12 * max(1.0, np.abs(np.outer(p, f)).max())


@pytest.mark.parametrize("name", CRITERIA)
def test_total_cop_is_under_the_com_on_level_ground(lateral_path, name):
    for stance in lateral_path.stances[::4]:
        found = copsense.solve_equilibrium(stance, criteria(stance)[name])
        total = copsense.cop.total_center_of_pressure(found)
        np.testing.assert_allclose(total, [*stance.com[:2], 0.0], rtol=0, atol=1e-12)


def test_total_cop_is_where_the_vertical_through_the_com_meets_a_plane(icub):
    # At rest f = m g up and m = c x f, so p = c + f (n.p0 - n.c) / (n.f): on the plane, under c.
    stance = with_hand(on_tilted_planes(icub, tilt=0.15, step=0.03), "l_hand", (-1, 0.2, 0.5))
    found = copsense.solve_equilibrium(stance, copsense.minimum_torque())
    for plane in random_planes(3):
        n = np.array(plane.normal)
        x, y, _ = stance.com
        z = plane.point[2] - (n[0] * (x - plane.point[0]) + n[1] * (y - plane.point[1])) / n[2]
        total = copsense.cop.total_center_of_pressure(found, plane)
        np.testing.assert_allclose(total, [x, y, z], rtol=0, atol=1e-11)
        np.testing.assert_allclose(
            copsense.cop.com_projection(stance, plane), [x, y, z], rtol=0, atol=1e-12
        )


def test_contact_cop_is_where_its_wrench_tips_nothing_in_the_world(icub):
    stance = off_centre(on_tilted_planes(icub, tilt=0.15, step=0.03))
    found = copsense.solve_equilibrium(stance, copsense.minimum_torque())
    cops = copsense.cop.contact_cops(found)
    for place, wrench, cop in zip(stance.placements, found.world_wrenches, cops, strict=True):
        arm = place.rotation @ np.append(cop, 0.0)
        left = place.rotation.T @ (wrench[3:] - np.cross(arm, wrench[:3]))
        np.testing.assert_allclose(left[:2], 0, rtol=0, atol=1e-12 * stance.robot.weight)
        # The general formula on the foot's own plane says the same.
        plane = Plane(tuple(place.translation), tuple(place.rotation[:, 2]))
        moment = wrench[3:] + np.cross(place.translation, wrench[:3])
        np.testing.assert_allclose(
            copsense.cop.center_of_pressure(wrench[:3], moment, plane),
            place.translation + arm,
            rtol=0,
            atol=1e-12,
        )


def test_cop_of_several_forces_is_their_mean_by_load():
    rng = np.random.default_rng(5)
    where = np.column_stack([rng.uniform(-1, 1, (6, 2)), np.zeros(6)])
    forces = np.column_stack([rng.standard_normal((6, 2)), rng.uniform(1, 5, 6)])
    p = copsense.cop.center_of_pressure(forces.sum(0), np.cross(where, forces).sum(0))
    np.testing.assert_allclose(p, forces[:, 2] @ where / forces[:, 2].sum(), rtol=0, atol=1e-14)


def test_a_contact_without_load_has_no_cop(lateral_path):
    stance = lateral_path.stances[0]
    with pytest.raises(copsense.CopsenseError, match="plane"):
        copsense.cop.center_of_pressure([1.0, 0.0, 0.0], [0.0, 0.0, 0.0])
    found = copsense.solve_equilibrium(stance, copsense.minimum_torque())
    forces = found.forces.copy()
    forces[2] = 0.0
    bare = copsense.statics.StaticEquilibrium(
        stance, found.criterion, forces, found.torques, found.multipliers
    )
    assert bare.unloaded == ("l_sole",)
    with pytest.raises(copsense.CopsenseError, match="l_sole"):
        copsense.cop.contact_cops(bare)


def test_the_support_polygon_is_the_hull_of_soles_and_points_on_level_ground(stance_of, icub):
    from copsense.cop import support_polygon

    points = support_polygon(stance_of("solo12"))
    feet = np.array([place.translation[:2] for place in stance_of("solo12").placements])
    assert sorted(map(tuple, points.vertices.round(12))) == sorted(map(tuple, feet.round(12)))
    hull = support_polygon(icub)
    for contact, place in zip(icub.contacts, icub.placements, strict=True):
        corners = np.pad(contact.sole.vertices, ((0, 0), (0, 1))) @ place.rotation.T
        assert (hull.margins((corners + place.translation)[:, :2]) > -1e-9).all()
    assert support_polygon(stance_of("four_bar")) is None
