"""changed: a stance of a robot with other hardware, whole and not linearised.

It is what the derivatives of `rates` are held against, and what sweeps are made of.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from copsense.contact import Contact
from copsense.criterion import Criterion
from copsense.drives import Drives, Spring
from copsense.errors import InvalidInputError
from copsense.hardware.parameter import Alteration, Parameter
from copsense.hardware.parameter_list import check_parameters
from copsense.posture import solve_posture
from copsense.robot import Robot
from copsense.stance import Stance
from copsense.terms import TorqueTerm


def changed(
    stance: Stance, criterion: Criterion, values: Mapping[Parameter, float]
) -> tuple[Stance, Criterion]:
    """The stance of a robot with other hardware, and the criterion on it.

    Its contacts stand where they did, its centre of mass is over the same point, and its posture is
    the nearest to what it was.

    Args:
        stance: of the robot as it is.
        criterion: what shares the load; another one where servos change.
        values: parameter -> what it is instead.

    Raises:
        InvalidInputError: a value that the parameter cannot have, or one of another robot.
        UnreachablePostureError: no posture of such a robot has its contacts there.
    """
    check_parameters(stance, tuple(values))
    steps = [(p.alteration, p.checked(value) - p.nominal) for p, value in values.items()]
    model = stance.robot.model.copy()
    for change, d in steps:
        _reshape(model, stance.robot, change, d)
    robot = stance.robot.with_dynamics(model, _with_springs(stance.robot.drives, steps))
    contacts = [_moved(contact, robot, steps) for contact in stance.contacts]
    there = Stance(robot, stance.q, contacts, False, stance.loads)
    x, y, _ = stance.com.tolist()
    com = (x if robot.base_nv == 6 else None, y, None)
    found = solve_posture(there, com=com, targets=stance.placements)
    return found.stance, _with_servos(criterion, stance, steps)


def _reshape(model: pin.Model, robot: Robot, change: Alteration, d: float) -> None:
    """Move joints on their links, and change what the links weigh."""
    for joint, moved in change.joints.items():
        place = model.jointPlacements[joint]
        model.jointPlacements[joint] = pin.SE3(place.rotation, place.translation + d * moved)
    for joint, (u, length) in change.stretches.items():
        model.inertias[joint] = _stretched(model.inertias[joint], u, d / length)
    for joint, kg in change.masses.items():
        body = model.inertias[joint].copy()
        body.mass = body.mass + d * kg
        model.inertias[joint] = body


def _stretched(body: pin.Inertia, u: Float[np.ndarray, " 3"], by: float) -> pin.Inertia:
    """A body whose every point x moves by (u . x) u times a share, its mass staying."""
    if not body.mass:
        return body
    F = np.eye(3) + by * np.outer(u, u)
    central = np.array(body.inertia)
    spread = F @ (np.trace(central) / 2 * np.eye(3) - central) @ F.T  # second moments of the mass
    return pin.Inertia(body.mass, F @ np.array(body.lever), np.trace(spread) * np.eye(3) - spread)


def _moved(contact: Contact, robot: Robot, steps: Sequence[tuple[Alteration, float]]) -> Contact:
    """The contact with its frame elsewhere on the link, and its sole stretched."""
    turned = robot.frame(contact.frame).placement.rotation
    offset, polygon = np.array(contact.offset), contact.polygon
    for change, d in steps:
        if contact.name in change.contacts:
            offset = offset + d * (turned.T @ change.contacts[contact.name])
        stretch = change.soles.get(contact.name)
        if stretch is not None and polygon is not None:
            polygon = polygon.copy()
            away = polygon[:, stretch.axis] - stretch.fixed
            polygon[:, stretch.axis] += d * away / stretch.extent
    x, y, z = offset.tolist()
    return replace(contact, offset=(x, y, z), polygon=polygon)


def _with_springs(drives: Drives, steps: Sequence[tuple[Alteration, float]]) -> Drives:
    springs = dict(drives.springs)
    for change, d in steps:
        for joint in change.springs:
            springs[joint] = Spring(springs[joint].stiffness + d, springs[joint].rest)
    return replace(drives, springs=springs) if springs != dict(drives.springs) else drives


def _with_servos(
    criterion: Criterion, stance: Stance, steps: Sequence[tuple[Alteration, float]]
) -> Criterion:
    """The criterion whose first term, a compliance for each motor, has these motors stiffer."""
    if not any(change.servos for change, _ in steps):
        return criterion
    first = criterion.terms[0]
    if not isinstance(first, TorqueTerm):
        raise InvalidInputError(
            f"criterion {criterion.name!r} has no stiffnesses of joints. Use "
            "copsense.stiffness.stiffness (--criterion stiffness:...)."
        )
    compliances = np.diag(criterion.at(stance).torque).copy()
    for change, d in steps:
        for name in change.servos:
            i = stance.robot.torque_names.index(name)
            compliances[i] = 1.0 / (1.0 / compliances[i] + d)
    return replace(criterion, terms=(TorqueTerm(compliances), *criterion.terms[1:]))
