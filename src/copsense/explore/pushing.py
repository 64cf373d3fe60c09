"""Pushing: the controls of a known force on the robot."""

from __future__ import annotations

from typing import Any

import numpy as np

from copsense.explore.assigning import Assigning
from copsense.explore.model import Model
from copsense.explore.state import State
from copsense.loads import Load

NOWHERE = "none"


class Pushing:
    """One force of a panel, at a point of a link; what else a state is loaded with stays."""

    def __init__(self, gui: Any, model: Model, state: State, assigning: Assigning) -> None:
        """Lay out the controls.

        Args:
            gui: of a viser server.
            model: whose frames can be pushed.
            state: what is asked for to begin with.
            assigning: says what was changed.
        """
        self._rest = state.loads[1:]
        self._given = state.loads[0] if state.loads else None
        given = self._given or Load(model.stance.robot.base_frame)
        frames = tuple(dict.fromkeys(name for name in model.stance.robot.frame_names if name))
        where = NOWHERE if self._given is None else given.frame
        with gui.add_folder("Load", expand_by_default=self._given is not None):
            self._frame = gui.add_dropdown("on", (NOWHERE, *frames), initial_value=where)
            self._force = gui.add_vector3(
                "force [N]", given.force, step=1.0, hint="x, y, z in world axes"
            )
            self._point = gui.add_vector3(
                "at [mm]", tuple(1e3 * np.array(given.point)), step=1.0, hint="x, y, z in the frame"
            )
        for handle in self._handles:
            handle.on_update(assigning.changed)
        self._assigning, self._first = assigning, self._values

    @property
    def _handles(self) -> tuple[Any, Any, Any]:
        return self._frame, self._force, self._point

    @property
    def _values(self) -> list[object]:
        return [handle.value for handle in self._handles]

    def loads(self) -> tuple[Load, ...]:
        """The loads asked for."""
        if self._values == self._first:
            return self._rest if self._given is None else (self._given, *self._rest)
        force = tuple(round(float(v), 6) for v in self._force.value)
        if self._frame.value == NOWHERE or not any(force):
            return self._rest
        point = tuple(round(float(v) / 1e3, 9) for v in self._point.value)
        (fx, fy, fz), (x, y, z) = force, point
        return (Load(self._frame.value, (fx, fy, fz), point=(x, y, z)), *self._rest)

    def reset(self) -> None:
        """Every control back to where it was at first."""
        with self._assigning.silently():
            for handle, value in zip(self._handles, self._first, strict=True):
                handle.value = value
