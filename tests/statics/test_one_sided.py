"""Derivatives with limits active, and to either side of where one begins to press."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from support import differences
from support.one_sided import FORWARD, both_sides, lateral, with_vertex
from support.random_cases import random_stance

import copsense
from copsense.cop import contact_cops
from copsense.errors import InfeasibleError
from copsense.limits import NO_LIMITS, Limits

D, KAPPA = 0.14, 0.75  # the four-bar preset: rod [m], and the CoM's height over the legs'
COP_ONLY = replace(NO_LIMITS, cop_margin=0.0)
HALF = 0.03  # m, from a four-bar foot's middle to its edges


@pytest.fixture(scope="module")
def four_bar(stance_of):
    """The four-bar with feet that end HALF to either side."""
    return with_edges(stance_of("four_bar"), (-HALF, HALF), (-HALF, HALF))


def with_edges(stance, left, right):
    ends = (left, right)
    return stance.with_contacts(
        [
            replace(c, polygon=np.array([[0.0, low], [0.0, high]]))
            for c, (low, high) in zip(stance.contacts, ends, strict=True)
        ]
    )


def family(alpha):
    """The criterion whose load transfer carries alpha of the CoM's moment (theory, section 5)."""
    weights = {"l_hip": 1 - alpha, "r_hip": 1 - alpha, "l_ankle": alpha, "r_ankle": alpha}
    return copsense.weighted_torque(weights)


def cop_y(criterion, limits):
    def value(stance):
        return contact_cops(copsense.solve_equilibrium(stance, criterion, limits))[:, 1]

    return value


def compare(stance, y, criterion, limits, tolerance=1e-6):
    """CoP slopes before and after y, checked against one-sided differences."""
    here, tangent = lateral(stance, y, stance.q)
    found = copsense.cop_sensitivity(here, criterion, limits)
    slopes = [found.one_sided(tangent, side=s)[:, 1] for s in (-1, 1)]
    for exact, numeric in zip(slopes, both_sides(stance, y, cop_y(criterion, limits)), strict=True):
        np.testing.assert_allclose(exact, numeric, rtol=tolerance, atol=tolerance)
    # Counting the coordinate the other way swaps and turns the sides.
    turned = [found.one_sided(tangent, side=s, rate=-1.0)[:, 1] for s in (-1, 1)]
    np.testing.assert_allclose(turned, [-slopes[1], -slopes[0]], rtol=1e-12, atol=1e-12)
    return found.equilibrium, slopes


@pytest.mark.parametrize("alpha", [0.1, 0.3, 0.5, 0.8])
def test_four_bars_cop_stops_at_its_edge_as_the_closed_form_says(four_bar, alpha):
    # The foot that unloads meets its edge first, at (1-alpha) d u = a (d - 2 alpha u).
    u = HALF * D / ((1 - alpha) * D + 2 * alpha * HALF)
    equilibrium, (before, after) = compare(four_bar, -u, family(alpha), COP_ONLY)
    # The path goes towards +y, back to the middle: the edge is touched from its far side.
    moving = (1 - alpha) * D**2 / (D - 2 * alpha * u) ** 2
    assert before[0] == pytest.approx(0.0, abs=1e-10)
    assert after[0] == pytest.approx(moving, rel=1e-8)
    assert after[1] == pytest.approx((1 - alpha) * D**2 / (D + 2 * alpha * u) ** 2, rel=1e-8)
    (touched,) = equilibrium.active
    assert touched.weak
    assert touched.name == "l_sole: CoP at the -y (right) edge"
    np.testing.assert_allclose(contact_cops(equilibrium)[0, 1], -HALF, atol=1e-12)


def test_saturated_cop_stands_still_while_the_other_foot_takes_over(four_bar):
    u = 0.045
    equilibrium, (before, after) = compare(four_bar, -u, family(0.5), COP_ONLY)
    np.testing.assert_allclose(before, after, rtol=1e-9)
    assert abs(before[0]) < 1e-12
    assert abs(before[1]) > 0.1
    assert [limit.weak for limit in equilibrium.active] == [False]


