"""pareto_front: what one quantity costs of another."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from copsense.arrays import whole_number
from copsense.blas import one_blas_thread
from copsense.criterion import Criterion
from copsense.design import Family
from copsense.errors import InvalidInputError
from copsense.limits import Limits
from copsense.optimisation.objectives import QUANTITIES, Quantity, quantity_named
from copsense.optimisation.optimum import Front
from copsense.optimisation.question import ITERATIONS, Over, Progress, Question, asked, required_of
from copsense.optimisation.searching import best_of, from_feasible
from copsense.optimisation.solver import Solution, solve
from copsense.optimisation.starts import starts_of
from copsense.optimisation.valuing import optimum_of
from copsense.optimisation.variables import Range
from copsense.stance import Stance


@one_blas_thread()
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
    iterations: int = ITERATIONS,
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
    question, notes = asked(
        stance, criterion, limits, over, within, reserve, distance, family, frame
    )
    points = whole_number(points, "the number of points", least=2)
    if len(tuple(objectives)) != 2 or len(set(objectives)) != 2:
        raise InvalidInputError(
            f"a front is of two quantities, got {', '.join(map(str, objectives))}. Give two of "
            f"{', '.join(QUANTITIES)}."
        )
    first, second = (quantity_named(name) for name in objectives)
    required = required_of(stance, require, first, second)

    def ends(quantity: Quantity, bound: Mapping[str, float], begin: list[np.ndarray]) -> Solution:
        program = question.program(quantity, {**required, **bound})
        found = [solve(program, x, iterations=iterations, progress=progress) for x in begin]
        return best_of(found, quantity) if any(s.feasible for s in found) else found[0]

    begin = starts_of(question.program(first, required), starts, seed)
    far, near = ends(first, {}, begin), ends(second, {}, begin)
    if not far.feasible:
        far = from_feasible(question.program(first, required), begin, iterations, progress)

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
        optimum_of(
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
            optimum_of(question, program, near, second.name, own, taken, False, (), iterations)
        )
    if len(rows) < points:
        notes.append(f"{points - len(rows)} of {points} bounds on {second.name} were not met.")
    early = sum(not row.converged for row in rows)
    if early:
        notes.append(
            f"{early} of {len(rows)} points are not proven to be optima; see their KKT residuals."
        )
    return Front((first.name, second.name), rows[0].before, tuple(rows), tuple(notes))


def _measured(question: Question, quantity: Quantity, x: Float[np.ndarray, " k"]) -> float:
    program = question.program(quantity, {})
    return program.value(program.at(x))
