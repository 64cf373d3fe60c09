"""worst_stances: the worst postures of a map as stances."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from copsense.batch import PostureChart
from copsense.maps.map_statistics import WorstPosture
from copsense.stance import Stance


def worst_stances(stance: Stance, worst: Sequence[WorstPosture]) -> list[Stance]:
    """The stances at a map's worst postures, solved again from their coordinates."""
    if not worst:
        return []
    names = tuple(worst[0].coordinates)
    values = np.array([[w.coordinates[n] for n in names] for w in worst])
    return [stance.at(q) for q in PostureChart(stance, names).solve(values).configurations]
