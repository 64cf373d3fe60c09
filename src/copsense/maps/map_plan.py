"""Map plan: everything that decides what a map holds, as a value and as readable parameters."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from copsense._version import __version__
from copsense.arrays import check_type, whole_number
from copsense.content import ShortRepr
from copsense.criterion import Criterion
from copsense.errors import InvalidInputError
from copsense.limits import Limits, optional_limits
from copsense.maps.sampling import Grid, Sample, Sampling
from copsense.provenance import model_digest, plain
from copsense.stance import Stance, check_at_rest, check_stance
from copsense.statics import named_criteria, with_tie_breaks
from copsense.uncertainty import Source, Uncertainty, check_uncertain, sources_of

FORMAT = 6  # of the store; counted up when what is written changes
_SMALL, _LARGE, _MANY = 4096, 16384, 16  # postures of a chunk; the large ones from 16 chunks on
_SLOW = 128  # of one whose postures take tens of milliseconds each


@dataclass(frozen=True, eq=False, repr=False)
class MapPlan(ShortRepr):
    """What to map, and in which pieces.

    Attributes:
        stance: robot, contacts, and what the coordinates not named keep.
        criteria: of distinct names.
        sampling: which postures.
        limits: what the wrenches must respect, or None.
        chunk: postures of a chunk, the unit that is written and resumed; given as None, 4096, and
            16384 in a map of 262144 or more, where each write would cost as much as the numbers;
            128 with an uncertainty.
        configurations: whether the configurations are stored too.
        uncertainty: how far the model may be off, for what that leaves of the travel; or None.
        sources: the errors that it means here.
        notes: what to know about robot and criteria, such as a tie-break that one was given.
    """

    stance: Stance
    criteria: Sequence[Criterion]
    sampling: Sampling
    limits: Limits | None = None
    chunk: int | None = None
    configurations: bool = False
    uncertainty: Uncertainty | Literal["default"] | None = None
    sources: tuple[Source, ...] = field(init=False, default=())
    notes: tuple[str, ...] = field(init=False, default=())

    def __post_init__(self) -> None:
        """Validate the criteria and the size of a chunk."""
        check_stance(self.stance)
        check_at_rest(self.stance, "a map")
        remedy = 'Give one, such as Grid((Axis("com_y", -0.03, 0.03, 41),)) or Sample(...).'
        check_type(self.sampling, (Grid, Sample), "a grid or sample of postures", remedy)
        object.__setattr__(self, "limits", optional_limits(self.limits))
        given = named_criteria(self.criteria, "a map")
        chosen, notes = with_tie_breaks([self.stance], given)
        object.__setattr__(self, "criteria", tuple(chosen.values()))
        object.__setattr__(self, "notes", (*self.stance.robot.notes, *notes))
        for criterion in self.criteria:
            if not isinstance(criterion, Criterion):
                raise InvalidInputError(
                    f"a map takes criteria, not {criterion!r}: a policy's code cannot be "
                    "written into the store. Give Criterion values."
                )
        self._take_uncertainty()
        size = _SMALL if len(self.sampling) < _MANY * _LARGE else _LARGE
        size = size if self.uncertainty is None else _SLOW
        given_size = size if self.chunk is None else self.chunk
        object.__setattr__(self, "chunk", whole_number(given_size, "the size of a chunk"))

    def _take_uncertainty(self) -> None:
        """Find the errors that an uncertainty means, before any posture is evaluated."""
        given = self.uncertainty
        if given is None:
            return
        check_uncertain(self.stance)
        if given == "default":
            given = Uncertainty.default(self.stance)
        assert isinstance(given, Uncertainty)
        object.__setattr__(self, "uncertainty", given)
        object.__setattr__(self, "sources", sources_of(given, self.stance, self.limits))

    @property
    def size(self) -> int:
        """Number of postures of a chunk."""
        assert self.chunk is not None  # since `__post_init__`
        return self.chunk

    @property
    def chunks(self) -> int:
        """Number of chunks."""
        return math.ceil(len(self.sampling) / self.size)

    def bounds(self, index: int) -> tuple[int, int]:
        """First posture of a chunk, and the one after its last."""
        return index * self.size, min((index + 1) * self.size, len(self.sampling))

    def parameters(self) -> dict[str, Any]:
        """Everything that decides the numbers, as JSON would hold it."""
        stance, sampling = self.stance, plain(self.sampling)
        if isinstance(self.sampling, Sample):  # a seed may be too long for a float
            sampling |= {"count": int(self.sampling.count), "seed": int(self.sampling.seed)}
        found = {
            "format": FORMAT,
            "copsense": __version__,
            "robot": {"name": stance.robot.name, "model": model_digest(stance)},
            "configuration": plain(stance.q),
            "contacts": [plain(c) for c in stance.contacts],
            "criteria": [plain(c.to_dict()) for c in self.criteria],
            "limits": plain(self.limits),
            "sampling": sampling,
            "chunk": self.size,
            "configurations": bool(self.configurations),
        }
        if self.uncertainty is not None:
            assert isinstance(self.uncertainty, Uncertainty)
            found["uncertainty"] = plain(self.uncertainty.to_dict())
        return found
