"""Regions of the centre of mass: contained in each other, exact, and where equilibria end."""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest
import scipy.optimize
from scipy.spatial import ConvexHull
from support.grounds import on_tilted_planes, with_hand

import copsense
from copsense import Plane, rectangle
from copsense.errors import InfeasibleError, InvalidInputError
from copsense.limits import NO_LIMITS, Limits
from copsense.margins import limit_margins
from copsense.regions import (
    BOX,
    FINEST,
    ComRegion,
    balance_at,
    com_region,
    criterion_region,
)

TOLERANCE = 1e-5  # m, of the regions here
STEP = 1e-6  # m: how far from a region's edge a point is put to be surely on one side

SOLE = rectangle((-0.06, 0.10), (-0.04, 0.04))
CRITERIA = {
    "wrench": copsense.minimum_wrench(0.3),
    "torque": copsense.minimum_torque(tie_break=copsense.minimum_wrench(1.0)),
}


def with_soles(stance, *, friction=0.6, polygon=SOLE):
    """The same stance with friction everywhere and this sole under every foot."""
    return stance.with_contacts(
        [
            replace(c, friction=friction, polygon=polygon if c.kind == "surface" else None)
            for c in stance.contacts
        ]
    )


@pytest.fixture(scope="module")
def grounded(stance_of):
    """Stance by name, on the flat or not, and torque limits under which its region shrinks."""
    made = {}

    def make(name):
        if name not in made:
            made[name] = build(name)
        return made[name]

    def build(name):
        if name == "icub":
            return with_soles(stance_of("icub")), 30.0
        if name == "icub with a hand":
            # The hand's point pushes on a wall that leans away: contacts far from coplanar.
            return with_soles(with_hand(stance_of("icub"), "l_hand", (-1.0, 0.2, 0.3))), 30.0
        if name == "talos":
            return with_soles(stance_of("talos")), 40.0
        if name == "talos on slopes":
            flat = with_soles(stance_of("talos"))
            return on_tilted_planes(flat, tilt=0.2, step=0.03, seed=3), 40.0
        if name == "solo12":
            return stance_of("solo12"), 0.9
        return on_tilted_planes(stance_of("solo12"), tilt=0.9, step=0.06, seed=4), 0.9

    return make


GROUNDED = (
    "icub",
    "icub with a hand",
    "talos",
    "talos on slopes",
    "solo12",
    "solo12 on slopes",
)


# --- What the weight does -----------------------------------------------------------------------


def shifted(stance, com):
    """The same posture of a robot whose base link carries its mass elsewhere: CoM over `com`."""
    model = stance.robot.model.copy()
    data = model.createData()
    pin.forwardKinematics(model, data, stance.q)
    step = np.append(np.asarray(com) - stance.com[:2], 0.0) * stance.robot.mass
    body = model.inertias[1]
    lever = body.lever + data.oMi[1].rotation.T @ step / body.mass
    model.inertias[1] = pin.Inertia(body.mass, lever, body.inertia)
    moved = copsense.Stance(copsense.Robot.from_model(model), stance.q, stance.contacts)
    np.testing.assert_allclose(moved.com[:2], com, atol=1e-12)
    return moved


@pytest.mark.parametrize("name", [*GROUNDED, "four_bar"])
def test_gravity_elsewhere_is_that_of_a_load_shifted_on_the_base(grounded, stance_of, name):
    stance = stance_of(name) if name == "four_bar" else grounded(name)[0]
    np.testing.assert_array_equal(balance_at(stance, stance.com[:2]), stance.gravity)
    x = 0.0 if name == "four_bar" else 0.07
    for step in ((x, 0.0), (0.0, -0.03), (x, 0.11)):
        com = stance.com[:2] + step
        np.testing.assert_allclose(
            balance_at(stance, com),
            shifted(stance, com).gravity,
            rtol=0,
            atol=1e-12 * stance.robot.weight,
        )


# --- A linear program of its own: forces at points, sums about the world's origin ---------------


