"""What cannot be: limits that exclude each other, soles without area, numbers that are none."""

from dataclasses import fields, replace

import numpy as np
import pytest

import copsense
from copsense.contact import Contact, Plane
from copsense.cop import contact_cops
from copsense.errors import (
    ContactGeometryError,
    InfeasibleError,
    InvalidInputError,
    UndeterminedWrenchError,
    UnknownNameError,
    UnloadedContactError,
)
from copsense.limits import NO_LIMITS, Limits, limit_rows

TORQUE, WRENCH = copsense.minimum_torque(), copsense.minimum_wrench(1.0)
NAN, INF = float("nan"), float("inf")


def solve(stance, limits, criterion=TORQUE):
    return copsense.solve_equilibrium(stance, criterion, limits)


def on(stance, **changes):
    """The stance with every contact changed."""
    return stance.with_contacts([replace(c, **changes) for c in stance.contacts])


# ---------------------------------------------------------------- limits that exclude each other


def test_more_load_asked_than_the_robot_weighs(icub):
    # Two feet that must carry 0.6 of the weight each: each has to be relaxed by a tenth.
    weight = icub.robot.weight
    with pytest.raises(InfeasibleError, match="normal force") as caught:
        solve(icub, replace(NO_LIMITS, normal_force=0.6 * weight))
    assert caught.value.violation == pytest.approx(0.1 * weight, rel=1e-6)
    assert set(caught.value.demands) == {"l_sole: normal force", "r_sole: normal force"}


def test_slope_steeper_than_its_friction(icub):
    # tan(0.3) = 0.309; the tangential demand of a pyramid with a side across the slope.
    slope = Plane((0, 0, 0), (np.sin(0.3), 0.0, np.cos(0.3)))
    contacts = [replace(c, plane=slope, friction=0.2) for c in icub.contacts]
    stance = copsense.robots.stand(icub.robot, contacts, icub.q)
    with pytest.raises(InfeasibleError) as caught:
        solve(stance, Limits(cop_margin=None))
    assert all("slips" in name for name in caught.value.demands)
    # m g sin spread over two feet against mu cos(pi/8) m g cos: each row is relaxed by half of it.
    least = max(
        np.cos(a) * np.sin(0.3) - 0.2 * np.cos(np.pi / 8) * np.cos(0.3)
        for a in np.pi / 8 * np.arange(1, 16, 2)
    )
    assert caught.value.violation == pytest.approx(0.5 * least * icub.robot.weight, rel=1e-6)
    assert solve(on(stance, friction=0.4), Limits(cop_margin=None)).optimality() < 1e-8


def test_no_friction_on_a_slope(icub, stance_of):
    for stance, tilt in ((icub, 0.05), (stance_of("solo12"), 0.05)):
        slope = Plane((0, 0, 0), (0.0, np.sin(tilt), np.cos(tilt)))
        contacts = [replace(c, plane=slope, friction=0.0) for c in stance.contacts]
        tilted = copsense.robots.stand(stance.robot, contacts, stance.q)
        with pytest.raises(InfeasibleError) as caught:
            solve(tilted, Limits(cop_margin=None))
        assert caught.value.violation > 0
        assert all("slips" in name for name in caught.value.demands)


def test_no_friction_on_slopes_that_lean_on_each_other(icub):
    # A valley: each foot's normal force holds the other's, and nothing has to rub.
    contacts = [
        replace(c, friction=0.0, plane=Plane((0, 0, 0), (0.0, -side * 0.2, 1.0)))
        for c, side in zip(icub.contacts, (1, -1), strict=True)
    ]
    stance = copsense.robots.stand(icub.robot, contacts, icub.q)
    found = solve(stance, Limits(cop_margin=None))
    assert np.abs(found.wrenches[:, :2]).max() < 1e-10 * icub.robot.weight
    assert found.residual() < 1e-9 * icub.robot.weight
    assert found.optimality() < 1e-8


def test_friction_on_flat_ground_may_be_zero(icub):
    found = solve(on(icub, friction=0.0), Limits())
    assert np.abs(found.wrenches[:, :2]).max() < 1e-10 * icub.robot.weight
    assert found.optimality() < 1e-8


def test_com_beyond_the_feet(icub):
    far = copsense.solve_posture(icub, com=(0.0, 0.13, None)).stance
    with pytest.raises(InfeasibleError, match="CoP at edge") as caught:
        solve(far, Limits())
    assert any("cop" in k for k in limit_kinds(far, Limits(), caught.value.demands))
    assert "each would have to be relaxed by" in str(caught.value)


def limit_kinds(stance, limits, names):
    rows = limit_rows(stance, limits)
    return {k for k, n in zip(rows.kinds, rows.names, strict=True) if n in names}


