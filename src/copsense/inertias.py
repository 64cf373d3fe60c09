"""Inertias: rotational inertias that no body has, and those that a simulation can take instead.

Statics, sensitivity, paths and maps feel masses and centres of mass only. Motion feels inertias:
their principal moments are positive, and none is greater than the other two together.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from copsense.listing import listed
from copsense.robot import Robot

_LEAST = 1e-12  # kg m^2: a principal moment under this is none
_ROUNDING = 1e-9  # share of the largest by which it may exceed the others together
_DENSITY = 1000.0  # kg/m^3, of the ball that stands in for a link without any inertia


def impossible_inertias(robot: Robot) -> dict[str, str]:
    """What moves with a joint and has an inertia that no body has: joint -> what is wrong there.

    The joint that stands for the base is ``"root_joint"``.
    """
    model, found = robot.model, {}
    for i in range(1, model.njoints):
        mass, moments = model.inertias[i].mass, np.linalg.eigvalsh(model.inertias[i].inertia)
        wrong = not _possible(moments) if mass else bool(moments.any())
        if wrong:
            found[model.names[i]] = (
                f"{carried_links(model, i)} ({mass:.3g} kg) has the principal inertias "
                f"{listed([f'{moment:.3g}' for moment in moments])} kg m^2"
            )
    return found


def repair_inertias(robot: Robot) -> Robot:
    """The robot with inertias that bodies have; its `notes` say which were changed, and to what.

    Each impossible inertia becomes that of a ball: of the mean of its principal moments (the rule
    of MuJoCo's ``balanceinertia``) or, where that is not positive, of a solid ball of the link's
    mass and the density of water; without mass there is none. Masses and centres of mass stay, and
    with them all statics.
    """
    names = impossible_inertias(robot)
    if not names:
        return robot
    model, notes = robot.model.copy(), list(robot.notes)
    for name, wrong in names.items():
        i = model.getJointId(name)
        body = model.inertias[i]
        moment = float(np.trace(body.inertia)) / 3.0
        instead = f"{moment:.3g} kg m^2 about every axis, their mean, takes their place"
        if not body.mass:
            moment, instead = 0.0, "without mass it gets none"
        elif moment < _LEAST:
            radius = (3.0 * body.mass / (4.0 * np.pi * _DENSITY)) ** (1.0 / 3.0)
            moment = 0.4 * body.mass * radius**2
            instead = f"{moment:.3g} kg m^2, a ball's of its mass, takes their place"
        model.inertias[i] = pin.Inertia(body.mass, body.lever, moment * np.eye(3))
        notes.append(f"{wrong}, which no body has: {instead}. Statics do not change; motions do.")
    return replace(robot, model=model, notes=tuple(notes))


def _possible(moments: Float[np.ndarray, " 3"]) -> bool:
    least, middle, largest = moments
    return bool(least >= _LEAST and least + middle >= largest * (1.0 - _ROUNDING))


def carried_links(model: pin.Model, joint: int) -> str:
    """The links that move with a joint (its index), in words."""
    bodies = [
        f.name for f in model.frames if f.parentJoint == joint and f.type == pin.FrameType.BODY
    ]
    if not bodies:
        return f"what joint {model.names[joint]!r} carries"
    others = len(bodies) - 1
    fixed = f" with the {others} fixed to it" if others else ""
    return f"link {bodies[0]!r}{fixed}"
