"""RecordingFile: what `copsense balance --output FILE.nc` wrote."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from copsense.errors import LogReadError
from copsense.extras import require
from copsense.logs.channel import ROWS, Channel, LogFile, Meaning, Progress, reading

_JOINTS: dict[str, Meaning] = {
    "joint_position": "positions",
    "joint_velocity": "velocities",
    "torque": "torques",
}


class RecordingFile(LogFile):
    """A recording of copsense's own simulation."""

    format: ClassVar[str] = "recording"

    def __init__(self, path: Path) -> None:
        """Read the variables' names."""
        super().__init__(path)
        require("netCDF4", "reading a recording")
        require("xarray", "reading a recording")
        import xarray as xr

        with reading(path, "netCDF file"), xr.open_dataset(path, engine="netcdf4") as data:
            missing = [
                v
                for v in ("time", "joint_position", "wrench", "configuration")
                if v not in data.variables
            ]
            if missing:
                raise LogReadError(
                    f"{path} is not a recording: it has no {', '.join(missing)}. Give what "
                    "copsense balance --output FILE.nc writes."
                )
            self.add(Channel("time", 1, meaning="time"))
            for key, meaning in _JOINTS.items():
                if key in data:
                    names = tuple(map(str, data["joint"].values))
                    if data[key].sizes.get("joint") == len(names):
                        self.add(Channel(key, len(names), names, "time", meaning))
            for contact in map(str, data["contact"].values):
                self.add(Channel(f"wrench/{contact}", 6, (), "time", "wrench"))
            # A planar robot's base is not a pose in space.
            if data["configuration"].shape[1] >= 7 + data["joint_position"].shape[1]:
                self.add(Channel("configuration/position", 3, (), "time", "base position"))
                self.add(Channel("configuration/rotation", 4, (), "time", "base rotation"))
            self.rows: int = int(data.sizes["time"])
            self.robot: str = str(data.attrs.get("robot", ""))
        self.layout: str = "copsense recording"

    def blocks(
        self, keys: Sequence[str], advance: Progress
    ) -> Iterator[Mapping[str, Float[np.ndarray, "n k"]]]:
        """Rows of some variables."""
        import xarray as xr

        share = self.path.stat().st_size / max(1, self.rows)
        with (
            reading(self.path, "netCDF file"),
            xr.open_dataset(self.path, engine="netcdf4") as data,
        ):
            for begin in range(0, self.rows, ROWS // 8):
                part = data.isel(time=slice(begin, begin + ROWS // 8))
                found = {}
                for key in keys:
                    name, _, label = key.partition("/")
                    values = part[name]
                    if name == "wrench":
                        values = values.sel(contact=label)
                    array = np.asarray(values.values, float).reshape(part.sizes["time"], -1)
                    if name == "configuration":
                        array = array[:, :3] if label == "position" else array[:, 3:7]
                    found[key] = array
                yield found
                advance(round(share * part.sizes["time"]))