def test_torque_that_gravity_alone_needs(icub):
    # No sharing of the load changes an elbow's torque.
    elbow = icub.robot.torque_names.index("l_elbow")
    needs = abs(copsense.solve_equilibrium(icub, TORQUE).torques[elbow])
    with pytest.raises(InfeasibleError) as caught:
        solve(icub, replace(NO_LIMITS, torque={"l_elbow": 0.4 * float(needs)}))
    assert caught.value.violation == pytest.approx(0.6 * needs, rel=1e-6)
    assert caught.value.demands == ("torque of l_elbow",)


def test_torque_of_zero_is_a_free_joint(icub):
    found = solve(icub, replace(NO_LIMITS, torque={"l_ankle_roll": 0.0, "r_knee": 0.0}))
    names = icub.robot.torque_names
    for joint in ("l_ankle_roll", "r_knee"):
        assert abs(found.torques[names.index(joint)]) < 1e-10
    assert found.optimality() < 1e-8
    # Both signs of a torque of zero are met at once; the derivative stands that.
    Z = icub.admissible_motions
    rates = found.rates(Z[:, 0])
    assert abs(rates.torques[names.index("r_knee")]) < 1e-9


# ------------------------------------------------------------------------------- degenerate soles

LINE = np.array([[-0.05, 0.01], [0.08, 0.02]])


def test_sole_of_two_points_holds_the_cop_on_its_line(icub):
    for criterion in (TORQUE, WRENCH):
        found = solve(on(icub, polygon=LINE), Limits(), criterion)
        along = (LINE[1] - LINE[0]) / np.linalg.norm(LINE[1] - LINE[0])
        for cop in contact_cops(found):
            offset = cop - LINE[0]
            assert abs(along[0] * offset[1] - along[1] * offset[0]) < 1e-10
            assert -1e-12 <= along @ offset <= np.linalg.norm(LINE[1] - LINE[0]) + 1e-12
        assert found.optimality() < 1e-8
        # The CoP moves along the line only.
        gradient = copsense.cop_sensitivity(found.stance, criterion, Limits()).matrix
        assert np.abs(np.einsum("kip,i->kp", gradient, [-along[1], along[0]])).max() < 1e-8
        assert np.abs(gradient).max() > 1e-3


def test_sole_of_two_points_has_a_margin_along_it(icub):
    stance = on(icub, polygon=LINE)
    solve(stance, Limits(cop_margin=0.04))
    # 0.052 m inside its back end the line begins in front of the CoM.
    with pytest.raises(InfeasibleError, match="CoP at the") as caught:
        solve(stance, Limits(cop_margin=0.052))
    assert 0.01 < caught.value.violation < 10  # Nm
    with pytest.raises(InvalidInputError, match=r"innermost one is 0.0652 m"):
        solve(stance, Limits(cop_margin=0.07))


def test_planar_foot_without_room_for_its_margin(stance_of):
    stance = on(stance_of("four_bar"), polygon=np.array([[0, -0.02], [0, 0.03]]))
    solve(stance, replace(NO_LIMITS, cop_margin=0.0249))
    with pytest.raises(InvalidInputError, match=r"'l_sole' has no point 0.026 m inside"):
        solve(stance, replace(NO_LIMITS, cop_margin=0.026))


def test_sole_too_narrow_for_its_margin(icub):
    narrow = on(icub, polygon=copsense.rectangle((-0.1, 0.1), (-0.01, 0.02)))
    solve(narrow, Limits(cop_margin=0.015))  # the middle line is left
    with pytest.raises(InvalidInputError, match=r"innermost one is 0.015 m inside"):
        solve(narrow, Limits(cop_margin=0.016))


@pytest.mark.parametrize("points", [[[0.0, 0.0]], [[0.1, 0.1], [0.1, 0.1]], [[0, NAN], [1, 1]]])
def test_sole_that_is_no_polygon(points):
    with pytest.raises(InvalidInputError, match="polygon"):
        Contact("l_sole", polygon=np.array(points))


@pytest.mark.parametrize(
    ("polygon", "friction", "what"),
    [
        (None, 0.5, "sole of three points"),
        (LINE, 0.5, "sole of three points"),
        (copsense.rectangle((-0.1, 0.1), (-0.1, 0.1)), None, "friction coefficient"),
        (copsense.rectangle((-0.1, 0.1), (-0.1, 0.1)), 0.0, "without friction"),
    ],
)
def test_wrench_cone_needs_a_sole_and_friction(icub, polygon, friction, what):
    stance = on(icub, polygon=polygon, friction=friction)
    with pytest.raises(InvalidInputError, match=what):
        solve(stance, Limits(torsion="cone"))


