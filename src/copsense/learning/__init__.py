"""What `copsense.torch` and `copsense.jax` have in common: centres of pressure as a function.

Values and gradients of many postures at once in NumPy's arrays. See `CopMap`.
"""

from copsense.learning.cop_map import CopMap
from copsense.learning.evaluation import Evaluation

__all__ = ["CopMap", "Evaluation"]
