"""json_data: results as plain data that JSON can hold."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any


def json_data(value: Any) -> Any:
    """Arrays and tuples as lists, infinities and NaN, which JSON lacks, as None.

    Args:
        value: numbers, texts, arrays, and lists and mappings of them.
    """
    if isinstance(value, Mapping):
        return {str(k): json_data(v) for k, v in value.items()}
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [json_data(v) for v in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
