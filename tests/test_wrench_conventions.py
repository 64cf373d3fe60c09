"""What the glossary says of other packages' wrenches, held against these packages."""

import numpy as np
import pinocchio as pin
import pytest

MASSES = {"trunk": 5.0, "foot": 1.0}
STANDING = """
<mujoco>
  <worldbody>
    <geom name="floor" type="plane" size="2 2 .1"/>
    <body name="trunk" pos="0 0 .351"><freejoint/><geom type="box" size=".1 .1 .1" mass="5"/>
      <body name="foot" pos="0.02 0 -.3"><site name="ankle" pos="0 0 .05"/>
        <geom name="foot" type="box" size=".15 .08 .05" mass="1"/></body></body>
  </worldbody>
  <sensor><force site="ankle"/><torque site="ankle"/></sensor>
</mujoco>
"""


@pytest.fixture(scope="module")
def standing():
    mujoco = pytest.importorskip("mujoco", reason="mujoco is not installed")
    model = mujoco.MjModel.from_xml_string(STANDING)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 2000)
    mujoco.mj_rnePostConstraint(model, data)
    return mujoco, model, data


def test_mujoco_gives_a_contacts_force_on_its_second_geom_the_normal_first(standing):
    mujoco, model, data = standing
    total, force = 0.0, np.zeros(6)
    for index in range(data.ncon):
        contact = data.contact[index]
        assert [model.geom(geom).name for geom in contact.geom] == ["floor", "foot"]
        np.testing.assert_allclose(contact.frame[:3], [0, 0, 1], atol=1e-6)  # first to second
        mujoco.mj_contactForce(model, data, index, force)
        total += force[0]
    assert total == pytest.approx(6 * 9.81, rel=1e-3)


def test_mujocos_external_force_has_the_moment_first_about_the_trees_centre(standing):
    _, model, data = standing
    moment, force = np.split(data.cfrc_ext[model.body("foot").id], 2)
    np.testing.assert_allclose(force, [0, 0, 6 * 9.81], atol=0.05)
    np.testing.assert_allclose(moment, 0, atol=0.05)  # the ground's force goes through the CoM


def test_mujocos_force_sensor_says_what_the_parent_does(standing):
    _, _, data = standing
    np.testing.assert_allclose(data.sensordata[:3], [0, 0, -5 * 9.81], atol=0.05)


def test_pinocchio_has_the_force_first_in_the_links_axes():
    force, moment = np.array([1.0, 2, 3]), np.array([4.0, 5, 6])
    np.testing.assert_array_equal(pin.Force(force, moment).vector, [*force, *moment])
    model = pin.Model()
    joint = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "base")
    q = np.array([0, 0, 1, 0, 0, np.sin(0.3), np.cos(0.3)])
    external = pin.StdVec_Force()
    external.extend([pin.Force.Zero(), pin.Force(force, moment)])
    torque = pin.rnea(model, model.createData(), q, np.zeros(6), np.zeros(6), external)
    assert joint == 1
    np.testing.assert_allclose(torque, [-1, -2, -3, -4, -5, -6])  # the base's axes, on the link


def test_idyntree_has_the_force_first():
    bindings = pytest.importorskip("idyntree.bindings", reason="idyntree is not installed")
    wrench = bindings.Wrench.FromPython([1.0, 2, 3, 4, 5, 6])
    shift = bindings.Transform(bindings.Rotation.Identity(), bindings.Position(0, 0, 1.0))
    at_the_shift = np.ravel((shift * wrench).toNumPy())  # about a point 1 m below
    np.testing.assert_allclose(at_the_shift, [1, 2, 3, 4 - 2, 5 + 1, 6])  # m + r x f
