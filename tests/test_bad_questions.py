"""Questions about a sensitivity, a centre of pressure or a margin that have no answer."""

import copy
import inspect
import pickle
from dataclasses import replace

import numpy as np
import pytest
from support.tiny import urdf

import copsense
from copsense import errors
from copsense.drives import Coupling
from copsense.errors import InvalidInputError, UnknownNameError, UnloadedContactError
from copsense.freedom import repetition_notes


@pytest.fixture(scope="module")
def sensitivity(icub):
    return copsense.cop_sensitivity(icub, copsense.minimum_torque())


def on_the_left_foot(stance):
    """A policy under which the right foot carries nothing."""

    def policy(q):
        here = stance.at(q)
        wrenches = np.zeros((2, 6))
        wrenches[0] = np.linalg.solve(here.jacobian[:6, :6].T, here.gravity[:6])
        return wrenches

    return policy


def test_an_unloaded_contact_has_no_centre_of_pressure(icub):
    policy = on_the_left_foot(icub)
    equilibrium = copsense.solve_equilibrium(icub, policy)
    assert equilibrium.unloaded == ("r_sole",)
    for ask in (
        lambda: copsense.cop.contact_cops(equilibrium),
        lambda: copsense.cop_sensitivity(icub, policy),
    ):
        with pytest.raises(UnloadedContactError, match=r"on r_sole.*remove the contact") as caught:
            ask()
        assert caught.value.contacts == ("r_sole",)


def test_a_force_along_the_plane_has_no_centre_of_pressure():
    with pytest.raises(UnloadedContactError, match="the plane"):
        copsense.cop.center_of_pressure(np.array([1.0, 0.0, 0.0]), np.zeros(3))


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_what_is_not_finite_has_no_centre_of_pressure(icub, value):
    still, moving = np.zeros(29), np.full(29, value)
    with pytest.raises(InvalidInputError, match="the force is not finite"):
        copsense.cop.center_of_pressure(np.array([0.0, 0.0, value]), np.zeros(3))
    with pytest.raises(InvalidInputError, match="the acceleration is not finite"):
        copsense.cop.zero_moment_point(icub, still, moving)
    with pytest.raises(InvalidInputError, match="other_wrenches is not finite"):
        copsense.cop.foot_rotation_indicator(
            icub, "l_sole", still, still, other_wrenches=np.full((2, 6), value)
        )


def test_a_velocity_has_the_robot_s_size(icub):
    with pytest.raises(InvalidInputError, match=r"the velocity has shape \(3,\).*\(29,\)"):
        copsense.cop.zero_moment_point(icub, np.zeros(3), np.zeros(29))


def test_an_unknown_contact_lists_the_contacts(icub):
    with pytest.raises(UnknownNameError, match=r"'l_soul'.*Did you mean l_sole"):
        copsense.cop.foot_rotation_indicator(icub, "l_soul", np.zeros(29), np.zeros(29))


def test_a_com_has_no_projection_on_a_wall(icub):
    with pytest.raises(InvalidInputError, match="parallel to gravity"):
        copsense.cop.com_projection(icub, copsense.Plane(normal=(1, 0, 0)))


def test_a_tangent_that_moves_a_contact_is_rejected_with_its_projection(icub, sensitivity):
    with pytest.raises(InvalidInputError, match=r"moves a contact\. Project it"):
        sensitivity.along(np.ones(29))
    Z = icub.admissible_motions
    assert np.all(np.isfinite(sensitivity.along(Z @ (Z.T @ np.ones(29)))))
    with pytest.raises(InvalidInputError, match=r"moves a contact\. Project it"):
        sensitivity.equilibrium.derivative(np.ones((29, 1)))


def test_a_tangent_is_finite_and_of_the_robot_s_size(sensitivity):
    for ask in (sensitivity.along, lambda t: sensitivity.along_joint(t, "l_knee")):
        with pytest.raises(InvalidInputError, match="the tangent has shape"):
            ask(np.ones(3))
        with pytest.raises(InvalidInputError, match="the tangent is not finite"):
            ask(np.full(29, np.nan))


@pytest.mark.parametrize("rate", [0.0, 1e-15, np.nan, np.inf])
def test_a_coordinate_that_stands_still_has_no_sensitivity(icub, sensitivity, rate):
    with pytest.raises(InvalidInputError, match=r"rate along the path|does not change"):
        sensitivity.along(icub.admissible_motions[:, 0], rate)


def test_a_joint_that_stands_still_has_no_sensitivity(icub, sensitivity):
    tangent = icub.admissible_motions[:, 0].copy()
    index = icub.robot.velocity_index("torso_yaw")
    others = icub.admissible_motions
    row = others[index]
    tangent = others @ (np.eye(len(row)) - np.outer(row, row) / (row @ row))[:, 0]
    with pytest.raises(InvalidInputError, match="Choose a coordinate that moves"):
        sensitivity.along_joint(tangent, "torso_yaw")


@pytest.mark.parametrize("step", [0.0, -1e-3, np.nan])
def test_the_step_of_differences_is_positive(icub, step):
    for ask in (
        copsense.sensitivity.finite_difference_sensitivity,
        copsense.check_sensitivity,
    ):
        with pytest.raises(InvalidInputError, match="the step of the differences"):
            ask(icub, copsense.minimum_torque(), step=step)


def test_an_audit_cannot_be_passed_by_a_tolerance_that_is_no_number(icub):
    with pytest.raises(InvalidInputError, match="the tolerance is nan"):
        copsense.check_sensitivity(icub, copsense.minimum_torque(), tolerance=np.nan)


