"""One sentence on an analysis: which criterion lets the CoM go farthest."""

from __future__ import annotations

import math
from typing import Any

from copsense.listing import listed

_SAME = 1e-6  # share of a travel by which two are as long: they are exact to 1e-9 m


def verdict(data: dict[str, Any]) -> str:
    """Which criterion keeps the feet planted longest, or meets its first limit last.

    Args:
        data: an analysis as plain data, infinities kept.
    """
    if all("limit_travel" in row for row in data["criteria"].values()):
        return _within_limits(data)
    reach = {
        name: min(
            (c[key], f"{contact} {word}")
            for contact, c in row["contacts"].items()
            for key, word in (("com_travel", "tips"), ("unloading_travel", "unloads"))
        )
        for name, row in data["criteria"].items()
    }
    blind = [
        c["name"]
        for c in data["contacts"]
        if c["kind"] != "point"
        and any("margin" not in row["contacts"][c["name"]] for row in data["criteria"].values())
    ]
    if blind:
        said = unknown_soles(", ".join(blind))
        return said[:1].upper() + said[1:]
    best, *equal = ranked(reach)[0]
    distance, event = reach[best]
    if distance < 0:
        return f"Every criterion has a contact that tips or pulls; nearest to standing: {best}."
    if distance > data["com_span"]:
        return "No contact tips or unloads, to first order, wherever the CoM can go."
    if equal:
        return (
            f"{listed([best, *equal])} keep the feet planted equally long: to first order the CoM "
            f"may move {distance * 1e3:.1f} mm before {event}{_others(reach, best, *equal)}."
        )
    return (
        f"{best} keeps the feet planted longest: to first order the CoM may move "
        f"{distance * 1e3:.1f} mm before {event}{_others(reach, best)}."
    )


def unknown_soles(contacts: str) -> str:
    """A note on contacts of which no sole is known, named with commas."""
    return (
        f"no sole is known under {contacts}, so when it tips is not either: give "
        "--sole X0:X1:Y0:Y1."
    )


def _within_limits(data: dict[str, Any]) -> str:
    """The same of the first limit met to either side, found along the path."""
    reach = {
        name: min(
            (
                (math.inf if t["exact"] is None else t["exact"], t["name"])
                for travels in row["limit_travel"].values()
                for t in travels
            ),
            default=(math.inf, ""),  # limits that limit nothing at this stance
        )
        for name, row in data["criteria"].items()
    }
    best, *equal = ranked(reach)[0]
    distance, limit = reach[best]
    if distance == 0:
        return "Every criterion meets a limit here already."
    if not math.isfinite(distance):
        every = listed([best, *equal])
        return f"{every} {'meet' if equal else 'meets'} no limit within reach."
    if equal:
        return (
            f"{listed([best, *equal])} meet their first limit equally late: the CoM may move "
            f"{distance * 1e3:.1f} mm until {limit}{_others(reach, best, *equal)}."
        )
    return (
        f"{best} is the last to meet a limit: the CoM may move {distance * 1e3:.1f} mm until "
        f"{limit}{_others(reach, best)}."
    )


def ranked(reach: dict[str, tuple[float, str]]) -> list[list[str]]:
    """Criteria by how far they let the CoM go, the farthest first; together if within rounding.

    Args:
        reach: name -> how far [m] and what ends it.
    """
    groups: list[list[str]] = []
    for name in sorted(reach, key=lambda name: -reach[name][0]):
        if groups and math.isclose(reach[groups[-1][0]][0], reach[name][0], rel_tol=_SAME):
            groups[-1].append(name)
        else:
            groups.append([name])
    order = list(reach)
    return [sorted(group, key=order.index) for group in groups]


def _others(reach: dict[str, tuple[float, str]], *told: str) -> str:
    others = ", ".join(
        f"{n} {d * 1e3:.1f} mm" if d >= 0 else f"{n}: {event} already"
        for n, (d, event) in reach.items()
        if n not in told
    )
    return f" ({others})" if others else ""
