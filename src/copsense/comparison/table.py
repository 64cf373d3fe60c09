"""Table: the scores of a plan as CSV, one row each, read back exactly as written."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from io import StringIO
from pathlib import Path
from typing import Any

import pandas as pd

from copsense.comparison.case import Case
from copsense.comparison.score import Score
from copsense.comparison.score_kinds import SCORES
from copsense.errors import InvalidInputError
from copsense.files import write_beside
from copsense.provenance import differences

NAMES = ("robot", "posture", "controller", "conditions", "trial")
COLUMNS = (
    "key",
    *NAMES,
    "score",
    "unit",
    *(f.name for f in fields(Score) if f.name != "score"),
    "parameters",
)
_NUMBERS = ("value", "low", "high", "predicted", "first_order")
_WRITE_ONE = "Write one with: copsense benchmark ... --output FILE.csv"


def make_table(done: Iterable[tuple[Case, Sequence[Score]]]) -> pd.DataFrame:
    """A tidy table, a row per score.

    Columns: the case's ``key``; names of robot, posture, controller, conditions and trial; the
    fields of `Score` with its unit; and ``parameters``, everything the case depends on, as JSON.
    """
    rows = [
        {"key": case.key, **dict(zip(NAMES, case.label, strict=True)), "score": score.score}
        | {"unit": score.unit}
        | {f.name: getattr(score, f.name) for f in fields(score)}
        | {"parameters": json.dumps(case.parameters, sort_keys=True)}
        for case, scores in done
        for score in scores
    ]
    return pd.DataFrame(rows, columns=list(COLUMNS))


def write_table(done: Iterable[tuple[Case, Sequence[Score]]], path: Path) -> None:
    """Write a table to a temporary file and rename it; numbers are exact to the last bit.

    Raises:
        OutputError: the file cannot be written.
    """
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for row in make_table(done).itertuples(index=False):
        writer.writerow([_written(value) for value in row])
    write_beside(path, lambda temporary: temporary.write_text(text.getvalue(), encoding="utf-8"))


def load_benchmark(path: str | Path) -> pd.DataFrame:
    """Read the table of a benchmark.

    Raises:
        InvalidInputError: no such file, or it is not the table of a benchmark.
    """
    path = Path(path)
    try:
        with path.open(newline="", encoding="utf-8") as file:
            reader = csv.DictReader(file)
            missing = [name for name in COLUMNS if name not in (reader.fieldnames or ())]
            if missing:
                raise InvalidInputError(
                    f"{path} is not the table of a benchmark: it lacks {', '.join(missing)}. "
                    f"{_WRITE_ONE}."
                )
            rows = [_read(row, number, path) for number, row in enumerate(reader, 2)]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        reason = getattr(error, "strerror", None) or error
        raise InvalidInputError(f"{path} cannot be read: {reason}. {_WRITE_ONE}.") from None
    return pd.DataFrame(rows, columns=list(COLUMNS))


def scores_of(table: pd.DataFrame) -> dict[str, list[Score]]:
    """The scores of each case of a table, by the case's key."""
    found: dict[str, list[Score]] = {}
    for row in table.to_dict("records"):
        score = Score(**{f.name: row[f.name] for f in fields(Score)})
        found.setdefault(str(row["key"]), []).append(score)
    return found


def other_parameters(table: pd.DataFrame, cases: Sequence[Case]) -> list[str]:
    """Where a table was made with other parameters than some cases, in words."""
    keys = {case.key for case in cases}
    labels = {case.label: case for case in cases}
    found: dict[str, None] = {}
    for row in table.drop_duplicates("key").to_dict("records"):
        if row["key"] in keys:
            continue
        label = tuple(row[name] for name in NAMES)
        case = labels.get(label)
        if case is None:
            found[f"it holds {' / '.join(label)}, which is not asked for"] = None
            continue
        try:
            old = json.loads(row["parameters"])
        except ValueError:
            old = {}
        for part in differences(old, case.parameters):
            then, now = json.dumps(part.stored), json.dumps(part.asked)
            found[f"{part.where} was {then}, is now {now}"] = None
    return list(found)


def _written(value: object) -> object:
    if isinstance(value, float):
        return "" if math.isnan(value) else repr(float(value))
    return value


def _read(row: Mapping[str, str], number: int, path: Path) -> dict[str, Any]:
    try:
        found: dict[str, Any] = {name: row[name] for name in COLUMNS}
        for name in _NUMBERS:
            found[name] = float(row[name]) if row[name] else math.nan
        found["runs"] = int(row["runs"])
        if row["score"] not in SCORES:
            raise ValueError(f"no score is called {row['score']!r}")
    except (KeyError, TypeError, ValueError) as error:
        raise InvalidInputError(f"{path}, line {number}: {error}. {_WRITE_ONE}.") from None
    return found
