"""optimise: the posture, and with it the criterion's weights, that do best within constraints."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from copsense.arrays import whole_number
from copsense.blas import one_blas_thread
from copsense.criterion import Criterion
from copsense.design import Family
from copsense.errors import CopsenseError, InvalidInputError
from copsense.limits import Limits
from copsense.listing import listed
from copsense.optimisation.objectives import TRAVELS, Quantity, quantity_named
from copsense.optimisation.optimum import SIDES, ExactTravel, Optimum
from copsense.optimisation.posture_program import PostureProgram
from copsense.optimisation.question import ITERATIONS, Over, Progress, Question, asked, required_of
from copsense.optimisation.searching import best_of, from_feasible
from copsense.optimisation.solver import Solution, judge, solve
from copsense.optimisation.starts import starts_of, weights_tried
from copsense.optimisation.valuing import exact_travels, optimum_of
from copsense.optimisation.variables import Range
from copsense.stance import Stance

_REFINING = 200  # of them, for the exact path
_FARTHER = 1.2  # of the smallest travel: ways with more are not looked at in a round
_NEAR = 0.3  # of the variables: the paths' ends follow the posture so far, all but linearly
_ROUNDS = 4  # of these
_ROUNDING = 1e-9  # relative, of a travel
_SAME = 1e-4  # relative: a travel that changed less is the same
_CROSSED = 1e-6  # of the constraints, by which a place may break them
_STILL = 1e-7  # of the variables: slopes under which a coordinate moves nothing


@one_blas_thread()
def optimise(
    stance: Stance,
    criterion: Criterion | None = None,
    limits: Limits | None = None,
    *,
    objective: str = "travel",
    over: Over | None = None,
    within: Mapping[str, Range] | None = None,
    reserve: Mapping[str, float] | float | None = None,
    distance: Range | None = None,
    require: Mapping[str, float] | None = None,
    family: Family | str | None = None,
    frame: str | None = None,
    starts: int = 4,
    seed: int = 0,
    iterations: int = ITERATIONS,
    progress: Progress | None = None,
) -> Optimum:
    """Look for the posture that does best within constraints, its contacts in place.

    A nonlinear program in epigraph form, solved by SciPy's SLSQP from several starts. Of a travel
    the search follows the slack's first order; from the best place that it found, the travel along
    the exact lateral path is then maximised and verified.

    Args:
        stance: robot, contacts, and what does not vary.
        criterion: what shares the load; default ``minimum_torque()``.
        limits: what the wrenches and torques must respect; default ``Limits()``.
        objective: ``"travel"`` (any horizontal way), ``"sideways"``, ``"margin"`` or ``"push"``, to
            be made large, or ``"gain"`` or ``"torque"``, to be made small; see `QUANTITIES`.
        over: what varies: coordinate of `copsense.batch.PostureChart` -> lowest and highest value
            [m, rad], or how far to either side, or None for the usual range. ``"com"``, ``"turn"``
            (of the base), ``"joints"`` (off the limbs in contact) and ``"feet"`` stand for several.
            Default ``com`` and ``turn``. What is not named keeps the stance's value; the limbs in
            contact follow. Empty, with a family: the posture stays, as in `design_criterion`.
        within: coordinate or joint that need not be named -> where it must stay [m, rad].
        reserve: part of the joints' names -> how far inside their limits they must stay [rad, or
            m], such as ``{"knee": 0.035}``; or one number for all.
        distance: least and largest horizontal distance of any two contacts [m].
        require: other quantity -> the least (the most, of gain and torque) that it may be, such as
            ``{"torque": 20.0}``.
        family: criteria whose parameters vary too, one of `copsense.design.families` or its name;
            instead of `criterion`.
        frame: what is pushed, where pushes are asked for; default the base.
        starts: postures that the search begins from: the stance, and the best of a sample.
        seed: of the sample.
        iterations: of the solver, from each start, at most.
        progress: called with 1 after each iteration.

    Raises:
        InvalidInputError: constraints that contradict each other by themselves, a range that is
            empty, coordinates that move nothing, or a robot that is not covered.
        UnreachablePostureError: no posture that keeps all constraints was found; the message names
            those that contradict each other.
        UnknownNameError: an objective, coordinate, joint, family or frame that does not exist.
    """
    question, notes = asked(
        stance, criterion, limits, over, within, reserve, distance, family, frame
    )
    wanted = quantity_named(objective)
    required = required_of(stance, require, wanted)
    starts = whole_number(starts, "the number of starts")
    seed = whole_number(seed, "the seed", least=0)
    iterations = whole_number(iterations, "the number of iterations")
    program = question.program(wanted, required)
    if not program.row_names:
        raise InvalidInputError(
            f"the limits limit nothing here, so there is no {objective}. Give limits that this "
            "stance has: a sole, a friction coefficient or a torque bound."
        )
    program.check()
    begin = starts_of(program, starts, seed)
    still = _still(program, begin[0])
    if len(still) == len(question.variables.plan.names) and question.variables.family is None:
        raise InvalidInputError(
            f"{listed(still)} {'moves' if len(still) == 1 else 'move'} nothing that counts for "
            f"{objective}: there is nothing to optimise. Let another coordinate vary."
        )
    if still:
        notes.append(
            f"{listed(still)} {'moves' if len(still) == 1 else 'move'} nothing that counts for "
            f"{objective}, and {'stays' if len(still) == 1 else 'stay'} where the start has it."
        )
    solutions = [solve(program, x, iterations=iterations, progress=progress) for x in begin]
    if not any(s.feasible for s in solutions):
        solutions.append(from_feasible(program, begin, iterations, progress))
    best = best_of(solutions, wanted)
    reached = tuple(s.value if s.feasible else math.nan for s in solutions)
    taken = sum(s.iterations for s in solutions)
    exact = False
    if wanted.name in TRAVELS:
        places = [begin[0], *(s.x for s in solutions if s.feasible)]
        if question.variables.family is not None:
            places += weights_tried(question.variables, begin[0])
        refined = _exactly(question, wanted, required, places, iterations, progress)
        if refined is not None:
            program, best, exact = (*refined, True)
            taken += best.iterations
    return optimum_of(
        question, program, best, objective, reached, taken, exact, tuple(notes), iterations
    )


def _still(program: PostureProgram, x: Float[np.ndarray, " k"]) -> list[str]:
    """Named coordinates that change neither the objective nor a constraint."""
    variables = program.variables
    slopes = program.slopes(x, program.at(x))
    largest = np.abs(np.vstack([slopes.equal, slopes.rows, slopes.rest])).max(axis=0)
    position = {int(at): i for i, at in enumerate(variables.index)}
    return [
        name
        for name, at in zip(variables.plan.names, variables.plan.place, strict=True)
        if largest[position[int(at)]] < _STILL
    ]


def _exactly(
    question: Question,
    objective: Quantity,
    required: Mapping[str, float],
    places: list[Float[np.ndarray, " k"]],
    iterations: int,
    progress: Progress | None,
) -> tuple[PostureProgram, Solution] | None:
    """Maximise the exact paths' travel from the place where it is largest.

    Args:
        question: what is asked.
        objective: which travel.
        required: bounds on other quantities.
        places: variables to choose from; what breaks a constraint is passed over.
        iterations: at most.
        progress: called with 1 after each.

    Returns:
        The program and the best place that was found; None where there is nothing to gain.
    """
    taken, program = 0, question.program(objective, required)
    ways = SIDES if objective.name == "sideways" else None
    best, x = -math.inf, places[0]
    travels: tuple[ExactTravel, ...] = ()
    for place in places:
        if program.broken(place) > _CROSSED:
            continue
        there = _reached(program, place, ways)
        value = min([t.distance for t in there], default=-math.inf)
        if objective.name == "travel":  # any way, which the paths along the axes are not
            value = min(value, program.value(program.at(place)))
        if value > best:
            best, travels, x = value, there, place
    if not travels:
        return None
    kept = None
    for _ in range(_ROUNDS):
        reached = min((t.distance for t in travels), default=0.0)
        if not (math.isfinite(reached) and reached > 0):
            break  # beyond a limit already, or none within reach
        question.gauge.ends = tuple(
            (f"com_{t.way[1]}", 1 if t.way[0] == "+" else -1, reached)
            for t in travels
            if t.distance < _FARTHER * reached
        )
        program = question.program(replace(objective, along=True), required)
        found = solve(
            program,
            x,
            iterations=min(_REFINING, iterations),
            region=_NEAR,
            progress=progress,
        )
        taken += found.iterations
        travels = _reached(program, found.x, ways) if found.feasible else ()
        travel = min((t.distance for t in travels), default=-math.inf)
        if not travel >= reached * (1 - _ROUNDING):
            break
        x, kept = found.x, (program, replace(found, iterations=taken))
        if travel - reached <= _SAME * travel:
            break
    if kept is None and question.gauge.ends:
        kept = program, judge(program, x, taken, False, "nothing was gained along the exact path")
    return kept


def _reached(
    program: PostureProgram, x: Float[np.ndarray, " k"], ways: tuple[str, ...] | None
) -> tuple[ExactTravel, ...]:
    """The exact travels at some variables, all or those of some ways; none where it has none."""
    try:
        here = program.settled(x)
        found = exact_travels(here, program.criterion(x), program.gauge.limits)
    except CopsenseError:
        return ()
    return tuple(t for t in found if ways is None or t.way in ways)
