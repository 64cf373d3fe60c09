"""Statics beside MuJoCo: what its bias and Jacobians leave unbalanced."""

import mujoco
import numpy as np

from copsense import Drives
from copsense.simulation.mujoco_model import build_model
from copsense.simulation.physics_settings import PhysicsSettings
from support.statics_apart import frame_at


def missing_forces(case, found):
    """MuJoCo's bias less contacts, loops, couplings, loads, springs and motors (nv,).

    Args:
        case: a stance of a robot with a free base and joints of one number.
        found: its equilibrium.
    """
    robot = case.robot
    plain = type(case)(robot.with_drives(Drives()), case.q, case.contacts)
    model = build_model(mujoco, plain, PhysicsSettings(), sensors=False)
    data = mujoco.MjData(model)
    x, y, z, w = case.q[3:7]
    data.qpos[:7] = [*case.q[:3], w, x, y, z]
    for joint in robot.joint_names:
        data.joint(joint).qpos[0] = robot.joint_position(case.q, joint)
    mujoco.mj_forward(model, data)
    missing = np.array(data.qfrc_bias)

    def push(joint, point, force, moment):
        linear, angular = np.zeros((2, 3, model.nv))
        body = 1 if joint == 1 else model.body(f"body {robot.model.names[joint]}").id
        mujoco.mj_jac(model, data, linear, angular, point, body)
        missing[:] -= linear.T @ force + angular.T @ moment

    for contact, place, wrench in zip(
        case.contacts, case.placements, found.world_wrenches, strict=True
    ):
        joint = robot.frame(contact.frame).parentJoint
        push(joint, place.translation, wrench[:3], wrench[3:])
    for load, wrench in zip(case.loads, case.applied.wrenches if case.loads else (), strict=True):
        place = frame_at(robot, case.q, load.frame, load.point)
        push(robot.frame(load.frame).parentJoint, place.translation, wrench[:3], wrench[3:])
    lam = list(found.loop_forces.values())
    for loop in robot.drives.loops:
        along = np.array(loop.axis) / np.linalg.norm(loop.axis)
        for sign in (-0.05, 0.05) if loop.kind == "pin" else (0.0,):
            point = frame_at(robot, case.q, loop.frame_b, loop.offset_b + sign * along)
            force, lam = point.rotation @ np.array(lam[:3]), lam[3:]
            for frame, factor in ((loop.frame_a, 1.0), (loop.frame_b, -1.0)):
                joint = robot.frame(frame).parentJoint
                push(joint, point.translation, factor * force, np.zeros(3))
    dofs = {joint: int(model.joint(joint).dofadr[0]) for joint in robot.joint_names}
    for coupling, torque in zip(robot.drives.couplings, lam, strict=True):
        missing[dofs[coupling.joint]] -= torque
        missing[dofs[coupling.of]] += coupling.ratio * torque
    for joint, spring in robot.drives.springs.items():
        now = robot.joint_position(case.q, joint)
        missing[dofs[joint]] += spring.stiffness * (now - spring.rest)
    for joint, torque in robot.drives.held.items():
        missing[dofs[joint]] -= torque
    for joint, torque in zip(robot.dof_names, found.joint_torques, strict=True):
        missing[dofs[joint]] -= torque
    return missing