@dataclass
class Raw:
    """Non-negative shares l of pushes, each a force at a point, and what they do.

    The pushes of a contact are the edges of its friction pyramid at the vertices of its sole.
    """

    total: np.ndarray  # (6, l) force and moment about the world's origin
    torques: np.ndarray  # (n, l) -J_j' of each push
    gravity: np.ndarray  # (n,)
    weight: float

    def holds(self, com, limit):
        """Whether pushes balance the weight over `com`, the torques within a limit."""
        up = np.array([0.0, 0.0, self.weight])
        needed = np.concatenate([up, np.cross([*com, 0.0], up)]) / self.weight
        # The least s so that every sum misses the balance by s at most.
        size = self.total.shape[1]
        A = [np.vstack([self.total, -self.total])]
        b = [np.concatenate([needed, -needed])]
        if limit is not None:
            A.append(np.vstack([self.torques, -self.torques]))
            b.append(np.concatenate([limit - self.gravity, limit + self.gravity]) / self.weight)
        give = np.zeros((sum(len(rows) for rows in A), 1))
        give[:12] = -1.0
        found = scipy.optimize.linprog(
            np.append(np.zeros(size), 1.0),
            np.hstack([np.vstack(A), give]),
            np.concatenate(b),
            bounds=(0, None),
            options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
        )
        assert found.status == 0
        return found.fun < 1e-9


def raw_problem(stance, sides=8):
    model, data = stance.robot.model, stance.robot.model.createData()
    zero = np.zeros(model.nv)
    gravity = pin.rnea(model, data, stance.q, zero, zero)[6:]
    pin.computeJointJacobians(model, data, stance.q)
    pin.framesForwardKinematics(model, data, stance.q)
    total, torques = [], []
    for contact in stance.contacts:
        frame = model.getFrameId(contact.frame)
        place = data.oMf[frame] * pin.SE3(np.array(contact.rotation), np.array(contact.offset))
        axes = place.rotation
        if contact.kind == "point":
            z = np.array(contact.plane.normal) if contact.plane else np.array([0.0, 0.0, 1.0])
            first = np.eye(3)[0] if abs(z[0]) < 0.9 else np.eye(3)[1]
            x = np.cross(np.cross(z, first), z)
            axes = np.column_stack([x, np.cross(z, x), z])
            axes /= np.linalg.norm(axes, axis=0)
        jacobian = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
        corners = [[0.0, 0.0]] if contact.kind == "point" else contact.polygon
        for x, y in corners:
            point = place.act(np.array([x, y, 0.0]))
            arm = point - data.oMf[frame].translation
            for angle in 2 * np.pi * np.arange(sides) / sides:
                tangential = contact.friction * np.array([np.cos(angle), np.sin(angle)])
                force = axes @ np.append(tangential, 1.0)
                total.append(np.concatenate([force, np.cross(point, force)]))
                wrench = np.concatenate([force, np.cross(arm, force)])
                torques.append(-jacobian[:, 6:].T @ wrench)
    weight = sum(body.mass for body in model.inertias) * 9.81
    return Raw(np.array(total).T, np.array(torques).T, gravity, weight)


def just_inside(region):
    """Points a step inside each corner."""
    centre = region.polygon.mean(axis=0)
    away = centre - region.polygon
    return region.polygon + STEP * away / np.linalg.norm(away, axis=1, keepdims=True)


def just_outside(region):
    """Points beyond the middle of each edge by the gap and a step."""
    ends = np.roll(region.polygon, -1, axis=0)
    edges = ends - region.polygon
    normals = np.column_stack([edges[:, 1], -edges[:, 0]])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return (region.polygon + ends) / 2 + (region.gap + STEP) * normals


@pytest.mark.parametrize("limited", [False, True], ids=["friction", "torques"])
@pytest.mark.parametrize("name", GROUNDED)
def test_equilibria_exist_just_inside_and_none_just_outside(grounded, name, limited):
    # The wrench cone of a sole is what pushes at its vertices make up.
    stance, limit = grounded(name)
    limit = limit if limited else None
    region = com_region(stance, Limits(torsion="cone", torque=limit), tolerance=TOLERANCE)
    assert region.bounded
    assert region.gap <= TOLERANCE
    assert region.area > 0
    raw = raw_problem(stance)
    for point in just_inside(region):
        assert raw.holds(point, limit)
    for point in just_outside(region):
        assert not raw.holds(point, limit)


