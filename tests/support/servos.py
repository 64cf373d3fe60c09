"""A robot on position servos in MuJoCo, its feet welded to the ground, or turning on springs."""

import mujoco
import numpy as np
import pinocchio as pin

from support.engines import MujocoRobot

TIME_STEP = 1e-4  # s


class ServoRobot:
    """Joint springs towards a command, and welds (or balls) that hold each contact frame's body."""

    def __init__(self, stance, stiffness, sole=None, damping=0.03):
        """`sole`: stiffness of the feet about x, y and z [Nm/rad]; None for welds. `damping`: s."""
        kind = mujoco.mjtEq.mjEQ_WELD if sole is None else mujoco.mjtEq.mjEQ_CONNECT

        def hold(spec):
            for contact in stance.contacts:
                weld = spec.add_equality(type=kind, objtype=mujoco.mjtObj.mjOBJ_BODY)
                weld.name1, weld.name2 = contact.frame, "world"
                weld.solref[:2] = 2 * TIME_STEP, 1.0
                weld.solimp[:2] = 0.9999, 0.9999

        self.stance, self.sole = stance, sole
        self.engine = MujocoRobot(stance.robot, hold)
        m = self.model = self.engine.model
        m.opt.timestep = TIME_STEP
        m.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        m.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
        m.dof_frictionloss[:] = 0.0
        # Joints of the file that the robot has locked are held too.
        m.jnt_stiffness[1:], m.dof_damping[6:], m.qpos_spring[7:] = 2000.0, 60.0, 0.0
        m.dof_damping[:6] = 100.0  # the base sways on soft soles; at rest this does nothing
        K = np.broadcast_to(np.asarray(stiffness, float), len(stance.robot.joint_names))
        self.joints = [m.joint(name) for name in stance.robot.joint_names]
        for joint, k in zip(self.joints, K, strict=True):
            m.jnt_stiffness[joint.id], m.dof_damping[joint.dofadr[0]] = k, damping * k
        self.bodies = [m.body(contact.frame).id for contact in stance.contacts]

    def settle(self, command, seconds=0.5, where=None, at_rest=True):
        """Command a configuration (nq,), wait, and return share of the first foot and CoM y.

        The welds hold the feet where they are in `where`, default the command.
        """
        m, data = self.model, self.engine.data
        self.engine.move(command if where is None else where)
        for i, body in enumerate(self.bodies):
            # A ball has its point in the foot first, a weld its point in the world.
            point, own = (3, 0) if self.sole is not None else (0, 3)
            m.eq_data[i, point : point + 3] = data.xpos[body]
            m.eq_data[i, own : own + 3] = 0.0
            if self.sole is None:
                mujoco.mju_negQuat(m.eq_data[i, 6:10], data.xquat[body])
        axes = [data.xmat[body].reshape(3, 3).copy() for body in self.bodies]
        for joint, angle in zip(self.joints, command[7:], strict=True):
            m.qpos_spring[joint.qposadr[0]] = angle
        data.qvel[:] = 0.0
        for _ in range(round(seconds / TIME_STEP)):
            if self.sole is not None:
                self._turn_back(axes)
            mujoco.mj_step(m, data)
        assert np.abs(data.qvel).max() < 2e-3 or not at_rest
        mujoco.mj_forward(m, data)
        # What holds the base, by the engine's own terms: the constraints' share of each foot.
        force = np.array([self._vertical(i) for i in range(len(self.bodies))])
        return force[0] / force.sum(), float(self.engine.com[1])

    @property
    def positions(self):
        """Of the joints, in the robot's order [rad, m]."""
        return np.array([self.engine.data.qpos[joint.qposadr[0]] for joint in self.joints])

    def _turn_back(self, axes):
        data = self.engine.data
        for body, before in zip(self.bodies, axes, strict=True):
            turned = data.xmat[body].reshape(3, 3) @ before.T
            speed = np.zeros(6)
            mujoco.mj_objectVelocity(self.model, data, mujoco.mjtObj.mjOBJ_XBODY, body, speed, 0)
            torque = -np.array(self.sole) * pin.log3(turned)
            torque -= 8.0 * speed[:3]  # Nms/rad
            data.xfrc_applied[body, 3:] = torque

    def _vertical(self, foot):
        """Vertical force of one foot's equality rows."""
        data = self.engine.data
        rows = data.efc_id[: data.nefc] == foot
        return data.efc_force[: data.nefc][rows][2]
