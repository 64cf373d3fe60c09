"""CsvFile: a table of numbers in text, a signal a column."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from copsense.errors import LogReadError
from copsense.extras import require
from copsense.logs.channel import ROWS, Channel, LogFile, Progress, reading

_SNIFFED = 65536  # bytes in which the heading must end


class CsvFile(LogFile):
    """A CSV file; commas, semicolons, tabs or spaces between the columns, a heading above them."""

    format: ClassVar[str] = "CSV"

    def __init__(self, path: Path) -> None:
        """Read the heading."""
        super().__init__(path)
        require("pandas", "reading a CSV log")
        try:
            with path.open(encoding="utf-8-sig", newline="") as file:
                head = file.read(_SNIFFED)
        except (OSError, UnicodeDecodeError) as error:
            raise LogReadError(
                f"{path} is not a text file: {error}. Give a CSV table with a heading."
            ) from None
        lines = [line for line in head.splitlines() if line.strip() and line[0] != "#"]
        if len(lines) < 2 or "\0" in head:
            raise LogReadError(
                f"{path} holds no table. Give a heading and a row of numbers per time, separated "
                "by commas."
            )
        self._separator: str = max(",;\t ", key=lines[0].count)
        names = [n.strip() for n in next(csv.reader([lines[0]], delimiter=self._separator))]
        if all(_is_number(name) for name in names):
            raise LogReadError(
                f"{path} has no heading: its first line is numbers. Name the columns, such as "
                "time,l_knee,...,l_sole_fz."
            )
        twice = {name for name in names if names.count(name) > 1}
        if twice:
            raise LogReadError(
                f"{path} has several columns named {', '.join(sorted(twice))}. Give each its own "
                "name."
            )
        self._names = names
        for name in names:
            self.add(Channel(name, 1))

    def blocks(
        self, keys: Sequence[str], advance: Progress
    ) -> Iterator[Mapping[str, Float[np.ndarray, "n k"]]]:
        """Rows of some columns."""
        import pandas as pd

        wanted = list(dict.fromkeys(keys))
        text, rows = dict.fromkeys(wanted, 0), 0
        examples: dict[str, str] = {}
        with self.path.open("rb") as file:
            at = 0
            with reading(self.path, "table"):
                for part in pd.read_csv(
                    file,
                    sep=self._separator,
                    names=self._names,
                    header=0,
                    usecols=wanted,
                    comment="#",
                    skip_blank_lines=True,
                    skipinitialspace=True,
                    chunksize=max(1, ROWS * 8 // len(self._names)),
                    index_col=False,
                    low_memory=False,
                ):
                    block = {}
                    for key in wanted:
                        column = part[key]
                        if not pd.api.types.is_numeric_dtype(column):
                            numbers = pd.to_numeric(column, errors="coerce")
                            words = column[numbers.isna() & column.notna()]
                            if len(words):
                                text[key] += len(words)
                                examples.setdefault(key, str(words.iloc[0])[:40])
                            column = numbers
                        block[key] = np.asarray(column, float)[:, None]
                    rows += len(part)
                    yield block
                    advance(file.tell() - at)
                    at = file.tell()
        for key, count in text.items():
            if count == rows and rows:
                raise LogReadError(
                    f"the column {key!r} of {self.path.name} holds no number; it begins with "
                    f"{examples[key]!r}. Write numbers, with a decimal point; times in seconds."
                )
            if count:
                self.notes.append(
                    f"{count} entries of the column {key!r}, such as {examples[key]!r}, are not "
                    "numbers and count as missing."
                )


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
