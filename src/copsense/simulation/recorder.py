"""Recorder: the rows of a rollout while it runs, laid out as a recording at its end."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pinocchio as pin

from copsense._version import __version__
from copsense.contact import COMPONENT_NAMES
from copsense.controllers.controller import Command
from copsense.controllers.target import Target
from copsense.cop import LEAST_LOAD, wrench_cops
from copsense.ground import CONVENTIONS, ground_variables
from copsense.simulation.events import Event
from copsense.simulation.recording import Recording
from copsense.simulation.simulator import Snapshot
from copsense.stance import Stance

_VARIABLES: dict[str, tuple[tuple[str, ...], str, str]] = {
    "com": (("com_axis",), "m", "centre of mass, world axes"),
    "com_target": (("com_axis",), "m", "centre of mass asked for, world axes"),
    "com_velocity": (("com_axis",), "m/s", "velocity of the centre of mass, world axes"),
    "wrench": (
        ("contact", "component"),
        "N, N m",
        "measured wrench of the environment on the robot about the contact frame's origin, contact "
        "axes",
    ),
    "wrench_command": (
        ("contact", "component"),
        "N, N m",
        "the wrench that the controller means to cause; NaN where it does not say",
    ),
    "torque": (("joint",), "N m", "joint torque applied (force for a prismatic joint)"),
    "torque_command": (("joint",), "N m", "joint torque commanded"),
    "configuration": (
        ("configuration_index",),
        "m, 1, rad",
        "base position, quaternion (x, y, z, w), joints",
    ),
    "joint_position": (("joint",), "rad, m", "joint position"),
    "joint_velocity": (("joint",), "rad/s, m/s", "joint velocity"),
    "tilt": (("contact",), "rad", "angle of the contact frame from its plane"),
}
# Of a robot on which not every joint has a motor of its own.
_OF_MOTORS: dict[str, tuple[tuple[str, ...], str, str]] = {
    "torque": (("motor",), "N m", "torque of each motor (force for a prismatic joint)"),
    "torque_command": (("motor",), "N m", "torque commanded of each motor"),
}


class Recorder:
    """Collects the rows of one rollout."""

    def __init__(self, stance: Stance) -> None:
        """Start an empty record."""
        self.stance = stance
        self._model = stance.robot.model
        self._data = self._model.createData()
        self._rows: dict[str, list[Any]] = {name: [] for name in ("time", *_VARIABLES)}

    def __len__(self) -> int:
        """Rows so far."""
        return len(self._rows["time"])

    def add(
        self,
        at: Snapshot,
        after: Snapshot,
        target: Target,
        command: Command,
        torques: np.ndarray,
        tilts: np.ndarray,
    ) -> None:
        """Add a row: the state at a time, and the wrenches during the step that followed it."""
        com = pin.centerOfMass(self._model, self._data, at.q, at.v)
        none = np.full(after.wrenches.shape, np.nan)
        row = {
            "time": at.time,
            "com": np.array(com),
            "com_target": target.com,
            "com_velocity": np.array(self._data.vcom[0]),
            "wrench": after.wrenches,
            "wrench_command": none if command.wrenches is None else command.wrenches,
            "torque": np.array(torques),
            "torque_command": command.torques,
            "configuration": at.q,
            "joint_position": self.stance.robot.joint_positions(at.q),
            "joint_velocity": at.v[6:],
            "tilt": tilts,
        }
        for name, value in row.items():
            self._rows[name].append(value)

    def recording(
        self,
        end: Event,
        tip: Event | None,
        tip_com: np.ndarray | None,
        attributes: Mapping[str, Any],
    ) -> Recording:
        """The recording.

        Args:
            end: why the run ended.
            tip: which contact first ceased to stand, if any.
            tip_com: where the centre of mass then was (3,), world axes [m].
            attributes: what else made the numbers.
        """
        import xarray as xr

        stance = self.stance
        motors = stance.robot.actuation
        variables = _VARIABLES if motors is None else _VARIABLES | _OF_MOTORS
        data: dict[str, Any] = {
            name: (("time", *dims), np.array(self._rows[name]), {"units": unit, "long_name": what})
            for name, (dims, unit, what) in variables.items()
        }
        cops, margins = _cops(stance, data["wrench"][1])
        data["cop"] = (
            ("time", "contact", "axis"),
            cops,
            {"units": "m", "long_name": "measured centre of pressure, contact axes"},
        )
        data["cop_command"] = (
            ("time", "contact", "axis"),
            _cops(stance, data["wrench_command"][1])[0],
            {"units": "m", "long_name": "commanded centre of pressure, contact axes"},
        )
        data["margin"] = (
            ("time", "contact"),
            margins,
            {"units": "m", "long_name": "distance of the CoP to the sole's nearest edge"},
        )
        data |= ground_variables(stance)
        nan = np.full(3, np.nan)
        data["tip_com"] = (
            "com_axis",
            nan if tip_com is None else tip_com,
            {"units": "m", "long_name": "centre of mass when a contact first ceased to stand"},
        )
        coordinates = {
            "time": ("time", np.array(self._rows["time"]), {"units": "s", "long_name": "time"}),
            "contact": list(stance.contact_names),
            "axis": ["x", "y"],
            "com_axis": ["x", "y", "z"],
            "contact_axis": ["x", "y", "z"],
            "component": list(COMPONENT_NAMES),
            "joint": list(stance.robot.dof_names),
        }
        if motors is not None:
            coordinates["motor"] = list(motors.motors)
        words = {
            "title": f"Balancing of {stance.robot.name}",
            "source": f"copsense {__version__}",
            "robot": stance.robot.name,
            "mass": stance.robot.mass,
            "weight": stance.robot.weight,
            "end_kind": end.kind,
            "end_reason": end.message,
            "end_time": end.time,
            "tip_kind": tip.kind if tip else "",
            "tip_contact": tip.contact if tip else "",
            "tip_reason": tip.message if tip else "",
            "tip_time": tip.time if tip else np.nan,
            **attributes,
            "conventions": CONVENTIONS,
        }
        return Recording(xr.Dataset(data, coordinates, words))


def _cops(stance: Stance, wrenches: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Centres of pressure (N, nc, 2), NaN where unloaded, and their margins (N, nc)."""
    wrenches = wrenches.reshape(-1, len(stance.contacts), 6)
    loaded = wrenches[:, :, 2] > LEAST_LOAD * stance.robot.weight
    cops = wrench_cops(wrenches, loaded)
    margins = np.full(cops.shape[:2], np.nan)
    for k, contact in enumerate(stance.contacts):
        if contact.sole:
            margins[:, k] = contact.sole.margins(cops[:, k])
    return cops, margins
