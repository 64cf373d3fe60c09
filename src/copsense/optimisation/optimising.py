"""optimise: the posture, and with it the criterion's weights, that do best within constraints."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from copsense.arrays import finite_number, whole_number
from copsense.content import ShortRepr
from copsense.criterion import Criterion, check_criterion, minimum_torque
from copsense.design import Family, family_named
from copsense.errors import CopsenseError, InvalidInputError, UnreachablePostureError
from copsense.limits import Limits, check_limits
from copsense.listing import first_few, listed
from copsense.optimisation.objectives import (
    QUANTITIES,
    TRAVELS,
    Gauge,
    Quantity,
    quantity_named,
    way_of,
)
from copsense.optimisation.optimum import (
    PROVEN,
    SIDES,
    Binding,
    ExactTravel,
    Front,
    Optimum,
    Valuation,
)
from copsense.optimisation.posture_program import PostureProgram
from copsense.optimisation.solver import Solution, judge, least_violation, solve
from copsense.optimisation.starts import starts_of, weights_tried
from copsense.optimisation.variables import (
    Range,
    Variables,
    com_moves,
    expand,
    reserves_of,
    shown,
    usual_coordinates,
    variables_of,
)
from copsense.path import COM_COORDINATES, LateralPath
from copsense.scan import PathScan
from copsense.stance import Stance, check_at_rest, check_stance
from copsense.statics import solve_equilibrium, with_tie_break

Progress = Callable[[int], object]
Over = Mapping[str, "Range | float | None"] | Iterable[str]

_ITERATIONS = 600  # of the solver, from each start
_REFINING = 200  # of them, for the exact path
_FARTHER = 1.2  # of the smallest travel: ways with more are not looked at in a round
_NEAR = 0.3  # of the variables: the paths' ends follow the posture so far, all but linearly
_ROUNDS = 4  # of these
_ROUNDING = 1e-9  # relative, of a travel
_SAME = 1e-4  # relative: a travel that changed less is the same
_CROSSED = 1e-6  # of the constraints, by which a place may break them
_STILL = 1e-7  # of the variables: slopes under which a coordinate moves nothing
_SPREAD = 0.01  # relative: starts that end farther apart than this ended in different optima


@dataclass(frozen=True, eq=False)
class _Question(ShortRepr):
    """What is asked, checked."""

    stance: Stance
    criterion: Criterion
    limits: Limits
    variables: Variables
    within: Mapping[str, Range]
    distance: Range | None
    gauge: Gauge

    def program(self, objective: Quantity, require: Mapping[str, float]) -> PostureProgram:
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
    iterations: int = _ITERATIONS,
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
            contact follow.
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
    question, notes = _asked(
        stance, criterion, limits, over, within, reserve, distance, family, frame
    )
    wanted = quantity_named(objective)
    required = _required(require, wanted)
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
        solutions.append(_from_feasible(program, begin, iterations, progress))
    best = _best(solutions, wanted)
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
    return _optimum(
        question, program, best, objective, reached, taken, exact, tuple(notes), iterations
    )


def pareto_front(
    stance: Stance,
    objectives: tuple[str, str],
    criterion: Criterion | None = None,
    limits: Limits | None = None,
    *,
    points: int = 7,
    over: Over | None = None,
    within: Mapping[str, Range] | None = None,
    reserve: Mapping[str, float] | float | None = None,
    distance: Range | None = None,
    require: Mapping[str, float] | None = None,
    family: Family | str | None = None,
    frame: str | None = None,
    starts: int = 4,
    seed: int = 0,
    iterations: int = _ITERATIONS,
    progress: Progress | None = None,
) -> Front:
    """What one quantity costs of another: the best of the first for each bound on the second.

    The ends are the optima of each alone; between them the second is bounded in even steps. Travels
    are to first order of the slack, as the search has them; each point's exact travel is given.

    Args:
        stance: as `optimise` has it, and so the other arguments.
        objectives: names of two quantities.
        criterion: what shares the load.
        limits: what must be respected.
        points: how many postures, both ends among them.
        over: what varies.
        within: where coordinates must stay.
        reserve: how far inside their limits joints must stay.
        distance: of any two contacts.
        require: bounds on other quantities.
        family: criteria whose parameters vary too.
        frame: what is pushed.
        starts: postures that the search for the ends begins from.
        seed: of their sample.
        iterations: of the solver for each point, at most.
        progress: called with 1 after each iteration.

    Raises:
        CopsenseError: as `optimise`.
    """
    question, notes = _asked(
        stance, criterion, limits, over, within, reserve, distance, family, frame
    )
    points = whole_number(points, "the number of points", least=2)
    if len(tuple(objectives)) != 2 or len(set(objectives)) != 2:
        raise InvalidInputError(
            f"a front is of two quantities, got {', '.join(map(str, objectives))}. Give two of "
            f"{', '.join(QUANTITIES)}."
        )
    first, second = (quantity_named(name) for name in objectives)
    required = _required(require, first, second)

    def ends(quantity: Quantity, bound: Mapping[str, float], begin: list[np.ndarray]) -> Solution:
        program = question.program(quantity, {**required, **bound})
        found = [solve(program, x, iterations=iterations, progress=progress) for x in begin]
        return _best(found, quantity) if any(s.feasible for s in found) else found[0]

    begin = starts_of(question.program(first, required), starts, seed)
    far, near = ends(first, {}, begin), ends(second, {}, begin)
    if not far.feasible:
        far = _from_feasible(question.program(first, required), begin, iterations, progress)

    def second_at(x: np.ndarray) -> float:
        return _measured(question, second, x)

    steps = np.linspace(second_at(far.x), second_at(near.x), points)
    found: list[tuple[Solution, dict[str, float]]] = [(far, {})]
    x = far.x
    for step in steps[1:-1]:
        bound = {second.name: float(step)}
        solution = ends(first, bound, [x, near.x])
        if solution.feasible:
            x = solution.x
            found.append((solution, bound))
    # At the best of the second alone a bound on it leaves the first no room to move in.
    rows = [
        _optimum(
            question,
            question.program(first, {**required, **bound}),
            solution,
            first.name,
            (solution.value,),
            solution.iterations,
            False,
            (),
            iterations,
        )
        for solution, bound in found
    ]
    if near.feasible:
        program = question.program(second, required)
        own = (near.value,)
        taken = near.iterations
        rows.append(
            _optimum(question, program, near, second.name, own, taken, False, (), iterations)
        )
    if len(rows) < points:
        notes.append(f"{points - len(rows)} of {points} bounds on {second.name} were not met.")
    early = sum(not row.converged for row in rows)
    if early:
        notes.append(
            f"{early} of {len(rows)} points are not proven to be optima; see their KKT residuals."
        )
    return Front((first.name, second.name), rows[0].before, tuple(rows), tuple(notes))


def _asked(
    stance: Stance,
    criterion: Criterion | None,
    limits: Limits | None,
    over: Over | None,
    within: Mapping[str, Range] | None,
    reserve: Mapping[str, float] | float | None,
    distance: Range | None,
    family: Family | str | None,
    frame: str | None,
) -> tuple[_Question, list[str]]:
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
    if not ranges:
        raise InvalidInputError(
            "no coordinate may vary, so there is nothing to optimise. Name one, such as com_z."
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
        distance = (low, float(high))
    shares = with_tie_break(stance, minimum_torque() if criterion is None else criterion)
    gauge = Gauge(stance, limits, frame)
    notes = [*stance.robot.notes]
    question = _Question(stance, shares, limits, variables, rest, distance, gauge)
    return question, notes


def _required(require: Mapping[str, float] | None, *objectives: Quantity) -> dict[str, float]:
    found = {}
    for name, value in (require or {}).items():
        quantity = quantity_named(name, "quantity")
        if quantity in objectives:
            raise InvalidInputError(
                f"{name} is what is optimised, and required as well. Leave one of them out."
            )
        found[name] = finite_number(value, f"the required {name}")
    return found


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


def _best(solutions: Iterable[Solution], objective: Quantity) -> Solution:
    kept = [s for s in solutions if s.feasible]
    return max(kept, key=lambda s: objective.sign * s.value)


def _from_feasible(
    program: PostureProgram,
    begin: list[np.ndarray],
    iterations: int,
    progress: Progress | None,
) -> Solution:
    """From where the constraints are broken least.

    Raises:
        UnreachablePostureError: they are broken there too.
    """
    x, violation, names = least_violation(program, begin[0], iterations=iterations)
    if not names:
        found = solve(program, x, iterations=iterations, progress=progress)
        if found.feasible:
            return found
    raise _unreachable(program, len(begin), iterations, violation, names)


def _unreachable(
    program: PostureProgram, begun: int, iterations: int, violation: float, names: tuple[str, ...]
) -> UnreachablePostureError:
    robot = program.stance.robot.name
    if not names:
        return UnreachablePostureError(
            f"no posture of {robot!r} that keeps all constraints was found from "
            f"{'one start' if begun == 1 else f'{begun} starts'} within {iterations} "
            "iterations, though the solver found no contradiction. Give more --iterations or "
            "--starts, or begin nearer (--at)."
        )
    named = dict.fromkeys(_short(name) for name in names)
    return UnreachablePostureError(
        f"no posture of {robot!r} keeps all constraints. Where they are broken least"
        + (f", by {violation * 100:.3g} mm," if any("in place" in n for n in named) else "")
        + (
            f" these contradict each other: {first_few(named, 8)}. Relax one of them."
            if len(named) > 1
            else f" this is what cannot be kept: {next(iter(named))}. Relax it, or let more vary."
        )
    )


def _short(name: str) -> str:
    """The constraint that a row of it belongs to."""
    asked, colon, _ = name.partition(": ")
    return asked if colon and (" at least " in asked or " at most " in asked) else name


def _exactly(
    question: _Question,
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
        found = _travels(here, program.criterion(x), program.gauge.limits)
    except CopsenseError:
        return ()
    return tuple(t for t in found if ways is None or t.way in ways)


def _travels(stance: Stance, criterion: Criterion, limits: Limits) -> tuple[ExactTravel, ...]:
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


def _measured(question: _Question, quantity: Quantity, x: Float[np.ndarray, " k"]) -> float:
    program = question.program(quantity, {})
    return program.value(program.at(x))


def _valued(
    question: _Question, stance: Stance, criterion: Criterion, x: Float[np.ndarray, " k"] | None
) -> Valuation:
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
        _travels(stance, criterion, question.limits),
        {name: float(given[at]) for name, at in places},
        parameters,
    )


def _optimum(
    question: _Question,
    program: PostureProgram,
    best: Solution,
    objective: str,
    reached: tuple[float, ...],
    taken: int,
    exact: bool,
    notes: tuple[str, ...],
    iterations: int,
) -> Optimum:
    variables, quantity = question.variables, QUANTITIES[objective]
    after = _valued(question, program.settled(best.x), program.criterion(best.x), best.x)
    before = _valued(question, question.stance, question.criterion, None)
    said = list(notes)
    values = [v for v in reached if math.isfinite(v)]
    if len(values) > 1 and np.ptp(values) > _SPREAD * max(map(abs, values)):
        said.append(
            f"the starts ended in different optima, {quantity.shown(min(values))} to "
            f"{quantity.shown(max(values))}: more --starts may find a better one."
        )
    if not best.finished or best.residual > PROVEN:
        said.append(
            f"the solver stopped early ({best.message}; at most {iterations} iterations from a "
            f"start): {quantity.shown(after.quantities[objective])} was reached, with a KKT "
            f"residual of {best.residual:.1e}. More --iterations may go farther."
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
