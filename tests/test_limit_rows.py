"""The rows of each limit say what the limit means: pyramids, soles, torsion, the exact cone."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog
from support.raw_qp import generators

import copsense
from copsense.contact import Contact
from copsense.limits import NO_LIMITS, Limits, limit_rows, torque_limits, torque_placeholders

SOLE = copsense.rectangle((-0.06, 0.13), (-0.04, 0.05))
MU = 0.6


@pytest.fixture(scope="module")
def shod(icub):
    """The iCub on feet that have everything that a limit can need."""
    return icub.with_contacts(
        [replace(c, polygon=SOLE, friction=MU, torsional_friction=0.03) for c in icub.contacts]
    )


def rows_of_foot(stance, limits, k=0):
    """Rows (r, 6) and bounds (r,) of one foot."""
    rows = limit_rows(stance, limits)
    mine = np.array(rows.contacts) == k
    return rows.matrix[mine][:, stance.rows[k]], rows.bound[mine]


def allows(A, b, wrench):
    return bool(np.all(A @ np.array(wrench) <= b))


@pytest.mark.parametrize(
    ("limit", "value", "kinds"),
    [
        ("normal_force", 0.0, {"normal force"}),
        ("friction", "contact", {"friction"}),
        ("friction", 0.3, {"friction"}),
        ("cop_margin", 0.0, {"cop"}),
        ("torsion", "contact", {"torsion"}),
        ("torsion", 0.1, {"torsion"}),
    ],
)
def test_each_limit_is_switched_on_alone(shod, limit, value, kinds):
    rows = limit_rows(shod, replace(NO_LIMITS, **{limit: value}))
    assert set(rows.kinds) == kinds
    assert set(rows.contacts) == {0, 1}
    assert np.all(np.isinf(rows.torque))
    assert all(name.startswith(("l_sole: ", "r_sole: ")) for name in rows.names)


@pytest.mark.parametrize("limit", ["normal_force", "friction", "cop_margin", "torsion"])
def test_each_limit_is_switched_off_alone(shod, limit):
    kind = {"normal_force": "normal force", "cop_margin": "cop"}.get(limit, limit)
    everything = {"normal force", "friction", "cop", "torsion"}
    rows = limit_rows(shod, replace(Limits(), **{limit: None}))
    assert set(rows.kinds) == everything - {kind}


def test_no_limits_at_all_is_the_free_equilibrium(shod):
    assert not NO_LIMITS.any
    assert not limit_rows(shod, NO_LIMITS).names
    free = copsense.solve_equilibrium(shod, copsense.minimum_torque())
    same = copsense.solve_equilibrium(shod, copsense.minimum_torque(), NO_LIMITS)
    np.testing.assert_array_equal(free.forces, same.forces)


def test_limits_that_do_not_bind_change_nothing(shod):
    for criterion in (copsense.minimum_torque(), copsense.minimum_wrench(1.0)):
        free = copsense.solve_equilibrium(shod, criterion)
        within = copsense.solve_equilibrium(shod, criterion, Limits(torque="model"))
        assert not within.active
        np.testing.assert_allclose(within.forces, free.forces, atol=1e-10 * shod.robot.weight)
        np.testing.assert_allclose(within.multipliers, free.multipliers, atol=1e-8)


@pytest.mark.parametrize("sides", [3, 4, 5, 8, 33])
def test_pyramid_is_inscribed_in_the_cone(shod, sides):
    A, b = rows_of_foot(shod, replace(NO_LIMITS, friction="contact", friction_sides=sides))
    assert len(A) == sides
    rng = np.random.default_rng(sides)
    f = rng.uniform(-1, 1, (20000, 6))
    f[:, 2] = np.abs(f[:, 2])
    within = np.all(f @ A.T <= b, axis=1)
    slip, hold = np.hypot(f[:, 0], f[:, 1]), MU * f[:, 2]
    assert np.all(slip[within] <= hold[within] + 1e-12)
    assert np.all(within[slip < hold * np.cos(np.pi / sides) - 1e-12])
    # Its edges lie on the cone, the first one along x.
    angles = 2 * np.pi * np.arange(sides) / sides
    edges = np.zeros((sides, 6))
    edges[:, 0], edges[:, 1], edges[:, 2] = MU * np.cos(angles), MU * np.sin(angles), 1.0
    values = edges @ A.T
    assert np.abs(values.max(axis=1)).max() < 1e-12
    assert np.all(np.sum(np.abs(values) < 1e-12, axis=1) == 2)


def test_cop_rows_are_the_sole_less_its_margin(shod):
    rng = np.random.default_rng(0)
    for margin in (0.0, 0.01, 0.04):
        A, b = rows_of_foot(shod, replace(NO_LIMITS, cop_margin=margin))
        for p in rng.uniform(-0.15, 0.15, (500, 2)):
            fz = rng.uniform(0.1, 300)
            wrench = np.array([0, 0, fz, p[1] * fz, -p[0] * fz, 0])
            inside = copsense.polygon.Polygon(SOLE).margin(p).distance >= margin
            assert inside == bool(np.all(A @ wrench <= b))


def test_cop_rows_alone_forbid_pulling(shod):
    # Wrenches with a CoP on the sole but a pulling force are not within the rows.
    A, b = rows_of_foot(shod, replace(NO_LIMITS, cop_margin=0.0))
    assert allows(A, b, [0, 0, 1.0, 0.0, 0.0, 0])
    assert not allows(A, b, [0, 0, -1.0, 0.0, 0.0, 0])


def test_torsion_rows(shod):
    A, b = rows_of_foot(shod, replace(NO_LIMITS, torsion="contact"))
    for mz, fine in ((2.9, True), (-2.9, True), (3.1, False), (-3.1, False)):
        assert allows(A, b, [0, 0, 100.0, 0, 0, mz]) == fine


SOLES = {
    "rectangle": SOLE,
    "triangle": np.array([[-0.1, -0.05], [0.1, -0.04], [0.0, 0.06]]),
    "heptagon": np.array(
        [[-0.1, 0.0], [-0.07, -0.05], [0.05, -0.06], [0.11, -0.02], [0.11, 0.03], [0.0, 0.06],
         [-0.08, 0.04]]
    ),
}  # fmt: skip


def vertex_forces_exist(w, polygon, mu, sides):
    """Whether forces within the pyramid at the sole's vertices make up a wrench."""
    rays = generators(polygon, mu, sides)
    size = np.abs(w).max()
    found = linprog(np.zeros(len(rays)), A_eq=rays.T, b_eq=w / size, bounds=(0, None))
    assert found.status in (0, 2)
    return found.status == 0


