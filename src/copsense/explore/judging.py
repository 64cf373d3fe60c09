"""Judging: the controls that say how the load is shared, and within which limits."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, Literal

from copsense.criterion import CRITERIA
from copsense.criterion_text import WEIGHTED
from copsense.errors import InvalidInputError
from copsense.explore.assigning import Assigning
from copsense.explore.best_weights import WEIGHT_DECADES
from copsense.explore.model import Model
from copsense.explore.panel_html import small_html
from copsense.explore.state import State, limits_text, weights_text
from copsense.limits import Limits

NONE, FILE = "none", "the stance file's"
_FRICTION = 0.5
_OFF, _OWN, _AS_GIVEN = "off", "contacts' own", "as given"
_ORDINALS = {1: "first", 2: "second", 3: "third"}
_SHOWN = 3  # criteria side by side, unless more are asked for
_LEAST_LENGTH, _MOST_LENGTH = -2.0, 1.0  # decimal logarithms of metres


class Judging:
    """Criteria, weights and limits of a panel.

    Attributes:
        keys: name of each weight slider -> the parts of joints' names that it weighs.
    """

    keys: Mapping[str, tuple[str, ...]]

    def __init__(
        self,
        gui: Any,
        model: Model,
        state: State,
        assigning: Assigning,
        actions: Mapping[str, Callable[[], object]],
    ) -> None:
        """Lay out the controls.

        Args:
            gui: of a viser server.
            model: what is judged.
            state: what is asked for to begin with.
            assigning: says what was changed.
            actions: label of a button of the weights -> what it does.
        """
        self._gui, self._model, self._given, self._assigning = gui, model, state, assigning
        self.keys = weight_keys(model)
        with gui.add_folder("Criteria"):
            self._add_criteria()
            self._add_weights(actions)
        with gui.add_folder("Limits", expand_by_default=False):
            self._add_limits()
        self._limits_touched = False
        self._first = self._judged

    def _add_criteria(self) -> None:
        gui, state = self._gui, self._given
        names = [*CRITERIA, *[WEIGHTED] * bool(self.keys)]
        if state.criteria == () and [c.name for c in self._model.criteria] != names[:2]:
            names.insert(0, FILE)
        asked = [*state.criteria] or ([FILE] if FILE in names else [*CRITERIA][:2])
        asked += [NONE] * (_SHOWN - len(asked))
        self._criteria = []
        for number, name in enumerate(asked, start=1):
            options = [*dict.fromkeys([*names, name, NONE])]
            label = _ORDINALS.get(number, f"number {number}")
            handle = gui.add_dropdown(label, tuple(options), initial_value=name)
            handle.on_update(self._assigning.changed)
            self._criteria.append(handle)
        self._other = gui.add_text(
            "other",
            "",
            hint="one more, as --criterion has it: stiffness:2000, weighted-torque:knee=3",
        )
        self._other.on_update(self._assigning.changed)
        self._length = gui.add_slider(
            "log10 of L [m]",
            min=_LEAST_LENGTH,
            max=_MOST_LENGTH,
            step=0.01,
            initial_value=_logarithm(state.length),
            hint="length that makes moments comparable with forces in minimum-wrench",
        )
        self._length.on_update(self._assigning.changed)

    def _add_weights(self, actions: Mapping[str, Callable[[], object]]) -> None:
        self._weights: dict[str, Any] = {}
        for group in self.keys:
            slider = self._gui.add_slider(
                f"log10 of {group} weight",
                min=-WEIGHT_DECADES,
                max=WEIGHT_DECADES,
                step=0.01,
                initial_value=0.0,
                hint=f"of the squared torques in {WEIGHTED}; 0 for the weight 1: "
                f"{', '.join(self._model.groups[group])}",
            )
            slider.on_update(self._weighed)
            self._weights[group] = slider
        if len(self._weights) > 1:
            buttons = self._gui.add_button_group(
                "best weights", tuple(actions), hint="searched for along y, within the limits"
            )
            buttons.on_click(lambda event: actions[event.target.value]())

    def _add_limits(self) -> None:
        gui, limits = self._gui, self._model.limits_of(self._given)
        self._limited = gui.add_checkbox(
            "wrenches within limits",
            limits is not None,
            disabled=self._model.limits is not None,
            hint="unilateral forces, friction and the soles' edges, as a QP",
        )
        self._limited.on_update(self._limits_changed)
        self._base = limits or Limits(friction=_FRICTION)
        base = self._base
        numbers = (
            ("friction", "friction", 1.0, _FRICTION, 0.01),
            ("normal_force", "least normal force [N]", 1.0, 0.0, 1.0),
            ("cop_margin", "inside the edges by [mm]", 1e3, 0.0, 0.5),
        )
        self._numbers: dict[str, tuple[Any, float, float]] = {}
        for name, label, scale, usual, step in numbers:
            value = getattr(base, name)
            shown = scale * value if isinstance(value, float) else usual
            handle = gui.add_number(label, max(round(shown, 6), 0.0), min=0.0, step=step)
            handle.on_update(self._limits_changed)
            self._numbers[name] = handle, float(handle.value), scale
        torsions = {"contact": _OWN, "cone": "wrench cone", None: _OFF}
        torques = {"model": "the model's", None: _OFF}
        self._choices: dict[str, tuple[Any, str, dict[str, Any]]] = {}
        for name, label, known in (
            ("torsion", "torsion", torsions),
            ("torque", "torques", torques),
        ):
            value = getattr(base, name)
            plain = value is None or isinstance(value, str)
            now = known[value] if plain else _AS_GIVEN
            options = [*known.values(), *[_AS_GIVEN] * (not plain)]
            choice = gui.add_dropdown(label, tuple(options), initial_value=now)
            choice.on_update(self._limits_changed)
            meant = {shown: value for value, shown in known.items()}
            self._choices[name] = choice, now, meant
        self._said = gui.add_html("")

    @property
    def _judged(self) -> list[object]:
        """What the controls of the criteria show."""
        handles = (*self._criteria, self._other, *self._weights.values())
        return [handle.value for handle in handles]

    @property
    def last(self) -> str:
        """The last criterion that is chosen, whose torques are shown; empty for the last of all."""
        named = [handle.value for handle in self._criteria if handle.value != NONE]
        return "" if self._other.value.strip() or not named else self._text_of(named[-1])

    def criteria(self) -> tuple[str, ...]:
        """The criteria asked for, as ``--criterion`` has them."""
        if self._judged == self._first:
            return self._given.criteria
        named = [handle.value for handle in self._criteria]
        if FILE in named:  # those alone: not each of them has a name
            return ()
        found = [self._text_of(name) for name in named if name != NONE]
        found += [self._other.value.strip()] * bool(self._other.value.strip())
        return tuple(dict.fromkeys(found)) or ("minimum-torque",)

    def _text_of(self, name: str) -> str:
        if name != WEIGHTED:
            return name
        return weights_text(
            {
                key: _power(slider.value)
                for group, slider in self._weights.items()
                for key in self.keys[group]
            }
        )

    def length(self) -> float:
        """The characteristic length [m]."""
        given = self._given.length
        return given if self._length.value == _logarithm(given) else _power(self._length.value)

    def limits(self) -> Limits | Literal["own"] | None:
        """The limits asked for. What has no control, or was not changed, stays as it was given."""
        if not self._limits_touched:
            return self._given.limits
        if not self._limited.value:
            return None
        changed: dict[str, Any] = {}
        for name, (handle, first, scale) in self._numbers.items():
            if handle.value != first:
                changed[name] = round(float(handle.value) / scale, 9)
        for name, (choice, now, meant) in self._choices.items():
            if choice.value != now:
                changed[name] = meant[choice.value]
        return replace(self._base, **changed)

    def set_weights(self, weights: Mapping[str, float]) -> None:
        """Move the sliders of the weights: group -> weight."""
        with self._assigning.silently():
            for group, weight in weights.items():
                self._weights[group].value = round(math.log10(weight), 2)
        self._weighed()

    def reset(self) -> None:
        """Every control back to where it was at first."""
        handles = (*self._criteria, self._other, *self._weights.values())
        with self._assigning.silently():
            for handle, value in zip(handles, self._first, strict=True):
                handle.value = value
            self._length.value = _logarithm(self._given.length)
            self._limited.value = self._model.limits_of(self._given) is not None
            for handle, number, _ in self._numbers.values():
                handle.value = number
            for choice, now, _ in self._choices.values():
                choice.value = now
        self._limits_touched = False

    def write(self, state: State) -> None:
        """Say the limits of a state."""
        limits = self._model.limits_of(state)
        try:
            said = "none" if limits is None else limits_text(limits)
        except InvalidInputError:
            said = "they differ by contact or joint, as the stance file has them"
        self._said.content = small_html(f"in force: {said}")

    def _weighed(self, event: object = None) -> None:
        """A weight was moved: a criterion that has it must be among those that are shown."""
        if self._assigning.active:
            return
        if all(handle.value != WEIGHTED for handle in self._criteria):
            free = [h for h in self._criteria if h.value == NONE] or self._criteria[-1:]
            with self._assigning.silently():
                free[0].value = WEIGHTED
        self._assigning.changed()

    def _limits_changed(self, event: object) -> None:
        if not self._assigning.active:
            self._limits_touched = True
        self._assigning.changed()


def weight_keys(model: Model) -> dict[str, tuple[str, ...]]:
    """Groups with a weight of their own, where ``--criterion`` can say it -> how it names them.

    By a part that every joint of the group has in its name and no other, or by the joints' names.
    """
    names = model.stance.robot.torque_names
    found: dict[str, tuple[str, ...]] = {}
    for group, joints in model.groups.items():
        if {n for n in names if group in n} == set(joints):
            found[group] = (group,)
        elif all(
            re.fullmatch(r"[\w.-]+", joint) and [n for n in names if joint in n] == [joint]
            for joint in joints
        ):
            found[group] = tuple(joints)
    return found


def _logarithm(length: float) -> float:
    """What the slider of L shows of a length."""
    return min(max(round(math.log10(length), 2), _LEAST_LENGTH), _MOST_LENGTH)


def _power(logarithm: float) -> float:
    """Ten to a slider's value, in four digits, so that commands stay short."""
    return float(f"{10.0**logarithm:.4g}")
