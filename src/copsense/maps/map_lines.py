"""Map lines: a map's summary in words, as the command prints it."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import TYPE_CHECKING

from copsense.listing import counted

if TYPE_CHECKING:
    from copsense.maps.map_statistics import CriterionSummary, MapSummary

_STILL = 1e-9  # a gain up to which no centre of pressure moves: of points, which have their own


def map_lines(summary: MapSummary) -> list[str]:
    """What there is to say of a map: of each criterion how much was evaluated, and its worst."""
    over = ", ".join(summary.coordinates)
    lines = [f"{summary.robot}: {counted(summary.postures, 'posture')} over {over}"]
    if not summary.complete:
        lines[0] += f", {summary.chunks_done} of {counted(summary.chunks, 'chunk')} done"
    said: set[tuple[str, int]] = set()  # a posture out of reach is so for every criterion
    for name, row in summary.criteria.items():
        shares = ", ".join(
            f"{count / summary.postures:.1%} {kind}" for kind, count in row.counts.items() if count
        )
        lines.append(f"  {name}: {shares}")
        for status, first in row.failed.items():
            if (status, first.posture) not in said:
                where = place_text(first.coordinates, summary)
                reason = _in_degrees(first.reason.removeprefix(f"{status}: "))
                lines.append(f"    {status}, first at {where}: {reason}")
            said.add((status, first.posture))
        if unloaded := row.counts_within.get("unloaded", 0):
            lines.append(
                f"    within the limits: a contact is left without load at "
                f"{counted(unloaded, 'posture')} ({unloaded / row.counts['evaluated']:.1%})"
            )
        if row.worst_travel:
            lines.append(f"    CoM travel: {_travel(row, summary)}")
        if row.worst_gain and row.worst_gain[0].value > _STILL:
            gain = row.worst_gain[0]
            lines.append(
                f"    CoM gain: worst {gain.value:.2f} at {place_text(gain.coordinates, summary)}; "
                f"median {row.gain_percentiles[50.0]:.2f}"
            )
    return lines


def place_text(coordinates: Mapping[str, float], summary: MapSummary) -> str:
    """Where a posture is: angles in degrees, lengths in metres."""
    units = dict(zip(summary.coordinates, summary.units, strict=True))
    return ", ".join(
        f"{name} {math.degrees(v):+.2f} deg" if units[name] == "rad" else f"{name} {v:+.4f} m"
        for name, v in coordinates.items()
    )


def _in_degrees(reason: str) -> str:
    """A reason as people read it: the store's are in SI, with three digits."""

    def shown(found: re.Match[str]) -> str:
        angle = math.degrees(float(found[1]))
        return f"{angle:.0f} deg" if angle >= 10 else f"{angle:.2g} deg"

    return re.sub(r"(\d[\d.]*(?:e[-+]?\d+)?) rad\b", shown, reason)


def _travel(row: CriterionSummary, summary: MapSummary) -> str:
    """The worst travel and what ends it, and the median; the CoM goes nowhere beyond its span."""
    span = summary.com_span
    worst, half = row.worst_travel[0], _length(row.travel_percentiles[50.0], span)
    if not worst.contact or worst.value > span:
        return "no contact tips or unloads, to first order, wherever the CoM can go"
    what = {
        "tips": f"{worst.contact} tips over edge {worst.tipping_edge}",
        "off its sole": f"CoP of {worst.contact} off its sole",
    }.get(worst.event, f"{worst.contact} {worst.event}")
    where = f"{place_text(worst.coordinates, summary)} ({what})"
    if worst.value >= 0:
        return f"worst {worst.value * 1e3:+.1f} mm at {where}; median {half}"
    count = row.without_travel
    return (
        f"none at {counted(count, 'posture')} ({count / row.counts['evaluated']:.1%}), "
        f"worst at {where}; median {half}"
    )


def _length(travel: float, span: float) -> str:
    if travel > span or travel == math.inf:
        return "unlimited"
    return f"{travel * 1e3:+.1f} mm" if travel >= 0 else "none"
