"""Panel: the controls beside the picture, what they ask for, and the words and numbers shown."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from copsense.criterion import CRITERIA
from copsense.explore.drawing import OPACITY, Colour, Shown, criterion_colours
from copsense.explore.model import Coordinate, Model
from copsense.explore.panel_html import (
    asked_html,
    copy_html,
    css,
    notes_html,
    status_html,
    table_html,
)
from copsense.explore.playback import run_seconds
from copsense.explore.state import Setting, State, weights_text
from copsense.explore.view import View
from copsense.limits import Limits
from copsense.posture_run import PostureRun

NEAREST, HELD = "nearest posture", "base held"
MESHES, STICKS, HIDDEN = "meshes", "stick figure", "hidden"
NONE, FILE = "none", "the stance file's"
_WEIGHT_DECADES = 1.5
_FRICTION = 0.5
_KINDS = {"com": "Centre of mass", "trunk": "Trunk", "joint": "Joints", "foot": "Feet"}
_CURVE_HEIGHT = 150  # pixels
_DEEPEST = 40.0  # mm outside the soles that the curve shows
_ORDINALS = {1: "first", 2: "second", 3: "third"}
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
            run: what is played instead of moving the robot.
        """
        self._gui, self._model, self._changed = server.gui, model, changed
        self._assigning = False
        self._given = state
        self.touched = set(state.coordinates)
        gui = server.gui
        self._status = gui.add_html("")
        self._table = gui.add_html("")
        self._curve: Any = None
        self._curve_place = gui.add_folder(None)
        self._copy = gui.add_html("")
        buttons = gui.add_button_group("", tuple(actions))
        buttons.on_click(lambda event: actions[event.target.value]())
        self._run = run
        self._playing(run)
        self._coordinates(state)
        self._judging(state)
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
            self._time.on_update(self._any)
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
        with self._silently():
            self._time.value = value if value <= self._time.max else self._time.min
        return True

    def _coordinates(self, state: State) -> None:
        gui = self._gui
        moved = self._run is None
        self._sliders: dict[str, Any] = {}
        self._folders: dict[str, Any] = {}
        with gui.add_folder("Posture", visible=moved):
            self._mode = gui.add_dropdown(
                "what gives way",
                (NEAREST, HELD),
                initial_value=HELD if state.held else NEAREST,
                hint="nearest posture: everything that is not asked for gives way; base held: what "
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

    def _judging(self, state: State) -> None:
        gui, model = self._gui, self._model
        names = [*CRITERIA]
        if state.criteria == () and [c.name for c in model.criteria] != names[:2]:
            names.insert(0, FILE)
        first = FILE if FILE in names else "minimum-wrench"
        second = NONE if FILE in names else "minimum-torque"
        asked = [*state.criteria] or [first, second]
        asked += [NONE] * (2 - len(asked))
        with gui.add_folder("Criteria"):
            self._criteria = []
            for number, name in enumerate(asked, start=1):
                label = _ORDINALS.get(number, f"number {number}")
                options = [*dict.fromkeys([*names, name, NONE])]
                handle = gui.add_dropdown(label, tuple(options), initial_value=name)
                handle.on_update(self._any)
                self._criteria.append(handle)
            self._length = gui.add_slider(
                "log10 of L [m]",
                min=-2.0,
                max=1.0,
                step=0.01,
                initial_value=_logarithm(state.length),
                hint="length that makes moments comparable with forces in minimum-wrench",
            )
            self._length.on_update(self._any)
            self._weights: dict[str, Any] = {}
            for group in weight_groups(model):
                slider = gui.add_slider(
                    f"log10 of {group} weight",
                    min=-_WEIGHT_DECADES,
                    max=_WEIGHT_DECADES,
                    step=0.01,
                    initial_value=0.0,
                    hint="of the squared torques in minimum-torque; 0 for the weight 1",
                )
                slider.on_update(self._any)
                self._weights[group] = slider
        with gui.add_folder("Limits", expand_by_default=False):
            limits = model.limits_of(state)
            self._limited = gui.add_checkbox(
                "wrenches within limits",
                limits is not None,
                disabled=model.limits is not None,
                hint="unilateral forces, friction and the soles' edges, as a QP",
            )
            given = limits.friction if limits is not None else _FRICTION
            friction = given if isinstance(given, float) else _FRICTION
            self._friction = gui.add_slider(
                "friction", min=0.05, max=1.5, step=0.01, initial_value=friction
            )
            self._torque = gui.add_checkbox(
                "torque limits", limits is not None and limits.torque is not None
            )
            for handle in (self._limited, self._friction, self._torque):
                handle.on_update(self._limits_changed)
        self._limits_given, self._friction_given = state.limits, friction
        self._limits_touched = False
        self._judged_given = self._judged

    @property
    def _judged(self) -> list[object]:
        """What the controls of the criteria show."""
        return [each.value for each in (*self._criteria, *self._weights.values())]

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
            shown = (
                self._robot,
                self._opacity,
                self._forces,
                self._regions,
                self._curve_on,
                self._axes,
            )
            for handle in (*shown, self._torques):
                handle.on_update(self._any)

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
            self._read_criteria(),
            self._read_length(),
            self._read_limits(),
            frozenset(name for name, on in overlays.items() if on),
        )

    def _read_coordinate(self, c: Coordinate) -> Setting:
        given, at = self._given.coordinates.get(c.name), self._sliders[c.name].value
        if given is not None and at == round(_shown(c, given.value), 1):
            return given  # to the last digit, as it was asked for
        return Setting(_meant(c, at), c.unit)

    def _read_length(self) -> float:
        given = self._given.length
        return given if self._length.value == _logarithm(given) else _power(self._length.value)

    def _read_criteria(self) -> tuple[str, ...]:
        if self._judged == self._judged_given:
            return self._given.criteria
        weights = {group: _power(slider.value) for group, slider in self._weights.items()}
        named = [handle.value for handle in self._criteria]
        if FILE in named:  # those alone: not each of them has a name
            return ()
        found = [
            weights_text(weights) if name == "minimum-torque" else name
            for name in named
            if name != NONE
        ]
        return tuple(dict.fromkeys(found)) or ("minimum-torque",)

    def _read_limits(self) -> Limits | Literal["own"] | None:
        if not self._limits_touched:
            return self._limits_given
        if not self._limited.value:
            return None
        base = self._limits_given if isinstance(self._limits_given, Limits) else self._model.limits
        friction: Any = round(self._friction.value, 2)
        torque: Any = "model" if self._torque.value else None
        if base is None:
            return Limits(friction=friction, torque=torque)
        # What has no control here stays as it was given.
        if self._friction.value == self._friction_given:
            friction = base.friction
        if self._torque.value and base.torque is not None:
            torque = base.torque
        return replace(base, friction=friction, torque=torque)

    def shown(self) -> Shown:
        """What is to be drawn."""
        chosen = [h.value for h in self._criteria if h.value != NONE]
        return Shown(
            robot=self._robot.value,
            forces=self._forces.value,
            torques=chosen[-1] if chosen and self._torques.value else "",
            regions=self._regions.value,
            axes=self._axes.value,
            opacity=float(self._opacity.value),
        )

    def reset(self) -> None:
        """Ask for nothing: every control back to where it was at first."""
        with self._silently():
            self.touched.clear()
            self._mode.value = NEAREST
            self._show_kinds(False)
            for name, slider in self._sliders.items():
                slider.value = round(_shown(self._model.coordinates[name], self._home(name)), 1)
            self._length.value = 0.0
            for slider in self._weights.values():
                slider.value = 0.0
        self._changed()

    def hide_robot(self, hidden: bool) -> None:
        """Hide the robot, as for a view from above, or show it again."""
        looks = self._robot.options
        if hidden != (self._robot.value == HIDDEN):
            self._robot.value = HIDDEN if hidden else looks[0]

    def follow(self, values: Mapping[str, float]) -> None:
        """Have the sliders that ask for nothing show where the posture has them [m, rad]."""
        with self._silently():
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
        with self._silently():
            slider.min = min(low, slider.value)
            slider.max = max(high, slider.value, slider.min + _LEAST_SPAN)

    def write(self, view: View, status: str, save: str = "") -> None:
        """Show a view's words and numbers."""
        colours = criterion_colours([each.name for each in view.criteria])
        self._status.content = status_html(view, status)
        self._table.content = table_html(view, colours)
        self._asked.content = asked_html(view.state, self._model)
        self._copy.content = copy_html(self._model, view.state, save)
        self._more.content = notes_html(view)
        self._plot(view, colours)

    def _plot(self, view: View, colours: Mapping[str, Colour]) -> None:
        if not np.isfinite(view.curve_margin).any():  # none yet, or feet without soles
            if self._curve is not None:
                self._curve.visible = False
            return
        played, name, unit = self._run, "CoM y", "m"
        now = float(view.com[1])
        if played is not None:
            name, unit = played.axis, played.unit
            now = float(played.values[view.row or 0])
        scale, shown = (1e3, "mm") if unit == "m" else (1.0, unit)
        y, now = view.curve_y * scale, now * scale
        rows = [row * 1e3 for row in view.curve_margin]
        low, high = _span(rows)
        low = max(low, -_DEEPEST)  # far outside nobody compares
        room = 0.05 * (high - low) + 1.0
        scales = {
            # Said outright: left to the browser, it now and then stays at 0 to 1.
            "x": {"time": False, "auto": False, "range": (float(y.min()), float(y.max()) + 1e-9)},
            "y": {"auto": False, "range": (low - room, high + room)},
        }
        # The cursor: an upright line at the CoM's y, two points of a series of its own.
        near = 1e-6 * max(float(np.ptp(y)), 1e-9)
        at = np.sort(np.append(y, [now - near, now + near]))
        margins = [np.interp(at, y, row, left=np.nan, right=np.nan) for row in rows]
        cursor = np.full(len(at), np.nan)
        first = int(np.searchsorted(at, now - 1.5 * near))
        cursor[first : first + 2] = low - room, high + room
        data = (at, *margins, cursor)
        if self._curve is not None and len(self._curve.data) == len(data):
            if self._curve.scales != scales:
                self._curve.scales = scales
            self._curve.data = data
            self._curve.visible = True
            return
        if self._curve is not None:
            self._curve.remove()
        series: tuple[Any, ...] = (
            {"label": f"{name} [{shown}]"},
            *(
                {"label": each, "stroke": css(colour), "width": 2}
                for each, colour in list(colours.items())[: len(rows)]
            ),
            {"label": "now", "stroke": "#555", "width": 1.5},
        )
        with self._curve_place:
            self._curve = self._gui.add_uplot(
                data,
                series,
                title=f"least margin [mm] over {name} [{shown}]",
                scales=scales,
                height=_CURVE_HEIGHT,
                legend={"show": False},
            )

    def _home(self, name: str) -> float:
        return self._model.coordinates[name].home

    def _moved(self, name: str) -> None:
        if not self._assigning:
            self.touched.add(name)
            self._changed()

    def _any(self, event: object) -> None:
        if not self._assigning:
            self._changed()

    def _limits_changed(self, event: object) -> None:
        if not self._assigning:
            self._limits_touched = True
            self._changed()

    def _mode_changed(self, event: object) -> None:
        if not self._assigning:
            self._show_kinds(self._mode.value == HELD)
            self._changed()

    def _show_kinds(self, held: bool) -> None:
        for kind in ("trunk", "foot"):
            if kind in self._folders and self._run is None:
                self._folders[kind].visible = held

    @contextmanager
    def _silently(self) -> Iterator[None]:
        """Assign without asking for a new state: assigning calls what updates call."""
        before, self._assigning = self._assigning, True
        try:
            yield
        finally:
            self._assigning = before


