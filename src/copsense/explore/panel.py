"""Panel: the controls beside the picture, what they ask for, and the words and numbers shown."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from copsense.explore.assigning import Assigning
from copsense.explore.drawing import LABELS, OPACITY, Shown, criterion_colours
from copsense.explore.judging import Judging
from copsense.explore.margin_plot import MarginPlot
from copsense.explore.model import Model
from copsense.explore.movable import Coordinate
from copsense.explore.panel_html import (
    asked_html,
    copy_html,
    notes_html,
    status_html,
    table_html,
)
from copsense.explore.playback import run_seconds
from copsense.explore.pushing import Pushing
from copsense.explore.state import Setting, State
from copsense.explore.view import View
from copsense.posture_run import PostureRun

NEAREST, HELD = "nearest posture", "base held"
MESHES, STICKS, HIDDEN = "meshes", "stick figure", "hidden"
_KINDS = {"com": "Centre of mass", "trunk": "Trunk", "joint": "Joints", "foot": "Feet"}
_LEAST_SPAN = 0.1  # mm or deg, of a slider


class Panel:
    """The controls of an explorer.

    Attributes:
        touched: coordinates that are asked for, because their slider was moved.
    """

    touched: set[str]

    def __init__(
        self,
        server: Any,
        model: Model,
        state: State,
        *,
        meshes: bool,
        changed: Callable[[], object],
        actions: Mapping[str, Callable[[], object]],
        weighings: Mapping[str, Callable[[], object]],
        run: PostureRun | None = None,
    ) -> None:
        """Lay out the controls.

        Args:
            server: a viser server.
            model: what can be moved.
            state: what is asked for to begin with.
            meshes: whether there are any to show.
            changed: called when anything was changed.
            actions: label of a button -> what it does.
            weighings: the same of the buttons that look for the best weights.
            run: what is played instead of moving the robot.
        """
        self._gui, self._model, self._assigning = server.gui, model, Assigning(changed)
        self._given = state
        self._pinned: set[str] = set()
        self.touched = set(state.coordinates)
        gui = server.gui
        self._status = gui.add_html("")
        self._table = gui.add_html("")
        self._curve = MarginPlot(gui, run)
        self._copy = gui.add_html("")
        buttons = gui.add_button_group("", tuple(actions))
        buttons.on_click(lambda event: actions[event.target.value]())
        self._run = run
        self._playing(run)
        self._coordinates(state)
        self._judging = Judging(gui, model, state, self._assigning, weighings)
        self._pushing = Pushing(gui, model, state, self._assigning) if run is None else None
        self._showing(meshes)
        self._more = gui.add_html("")

    def _playing(self, run: PostureRun | None) -> None:
        if run is None:
            return
        gui = self._gui
        low, high = float(run.values.min()), float(run.values.max())
        with gui.add_folder("Playback"):
            self._time = gui.add_slider(
                f"{run.axis} [{run.unit}]" if run.unit else run.axis,
                min=low,
                max=max(high, low + 1e-6),
                step=max((high - low) / 1000.0, 1e-6),
                initial_value=float(run.values[0]),
            )
            self._time.on_update(self._assigning.changed)
            self._play = gui.add_checkbox("play", False)
            self._speed = gui.add_dropdown("speed", ("1", "0.5", "0.25", "0.1", "2"))

    @property
    def row(self) -> int:
        """The row of the run that is shown."""
        assert self._run is not None
        return int(np.argmin(np.abs(self._run.values - self._time.value)))

    def advance(self, seconds: float) -> bool:
        """Go on by so many seconds, round at the end; whether it is played at all."""
        run = self._run
        if run is None or not self._play.value:
            return False
        rate = (self._time.max - self._time.min) / max(run_seconds(run), 1e-3)
        value = self._time.value + seconds * rate * float(self._speed.value)
        with self._assigning.silently():
            self._time.value = value if value <= self._time.max else self._time.min
        return True

    def _coordinates(self, state: State) -> None:
        gui = self._gui
        moved = self._run is None
        self._sliders: dict[str, Any] = {}
        self._folders: dict[str, Any] = {}
        with gui.add_folder("Posture", visible=moved):
            self._mode = gui.add_dropdown(
                "what yields",
                (NEAREST, HELD),
                initial_value=HELD if state.held else NEAREST,
                hint="nearest posture: everything that is not asked for yields; base held: what "
                "is not asked for keeps the stance's value",
            )
            self._mode.on_update(self._mode_changed)
            self._asked = gui.add_html("")
        for kind, label in _KINDS.items():
            own = [c for c in self._model.coordinates.values() if c.kind == kind]
            if not own:
                continue
            self._folders[kind] = gui.add_folder(
                label, expand_by_default=kind == "com", visible=moved
            )
            with self._folders[kind]:
                for c in own:
                    self._sliders[c.name] = self._slider(c, state)
        self._show_kinds(state.held)

    def _slider(self, c: Coordinate, state: State) -> Any:
        setting = state.coordinates.get(c.name)
        low, high = sorted((_shown(c, c.low), _shown(c, c.high)))
        high = max(high, low + _LEAST_SPAN)
        unit = "mm" if c.unit == "m" else "deg"
        handle = self._gui.add_slider(
            f"{c.name} [{unit}]",
            min=round(low, 1),
            max=round(high, 1),
            step=0.1,
            initial_value=round(_shown(c, c.home if setting is None else setting.value), 1),
            hint="the joint's position" if c.kind == "joint" else "from where the stance has it",
        )
        handle.on_update(lambda event, name=c.name: self._moved(name))
        return handle

    def _showing(self, meshes: bool) -> None:
        gui = self._gui
        with gui.add_folder("Show", expand_by_default=False):
            looks = (MESHES, STICKS, HIDDEN) if meshes else (STICKS, HIDDEN)
            self._robot = gui.add_dropdown("robot", looks, initial_value=looks[0])
            self._opacity = gui.add_slider(
                "opacity", min=0.1, max=1.0, step=0.05, initial_value=OPACITY, visible=meshes
            )
            self._forces = gui.add_checkbox("forces", True)
            self._regions = gui.add_checkbox("regions of the CoM", False)
            self._curve_on = gui.add_checkbox("margins along y", True)
            self._axes = gui.add_checkbox("contact axes", False)
            self._torques = gui.add_checkbox("torque colours", True)
            self._labels = gui.add_dropdown(
                "labels",
                LABELS,
                hint="a click on a link of the robot shows or hides its joint's alone",
            )
            shown = (
                self._robot,
                self._opacity,
                self._forces,
                self._regions,
                self._curve_on,
                self._axes,
            )
            for handle in (*shown, self._torques, self._labels):
                handle.on_update(self._assigning.changed)

    def read(self) -> State:
        """The state that the controls ask for."""
        held = self._mode.value == HELD
        coordinates = {}
        for name in self._model.coordinates:
            c = self._model.coordinates[name]
            if name in self.touched and (held or c.kind in ("com", "joint")):
                coordinates[name] = self._read_coordinate(c)
        overlays = {"curve": self._curve_on.value, "regions": self._regions.value}
        return State(
            self._model.words,
            coordinates,
            held,
            self._judging.criteria(),
            self._judging.length(),
            self._judging.limits(),
            frozenset(name for name, on in overlays.items() if on),
            self._given.loads if self._pushing is None else self._pushing.loads(),
        )

    def _read_coordinate(self, c: Coordinate) -> Setting:
        given, at = self._given.coordinates.get(c.name), self._sliders[c.name].value
        if given is not None and at == round(_shown(c, given.value), 1):
            return given  # to the last digit, as it was asked for
        return Setting(_meant(c, at), c.unit)

    def shown(self, view: View) -> Shown:
        """What of a view is to be drawn."""
        names = [each.name for each in view.criteria]
        last = self._judging.last
        criterion = last if last in names else (names or [""])[-1]
        return Shown(
            robot=self._robot.value,
            forces=self._forces.value,
            torques=criterion if self._torques.value else "",
            criterion=criterion,
            labels=self._labels.value,
            pinned=frozenset(self._pinned),
            regions=self._regions.value,
            axes=self._axes.value,
            opacity=float(self._opacity.value),
        )

    def reset(self) -> None:
        """Ask for nothing: every control back to where it was at first."""
        with self._assigning.silently():
            self.touched.clear()
            self._mode.value = NEAREST
            self._show_kinds(False)
            for name, slider in self._sliders.items():
                slider.value = round(_shown(self._model.coordinates[name], self._home(name)), 1)
        self._judging.reset()
        if self._pushing is not None:
            self._pushing.reset()
        self._pinned.clear()
        self._assigning.changed()

    def hide_robot(self, hidden: bool) -> None:
        """Hide the robot, as for a view from above, or show it again."""
        looks = self._robot.options
        if hidden != (self._robot.value == HIDDEN):
            self._robot.value = HIDDEN if hidden else looks[0]

    def follow(self, values: Mapping[str, float]) -> None:
        """Have the sliders that ask for nothing show where the posture has them [m, rad]."""
        with self._assigning.silently():
            for name, value in values.items():
                slider = self._sliders[name]
                at = round(_shown(self._model.coordinates[name], value), 1)
                if name not in self.touched and abs(at - slider.value) > 0.05:
                    _widen(slider, at)
                    slider.value = at

    def set_ends(self, name: str, low: float, high: float) -> None:
        """Say from where to where a coordinate can go [m, rad]."""
        c, slider = self._model.coordinates[name], self._sliders[name]
        ends = sorted((_shown(c, low), _shown(c, high)))
        low, high = math.floor(ends[0] * 10) / 10, math.ceil(ends[1] * 10) / 10
        with self._assigning.silently():
            slider.min = min(low, slider.value)
            slider.max = max(high, slider.value, slider.min + _LEAST_SPAN)
            slider.disabled = high - low <= _LEAST_SPAN  # nothing to choose

    def write(self, view: View, status: str, save: str = "") -> None:
        """Show a view's words and numbers."""
        colours = criterion_colours([each.name for each in view.criteria])
        self._status.content = status_html(view, status)
        self._table.content = table_html(view, colours)
        self._asked.content = asked_html(view.state, self._model)
        self._copy.content = copy_html(self._model, view.state, save)
        self._more.content = notes_html(view)
        self._judging.write(view.state)
        self._curve.show(view, colours)

    def pin(self, joint: str) -> None:
        """Show the label of a joint, or hide it again."""
        self._pinned.symmetric_difference_update({joint})
        self._assigning.changed()

    @property
    def weight_keys(self) -> Mapping[str, tuple[str, ...]]:
        """Name of each weight slider -> the parts of joints' names that it weighs."""
        return self._judging.keys

    def set_weights(self, weights: Mapping[str, float]) -> None:
        """Move the sliders of the weights: group -> weight."""
        self._judging.set_weights(weights)

    def _home(self, name: str) -> float:
        return self._model.coordinates[name].home

    def _moved(self, name: str) -> None:
        if not self._assigning.active:
            self.touched.add(name)
            self._assigning.changed()

    def _mode_changed(self, event: object) -> None:
        if not self._assigning.active:
            self._show_kinds(self._mode.value == HELD)
            self._assigning.changed()

    def _show_kinds(self, held: bool) -> None:
        for kind in ("trunk", "foot"):
            if kind in self._folders and self._run is None:
                self._folders[kind].visible = held


def _shown(c: Coordinate, value: float) -> float:
    """A coordinate as its slider shows it [mm, deg]."""
    scale = 1e3 if c.unit == "m" else math.degrees(1.0)
    return scale * (value if c.kind == "joint" else c.sign * (value - c.home))


def _meant(c: Coordinate, shown: float) -> float:
    """What a slider's number means [m, rad]."""
    value = shown / 1e3 if c.unit == "m" else math.radians(shown)
    # To a nanometre: homes that miss zero by rounding would make commands long.
    return round(value if c.kind == "joint" else c.home + c.sign * value, 9)


def _widen(slider: Any, value: float) -> None:
    if value < slider.min:
        slider.min = value
    if value > slider.max:
        slider.max = value
