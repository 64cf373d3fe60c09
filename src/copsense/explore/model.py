"""Model: a stance that answers states with views, the quick part first and the rest in stages."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from copsense.analysis.asked import asked_posture, determined_criteria, placed_stance
from copsense.analysis.limit_analysis import SIDES, analyse_limits
from copsense.arrays import check_type
from copsense.batch import PostureChart
from copsense.batch.postures.chart_posture import unreachable
from copsense.content import FrozenMapping
from copsense.cop import contact_cops
from copsense.criterion import Criterion, minimum_torque, minimum_wrench
from copsense.criterion_text import criterion_from_text
from copsense.design import joint_groups
from copsense.errors import CopsenseError
from copsense.explore.movable import Coordinate, movable_coordinates
from copsense.explore.state import State
from copsense.explore.view import (
    RegionView,
    View,
    criterion_view,
    posture_parts,
)
from copsense.joint_notes import joint_limit_notes
from copsense.limits import Limits
from copsense.loads import Load
from copsense.path import COM_COORDINATES, LateralPath
from copsense.posture import solve_posture
from copsense.regions import com_regions
from copsense.sensitivity import cop_sensitivity
from copsense.stance import AT_LIMIT, Stance, check_at_rest, check_stance
from copsense.statics import named_criteria, solve_equilibrium

_CURVE_STEP, _CURVE_REACH = 0.005, 0.12  # m, between the postures of the curve and to either side
_REGION_TOLERANCE = 1e-3  # m
_KEPT = 64  # charts

Stale = Callable[[], bool]
Stage = Callable[[View, Stale], View]


class Model:
    """A stance to explore: `view` answers a state at once, the `stages` add what takes longer.

    It holds no window and starts no thread; numbers are those of `copsense.analyse`, by the same
    functions.

    Attributes:
        stance: where every state starts from.
        words: the words of the command line that say it; see `State`.
        criteria: what shares the load where a state names none.
        limits: the limits of the stance file, or None.
        coordinates: what can be moved, by name.
        groups: name of each group of joints with a weight of its own -> the joints.
        compiled: whether charts are served by the compiled kernel; see `use_compiled`.
    """

    stance: Stance
    words: tuple[str, ...]
    criteria: tuple[Criterion, ...]
    limits: Limits | None
    coordinates: Mapping[str, Coordinate]
    groups: Mapping[str, tuple[str, ...]]
    compiled: bool

    def __init__(
        self,
        stance: Stance,
        words: Sequence[str] = (),
        *,
        criteria: Sequence[Criterion] | None = None,
        limits: Limits | None = None,
    ) -> None:
        """Lay out what can be moved.

        Args:
            stance: the robot on its contacts, at rest.
            words: the words that say so on the command line; the robot's name where none are given.
            criteria: what shares the load where a state names none; default the paper's two.
            limits: what ``"own"`` means in a state.

        Raises:
            InvalidInputError: not a stance at rest, or criteria of one name.
        """
        check_stance(stance)
        check_at_rest(stance, "an explorer")
        self.stance = stance
        self.words = tuple(words) or (stance.robot.name,)
        usual = (minimum_wrench(1.0), minimum_torque())
        given = usual if criteria is None else criteria
        self.criteria = tuple(named_criteria(given, "an explorer", policies=False).values())
        if limits is not None:
            check_type(limits, Limits, "limits", "Give copsense.Limits(...).")
        self.limits = limits
        self.coordinates = FrozenMapping({c.name: c for c in movable_coordinates(stance)})
        self.groups = FrozenMapping(joint_groups(stance))
        self.compiled = PostureChart(stance, ("com_y",)).compiled
        self._charts: dict[tuple[tuple[str, ...], tuple[Load, ...], bool], PostureChart] = {}
        self._under = lru_cache(maxsize=4)(self._put_under)
        self._criteria = lru_cache(maxsize=32)(self._read_criteria)
        self._curves: dict[State, tuple[np.ndarray, np.ndarray, np.ndarray]] = {}

    def __repr__(self) -> str:
        """The robot."""
        return f"Model({self.stance.robot.name!r}, {len(self.coordinates)} coordinates)"

    @property
    def start(self) -> State:
        """The state of the stance itself, with what is asked for by default."""
        return State(self.words)

    def use_compiled(self) -> None:
        """Compile what charts need, seconds once on a machine, and use it from then on."""
        PostureChart(self.stance, ("com_y",)).compile()
        self.compiled = True

    def criteria_of(self, state: State) -> dict[str, Criterion]:
        """The criteria of a state, by name.

        Raises:
            CopsenseError: one that is not understood or does not fit.
        """
        return self._criteria(state.criteria, state.length)

    def limits_of(self, state: State) -> Limits | None:
        """The limits of a state."""
        return self.limits if isinstance(state.limits, str) else state.limits

    def posture(self, state: State) -> Stance:
        """The posture of a state: that of ``copsense.analyse`` for its command.

        Raises:
            CopsenseError: there is none; the message says why.
        """
        stance = self.loaded(state)
        if state.at and self.compiled:
            chart = self._chart(tuple(state.at), state.loads)
            found = chart.solve([list(state.at.values())])
            if not found.converged[0]:
                raise unreachable(stance, state.at, str(found.reasons[0]))
            return stance.at(found.configurations[0])
        joints = {} if state.at else state.joints
        com = (None, None, None) if state.at else state.com
        return placed_stance(stance, com, joints, state.at)

    def loaded(self, state: State) -> Stance:
        """The stance under a state's loads.

        Raises:
            CopsenseError: a load on what is not there.
        """
        return self._under(state.loads)

    def _put_under(self, loads: tuple[Load, ...]) -> Stance:
        return self.stance.with_loads([*self.stance.loads, *loads]) if loads else self.stance

    def view(self, state: State, revision: int = 0, last: View | None = None) -> View:
        """What a state looks like, all but what the `stages` add.

        Args:
            state: what is asked for.
            revision: number of the request.
            last: what is shown where the state has no posture; default the stance itself.
        """
        try:
            here = self.posture(state)
            return self._view(here, state, revision)
        except CopsenseError as error:
            if last is None:
                if not state.coordinates:
                    # Nothing but the criteria can have failed: show the robot without them.
                    parts = posture_parts(self.stance)
                    return View(state, revision, criteria=(), reason=str(error), **parts)
                last = self.view(replace(state, coordinates={}), revision)
            return replace(last, state=state, revision=revision, reason=str(error))

    def _view(self, here: Stance, state: State, revision: int) -> View:
        limits = self.limits_of(state)
        chosen, notes = determined_criteria(here, self.criteria_of(state), limits)
        said = tuple(
            criterion_view(name, cop_sensitivity(here, criterion, limits), limits)
            for name, criterion in chosen.items()
        )
        notes = [*notes, *joint_limit_notes(here)]
        return View(state, revision, criteria=said, notes=tuple(notes), **posture_parts(here))

    @property
    def stages(self) -> tuple[tuple[float, Stage], ...]:
        """Seconds of rest after which each is worth its time, and what adds it to a view."""
        return (0.0, self.add_curve), (0.12, self.add_regions), (0.5, self.add_binding)

    def add_curve(self, view: View, stale: Stale = lambda: False) -> View:
        """The view with margins and load shares along the lateral path through it.

        The path holds what the state holds, but the CoM's y.
        """
        if view.reason or "curve" not in view.state.overlays:
            return view
        asked = {n: s for n, s in view.state.coordinates.items() if n != "com_y"}
        key = replace(view.state, coordinates=asked, overlays=frozenset())
        if key not in self._curves:
            found: dict[float, list[tuple[float, float]]] = {}
            names, limits = self.criteria_of(view.state), self.limits_of(view.state)
            for y, here in self._lateral(key):
                if stale():
                    return view
                found[y] = [least_values(here, c, limits) for c in names.values()]
            if not found:
                return view
            ys = np.array(sorted(found))
            margins, shares = np.array([found[y] for y in ys]).transpose(2, 1, 0)
            self._curves = {key: (ys, margins, shares)}  # the last one is enough
        known, margins, shares = self._curves[key]
        names = self.criteria_of(view.state)
        return replace(
            view,
            curve_y=known,
            curve_criteria=tuple(names),
            curve_margin=margins,
            curve_share=shares,
        )

    def _lateral(self, key: State) -> Iterator[tuple[float, Stance]]:
        """Postures along the lateral path of a state, from the middle outwards."""
        stance = self.loaded(key)
        middle = float(stance.com[1])
        count = round(_CURVE_REACH / _CURVE_STEP)
        for side in (1, -1):
            here = stance
            for i in range(0 if side == 1 else 1, count + 1):
                y = middle + side * i * _CURVE_STEP
                try:
                    if key.held:
                        here = self.posture(key.named("com_y", y, "m"))
                    else:
                        x, _, z = key.com
                        if x is None and stance.robot.base_nv == 6:
                            x = float(stance.com[0])
                        here = solve_posture(
                            here, com=(x, y, z), joints=key.joints, reference=stance.q
                        ).stance
                except CopsenseError:
                    break
                yield y, here

    def add_regions(self, view: View, stale: Stale = lambda: False) -> View:
        """The view with the regions of the CoM, the joints held; without limits, of the soles."""
        if view.reason or "regions" not in view.state.overlays:
            return view
        here = self.loaded(view.state).at(view.q)
        limits = self.limits_of(view.state) or Limits()
        chosen, _ = determined_criteria(here, self.criteria_of(view.state), None)
        criteria = [c for c in chosen.values() if isinstance(c, Criterion)]
        if stale():
            return view
        try:
            found = com_regions(here, criteria, limits, tolerance=_REGION_TOLERANCE)
        except CopsenseError as error:
            notes = (*view.notes, f"no regions of the CoM: {error}")
            return replace(view, regions=(), notes=notes)
        regions = [RegionView(n, r.polygon) for n, r in found.items() if len(r.polygon)]
        return replace(view, regions=tuple(regions))

    def add_binding(self, view: View, stale: Stale = lambda: False) -> View:
        """The view with what is met first on the way to either side, where there are limits."""
        limits = self.limits_of(view.state)
        if view.reason or limits is None or not limits.any:
            return view
        here, tangent = asked_posture(
            self.loaded(view.state).at(view.q), (None, None, None), None, None
        )
        chosen, _ = determined_criteria(here, self.criteria_of(view.state), limits)
        path, lines = LateralPath(here), []
        for name, criterion in chosen.items():
            if stale():
                return view
            assert isinstance(criterion, Criterion)
            try:
                found = cop_sensitivity(here, criterion, limits)
                analysis = analyse_limits(path, criterion, limits, found, tangent)
            except CopsenseError as error:
                lines.append(f"{name}: {error}")
                continue
            for side in SIDES:
                met = [t for t in analysis.travels[side].limits if t.exact is not None]
                lines.append(
                    f"{name}, CoM to {side}: {met[0].name} after {1e3 * met[0].exact:.1f} mm"  # type: ignore[operator]
                    if met
                    else f"{name}, CoM to {side}: no limit within reach"
                )
        return replace(view, binding=tuple(lines))

    def code(self, state: State) -> tuple[str, str]:
        """The command and the lines of Python that print a state's numbers.

        Raises:
            InvalidInputError: as `State.to_command`.
        """
        return state.to_command(), state.to_python()

    def values(self, view: View) -> dict[str, float]:
        """Where a view's posture has each CoM and joint coordinate [m, rad]."""
        robot = self.stance.robot
        found = dict(zip(COM_COORDINATES, (float(c) for c in view.com), strict=True))
        return {
            name: found[name] if c.kind == "com" else robot.joint_position(view.q, name)
            for name, c in self.coordinates.items()
            if c.kind in ("com", "joint")
        }

    def reach(self, state: State, name: str, stale: Stale = lambda: False) -> tuple[float, float]:
        """From where to where one coordinate of a state can go, the others as they are [m, rad].

        It ends where there is no posture, or where a joint meets its limit. Every tenth of the way
        to the coordinate's own ends is tried, then the last is halved.
        """
        coordinate = self.coordinates[name]
        ends = []
        for end in (coordinate.low, coordinate.high):
            good, bad = 0.0, None
            for share in np.linspace(0.1, 1.0, 10):
                if stale():
                    return coordinate.low, coordinate.high
                if not self._reaches(state, coordinate, end, float(share)):
                    bad = float(share)
                    break
                good = float(share)
            for _ in range(3 if bad is not None else 0):
                assert bad is not None
                middle = 0.5 * (good + bad)
                if self._reaches(state, coordinate, end, middle):
                    good = middle
                else:
                    bad = middle
            ends.append(coordinate.home + good * (end - coordinate.home))
        return ends[0], ends[1]

    def _reaches(self, state: State, coordinate: Coordinate, end: float, share: float) -> bool:
        value = coordinate.home + share * (end - coordinate.home)
        try:
            here = self.posture(state.named(coordinate.name, value, coordinate.unit))
        except CopsenseError:
            return False
        # What the stance itself is beyond, it may stay beyond.
        return bool(np.all(here.joint_limit_excess <= self.stance.joint_limit_excess + AT_LIMIT))

    def _chart(self, names: tuple[str, ...], loads: tuple[Load, ...]) -> PostureChart:
        key = names, loads, self.compiled
        if key not in self._charts:
            if len(self._charts) > _KEPT:
                self._charts.clear()
            self._charts[key] = PostureChart(self._under(loads), names, compiled=self.compiled)
        return self._charts[key]

    def _read_criteria(self, texts: tuple[str, ...], length: float) -> dict[str, Criterion]:
        if not texts:
            return {c.name: c for c in self.criteria}
        found = [criterion_from_text(text, length) for text in texts]
        for criterion in found:
            criterion.at(self.stance)  # weights that do not fit are an error
        return dict(named_criteria(found, "an explorer", policies=False))


def least_values(
    stance: Stance, criterion: Criterion, limits: Limits | None
) -> tuple[float, float]:
    """The least margin of any contact with a sole [m], and the least share of the weight of any.

    NaN where there is none.
    """
    try:
        chosen, _ = determined_criteria(stance, {criterion.name: criterion}, limits)
        equilibrium = solve_equilibrium(stance, chosen[criterion.name], limits)
        share = float(equilibrium.wrenches[:, 2].min()) / stance.robot.weight
        cops = contact_cops(equilibrium)
    except (CopsenseError, KeyError):
        return np.nan, np.nan
    margins = [
        float(contact.sole.margins(cop))
        for contact, cop in zip(stance.contacts, cops, strict=True)
        if contact.sole is not None
    ]
    return min(margins, default=np.nan), share
