"""sweep: many postures and criteria into one labelled result; a failure is a row."""

from __future__ import annotations

import json
import reprlib
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from html import escape
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from copsense.arrays import check_type
from copsense.blas import one_blas_thread
from copsense.criterion import Criterion
from copsense.errors import (
    CopsenseError,
    InvalidInputError,
    UnknownNameError,
)
from copsense.extras import require
from copsense.joint_notes import swept_joint_notes
from copsense.json_data import json_data
from copsense.labelled import LabelledResult, tidy_table
from copsense.limits import Limits, check_limits
from copsense.listing import first_few
from copsense.path import PosturePath, check_path
from copsense.polygon import ON_EDGE
from copsense.provenance import made_by, read_plain
from copsense.sensitivity import CopSensitivity
from copsense.statics import (
    ConstrainedEquilibrium,
    WrenchPolicy,
    named_criteria,
    tie_break_note,
)
from copsense.sweep_layout import SweepRows, sweep_dataset, with_changes
from copsense.sweep_margins import with_limit_margins
from copsense.sweep_sway import evaluate_row, passing_instant, with_sway
from copsense.timed_path import Sway

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.figure import Figure

    from copsense.explore.showing import ShownPage
    from copsense.stance import Stance

_SHOWN = 5  # criteria, and contacts, that the representation lists
_COLUMNS = (
    "com",
    "cop",
    "wrench",
    "margin",
    "margin_side",
    "com_travel",
    "unloading_travel",
    "cop_gain",
    "cop_slope",
    "worst_case_gain",
    "pulling",
    "active_limits",
    "change_travel",
    "change_limit",
    "residual",
    "reason",
    "torque",
    "cop_sensitivity",
)


