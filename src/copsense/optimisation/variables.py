"""Variables: what an optimisation may change, between which bounds, and what it may not.

The variables of the program are the coordinates that are named (those of a `PostureChart`), the
joints and base coordinates that follow, so that the contacts stay in place, and the logarithms of a
criterion's parameters. Lengths count in tenths of a metre, so that a step of one is as large for
each of them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from jaxtyping import Float, Int
from numpy.typing import ArrayLike

from copsense.arrays import check_type, finite_number
from copsense.batch.postures.coordinates import (
    BASE,
    Coordinates,
    Unit,
    chart_coordinates,
    coordinate_names,
    joint_units,
)
from copsense.content import ShortRepr
from copsense.design import Family
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.freedom import com_held, missing_joints
from copsense.magnitudes import check_angle
from copsense.path import COM_COORDINATES
from copsense.reach import SWEPT, check_coordinate, check_within_reach
from copsense.stance import Stance

Range = tuple[float, float]

_TENTH = 10.0  # of a metre, per unit of a variable
_TURN = math.radians(20.0)  # of the base about its axes, unless a range is given
_ROOM = 0.2  # of the CoM's height, how far the CoM goes, likewise
_PROBE, _FAST = 1e-5, 1e-6  # of a motion: its length, and the least share that moves a coordinate
_FREE = math.pi  # rad: of a joint without limits, likewise
GROUPS = ("com", "turn", "joints", "feet")
"""Names that stand for several coordinates; see `expand`."""


@dataclass(frozen=True, eq=False, repr=False)
class Variables(ShortRepr):
    """The variables of a program, in its own units.

    Attributes:
        plan: what the named coordinates mean on the stance.
        index: which of the plan's given numbers vary (n,).
        scale: units of a variable per metre, or radian (n,).
        lower: bounds (n,), minus infinity where there is none.
        upper: likewise.
        names: of what varies (n,), such as ``"l_knee"``.
        units: ``"m"`` or ``"rad"`` (n,).
        below: what each lower bound is (n,), in words.
        above: likewise.
        family: whose parameters vary too, behind the others, by their logarithms; or None.
    """

    plan: Coordinates
    index: Int[np.ndarray, " n"]
    scale: Float[np.ndarray, " n"]
    lower: Float[np.ndarray, " k"]
    upper: Float[np.ndarray, " k"]
    names: tuple[str, ...]
    units: tuple[str, ...]
    below: tuple[str, ...]
    above: tuple[str, ...]
    family: Family | None

    def __len__(self) -> int:
        """Number of variables, the criterion's among them."""
        return len(self.lower)

    def given(self, x: Float[np.ndarray, " k"]) -> np.ndarray:
        """The plan's given numbers where the variables are these."""
        found = self.plan.given.copy()
        found[self.index] = x[: len(self.index)] / self.scale
        return found

    def parameters(self, x: Float[np.ndarray, " k"]) -> tuple[float, ...]:
        """The criterion's parameters there."""
        return tuple(float(value) for value in np.exp(x[len(self.index) :]))

    def at(self, given: np.ndarray, parameters: ArrayLike = ()) -> Float[np.ndarray, " k"]:
        """The variables of given numbers and parameters, moved inside the bounds."""
        inside = np.concatenate([given[self.index] * self.scale, np.log(parameters)])
        return np.clip(inside, self.lower, self.upper)


def shown(value: float, unit: str) -> str:
    """A length in mm or an angle in degrees, as people read them."""
    if unit == "1":
        return f"{value:.4g}"
    # Plus zero: of what rounds to nothing the sign is not shown.
    if unit == "m":
        return f"{round(value * 1e3, 1) + 0.0:.1f} mm"
    return f"{round(math.degrees(value), 2) + 0.0:.2f} deg"


def usual_coordinates(stance: Stance) -> dict[str, Range]:
    """The CoM and the base's orientation, as far as the contacts let them go."""
    groups = _groups(stance)
    return expand(stance, [name for name in ("com", "turn") if groups[name]])


