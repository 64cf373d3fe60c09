"""Statics of a driven robot written apart: one dense system over motors, contacts and loops.

    minimise 1/2 t' W t + 1/2 f' W_f f   subject to   N = S t + J' f + L' lam

Contacts' rows by Pinocchio's Jacobian in world axes, loops' rows by differences of positions.
"""

import numpy as np
import pinocchio as pin

WORLD = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


def frame_at(robot, q, name, point=(0.0, 0.0, 0.0)):
    """World placement of a point of a frame."""
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    return data.oMf[robot.model.getFrameId(name)] * pin.SE3(np.eye(3), np.array(point))


def jacobian_at(robot, q, name, point=(0.0, 0.0, 0.0)):
    """Its Jacobian in world axes, linear then angular."""
    data = robot.model.createData()
    pin.computeJointJacobians(robot.model, data, q)
    pin.updateFramePlacements(robot.model, data)
    index = robot.model.getFrameId(name)
    J = np.array(pin.getFrameJacobian(robot.model, data, index, WORLD))
    arm = data.oMf[index].rotation @ np.array(point)
    J[:3] -= pin.skew(arm) @ J[3:]
    return J


def loop_gaps(robot, q):
    """Gaps of the loops in world axes, two points for a pin, three for a weld; then couplings."""
    gaps = []
    for loop in robot.drives.loops:
        along = np.array(loop.axis) / np.linalg.norm(loop.axis)
        offsets = {"ball": [np.zeros(3)], "pin": [along * 0.05, -along * 0.05]}.get(
            loop.kind, [np.zeros(3), 0.1 * np.eye(3)[0], 0.1 * np.eye(3)[1]]
        )
        for offset in offsets:
            a = frame_at(robot, q, loop.frame_a, loop.offset_a + offset).translation
            b = frame_at(robot, q, loop.frame_b, loop.offset_b + offset).translation
            gaps.append(a - b)
    for c in robot.drives.couplings:
        lead, follow = robot.joint_position(q, c.of), robot.joint_position(q, c.joint)
        gaps.append([follow - c.ratio * lead - c.offset])
    return np.concatenate(gaps) if gaps else np.zeros(0)


def loop_rows(robot, q, step=1e-3):
    """d gaps/dq by fourth-order differences."""
    model, columns = robot.model, []
    for e in np.eye(model.nv):
        g = {s: loop_gaps(robot, pin.integrate(model, q, s * step * e)) for s in (-2, -1, 1, 2)}
        columns.append((8 * (g[1] - g[-1]) - (g[2] - g[-2])) / (12 * step))
    return np.array(columns).T


def motor_map(robot):
    """S (nv, motors), and the motors' names."""
    names, drives = list(robot.velocity_names), robot.drives
    away = {c.joint for c in drives.couplings} | {j for t in drives.transmissions for j in t.joints}
    own = drives.motors if drives.motors is not None else [n for n in names[6:] if n not in away]
    columns = {}
    for joint in own:
        columns[joint] = np.eye(len(names))[names.index(joint)]
    for each in drives.transmissions:
        for k, motor in enumerate(each.motors):
            columns[motor] = np.zeros(len(names))
            for j, joint in enumerate(each.joints):
                columns[motor][names.index(joint)] = each.matrix[j, k]
    return np.array(list(columns.values())).T, list(columns)


def balance(stance):
    """N: gravity less the loads, springs and held torques."""
    robot, q = stance.robot, stance.q
    N = np.array(pin.computeGeneralizedGravity(robot.model, robot.model.createData(), q))
    names = list(robot.velocity_names)
    for joint, spring in robot.drives.springs.items():
        N[names.index(joint)] += spring.stiffness * (robot.joint_position(q, joint) - spring.rest)
    for joint, torque in robot.drives.held.items():
        N[names.index(joint)] -= torque
    for load in stance.loads:
        place = frame_at(robot, q, load.frame, load.point)
        J = jacobian_at(robot, q, load.frame, load.point)
        if hasattr(load, "anchor"):
            force = np.array(load.force) - load.stiffness * (place.translation - load.anchor)
            wrench = np.append(force, np.zeros(3))
        else:
            turn = place.rotation if load.fixed_to == "body" else np.eye(3)
            wrench = np.append(turn @ load.force, turn @ load.moment)
        N -= J.T @ wrench
    return N


def solve_apart(stance, torque_weight, wrench_weight):
    """Contact wrenches in contact axes (nc * 6,) and motor torques by name.

    Args:
        stance: of surface contacts.
        torque_weight: of each motor: a number, or name -> number.
        wrench_weight: six numbers.
    """
    robot, q = stance.robot, stance.q
    S, motors = motor_map(robot)
    rows = []
    for contact in stance.contacts:
        R = frame_at(robot, q, contact.frame).rotation.T
        J = jacobian_at(robot, q, contact.frame)
        rows.append(np.vstack([R @ J[:3], R @ J[3:]]))
    J, L = np.vstack(rows), loop_rows(robot, q).reshape(-1, robot.model.nv)
    # Dependent rows of a loop have rounding instead of a direction: the independent ones do.
    u, s, _ = np.linalg.svd(L, full_matrices=False) if len(L) else (L, np.zeros(0), None)
    L = u[:, s > 1e-6].T @ L
    Wt = np.eye(len(motors)) * torque_weight
    Wf = np.diag(np.tile(np.asarray(wrench_weight, float), len(stance.contacts)))
    k, m, l, nv = len(motors), len(J), len(L), robot.model.nv
    K = np.zeros((k + m + l + nv,) * 2)
    K[:k, :k], K[k : k + m, k : k + m] = Wt, Wf
    K[k + m + l :, : k + m + l] = np.hstack([S, J.T, L.T])
    K[: k + m + l, k + m + l :] = K[k + m + l :, : k + m + l].T
    right = np.concatenate([np.zeros(k + m + l), balance(stance)])
    x = np.linalg.lstsq(K, right, rcond=1e-13)[0]
    assert np.abs(K @ x - right).max() < 1e-8 * max(1.0, np.abs(right).max())
    return x[k : k + m], dict(zip(motors, x[:k], strict=True))
