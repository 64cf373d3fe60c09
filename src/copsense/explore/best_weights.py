"""Best weights: of the explorer's weights of the torques, those that do best along y."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from copsense.criterion import Criterion
from copsense.criterion_text import criterion_from_text
from copsense.design import Family, Objective, design_criterion, usual_grid
from copsense.errors import InvalidInputError
from copsense.explore.model import Model
from copsense.explore.state import State, weights_text
from copsense.limits import Limits
from copsense.path import com_sweep

WEIGHT_DECADES = 1.5  # of a weight, to either side of one
_REACH, _POSTURES = 0.12, 25  # m to either side of the posture, and how many are looked at
_GRID = 5  # values of each weight at most, before the search is refined


def best_weights(
    model: Model, state: State, keys: Mapping[str, Sequence[str]], objective: Objective
) -> tuple[dict[str, float], str]:
    """The weights that do best from a state's posture on along y, and what they gain.

    Args:
        model: the stance.
        state: where the robot is, under which loads and within which limits; limits of the soles,
            friction and unilateral forces where it has none.
        keys: group -> parts of joints' names that share its weight; the last group's stays one.
        objective: ``"travel"`` for the farthest, ``"gain"`` for the least movement of the CoPs.

    Returns:
        Group -> weight in four digits, and a sentence.

    Raises:
        CopsenseError: no posture, or no criterion of the family works along the path.
    """
    if len(keys) < 2:
        raise InvalidInputError("a single weight changes nothing. Choose another robot.")
    here = model.posture(state)
    y = float(here.com[1])
    path = com_sweep(here, "com_y", y - _REACH, y + _REACH, _POSTURES)
    free = [*keys][:-1]

    def build(values: Sequence[float]) -> Criterion:
        weights = {key: v for g, v in zip(free, values, strict=True) for key in keys[g]}
        return criterion_from_text(weights_text(weights))

    bound = 10.0**WEIGHT_DECADES
    family = Family("weights", tuple(free), ((1 / bound, bound),) * len(free), build)
    limits = model.limits_of(state) or Limits()
    grid = min(usual_grid(family), _GRID)
    found = design_criterion(path, limits, family, objective=objective, grid=grid)
    weights = {g: float(f"{found.score.parameters[g]:.4g}") for g in free} | {[*keys][-1]: 1.0}
    what = "farthest travel" if objective == "travel" else "least movement of the CoPs"
    edges = [g for g in free if abs(abs(np.log10(weights[g])) - WEIGHT_DECADES) < 0.01]
    more = f"; at a slider's end: {', '.join(edges)}" if edges else ""
    return weights, f"weights for the {what} along y: {found.verdict}{more}"
