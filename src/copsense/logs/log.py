"""Log: what a robot recorded of itself, on one clock and in copsense's conventions."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from jaxtyping import Float

from copsense.content import freeze
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.logs.finding import Finding

SensorKind = Literal["sole", "leg", "plate"]
SENSOR_KINDS: tuple[SensorKind, ...] = ("sole", "leg", "plate")
WORLD = "world"  # frame of a wrench in world axes, about the contact's origin


@dataclass(frozen=True, eq=False, repr=False)
class WrenchSeries:
    """What one force sensor measured: what the environment does to the robot.

    Attributes:
        name: of the sensor.
        contact: name of the contact, or of its frame in the robot's model, that it serves.
        frame: frame of the robot's model in whose axes and about whose origin it measures; empty
            for the contact frame itself, ``"world"`` for world axes about the contact's origin.
        kind: ``"sole"`` (under the foot's own link), ``"leg"`` (farther up: the weight and inertia
            of what hangs below are taken off) or ``"plate"`` (a force plate in the ground).
        values: force, then moment (N, 6) [N, Nm]; NaN where nothing was measured. A sensor in the
            leg measures what the part below does to the part above, which at rest points as
            the ground's force does.
    """

    name: str
    contact: str
    frame: str
    kind: SensorKind
    values: Float[np.ndarray, "N 6"]

    def __post_init__(self) -> None:
        """Own the array."""
        freeze(self, "values")

    def __repr__(self) -> str:
        """Sensor, contact and mean normal force."""
        what = "normal force" if self.normal_only else "wrench"
        normal = self.values[:, 2]
        known = normal[np.isfinite(normal)]
        mean = f"{known.mean():.4g} N on average" if known.size else "nothing measured"
        return f"WrenchSeries({self.name!r}: {what} of {self.contact!r}, {mean})"

    @property
    def normal_only(self) -> bool:
        """Whether the normal force is all that was measured."""
        return not bool(np.isfinite(self.values[:, [0, 1, 3, 4, 5]]).any())


@dataclass(frozen=True, eq=False, repr=False)
class Log:
    """What a robot recorded of itself.

    Rows are samples at equal steps; where nothing was measured, in a gap or a stretch of NaN, the
    numbers are NaN and `findings` says so.

    Attributes:
        source: the file's name.
        times: (N,) from the first sample on, equal steps [s].
        joint_names: the joints, in the columns' order.
        positions: (N, nj) [rad, or m].
        wrenches: what each force sensor measured.
        velocities: (N, nj) [rad/s, m/s] as recorded, or None.
        torques: (N, nj) [Nm, N] as recorded, NaN for a joint without, or None.
        base: position [m] and quaternion (x, y, z, w) of the base (N, 7), as recorded, or None.
        base_frame: frame of the robot's model that `base` places; empty for the root link.
        start: what the first sample's clock read [s].
        findings: what is missing or wrong.
        notes: how it was read, a sentence each.
    """

    source: str
    times: Float[np.ndarray, " N"]
    joint_names: tuple[str, ...]
    positions: Float[np.ndarray, "N nj"]
    wrenches: tuple[WrenchSeries, ...]
    velocities: Float[np.ndarray, "N nj"] | None = None
    torques: Float[np.ndarray, "N nj"] | None = None
    base: Float[np.ndarray, "N 7"] | None = None
    base_frame: str = ""
    start: float = 0.0
    findings: tuple[Finding, ...] = field(default=())
    notes: tuple[str, ...] = field(default=())

    def __post_init__(self) -> None:
        """Own the arrays, and reject those that do not fit."""
        freeze(self, "times", "positions", "velocities", "torques", "base")
        for name in ("joint_names", "wrenches", "findings", "notes"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        N, nj = len(self.times), len(self.joint_names)
        shapes = [
            ("positions", self.positions, (N, nj)),
            ("velocities", self.velocities, (N, nj)),
            ("torques", self.torques, (N, nj)),
            ("base", self.base, (N, 7)),
            *((f"wrench {w.name!r}", w.values, (N, 6)) for w in self.wrenches),
        ]
        for what, array, shape in shapes:
            if array is not None and array.shape != shape:
                raise InvalidInputError(
                    f"the {what} of the log {self.source!r} have shape {array.shape}. Give "
                    f"{shape}: a row per time."
                )
        if N < 2:
            raise InvalidInputError(
                f"the log {self.source!r} has {N} row(s). A comparison takes two or more; check "
                "that the right clock is mapped."
            )

    def __repr__(self) -> str:
        """Source, length, joints and sensors."""
        sensors = ", ".join(w.name for w in self.wrenches) or "no force sensor"
        return (
            f"Log({self.source!r}: {self.times[-1]:.4g} s at {self.rate:.4g} Hz, "
            f"{len(self.joint_names)} joints, {sensors}; {len(self.findings)} finding(s))"
        )

    @property
    def step(self) -> float:
        """Time from row to row [s]."""
        return float((self.times[-1] - self.times[0]) / (len(self.times) - 1))

    @property
    def rate(self) -> float:
        """Rows a second [Hz]."""
        return 1.0 / self.step

    def wrench(self, name: str) -> WrenchSeries:
        """What a sensor measured, by the sensor's name or its contact's.

        Raises:
            UnknownNameError: there is no such sensor.
        """
        for found in self.wrenches:
            if name in (found.name, found.contact):
                return found
        raise UnknownNameError("sensor in the log", name, [w.name for w in self.wrenches])
