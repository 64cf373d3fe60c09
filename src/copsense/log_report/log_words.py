"""Words of a log's report that follow from the numbers: rows of tables, the answer, the limits."""

from __future__ import annotations

import math

import numpy as np

from copsense.logs import LogComparison
from copsense.logs.log_comparison import MEASURED

# Where a slope lies against an interval -> the badge's kind and mark.
BADGES = {"inside": ("holds", "✓"), "on the edge": ("if", "◐"), "outside": ("not", "✗")}


def slope_rows(comparison: LogComparison, output: str) -> list[dict[str, str]]:
    """A row for each source of an output's slope, and where it lies against the measured one."""
    rows = []
    slopes = comparison.slopes.get(output, {})
    measured = slopes.get(MEASURED)
    for source, slope in slopes.items():
        place = "" if measured is None or source == MEASURED else measured.place_of(slope)
        kind, mark = BADGES.get(place, ("", ""))
        rows.append(
            {
                "source": source,
                "slope": f"{slope.value:.3f}",
                "interval": f"[{slope.low:.3f}, {slope.high:.3f}]",
                "phase": "–"
                if math.isnan(slope.phase)
                else f"{math.degrees(slope.phase):+.1f}°".replace("-", "−"),
                "error": comparison.error_text(output, source) or "–",
                "verdict": place,
                "kind": kind,
                "mark": mark,
            }
        )
    return rows


def slope_tables(comparison: LogComparison) -> list[dict[str, object]]:
    """A table for each output whose slopes are shown."""
    return [
        {
            "name": "Load share per CoM travel, times the feet's distance"
            if output == "load"
            else f"{output} per CoM travel",
            "rows": slope_rows(comparison, output),
            "measured": MEASURED in comparison.slopes[output],
        }
        for output in comparison.shown_slopes
    ]


def answer(comparison: LogComparison) -> tuple[str, ...]:
    """What the log says, in a few sentences."""
    load = comparison.slopes.get("load", {})
    measured = load.get(MEASURED)
    moved = f"{comparison.heading}."
    if measured is None:
        return (moved, "No slope of the load was measured: there are no two feet that sway.")
    places: dict[str, list[str]] = {place: [] for place in BADGES}
    for source, slope in load.items():
        if source != MEASURED:
            places[measured.place_of(slope)].append(f"{source} ({slope.value:.3f})")
    against = "; ".join(f"{place}: {', '.join(names)}" for place, names in places.items() if names)
    return (
        moved,
        f"The load went from foot to foot at {measured.value:.3f} [{measured.low:.3f}, "
        f"{measured.high:.3f}] of the centre of mass's moment: 1 would be all of it, 0 none.",
        *((f"Against this interval lie, {against}.",) if against else ()),
    )


def reach(comparison: LogComparison) -> tuple[str, ...]:
    """What a log does not show."""
    sway = comparison.sway
    lines = []
    if sway is not None and sway.method == "fundamental":
        lines.append(
            f"One sway of {sway.amplitude * 1e3:.1f} mm at {sway.frequency:.2f} Hz: nothing is "
            "said of larger or faster motions."
        )
    elif sway is not None:
        lines.append(
            "A motion without one frequency: slopes are regressions on the centre of mass, and "
            "inertia is not told apart from statics by its phase."
        )
    if not np.isfinite(comparison.cops).any():
        lines.append(
            "Normal forces alone: the centres of pressure of the feet are predicted here, and "
            "compared with nothing."
        )
    if comparison.torques is None:
        lines.append("No joint torques were recorded.")
    if any(s.criterion == "minimum-torque" for s in comparison.statics):
        lines.append(
            "A robot on position servos of equal stiffness shares its load as minimum torque does: "
            "a log of forces cannot tell one from the other."
        )
    return (
        *lines,
        "Slopes are compared, not loads: an offset of a sensor, and preload between the feet, "
        "move all shares by a constant. A millimetre of preload moves the slope of a stiff robot "
        "by about 0.1, which no interval here has in it.",
        "Masses and lengths are the model's.",
    )
