"""Many postures at once: the same answers as one at a time, a thousand times faster.

`evaluate_batch` gives what `copsense.cop_sensitivity` gives, for rows of configurations; a
`BatchKernel` keeps what does not depend on them. A `PostureChart` makes the configurations, from
rows of named coordinates, with the contacts in place.

Both have a compiled kernel, and a reference that answers what the kernel does not cover.
"""

from copsense.batch.postures.chart import PostureChart
from copsense.batch.postures.chart_posture import chart_posture
from copsense.batch.postures.coordinates import coordinate_names
from copsense.batch.postures.posture_batch import PostureBatch
from copsense.batch.statics.batch_kernel import BatchKernel, evaluate_batch
from copsense.batch.statics.batch_result import BatchResult
from copsense.batch.statics.limit_result import LimitResult

__all__ = [
    "BatchKernel",
    "BatchResult",
    "LimitResult",
    "PostureBatch",
    "PostureChart",
    "chart_posture",
    "coordinate_names",
    "evaluate_batch",
]
