"""Searching: the best of several starts, or what no posture keeps."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from copsense.errors import UnreachablePostureError
from copsense.listing import first_few
from copsense.optimisation.objectives import QUANTITIES, Quantity
from copsense.optimisation.posture_program import PostureProgram
from copsense.optimisation.question import Progress
from copsense.optimisation.solver import Solution, least_violation, solve


def best_of(solutions: Iterable[Solution], objective: Quantity) -> Solution:
    """The best of those that keep every constraint; there is one at least."""
    kept = [s for s in solutions if s.feasible]
    return max(kept, key=lambda s: objective.sign * s.value)


def from_feasible(
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
    placed = any("in place" in n for n in named)
    length = placed and not any(n.partition(" ")[0] in QUANTITIES for n in named)
    return UnreachablePostureError(
        f"no posture of {robot!r} keeps all constraints. Where they are broken least"
        + (f", by {violation * 100:.3g} mm," if length else "")
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
