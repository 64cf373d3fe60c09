"""Configurations, postures and paths that cannot be: an error, or a row with its reason."""

import numpy as np
import pinocchio as pin
import pytest
from support.tiny import urdf

import copsense
from copsense.errors import InvalidInputError, UnknownNameError, UnreachablePostureError


def changed(q, index, value):
    q = np.array(q)
    q[index] = value
    return q


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_configuration_that_is_not_finite_says_where(icub, value):
    with pytest.raises(InvalidInputError, match="not finite at index 9"):
        icub.at(changed(icub.q, 9, value))


@pytest.mark.parametrize("size", [0, 29, 31])
def test_a_configuration_of_the_wrong_size_says_what_it_holds(icub, size):
    with pytest.raises(InvalidInputError, match=r"\(30,\): base position, quaternion .* 23 joints"):
        icub.at(np.zeros(size))


@pytest.mark.parametrize("scale", [0.0, 0.5, 2.0])
def test_an_unnormalised_quaternion_is_not_fixed_in_silence(icub, scale):
    with pytest.raises(InvalidInputError, match=r"unit length.*x, y, z, w"):
        icub.at(changed(icub.q, slice(3, 7), scale * icub.q[3:7]))


@pytest.mark.parametrize("q", ["home", [[1.0], [1.0, 2.0]], [None] * 30])
def test_a_configuration_that_is_no_numbers_says_so(icub, q):
    with pytest.raises(InvalidInputError, match=r"not an array of numbers|not finite"):
        icub.robot.check_configuration(q)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_joint_position_that_is_not_finite_names_the_joint(icub, value):
    with pytest.raises(InvalidInputError, match="joint 'l_knee' is"):
        icub.robot.configuration({"l_knee": value})
    with pytest.raises(InvalidInputError, match="joint 'l_knee' is"):
        copsense.solve_posture(icub, joints={"l_knee": value})


def test_an_unknown_joint_lists_the_valid_ones_wherever_it_is_named(icub):
    asked = [
        lambda: icub.robot.configuration({"l_nee": 0.1}),
        lambda: copsense.solve_posture(icub, joints={"l_nee": 0.1}),
        lambda: copsense.joint_sweep(icub, "l_nee", 0.0, 0.1, 2),
        lambda: icub.robot.velocity_index("l_nee"),
    ]
    for ask in asked:
        with pytest.raises(UnknownNameError, match=r"'l_nee'.*Did you mean l_knee.*torso_yaw"):
            ask()


def test_a_joint_of_several_freedoms_or_none_has_no_angle():
    model = pin.Model()
    base = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "root_joint")
    model.appendBodyToJoint(base, pin.Inertia.Random(), pin.SE3.Identity())
    ball = model.addJoint(base, pin.JointModelSpherical(), pin.SE3.Identity(), "ball")
    model.appendBodyToJoint(ball, pin.Inertia.Random(), pin.SE3.Identity())
    robot = copsense.Robot.from_model(model)
    with pytest.raises(InvalidInputError, match=r"3 degrees of freedom.*revolute or prismatic"):
        robot.configuration({"ball": 0.1})
    fixed = urdf().replace('type="revolute"', 'type="fixed"', 1)
    with pytest.raises(UnknownNameError, match=r"'left_hip'.*Valid: right_hip"):
        copsense.Robot.from_urdf(fixed).velocity_index("left_hip")


def test_a_posture_out_of_reach_says_what_remains(icub):
    with pytest.raises(UnreachablePostureError, match=r"CoM y = 0\.5 m.*remains .*Ask for less"):
        copsense.solve_posture(icub, com=(None, 0.5, None))
    with pytest.raises(UnreachablePostureError, match=r"CoM z = 2 m.*remains"):
        copsense.solve_posture(icub, com=(None, None, 2.0))


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_com_that_is_not_finite_says_which_coordinate(icub, value):
    with pytest.raises(InvalidInputError, match=r"the CoM's y \[m\] is"):
        copsense.solve_posture(icub, com=(None, value, None))


def test_a_com_has_three_entries(icub):
    with pytest.raises(InvalidInputError, match=r"2 entries\. Give x, y and z"):
        copsense.solve_posture(icub, com=(0.0, 0.0))


def test_targets_are_finite_and_one_for_each_contact(icub):
    with pytest.raises(InvalidInputError, match=r"1 target for 2 contacts\. Give one each"):
        copsense.solve_posture(icub, targets=icub.placements[:1])
    nowhere = pin.SE3(np.eye(3), np.array([np.nan, 0.0, 0.0]))
    with pytest.raises(InvalidInputError, match="the target of contact 'r_sole' is not finite"):
        copsense.solve_posture(icub, targets=[icub.placements[0], nowhere])