@pytest.mark.parametrize("sides", [3, 4, 8])
@pytest.mark.parametrize("sole", SOLES)
def test_wrench_cone_is_what_forces_at_the_vertices_make_up(shod, sole, sides):
    polygon, rng = SOLES[sole], np.random.default_rng(5)
    stance = shod.with_contacts([replace(c, polygon=polygon) for c in shod.contacts])
    limits = replace(NO_LIMITS, torsion="cone", friction="contact", friction_sides=sides)
    A, b = rows_of_foot(stance, limits)
    polygon = stance.contacts[0].polygon
    rays = generators(polygon, MU, sides)
    assert (rays @ A.T - b).max() < 1e-9
    middle = rays.mean(axis=0)
    for _ in range(40):
        # From the middle to a face: vertex forces make up what is just within and no more.
        away = rng.standard_normal(6) * np.abs(rays - middle).max(axis=0)
        with np.errstate(divide="ignore"):
            reach = (b - A @ middle) / (A @ away)
        reach = reach[reach > 0].min()
        assert vertex_forces_exist(middle + 0.999 * reach * away, polygon, MU, sides)
        assert not vertex_forces_exist(middle + 1.001 * reach * away, polygon, MU, sides)


def test_every_face_of_the_wrench_cone_is_needed(shod):
    limits = replace(NO_LIMITS, torsion="cone", friction="contact", friction_sides=4)
    rows = limit_rows(shod, limits)
    A = rows.matrix[
        [k == "wrench cone" and c == 0 for k, c in zip(rows.kinds, rows.contacts, strict=True)]
    ]
    A = A[:, :6]
    rays = generators(SOLE, MU, 4)
    for row in A:
        assert np.linalg.matrix_rank(rays[np.abs(rays @ row) < 1e-12], tol=1e-9) == 5


