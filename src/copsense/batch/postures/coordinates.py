"""Coordinates: the names of a chart's coordinates, and what each of them sets or frees.

A posture is described by **given** numbers: the base's pose, every joint, the CoM, and where each
contact stands. The base's pose and the joints are also the unknowns of the search; which of them
the search may change depends on what is named.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import pinocchio as pin

from copsense.content import ShortRepr, freeze
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.path import COM_COORDINATES
from copsense.stance import Stance

Unit = Literal["m", "rad"]

BASE = ("base_x", "base_y", "base_z", "roll", "pitch", "yaw")
FOOT = ("x", "y", "yaw")
_WAYS = ("along x", "along y", "along z", "about x", "about y", "about z")
_UNITS: tuple[Unit, ...] = ("m", "m", "m", "rad", "rad", "rad")
_STEEP = 0.2  # least vertical part of a plane's normal for a foot to be moved on it
_SINGULAR = 1e-6  # of the largest: singular values under it move nothing


@dataclass(frozen=True, eq=False, repr=False)
class Limb(ShortRepr):
    """Contacts that share joints, and what moves to keep them in place.

    Attributes:
        contacts: their indices.
        unknowns: what moves, as indices of given numbers: base and joints.
    """

    contacts: tuple[int, ...]
    unknowns: tuple[int, ...]


@dataclass(frozen=True, eq=False, repr=False)
class Coordinates(ShortRepr):
    """What a chart's coordinates mean on a stance.

    Given numbers are, in order: the base (x, y, z, roll, pitch, yaw; a planar base's x, y, angle),
    each joint velocity's position, the CoM's x, y, z, and x, y, yaw of each contact.

    Attributes:
        names: as given.
        units: ``"m"`` or ``"rad"`` for each.
        given: the stance's own numbers.
        place: which of them each coordinate sets (k,).
        com_axes: axes of the CoM that are named.
        turned: whether the base's orientation may differ from the stance's.
        limbs: the systems to solve, each apart from the others.
        positions: origin of each contact (nc, 3) [m].
        rotations: axes of each contact, as columns (nc, 3, 3).
        slopes: how its plane rises along world x and y (nc, 2).
        low: lower limit of each joint velocity's position, minus infinity where it has none; the
            stance's own position where that is beyond.
        high: upper limit.
    """

    names: tuple[str, ...]
    units: tuple[Unit, ...]
    given: np.ndarray
    place: np.ndarray
    com_axes: tuple[int, ...]
    turned: bool
    limbs: tuple[Limb, ...]
    positions: np.ndarray
    rotations: np.ndarray
    slopes: np.ndarray
    low: np.ndarray
    high: np.ndarray

    def __post_init__(self) -> None:
        """Own the arrays."""
        freeze(self, "given", "place", "positions", "rotations", "slopes", "low", "high")


def solved_whole(stance: Stance) -> bool:
    """Whether loops, couplings or hanging joints tie base and limbs of a robot together."""
    return stance.closures is not None or bool(stance.hanging_motions.shape[1])


def coordinate_names(stance: Stance) -> tuple[str, ...]:
    """Names that a chart of this stance takes."""
    # With loops or hanging joints nothing but the whole robot can be solved for.
    base = BASE if stance.robot.base_nv == 6 and not solved_whole(stance) else ()
    feet = [
        f"{c.name}:{way}"
        for c, normal in zip(stance.contacts, _normals(stance), strict=True)
        for way in (FOOT if c.kind == "surface" else FOOT[:2])
        if c.kind != "planar" and normal[2] > _STEEP
    ]
    joints = [n for n in stance.robot.joint_names if _one(stance, n)]
    return (*COM_COORDINATES, *base, *joints, *feet)


def chart_coordinates(stance: Stance, names: Sequence[str]) -> Coordinates:
    """Find out what some names mean.

    Raises:
        InvalidInputError: a name twice, or two that contradict each other.
        UnknownNameError: a name that is not a coordinate.
    """
    if isinstance(names, str):
        raise InvalidInputError("coordinates is a single name. Give a list of them.")
    names = tuple(str(name) for name in names)
    valid = coordinate_names(stance)
    for name in names:
        if name not in valid:
            raise UnknownNameError(f"coordinate of robot {stance.robot.name!r}", name, valid)
    if len(set(names)) != len(names):
        raise InvalidInputError(
            f"a chart needs distinct coordinates, got {', '.join(names)}. Name each of them once."
        )
    for axis in "xyz":
        if {f"com_{axis}", f"base_{axis}"} <= set(names):
            raise InvalidInputError(
                f"com_{axis} and base_{axis} are both named, but the one decides the other. "
                "Leave one of them out."
            )
    nb, nv = stance.robot.base_nv, stance.robot.model.nv
    index = {name: i for i, name in enumerate(BASE)} if nb == 6 else {}
    index |= {n: stance.robot.velocity_index(n) for n in stance.robot.joint_names if n in names}
    index |= {name: nv + i for i, name in enumerate(COM_COORDINATES)}
    for k, contact in enumerate(stance.contacts):
        index |= {f"{contact.name}:{way}": nv + 3 + 3 * k + i for i, way in enumerate(FOOT)}
    place = np.array([index[name] for name in names], dtype=np.int64)
    com_axes = tuple(i for i, name in enumerate(COM_COORDINATES) if name in names)
    limbs = _limbs(stance, {int(p) for p in place}, com_axes)
    unknowns = {u for limb in limbs for u in limb.unknowns}
    low, high = stance.robot.position_limits
    own = np.array(
        [
            stance.robot.joint_position(stance.q, name) if _one(stance, name) else 0.0
            for name, _ in joint_units(stance)
        ]
    )
    normals = _normals(stance)
    level = normals[:, 2] > _STEEP
    slopes = np.where(
        level[:, None], -normals[:, :2] / np.where(level, normals[:, 2], 1.0)[:, None], 0.0
    )
    return Coordinates(
        names,
        tuple(_unit(stance, name) for name in names),
        np.concatenate([_start(stance), _feet(stance).ravel()]),
        place,
        com_axes,
        nb == 6 and bool((set(place.tolist()) | unknowns) & {3, 4, 5}),
        limbs,
        np.array([p.translation for p in stance.placements]),
        np.array([p.rotation for p in stance.placements]),
        slopes,
        # Where the stance stands is allowed: its caller has been warned.
        np.minimum(low, own),
        np.maximum(high, own),
    )


def roll_pitch_yaw(rotation: np.ndarray) -> np.ndarray:
    """Angles of Rz(yaw) Ry(pitch) Rx(roll) [rad]."""
    return np.asarray(pin.rpy.matrixToRpy(np.array(rotation)))


def joint_units(stance: Stance) -> list[tuple[str, Unit]]:
    """Name of each joint velocity and the unit of its position."""
    robot, found = stance.robot, []
    for joint, name in zip(list(robot.model.joints)[2:], robot.joint_names, strict=True):
        found += [(name, _unit(stance, name))] * joint.nv
    return found


def row_units(stance: Stance, plan: Coordinates) -> list[tuple[str, Unit]]:
    """What each constraint holds, in the order of a plan's limbs, and its unit."""
    found = []
    for k in (k for limb in plan.limbs for k in limb.contacts):
        contact = stance.contacts[k]
        found += [(f"contact {contact.name} {_WAYS[i]}", _UNITS[i]) for i in contact.components]
    return found + [(f"the CoM {_WAYS[axis]}", "m") for axis in plan.com_axes]


def _one(stance: Stance, joint: str) -> bool:
    return int(stance.robot.model.joints[stance.robot.joint_id(joint)].nv) == 1


def _unit(stance: Stance, name: str) -> Unit:
    if name in stance.robot.joint_names:
        kind = stance.robot.model.joints[stance.robot.joint_id(name)].shortname()
        return "m" if kind.startswith("JointModelP") else "rad"
    return "rad" if name.rpartition(":")[2] in ("roll", "pitch", "yaw") else "m"


def _start(stance: Stance) -> np.ndarray:
    """The stance's base, joints and CoM."""
    robot, model = stance.robot, stance.robot.model
    here = np.zeros(model.nv)
    if robot.base_nv == 6:
        root = model.jointPlacements[1] * pin.XYZQUATToSE3(np.array(stance.q[:7]))
        here[:3], here[3:6] = root.translation, roll_pitch_yaw(root.rotation)
    else:
        here[:3] = *stance.q[:2], np.arctan2(stance.q[3], stance.q[2])
    for name in robot.joint_names:
        if _one(stance, name):
            here[robot.velocity_index(name)] = robot.joint_position(stance.q, name)
    return np.concatenate([here, stance.com])


def _feet(stance: Stance) -> np.ndarray:
    """x, y and yaw of each contact: yaw turns its plane's own x axis into the contact's (nc, 3)."""
    found = []
    for place in stance.placements:
        x, _, z = place.rotation.T
        nearest = np.array([1.0, 0.0, 0.0]) if abs(z[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
        first = nearest - z * (z @ nearest)
        found.append([*place.translation[:2], np.arctan2(x @ np.cross(z, first), x @ first)])
    return np.array(found)


def _normals(stance: Stance) -> np.ndarray:
    """Normal of the plane along which each contact moves (nc, 3)."""
    return np.array(
        [
            place.rotation[:, 2] if contact.plane is None else contact.plane.normal
            for contact, place in zip(stance.contacts, stance.placements, strict=True)
        ]
    )


def _limbs(stance: Stance, named: set[int], com_axes: tuple[int, ...]) -> tuple[Limb, ...]:
    """The systems: one for each limb, or one for all where base or CoM tie them together."""
    model, nb = stance.robot.model, stance.robot.base_nv
    limbs: list[tuple[list[int], set[int]]] = []
    for k, contact in enumerate(stance.contacts):
        chain: set[int] = set()
        for i in stance.limb(contact):
            joint = model.joints[i]
            chain |= set(range(joint.idx_v, joint.idx_v + joint.nv)) - named
        contacts = [k]
        for other in [limb for limb in limbs if limb[1] & chain]:
            limbs.remove(other)
            contacts, chain = other[0] + contacts, other[1] | chain
        limbs.append((contacts, chain))
    rows = [sum(len(stance.contacts[k].components) for k in limb[0]) for limb in limbs]
    short = any(len(limb[1]) < r for limb, r in zip(limbs, rows, strict=True))
    base: set[int] = set()
    if short or (com_axes and nb != 6):
        base = set(range(nb)) - named
    elif com_axes:
        base = set(com_axes)
    if base or com_axes:
        everything = set().union(base, *(limb[1] for limb in limbs))
        rest = set(range(nb, stance.robot.model.nv)) - named
        # Where limbs and base cannot do it alone, the other joints take part.
        if _reach(stance, com_axes, everything) != _reach(stance, com_axes, everything | rest):
            everything |= rest
        return (Limb(tuple(range(len(stance.contacts))), tuple(sorted(everything))),)
    return tuple(Limb(tuple(sorted(c)), tuple(sorted(u))) for c, u in limbs)


def _reach(stance: Stance, com_axes: tuple[int, ...], columns: set[int]) -> tuple[int, int]:
    """In how many directions some velocities move the contacts, and the CoM with them in place."""
    others = sorted(set(range(stance.robot.model.nv)) - columns)
    _, s, vt = np.linalg.svd(stance.admissible_motions[others])  # true motions, not false ones
    motions = stance.admissible_motions @ vt[int(np.sum(s > _SINGULAR)) :].T
    J, com = stance.jacobian[:, sorted(columns)], stance.com_jacobian[list(com_axes)] @ motions
    tolerance = _SINGULAR * np.linalg.norm(stance.jacobian, 2)
    return int(np.linalg.matrix_rank(J, tol=tolerance)), int(
        np.linalg.matrix_rank(com, tol=_SINGULAR)
    )