@pytest.mark.parametrize("name", ["icub", "solo12 on slopes"])
def test_a_robot_with_its_load_there_has_a_constrained_equilibrium(grounded, name):
    stance, limit = grounded(name)
    limits = Limits(torque=limit)
    region = com_region(stance, limits, tolerance=TOLERANCE)
    criterion = CRITERIA["wrench"]
    for point in just_inside(region):
        copsense.solve_equilibrium(shifted(stance, point), criterion, limits)
    for point in just_outside(region):
        with pytest.raises(InfeasibleError):
            copsense.solve_equilibrium(shifted(stance, point), criterion, limits)


# --- Known regions ------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["icub", "talos", "romeo", "solo12", "anymal_c"])
def test_ample_friction_on_flat_ground_gives_the_support_polygon(stance_of, name):
    preset = stance_of(name)
    stance = preset.with_contacts([replace(c, friction=20.0) for c in preset.contacts])
    region = com_region(stance, Limits(torsion=None), tolerance=1e-6)
    corners = []
    for contact, place in zip(stance.contacts, stance.placements, strict=True):
        sole = np.zeros((1, 2)) if contact.kind == "point" else contact.polygon
        corners += [place.act(np.append(p, 0.0))[:2] for p in sole]
    corners = np.array(corners)
    hull = corners[ConvexHull(corners).vertices]
    assert max(region.margin(p) for p in hull) < 1e-8
    assert min(region.margin(p) for p in hull) > -region.gap - 1e-8
    for point in region.polygon:
        assert np.max(ConvexHull(corners).equations @ np.append(point, 1.0)) < 1e-8


@pytest.mark.parametrize("yaw", [0.0, 0.4])
def test_a_rectangle_has_four_vertices(stance_of, yaw):
    # Two equal soles side by side, also turned about the vertical.
    stance = with_soles(turned(stance_of("talos"), yaw), friction=5.0)
    region = com_region(stance, Limits())
    assert region.polygon.shape == (4, 2)
    assert region.gap < 1e-8
    left, right = (place.translation[:2] for place in stance.placements)
    place = stance.placements[0].rotation[:2, :2]
    width = np.linalg.norm(left - right) + 0.08
    assert region.area == pytest.approx(0.16 * width, abs=1e-8)
    sides = np.roll(region.polygon, -1, axis=0) - region.polygon
    along = np.sort(np.abs(sides @ place), axis=1)
    np.testing.assert_allclose(along[:, 0], 0.0, atol=1e-8)


def test_soles_that_are_points_give_a_segment_and_one_gives_a_point(stance_of):
    line = np.array([[0.0, -0.03], [0.0, 0.03]])
    stance = with_soles(stance_of("talos"), friction=2.0, polygon=line)
    feet = np.array([place.translation[:2] for place in stance.placements])
    for margin, width in ((0.0, 0.03), (0.03, 0.0)):
        region = com_region(stance, Limits(cop_margin=margin))
        assert region.polygon.shape == (2, 2)
        ends = feet + np.sign(feet - feet.mean(axis=0)) * [0.0, width]
        for end in ends:
            assert np.min(np.linalg.norm(region.polygon - end, axis=1)) < 1e-8
        assert region.area == 0.0
        assert region.contains(feet.mean(axis=0))
        assert region.margin(feet.mean(axis=0)) == pytest.approx(0.0, abs=1e-8)
        assert region.margin(feet.mean(axis=0) + np.array([0.02, 0])) == pytest.approx(
            -0.02, abs=1e-8
        )
        own = criterion_region(stance, CRITERIA["wrench"], Limits(cop_margin=margin))
        # The minimum wrench leaves no foot without a moment, but at the centre.
        assert len(own.polygon) == (2 if width else 1)
        assert all(region.margin(p) > -1e-8 for p in own.polygon)
    alone = stance.with_contacts(stance.contacts[:1])
    point = com_region(alone, Limits(cop_margin=0.03))
    assert point.polygon.shape == (1, 2)
    np.testing.assert_allclose(point.polygon[0], feet[0], atol=1e-8)


