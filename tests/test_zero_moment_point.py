"""Zero-moment point and foot rotation indicator of motions, against inverse dynamics."""

import numpy as np
import pinocchio as pin
import pytest
from support.grounds import off_centre

import copsense
from copsense import Plane

TILTED = Plane((0.1, 0.0, 0.05), (0.2, -0.1, 1.0))


@pytest.fixture(scope="module")
def posture(icub):
    return off_centre(icub)


def motions(stance, count, seed):
    rng = np.random.default_rng(seed)
    for _ in range(count):
        yield rng.uniform(-1, 1, (2, stance.robot.model.nv))


def base_wrench(model, q, v, a):
    """Force and moment about the world's origin that hold the motion, if all on the base."""
    data = model.createData()
    needed = pin.Force(pin.rnea(model, data, q, v, a)[:6])
    pin.forwardKinematics(model, data, q)
    world = data.oMi[1].act(needed)
    return world.linear, world.angular


@pytest.mark.parametrize("plane", [None, TILTED], ids=["level", "tilted"])
def test_zmp_is_the_cop_of_the_wrench_that_inverse_dynamics_asks_for(posture, plane):
    p = plane or Plane()
    n, p0 = np.array(p.normal), np.array(p.point)
    for v, a in motions(posture, 20, seed=1):
        f, m = base_wrench(posture.robot.model, posture.q, v, a)
        expected = (np.cross(n, m) + (n @ p0) * f) / (n @ f)
        given = copsense.cop.zero_moment_point(posture, v, a, plane)
        np.testing.assert_allclose(given, expected, rtol=0, atol=1e-10)


@pytest.mark.parametrize("plane", [None, TILTED], ids=["level", "tilted"])
def test_zmp_at_rest_is_the_projection_of_the_com(posture, plane):
    still = np.zeros(29)
    np.testing.assert_allclose(
        copsense.cop.zero_moment_point(posture, still, still, plane),
        copsense.cop.com_projection(posture, plane),
        rtol=0,
        atol=1e-12,
    )


def test_zmp_leans_against_the_coms_acceleration(posture):
    # One mass on a stick: x_zmp = x - z a_x / g when the height and the spin stand still.
    a = np.zeros(29)
    a[:3] = pin.XYZQUATToSE3(posture.q[:7]).rotation.T @ [0.5, 0.2, 0.0]  # all of it, sideways
    given = copsense.cop.zero_moment_point(posture, np.zeros(29), a)
    x, y, z = posture.com
    np.testing.assert_allclose(
        given, [x - z * 0.5 / 9.81, y - z * 0.2 / 9.81, 0], rtol=0, atol=1e-12
    )


def foot_at_rest(stance, v, a):
    """The nearest velocity and acceleration that keep the only foot on the ground."""
    J = stance.jacobian
    v = v - np.linalg.pinv(J) @ (J @ v)
    model, data = stance.robot.model, stance.robot.model.createData()
    pin.forwardKinematics(model, data, stance.q, v, np.zeros_like(v))
    frame = model.getFrameId(stance.contacts[0].frame)
    drift = pin.getFrameAcceleration(model, data, frame, pin.LOCAL).vector
    return v, a - np.linalg.pinv(J) @ (J @ a + drift)


def test_fri_is_the_zmp_and_the_cop_while_the_foot_stands(posture):
    single = posture.with_contacts(posture.contacts[:1])
    place = single.placements[0]
    plane = Plane(tuple(place.translation), tuple(place.rotation[:, 2]))
    for v, a in motions(single, 10, seed=2):
        v, a = foot_at_rest(single, v, a)
        fri = copsense.cop.foot_rotation_indicator(single, "l_sole", v, a, plane)
        zmp = copsense.cop.zero_moment_point(single, v, a, plane)
        np.testing.assert_allclose(fri, zmp, rtol=0, atol=1e-10)
        # The foot's wrench by inverse dynamics, and its centre of pressure.
        f, m = base_wrench(single.robot.model, single.q, v, a)
        wrench = place.actInv(pin.Force(f, m))
        cop = [-wrench.angular[1] / wrench.linear[2], wrench.angular[0] / wrench.linear[2], 0]
        np.testing.assert_allclose(place.actInv(fri), cop, rtol=0, atol=1e-10)


def test_fri_of_a_turning_foot_leaves_out_its_inertia_but_not_its_weight(posture):
    # Goswami 1999: the rest of the robot by a model whose foot weighs nothing, plus the weight.
    single = posture.with_contacts(posture.contacts[:1])
    model = posture.robot.model.copy()
    foot = posture.robot.frame("l_sole").parentJoint
    inertia = model.inertias[foot].copy()
    model.inertias[foot] = pin.Inertia.Zero()
    data = model.createData()
    pin.forwardKinematics(model, data, posture.q)
    where, weight = data.oMi[foot].act(inertia.lever), np.array([0, 0, 9.81 * inertia.mass])
    apart = []
    for v, a in motions(single, 10, seed=3):
        f, m = base_wrench(model, posture.q, v, a)
        f, m = f + weight, m + np.cross(where, weight)
        given = copsense.cop.foot_rotation_indicator(single, "l_sole", v, a)
        expected = np.array([-m[1], m[0], 0]) / f[2]
        np.testing.assert_allclose(given, expected, rtol=0, atol=1e-10)
        apart.append(np.abs(given - copsense.cop.zero_moment_point(single, v, a)).max())
    assert max(apart) > 1e-5


def test_fri_of_a_foot_at_rest_on_two_feet_is_its_own_cop(posture):
    found = copsense.solve_equilibrium(posture, copsense.minimum_torque())
    still, cops = np.zeros(29), copsense.cop.contact_cops(found)
    for k, name in enumerate(posture.contact_names):
        fri = copsense.cop.foot_rotation_indicator(
            posture, name, still, still, other_wrenches=found.wrenches
        )
        np.testing.assert_allclose(
            fri, posture.placements[k].act(np.append(cops[k], 0.0)), rtol=0, atol=1e-11
        )
