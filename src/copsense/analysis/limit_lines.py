"""What stands under a criterion's table of limits: the active ones, and how far the CoM may go."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any


def clipped(row: dict[str, Any]) -> bool:
    """Whether a limit clips the wrenches of a criterion."""
    return any(limit["multiplier"] for limit in row.get("active_limits", ()))


def limit_lines(row: dict[str, Any], span: float) -> Iterator[str]:
    """Lines on the limits of one criterion; none without limits.

    To the next change of the active limits the wrenches are those within the limits; to each limit
    they are the criterion's own.

    Args:
        row: the criterion's part of an analysis.
        span: a length that the CoM's travel cannot exceed with the contacts in place [m].
    """
    if "limit_travel" not in row:
        return
    yield (
        "slopes and gains: of the wrenches as the limits clip them; how far the CoM may go stands "
        "below"
        if clipped(row)
        else "tips, unloads: in the worst direction, to first order; along y, see below"
    )
    yield f"active limits: {'; '.join(_named(row['active_limits'])) or 'none'}"
    nearest = row["nearest_change"]
    if nearest is not None and nearest["travel"] <= span:
        yield (
            f"CoM any way: {nearest['travel'] * 1e3:4.1f} mm until {nearest['name']} "
            f"{_verb(nearest)} (first order)"
        )
    for side, change in row["next_change"].items():
        first, exact = change["first_order"], change["exact"]
        if row["active_limits"] and exact is not None:
            predicted = f"{first['travel'] * 1e3:.1f}" if first else "never"
            yield (
                f"CoM to {side}: {exact['travel'] * 1e3:6.1f} mm until {exact['name']} "
                f"{_verb(exact)} (first order: {predicted})"
            )
    if row["active_limits"]:
        yield "unclipped, the criterion's own wrenches:"
    for side, travels in row["limit_travel"].items():
        for travel in travels[:3]:
            if travel["exact"] is None:
                continue
            first = travel["first_order"]
            predicted = f"{first * 1e3:.1f}" if math.isfinite(first) else "never"
            predicted = "met" if travel["exact"] == 0 else f"first order: {predicted}"
            distance = travel["exact"] * 1e3 + 0.0  # no minus before a zero
            yield f"CoM to {side}: {distance:6.1f} mm to {travel['name']} ({predicted})"


def _verb(change: dict[str, Any]) -> str:
    """What a limit does at a change."""
    return "binds" if change["binds"] else "lets go"


def _named(active: list[dict[str, Any]]) -> list[str]:
    """Names of active limits; the sides of a pyramid that are merely touched stand together."""
    names = [limit["name"] for limit in active if limit["multiplier"]]
    touched: dict[str, list[str]] = {}
    for limit in active:
        if not limit["multiplier"]:
            touched.setdefault(limit["name"].partition(" towards ")[0], []).append(limit["name"])
    for common, each in touched.items():
        name = each[0] if len(each) == 1 else f"{common} {len(each)} ways"
        names.append(f"{name} (touched)")
    return names