def expand(
    stance: Stance, over: Mapping[str, Range | float | None] | Iterable[str]
) -> dict[str, Range]:
    """Coordinate -> range, from what a caller writes.

    Args:
        stance: where the coordinates are.
        over: coordinate -> lowest and highest value, or how far to either side of the stance's own,
            or None for the usual range: a joint's limits, 20 deg of the base, a fifth of the CoM's
            height. ``"com"``, ``"turn"``, ``"joints"`` and ``"feet"`` stand for the CoM's
            coordinates, roll, pitch and yaw of the base, the joints that do not carry the
            contacts, and where these stand (x and y).

    Raises:
        UnknownNameError: a name that is not a coordinate.
        InvalidInputError: an empty range, a coordinate twice, or where a contact stands without a
            range.
    """
    ranges = over if isinstance(over, Mapping) else dict.fromkeys(over)
    valid, members = coordinate_names(stance), _groups(stance)
    found: dict[str, Range] = {}
    for name, given in ranges.items():
        if name not in valid and name not in GROUPS:
            raise UnknownNameError(
                f"coordinate of robot {stance.robot.name!r}", str(name), (*GROUPS, *valid)
            )
        if name in GROUPS and name not in valid and isinstance(given, tuple | list):
            raise InvalidInputError(
                f"{name} stands for several coordinates, which have no range in common. Give how "
                f"far to either side they go, such as {name}=+-30mm, or name them one by one."
            )
        own = [name] if name in valid else members[name]
        if not own:
            raise InvalidInputError(
                f"robot {stance.robot.name!r} has nothing that {name} stands for. Leave it out."
            )
        for each in own:
            if each in found:
                raise InvalidInputError(f"{each} is named twice. Name each coordinate once.")
            found[each] = _range(stance, each, given)
    return found


def _groups(stance: Stance) -> dict[str, list[str]]:
    """The coordinates that each of `GROUPS` stands for; none where the robot has none."""
    valid = coordinate_names(stance)
    carry = {stance.robot.model.names[joint] for c in stance.contacts for joint in stance.limb(c)}
    return {
        "com": [n for n in COM_COORDINATES if n in valid and com_moves(stance, n)],
        "turn": [n for n in BASE[3:] if n in valid and BASE.index(n) not in _held_fast(stance)],
        "joints": [n for n in stance.robot.joint_names if n in valid and n not in carry],
        "feet": [n for n in valid if n.endswith((":x", ":y"))],
    }


def com_moves(stance: Stance, name: str) -> bool:
    """Whether the contacts let the CoM move along an axis, ``"com_x"`` say."""
    axis = COM_COORDINATES.index(name)
    return not (stance.robot.base_nv != 6 and axis == 0) and not com_held(stance, axis)


def _range(stance: Stance, name: str, given: Range | float | None) -> Range:
    chart = chart_coordinates(stance, [name])
    own, unit = float(chart.given[chart.place[0]]), chart.units[0]
    if given is None:
        return _usual_range(stance, name, own, chart)
    if isinstance(given, int | float):
        width = finite_number(given, f"the range of {name}", positive=True)
        what = f"how far {name} may go to either side"
        if unit == "m":
            check_within_reach(stance.robot, width, what, SWEPT)
        else:
            check_angle(width, what)
        return own - width, own + width
    check_type(given, (tuple, list), f"a range of {name}", "Give lowest and highest value.")
    low, high = (finite_number(value, f"the range of {name}") for value in given)
    if not low < high:
        raise InvalidInputError(
            f"the range of {name}, {shown(low, unit)} to {shown(high, unit)}, is empty: nothing "
            "could vary. Give LOW < HIGH, or leave it out to keep it where it is."
        )
    for end in (low, high):
        check_coordinate(stance.robot, name, unit, own, end)
    return low, high


def _usual_range(stance: Stance, name: str, own: float, chart: Coordinates) -> Range:
    if ":" in name:
        raise InvalidInputError(
            f"where {name.partition(':')[0]} may stand is not known. Give a range of {name}, such "
            f"as {name}=+-{'5deg' if name.endswith('yaw') else '30mm'}."
        )
    if name in stance.robot.joint_names:
        joint = int(chart.place[0]) - stance.robot.base_nv
        low, high = float(chart.low[joint]), float(chart.high[joint])
        return (
            low if math.isfinite(low) else own - _FREE,
            high if math.isfinite(high) else own + _FREE,
        )
    if name in BASE[3:]:
        return own - _TURN, own + _TURN
    ground = np.mean([place.translation[2] for place in stance.placements])
    reach = _ROOM * abs(float(stance.com[2] - ground))
    return own - reach, own + reach