def test_wrench_cone_of_a_sole_with_too_many_vertices(icub):
    assert len(icub.contacts[0].polygon) > 24
    with pytest.raises(InvalidInputError, match=r"vertices.*rectangle"):
        solve(on(icub, friction=0.5), Limits(torsion="cone"))


# --------------------------------------------------------------------- what no criterion decides


def test_redundant_contact_is_said_to_be_one(icub):
    # Both hands' points on the same forearm are felt alike by every torque beyond it.
    twice = [
        *icub.contacts,
        Contact("l_sole", name="again", offset=(0.02, 0.0, 0.0)),
    ]
    stance = icub.with_contacts(twice)
    assert stance.rank < len(stance.component_index)
    with pytest.raises(UndeterminedWrenchError, match=r"undetermined.*minimum_wrench"):
        solve(stance, Limits(normal_force=0.0, cop_margin=None))
    share = copsense.mixed((TORQUE, 1.0), (WRENCH, 1e-3))
    found = solve(stance, Limits(cop_margin=None), share)
    assert found.optimality() < 1e-8
    assert found.residual() < 1e-9 * icub.robot.weight


def test_policy_with_limits_is_rejected(icub):
    wrenches = copsense.solve_equilibrium(icub, WRENCH).wrenches
    with pytest.raises(InvalidInputError, match="limits apply to a Criterion"):
        solve(icub, Limits(), lambda q: wrenches)


def test_inertia_weight_with_massless_feet_is_rejected(stance_of):
    with pytest.raises(InvalidInputError, match="every joint to move some mass"):
        solve(stance_of("four_bar"), Limits(), copsense.weighted_torque("inverse inertia"))


def test_foot_pressed_to_nothing_has_no_centre_of_pressure(stance_of):
    # The CoM over a foot's far edge: the other one carries nothing.
    stance = on(stance_of("four_bar"), polygon=np.array([[0, -0.02], [0, 0.02]]))
    over = copsense.solve_posture(stance, com=(None, 0.09, None)).stance
    found = solve(over, Limits())
    assert found.unloaded == ("r_sole",)
    with pytest.raises(UnloadedContactError, match="r_sole"):
        copsense.cop_sensitivity(over, TORQUE, Limits())


def test_motion_that_leaves_the_limits_is_said_to_have_no_derivative(stance_of):
    # CoM at the very end of the outer foot: there is nowhere to go on.
    stance = on(stance_of("four_bar"), polygon=np.array([[0, -0.02], [0, 0.02]]))
    limits = replace(NO_LIMITS, cop_margin=0.0, normal_force=0.0)
    posture = copsense.solve_posture(stance, com=(None, 0.09, None))
    found = solve(posture.stance, limits)
    with pytest.raises(InvalidInputError, match="move a little along the path"):
        found.rates(posture.tangents[:, 0])
    found.rates(-posture.tangents[:, 0])  # the way back is open


# ---------------------------------------------------------------------- numbers that limit nothing


@pytest.mark.parametrize("name", ["normal_force", "friction", "cop_margin", "torsion"])
@pytest.mark.parametrize("value", [NAN, -1.0, INF, -INF])
def test_limit_that_is_no_size(name, value):
    with pytest.raises(InvalidInputError, match=name):
        Limits(**{name: value})


@pytest.mark.parametrize("torque", [NAN, -1.0, {"l_knee": -2.0}, {"l_knee": NAN}])
def test_torque_limit_that_is_no_size(torque):
    with pytest.raises(InvalidInputError, match="torque limits"):
        Limits(torque=torque)


@pytest.mark.parametrize("sides", [2, 0, -4])
def test_pyramid_without_sides(sides):
    with pytest.raises(InvalidInputError, match="sides"):
        Limits(friction_sides=sides)


def test_unknown_names(icub):
    # The annotations reject these too while the suite runs: looked at without them.
    for name, value in (
        ("torsion", "Cone"),
        ("friction", "cone"),
        ("cop_margin", "contact"),
        ("torque", "motor"),
    ):
        limits = object.__new__(Limits)
        for field in fields(Limits):
            object.__setattr__(limits, field.name, value if field.name == name else field.default)
        with pytest.raises(UnknownNameError, match=value):
            limits.__post_init__()
    with pytest.raises(UnknownNameError, match="l_knee"):
        solve(icub, Limits(torque={"l_kneee": 10.0}))


@pytest.mark.parametrize("what", ["friction", "torsional_friction"])
@pytest.mark.parametrize("value", [NAN, -0.1, INF])
def test_contact_with_friction_that_is_none(what, value):
    with pytest.raises(InvalidInputError, match=what):
        Contact("l_sole", **{what: value})


def test_stance_off_its_plane_never_reaches_the_solver(icub):
    with pytest.raises(ContactGeometryError):
        icub.with_contacts([replace(c, plane=Plane((0, 0, 0.1))) for c in icub.contacts])