@pytest.mark.parametrize("sole", [0.02, 0.05])
def test_the_four_bar_has_an_interval_known_in_closed_form(stance_of, sole):
    # theory.md, section 5: SCoP of the rear foot = (1 - alpha) d u / (d - 2 alpha u) = sole.
    d, half = 0.14, np.array([[0.0, -sole], [0.0, sole]])
    preset = stance_of("four_bar")
    stance = preset.with_contacts([replace(c, friction=5.0, polygon=half) for c in preset.contacts])
    region = com_region(stance, Limits())
    assert region.interval
    np.testing.assert_allclose(region.polygon, [[0, -d / 2 - sole], [0, d / 2 + sole]], atol=1e-8)
    assert region.margin([0.0, 0.01]) == pytest.approx(d / 2 + sole - 0.01, abs=1e-8)
    assert region.margin([0.0, -0.5]) == pytest.approx(d / 2 + sole - 0.5, abs=1e-8)
    length = 0.1
    w = length**-2
    for criterion, alpha, moving in (
        (copsense.minimum_wrench(length), w * d**2 / (w * d**2 + 4), False),
        (copsense.minimum_wrench(length), w * d**2 / (w * d**2 + 4), True),
        (copsense.minimum_torque(), 0.5, True),
    ):
        own = criterion_region(stance, criterion, Limits(), moving=moving)
        end = sole * d / ((1 - alpha) * d + 2 * alpha * sole)
        np.testing.assert_allclose(own.polygon, [[0, -end], [0, end]], atol=1e-10)
        assert own.interval


def test_nothing_limited_reaches_the_box(stance_of):
    stance = stance_of("talos")
    for region in (
        com_region(stance, NO_LIMITS),
        criterion_region(stance, CRITERIA["wrench"], NO_LIMITS),
    ):
        assert not region.bounded
        assert region.area == pytest.approx((2 * BOX) ** 2, rel=1e-9)


def test_walls_on_both_sides_leave_a_region_without_end(stance_of):
    # Hands that squeeze as hard as they like carry any moment about the walls' normal.
    stance = stance_of("icub")
    stance = with_hand(stance, "l_hand", (0.0, -1.0, 0.0))
    stance = stance.with_contacts(
        [*stance.contacts[:2], replace(stance.contacts[2], name="left", friction=1.0)]
    )
    stance = with_hand(stance, "r_hand", (0.0, 1.0, 0.0))
    stance = with_soles(stance, friction=1.0)
    assert not com_region(stance, Limits()).bounded
    assert com_region(stance, Limits(torque=30.0)).bounded


# --- The criterion's own region -----------------------------------------------------------------


@pytest.mark.parametrize("criterion", CRITERIA)
@pytest.mark.parametrize("name", GROUNDED)
def test_the_criterion_breaks_a_limit_exactly_where_its_region_ends(grounded, name, criterion):
    stance, limit = grounded(name)
    for torque in (None, 2 * limit):
        limits = Limits(torque=torque)
        region = criterion_region(stance, CRITERIA[criterion], limits)
        assert region.gap <= 2e-8

        def smallest(point, limits=limits):
            there = shifted(stance, point)
            found = copsense.solve_equilibrium(there, CRITERIA[criterion])
            return min(margin.value for margin in limit_margins(found, limits))

        if region.empty:
            # A hand that would pull, a foot that would slip: a limit is broken everywhere.
            assert name in ("icub with a hand", "solo12 on slopes")
            points = stance.com[:2] + 0.3 * np.random.default_rng(0).standard_normal((20, 2))
            assert all(smallest(point) < 0 for point in points)
            continue
        assert region.area > 0
        assert all(smallest(point) > 0 for point in just_inside(region))
        assert all(smallest(point) < 0 for point in just_outside(region))