@pytest.mark.parametrize("joint", ["l_hip", "l_ankle", "r_hip", "r_ankle"])
def test_four_bars_torque_limit_just_met(four_bar, joint):
    y, criterion = -0.02, family(0.4)
    here, _ = lateral(four_bar, y, four_bar.q)
    free = copsense.solve_equilibrium(here, criterion)
    limit = abs(free.torques[list(here.robot.torque_names).index(joint)])
    limits = replace(NO_LIMITS, torque={joint: float(limit)})
    equilibrium, (before, after) = compare(four_bar, y, criterion, limits)
    (touched,) = equilibrium.active
    assert touched.weak
    assert touched.name == f"torque of {joint}"
    assert not np.allclose(before, after, rtol=1e-2)


def test_several_limits_met_at_once(four_bar):
    y, criterion = -0.02, family(0.4)
    here, _ = lateral(four_bar, y, four_bar.q)
    free = copsense.solve_equilibrium(here, criterion)
    torque = dict(zip(here.robot.torque_names, np.abs(free.torques), strict=True))
    edge = float(-contact_cops(free)[0, 1])
    stance = with_edges(four_bar, (-edge, edge), (-HALF, HALF))
    names = ("l_ankle", "r_hip")
    limits = replace(COP_ONLY, torque={name: float(torque[name]) for name in names})
    equilibrium, _ = compare(stance, y, criterion, limits)
    assert len(equilibrium.active) == 3
    assert all(limit.weak for limit in equilibrium.active)


def test_both_feet_on_their_edges_in_the_middle(stance_of):
    stance = with_edges(stance_of("four_bar"), (0.0, HALF), (-HALF, 0.0))
    equilibrium, (before, after) = compare(stance, 0.0, family(0.3), COP_ONLY)
    assert sorted(limit.name for limit in equilibrium.active) == [
        "l_sole: CoP at the -y (right) edge",
        "r_sole: CoP at the +y (left) edge",
    ]
    assert abs(before[0]) < 1e-10  # going towards -y the left foot's CoP is held,
    assert abs(after[1]) < 1e-10  # towards +y the right foot's
    np.testing.assert_allclose(before[1], after[0], rtol=1e-8)  # mirrored


def test_zero_friction_presses_more_rows_than_there_are_directions(icub):
    # 8 rows a foot for two directions: dependent, and most of them touch without pressing.
    smooth = icub.with_contacts([replace(c, friction=0.0) for c in icub.contacts])
    limits = replace(NO_LIMITS, friction="contact")
    _, (before, after) = compare(smooth, 0.01, copsense.minimum_torque(), limits)
    np.testing.assert_allclose(before, after, rtol=1e-9)
    here, tangent = lateral(smooth, 0.01)
    rates = copsense.solve_equilibrium(here, copsense.minimum_torque(), limits).rates(tangent)
    tangential = here.unstack(rates.forces)[:, :2]
    assert np.abs(tangential).max() < 1e-9 * np.abs(rates.forces).max()


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize(
    ("criterion", "printed"),
    [(copsense.minimum_wrench(1.0), 0.0384), (copsense.minimum_torque(), 0.0459)],
    ids=["wrench", "torque"],
)
def test_icubs_first_activation(icub, criterion, printed, side):
    def margin(y):
        at, _ = lateral(icub, y, icub.q)
        found = copsense.solve_equilibrium(at, criterion)
        return min(
            copsense.polygon.Polygon(c.polygon).margin(p).distance
            for c, p in zip(at.contacts, contact_cops(found), strict=True)
        )

    y = brentq(margin, 0.02 * side, 0.06 * side, xtol=1e-15, rtol=1e-15)
    assert abs(y) == pytest.approx(printed, abs=1.5e-4)
    equilibrium, (before, after) = compare(icub, y, criterion, COP_ONLY, 3e-6)
    (touched,) = equilibrium.active
    assert touched.weak
    # Unloaded and loaded foot; outwards is towards `side`.
    inner, outer = (before, after) if side > 0 else (after, before)
    np.testing.assert_allclose(
        inner, cop_slopes(icub, y, criterion), rtol=1e-8
    )  # still free on this side
    foot = icub.contact_names.index(touched.name.split(":")[0])
    jump = np.abs(outer - inner)
    assert jump[foot] > 0.3 * abs(inner[foot])


