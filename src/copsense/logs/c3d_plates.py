"""The force plates of a C3D file, as a program that `apart.read_apart` runs."""

from __future__ import annotations

import sys

import numpy as np


def main() -> None:
    """Write each plate's reaction, laboratory's axes about their origin [N, Nm], and the rate."""
    from ezc3d import c3d

    data = c3d(sys.argv[1], extract_forceplat_data=True)
    plates = [_wrench(plate) for plate in data["data"].get("platform", [])]
    found = {f"plate {i + 1}": wrench for i, wrench in enumerate(plates)}
    rate = float(data["header"]["analogs"]["frame_rate"])
    held = {"rate": np.array(rate)} | found
    np.savez(sys.stdout.buffer, **held)  # type: ignore[arg-type]


def _wrench(plate: dict[str, object]) -> np.ndarray:
    """Force and moment about the laboratory's origin (N, 6).

    ezc3d gives the moment about the middle of the plate's corners.
    """
    force = np.asarray(plate["force"], float).T
    length = _unit(plate["unit_position"])
    moment = np.asarray(plate["moment"], float).T * _unit(plate["unit_moment"])
    middle = np.asarray(plate["corners"], float).reshape(3, -1).mean(axis=1) * length
    return np.hstack([force, moment + np.cross(middle, force)])


def _unit(text: object) -> float:
    return 1e-3 if "mm" in str(text).lower() else 1.0


if __name__ == "__main__":
    main()