@pytest.mark.parametrize("weight", [0.0, -1.0, np.nan])
def test_posture_weights_are_positive(weight):
    with pytest.raises(InvalidInputError, match="the posture weight free"):
        copsense.posture.PostureCost(free=weight)


def test_a_displacement_off_the_manifold_s_reach_is_an_error_not_a_guess(icub):
    with pytest.raises(UnreachablePostureError, match="remains"):
        copsense.posture.retract(icub, 10 * np.ones(29))
    with pytest.raises(InvalidInputError, match="the displacement is not finite"):
        copsense.posture.retract(icub, np.full(29, np.nan))
    with pytest.raises(InvalidInputError, match="the displacement has shape"):
        copsense.posture.retract(icub, np.ones(3))


@pytest.mark.parametrize(
    ("ends", "said"),
    [
        ((np.nan, 0.0, 3), "a sweep's start is nan"),
        ((0.0, np.inf, 3), "a sweep's stop is inf"),
        ((0.0, 1.0, 0), "a sweep of 0 postures"),
        ((0.0, 1.0, -3), "a sweep of -3 postures"),
        ((0.0, 1.0, 10**15), "Give a count from 1 to 1000000"),
    ],
)
def test_the_ends_and_the_count_of_a_sweep_are_checked_first(icub, ends, said):
    for ask in (copsense.lateral_sweep, lambda *a: copsense.joint_sweep(a[0], "l_knee", *a[1:])):
        with pytest.raises(InvalidInputError) as caught:
            ask(icub, *ends)
        assert said in str(caught.value)


def test_a_com_x_that_is_not_finite_is_not_a_sweep_of_failures(icub):
    with pytest.raises(InvalidInputError, match="com_x"):
        copsense.lateral_sweep(icub, 0.0, 0.01, 2, com_x=np.nan)


def test_a_posture_out_of_reach_is_a_row_with_its_reason_and_no_numbers(icub):
    path = copsense.lateral_sweep(icub, 0.0, 5.0, 2)
    dataset = copsense.sweep(path, [copsense.minimum_torque()])
    assert [(i, name) for i, name, _ in dataset.failed_rows] == [(1, "minimum-torque")]
    assert "CoM y = 5 m" in dataset.failed_rows[0][2]
    lost, kept = dataset.isel(posture=1), dataset.isel(posture=0)
    for name, variable in lost.data_vars.items():
        if "posture" in dataset[name].dims and variable.dtype.kind == "f":
            assert np.all(np.isnan(variable)), name
            assert not np.any(np.isnan(kept[name])), name
    assert float(lost["com_y"]) == 5.0


def test_a_sweep_that_fails_everywhere_is_still_a_dataset(icub):
    dataset = copsense.sweep(copsense.lateral_sweep(icub, 5.0, 6.0, 2), [copsense.minimum_torque()])
    assert len(dataset.failed_rows) == 2


def test_a_list_of_configurations_is_checked_one_by_one(icub):
    with pytest.raises(InvalidInputError, match=r"is empty\. Give at least one"):
        copsense.path_through(icub, [])
    moved = pin.integrate(icub.robot.model, icub.q, np.full(29, 0.01))
    with pytest.raises(InvalidInputError, match=r"configuration 1 has a contact .*project=True"):
        copsense.path_through(icub, [icub.q, moved])
    with pytest.raises(InvalidInputError, match="not finite"):
        copsense.path_through(icub, [changed(icub.q, 9, np.nan)])


@pytest.mark.parametrize(
    "name", ["com", "cop", "contact", "posture", "velocity", "a/b", "é ü", "."]
)
def test_a_joint_of_any_name_can_be_swept_and_stored(name, tmp_path):
    robot = copsense.Robot.from_urdf(urdf().replace('"left_hip"', f'"{name}"'))
    stance = copsense.load_stance(robot, contacts=["left", "right"], contact_at="sole")
    path = copsense.joint_sweep(stance, name, 0.0, 0.0, 2)
    dataset = copsense.sweep(path, [copsense.minimum_wrench(1.0)])
    for suffix in (".nc", ".csv"):
        dataset.save(tmp_path / f"swept{suffix}")
    back = copsense.Sweep.load(tmp_path / "swept.nc")
    assert list(back["contact"].values) == ["left", "right"]
    assert back["com"].dims == ("posture", "com_axis")
    np.testing.assert_array_equal(back[back.attrs["coordinate"]], path.values)
    header = (tmp_path / "swept.csv").read_text("utf-8").splitlines()[0].split(",")
    assert len(set(header)) == len(header)
