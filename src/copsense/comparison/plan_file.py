"""Plan files: the cases of a benchmark, written in TOML."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, get_type_hints

from copsense.comparison.case import IDEAL, Case, make_plan
from copsense.comparison.choices import Conditions, ControllerChoice, PostureChoice, RobotChoice
from copsense.comparison.plan_values import structure
from copsense.comparison.trials import Trial, trial_named
from copsense.errors import (
    CopsenseError,
    InvalidInputError,
    MissingExtraError,
    UnknownNameError,
)
from copsense.files import read_toml
from copsense.simulation import Scenario


@dataclass(frozen=True)
class PostureTable:
    """A posture as a plan file has it, with the unit of each position in its key.

    Attributes:
        knees_deg: bend of both knees [deg], see `PostureChoice.knees`.
        width: between the feet [m].
        joints_deg: joint -> angle [deg].
        joints_m: prismatic joint -> position [m].
    """

    knees_deg: float | None = None
    width: float | None = None
    joints_deg: Mapping[str, float] = field(default_factory=dict)
    joints_m: Mapping[str, float] = field(default_factory=dict)


def read_plan(path: str | Path) -> tuple[Case, ...]:
    """A plan from a TOML file.

    Tables ``[robots.NAME]``, ``[postures.NAME]``, ``[controllers.NAME]``, ``[conditions.NAME]`` and
    ``[trials.NAME]`` hold the fields of `RobotChoice`, `PostureTable`, `ControllerChoice`, a
    scenario and a trial (with its ``kind``). The plan is their product, or that of each
    ``[[block]]``, which lists names: ``robots = ["icub"]``.

    Raises:
        InvalidInputError: no such file, not TOML, or a value that is not valid.
        UnknownNameError: a table, field or name that is not known.
    """
    path = Path(path)
    content = read_toml(path, "plan", "Give the path of a TOML file.")
    for name in content:
        if name not in (*_READERS, "block"):
            raise UnknownNameError(f"table in {path.name}", name, (*_READERS, "block"))
    known = {kind: _read_tables(kind, content.get(kind, {}), path.name) for kind in _READERS}
    known["postures"] = known["postures"] or {"own": PostureChoice()}
    known["conditions"] = known["conditions"] or {"ideal": IDEAL}
    for kind in ("robots", "controllers", "trials"):
        if not known[kind]:
            raise InvalidInputError(f"{path.name} has no {kind}. Write a table [{kind}.NAME].")
    blocks = content.get("block", [{}])
    cases: list[Case] = []
    for block in blocks if isinstance(blocks, list) else [blocks]:
        block = structure(block, dict[str, Any], f"a [[block]] in {path.name}")
        cases += _block(block, known, path.name)
    return tuple(cases)


def _read_tables(kind: str, tables: object, where: str) -> dict[str, Any]:
    """The tables ``[kind.NAME]`` as values, by their names."""
    if not isinstance(tables, Mapping):
        raise InvalidInputError(f"{kind} in {where} is not a table. Write [{kind}.NAME].")
    found = {}
    for name, table in tables.items():
        if not isinstance(table, Mapping):
            raise InvalidInputError(f"{kind}.{name} is not a table. Write [{kind}.{name}].")
        if "name" in table:
            raise InvalidInputError(
                f"[{kind}.{name}] in {where} has a key 'name', which its heading gives. "
                "Leave it out."
            )
        try:
            found[name] = _READERS[kind](name, dict(table))
        except (UnknownNameError, MissingExtraError):
            raise
        except (CopsenseError, TypeError, ValueError) as error:
            raise InvalidInputError(f"[{kind}.{name}] in {where}: {error}") from None
    return found


def _block(
    block: Mapping[str, Any], known: Mapping[str, Mapping[str, Any]], where: str
) -> tuple[Case, ...]:
    chosen: dict[str, dict[str, Any]] = {}
    for kind in block:
        if kind not in known:
            raise UnknownNameError(f"part of a [[block]] in {where}", kind, known)
    for kind, there in known.items():
        names = block.get(kind, list(there))
        if names == []:
            raise InvalidInputError(f"a [[block]] in {where} has no {kind}. Name some of them.")
        for name in names if isinstance(names, list) else [names]:
            if name not in there:
                raise UnknownNameError(f"{kind} of a [[block]] in {where}", name, there)
            chosen.setdefault(kind, {})[name] = there[name]
    return make_plan(
        list(chosen["robots"].values()),
        list(chosen["postures"].values()),
        list(chosen["controllers"].values()),
        chosen["trials"],
        list(chosen["conditions"].values()),
    )


def _robot(name: str, table: dict[str, Any]) -> RobotChoice:
    return structure({"source": name} | table | {"name": name}, RobotChoice)


def _posture(name: str, table: dict[str, Any]) -> PostureChoice:
    found: PostureTable = structure(table, PostureTable)
    joints = {joint: math.radians(angle) for joint, angle in found.joints_deg.items()}
    return PostureChoice(
        name,
        None if found.knees_deg is None else math.radians(found.knees_deg),
        found.width,
        (joints | dict(found.joints_m)) or None,
    )


def _controller(name: str, table: dict[str, Any]) -> ControllerChoice:
    limits = table.get("limits")
    if isinstance(limits, Mapping):
        # TOML has no null: false switches a limit off.
        table["limits"] = {key: None if v is False else v for key, v in limits.items()}
    return structure(table | {"name": name}, ControllerChoice)


def _conditions(name: str, table: dict[str, Any]) -> Conditions:
    hints = get_type_hints(Scenario)
    # Conditions name the fields that a scenario lacks; the others are of its fields' types.
    return Conditions(
        name,
        {
            key: structure(value, hints[key], key) if key in hints else value
            for key, value in table.items()
        },
    )


def _trial(name: str, table: dict[str, Any]) -> Trial:
    return trial_named(str(table.pop("kind", name)), **table)


_READERS: dict[str, Callable[[str, dict[str, Any]], Any]] = {
    "robots": _robot,
    "postures": _posture,
    "controllers": _controller,
    "conditions": _conditions,
    "trials": _trial,
}
