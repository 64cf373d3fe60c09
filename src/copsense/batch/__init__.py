"""Many postures at once: the same answers as one at a time, a thousand times faster.

`evaluate_batch` gives what `copsense.cop_sensitivity` gives, for rows of configurations; a
`BatchKernel` keeps what does not depend on them.
"""

from copsense.batch.evaluation import BatchKernel, evaluate_batch
from copsense.batch.result import BatchResult

__all__ = ["BatchKernel", "BatchResult", "evaluate_batch"]
