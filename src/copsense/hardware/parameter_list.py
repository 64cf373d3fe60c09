"""hardware_parameters: the dimensions, masses and stiffnesses of a robot that stands."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from copsense import rigid_body
from copsense.arrays import checked_tuple
from copsense.contact import Contact
from copsense.criterion import Criterion
from copsense.criterion_text import STIFFNESS
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.hardware.pairs import all_alike, mirrored
from copsense.hardware.parameter import GROUPS, Alteration, Parameter, Stretch
from copsense.rigid_body import Attachment
from copsense.robot import Robot
from copsense.stance import Stance, check_stance
from copsense.terms import TorqueTerm
from copsense.uncertainty.source_list import link_names

_SHORTEST = 1e-3  # m: what is shorter has no length to change
_LIGHTEST = 1e-6  # kg
_ASIDE = 0.2  # share of the way from the middle of the feet that a sole's axis must point along
# Parts of a sole -> its axis, and whether low or high end stays; None is its middle.
_PARTS = {
    "front": (0, 0),
    "back": (0, 1),
    "left": (1, 0),
    "right": (1, 1),
    "length": (0, None),
    "width": (1, None),
}


def hardware_parameters(
    stance: Stance, criterion: Criterion | None = None, *, single: bool = False
) -> tuple[Parameter, ...]:
    """What of a robot's hardware may be changed, with what it is now.

    Soles and ankles of all feet change together, and so do the left and the right one of links and
    joints.

    Args:
        stance: the robot on its contacts.
        criterion: one of `copsense.stiffness.stiffness` has stiffnesses of joints as well.
        single: each foot, link and joint by itself.
    """
    check_stance(stance)
    alone = _alone(stance, criterion)
    hips = tuple(_hips(stance))
    if single:
        return (*hips, *alone)
    feet = [p for p in alone if p.kind.startswith("sole_") or p.kind == "ankle_height"]
    return (*_of_feet(stance, feet), *hips, *_alike(alone, all_alike))


def parameter_named(name: str, stance: Stance, criterion: Criterion | None = None) -> Parameter:
    """A parameter by its name, of several parts together or of one.

    Raises:
        InvalidInputError: a robot on points has no soles, say.
        UnknownNameError: no such parameter.
    """
    together = hardware_parameters(stance, criterion)
    alone = _alone(stance, criterion)
    every = {p.name: p for p in (*alone, *_alike(alone, mirrored), *together)}
    if name in every:
        return every[name]
    kind, at, _ = name.partition("@")
    robot, valid = stance.robot.name, [p.name for p in together]
    if kind not in GROUPS:
        raise UnknownNameError("hardware parameter", name, valid)
    same = [each for each in every if each.partition("@")[0] == kind]
    if same:
        if not at:
            raise InvalidInputError(
                f"{kind} of what? Give KIND@WHERE: one of {', '.join(same[:20])}."
            )
        raise UnknownNameError(f"hardware parameter {kind} of robot {robot!r}", name, same)
    why = {
        "stiffness": "its criterion has no stiffnesses of joints. Give one that has "
        "(--criterion stiffness:hip=4000,rest=2000)",
        "spring": "none of its joints has a spring",
        "hip_width": "its limbs begin at one place",
        "hip_length": "its limbs begin at one place, seen from the side",
        "length": "none of its links has a length between two joints that could be changed",
        "ankle_height": "it stands on points, which have no ankle",
    }.get(kind, "it stands on contacts without such a sole")
    raise InvalidInputError(
        f"robot {robot!r} has no {kind}: {why}. Valid: {', '.join(valid[:20])}."
    )


def check_parameters(stance: Stance, given: Sequence[Parameter]) -> tuple[Parameter, ...]:
    """Parameters of this robot.

    Raises:
        InvalidInputError: none is given, something else than a parameter, or one of a contact, link
            or joint that the robot does not have.
    """
    remedy = "Give some of copsense.hardware.hardware_parameters(stance)."
    found = checked_tuple(given, Parameter, "parameter", remedy)
    if not found:
        raise InvalidInputError(f"no parameter is given. {remedy}")
    robot = stance.robot
    own = {*stance.contact_names, *link_names(robot), *robot.model.names, *robot.torque_names}
    for parameter in found:
        lacking = [name for name in parameter.where if name not in own]
        if lacking:
            raise InvalidInputError(
                f"{parameter.name} is of {lacking[0]!r}, which robot {robot.name!r} does not have "
                f"here. {remedy}"
            )
    return found


def _alone(stance: Stance, criterion: Criterion | None) -> tuple[Parameter, ...]:
    """Of each foot, link and joint by itself."""
    return (
        *_soles(stance),
        *_ankles(stance),
        *_lengths(stance),
        *_masses(stance.robot),
        *_servos(stance, criterion),
        *_springs(stance.robot),
    )


def _alike(
    alone: Sequence[Parameter], groups: Callable[[Sequence[str]], dict[str, tuple[str, ...]]]
) -> Iterator[Parameter]:
    """Links and joints that are alike together."""
    rest = [p for p in alone if not p.kind.startswith("sole_") and p.kind != "ankle_height"]
    for kind in dict.fromkeys(p.kind for p in rest):
        own = {p.where[0]: p for p in rest if p.kind == kind}
        for name, group in groups(list(own)).items():
            yield _together(f"{kind}@{name}", [own[each] for each in group])


def _together(name: str, parts: Sequence[Parameter]) -> Parameter:
    first = parts[0]
    change = Alteration.together(p.alteration for p in parts)
    nominal = math.fsum(p.nominal for p in parts) / len(parts)
    return replace(
        first,
        name=name,
        where=tuple(place for p in parts for place in p.where),
        nominal=nominal,
        size=math.fsum(p.size for p in parts) / len(parts),
        alteration=change,
        # All change by the same, so that the one that has least left of it counts.
        low=nominal + max(p.low - p.nominal for p in parts),
    )


def _of_feet(stance: Stance, feet: Sequence[Parameter]) -> Iterator[Parameter]:
    """Soles and ankles of all feet together; their sides as the outer and the inner one."""
    outer = {c.name: _outer(stance, c) for c in stance.contacts if c.sole is not None}
    two_sided = len(outer) > 1 and all(outer.values())
    by_kind: dict[str, list[Parameter]] = {}
    for each in feet:
        kind, (contact,) = each.kind, each.where
        side = kind.removeprefix("sole_")
        if two_sided and side in ("left", "right"):
            kind = "sole_outer" if side == outer[contact] else "sole_inner"
        by_kind.setdefault(kind, []).append(replace(each, kind=kind))
    order = list(GROUPS)
    for kind, parts in sorted(by_kind.items(), key=lambda item: order.index(item[0])):
        yield _together(kind, parts)


def _outer(stance: Stance, contact: Contact) -> str:
    """Which side of a sole, ``"left"`` or ``"right"``, faces away from the other feet, or none."""
    places = dict(zip(stance.contact_names, stance.placements, strict=True))
    own = places[contact.name]
    middle = np.mean([place.translation for place in places.values()], axis=0)
    away = own.translation - middle
    far = float(np.linalg.norm(away))
    along = 0.0 if far < _SHORTEST else float(own.rotation[:, 1] @ away) / far
    return "" if abs(along) < _ASIDE else "left" if along > 0 else "right"


def _soles(stance: Stance) -> Iterator[Parameter]:
    for contact in stance.contacts:
        if contact.sole is None:
            continue
        low, high = contact.sole.vertices.min(axis=0), contact.sole.vertices.max(axis=0)
        for part, (axis, end) in _PARTS.items():
            extent = float(high[axis] - low[axis])
            if extent < _SHORTEST or (axis == 0 and contact.kind == "planar"):
                continue
            ends = float(low[axis]), float(high[axis])
            fixed = sum(ends) / 2 if end is None else ends[end]
            # How far its edge is from the contact's origin.
            nominal = extent if end is None else ends[1] if end == 0 else -ends[0]
            yield Parameter(
                f"sole_{part}@{contact.name}",
                f"sole_{part}",
                (contact.name,),
                nominal,
                "m",
                extent,
                Alteration(soles={contact.name: Stretch(axis, fixed, extent)}),
                nominal - extent,
            )


def _ankles(stance: Stance) -> Iterator[Parameter]:
    for contact in stance.contacts:
        if contact.kind == "point":
            continue
        place = contact.on(stance.robot).placement
        height = -float((place.rotation.T @ place.translation)[2])
        yield Parameter(
            f"ankle_height@{contact.name}",
            "ankle_height",
            (contact.name,),
            height,
            "m",
            max(abs(height), 10 * _SHORTEST),
            Alteration(contacts={contact.name: -place.rotation[:, 2]}),
        )


def _chains(stance: Stance) -> dict[str, tuple[int, ...]]:
    """Joints of each contact's limb, without those that all limbs share."""
    chains = {contact.name: stance.limb(contact) for contact in stance.contacts}
    while len({chain[:1] for chain in chains.values()}) == 1 and all(
        len(chain) > 1 for chain in chains.values()
    ):
        if len(set(chains.values())) == 1:
            break
        chains = {name: chain[1:] for name, chain in chains.items()}
    return chains


