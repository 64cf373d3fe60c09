"""Map plan: everything that decides what a map holds, as a value and as readable parameters."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass
from typing import Any

import numpy as np

from copsense._version import __version__
from copsense.arrays import whole_number
from copsense.criterion import Criterion
from copsense.errors import InvalidInputError
from copsense.limits import Limits
from copsense.maps.sampling import Sampling
from copsense.stance import Stance

FORMAT = 2  # of the store; counted up when what is written changes
_SAME = 1e-9  # by which numbers of one stance may differ between machines
_LISTED = 5  # differences that an error names


@dataclass(frozen=True, eq=False)
class MapPlan:
    """What to map, and in which pieces.

    Attributes:
        stance: robot, contacts, and what the coordinates not named keep.
        criteria: of distinct names.
        sampling: which postures.
        limits: what the wrenches must respect, or None.
        chunk: postures of a chunk, the unit that is written and resumed.
        configurations: whether the configurations are stored too.
    """

    stance: Stance
    criteria: tuple[Criterion, ...]
    sampling: Sampling
    limits: Limits | None = None
    chunk: int = 4096
    configurations: bool = False

    def __post_init__(self) -> None:
        """Validate the criteria and the size of a chunk."""
        given = (self.criteria,) if isinstance(self.criteria, Criterion) else self.criteria
        object.__setattr__(self, "criteria", tuple(given))
        for criterion in self.criteria:
            if not isinstance(criterion, Criterion):
                raise InvalidInputError(
                    f"a map takes criteria, not {criterion!r}: a policy's code cannot be "
                    "written into the store. Give Criterion values."
                )
        object.__setattr__(self, "chunk", whole_number(self.chunk, "the size of a chunk"))
        if self.limits is not None and not self.limits.any:
            object.__setattr__(self, "limits", None)

    @property
    def chunks(self) -> int:
        """Number of chunks."""
        return math.ceil(len(self.sampling) / self.chunk)

    def bounds(self, index: int) -> tuple[int, int]:
        """First posture of a chunk, and the one after its last."""
        return index * self.chunk, min((index + 1) * self.chunk, len(self.sampling))

    def parameters(self) -> dict[str, Any]:
        """Everything that decides the numbers, as JSON would hold it."""
        stance = self.stance
        return {
            "format": FORMAT,
            "copsense": __version__,
            "robot": {"name": stance.robot.name, "model": _model_digest(stance)},
            "configuration": plain(stance.q),
            "contacts": [plain(c) for c in stance.contacts],
            "criteria": [plain(c) for c in self.criteria],
            "limits": plain(self.limits),
            "sampling": {"kind": type(self.sampling).__name__.lower(), **plain(self.sampling)},
            "chunk": int(self.chunk),
            "configurations": bool(self.configurations),
        }


def digest(parameters: Mapping[str, Any]) -> str:
    """SHA-256 of parameters."""
    return hashlib.sha256(json.dumps(parameters, sort_keys=True).encode()).hexdigest()


def plain(value: Any) -> Any:
    """A value of copsense as JSON holds it: dataclasses by their fields, arrays as lists."""
    if is_dataclass(value):
        return {f.name: plain(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    if isinstance(value, float) and not math.isfinite(value):
        return repr(value)
    return value


def differences(stored: Any, asked: Any, where: str = "") -> list[str]:
    """What differs between two sets of parameters, in words; rounding does not count."""
    if isinstance(stored, dict) and isinstance(asked, dict):
        found = []
        for key in dict.fromkeys([*stored, *asked]):
            inside = f"{where}.{key}" if where else str(key)
            found += differences(stored.get(key), asked.get(key), inside)
        return found
    if isinstance(stored, list) and isinstance(asked, list) and len(stored) == len(asked):
        found = []
        for i, (one, other) in enumerate(zip(stored, asked, strict=True)):
            found += differences(one, other, f"{where}[{i}]")
        return found
    if isinstance(stored, float) and isinstance(asked, float | int):
        return [] if abs(stored - asked) <= _SAME else [_unequal(where, stored, asked)]
    return [] if stored == asked else [_unequal(where, stored, asked)]


def worded(found: list[str]) -> str:
    """The first few differences, and the number of the others."""
    more = f", and {len(found) - _LISTED} more" if len(found) > _LISTED else ""
    return "; ".join(found[:_LISTED]) + more


def _unequal(where: str, stored: Any, asked: Any) -> str:
    return f"{where} is {_short(stored)} there, {_short(asked)} here"


def _short(value: Any) -> str:
    if (
        isinstance(value, list)
        and value
        and all(isinstance(v, dict) and "name" in v for v in value)
    ):
        value = [v["name"] for v in value]
    text = json.dumps(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _model_digest(stance: Stance) -> str:
    """SHA-256 of what the numbers depend on in a model: tree, placements, inertias, limits."""
    model, found = stance.robot.model, hashlib.sha256()
    for i in range(model.njoints):
        joint, inertia = model.joints[i], model.inertias[i]
        words = (model.names[i], joint.shortname() if i else "", int(model.parents[i]))
        found.update(repr(words).encode())
        numbers = [model.jointPlacements[i].homogeneous, inertia.mass, inertia.lever]
        found.update(_bytes([*numbers, inertia.inertia]))
    for contact in stance.contacts:
        frame = stance.robot.frame(contact.frame)
        found.update(repr((frame.name, int(frame.parentJoint))).encode())
        found.update(_bytes([frame.placement.homogeneous]))
    limits = [model.lowerPositionLimit, model.upperPositionLimit, model.upperEffortLimit]
    found.update(_bytes([*limits, model.gravity.linear]))
    return found.hexdigest()


def _bytes(numbers: list[Any]) -> bytes:
    """Numbers to twelve digits as bytes: the rest may differ with a machine's math library."""
    flat = np.concatenate([np.ravel(n) for n in numbers])
    return " ".join(f"{x:.12g}" for x in flat + 0.0).encode()
