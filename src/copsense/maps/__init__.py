"""Maps: the sensitivity over a whole space of postures, streamed to a Zarr store.

`map_postures` evaluates a `Grid` or a `Sample` of a posture chart's coordinates chunk by chunk, and
resumes a map that was stopped. `load_map` opens the store.
"""

from copsense.extras import require

require("xarray", "a map")  # before the modules that import it

from copsense.maps.map_plan import MapPlan
from copsense.maps.map_stances import worst_stances
from copsense.maps.map_statistics import CriterionSummary, FailedPosture, MapSummary, WorstPosture
from copsense.maps.mapping import load_map, map_postures, map_summary
from copsense.maps.marginals import Marginal, marginal
from copsense.maps.sampling import Axis, Grid, Sample

__all__ = [
    "Axis",
    "CriterionSummary",
    "FailedPosture",
    "Grid",
    "MapPlan",
    "MapSummary",
    "Marginal",
    "Sample",
    "WorstPosture",
    "load_map",
    "map_postures",
    "map_summary",
    "marginal",
    "worst_stances",
]