class Sweep(LabelledResult):
    """What `sweep` found: every criterion at every posture of a path.

    ``sweep["cop_slope"]`` is a labelled array; the dimensions are ``posture, criterion, contact,
    axis, component, joint, velocity, com_direction, com_axis, vertex``, and within limits
    ``limit``. Every variable carries unit and meaning. A row that failed has NaN and its reason in
    ``reason``; elsewhere ``reason`` is empty.
    """

    _needs: ClassVar = ("cop", "wrench", "torque", "com", "reason", "pulling", "margin")
    _needs_attributes: ClassVar = ("coordinate",)
    _what: ClassVar = "a sweep"
    _made_by: ClassVar = "copsense.sweep"
    _command: ClassVar = "copsense sweep ... --output FILE.nc"

    __slots__ = ()

    @property
    def coordinate(self) -> xr.DataArray:
        """The path's coordinate at every posture, with its unit."""
        return self[str(self.attrs["coordinate"])]

    @property
    def criteria(self) -> tuple[Criterion | str, ...]:
        """What was minimised, as values that can be evaluated again; of a policy its name alone.

        Empty for a file of an earlier version, which did not record it.
        """
        return tuple(
            str(each["policy"]) if "policy" in each else Criterion.from_dict(each)
            for each in json.loads(self.attrs.get("criteria", "[]"))
        )

    @property
    def limits(self) -> Limits | None:
        """The limits within which the wrenches were solved; None for none."""
        found = read_plain(json.loads(self.attrs.get("limits", "null")))
        if found is None:
            return None
        del found["is"]
        return Limits(**found | {"friction_sides": int(found["friction_sides"])})

    @property
    def period(self) -> float | None:
        """Of the sway that every row is an instant of [s]; None at rest."""
        found = self.attrs.get("period")
        return None if found is None else float(found)

    @property
    def static_frequencies(self) -> dict[str, dict[str, float]]:
        """Criterion -> output -> up to which its statics are within 5 % in a sway [Hz].

        NaN for an output that stands still at rest; empty for a sweep at rest.
        """
        if "static_frequency" not in self:
            return {}
        found = self["static_frequency"]
        return {
            name: dict(zip(self.labels("output"), map(float, row), strict=True))
            for name, row in zip(self.labels("criterion"), found.values, strict=True)
        }

    @property
    def planted(self) -> xr.DataArray:
        """Whether each contact pushes with its CoP on its sole, the edge included.

        Over posture, criterion and contact. A CoP within `ON_EDGE` of the edge is on it: a limit
        holds it there. A contact without a sole is planted where it pushes; a failed row is not.
        """
        return (self["margin"] > -ON_EDGE) & ~self["pulling"]

    @property
    def free(self) -> xr.DataArray:
        """Whether no limit is active, over posture and criterion; where there are none, true.

        False where the row failed.
        """
        solved = self["reason"] == ""
        return solved & (self["active_limits"] == "") if "active_limits" in self else solved

    @property
    def planted_range(self) -> dict[str, tuple[float, float] | None]:
        """Criterion -> the longest part of the path on which every contact is planted.

        Ends in the unit of `coordinate`, the lower first; None where no posture is.
        """
        return self._longest(self.planted.all("contact"))

    @property
    def free_range(self) -> dict[str, tuple[float, float] | None]:
        """Criterion -> the longest part of the path on which no limit is active, likewise."""
        return self._longest(self.free)

    @property
    def failed(self) -> xr.DataArray:
        """Whether each row failed, over posture and criterion."""
        return self["reason"] != ""

    @property
    def failed_rows(self) -> tuple[tuple[int, str, str], ...]:
        """Posture, criterion and reason of every row that failed."""
        reasons, names = self["reason"].values, self.labels("criterion")
        return tuple((int(i), names[j], str(reasons[i, j])) for i, j in np.argwhere(reasons != ""))

    def subset(
        self, criteria: Sequence[str] | None = None, postures: Sequence[int] | None = None
    ) -> Sweep:
        """The sweep of some criteria, in the order given, and of some postures by position.

        Raises:
            UnknownNameError: a criterion that the sweep does not have.
            InvalidInputError: a posture that it does not have, or not lists of them.
        """
        found = self._dataset
        if criteria is not None:
            remedy = f"Give a list of names among {', '.join(self.labels('criterion'))}."
            check_type(criteria, (list, tuple), "a list of criteria's names", remedy)
            for name in criteria:
                if name not in self.labels("criterion"):
                    raise UnknownNameError("criterion in the sweep", name, self.labels("criterion"))
            found = found.sel(criterion=list(criteria))
            recorded = json.loads(self.attrs.get("criteria", "[]"))
            if recorded:
                known = dict(zip(self.labels("criterion"), recorded, strict=True))
                kept = json.dumps([known[name] for name in criteria])
                found = found.assign_attrs(criteria=kept)
        if postures is not None:
            count = self.sizes["posture"]
            numbers = np.asarray(postures)
            whole = numbers.dtype.kind in "iu"
            if not (
                numbers.ndim == 1 and whole and np.all((-count <= numbers) & (numbers < count))
            ):
                raise InvalidInputError(
                    f"postures is {reprlib.repr(postures)}. Give a list of positions from 0 to "
                    f"{count - 1}."
                )
            found = found.isel(posture=numbers.astype(int))
        return Sweep(found)

    def with_limit_margins(self, limits: Limits) -> Sweep:
        """The sweep with the margins of its wrenches and torques to other limits.

        A sweep within limits has the margins to them already. The wrenches stay what they are.

        Returns:
            A sweep with ``limit_margin`` (posture, criterion, limit), negative beyond the limit,
            and ``limit_kind`` and ``limit_unit`` of each. NaN where a row failed, and to the sole's
            edge where a contact pulls and has no centre of pressure.

        Raises:
            InvalidInputError: a limit needs what the contacts do not have.
            UnknownNameError: a torque limit names no joint.
        """
        return Sweep(with_limit_margins(self.to_xarray(), limits))

    def to_dict(self) -> dict[str, Any]:
        """What ``copsense sweep --json`` prints: plain data, None for what is infinite.

        For each criterion over which part of the path every contact is planted (within limits: no
        limit is active), in the unit of the coordinate, and the smallest margin on the way [m].
        """
        limits, coordinate = self.limits, self.coordinate
        ranges = self.planted_range if limits is None else self.free_range
        data: dict[str, Any] = {
            "robot": self.attrs["robot"],
            "coordinate": coordinate.name,
            "unit": coordinate.attrs["units"],
            "postures": coordinate.size,
            "failed_rows": len(self.failed_rows),
            "criteria": {
                name: {
                    "planted": ranges[name],
                    "smallest_margin": float(self["margin"].sel(criterion=name).min()),
                    "static_frequency": self.static_frequencies.get(name),
                    "largest_residual": float(self["residual"].sel(criterion=name).max()),
                }
                for name in self.labels("criterion")
            },
            "limits": None if limits is None else repr(limits),
            "period": self.period,
            "without_sole": self.attrs["without_sole"],
            "notes": list(self.notes),
        }
        return dict(json_data(data))

    def to_pandas(self) -> pd.DataFrame:
        """A tidy table: a row per posture, criterion and contact."""
        first = ("posture", str(self.attrs["coordinate"]), "criterion", "contact")
        return tidy_table(self._dataset, ("posture", "criterion", "contact"), first, _COLUMNS)

    def plot(self) -> Figure:
        """The sweep in one figure, `copsense.plots.plot_results`."""
        from copsense.plots import plot_results

        return plot_results(self)

    def show(self, stance: Stance) -> ShownPage:
        """A film in 3-D on the stance it was made of, `copsense.explore.showing.show`."""
        from copsense.explore.showing import show

        return show(self, stance)

    def __repr__(self) -> str:
        """Robot, path, and over which part of it each criterion keeps every contact planted."""
        return "\n".join([f"<copsense.Sweep of {self._heading()}", *self._lines()]) + ">"

    def _repr_html_(self) -> str:
        """The same with xarray's own view folded away, for notebooks."""
        lines = "".join(f"<div>{escape(line)}</div>" for line in self._lines())
        return (
            f"<div><strong>Sweep of {escape(self._heading())}</strong>{lines}"
            f"<details><summary>dataset</summary>{self._dataset._repr_html_()}</details></div>"
        )

    def _heading(self) -> str:
        along = self.coordinate
        ends = f"{float(along[0]):g} to {float(along[-1]):g} {along.attrs.get('units', '')}"
        count = self.sizes["posture"]
        return (
            f"{self.attrs['robot']}: {count} posture{'s' * (count != 1)} along {along.name}, "
            f"{ends.strip()}"
        )

    def _lines(self) -> list[str]:
        """What the representation says under its heading."""
        contacts, names = self.labels("contact"), self.labels("criterion")
        unit = self.coordinate.attrs.get("units", "")
        lines = [f"  contacts: {first_few(contacts, _SHOWN)}"]
        if self.period is not None:
            lines.append(f"  in a sway of {self.period:g} s")
        word, ranges = "every contact planted", self.planted_range
        if self.limits is not None:
            lines.append(f"  within {self.limits}")
            word, ranges = "no limit active", self.free_range
        for name in names[:_SHOWN]:
            ends = ranges[name]
            part = "at no posture"
            if ends is not None:
                low, high = ends
                part = f"from {low:g} to {high:g} {unit}" if low != high else f"at {low:g} {unit}"
            lines.append(f"  {name}: {word} {part.strip()}")
        if len(names) > _SHOWN:
            lines.append(f"  and {len(names) - _SHOWN} more criteria")
        failed = self.failed_rows
        if failed:
            posture, name, reason = failed[0]
            lines.append(f"  {len(failed)} rows failed; posture {posture}, {name}: {reason[:60]}")
        return lines

    def _longest(self, flags: xr.DataArray) -> dict[str, tuple[float, float] | None]:
        values = self.coordinate.values
        found: dict[str, tuple[float, float] | None] = {}
        for name, column in zip(self.labels("criterion"), flags.values.T, strict=True):
            run = _longest_run(column)
            found[name] = None
            if run is not None:
                low, high = sorted(float(values[i]) for i in run)
                found[name] = (low, high)
        return found


