"""What a sway does to the outputs of an analysis, in words."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any


def sway_lines(row: dict[str, Any]) -> Iterator[str]:
    """Lines under the table of one criterion; none where no sway was asked about."""
    if "sway" not in row:
        return
    period = row["sway"]["period"]
    yield f"swaying in {period:g} s ({1 / period:.3g} Hz), slopes are those above times:"
    for output, found in row["sway"]["outputs"].items():
        if math.isnan(found["lever"]):
            yield f"  {output}: stands still at rest"
            continue
        yield (
            f"  {output}: {found['factor']:.3f} (statics within 5 % up to "
            f"{found['static_frequency']:.3f} Hz)"
        )
