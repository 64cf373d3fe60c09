"""MuJoCo and iDynTree beside Pinocchio: one URDF, one configuration, answers in one convention.

Answers are in Pinocchio's: velocity = base linear and angular in the base's axes, then the joints
in the robot's order; frame Jacobians in the frame's axes, linear rows first. Joints that a robot
has locked are locked at zero here too.
"""

import sys
import xml.etree.ElementTree as ET

import mujoco
import numpy as np
import pinocchio as pin
import pytest

if sys.version_info >= (3, 14):
    pytest.importorskip("idyntree", reason="iDynTree has no wheel for this Python yet")
import idyntree.bindings as idyn


def _skeleton(robot):
    """The URDF's links, joints and masses alone: shapes would change or need files."""
    root = ET.fromstring(robot.description.text)
    for link in root.iter("link"):
        for shape in link.findall("visual") + link.findall("collision"):
            link.remove(shape)
    for kind in ("gazebo", "transmission", "sensor", "mujoco"):
        for element in root.findall(kind):
            root.remove(element)
    return root


class MujocoRobot:
    """MuJoCo: the free joint's velocity is linear in world axes, angular in the base's."""

    def __init__(self, robot, prepare=lambda spec: None):
        root = _skeleton(robot)
        options = ET.SubElement(root, "mujoco")
        # Massless links, soles among them, keep their frames only if bodies are not fused.
        ET.SubElement(options, "compiler", fusestatic="false", discardvisual="false")
        spec = mujoco.MjSpec.from_string(ET.tostring(root, encoding="unicode"))
        spec.option.gravity = [0.0, 0.0, -9.81]
        base = spec.worldbody.first_body()
        base.add_freejoint()
        prepare(spec)
        self.robot, self.model = robot, spec.compile()
        assert not self.model.dof_armature.any()
        self.data = mujoco.MjData(self.model)
        joints = [self.model.joint(name) for name in robot.joint_names]
        self.columns = np.concatenate([np.arange(6), [j.dofadr[0] for j in joints]])
        self.positions = [j.qposadr[0] for j in joints]

    def move(self, q):
        x, y, z, w = q[3:7]
        self.data.qpos[:] = 0
        self.data.qpos[:7] = [*q[:3], w, x, y, z]
        self.data.qpos[self.positions] = q[7:]
        self.data.qvel[:] = 0
        mujoco.mj_forward(self.model, self.data)
        rotation = pin.Quaternion(w, x, y, z).matrix()
        self.world = np.eye(len(self.columns))
        self.world[:3, :3] = rotation  # MuJoCo's velocity = world @ Pinocchio's

    @property
    def gravity(self):
        return self.world.T @ self.data.qfrc_bias[self.columns]

    @property
    def mass_matrix(self):
        M = np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, self.data, M)
        return self.world.T @ M[np.ix_(self.columns, self.columns)] @ self.world

    @property
    def com(self):
        return self.data.subtree_com[1].copy()

    def jacobian(self, frame):
        body = self.model.body(frame).id
        linear, angular = np.zeros((2, 3, self.model.nv))
        mujoco.mj_jacBody(self.model, self.data, linear, angular, body)
        axes = self.data.xmat[body].reshape(3, 3).T
        return np.vstack([axes @ linear, axes @ angular])[:, self.columns] @ self.world

    def inverse_dynamics(self, q, motion):
        """M dv/dt + C v + G by mj_inverse, without friction, damping and contacts."""
        self.model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
        self.model.dof_damping[:] = self.model.dof_frictionloss[:] = 0.0
        self.move(q)
        v, turned = motion.velocity, np.array(motion.acceleration)
        # d/dt of linear velocity in world axes: R (a + w x v).
        turned[:3] += np.cross(v[3:6], v[:3])
        self.data.qvel[self.columns], self.data.qacc[self.columns] = (
            self.world @ v,
            self.world @ turned,
        )
        mujoco.mj_inverse(self.model, self.data)
        return self.world.T @ self.data.qfrc_inverse[self.columns]

    def imbalance(self, equilibrium):
        """What an equilibrium in motion leaves of MuJoCo's inverse dynamics (nv,) [N, Nm]."""
        stance = equilibrium.stance
        missing = self.inverse_dynamics(stance.q, stance.motion)
        missing[6:] -= equilibrium.torques
        for contact, wrench in zip(stance.contacts, equilibrium.wrenches, strict=True):
            placement = stance.robot.frame(contact.frame).placement
            on_frame = placement.actInv(contact.on(stance.robot).placement).act(pin.Force(wrench))
            missing -= self.jacobian(contact.frame).T @ on_frame.vector
        return missing


class IdyntreeRobot:
    """iDynTree: "mixed" base velocity, linear and angular in world axes at the base's origin."""

    def __init__(self, robot):
        loader = idyn.ModelLoader()
        # Links keep their frames; every joint of the file is there, locked ones stay at zero.
        assert loader.loadModelFromString(ET.tostring(_skeleton(robot), encoding="unicode"))
        self.robot, self.engine = robot, idyn.KinDynComputations()
        assert self.engine.loadRobotModel(loader.model())
        self.engine.setFrameVelocityRepresentation(idyn.MIXED_REPRESENTATION)
        # The base must be the one Pinocchio takes, the file's root.
        root = robot.model.frames[robot.model.getFrameId("root_joint") + 1].name
        assert self.engine.setFloatingBase(root), root
        model = self.engine.model()
        self.dofs = [
            model.getJoint(model.getJointIndex(n)).getDOFsOffset() for n in robot.joint_names
        ]
        self.columns = np.concatenate([np.arange(6), 6 + np.array(self.dofs)])

    def move(self, q):
        x, y, z, w = q[3:7]
        rotation = pin.Quaternion(w, x, y, z).matrix()
        base = np.eye(4)
        base[:3, :3], base[:3, 3] = rotation, q[:3]
        n = self.engine.model().getNrOfDOFs()
        joints = np.zeros(n)
        joints[self.dofs] = q[7:]
        down = np.array([0.0, 0.0, -9.81])
        assert self.engine.setRobotState(base, joints, np.zeros(6), np.zeros(n), down)
        self.n = n
        self.world = np.eye(len(self.columns))
        self.world[:3, :3] = self.world[3:6, 3:6] = rotation

    @property
    def gravity(self):
        # At zero velocity; generalizedGravityForces can use a base pose that is out of date.
        forces = idyn.FreeFloatingGeneralizedTorques(self.engine.model())
        assert self.engine.generalizedBiasForces(forces)
        bias = np.concatenate([forces.baseWrench().toNumPy(), forces.jointTorques().toNumPy()])
        return self.world.T @ bias[self.columns]

    @property
    def mass_matrix(self):
        M = idyn.MatrixDynSize(self.n + 6, self.n + 6)
        assert self.engine.getFreeFloatingMassMatrix(M)
        M = M.toNumPy()
        return self.world.T @ M[np.ix_(self.columns, self.columns)] @ self.world

    @property
    def com(self):
        return self.engine.getCenterOfMassPosition().toNumPy()

    def jacobian(self, frame):
        J = idyn.MatrixDynSize(6, self.n + 6)
        assert self.engine.getFrameFreeFloatingJacobian(frame, J)
        J = J.toNumPy()
        axes = self.engine.getWorldTransform(frame).getRotation().toNumPy().T
        return np.vstack([axes @ J[:3], axes @ J[3:]])[:, self.columns] @ self.world
