"""The MuJoCo model of a stance, built from its Pinocchio model.

It is not read from the robot's file, so locked joints, replaced inertias and robots without a file
are simulated as they are analysed.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pinocchio as pin

from copsense.contact import Contact
from copsense.errors import ImpossibleInertiaError, InvalidInputError
from copsense.inertias import carried_links, impossible_inertias
from copsense.robot import Robot
from copsense.simulation.mujoco_drives import add_drives, driven_joints, quaternion
from copsense.simulation.physics_settings import PhysicsSettings
from copsense.simulation.support_points import support_points
from copsense.stance import Stance, check_at_rest

_POINT = 1e-4  # m: radius of the ball at each support point
# m: how deep each ball starts in the ground. A contact that only touches carries no force in the
# first step, and torques meant for a foot on the ground would spin it.
_PRESSED = 1e-6
_HINGES = ("JointModelR",)
_SLIDES = ("JointModelP",)


def build_model(mujoco: Any, stance: Stance, settings: PhysicsSettings, *, sensors: bool) -> Any:
    """The compiled MuJoCo model of a stance."""
    robot, model = stance.robot, stance.robot.model
    check_at_rest(stance, "the start of a simulation")
    if model.joints[1].shortname() != "JointModelFreeFlyer":
        raise InvalidInputError(
            f"robot {robot.name!r} moves in a plane, the simulation in space. Use a robot with a "
            "free-floating base."
        )
    spec = mujoco.MjSpec()
    spec.compiler.autolimits, spec.compiler.degree = False, False
    option = spec.option
    option.timestep, option.gravity = settings.time_step, model.gravity.linear
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.impratio, option.tolerance, option.iterations = settings.impedance_ratio, 1e-10, 100
    # Without this flag a fall restarts the simulation without an error.
    option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    # One robot is one island: to look for others, and to copy its matrices, would be wasted.
    option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ISLAND)
    bodies = {0: spec.worldbody}
    for chain in _chains(stance):
        bodies[chain[-1]] = _add_body(mujoco, robot, chain, bodies[model.parents[chain[0]]])
    for contact, world in zip(stance.contacts, stance.placements, strict=True):
        _add_contact(mujoco, spec, bodies, robot, contact, world, settings)
        for kind in ("FORCE", "TORQUE") if sensors else ():
            spec.add_sensor(
                name=f"{kind.lower()} of {contact.name}",
                type=getattr(mujoco.mjtSensor, f"mjSENS_{kind}"),
                objtype=mujoco.mjtObj.mjOBJ_SITE,
                objname=f"contact {contact.name}",
            )
    add_drives(mujoco, spec, bodies, stance, settings)
    try:
        return spec.compile()
    except ValueError as error:
        impossible = impossible_inertias(robot)
        if impossible:
            raise ImpossibleInertiaError(robot.name, list(impossible.values())) from None
        # MuJoCo's remedies are options of its own file format.
        reason, _, where = str(error).strip().removeprefix("Error: ").partition("\n")
        named = re.search(r"'body (.+)'", where)
        link = f" of {carried_links(model, model.getJointId(named[1]))}" if named else ""
        raise InvalidInputError(
            f"MuJoCo cannot simulate robot {robot.name!r}: {reason.split(';')[0]}{link}. Give its "
            "links physical masses and inertias."
        ) from None


def _chains(stance: Stance) -> Iterator[list[int]]:
    """The joints of each body: its own, before it those that move it but nothing else with mass.

    MuJoCo gives one body several joints, and rejects bodies without mass.
    """
    model = stance.robot.model
    used = {contact.on(stance.robot).joint for contact in stance.contacts} | driven_joints(stance)
    chain: list[int] = []
    for i in range(1, model.njoints):
        chain.append(i)
        empty = i > 1 and not model.inertias[i].mass and not model.inertias[i].inertia.any()
        if not (empty and list(model.children[i]) == [i + 1] and i not in used):
            yield chain
            chain = []


def _add_body(mujoco: Any, robot: Robot, chain: Sequence[int], parent: Any) -> Any:
    """Add the body moved by joints of the model, and the joints."""
    model, i = robot.model, chain[-1]
    place, inertia = pin.SE3.Identity(), model.inertias[i]
    for number in chain:
        place = place * model.jointPlacements[number]
    body = parent.add_body(
        name=f"body {model.names[i]}", pos=place.translation, quat=quaternion(place)
    )
    body.explicitinertial = True
    body.mass, body.ipos = inertia.mass, inertia.lever
    at_com = inertia.inertia
    body.fullinertia = [*np.diag(at_com), at_com[0, 1], at_com[0, 2], at_com[1, 2]]
    if i == 1:
        body.add_freejoint()
        return body
    for at, number in enumerate(chain):
        # MuJoCo has a body's joints in the body's own axes, as they are at zero.
        before = pin.SE3.Identity()
        for later in chain[at + 1 :]:
            before = before * model.jointPlacements[later]
        _add_joint(mujoco, robot, number, body, before.inverse())
    return body


def _add_joint(mujoco: Any, robot: Robot, i: int, body: Any, place: pin.SE3) -> None:
    """Add a joint of the model that stands at a place in a body's axes."""
    model, joint = robot.model, robot.model.joints[i]
    kind, subspace = joint.shortname(), np.ravel(joint.createData().S)
    if not kind.startswith((*_HINGES, *_SLIDES)) or joint.nv != 1 or not _unit(subspace):
        raise InvalidInputError(
            f"joint {model.names[i]!r} of robot {robot.name!r} is a {kind}, which cannot be "
            "simulated. Lock it: robot.keeping([...]) (--lock JOINT)."
        )
    hinge = bool(np.any(subspace[3:]))
    body.add_joint(
        name=model.names[i],
        type=mujoco.mjtJoint.mjJNT_HINGE if hinge else mujoco.mjtJoint.mjJNT_SLIDE,
        pos=place.translation,
        axis=place.rotation @ (subspace[3:] if hinge else subspace[:3]),
        armature=float(model.armature[joint.idx_v]),
    )


