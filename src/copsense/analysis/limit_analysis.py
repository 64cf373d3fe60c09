"""LimitAnalysis: which limits are active at a posture, and how far along the CoM's path each is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from copsense.content import freeze
from copsense.criterion import Criterion
from copsense.errors import CopsenseError
from copsense.limits import Limits
from copsense.listing import first_few
from copsense.margins import LimitMargin, limit_margins
from copsense.path import LateralPath
from copsense.scan import PathScan
from copsense.sensitivity import CopSensitivity
from copsense.statics import ActiveLimit, ActiveSetChange, ConstrainedEquilibrium
from copsense.travel import Travel

SIDES = {"+y": 1, "-y": -1}  # to which the CoM may go, world axes


@dataclass(frozen=True, eq=False, repr=False)
class LimitAnalysis:
    """A criterion within limits at one posture.

    Attributes:
        active: limits that hold with equality, the hardest pressed first.
        optimality: largest violation of a condition of the optimum, relative.
        margins: distance of each contact and joint to each kind of limit.
        next_changes: side, ``"+y"`` or ``"-y"`` -> the next limit to bind or let go along the
            lateral path there, to first order and exact; either is None where none changes within
            reach. Empty where it cannot be said, as where the active limits are degenerate.
        travels: side -> how far the CoM may go until the criterion's own wrenches, unclipped, meet
            each limit.
        nearest_change: the limit that begins or ceases to press first whichever way the CoM goes,
            to first order, as `CopSensitivity.nearest_active_set_change`; None where none changes,
            and where it cannot be said.
        unknown: why not all changes can be said, and what to do; empty where they can.
    """

    active: tuple[ActiveLimit, ...]
    optimality: float
    margins: tuple[LimitMargin, ...]
    next_changes: Mapping[str, tuple[ActiveSetChange | None, ActiveSetChange | None]]
    travels: Mapping[str, Travel]
    nearest_change: ActiveSetChange | None = None
    unknown: str = ""

    def __post_init__(self) -> None:
        """Own the mappings."""
        freeze(self, "next_changes", "travels")

    def __repr__(self) -> str:
        """The active limits, and the first that is met to either side."""
        active = first_few((limit.name for limit in self.active), 4) or "none"
        ways = "".join(f"; CoM to {side}: {met!r}" for side, met in self.travels.items())
        return f"LimitAnalysis(active limits: {active}{ways})"

    @property
    def pressed(self) -> bool:
        """Whether a limit clips the wrenches."""
        return any(limit.multiplier for limit in self.active)

    def to_dict(self) -> dict[str, Any]:
        """The part of a criterion's answer that is about limits, infinities kept."""
        return {
            "active_limits": [asdict(limit) for limit in self.active],
            "optimality": self.optimality,
            "limit_margins": [asdict(margin) for margin in self.margins],
            "nearest_change": _predicted(self.nearest_change),
            "next_change": {
                side: {
                    "first_order": _predicted(first),
                    "exact": None
                    if exact is None
                    else {"name": exact.name, "binds": exact.binds, "travel": exact.travel},
                }
                for side, (first, exact) in self.next_changes.items()
            },
            "limit_travel": {
                side: [
                    {
                        "name": met.name,
                        "margin": met.margin.value,
                        "unit": met.margin.unit,
                        "first_order": met.first_order,
                        "exact": met.exact,
                    }
                    for met in travel.limits
                ]
                for side, travel in self.travels.items()
            },
        }


def _predicted(change: ActiveSetChange | None) -> dict[str, Any] | None:
    """A change to first order, as plain data."""
    if change is None:
        return None
    return {
        "name": change.name,
        "kind": change.kind,
        "binds": change.binds,
        "travel": change.travel,
    }


def analyse_limits(
    path: LateralPath,
    criterion: Criterion,
    limits: Limits,
    found: CopSensitivity,
    tangent: Float[np.ndarray, " nv"],
) -> LimitAnalysis:
    """How one criterion stands with the limits at a posture.

    Args:
        path: the CoM's lateral path through the posture; criteria share it.
        criterion: what shares the load.
        limits: what the wrenches and torques respect.
        found: the sensitivity of the criterion there, within the limits.
        tangent: dq/dy of the CoM's lateral path (nv,).
    """
    equilibrium = found.equilibrium
    assert isinstance(equilibrium, ConstrainedEquilibrium)
    own, within = PathScan(path, criterion), PathScan(path, criterion, limits)
    changes: dict[str, tuple[ActiveSetChange | None, ActiveSetChange | None]] = {}
    nearest, unknown = None, ""
    try:
        nearest = found.nearest_active_set_change()
        changes = {
            side: (found.next_active_set_change(way * tangent), within.next_active_set_change(way))
            for side, way in SIDES.items()
        }
    except CopsenseError as error:
        unknown = str(error)
    return LimitAnalysis(
        tuple(equilibrium.active),
        equilibrium.optimality(),
        limit_margins(equilibrium, limits),
        changes,
        {side: own.travel(limits, way) for side, way in SIDES.items()},
        nearest,
        unknown,
    )
