"""How a robot is written changes nothing: base link, base frame, order of joints and contacts."""

import numpy as np
import pinocchio as pin
import pytest
from support.grounds import off_centre
from support.models import base_pose, put_together, rerooted, shifted_base, stance_with, take_apart

import copsense

EXACT = 1e-9
TORQUE = copsense.minimum_torque()
# The inverse of the joint-space inertia is left out: which block of M that is depends on the base.
CRITERIA = {
    "minimum wrench": copsense.minimum_wrench(0.7),
    "minimum torque": TORQUE,
    "tangential, then torque": copsense.minimum_tangential(TORQUE),
}
each_criterion = pytest.mark.parametrize("criterion", CRITERIA)


@pytest.fixture(scope="module")
def posture(lateral_path):
    return off_centre(lateral_path.stances[10])


def base_in_the_chest(stance):
    """The base moves along the torso's three joints to the chest; legs now hang on the torso."""
    bodies = take_apart(stance.robot.model)
    for joint in ("torso_pitch", "torso_roll", "torso_yaw"):
        bodies = rerooted(bodies, joint)
    data = stance.robot.model.createData()
    pin.forwardKinematics(stance.robot.model, data, stance.q)
    return stance_with(stance, bodies, data.oMi[stance.robot.model.getJointId("torso_yaw")])


def base_frame_elsewhere(stance):
    shift = pin.SE3(pin.rpy.rpyToMatrix(0.4, -1.1, 2.0), np.array([0.3, -0.1, 0.5]))
    bodies = shifted_base(take_apart(stance.robot.model), shift)
    return stance_with(stance, bodies, base_pose(stance) * shift)


def joints_in_reverse(stance):
    bodies = take_apart(stance.robot.model)
    return stance_with(stance, dict(reversed(bodies.items())), base_pose(stance))


WRITTEN_OTHERWISE = {
    "base in the chest": base_in_the_chest,
    "base frame elsewhere": base_frame_elsewhere,
    "joints in reverse": joints_in_reverse,
}
otherwise = pytest.mark.parametrize("rewrite", WRITTEN_OTHERWISE)


def velocity_map(stance, other):
    """What turns a velocity of the one model into the other's (nv x nv)."""
    names, others = stance.robot.joint_names, other.robot.joint_names
    T = np.zeros((29, 29))
    # The other's base link, wherever it is in this robot: both have l_sole, rigidly on a link.
    T[6:, 6:] = np.array([[a == b for b in names] for a in others])
    J, K = stance.jacobian[:6], other.jacobian[:6]
    T[:6] = np.linalg.solve(K[:, :6], J - K[:, 6:] @ T[6:])
    return T


@otherwise
def test_rewritten_robot_is_the_same(posture, rewrite):
    other = WRITTEN_OTHERWISE[rewrite](posture)
    np.testing.assert_allclose(other.com, posture.com, rtol=0, atol=1e-12)
    for mine, theirs in zip(posture.placements, other.placements, strict=True):
        np.testing.assert_allclose(theirs.homogeneous, mine.homogeneous, rtol=0, atol=1e-12)
    T = velocity_map(posture, other)
    np.testing.assert_allclose(T.T @ other.gravity, posture.gravity, rtol=0, atol=1e-9)
    np.testing.assert_allclose(T.T @ other.mass_matrix @ T, posture.mass_matrix, rtol=0, atol=1e-10)


@otherwise
@each_criterion
def test_results_do_not_depend_on_the_chart(posture, rewrite, criterion):
    other = WRITTEN_OTHERWISE[rewrite](posture)
    mine = copsense.cop_sensitivity(posture, CRITERIA[criterion])
    theirs = copsense.cop_sensitivity(other, CRITERIA[criterion])
    names, others = posture.robot.joint_names, other.robot.joint_names
    order = [others.index(name) for name in names]

    def same(a, b):
        np.testing.assert_allclose(a, b, rtol=EXACT, atol=EXACT * np.abs(b).max())

    same(theirs.equilibrium.wrenches, mine.equilibrium.wrenches)
    same(theirs.equilibrium.torques[order], mine.equilibrium.torques)
    same(theirs.cop, mine.cop)
    same(theirs.com_gain, mine.com_gain)
    same(theirs.load_gain, mine.load_gain)
    same(theirs.com_travel, mine.com_travel)
    same(theirs.worst_case_gain, mine.worst_case_gain)
    # Along any one motion of the robot, whatever its coordinates.
    motions = posture.admissible_motions
    T = velocity_map(posture, other)
    same(theirs.gradient @ (T @ motions), mine.gradient @ motions)


@each_criterion
def test_order_of_contacts_orders_the_results_alone(posture, criterion):
    mine = copsense.cop_sensitivity(posture, CRITERIA[criterion])
    theirs = copsense.cop_sensitivity(
        posture.with_contacts(posture.contacts[::-1]), CRITERIA[criterion]
    )
    for what in ("cop", "gradient", "com_gain", "load_gain", "worst_case_gain", "com_travel"):
        a, b = getattr(theirs, what)[::-1], getattr(mine, what)
        np.testing.assert_allclose(a, b, rtol=0, atol=EXACT * np.abs(b).max(), err_msg=what)
    np.testing.assert_allclose(
        theirs.equilibrium.torques, mine.equilibrium.torques, rtol=0, atol=1e-9
    )


def test_choice_of_tangent_basis_does_not_matter(posture):
    found = copsense.cop_sensitivity(posture, TORQUE)
    mix = np.linalg.qr(np.random.default_rng(8).standard_normal((17, 17)))[0]
    Z = found.basis @ mix
    forces, torques = found.equilibrium.derivative(Z)
    other = copsense.sensitivity.CopSensitivity(
        found.equilibrium, Z, found.cop, found.matrix @ mix, posture.unstack(forces), torques
    )
    # The derivatives along mixed motions are the mixed derivatives ...
    np.testing.assert_allclose(other.wrench_derivative, found.wrench_derivative @ mix, atol=1e-8)
    np.testing.assert_allclose(other.torque_derivative, found.torque_derivative @ mix, atol=1e-8)
    # ... and what is reported without a basis is the same.
    np.testing.assert_allclose(other.com_gain, found.com_gain, rtol=0, atol=EXACT)
    np.testing.assert_allclose(other.worst_case_gain, found.worst_case_gain, rtol=EXACT)


def test_model_taken_apart_and_put_together_is_the_model(icub):
    rebuilt = put_together(take_apart(icub.robot.model), "icub")
    assert rebuilt.joint_names == icub.robot.joint_names
    again = copsense.Stance(rebuilt, icub.q, icub.contacts)
    np.testing.assert_allclose(again.mass_matrix, icub.mass_matrix, rtol=0, atol=1e-12)
