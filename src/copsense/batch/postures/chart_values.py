"""Chart values: what a caller gives for a chart's coordinates, checked."""

from __future__ import annotations

import numpy as np

from copsense.arrays import finite_array
from copsense.errors import InvalidInputError


def checked_values(values: object, names: tuple[str, ...]) -> np.ndarray:
    """Values (N, k) of the coordinates, contiguous."""
    meaning = f"one posture in each row, columns {', '.join(names)}"
    return np.ascontiguousarray(
        finite_array(values, "values of a chart", (None, len(names)), meaning)
    )


def checked_ends(
    ends: tuple[object, object], names: tuple[str, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """Least and largest value of each coordinate (k,)."""
    try:
        low, high = ends
    except (TypeError, ValueError):
        raise InvalidInputError(
            "over is not two rows of values. Give the least and the largest value of each "
            f"coordinate: {', '.join(names)}."
        ) from None
    shape, meaning = (len(names),), f"one for each of {', '.join(names)}"
    low = finite_array(low, "the least value of each coordinate", shape, meaning)
    high = finite_array(high, "the largest value of each coordinate", shape, meaning)
    for name, least, largest in zip(names, low, high, strict=True):
        if least > largest:
            raise InvalidInputError(
                f"{name} is to be over {least:g} to {largest:g}. Give the lesser value first."
            )
    return low, high