def cop_slopes(stance, y, criterion):
    here, tangent = lateral(stance, y, stance.q)
    return copsense.cop_sensitivity(here, criterion).along(tangent)[:, 1]


@pytest.mark.parametrize("side", [-1, 1])
def test_icubs_cop_held_by_one_edge_slides_along_it(icub, side):
    # The hull of its sole's mesh has edges there that are 1e-7 to 1e-6 rad apart.
    com = np.add(icub.com, [-0.025, -0.054, -0.01])
    slides_along(icub, com, Limits(), side, step=1e-4)


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("out", [2e-7, 2e-6])
def test_cop_slides_along_one_of_two_edges_nearly_in_line(icub, out, side):
    # The vertex between them is 20 um from the centre of pressure.
    com, limits = np.add(icub.com, [0.0, 0.05, 0.0]), Limits()
    plain = with_vertex(icub, 0.0, 0.0)
    at = copsense.solve_posture(plain, com=tuple(com), reference=icub.q).stance
    cop = contact_cops(copsense.solve_equilibrium(at, copsense.minimum_torque(), limits))
    stance = with_vertex(icub, cop[1, 0] + 2e-5, out)
    assert len(stance.contacts[1].polygon) == (4 if out < 1e-6 else 5)
    slides_along(stance, com, limits, side, step=1e-6)


def slides_along(stance, com, limits, side, step):
    """Compare slopes over CoM x with differences where one edge of a foot presses, alone."""
    criterion = copsense.minimum_torque()
    found = copsense.solve_posture(stance, com=tuple(com), reference=stance.q)
    here = copsense.cop_sensitivity(found.stance, criterion, limits)
    (pressing,) = here.equilibrium.active
    assert not pressing.weak
    assert pressing.kind == "cop"
    slope = here.one_sided(found.tangents[:, 0], side=side)
    at = [
        contact_cops(
            copsense.solve_equilibrium(
                copsense.solve_posture(
                    found.stance,
                    com=tuple(np.add(com, [side * k * step, 0.0, 0.0])),
                    reference=stance.q,
                ).stance,
                criterion,
                limits,
            )
        )
        for k in range(5)
    ]
    numeric = side * np.tensordot(FORWARD, at, axes=1) / step
    np.testing.assert_allclose(slope, numeric, rtol=0, atol=1e-6 + 1e-12 / step)
    foot = stance.contact_names.index(pressing.name.split(":")[0])
    assert abs(slope[foot, 0]) > 0.3


def test_saturated_cop_has_no_slope_along_the_edges_normal(icub):
    for criterion in (copsense.minimum_torque(), copsense.minimum_wrench(1.0)):
        for y in (-0.06, 0.06):
            here, _ = lateral(icub, y, icub.q)
            found = copsense.cop_sensitivity(here, criterion, COP_ONLY)
            pressing = [a.name for a in found.equilibrium.active if not a.weak]
            assert pressing
            held = 0
            for k, contact in enumerate(here.contacts):
                margin = copsense.polygon.Polygon(contact.polygon).margin(found.cop[k])
                if margin.distance < 1e-10:
                    assert np.abs(margin.normal @ found.matrix[k]).max() < 1e-9
                    held += 1
            assert held


