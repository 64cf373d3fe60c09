"""sources_of: the single errors that an uncertainty means for a robot on its contacts."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any

import pinocchio as pin

from copsense.contact import Contact
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.limits import Limits, friction_of
from copsense.patterns import by_name
from copsense.posture import contact_motions
from copsense.robot import Robot
from copsense.stance import Stance
from copsense.uncertainty.source import AXES, PLACES, SLOPES, Source
from copsense.uncertainty.uncertainty_tables import Table, Uncertainty

# Why a source has no meaning somewhere, a sentence; None where it has.
Reason = str | None


def sources_of(
    uncertainty: Uncertainty, stance: Stance, limits: Limits | None = None
) -> tuple[Source, ...]:
    """The errors that an uncertainty means here, those of no size left out.

    What a pattern with a star says is passed over where it has no meaning; what a name says is not.

    Args:
        uncertainty: the tables.
        stance: the robot on its contacts.
        limits: what has to be met; gives the coefficients of friction.

    Raises:
        UnknownNameError: no such link, joint, contact or frame.
        InvalidInputError: an uncertainty without meaning for this robot, or none that is left.
    """
    found = [
        *_of_links(uncertainty.links, stance.robot),
        *_of_payloads(uncertainty, stance.robot),
        *_of_joints(uncertainty.joints, stance.robot),
        *_of_ground(uncertainty.ground, stance.robot),
        *_of_contacts(uncertainty.contacts, stance, limits),
    ]
    kept = tuple(source for source in found if source.deviation > 0)
    if not kept:
        raise InvalidInputError(
            f"nothing of the uncertainty has a meaning for robot {stance.robot.name!r} on these "
            "contacts, or a size. Give a standard deviation above zero of something it has."
        )
    _check_masses(kept, stance.robot, uncertainty.sigmas)
    return kept


@lru_cache(maxsize=32)  # frames of the model are slow to go through
def link_names(robot: Robot) -> tuple[str, ...]:
    """The link of each joint of the model (njoints - 1,), the base's first.

    Links that are fixed to another count as part of it.
    """
    names: dict[int, str] = {}
    for frame in robot.model.frames:
        if frame.type == pin.FrameType.BODY:
            names.setdefault(int(frame.parentJoint), str(frame.name))
    return tuple(names.get(j, str(robot.model.names[j])) for j in range(1, robot.model.njoints))


def _said(
    table: Table,
    key: str,
    names: Sequence[str],
    kind: str,
    reason: Callable[[str], Reason],
) -> Iterator[tuple[str, Any]]:
    """Name and value of all that one key says of something it has a meaning for."""
    given = {of: values[key] for of, values in table.items() if key in values}
    where = f"the uncertainty's {key}"
    found = by_name(given, names, kind, where)
    reasons = {name: reason(name) for name in found}
    for pattern in given:
        of = [name for name, (by, _) in found.items() if by == pattern]
        if of and all(reasons[name] for name in of) and pattern != "*":
            raise InvalidInputError(f"{where} of {pattern!r} has no meaning: {reasons[of[0]]}")
    for name, (_, value) in found.items():
        if reasons[name] is None:
            yield name, value


def _of_links(table: Table, robot: Robot) -> Iterator[Source]:
    names = link_names(robot)
    bodies = dict(zip(names, list(robot.model.inertias)[1:], strict=True))
    kind = f"link in robot {robot.name!r}"
    for of in table:
        if of not in names and of in robot.frame_names:
            carrier = names[robot.frame(of).parentJoint - 1]
            raise UnknownNameError(
                kind,
                of,
                names,
                f"{of!r} is fixed to {carrier!r}, and counts as part of it: give that one's.",
            )

    def massless(link: str) -> Reason:
        return None if bodies[link].mass > 0 else f"link {link} has no mass. Give mass_kg."

    for link, percent in _said(table, "mass_percent", names, kind, massless):
        yield Source("mass", link, "", percent / 100 * bodies[link].mass, "kg")
    for link, mass in _said(table, "mass_kg", names, kind, lambda _: None):
        yield Source("mass", link, "", mass, "kg")
    for link, each in _said(table, "com_m", names, kind, massless):
        for part, length in zip(AXES, each, strict=True):
            yield Source("com", link, part, length, "m")


def _of_payloads(uncertainty: Uncertainty, robot: Robot) -> Iterator[Source]:
    for payload in uncertainty.payloads:
        robot.frame(payload["frame"])
        yield Source(
            "payload", payload["frame"], "", payload["mass_kg"], "kg", tuple(payload["com_m"])
        )


def _of_joints(table: Table, robot: Robot) -> Iterator[Source]:
    names = [j for j in robot.joint_names if robot.model.joints[robot.joint_id(j)].nv == 1]
    kind = f"joint of one axis in robot {robot.name!r}"
    units = {joint: robot.joint_unit(joint) for joint in names}

    def turns(joint: str, key: str, other: str) -> Reason:
        return None if units[joint] == "rad" else f"{joint} slides. Give {other} instead of {key}."

    def slides(joint: str, key: str, other: str) -> Reason:
        return None if units[joint] == "m" else f"{joint} turns. Give {other} instead of {key}."

    def driven(joint: str) -> Reason:
        if robot.actuation is None:
            return None
        row = robot.velocity_index(joint) - robot.base_nv
        moved = robot.actuation.matrix[row].any()
        return None if moved else f"no motor drives {joint}. Leave it out."

    for key, own, other in (
        ("offset_deg", turns, "offset_m"),
        ("offset_m", slides, "offset_deg"),
        ("torque_Nm", turns, "torque_N"),
        ("torque_N", slides, "torque_Nm"),
    ):

        def reason(joint: str, key: str = key, own: Any = own, other: str = other) -> Reason:
            wrong: Reason = own(joint, key, other)
            return wrong or (driven(joint) if key.startswith("torque") else None)

        for joint, value in _said(table, key, names, kind, reason):
            if key.startswith("torque"):
                yield Source("torque", joint, "", value, "N m" if own is turns else "N")
            elif own is turns:
                yield Source("offset", joint, "", math.radians(value), "rad")
            else:
                yield Source("offset", joint, "", value, "m")


def _of_ground(table: Mapping[str, float], robot: Robot) -> Iterator[Source]:
    for part in SLOPES:
        key = f"{part}_deg"
        if key not in table:
            continue
        if robot.base_nv != 6 and part == "pitch":
            raise InvalidInputError(
                f"the uncertainty's {key} of the ground has no meaning: robot {robot.name!r} lives "
                "in a plane. Give roll_deg."
            )
        yield Source("slope", "ground", part, math.radians(table[key]), "rad")


def _of_contacts(table: Table, stance: Stance, limits: Limits | None) -> Iterator[Source]:
    contacts = dict(zip(stance.contact_names, stance.contacts, strict=True))
    kind, names = "contact", list(contacts)
    moved = contact_motions(stance)[1] if table else None
    rows = dict(zip(names, stance.rows, strict=True))

    def carries(contact: Contact, part: str) -> Reason:
        if PLACES[part] not in contact.components:
            return f"contact {contact.name} is a {contact.kind} contact, which has no {part} there."
        return None

    links = {name: contact.on(stance.robot).joint for name, contact in contacts.items()}

    def stands(name: str, part: str) -> Reason:
        wrong = carries(contacts[name], part)
        if wrong is not None:
            return wrong
        beside = [n for n in names if n != name and links[n] == links[name]]
        if beside:
            return f"{name} and {beside[0]} are on one link, and keep their distance."
        row = rows[name].start + contacts[name].components.index(PLACES[part])
        assert moved is not None
        return (
            None if moved[row] else f"the joints of this robot cannot follow {name} along {part}."
        )

    def soled(name: str, part: str) -> Reason:
        if contacts[name].kind == "point":
            return f"{name} is a point contact, which has no sole. Give x_m and y_m."
        return carries(contacts[name], part)

    for part in PLACES:
        for key in (f"{part}_m", f"{part}_deg"):
            for name, value in _said(table, key, names, kind, lambda n, part=part: stands(n, part)):  # type: ignore[misc]
                turns = key.endswith("_deg")
                size = math.radians(value) if turns else value
                of = "height" if part == "height" else "place"
                yield Source(of, name, part, size, "rad" if turns else "m")
    for part, unit in (("x", "m"), ("y", "m"), ("yaw", "deg")):
        key = f"sole_{part}_{unit}"
        for name, value in _said(table, key, names, kind, lambda n, part=part: soled(n, part)):  # type: ignore[misc]
            size = math.radians(value) if unit == "deg" else value
            yield Source("sole", name, part, size, "rad" if unit == "deg" else "m")

    def rubs(name: str) -> Reason:
        if limits is None or limits.torsion == "cone":
            return (
                "the limits have no friction. Give limits with it (--limits friction=0.33)."
                if limits is None
                else "the exact wrench cone is not linear in the coefficient. Give torsion another "
                "limit."
            )
        if friction_of(contacts[name], limits) is None:
            return f"contact {name} has no limit of friction. Give it one."
        return None

    for name, value in _said(table, "friction", names, kind, rubs):
        yield Source("friction", name, "", value, "1")


def _check_masses(sources: Sequence[Source], robot: Robot, sigmas: float) -> None:
    """Reject a mass that may be negative, to as many standard deviations as are asked about."""
    names = link_names(robot)
    for source in sources:
        if source.kind not in ("mass", "payload"):
            continue
        joint = (
            names.index(source.where) + 1
            if source.kind == "mass"
            else robot.frame(source.where).parentJoint
        )
        mass = float(robot.model.inertias[joint].mass)
        if sigmas * source.deviation >= mass:
            raise InvalidInputError(
                f"the {source.name} is known to {source.deviation:.3g} kg, and the link has "
                f"{mass:.3g} kg: within {sigmas:g} standard deviations it could be negative. Give "
                "a smaller one."
            )