def weight_groups(model: Model) -> list[str]:
    """Parts of the joints' names that have a weight of their own, where ``--criterion`` can say it.

    A group is named by a part that every joint of it has in its name, and no other.
    """
    names = model.stance.robot.torque_names
    return [
        group
        for group, joints in model.groups.items()
        if {n for n in names if group in n} == set(joints)
    ]


def _shown(c: Coordinate, value: float) -> float:
    """A coordinate as its slider shows it [mm, deg]."""
    scale = 1e3 if c.unit == "m" else math.degrees(1.0)
    return scale * (value if c.kind == "joint" else c.sign * (value - c.home))


def _meant(c: Coordinate, shown: float) -> float:
    """What a slider's number means [m, rad]."""
    value = shown / 1e3 if c.unit == "m" else math.radians(shown)
    # To a nanometre: homes that miss zero by rounding would make commands long.
    return round(value if c.kind == "joint" else c.home + c.sign * value, 9)


def _logarithm(length: float) -> float:
    """What the slider of L shows of a length."""
    return min(max(round(math.log10(length), 2), -2.0), 1.0)


def _power(logarithm: float) -> float:
    """Ten to a slider's value, in four digits, so that commands stay short."""
    return float(f"{10.0**logarithm:.4g}")


def _widen(slider: Any, value: float) -> None:
    if value < slider.min:
        slider.min = value
    if value > slider.max:
        slider.max = value


def _span(rows: Sequence[np.ndarray]) -> tuple[float, float]:
    found = np.concatenate([row[np.isfinite(row)] for row in rows] or [np.zeros(1)])
    return (float(found.min()), float(found.max())) if len(found) else (0.0, 1.0)
