"""worst_stances: the worst postures of a map as stances."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from copsense.batch import PostureChart
from copsense.maps.map_statistics import WorstPosture
from copsense.maps.sampling import Sampling
from copsense.stance import Stance


def worst_stances(
    stance: Stance, sampling: Sampling, worst: Sequence[WorstPosture]
) -> list[Stance]:
    """The stances at worst postures of a map over a sampling, solved again as the map solved them.

    Args:
        stance: that of the map.
        sampling: what it is over.
        worst: postures that were evaluated.
    """
    if not worst:
        return []
    chart = PostureChart(stance, sampling.names, over=sampling.ends)
    values = np.array([[w.coordinates[n] for n in sampling.names] for w in worst])
    return [stance.at(q) for q in chart.solve(values).configurations]
