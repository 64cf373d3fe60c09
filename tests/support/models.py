"""The same robot written otherwise: another base, order of joints or mass, or its mirror image.

A model of revolute joints is taken apart into plain bodies, changed, and built again. Joints and
frames keep their names, so that results are compared by name.
"""

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

import copsense

FLIP = np.diag([1.0, -1.0, 1.0])  # the mirror: left becomes right


@dataclass
class Body:
    """A link: the joint that carries it, on which parent, and what hangs on it."""

    joint: str
    parent: str
    placement: pin.SE3
    axis: np.ndarray
    inertia: pin.Inertia
    frames: dict[str, pin.SE3]


BASE = "root_joint"


def take_apart(model):
    """Joint name -> Body, the base first."""
    bodies = {}
    for i in range(1, model.njoints):
        axis = np.zeros(3) if i == 1 else model.joints[i].createData().S[3:].ravel()
        frames = {
            f.name: f.placement
            for f in model.frames
            if f.parentJoint == i and f.type != pin.FrameType.JOINT
        }
        parent = "" if i == 1 else model.names[model.parents[i]]
        bodies[model.names[i]] = Body(
            model.names[i], parent, model.jointPlacements[i], axis, model.inertias[i], frames
        )
    assert all(np.isclose(np.linalg.norm(b.axis), 1) for b in list(bodies.values())[1:])
    return bodies


def put_together(bodies, name):
    """A robot of these bodies, in their order as far as parents come first."""
    model, ids = pin.Model(), {"": 0}
    waiting = list(bodies.values())
    while waiting:
        body = next(b for b in waiting if b.parent in ids)
        waiting.remove(body)
        kind = (
            pin.JointModelRevoluteUnaligned(body.axis) if body.parent else pin.JointModelFreeFlyer()
        )
        ids[body.joint] = model.addJoint(ids[body.parent], kind, body.placement, body.joint)
        model.appendBodyToJoint(ids[body.joint], body.inertia, pin.SE3.Identity())
        for frame, placement in body.frames.items():
            model.addFrame(pin.Frame(frame, ids[body.joint], 0, placement, pin.FrameType.OP_FRAME))
    return copsense.Robot.from_model(model, name=name)


def stance_with(stance, bodies, base, contacts=None):
    """The stance of a changed robot, its joints where they were, its base at a pose."""
    robot = put_together(bodies, stance.robot.name)
    angles = {
        joint: stance.robot.joint_position(stance.q, joint) for joint in stance.robot.joint_names
    }
    q = robot.configuration({joint: angles[joint] for joint in robot.joint_names})
    q[:7] = pin.SE3ToXYZQUAT(base)
    return copsense.Stance(robot, q, contacts or stance.contacts)


def base_pose(stance):
    return pin.XYZQUATToSE3(np.array(stance.q[:7]))


def shifted_base(bodies, shift):
    """The same links with the base's frame elsewhere on its link."""
    changed = dict(bodies)
    base = bodies[BASE]
    changed[BASE] = replace(
        base,
        inertia=shift.actInv(base.inertia),
        frames={name: shift.actInv(place) for name, place in base.frames.items()},
    )
    for name, body in bodies.items():
        if body.parent == BASE:
            changed[name] = replace(body, placement=shift.actInv(body.placement))
    return changed


def rerooted(bodies, joint):
    """The same links with the link behind a joint of the base as the base."""
    assert bodies[joint].parent == BASE
    changed = shifted_base(bodies, bodies[joint].placement)  # the joint's axis is now at the base
    old, new = changed[BASE], changed[joint]
    for name, body in changed.items():
        # Links that hung on the one hang on what is now called by its name.
        parent = {BASE: joint, joint: BASE}.get(body.parent, body.parent)
        changed[name] = replace(body, parent=parent)
    changed[BASE] = replace(old, inertia=new.inertia, frames=new.frames)
    changed[joint] = replace(
        new, parent=BASE, axis=-new.axis, inertia=old.inertia, frames=old.frames
    )
    return changed


def scaled(bodies, factor):
    """Every link heavier by a factor, of the same shape."""
    return {
        name: replace(
            body,
            inertia=pin.Inertia(
                factor * body.inertia.mass, body.inertia.lever, factor * body.inertia.inertia
            ),
        )
        for name, body in bodies.items()
    }


def mirror_pose(place):
    return pin.SE3(FLIP @ place.rotation @ FLIP, FLIP @ place.translation)


def mirrored(stance):
    """The mirror image of robot, posture and contacts; joints keep their angles."""
    bodies = {
        name: replace(
            body,
            placement=mirror_pose(body.placement),
            axis=-FLIP @ body.axis,  # a turn about a is, in the mirror, one about -(a mirrored)
            inertia=pin.Inertia(
                body.inertia.mass, FLIP @ body.inertia.lever, FLIP @ body.inertia.inertia @ FLIP
            ),
            frames={frame: mirror_pose(place) for frame, place in body.frames.items()},
        )
        for name, body in take_apart(stance.robot.model).items()
    }
    contacts = []
    for c in stance.contacts:
        polygon = None if c.polygon is None else c.polygon * [1.0, -1.0]
        x, y, z = c.offset
        contacts.append(
            replace(c, offset=(x, -y, z), rotation=FLIP @ c.rotation @ FLIP, polygon=polygon)
        )
    return stance_with(stance, bodies, mirror_pose(base_pose(stance)), tuple(contacts))
