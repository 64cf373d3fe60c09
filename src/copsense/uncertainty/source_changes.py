"""What each source of uncertainty changes of a stance and of its limits, to first order.

Every column is per unit of its source: one right-hand side of the system that solved the statics.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from jaxtyping import Float

from copsense import rigid_body
from copsense.arrays import read_only
from copsense.changes import StanceChange
from copsense.contact import Contact
from copsense.errors import InvalidInputError
from copsense.limits import Limits, friction_of, limit_rows
from copsense.load_problem import LoadProblem
from copsense.posture import contact_motions
from copsense.robot import Robot
from copsense.stance import Stance, check_at_rest
from copsense.uncertainty.source import AXES, PLACES, SLOPES, Source
from copsense.uncertainty.source_list import link_names

_SPAN = 0.5  # of a coefficient of friction, in which rows of the pyramid are affine


def check_uncertain(stance: Stance, what: str = "an uncertainty") -> None:
    """Reject a stance of which these derivatives are not known.

    Args:
        stance: the stance.
        what: what changes it, such as ``"an uncertainty"``.

    Raises:
        InvalidInputError: it moves, or parts of it hang, which follow what is uncertain.
    """
    check_at_rest(stance, what)
    if stance.hanging_motions.shape[1]:
        raise InvalidInputError(
            f"parts of robot {stance.robot.name!r} hang at an equilibrium of their own, which "
            f"{what} moves: that is not worked out here. Give every joint a motor, or lock it."
        )


def change_of(stance: Stance, sources: Sequence[Source]) -> StanceChange:
    """How a stance changes per unit of each source (p in all)."""
    robot, count = stance.robot, len(sources)
    nv, rows = robot.model.nv, len(stance.constraints)
    V, load = np.zeros((nv, count)), np.zeros((nv, count))
    frames = np.zeros((count, rows, nv))
    inertias = np.zeros((10 * (robot.model.njoints - 1), count))
    kinds = {source.kind for source in sources}
    follow = contact_motions(stance)[0] if kinds & {"place", "height"} else None
    detected = _undetected(stance) if "offset" in kinds else None
    contacts = dict(zip(stance.contact_names, stance.contacts, strict=True))
    of_contact = dict(zip(stance.contact_names, stance.rows, strict=True))
    for i, source in enumerate(sources):
        if source.kind in ("mass", "com", "payload"):
            joint, parameters = _inertial(robot, source)
            inertias[10 * (joint - 1) : 10 * joint, i] = parameters
        elif source.kind == "slope":
            # In the axes of the ground gravity turns the other way: dg = -w x g.
            w = np.eye(3)[SLOPES[source.part]]
            pull = -np.cross(w, robot.model.gravity.linear)
            load[:, i] = rigid_body.gravity_under(robot, stance.q, pull)
        elif source.kind == "torque":
            load[robot.velocity_index(source.where), i] = -1.0
        elif source.kind == "offset":
            assert detected is not None
            V[:, i] = detected[:, robot.velocity_index(source.where) - robot.base_nv]
        elif source.kind in ("place", "height"):
            assert follow is not None
            components = contacts[source.where].components
            row = of_contact[source.where].start + components.index(PLACES[source.part])
            V[:, i] = follow[:, row]
        elif source.kind == "sole":
            contact, at = contacts[source.where], of_contact[source.where]
            frames[i, at] = -_turn(contact, source.part) @ stance.jacobian[at]
    return StanceChange(
        V,
        load,
        frames if "sole" in kinds else None,
        inertias if kinds & {"mass", "com", "payload"} else None,
    )


def row_change(
    stance: Stance, limits: Limits, sources: Sequence[Source]
) -> Float[np.ndarray, "p r c"] | None:
    """How the rows A of limits, A f <= b, change per unit of each source; None if they do not.

    Rows as `LimitRows.over_forces` has them, over the contacts' forces and those of loops. Of the
    torques' rows what the stance changes is left out.
    """
    if not any(source.kind == "friction" for source in sources):
        return None
    problem = LoadProblem.of(stance)

    def rows(mu: float, name: str) -> np.ndarray:
        return limit_rows(stance, with_friction(stance, limits, {name: mu})).over_forces(problem)[0]

    found = np.zeros((len(sources), *rows(0.0, sources[-1].where).shape))
    for i, source in enumerate(sources):
        if source.kind == "friction":
            found[i] = (rows(_SPAN, source.where) - rows(0.0, source.where)) / _SPAN
    return found


def with_friction(stance: Stance, limits: Limits, friction: dict[str, float]) -> Limits:
    """Limits with these coefficients of friction, by contact, and the others as they were."""
    own = {contact.name: friction_of(contact, limits) for contact in stance.contacts}
    every = {name: mu for name, mu in (own | friction).items() if mu is not None}
    return replace(limits, friction=every)


def joint_displacement(
    stance: Stance, offsets: Float[np.ndarray, " n"]
) -> Float[np.ndarray, " nv"]:
    """Where joints that are read wrong by so much truly are (nv,), with the contacts in place."""
    return _undetected(stance) @ offsets


@lru_cache(maxsize=8)  # of a stance that is sampled
def _undetected(stance: Stance) -> Float[np.ndarray, "nv n"]:
    """Z Z_j^+: the part of joint offsets that moves no contact; the rest would be seen as a gap."""
    Z = stance.admissible_motions
    return read_only(Z @ np.linalg.pinv(Z[stance.robot.base_nv :], rcond=1e-9))


def inertial_joint(robot: Robot, source: Source) -> int:
    """The joint of the model whose link a mass, a centre of mass or a payload belongs to."""
    if source.kind == "payload":
        return int(robot.frame(source.where).parentJoint)
    return link_names(robot).index(source.where) + 1


def _inertial(robot: Robot, source: Source) -> tuple[int, Float[np.ndarray, " 10"]]:
    """The joint, and how its link's inertial parameters change per unit of the source.

    As ``pin.Inertia.toDynamicParameters``: m, m c, and the inertia about the joint's frame
    I + m (|c|^2 1 - c c'), its lower triangle row by row.
    """
    joint = inertial_joint(robot, source)
    body = robot.model.inertias[joint]
    c = np.array(body.lever)
    if source.kind == "payload":
        c = robot.frame(source.where).placement.act(np.array(source.point))
    if source.kind == "com":
        e = np.eye(3)[AXES[source.part]]
        m = float(body.mass)
        first, about = m * e, m * (2 * (c @ e) * np.eye(3) - np.outer(e, c) - np.outer(c, e))
        return joint, np.concatenate([[0.0], first, about[np.tril_indices(3)]])
    about = (c @ c) * np.eye(3) - np.outer(c, c)
    return joint, np.concatenate([[1.0], c, about[np.tril_indices(3)]])


def sole_displacement(part: str) -> Float[np.ndarray, " 6"]:
    """The unit displacement of a sole on its link, along and about its own axes [m, rad]."""
    return np.eye(6)[PLACES[part]]


def _turn(contact: Contact, part: str) -> Float[np.ndarray, "k k"]:
    """d x of motions in contact axes, among what the contact carries: how a moved frame sees them.

    d x v = (w_d x v + v_d x w, w_d x w).
    """
    d = sole_displacement(part)
    cross = np.zeros((6, 6))
    for column in range(3):
        e = np.eye(3)[column]
        cross[:3, column] = cross[3:, 3 + column] = np.cross(d[3:], e)
        cross[:3, 3 + column] = np.cross(d[:3], e)
    own = list(contact.components)
    return cross[np.ix_(own, own)]