def _hips(stance: Stance) -> Iterator[Parameter]:
    """How far apart the limbs begin, to the side and, of more than two, ahead."""
    robot = stance.robot
    hips = list(dict.fromkeys(chain[0] for chain in _chains(stance).values() if chain))
    if len(hips) < 2:
        return
    places = _joint_places(stance, hips)
    at = np.array([place.translation for place in places])
    axes = {"hip_width": 1, "hip_length": 0} if len(hips) > 2 else {"hip_width": 1}
    for kind, axis in axes.items():
        if axis == 0 and robot.base_nv != 6:
            continue
        away = at[:, axis] - at[:, axis].mean()
        low, high = away[away < 0], away[away > 0]
        if not (len(low) and len(high)) or high.mean() - low.mean() < _SHORTEST:
            continue
        parents = _joint_places(stance, [int(robot.model.parents[hip]) for hip in hips])
        moved = {
            hip: place.rotation.T @ (np.sign(d) / 2 * np.eye(3)[axis])
            for hip, place, d in zip(hips, parents, away, strict=True)
            if abs(d) > _SHORTEST / 2
        }
        width = float(high.mean() - low.mean())
        where = tuple(str(robot.model.names[hip]) for hip in moved)
        yield Parameter(kind, kind, where, width, "m", width, Alteration(joints=moved), 0.0)