@pytest.mark.parametrize("criterion", CRITERIA)
def test_a_moving_robot_meets_its_limits_there_to_first_order(grounded, criterion):
    # Along each edge's direction, the margin's slope by finite differences on the manifold.
    stance, _ = grounded("icub")
    limits = Limits()
    region = criterion_region(stance, CRITERIA[criterion], limits, moving=True)
    sensitivity = copsense.cop_sensitivity(stance, CRITERIA[criterion])
    start = copsense.solve_equilibrium(stance, CRITERIA[criterion])
    rows = copsense.limits.limit_rows(stance, limits)
    h = 1e-4
    for corner in region.polygon:
        step = corner - stance.com[:2]
        v = sensitivity.com_motions @ step
        forces = [
            copsense.solve_equilibrium(
                copsense.posture.retract(stance, s * h * v), CRITERIA[criterion]
            )
            for s in (-1, 1)
        ]
        rate = (forces[1].forces - forces[0].forces) / (2 * h)
        slack = rows.bound - rows.matrix @ (start.forces + rate)
        # A corner is where two limits are met, and none is passed.
        slack /= stance.robot.weight
        assert np.sort(slack)[0] > -1e-6
        assert np.sort(slack)[1] < 1e-6


def test_a_policy_has_a_region_only_where_it_moves(grounded):
    stance, _ = grounded("icub")
    criterion = CRITERIA["wrench"]

    def policy(q):
        return copsense.solve_equilibrium(stance.at(q), criterion).wrenches

    with pytest.raises(InvalidInputError, match="moving=True"):
        criterion_region(stance, policy, Limits())
    same = criterion_region(stance, policy, Limits(), moving=True)
    other = criterion_region(stance, criterion, Limits(), moving=True)
    np.testing.assert_allclose(same.polygon, other.polygon, atol=1e-6)


# --- Laws ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", GROUNDED)
def test_regions_are_nested(grounded, name):
    stance, limit = grounded(name)
    for torsion in ("contact", "cone"):
        regions = [
            com_region(stance, Limits(torsion=torsion, torque=torque), tolerance=TOLERANCE)
            for torque in (None, limit, 0.8 * limit)
        ]
        for outer, inner in pairwise(regions):
            assert all(outer.margin(p) > -outer.gap - 1e-8 for p in inner.polygon)
            assert inner.area <= outer.area + 1e-8
        for criterion in CRITERIA.values():
            for outer, torque in zip(regions, (None, limit, 0.8 * limit), strict=True):
                own = criterion_region(stance, criterion, Limits(torsion=torsion, torque=torque))
                assert all(outer.margin(p) > -outer.gap - 1e-8 for p in own.polygon)


def test_a_finer_tolerance_stays_within_the_coarse_gap(grounded):
    stance, limit = grounded("solo12 on slopes")
    fine = com_region(stance, Limits(torque=limit), tolerance=1e-6)
    for tolerance in (1e-2, 1e-3, 1e-4):
        coarse = com_region(stance, Limits(torque=limit), tolerance=tolerance)
        assert coarse.gap <= tolerance
        assert len(coarse.polygon) <= len(fine.polygon)
        assert all(coarse.margin(p) > -coarse.gap - 1e-8 for p in fine.polygon)
        assert all(fine.margin(p) > -fine.gap - 1e-8 for p in coarse.polygon)


def turned(stance, yaw, shift=(0.0, 0.0)):
    """The whole robot turned about the world's vertical, then shifted."""
    q = np.array(stance.q)
    rotation = pin.rpy.rpyToMatrix(0.0, 0.0, yaw)
    q[:3] = rotation @ q[:3] + [*shift, 0.0]
    q[3:7] = pin.Quaternion(rotation @ pin.Quaternion(q[3:7]).matrix()).coeffs()
    return stance.at(q)


def same_polygon(a, b, atol):
    """Whether two polygons are the same, wherever they begin."""
    assert len(a) == len(b)
    first = int(np.argmin(np.linalg.norm(b - a[0], axis=1)))
    np.testing.assert_allclose(np.roll(b, -first, axis=0), a, rtol=0, atol=atol)