def caron(w, mu, X, Y):
    """The 16 rows of Caron, Pham, Nakamura (2015), Eqs. (15)-(20), for |x| <= X, |y| <= Y.

    Friction is |f_x| <= mu f_z and |f_y| <= mu f_z, moments are about the middle.
    """
    fx, fy, fz, tx, ty, tz = w
    least = -mu * (X + Y) * fz + abs(Y * fx - mu * tx) + abs(X * fy - mu * ty)
    most = mu * (X + Y) * fz - abs(Y * fx + mu * tx) - abs(X * fy + mu * ty)
    return np.min(
        [
            mu * fz - abs(fx),
            mu * fz - abs(fy),
            Y * fz - abs(tx),
            X * fz - abs(ty),
            tz - least,
            most - tz,
        ]
    )


def test_wrench_cone_of_a_rectangle_is_carons(shod):
    # Theirs has a pyramid with its sides along the sole's; copsense's has its edges along x and
    # y. So the sole is turned by 45 degrees in the contact frame, and its axes are used.
    X, Y, turn = 0.11, 0.05, np.pi / 4
    R = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    sole = copsense.rectangle((-X, X), (-Y, Y)) @ R.T
    stance = shod.with_contacts([replace(c, polygon=sole) for c in shod.contacts])
    limits = Limits(torsion="cone", friction_sides=4)
    A, b = rows_of_foot(stance, limits)
    cone = limit_rows(stance, limits).kinds[: len(A)].count("wrench cone")
    assert cone == 16
    rng, inside = np.random.default_rng(7), 0
    for _ in range(20000):
        w = rng.uniform(-1, 1, 6) * [MU, MU, 0, Y, X, 0.5 * MU * (X + Y)] + [0, 0, 1, 0, 0, 0]
        theirs = caron(w, MU / np.sqrt(2), X, Y)
        turned = np.concatenate([R @ w[:2], w[2:3], R @ w[3:5], w[5:]])
        ours = (b - A @ turned).min()
        if min(abs(theirs), abs(ours)) > 1e-9:
            assert (theirs > 0) == (ours > 0)
            inside += theirs > 0
    assert 200 < inside < 19800


def test_wrench_cone_holds_for_little_friction(shod):
    # 1e-12 looks flat to the hull's algorithm.
    for mu in (1e-3, 1e-6, 1e-12):
        stance = shod.with_contacts([replace(c, friction=mu) for c in shod.contacts])
        A, b = rows_of_foot(stance, replace(NO_LIMITS, torsion="cone", friction="contact"))
        assert allows(A, b, [0, 0, 1, 0, 0, 0])
        assert not allows(A, b, [2 * mu, 0, 1, 0, 0, 0])
        assert not allows(A, b, [0, 0, 1, 0.06, 0, 0])


