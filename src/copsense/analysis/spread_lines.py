"""What errors of the model make of a criterion's answer, in lines under its table."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

_SCALES = {"m": (1e3, "mm"), "N": (1.0, "N"), "N m": (1.0, "N m")}
_LEAST = 0.005  # of a variance, that is listed
_STILL = 1e-8  # m


def spread_lines(row: dict[str, Any]) -> Iterator[str]:
    """Lines on the uncertainty of one criterion; none where no uncertainty was given."""
    if "uncertainty" not in row:
        return
    data = row["uncertainty"]
    many = "s" * (data["sigmas"] != 1)
    yield (
        f"{data['sources']} errors of the model, {data['sigmas']:g} standard deviation{many}: "
        "likely, all together; at worst, each its worst way"
    )
    margins = {(m["where"], m["kind"]): m for m in data["margins"]}
    for name, found in data["contacts"].items():
        long, short = (float(x) for x in found["half_axes"])
        if long < _STILL:
            continue
        heading = math.degrees(found["heading"])
        left = ""
        if (name, "cop") in margins:
            margin = margins[name, "cop"]
            left = (
                f"; of {margin['margin'] * 1e3:.1f} mm to the edge {margin['likely'] * 1e3:.1f} "
                f"likely left, {margin['worst'] * 1e3:.1f} at worst"
            )
        yield (
            f"{name}: CoP within {long * 1e3:.1f} x {short * 1e3:.1f} mm, the longer "
            f"{heading:.0f} deg from x{left}"
        )
        yield f"{name}: {_shares(found['shares'])}; most by {_shares(found['strongest'])}"
    for margin in data["margins"]:
        scale, unit = _SCALES[margin["unit"]]
        if margin["kind"] != "cop" and margin["worst"] < 0 <= margin["margin"]:
            yield (
                f"{margin['name']}: of {margin['margin'] * scale:.1f} {unit} "
                f"{margin['likely'] * scale:.1f} likely left, {margin['worst'] * scale:.1f} at "
                "worst"
            )
    for side, travel in data["travels"].items():
        if travel["limit"] is None:
            yield f"CoM to {side}: no limit within reach"
            continue
        exact = travel["worst_exact"]
        exactly = "" if exact is None else f" ({exact * 1e3:.1f} exactly)"
        yield (
            f"CoM to {side}: {travel['travel'] * 1e3:6.1f} mm to {travel['limit']}; "
            f"{travel['likely'] * 1e3:.1f} likely left, {travel['worst'] * 1e3:.1f} at worst"
            f"{exactly}"
        )


def _shares(shares: Mapping[str, float]) -> str:
    return ", ".join(f"{share:.0%} {name}" for name, share in shares.items() if share >= _LEAST)