def _unit(subspace: np.ndarray) -> bool:
    """Whether a motion is a pure turn or slide of unit rate."""
    parts = np.linalg.norm(subspace[:3]), np.linalg.norm(subspace[3:])
    return bool(np.isclose(max(parts), 1.0) and np.isclose(min(parts), 0.0))


def _add_contact(
    mujoco: Any,
    spec: Any,
    bodies: dict[int, Any],
    robot: Robot,
    contact: Contact,
    world: pin.SE3,
    settings: PhysicsSettings,
) -> None:
    """Add a contact's frame, its support points and the plane below them."""
    at = contact.on(robot)
    body, place = bodies[at.joint], at.placement
    body.add_site(name=f"contact {contact.name}", pos=place.translation, quat=quaternion(place))
    up = world.rotation[:, 2]
    point = contact.kind == "point"
    spec.worldbody.add_geom(
        name=f"plane under {contact.name}",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[0.0, 0.0, 1.0],
        # A point's ball is centred on the point; a sole's balls touch the sole from above.
        pos=world.translation + (_PRESSED - (_POINT if point else 0.0)) * up,
        quat=quaternion(world),
        contype=0,
        conaffinity=0,
    )
    friction = settings.friction if contact.friction is None else contact.friction
    for number, (x, y) in enumerate(support_points(contact, settings.sole_detail)):
        name = f"{contact.name} | {number}"
        body.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=[_POINT, 0.0, 0.0],
            pos=place.act(np.array([x, y, 0.0 if point else _POINT])),
            mass=0.0,
            contype=0,
            conaffinity=0,
        )
        spec.add_pair(
            geomname1=f"plane under {contact.name}",
            geomname2=name,
            condim=3,
            friction=[friction, friction, 0.0, 0.0, 0.0],
            solref=[settings.contact_time, 1.0],
        )