def test_wrench_cone_includes_friction_and_cop(shod):
    # Whatever the cone allows, the separate rows allow; and it forbids some of what they allow.
    limits = Limits(torsion="cone", friction_sides=4)
    rows = limit_rows(shod, limits)
    mine = np.array(rows.contacts) == 0
    is_cone = np.array(rows.kinds)[mine] == "wrench cone"
    A, b = rows_of_foot(shod, limits)
    rng, stricter = np.random.default_rng(1), 0
    for _ in range(5000):
        w = rng.uniform(-1, 1, 6) * [MU, MU, 0, 0.05, 0.1, 0.05] + [0, 0, 1, 0, 0, 0]
        cone, rest = np.all((A @ w <= b)[is_cone]), np.all((A @ w <= b)[~is_cone])
        assert rest or not cone
        stricter += bool(rest and not cone)
    assert stricter > 50


def test_icubs_placeholders_are_told_by_name(icub):
    names = icub.robot.torque_names
    upper = {n for n in names if n.startswith("torso") or "shoulder" in n or "elbow" in n}
    assert set(torque_placeholders(icub)) == upper
    bound = dict(zip(names, torque_limits(icub, "model"), strict=True))
    assert {n for n, t in bound.items() if np.isinf(t)} == upper
    # Hip pitch 55.5 Nm, and 37 Nm at every other joint of the legs.
    for name in set(names) - upper:
        assert bound[name] == pytest.approx(55.5 if "hip_pitch" in name else 37.0)


def test_torque_limits_by_number_and_by_joint(icub):
    assert np.all(torque_limits(icub, 12.0) == 12.0)
    bound = torque_limits(icub, {"l_knee": 5.0})
    assert bound[icub.robot.torque_names.index("l_knee")] == 5.0
    assert np.sum(np.isfinite(bound)) == 1


def test_point_and_planar_feet_have_the_rows_they_can_have(stance_of):
    solo = limit_rows(stance_of("solo12"), Limits(torsion="cone"))
    assert set(solo.kinds) == {"normal force", "friction"}
    four_bar = stance_of("four_bar")
    feet = [
        replace(c, polygon=np.array([[0, -0.05], [0, 0.02]]), friction=0.5)
        for c in four_bar.contacts
    ]
    rows = limit_rows(four_bar.with_contacts(feet), Limits())
    assert [k for k, c in zip(rows.kinds, rows.contacts, strict=True) if c == 0] == [
        "normal force", "friction", "friction", "cop", "cop",
    ]  # fmt: skip
    A = rows.matrix[:, :3]  # fy, fz, mx
    assert np.all(A @ [0.49, 1.0, 0.019] <= 0)
    for beyond in ([0.51, 1, 0], [-0.51, 1, 0], [0, 1, 0.021], [0, 1, -0.051], [0, -1e-9, 0]):
        assert not np.all(A @ beyond <= 0)


def test_contact_turned_in_its_link_keeps_its_meaning(icub):
    # The same sole in a contact frame turned by 90 degrees about the normal.
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    contacts = [replace(c, polygon=SOLE, friction=MU) for c in icub.contacts]
    turned = [
        Contact(
            c.frame, rotation=c.rotation @ turn, offset=c.offset, friction=MU,
            polygon=np.asarray(c.polygon) @ turn[:2, :2],
        )
        for c in contacts
    ]  # fmt: skip
    at = copsense.solve_posture(icub, com=(0.0, 0.055, None)).stance
    criterion, limits = copsense.minimum_torque(), Limits(friction_sides=4, torsion=0.002)
    one = copsense.solve_equilibrium(at.with_contacts(contacts), criterion, limits)
    other = copsense.solve_equilibrium(at.with_contacts(turned), criterion, limits)
    assert one.active
    np.testing.assert_allclose(
        one.world_wrenches, other.world_wrenches, atol=1e-9 * at.robot.weight
    )


def test_an_explicit_friction_overrides_the_contacts_own(stance_of):
    stance = stance_of("solo12")
    assert {contact.friction for contact in stance.contacts} == {0.7}
    own, same, ice = (
        limit_rows(stance, replace(NO_LIMITS, friction=mu)).matrix for mu in ("contact", 0.7, 0.1)
    )
    np.testing.assert_array_equal(own, same)
    assert not np.allclose(own, ice)