def variables_of(
    stance: Stance,
    ranges: Mapping[str, Range],
    within: Mapping[str, Range],
    reserve: Mapping[str, float],
    family: Family | None,
) -> tuple[Variables, dict[str, Range]]:
    """Lay out the variables of a program.

    Args:
        stance: where they begin.
        ranges: coordinate that varies -> its range [m, rad].
        within: coordinate or joint that follows -> where it must stay.
        reserve: joint -> how far inside its limits it must stay [rad, m].
        family: whose parameters vary too.

    Returns:
        The variables, and those of `within` that are not variables themselves.

    Raises:
        InvalidInputError: constraints that contradict each other, or a robot that is not covered.
    """
    robot = stance.robot
    if stance.hanging_motions.shape[1]:
        raise InvalidInputError(
            f"robot {robot.name!r} has joints that hang, or springs that settle, at an equilibrium "
            "of their own: it cannot be optimised. Lock or couple them (--lock, --couple), or look "
            "for postures with copsense map."
        )
    fast = set() if any(":" in name for name in ranges) else _held_fast(stance)
    for name in ranges:
        if name in COM_COORDINATES and (held := com_held(stance, COM_COORDINATES.index(name))):
            raise InvalidInputError(held)
    plan = chart_coordinates(stance, tuple(ranges))
    for name, place in zip(plan.names, plan.place, strict=True):
        if int(place) in fast:
            lacking = "; ".join(missing_joints(stance))
            raise InvalidInputError(
                f"the contacts of {robot.name!r} hold {name} fast: no posture with them in place "
                "moves it."
                + (f" {lacking[0].upper()}{lacking[1:]}." if lacking else "")
                + " Let another coordinate vary."
            )
    moved = {u for limb in plan.limbs for u in limb.unknowns if ranges}
    closing = _closing(stance, moved | {int(p) for p in plan.place})
    if closing:  # loops and couplings tie base and limbs together
        moved |= {*range(robot.base_nv), *closing}
    index = np.array(sorted(({int(p) for p in plan.place} | moved) - fast), dtype=int)
    labels, units = _labels(stance)
    low, high = np.full(len(plan.given), -np.inf), np.full(len(plan.given), np.inf)
    below, above = [""] * len(low), [""] * len(low)
    nb, limits = robot.base_nv, robot.position_limits
    for joint in range(robot.model.nv - nb):
        at, name = nb + joint, labels[nb + joint]
        spare, unit = reserve.get(name, 0.0), units[at]
        # A stance that is beyond a limit is allowed to be, unless a reserve is asked for.
        a, b = (x[joint] for x in (limits if name in reserve else (plan.low, plan.high)))
        low[at], high[at] = a + spare, b - spare
        below[at] = f"{name} at its lower limit of {shown(a, unit)}"
        above[at] = f"{name} at its upper limit of {shown(b, unit)}"
        if spare:
            below[at] += f" plus its reserve of {shown(spare, unit)}"
            above[at] += f" less its reserve of {shown(spare, unit)}"
        if low[at] > high[at]:
            raise InvalidInputError(
                f"contradictory constraints: joint {name} moves from {shown(a, unit)} to "
                f"{shown(b, unit)}, which leaves no room for a reserve of {shown(spare, unit)} at "
                "both ends. Give less."
            )
    places = dict(zip(plan.names, plan.place.tolist(), strict=True))
    places |= {name: i for i, name in enumerate(labels) if name and name not in places}
    rest: dict[str, Range] = {}
    for what, asked in (("its range", ranges), ("where it must stay", within)):
        for name, (a, b) in asked.items():
            at = places[name]
            if what != "its range" and at not in index and name in COM_COORDINATES:
                rest[name] = (a, b)  # follows from the posture
                continue
            if a > low[at]:
                low[at], below[at] = a, f"{name} at {shown(a, units[at])}, the lower end of {what}"
            if b < high[at]:
                high[at], above[at] = b, f"{name} at {shown(b, units[at])}, the upper end of {what}"
            if low[at] > high[at]:
                raise InvalidInputError(
                    f"contradictory constraints on {name}: {below[at].partition(' at ')[2]}, is "
                    f"above {above[at].partition(' at ')[2]}. Widen one of them."
                )
    _check_kept(plan, index, low, high, labels, units, below, above)
    scale = np.where([units[i] == "m" for i in index], _TENTH, 1.0)
    logs = np.log(np.array(family.bounds if family else (), dtype=float)).reshape(-1, 2)
    parameters = family.parameters if family else ()
    bounds = family.bounds if family else ()
    return Variables(
        plan,
        index,
        scale,
        np.concatenate([low[index] * scale, logs[:, 0]]),
        np.concatenate([high[index] * scale, logs[:, 1]]),
        (*(labels[i] for i in index), *parameters),
        (*(units[i] for i in index), *("1" for _ in parameters)),
        (
            *(below[i] for i in index),
            *(f"{p} at {a:g}, its least" for p, (a, _) in zip(parameters, bounds, strict=True)),
        ),
        (
            *(above[i] for i in index),
            *(f"{p} at {b:g}, its most" for p, (_, b) in zip(parameters, bounds, strict=True)),
        ),
        family,
    ), rest


