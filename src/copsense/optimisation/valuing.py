"""Valuing: what a posture is worth, and what an optimum says of itself."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from copsense.criterion import Criterion
from copsense.errors import CopsenseError
from copsense.limits import Limits
from copsense.optimisation.objectives import QUANTITIES, TRAVELS, way_of
from copsense.optimisation.optimum import PROVEN, Binding, ExactTravel, Optimum, Valuation
from copsense.optimisation.posture_program import PostureProgram
from copsense.optimisation.question import Question
from copsense.optimisation.solver import Solution
from copsense.optimisation.variables import com_moves
from copsense.path import COM_COORDINATES, LateralPath
from copsense.scan import PathScan
from copsense.stance import Stance
from copsense.statics import solve_equilibrium

_SPREAD = 0.01  # relative: starts that end farther apart than this ended in different optima


def valued(
    question: Question, stance: Stance, criterion: Criterion, x: Float[np.ndarray, " k"] | None
) -> Valuation:
    """What a posture is worth: every quantity, and the exact travels.

    Args:
        question: what is asked.
        stance: the posture.
        criterion: what shares the load there.
        x: its variables; None for the stance that the question begins with.
    """
    variables, found = question.variables, {}
    equilibrium = solve_equilibrium(stance, criterion)
    for name, quantity in QUANTITIES.items():
        try:
            found[name] = question.gauge.measure(quantity, equilibrium)
        except (CopsenseError, ValueError):
            found[name] = math.nan
    given = variables.plan.given if x is None else variables.given(x)
    places = zip(variables.plan.names, variables.plan.place, strict=True)
    family = variables.family
    parameters = {}
    if family is not None and x is not None:
        parameters = dict(zip(family.parameters, variables.parameters(x), strict=True))
    return Valuation(
        stance,
        criterion,
        found,
        exact_travels(stance, criterion, question.limits),
        {name: float(given[at]) for name, at in places},
        parameters,
    )


def exact_travels(stance: Stance, criterion: Criterion, limits: Limits) -> tuple[ExactTravel, ...]:
    """How far the CoM may go along both level axes, as far as the contacts let it move so."""
    found = []
    for coordinate in COM_COORDINATES[1::-1]:
        if not com_moves(stance, coordinate):
            continue
        scan = PathScan(LateralPath(stance, coordinate=coordinate), criterion)
        for side in (1, -1):
            first, way = scan.travel(limits, side).first, way_of(coordinate, side)
            if first is None or first.exact is None:
                found.append(ExactTravel(way, math.inf, ""))
            else:
                found.append(ExactTravel(way, first.exact, first.name))
    return tuple(found)


def optimum_of(
    question: Question,
    program: PostureProgram,
    best: Solution,
    objective: str,
    reached: tuple[float, ...],
    taken: int,
    exact: bool,
    notes: tuple[str, ...],
    iterations: int,
) -> Optimum:
    """The answer, with its notes.

    Args:
        question: what was asked.
        program: the one that was solved last.
        best: where it ended.
        objective: name of what was optimised.
        reached: from each start.
        taken: iterations in all.
        exact: whether the exact paths were the objective at the end.
        notes: what is known already.
        iterations: that were allowed from a start.
    """
    variables, quantity = question.variables, QUANTITIES[objective]
    after = valued(question, program.settled(best.x), program.criterion(best.x), best.x)
    before = valued(question, question.stance, question.criterion, None)
    said = list(notes)
    values = [v for v in reached if math.isfinite(v)]
    if len(values) > 1 and np.ptp(values) > _SPREAD * max(map(abs, values)):
        order = " to first order" if objective in TRAVELS else ""
        said.append(
            f"the starts ended in different optima, {quantity.shown(min(values))} to "
            f"{quantity.shown(max(values))}{order}: more starts (--starts) may find a better one."
        )
    there = f"{quantity.shown(after.worth(objective))} was reached"
    if not best.finished:
        said.append(
            f"the solver stopped early ({best.message}; at most {iterations} iterations from a "
            f"start): {there}, with a KKT residual of {best.residual:.1e}. More iterations "
            "(--iterations) may go farther."
        )
    elif best.residual > PROVEN:
        said.append(
            f"the solver ended by itself: {there}, but the KKT residual of {best.residual:.1e} is "
            f"over {PROVEN:g}, so that this is not proven to be an optimum. Other starts "
            "(--starts, --seed) may go farther."
        )
    units = dict(zip(variables.plan.names, variables.plan.units, strict=True))
    return Optimum(
        objective,
        before,
        after,
        question.limits,
        units,
        _binding(program, best),
        best.residual,
        best.finished,
        taken,
        reached,
        exact,
        tuple(said),
    )


def _binding(program: PostureProgram, best: Solution) -> tuple[Binding, ...]:
    variables, rows = program.variables, set(program.row_names)
    most = max(best.multipliers.values(), default=1.0)
    found = [
        Binding(name, 0.0, value / most, "objective" if name in rows else "constraint")
        for name, value in best.multipliers.items()
        if value > 1e-3 * most
    ]
    scale = [*variables.scale, *[1.0] * (len(variables) - len(variables.scale))]
    largest = max((abs(value) for value in best.bounds.values()), default=1.0)
    for i, value in sorted(best.bounds.items(), key=lambda pair: -abs(pair[1])):
        if abs(value) > 1e-3 * largest:
            name = variables.above[i] if value > 0 else variables.below[i]
            price = abs(value) * scale[i] / program.scale
            found.append(Binding(name, price, abs(value) / largest, "bound", variables.units[i]))
    return tuple(found)
