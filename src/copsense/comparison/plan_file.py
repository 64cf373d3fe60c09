"""Plan files: the cases of a benchmark, written in TOML."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import is_dataclass
from pathlib import Path
from typing import Any, get_args, get_type_hints

from copsense.comparison.case import IDEAL, Case, make_plan
from copsense.comparison.choices import Conditions, ControllerChoice, PostureChoice, RobotChoice
from copsense.comparison.plan_values import as_table, build, check_fields
from copsense.comparison.trials import Trial, trial_named
from copsense.errors import CopsenseError, InvalidInputError, UnknownNameError
from copsense.limits import Limits
from copsense.simulation import Scenario


def read_plan(path: str | Path) -> tuple[Case, ...]:
    """A plan from a TOML file.

    Tables ``[robots.NAME]``, ``[postures.NAME]``, ``[controllers.NAME]``, ``[conditions.NAME]`` and
    ``[trials.NAME]`` hold the fields of `RobotChoice`, `PostureChoice` (joints as ``joints_deg``),
    `ControllerChoice`, a scenario and a trial (with its ``kind``). The plan is their product, or
    that of each ``[[block]]``, which lists names: ``robots = ["icub"]``.

    Raises:
        InvalidInputError: no such file, no TOML, or values that mean nothing.
        UnknownNameError: a table, field or name that is not known.
    """
    path = Path(path)
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InvalidInputError(
            f"the plan {path} cannot be read: {error.strerror}. Give the path of a TOML file."
        ) from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InvalidInputError(f"the plan {path} is no TOML: {error}. Mend this place.") from None
    readers = {
        "robots": _robot,
        "postures": _posture,
        "controllers": _controller,
        "conditions": _conditions,
        "trials": _trial,
    }
    for name in content:
        if name not in (*readers, "block"):
            raise UnknownNameError(f"table in {path.name}", name, (*readers, "block"))
    known: dict[str, dict[str, Any]] = {}
    for kind, read in readers.items():
        tables = content.get(kind, {})
        if not isinstance(tables, Mapping):
            raise InvalidInputError(f"{kind} in {path.name} is no table. Write [{kind}.NAME].")
        known[kind] = {}
        for name, table in tables.items():
            if not isinstance(table, Mapping):
                raise InvalidInputError(f"{kind}.{name} is no table. Write [{kind}.{name}].")
            try:
                if "name" in table:
                    raise InvalidInputError("a name is that of its table. Leave it out.")
                known[kind][name] = read(name, dict(table))
            except UnknownNameError:
                raise
            except (CopsenseError, TypeError, ValueError) as error:
                raise InvalidInputError(f"[{kind}.{name}] in {path.name}: {error}") from None
    known["postures"] = known["postures"] or {"own": PostureChoice()}
    known["conditions"] = known["conditions"] or {"ideal": IDEAL}
    for kind in ("robots", "controllers", "trials"):
        if not known[kind]:
            raise InvalidInputError(f"{path.name} has no {kind}. Write a table [{kind}.NAME].")
    blocks = content.get("block", [{}])
    cases: list[Case] = []
    for block in blocks if isinstance(blocks, list) else [blocks]:
        cases += _block(as_table(block, f"a [[block]] in {path.name}"), known, path.name)
    return tuple(cases)


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
    table.setdefault("source", name)
    if "soles" in table:
        check_fields(RobotChoice, {"soles": table["soles"]})
        table["soles"] = {frame: tuple(sole) for frame, sole in table["soles"].items()}
    return build(RobotChoice, table | {"name": name})


def _posture(name: str, table: dict[str, Any]) -> PostureChoice:
    if "joints_deg" in table:
        degrees = table.pop("joints_deg")
        check_fields(PostureChoice, {"joints": degrees})
        table["joints"] = {joint: math.radians(angle) for joint, angle in degrees.items()}
    return build(PostureChoice, table | {"name": name})


def _controller(name: str, table: dict[str, Any]) -> ControllerChoice:
    if "limits" in table:
        # TOML has no null: false switches a limit off.
        values = {
            key: None if v is False else v for key, v in as_table(table["limits"], "limits").items()
        }
        table["limits"] = build(Limits, values)
    return build(ControllerChoice, table | {"name": name})


def _conditions(name: str, table: dict[str, Any]) -> Conditions:
    hints = get_type_hints(Scenario)
    values = {}
    for field, value in table.items():
        kinds = [k for k in (hints.get(field), *_parts(hints.get(field))) if is_dataclass(k)]
        if kinds and isinstance(value, Mapping):
            value = build(kinds[0], dict(value))  # type: ignore[arg-type]
        elif kinds and isinstance(value, list):
            value = tuple(build(kinds[0], as_table(part, field)) for part in value)  # type: ignore[arg-type]
        values[field] = value
    check_fields(Scenario, values)
    return Conditions(name, values)


def _trial(name: str, table: dict[str, Any]) -> Trial:
    return trial_named(str(table.pop("kind", name)), **table)


def _parts(hint: Any) -> list[Any]:
    """What a type is made of: the X of X | None and of tuple[X, ...]."""
    found = []
    for part in get_args(hint):
        found += [part, *_parts(part)]
    return found
