"""Opening: which reader a log file needs, by its suffix and its first bytes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from copsense.errors import LogReadError
from copsense.files import checked_path, file_at
from copsense.logs.bag_reading import BagFile
from copsense.logs.c3d_reading import C3dFile
from copsense.logs.channel import LogFile
from copsense.logs.csv_reading import CsvFile
from copsense.logs.eurobench_reading import EurobenchFolder
from copsense.logs.matlab_reading import MatlabFile
from copsense.logs.parquet_reading import ParquetFile
from copsense.logs.recording_reading import RecordingFile

_READERS: dict[str, Callable[[Path], LogFile]] = {
    ".csv": CsvFile,
    ".txt": CsvFile,
    ".tsv": CsvFile,
    ".parquet": ParquetFile,
    ".pq": ParquetFile,
    ".mat": MatlabFile,
    ".bag": BagFile,
    ".mcap": BagFile,
    ".db3": BagFile,
    ".c3d": C3dFile,
    ".nc": RecordingFile,
}


def open_log_file(path: str | Path) -> LogFile:
    """Open a log file as far as to know what it holds.

    Args:
        path: CSV, Parquet, MATLAB (v5 or v7.3), ROS 1 or 2 bag, MCAP, C3D, one of copsense's own
            recordings (netCDF), or the folder of a ROS 2 bag or a Eurobench trial.

    Raises:
        LogReadError: there is no such file, or it is damaged or of another format.
        MissingExtraError: its reader is not installed.
    """
    path = checked_path(path, "a log")
    if path.is_dir():
        return BagFile(path) if (path / "metadata.yaml").is_file() else EurobenchFolder(path)
    if not file_at(path):
        raise LogReadError(f"there is no log at {str(path)[:300]!r}. Give the path of a file.")
    if path.stat().st_size == 0:
        raise LogReadError(f"{path} is empty. Copy it again.")
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        raise LogReadError(
            f"the log {path.name!r} has no known suffix. Readable: {', '.join(_READERS)}, and the "
            "folders of ROS 2 bags and Eurobench trials."
        )
    return reader(path)