def test_an_audit_says_where_and_by_how_much_it_failed(icub):
    said = r"derivative of the .* relative, .* do not decide.* Move the posture"
    with pytest.raises(errors.SensitivityMismatchError, match=said):
        copsense.check_sensitivity(icub, copsense.minimum_torque(), tolerance=0.0)


def test_an_audit_of_a_loop_that_all_but_repeats_the_contacts_takes_a_shorter_step():
    drives = copsense.Drives(couplings=(Coupling("r_hip_yaw", "l_hip_yaw", -1.0),))
    stance = copsense.load_stance("icub", drives=drives)
    assert repetition_notes(stance)
    for criterion in (copsense.minimum_torque(), copsense.minimum_wrench(1.0)):
        copsense.check_sensitivity(stance, criterion)


def test_an_audit_of_a_wrong_derivative_asks_for_a_report(icub, monkeypatch):
    """Differences that agree among themselves, and not with it."""
    exact = copsense.sensitivity.cop_sensitivity

    def wrong(*words):
        found = exact(*words)
        return replace(found, torque_derivative=found.torque_derivative * (1 + 1e-5))

    monkeypatch.setattr("copsense.sensitivity.cop_sensitivity", wrong)
    said = r"derivative of the torque .* 1\.0.e-05 relative.* please report it"
    with pytest.raises(errors.SensitivityMismatchError, match=said):
        copsense.check_sensitivity(icub, copsense.minimum_torque())


def test_a_margin_is_of_a_point_and_a_polygon_in_order(icub):
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    middle = np.array([0.5, 0.5])
    assert copsense.polygon.Polygon(square).margin(middle).distance == pytest.approx(0.5)
    star = np.array([[np.cos(2 * t), np.sin(2 * t)] for t in np.arange(5) * 2 * np.pi / 5])
    dented = np.insert(square, 1, [0.5, 0.1], axis=0)
    for wrong in (square[::-1], np.vstack([square, square[-1:]]), star, dented):
        with pytest.raises(InvalidInputError, match="counter-clockwise"):
            copsense.polygon.Polygon(wrong)
    with pytest.raises(InvalidInputError, match="no edge"):
        copsense.polygon.Polygon(square[:1]).margin(middle)
    with pytest.raises(InvalidInputError, match="the point is not finite"):
        copsense.polygon.Polygon(square).margin(np.array([np.nan, 0.5]))


@pytest.mark.parametrize("thickness", [0.0, -1e-3, np.nan])
def test_the_thickness_of_a_sole_is_positive(icub, thickness):
    with pytest.raises(InvalidInputError, match="the thickness of a sole"):
        copsense.sole.read_sole(icub.robot, icub.contacts[0], thickness=thickness)
    with pytest.raises(UnknownNameError, match="Did you mean l_sole"):
        copsense.sole.read_sole(icub.robot, copsense.Contact("l_soul"))


def test_a_robot_that_cannot_move_has_zero_gain_and_never_tips():
    stance = copsense.load_stance(urdf(), contacts=["left", "right"], contact_at="sole")
    assert stance.admissible_motions.shape[1] == 0
    result = copsense.cop_sensitivity(stance, copsense.minimum_wrench(1.0))
    np.testing.assert_array_equal(result.com_gain, 0.0)
    np.testing.assert_array_equal(result.worst_case_gain, 0.0)
    assert np.all(np.isposinf(result.com_travel))


def test_a_robot_without_joints_stands_and_has_no_torque():
    mass = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    text = f'<robot name="brick"><link name="brick">{mass}</inertial></link></robot>'
    robot = copsense.Robot.from_urdf(text)
    stance = copsense.Stance(robot, robot.configuration(), (copsense.Contact("brick"),))
    equilibrium = copsense.solve_equilibrium(stance, copsense.minimum_torque())
    assert equilibrium.torques.shape == (0,)
    assert equilibrium.wrenches[0, 2] == pytest.approx(9.81)


def test_every_error_is_of_one_family_and_survives_copies():
    family = [
        e for _, e in inspect.getmembers(errors, inspect.isclass) if e.__module__ == errors.__name__
    ]
    assert all(issubclass(e, errors.CopsenseError) for e in family)
    samples = [
        errors.UnknownNameError("joint", "l_nee", ["l_knee"], "Or none."),
        errors.MissingExtraError("icub-models", "icub", "robot 'icub'"),
        errors.UnloadedContactError(("l_sole",)),
        errors.UndeterminedWrenchError("open", ("l_sole fz",)),
        errors.InfeasibleError(3.0, ("l_sole: normal force",)),
        errors.ImpossibleInertiaError("rods", ("link 'rod' (1 kg) has ...",)),
        errors.UnsolvedError(1e-3),
        errors.UnbalancedError("rods", {"forearm": 0.8}),
        errors.UnstablePostureError("rods", ("forearm",), -0.8),
        *(
            e("said")
            for e in family
            if e
            not in {
                errors.UnknownNameError,
                errors.MissingExtraError,
                errors.UnloadedContactError,
                errors.UndeterminedWrenchError,
                errors.ImpossibleInertiaError,
                errors.InfeasibleError,
                errors.UnsolvedError,
                errors.UnbalancedError,
                errors.UnstablePostureError,
            }
        ),
    ]
    assert {type(e) for e in samples} == set(family)
    for error in samples:
        for again in (pickle.loads(pickle.dumps(error)), copy.copy(error)):
            assert (str(again), vars(again)) == (str(error), vars(error))