def _joint_places(stance: Stance, joints: Sequence[int]) -> tuple[pin.SE3, ...]:
    origins = [Attachment(joint, pin.SE3.Identity()) for joint in joints]
    return rigid_body.place(stance.robot, stance.q, origins)[0]


def _lengths(stance: Stance) -> Iterator[Parameter]:
    """Of the links of each limb, from joint to joint, or to a contact that is a point."""
    robot, names = stance.robot, link_names(stance.robot)
    chains, seen = _chains(stance), set()
    tied = {
        int(robot.frame(frame).parentJoint)
        for frame in (
            *(f for loop in robot.drives.loops for f in (loop.frame_a, loop.frame_b)),
            *(load.frame for load in stance.loads),
        )
    }
    for contact in stance.contacts:
        chain, on = chains[contact.name], contact.on(robot)
        for joint, following in zip(chain, (*chain[1:], 0), strict=True):
            if joint in seen or joint in tied or (not following and contact.kind != "point"):
                continue
            seen.add(joint)
            if following:
                end = np.array(robot.model.jointPlacements[following].translation)
            else:
                end = np.array(on.placement.translation)
            length = float(np.linalg.norm(end))
            if length < _SHORTEST:
                continue
            yield Parameter(
                f"length@{names[joint - 1]}",
                "length",
                (names[joint - 1],),
                length,
                "m",
                length,
                _stretched(stance, joint, end / length, length),
                0.0,
            )


def _stretched(stance: Stance, joint: int, u: Float[np.ndarray, " 3"], length: float) -> Alteration:
    """A link stretched along u: what stands on it moves along, and its mass is spread out."""
    model = stance.robot.model

    def moved(point: Float[np.ndarray, " 3"]) -> Float[np.ndarray, " 3"]:
        return float(u @ point) / length * u

    carried = {
        child: moved(model.jointPlacements[child].translation)
        for child in range(1, model.njoints)
        if int(model.parents[child]) == joint
    }
    on = {contact.name: contact.on(stance.robot) for contact in stance.contacts}
    feet = {
        name: moved(place.placement.translation)
        for name, place in on.items()
        if place.joint == joint
    }
    return Alteration(joints=carried, contacts=feet, stretches={joint: (u, length)})


def _masses(robot: Robot) -> Iterator[Parameter]:
    for joint, name in enumerate(link_names(robot), start=1):
        mass = float(robot.model.inertias[joint].mass)
        if mass > _LIGHTEST:
            yield Parameter(
                f"mass@{name}", "mass", (name,), mass, "kg", mass, Alteration(masses={joint: 1.0}),
                0.0,
            )  # fmt: skip


def _servos(stance: Stance, criterion: Criterion | None) -> Iterator[Parameter]:
    """Of position servos, where the criterion says that they share the load."""
    if criterion is None or not criterion.name.startswith(STIFFNESS):
        return
    if not isinstance(criterion.terms[0], TorqueTerm):
        return
    weights = criterion.at(stance).torque
    if np.any(weights - np.diag(np.diag(weights))):
        return
    slides = _slides(stance.robot)
    for name, compliance in zip(stance.robot.torque_names, np.diag(weights), strict=True):
        if compliance > 0:
            stiff = 1.0 / float(compliance)
            yield Parameter(
                f"stiffness@{name}",
                "stiffness",
                (name,),
                stiff,
                "N/m" if name in slides else "N m/rad",
                stiff,
                Alteration(servos=(name,)),
                0.0,
            )


def _springs(robot: Robot) -> Iterator[Parameter]:
    slides = _slides(robot)
    for name, spring in robot.drives.springs.items():
        yield Parameter(
            f"spring@{name}",
            "spring",
            (name,),
            spring.stiffness,
            "N/m" if name in slides else "N m/rad",
            abs(spring.stiffness) or 1.0,
            Alteration(springs=(name,)),
        )


def _slides(robot: Robot) -> set[str]:
    return {name for name in robot.dof_names if robot.joint_unit(name) == "m"}