def _held_fast(stance: Stance) -> set[int]:
    """Which of a plan's given numbers no motion moves, where contacts hold some to second order.

    As base roll and hip roll on legs without ankle roll. The solver would see them free at every
    posture in place, and creep.
    """
    if not stance.false_motions.shape[1]:
        return set()
    model, names = stance.robot.model, coordinate_names(stance)
    moves = np.zeros(model.nv, dtype=bool)
    for motion in stance.admissible_motions.T:
        ahead, behind = (
            stance.at(pin.integrate(model, stance.q, step * motion), check=False)
            for step in (_PROBE, -_PROBE)
        )
        rates = np.subtract(
            *(chart_coordinates(s, names[:1]).given[: model.nv] for s in (ahead, behind))
        )
        moves |= np.abs(rates) > 2 * _PROBE * _FAST
    return set(np.flatnonzero(~moves).tolist())


def _closing(stance: Stance, moved: set[int]) -> set[int]:
    """Velocities that move along with some others, for loops and couplings to stay closed."""
    if stance.closures is None:
        return set()
    tied = [set(np.flatnonzero(row).tolist()) for row in stance.closures.jacobian]
    found: set[int] = set()
    while more := {v for row in tied if row & (moved | found) for v in row} - found:
        found |= more
    return found


def _labels(stance: Stance) -> tuple[list[str], list[Unit]]:
    """Name and unit of each of a plan's given numbers."""
    joints = joint_units(stance)
    planar: tuple[str, ...] = ("base_y", "base_z", "roll")
    base = BASE if stance.robot.base_nv == 6 else planar
    names = [*base, *(name for name, _ in joints), *COM_COORDINATES]
    turns = ("roll", "pitch", "yaw")
    units: list[Unit] = ["rad" if name in turns else "m" for name in base]
    units += [unit for _, unit in joints] + ["m"] * 3
    for contact in stance.contacts:
        names += [f"{contact.name}:{way}" for way in ("x", "y", "yaw")]
        units += ["m", "m", "rad"]
    return names, units


def _check_kept(
    plan: Coordinates,
    index: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    labels: Sequence[str],
    units: Sequence[str],
    below: Sequence[str],
    above: Sequence[str],
) -> None:
    """Reject a constraint that something breaks which does not move."""
    for at in set(range(len(low))) - set(index.tolist()):
        own = plan.given[at]
        for broken, bound in ((own < low[at] - 1e-9, below), (own > high[at] + 1e-9, above)):
            if broken:
                raise InvalidInputError(
                    f"contradictory constraints: {labels[at]} does not vary and stays at "
                    f"{shown(own, units[at])}, beyond the bound {bound[at]}. Let it vary "
                    f"(--over {labels[at]}), or widen the bound."
                )


def reserves_of(stance: Stance, reserve: Mapping[str, float] | float | None) -> dict[str, float]:
    """Joint -> how far inside its limits it must stay.

    Args:
        stance: whose joints.
        reserve: part of the joints' names -> reserve [rad, or m]; ``"rest"`` is of the others; or
            one number for all that turn.

    Raises:
        InvalidInputError: a negative reserve, or a part that no joint's name has.
    """
    given = {"rest": reserve} if isinstance(reserve, int | float) else dict(reserve or {})
    found: dict[str, float] = {}
    names = dict(joint_units(stance))
    for part, value in given.items():
        value = finite_number(value, f"the reserve of {part}")
        if value < 0:
            raise InvalidInputError(
                f"the reserve of {part} is negative: joints would pass their limits. Give 0 or "
                "more."
            )
        if part == "rest":
            continue
        own = [name for name in names if part.lower() in name.lower()]
        if not own:
            raise UnknownNameError("joint, or part of a joint's name", part, (*names, "rest"))
        found |= dict.fromkeys(own, value)
    if "rest" in given:
        others = [n for n, unit in names.items() if n not in found and unit == "rad"]
        found |= dict.fromkeys(others, float(given["rest"]))
    return found