@one_blas_thread()
def sweep(
    path: PosturePath,
    criteria: Sequence[Criterion | WrenchPolicy],
    limits: Limits | None = None,
    *,
    period: float | None = None,
    progress: Callable[[int], object] | None = None,
) -> Sweep:
    """Evaluate every criterion at every posture of a path.

    Args:
        path: the postures and their tangents.
        criteria: criteria with distinct names, or policies q -> wrenches (named by their function).
        limits: what the wrenches and torques must respect; None for nothing. The active ones of
            each row are then named in ``active_limits``, separated by semicolons, and every row has
            its margins to them in ``limit_margin``. ``change_travel`` is how far the CoM may go
            from there, whichever way and to first order, before ``change_limit`` begins or ceases
            to press [m]; NaN where a tie-break alone presses.
        period: sway along the whole path and back in this time [s] instead of standing still at
            each posture, see `copsense.timed_path.Sway`: wrenches, torques, centres of pressure and
            margins carry the inertia, and ``cop_slope`` is along the sway; other derivatives hold
            the numbers of velocity and acceleration. ``static_frequency`` says up to which
            frequency the statics of each output are within 5 %.
        progress: called with 1 after each posture.

    A criterion that leaves forces undetermined which contacts exert against each other alone is
    given a tie-break (`copsense.statics.with_tie_break`), which ``notes`` and ``criteria`` say.

    Returns:
        The sweep. A row that failed has NaN and its reason.

    Raises:
        InvalidInputError: there is no criterion, two have one name, or a policy is given with
            limits or a period, within which only a criterion can be solved; or there is no
            curve to sway along.
    """
    require("xarray", "a sweep")
    check_path(path)
    if limits is not None:
        check_limits(limits)
    given = named_criteria(criteria, "a sweep")
    chosen = dict(given)  # a tie-break that one posture needs serves all after it
    _check_policies(chosen, limits, period)
    sway = None if period is None else Sway(path, period)
    rows = SweepRows(path.stances[0], len(path), list(chosen))
    for i in range(len(path)):
        passing = passing_instant(sway, path, i, rows)
        for j, (name, criterion) in enumerate(chosen.items()):
            if i in path.failures:
                rows.reason[i, j] = path.failures[i]
                continue
            if rows.reason[i, j]:
                continue
            try:
                found, slope = evaluate_row(path, i, criterion, limits, passing)
                chosen[name] = found.equilibrium.criterion
                _fill(rows, (i, j), found, slope)
            except CopsenseError as error:
                rows.reason[i, j] = str(error)
        if progress:
            progress(1)
    tied = [tie_break_note(name) for name in chosen if chosen[name] != given[name]]
    made = made_by(path.stances[0], list(chosen.values()), limits, tied)
    dataset = sweep_dataset(path, rows, made)
    if sway is not None:
        dataset = with_sway(dataset, sway, list(chosen.values()), limits)
    if limits is not None:
        dataset = with_changes(dataset, rows)
        if limits.any:
            dataset = with_limit_margins(dataset, limits)
    excess = dataset["joint_limit_excess"].values
    return Sweep(dataset).with_notes(swept_joint_notes(path.stances[0].robot, excess))


