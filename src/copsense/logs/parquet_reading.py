"""ParquetFile: a table in Apache Parquet, a signal a column; lists are several numbers a row."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from copsense.errors import LogReadError
from copsense.extras import require
from copsense.logs.channel import ROWS, Channel, LogFile, Progress, reading


class ParquetFile(LogFile):
    """A Parquet file."""

    format: ClassVar[str] = "Parquet"

    def __init__(self, path: Path) -> None:
        """Read the schema, and of lists one row."""
        super().__init__(path)
        require("pyarrow", "reading a Parquet log")
        import pyarrow as pa
        import pyarrow.parquet as pq

        with reading(path, "Parquet file"), pq.ParquetFile(path) as file:
            schema = file.schema_arrow
            lists = [f.name for f in schema if _is_list(f.type)]
            first = next(file.iter_batches(1, columns=lists), None) if lists else None
            for each in schema:
                if _is_list(each.type):
                    one = first.column(each.name)[0].as_py() if first is not None else None
                    if one and all(isinstance(x, float | int) for x in one):
                        self.add(Channel(each.name, len(one)))
                elif pa.types.is_temporal(each.type):
                    unit = getattr(each.type, "unit", "ns")
                    self.add(Channel(each.name, 1, unit_time=unit))
                elif pa.types.is_floating(each.type) or pa.types.is_integer(each.type):
                    self.add(Channel(each.name, 1))
        if not self.channels:
            raise LogReadError(f"{path} has no column of numbers. Give a table of signals.")

    def blocks(
        self, keys: Sequence[str], advance: Progress
    ) -> Iterator[Mapping[str, Float[np.ndarray, "n k"]]]:
        """Rows of some columns."""
        import pyarrow.parquet as pq

        wanted = list(dict.fromkeys(keys))
        with reading(self.path, "Parquet file"), pq.ParquetFile(self.path) as file:
            share = self.path.stat().st_size / max(1, file.metadata.num_rows)
            for batch in file.iter_batches(max(1, ROWS * 8 // len(wanted)), columns=wanted):
                yield {key: self._numbers(key, batch.column(key)) for key in wanted}
                advance(round(share * batch.num_rows))

    def _numbers(self, key: str, column: Any) -> Float[np.ndarray, "n k"]:
        import pyarrow as pa

        width = self.channels[key].width
        if _is_list(column.type):
            rows = column.to_pylist()
            if any(row is not None and len(row) != width for row in rows):
                raise LogReadError(
                    f"the lists of column {key!r} of {self.path.name} differ in length. Give "
                    f"{width} numbers in every row."
                )
            return np.array([row or [np.nan] * width for row in rows], float).reshape(-1, width)
        if pa.types.is_temporal(column.type):
            column = column.cast(pa.int64())
        return np.asarray(column.to_numpy(zero_copy_only=False), float)[:, None]


def _is_list(kind: Any) -> bool:
    import pyarrow as pa

    return bool(
        pa.types.is_list(kind) or pa.types.is_large_list(kind) or pa.types.is_fixed_size_list(kind)
    )
