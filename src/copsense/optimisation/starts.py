"""Starts: postures from which a search begins, the best of a sample."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
from jaxtyping import Float

from copsense.batch import PostureChart
from copsense.batch.postures.coordinates import chart_coordinates
from copsense.optimisation.posture_program import PostureProgram
from copsense.optimisation.variables import Variables

_WEIGHTS = 49  # sets of parameters of a criterion that are looked at
_SAMPLES = 96  # postures that are looked at
_NEARER = (1.0, 0.5, 0.25, 0.1)  # shares of the ranges, in turn: far out few postures are reached


def starts_of(program: PostureProgram, count: int, seed: int) -> list[Float[np.ndarray, " k"]]:
    """Variables to begin with: the stance's own, then the best of a quasi-random sample.

    Args:
        program: what is to be optimised.
        count: how many, at most.
        seed: of the sample.
    """
    variables, plan = program.variables, program.variables.plan
    middle = 0 * variables.lower[len(variables.index) :]
    own = variables.at(plan.given, np.exp(middle))
    if count < 2:
        return [own]
    if plan.names:
        looked = sorted(_sample(program, seed), key=lambda pair: -pair[0])
    else:  # the posture stays
        tried = weights_tried(variables, own)
        looked = sorted(((_least(program, x), x) for x in tried), key=lambda pair: -pair[0])
    better = [x for _, x in looked[: max(len(looked) // 2, count)]]
    found = [own]
    while better and len(found) < count:  # the one that is farthest from those that are taken
        away = [min(float(np.linalg.norm(x - other)) for other in found) for x in better]
        found.append(better.pop(int(np.argmax(away))))
    return found


def weights_tried(
    variables: Variables, x: Float[np.ndarray, " k"]
) -> list[Float[np.ndarray, " k"]]:
    """Variables with the criterion's parameters on a grid over their bounds, the posture kept."""
    first = len(variables.index)
    low, high = variables.lower[first:], variables.upper[first:]
    count = max(n for n in range(2, 8) if n ** len(low) <= _WEIGHTS or n == 2)
    axes = [np.linspace(a, b, count) for a, b in zip(low, high, strict=True)]
    return [np.concatenate([x[:first], logs]) for logs in product(*axes)]


def _sample(program: PostureProgram, seed: int) -> list[tuple[float, np.ndarray]]:
    """Postures of a sample that can be reached: least row of the objective, and variables."""
    from copsense.maps.sampling import Axis, Sample  # a map needs xarray, a figure does not

    variables, plan = program.variables, program.variables.plan
    names, k = plan.names, len(plan.names)
    position = {int(at): i for i, at in enumerate(variables.index)}
    at = [position[int(place)] for place in plan.place]
    low = variables.lower[at] / variables.scale[at]
    high = variables.upper[at] / variables.scale[at]
    logs = [
        (a, b)
        for a, b in zip(
            variables.lower[len(variables.index) :],
            variables.upper[len(variables.index) :],
            strict=True,
        )
    ]
    axes = [
        Axis(f"x{i}", float(a), float(b))
        for i, (a, b) in enumerate([*zip(low, high, strict=True), *logs])
    ]
    drawn = Sample(tuple(axes), _SAMPLES, seed).values(0, _SAMPLES)
    own = np.clip(plan.given[plan.place], low, high)
    share = np.array([_NEARER[i % len(_NEARER)] for i in range(_SAMPLES)])[:, None]
    asked = own + share * (drawn[:, :k] - own)
    chart = PostureChart(program.stance, names)
    if not chart.compiled:  # so few postures are not worth the compiler
        chart = PostureChart(program.stance, names, compiled=False)
    found = chart.solve(asked)
    kept = []
    for row in np.flatnonzero(found.converged):
        here = program.stance.at(found.configurations[row], check=False)
        given = np.array(chart_coordinates(here, names).given)
        given[plan.place] = asked[row]
        _unwind(given, plan.given, program.stance.robot.base_nv)
        x = variables.at(given, np.exp(drawn[row, k:]))
        kept.append((_least(program, x), x))
    return kept


def _least(program: PostureProgram, x: Float[np.ndarray, " k"]) -> float:
    return float(program.at(x).rows.min())


def _unwind(given: np.ndarray, own: np.ndarray, base_nv: int) -> None:
    """Angles of the base within half a turn of the stance's."""
    turns = slice(3, 6) if base_nv == 6 else slice(2, 3)
    whole = 2 * math.pi
    given[turns] -= whole * np.round((given[turns] - own[turns]) / whole)