def _check_policies(
    criteria: Mapping[str, Criterion | WrenchPolicy], limits: Limits | None, period: float | None
) -> None:
    """Reject a policy within limits, or in motion."""
    policies = [name for name, c in criteria.items() if not isinstance(c, Criterion)]
    if period is not None and policies:
        raise InvalidInputError(
            f"{policies[0]} is a policy q -> wrenches: it does not know how the robot moves. Leave "
            "the period out, or give a Criterion."
        )
    if limits is not None and policies:
        raise InvalidInputError(
            f"{policies[0]} is a policy: its wrenches are what it says, and limits cannot change "
            "them. Leave the limits out and ask for margins to them with "
            "sweep(...).with_limit_margins(limits), or give a Criterion."
        )


def _fill(rows: SweepRows, at: tuple[int, int], found: CopSensitivity, slope: np.ndarray) -> None:
    """Enter what one posture and criterion gave."""
    equilibrium = found.equilibrium
    margins = _margins(found)
    values: dict[str, Any] = {
        "cop": found.cop,
        "wrench": equilibrium.wrenches,
        "torque": equilibrium.torques,
        "cop_sensitivity": found.gradient,
        "cop_slope": slope,
        "cop_gain": found.com_gain,
        "worst_case_gain": found.worst_case_gain,
        "com_travel": found.com_travel,
        "unloading_travel": found.unloading_travel,
        "margin": [margin for margin, _ in margins],
        "residual": equilibrium.residual(),
    }
    for name, value in values.items():
        rows.values[name][at] = value
    rows.side[at] = [side for _, side in margins]
    rows.pulling[at] = [c in equilibrium.pulling for c in equilibrium.stance.contact_names]
    if isinstance(equilibrium, ConstrainedEquilibrium):
        rows.active[at] = "; ".join(limit.name for limit in equilibrium.active)
        with suppress(InvalidInputError):  # the tie-break alone presses: it stays NaN
            i, rows.change_travel[at] = equilibrium.nearest_changing_row(found.com_motions)
            rows.change_limit[at] = equilibrium.names[i] if i >= 0 else ""


def _margins(found: CopSensitivity) -> list[tuple[float, str]]:
    """Margin and side of each contact; a contact without a sole has no edge to reach."""
    margins = []
    for contact, cop in zip(found.equilibrium.stance.contacts, found.cop, strict=True):
        if contact.sole is None:
            margins.append((np.inf, ""))
        else:
            margin = contact.sole.margin(cop)
            margins.append((margin.distance, margin.side))
    return margins


def _longest_run(flags: np.ndarray) -> tuple[int, int] | None:
    """First and last index of the longest run of true values."""
    ends = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    if not len(ends):
        return None
    runs = ends.reshape(-1, 2)
    first, after = runs[int(np.argmax(runs[:, 1] - runs[:, 0]))]
    return int(first), int(after) - 1