def test_regions_turn_with_the_robot(grounded):
    stance, _ = grounded("talos")
    limits = Limits(torque=40.0)
    there = turned(stance, 0.7, (2.0, -1.0))
    R = pin.rpy.rpyToMatrix(0.0, 0.0, 0.7)[:2, :2]
    own = [criterion_region(s, CRITERIA["torque"], limits) for s in (stance, there)]
    same_polygon(own[0].polygon @ R.T + [2.0, -1.0], own[1].polygon, 1e-8)
    both = [com_region(s, limits, tolerance=TOLERANCE) for s in (stance, there)]
    assert all(both[1].margin(R @ p + [2.0, -1.0]) > -both[1].gap - 1e-8 for p in both[0].polygon)
    assert both[1].area == pytest.approx(both[0].area, abs=1e-5)


def test_a_mirrored_ground_mirrors_the_region(stance_of):
    flat = stance_of("solo12")
    slopes = {"FL": (0.2, 0.1), "FR": (-0.1, 0.3), "HL": (0.0, -0.2), "HR": (0.3, 0.0)}

    def standing(mirrored):
        contacts = []
        for contact, place in zip(flat.contacts, flat.placements, strict=True):
            leg = contact.frame[:2]
            sign = -1.0 if mirrored else 1.0
            if mirrored:
                leg = leg[0] + {"L": "R", "R": "L"}[leg[1]]
            x, y = slopes[leg]
            plane = Plane(tuple(place.translation), (x, sign * y, 1.0))
            contacts.append(replace(contact, plane=plane, friction=0.5))
        return flat.with_contacts(contacts)

    limits = Limits(torque=1.0)
    here, there = (com_region(standing(m), limits, tolerance=1e-6) for m in (False, True))
    assert here.area > 0.01
    flipped = here.polygon * [1.0, -1.0]
    # The model's own left and right thighs differ by 3e-5 Nm of its weight's moment.
    assert all(there.margin(p) > -1e-5 for p in flipped)
    assert there.area == pytest.approx(here.area, abs=1e-5)
    loose = Limits(friction=None, torque=1.0)
    own = [criterion_region(standing(m), CRITERIA["torque"], loose) for m in (False, True)]
    assert own[0].area > 0.001
    same_polygon((own[0].polygon * [1.0, -1.0])[::-1], own[1].polygon, 1e-5)


def scaled(stance, mass, length):
    """A robot that is heavier and larger throughout, and what it stands on too."""
    model = stance.robot.model.copy()
    for i in range(model.njoints):
        body = model.inertias[i]
        model.inertias[i] = pin.Inertia(mass * body.mass, length * body.lever, body.inertia)
        place = model.jointPlacements[i]
        model.jointPlacements[i] = pin.SE3(place.rotation, length * place.translation)
    for frame in model.frames:
        frame.placement = pin.SE3(frame.placement.rotation, length * frame.placement.translation)
    q = np.array(stance.q)
    q[:3] *= length
    contacts = [
        replace(
            c,
            offset=tuple(length * np.array(c.offset)),
            polygon=None if c.polygon is None else length * c.polygon,
            plane=c.plane and Plane(tuple(length * np.array(c.plane.point)), c.plane.normal),
        )
        for c in stance.contacts
    ]
    return copsense.Stance(copsense.Robot.from_model(model), q, tuple(contacts))


@pytest.mark.parametrize(("mass", "length"), [(3.0, 1.0), (1.0, 2.0), (0.01, 0.2)])
@pytest.mark.parametrize("name", ["talos", "solo12", "solo12 on slopes"])
def test_regions_scale_with_the_robot(grounded, name, mass, length):
    stance, limit = grounded(name)
    big = scaled(stance, mass, length)
    here = com_region(stance, Limits(torque=limit), tolerance=1e-6)
    there = com_region(big, Limits(torque=limit * mass * length), tolerance=1e-6 * length)
    assert all(there.margin(length * p) > -2e-6 * length for p in here.polygon)
    assert there.area == pytest.approx(length**2 * here.area, rel=1e-4)
    # Neither depends on the unit of length: one weighs torques alone, the other forces at points.
    criterion = CRITERIA["torque" if name == "talos" else "wrench"]
    own = criterion_region(stance, criterion, Limits(torque=2 * limit))
    other = criterion_region(big, criterion, Limits(torque=2 * limit * mass * length))
    assert own.empty == (name == "solo12 on slopes")
    assert own.empty == other.empty
    if own.empty:
        return
    same_polygon(length * own.polygon, other.polygon, 1e-7)


