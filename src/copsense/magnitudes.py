"""Magnitudes: numbers that only another unit explains, and what they would be in it.

copsense takes metres, radians, newtons and kilograms; the command line takes angles in degrees.
Limits are generous: a number beyond them is of no robot, be it 3 cm or 6 m high.
"""

from __future__ import annotations

import math
import warnings

from copsense.errors import InvalidInputError

LONGEST = 20.0  # m: no part of a robot is longer
LONGEST_SOLE = 5.0  # m
_MASSES = 3.0  # of a robot, from which its payload is doubted
_STICKY = 20.0  # times the normal force, from which friction is doubted
_BEYOND = 10.0  # times its range, from which a slide's position is not metres
_STRONG = 10.0  # times the weight at its reach, from which a torque is doubted
_TURN = 2 * math.pi * (1 + 1e-9)


class MagnitudeWarning(UserWarning):
    """A number that is hardly meant in the unit it is taken in."""


def in_metres(value: float) -> str:
    """What a length [m] would be had it been given in millimetres, a sentence."""
    return (
        f"Lengths are in metres: {abs(value):.4g} mm are {abs(value) / 1e3:.4g} m "
        f"({abs(value):.4g}mm on the command line)."
    )


def in_radians(value: float) -> str:
    """What an angle [rad] would be had it been given in degrees, a sentence."""
    return (
        f"Angles are in radians (in degrees on the command line): {value:.4g} degrees are "
        f"{math.radians(value):.4g}."
    )


def check_length(metres: float, what: str, most: float = LONGEST) -> None:
    """Reject a length that is not in metres.

    Args:
        metres: the length; its sign does not count.
        what: how the message calls it.
        most: the longest that may be meant [m].

    Raises:
        InvalidInputError: it is longer.
    """
    if abs(metres) > most:
        raise InvalidInputError(f"{what} is {metres:.4g} m. {in_metres(metres)}")


def doubt_length(metres: float, what: str) -> None:
    """Warn of a length that may be meant, and is hardly in metres."""
    if abs(metres) > LONGEST:
        warnings.warn(
            f"{what} is {metres:.4g} m. {in_metres(metres)}", MagnitudeWarning, stacklevel=3
        )


def check_angle(radians: float, what: str) -> None:
    """Reject an angle of more than a turn, which is not in radians.

    Raises:
        InvalidInputError: it is more.
    """
    if abs(radians) > _TURN:
        raise InvalidInputError(
            f"{what} is {radians:.4g} rad, {abs(radians) / (2 * math.pi):.3g} turns. "
            f"{in_radians(radians)}"
        )


def check_joint_position(
    position: float, joint: str, unit: str, lower: float, upper: float
) -> None:
    """Reject a position that only another unit explains; one without limits is doubted.

    Args:
        position: of the joint [rad, or m].
        joint: its name.
        unit: ``"rad"`` or ``"m"``.
        lower: its lowest position; -inf where there is no limit.
        upper: its highest.

    Raises:
        InvalidInputError: it is beyond the joint's range, by so much that it is not in its unit.
    """
    if lower <= position <= upper and math.isfinite(upper - lower):
        return
    ends = [abs(end) for end in (lower, upper) if math.isfinite(end)]
    most = _TURN if unit == "rad" else max([1.0, *(_BEYOND * end for end in ends)])
    if abs(position) <= most:
        return
    if not lower <= position <= upper:
        hint = in_radians(position) if unit == "rad" else in_metres(position)
        raise InvalidInputError(
            f"the position of joint {joint!r} is {position:.4g} {unit}, and its range goes from "
            f"{lower:.4g} to {upper:.4g} {unit}. {hint}"
        )
    far, hint = ("a turn", in_radians(90.0)) if unit == "rad" else ("a metre", in_metres(100.0))
    warnings.warn(
        f"joint {joint!r}, which has no limits, is put beyond {far}. {hint}",
        MagnitudeWarning,
        stacklevel=4,
    )


def doubt_payload(kilograms: float, robot: str, mass: float, what: str) -> None:
    """Warn of a payload that is heavier than a robot [kg] carries."""
    if abs(kilograms) > _MASSES * mass:
        warnings.warn(
            f"{what} is {kilograms:.4g} kg, {abs(kilograms) / mass:.3g} times the mass of "
            f"{robot!r}. Masses are in kilograms: {kilograms:.4g} g are {kilograms / 1e3:.4g} kg.",
            MagnitudeWarning,
            stacklevel=3,
        )


def doubt_torque(newton_metres: float, most: float, what: str) -> None:
    """Warn of a torque that is many times what a robot's weight makes at its reach, `most` [Nm]."""
    if abs(newton_metres) > _STRONG * most:
        warnings.warn(
            f"{what} is {newton_metres:g} Nm, {abs(newton_metres) / most:.3g} times what the "
            f"robot's weight makes at its reach. Torques are in Nm: {newton_metres:g} Nmm are "
            f"{newton_metres / 1e3:g} Nm.",
            MagnitudeWarning,
            stacklevel=3,
        )


def doubt_friction(coefficient: float, what: str) -> None:
    """Warn of a coefficient of friction that no sole and floor have."""
    if coefficient > _STICKY:
        warnings.warn(
            f"{what} is {coefficient:.4g}. It is a ratio of forces, 0.3 to 1.2 for most soles: "
            f"{coefficient:.4g} % are {coefficient / 100:.4g}.",
            MagnitudeWarning,
            stacklevel=3,
        )
