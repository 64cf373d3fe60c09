"""Nested regions: what friction and soles, torque limits and each criterion leave to the CoM."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from jaxtyping import Float

from copsense.blas import one_blas_thread
from copsense.content import freeze
from copsense.criterion import Criterion
from copsense.json_data import json_data
from copsense.limits import Limits, check_limits
from copsense.regions.feasible_region import com_region
from copsense.regions.region import ComRegion
from copsense.regions.unclipped_region import criterion_region
from copsense.stance import Stance, check_stance
from copsense.statics import named_criteria, with_tie_breaks

SUPPORTED, ACTUATED = "friction and soles", "and torque limits"


@dataclass(frozen=True, eq=False, repr=False)
class ComRegions(Mapping[str, ComRegion]):
    """The regions of the CoM at one stance, the widest first; a mapping from name to region.

    Its keys are ``"friction and soles"``, ``"and torque limits"`` where there are any, and the
    criteria's names.

    Attributes:
        com: horizontal position (2,) of the stance's CoM, world x and y [m].
        supported: an equilibrium exists within all but the torque limits.
        actuated: one exists within the torque limits too; None without any.
        unclipped: criterion -> where its own wrenches stay within all limits.
        criteria: name -> the criterion asked about, with the tie-break that it needed.
        notes: a sentence for each criterion that was given a tie-break.
    """

    com: Float[np.ndarray, " 2"]
    supported: ComRegion
    actuated: ComRegion | None
    unclipped: Mapping[str, ComRegion]
    criteria: Mapping[str, Criterion] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Own the position and the mappings."""
        freeze(self, "com", "unclipped", "criteria")

    def __getitem__(self, name: str) -> ComRegion:
        """The region of a name."""
        return self._named[name]

    def __iter__(self) -> Iterator[str]:
        """The names, the widest region first."""
        return iter(self._named)

    def __len__(self) -> int:
        """How many regions there are."""
        return len(self._named)

    def __repr__(self) -> str:
        """A line for each region: its area, and how far the CoM is inside; then the notes."""
        width = max(map(len, self))
        lines = (
            f"  {name:{width}}  {region!r}, the CoM {self.margins[name] * 1e3:+.1f} mm inside"
            for name, region in self.items()
        )
        return "\n".join(["ComRegions:", *lines, *(f"note: {note}" for note in self.notes)])

    def to_dict(self) -> dict[str, Any]:
        """Plain data of each region, as ``copsense analyse --regions ... --json`` prints it.

        ``margin`` is how far the stance's CoM is inside [m], None for an empty region.
        """
        return {
            name: json_data(
                {
                    "polygon": region.polygon,
                    "area": region.area,
                    "gap": region.gap,
                    "bounded": region.bounded,
                    "margin": self.margins[name],
                }
            )
            for name, region in self.items()
        }

    @property
    def areas(self) -> dict[str, float]:
        """Area of each region [m^2]."""
        return {name: region.area for name, region in self.items()}

    @property
    def margins(self) -> dict[str, float]:
        """How far the stance's CoM is inside each region [m]; see `ComRegion.margin`."""
        return {name: region.margin(self.com) for name, region in self.items()}

    @property
    def _named(self) -> dict[str, ComRegion]:
        actuated = {} if self.actuated is None else {ACTUATED: self.actuated}
        return {SUPPORTED: self.supported, **actuated, **self.unclipped}


@one_blas_thread()
def com_regions(
    stance: Stance, criteria: Sequence[Criterion], limits: Limits, *, tolerance: float = 1e-4
) -> ComRegions:
    """Where the CoM may be over the ground, contacts and joints held at a posture.

    Args:
        stance: the posture.
        criteria: whose own wrenches are asked about, each of another name. One that leaves forces
            undetermined that contacts exert against each other gets a tie-break, which the result
            names.
        limits: what the wrenches and torques must respect.
        tolerance: of `com_region` [m].

    Raises:
        InfeasibleError: no equilibrium within the limits, wherever the CoM is.
        UndeterminedWrenchError: a criterion even so leaves several wrenches equally good.
        InvalidInputError: limits or weights that do not fit the stance.
        UnknownNameError: a torque limit names no joint.
    """
    check_stance(stance)
    check_limits(limits)
    named = named_criteria(criteria, "a comparison of regions", policies=False)
    chosen, notes = with_tie_breaks([stance], named)  # as an analysis of the posture does
    actuated = None
    if limits.torque is not None:
        actuated = com_region(stance, limits, tolerance=tolerance)
    return ComRegions(
        stance.com[:2],
        com_region(stance, replace(limits, torque=None), tolerance=tolerance),
        actuated,
        {name: criterion_region(stance, c, limits) for name, c in chosen.items()},
        chosen,
        notes,
    )