def tightened(stance, criterion, kind, share=0.8):
    """The stance on contacts, and limits of one kind, that leave a share of what is used."""
    free = copsense.solve_equilibrium(stance, criterion)
    w, contacts = np.abs(free.wrenches), stance.contacts
    slip = np.hypot(w[:, 0], w[:, 1]) / w[:, 2]
    if kind == "friction":
        contacts = [replace(c, friction=share * r) for c, r in zip(contacts, slip, strict=True)]
        return stance.with_contacts(contacts), replace(NO_LIMITS, friction="contact")
    if kind == "torsion":
        twist = share * float((w[:, 5] / w[:, 2]).max())
        contacts = [replace(c, torsional_friction=twist) for c in contacts]
        return stance.with_contacts(contacts), replace(NO_LIMITS, torsion="contact")
    if kind == "cop":
        # Sideways only: how far the feet's CoPs lie forward is not a matter of sharing.
        sizes = np.abs(contact_cops(free)[:, 1]) * share
        contacts = [
            replace(c, polygon=copsense.rectangle((-0.2, 0.2), (-y, y)))
            for c, y in zip(contacts, sizes, strict=True)
        ]
        return stance.with_contacts(contacts), COP_ONLY
    if kind == "wrench cone":
        sole = copsense.rectangle((-0.06, 0.06), (-0.03, 0.03))
        contacts = [
            replace(c, polygon=sole, friction=r) for c, r in zip(contacts, slip, strict=True)
        ]
        return stance.with_contacts(contacts), replace(
            NO_LIMITS, friction="contact", torsion="cone", friction_sides=4
        )
    if kind == "torque":
        names, torques = stance.robot.torque_names, np.abs(free.torques)
        moved = np.argsort(-torques * (np.abs(stance.jacobian[:, -len(names) :]).max(axis=0) > 0))
        limits = {names[i]: share * float(torques[i]) for i in moved[:2]}
        return stance, replace(NO_LIMITS, torque=limits)
    least = float(0.9 * w[:, 2].min() + 0.1 * w[:, 2].mean())
    return stance, replace(NO_LIMITS, normal_force=least)


EVERY_KIND = ("cop", "friction", "normal force", "torque", "torsion", "wrench cone")
FORCES_ONLY = ("friction", "normal force", "torque")


@pytest.mark.parametrize(
    ("robot", "kind"),
    [(robot, kind) for robot in ("icub", "talos") for kind in EVERY_KIND]
    + [(robot, kind) for robot in ("solo12", "four_bar") for kind in FORCES_ONLY],
)
def test_derivative_with_frozen_rows_along_every_motion(stance_of, robot, kind):
    rng = np.random.default_rng(8)
    criteria = [copsense.minimum_torque(), copsense.minimum_wrench(0.3)]
    if robot == "icub":
        criteria.append(copsense.weighted_torque("inverse inertia"))
    for attempt in range(12):
        criterion = criteria[attempt % len(criteria)]
        stance = random_stance(stance_of(robot), rng, turn=0.05, shift=0.02)
        stance, limits = tightened(stance, criterion, kind)
        try:
            found = copsense.solve_equilibrium(stance, criterion, limits)
            if found.active and frozen_rows_agree(stance, criterion, limits, found):
                return
        except (InfeasibleError, RowsChangedError):
            continue
    pytest.fail("no posture whose active rows stay the same nearby")


class RowsChangedError(Exception):
    """A row came or went between a posture and its neighbours."""


def frozen_rows_agree(stance, criterion, limits, found):
    """Compare every derivative with central differences; nothing to compare if a row is weak."""
    if any(a.weak for a in found.active):
        return False
    pressing = {a.name for a in found.active}

    def numbers(at):
        moved = copsense.solve_equilibrium(at, criterion, limits)
        if {a.name for a in moved.active} != pressing:
            raise RowsChangedError
        return np.concatenate([moved.forces, moved.torques])

    Z = stance.admissible_motions
    numeric = differences.along(stance, numbers, Z, step=2e-4)
    df, dtau = found.derivative(Z)
    exact = np.vstack([df, dtau])
    scale = np.abs(exact).max()
    assert np.abs(exact - numeric).max() < 1e-7 * scale
    # Away from weak rows both one-sided derivatives are this one.
    for sign in (1.0, -1.0):
        rates = found.rates(sign * Z[:, 0])
        np.testing.assert_allclose(rates.forces, sign * df[:, 0], atol=1e-8 * scale)
        np.testing.assert_allclose(rates.torques, sign * dtau[:, 0], atol=1e-8 * scale)
    return True
