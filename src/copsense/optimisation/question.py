"""Question: what is asked of an optimisation, checked, and the programs that it makes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from copsense.arrays import finite_number
from copsense.content import ShortRepr
from copsense.criterion import Criterion, check_criterion, minimum_torque
from copsense.design import Family, family_named
from copsense.errors import InvalidInputError
from copsense.limits import Limits, check_limits
from copsense.magnitudes import doubt_torque, in_metres
from copsense.optimisation.objectives import Gauge, Quantity, quantity_named
from copsense.optimisation.posture_program import PostureProgram
from copsense.optimisation.variables import (
    Range,
    Variables,
    expand,
    reserves_of,
    shown,
    usual_coordinates,
    variables_of,
)
from copsense.reach import SWEPT, check_within_reach, robot_reach
from copsense.stance import Stance, check_at_rest, check_stance
from copsense.statics import with_tie_break

Progress = Callable[[int], object]
Over = Mapping[str, "Range | float | None"] | Iterable[str]

ITERATIONS = 600  # of the solver, from each start


@dataclass(frozen=True, eq=False)
class Question(ShortRepr):
    """What is asked, checked."""

    stance: Stance
    criterion: Criterion
    limits: Limits
    variables: Variables
    within: Mapping[str, Range]
    distance: Range | None
    gauge: Gauge

    def program(self, objective: Quantity, require: Mapping[str, float]) -> PostureProgram:
        """The program of an objective, within bounds on other quantities."""
        return PostureProgram(
            self.stance,
            self.criterion,
            self.variables,
            self.gauge,
            objective,
            require=require,
            within=self.within,
            distance=self.distance,
        )


def asked(
    stance: Stance,
    criterion: Criterion | None,
    limits: Limits | None,
    over: Over | None,
    within: Mapping[str, Range] | None,
    reserve: Mapping[str, float] | float | None,
    distance: Range | None,
    family: Family | str | None,
    frame: str | None,
) -> tuple[Question, list[str]]:
    """Check what is asked; arguments and errors are those of `optimise`.

    Returns:
        The question, and what to know about the robot.
    """
    check_stance(stance)
    check_at_rest(stance, "an optimisation")
    if criterion is not None:
        check_criterion(criterion)
        if family is not None:
            raise InvalidInputError(
                "a criterion and a family of criteria are both given. Give one of them."
            )
    limits = Limits() if limits is None else limits
    check_limits(limits)
    chosen = None if family is None else family_named(stance, family)
    ranges = usual_coordinates(stance) if over is None else expand(stance, over)
    if not ranges and family is None:
        raise InvalidInputError(
            "no coordinate may vary, so there is nothing to optimise. Name one, such as com_z, or "
            "give a family of criteria, whose weights vary."
        )
    kept, spare = expand(stance, within or {}), reserves_of(stance, reserve)
    variables, rest = variables_of(stance, ranges, kept, spare, chosen)
    if distance is not None:
        low, high = distance
        low = finite_number(low, "the least distance of two contacts [m]")
        if not low < high:
            raise InvalidInputError(
                f"contradictory constraints: two contacts are to be at least {shown(low, 'm')} and "
                f"at most {shown(high, 'm')} apart. Give LOW < HIGH."
            )
        check_within_reach(stance.robot, low, "the least distance of two contacts", SWEPT)
        distance = (low, float(high))
    shares = with_tie_break(stance, minimum_torque() if criterion is None else criterion)
    gauge = Gauge(stance, limits, frame)
    notes = [*stance.robot.notes]
    question = Question(stance, shares, limits, variables, rest, distance, gauge)
    return question, notes


def required_of(
    stance: Stance, require: Mapping[str, float] | None, *objectives: Quantity
) -> dict[str, float]:
    """Check the bounds on quantities other than the objectives.

    Raises:
        UnknownNameError: no such quantity.
        InvalidInputError: an objective, not a number, or more than there can be of the quantity.
    """
    robot, found = stance.robot, {}
    for name, value in (require or {}).items():
        quantity = quantity_named(name, "quantity")
        if quantity in objectives:
            raise InvalidInputError(
                f"{name} is what is optimised, and required as well. Leave one of them out."
            )
        found[name] = finite_number(value, f"the required {name}")
        if found[name] < 0 and quantity.sign < 0:
            raise InvalidInputError(
                f"the required {name} is {quantity.shown(found[name])} at most, and nothing has "
                "less than zero of it. Give a positive number."
            )
        _check_size(quantity, found[name], robot.weight)
        if name == "torque":
            doubt_torque(found[name], robot.weight * robot_reach(robot), f"the required {name}")
    return found


def _check_size(quantity: Quantity, value: float, weight: float) -> None:
    """Reject a bound that no posture of any robot keeps.

    Raises:
        InvalidInputError: it is more than is measured of the quantity; the message says the unit.
    """
    most = quantity.most(weight)
    if value <= most:
        return
    why = {
        "m": f"travels of the CoM are measured up to {most:g} m. {in_metres(value)}",
        "N": f"pushes are measured up to the robot's weight, {most:.4g} N. Give less.",
        "1": f"it is a share of a limit, 1 at most: {value:.4g} % are {value / 100:.4g}.",
    }[quantity.unit]
    unit = "" if quantity.unit == "1" else f" {quantity.unit}"
    raise InvalidInputError(f"the required {quantity.name} is {value:g}{unit}, and {why}")