# --- Nothing to find, and bad questions ---------------------------------------------------------


def test_limits_in_conflict_are_named(grounded):
    stance, _ = grounded("icub")
    heavy = Limits(normal_force=0.6 * stance.robot.weight)
    with pytest.raises(InfeasibleError) as caught:
        com_region(stance, heavy)
    assert set(caught.value.demands) >= {"l_sole: normal force", "r_sole: normal force"}
    assert caught.value.violation == pytest.approx(0.1 * stance.robot.weight, rel=1e-6)
    own = criterion_region(stance, CRITERIA["wrench"], heavy)
    assert own.empty
    assert own.area == 0.0
    assert own.margin([0.0, 0.0]) == -np.inf
    assert not own.contains([0.0, 0.0])


def test_a_posture_too_hard_for_an_arm_is_named(grounded):
    stance, _ = grounded("icub")
    limits = Limits(torque={"l_knee": 500.0, "l_elbow": 0.01, "torso_roll": 500.0})
    with pytest.raises(InfeasibleError) as caught:
        com_region(stance, limits)
    assert caught.value.demands == ("torque of l_elbow",)
    # The elbow holds its forearm up, whatever the feet do.
    elbow = stance.robot.torque_names.index("l_elbow")
    needed = abs(stance.gravity[6 + elbow])
    assert caught.value.violation == pytest.approx(needed - 0.01, rel=1e-6)
    assert criterion_region(stance, CRITERIA["wrench"], limits).empty


def test_nothing_stands_on_a_slope_without_friction(stance_of):
    flat = stance_of("solo12")
    contacts = [
        replace(c, friction=0.0, plane=Plane((0.0, 0.0, 0.0), (0.2, 0.0, 1.0)))
        for c in flat.contacts
    ]
    stance = copsense.robots.stand(flat.robot, contacts, flat.q)
    with pytest.raises(InfeasibleError) as caught:
        com_region(stance, Limits())
    assert any("slips" in name for name in caught.value.demands)
    assert criterion_region(stance, CRITERIA["wrench"], Limits()).empty
    # Just over the slope's tangent there is friction enough.
    gripping = [replace(c, friction=0.25) for c in contacts]
    assert com_region(stance.with_contacts(gripping), Limits()).area > 0.05


def test_no_friction_on_flat_ground_does_no_harm(stance_of):
    flat = stance_of("solo12")
    smooth = flat.with_contacts([replace(c, friction=0.0) for c in flat.contacts])
    rough = com_region(flat, Limits())
    same_polygon(com_region(smooth, Limits()).polygon, rough.polygon, 1e-8)


@pytest.mark.parametrize("tolerance", [0.0, -1e-4, np.nan, FINEST / 2])
def test_a_bad_tolerance_is_rejected(grounded, tolerance):
    with pytest.raises(InvalidInputError, match="tolerance"):
        com_region(grounded("solo12")[0], Limits(), tolerance=tolerance)


def test_a_region_owns_its_vertices_and_knows_inside_from_outside():
    corners = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]])
    region = ComRegion(corners, 0.0, True)
    corners[0] = 9.0
    assert region.polygon[0, 0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        region.polygon[0] = 1.0
    assert region.area == 2.0
    assert region.margin([0.5, 0.5]) == pytest.approx(0.5)
    assert region.margin([0.5, 0.9]) == pytest.approx(0.1)
    assert region.margin([3.0, 2.0]) == pytest.approx(-np.sqrt(2))  # from the corner, not an edge
    assert region.contains([2.0, 1.0])
    assert not region.contains([2.0, 1.001])
    with pytest.raises(InvalidInputError, match="the point"):
        region.margin([1.0, 2.0, 3.0])
