"""What made these numbers: versions, robot, criteria and limits, as plain data that JSON holds."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np

from copsense._version import __version__
from copsense.criterion import Criterion
from copsense.errors import InvalidInputError
from copsense.limits import Limits
from copsense.stance import Stance
from copsense.statics import WrenchPolicy, policy_name

_SAME = 1e-9  # by which numbers of one stance may differ between machines
_LISTED = 5  # differences that an error names


def plain(value: object) -> Any:
    """A value of copsense as JSON holds it.

    Criteria become what `Criterion.to_dict` gives, other dataclasses their fields, with the class's
    name under ``"is"``. Arrays become lists, whole numbers floats (1 and 1.0 are the same
    parameter), infinities and NaN text.

    Raises:
        InvalidInputError: something that is not a value, such as a function.
    """
    if isinstance(value, Criterion):
        return plain(value.to_dict())
    if is_dataclass(value) and not isinstance(value, type):
        return {"is": type(value).__name__} | {
            f.name: plain(getattr(value, f.name)) for f in fields(value) if f.init
        }
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(name): plain(part) for name, part in value.items()}
    if isinstance(value, list | tuple):
        return [plain(part) for part in value]
    if value is None or isinstance(value, str | bool):
        return value
    if isinstance(value, int | float):
        return float(value) if math.isfinite(value) else repr(float(value))
    raise InvalidInputError(
        f"{value!r} cannot be written down as a parameter. Give numbers, words and values such as "
        "Motors(delay=0.005)."
    )


def read_plain(value: Any) -> Any:
    """What `plain` wrote, its infinities and NaN as numbers again."""
    if isinstance(value, Mapping):
        return {name: read_plain(part) for name, part in value.items()}
    if isinstance(value, list):
        return [read_plain(part) for part in value]
    return float(value) if value in ("inf", "-inf", "nan") else value


def digest(parameters: object) -> str:
    """SHA-256 of plain data."""
    return hashlib.sha256(json.dumps(parameters, sort_keys=True).encode()).hexdigest()


@dataclass(frozen=True)
class Difference:
    """Where two sets of plain data differ.

    Attributes:
        where: the way to the value, such as ``"criteria[0].name"``.
        stored: the value in the first.
        asked: the value in the second.
    """

    where: str
    stored: Any
    asked: Any

    def __str__(self) -> str:
        """In words."""
        return f"{self.where} is {_short(self.stored)} there, {_short(self.asked)} here"


def differences(stored: object, asked: object, where: str = "") -> list[Difference]:
    """Where two sets of plain data differ; numbers within rounding are the same."""
    if isinstance(stored, Mapping) and isinstance(asked, Mapping):
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
    if isinstance(stored, float | int) and isinstance(asked, float | int):
        same = abs(stored - asked) <= _SAME
    else:
        same = stored == asked
    return [] if same else [Difference(where, stored, asked)]


def worded(found: Sequence[Difference]) -> str:
    """The first few differences, and how many more there are."""
    more = f", and {len(found) - _LISTED} more" if len(found) > _LISTED else ""
    return "; ".join(str(one) for one in found[:_LISTED]) + more


def model_digest(stance: Stance) -> str:
    """SHA-256 of what the numbers depend on in a model: tree, placements, inertias and limits."""
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
    drives = stance.robot.drives
    if drives or stance.loads:
        found.update(json.dumps(plain([drives, list(stance.loads)])).encode())
    if stance.motion is not None:
        found.update(_bytes([stance.motion.velocity, stance.motion.acceleration]))
    return found.hexdigest()


def made_by(
    stance: Stance,
    criteria: Sequence[Criterion | WrenchPolicy],
    limits: Limits | None,
    notes: Sequence[str] = (),
) -> dict[str, str]:
    """What made the numbers of a result, as attributes of its dataset.

    Returns:
        ``criteria``: JSON of `Criterion.to_dict` for each, or ``{"policy": name}``; ``limits``:
        JSON of the limits, ``"null"`` without; ``model_digest``: of the robot and its contacts'
        frames; ``contacts``: JSON of the contacts; ``notes``: JSON of the robot's notes and of
        those given.
    """
    return {
        "criteria": json.dumps(
            [plain(c) if isinstance(c, Criterion) else {"policy": policy_name(c)} for c in criteria]
        ),
        "limits": json.dumps(plain(limits)),
        "contacts": json.dumps(plain(stance.contacts)),
        "model_digest": model_digest(stance),
        "notes": json.dumps([*stance.robot.notes, *notes]),
    }


def versions(packages: Sequence[str]) -> dict[str, str]:
    """The version of copsense and of other distributions, empty where one is not installed."""
    found = {"copsense": __version__}
    for package in packages:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = ""
    return found


def _short(value: Any) -> str:
    if (
        isinstance(value, list)
        and value
        and all(isinstance(v, dict) and "name" in v for v in value)
    ):
        value = [v["name"] for v in value]
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    text = json.dumps(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _bytes(numbers: Sequence[Any]) -> bytes:
    """Numbers to twelve digits as bytes: less is the mathematics library of another machine."""
    flat = np.concatenate([np.ravel(n) for n in numbers])
    return " ".join(f"{x:.12g}" for x in flat + 0.0).encode()
