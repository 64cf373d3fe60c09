"""Playback: postures that were recorded or swept, one after the other, with what was measured."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from copsense.content import ShortRepr, freeze
from copsense.criterion import Criterion
from copsense.errors import CopsenseError, InvalidInputError
from copsense.explore.model import Model, Stale, least_margin
from copsense.explore.state import State
from copsense.explore.view import View, posture_parts
from copsense.extras import require
from copsense.limits import Limits
from copsense.provenance import model_digest
from copsense.stance import Stance

SWEEP_SECONDS = 5.0  # that a sweep takes from end to end
_CURVE_POINTS = 60


@dataclass(frozen=True, eq=False, repr=False)
class Playback(ShortRepr):
    """Postures in order, from a file of `copsense balance` or `copsense sweep`.

    Attributes:
        path: the file.
        axis: what `values` are: ``"time"`` or the coordinate that was swept.
        unit: of them.
        values: one for each posture, rising or falling (N,).
        configurations: the postures (N, nq).
        rows: which rows of the file they are; those without a posture are left out (N,).
        measured: centres of pressure in contact axes (N, nc, 2) [m], NaN where a contact carries
            nothing; None where nothing was measured.
    """

    path: Path
    axis: str
    unit: str
    values: Float[np.ndarray, " N"]
    configurations: Float[np.ndarray, "N nq"]
    rows: Int[np.ndarray, " N"]
    measured: Float[np.ndarray, "N nc 2"] | None

    def __post_init__(self) -> None:
        """Own the arrays."""
        freeze(self, "values", "configurations", "rows")
        if self.measured is not None:
            freeze(self, "measured")

    def __len__(self) -> int:
        """Number of postures."""
        return len(self.values)

    @classmethod
    def load(cls, path: str | Path, stance: Stance) -> Playback:
        """Read a file of `copsense balance --output` or `copsense sweep --output`.

        Args:
            path: netCDF.
            stance: the robot and the contacts it was made of.

        Raises:
            InvalidInputError: no such file, something else, or of another robot.
            MissingExtraError: xarray is not installed.
        """
        require("xarray", "playing a recording")
        from copsense.simulation import Recording
        from copsense.sweeps import Sweep

        source: Any
        try:
            source = Recording.load(path)
            axis, unit, measured = "time", "s", source["cop"].values
        except InvalidInputError as error:
            try:
                source = Sweep.load(path)
            except InvalidInputError:
                raise error from None
            axis = str(source.attrs["coordinate"])
            unit, measured = str(source[axis].attrs.get("units", "")), None
        if source.attrs.get("model_digest") != model_digest(stance):
            raise InvalidInputError(
                f"{path} is of another stance: its robot is {source.attrs.get('robot')!r} "
                f"on {', '.join(str(name) for name in source['contact'].values)}, or one of them "
                "has changed since. Explore the stance that it was made of, with the same options."
            )
        values, q = np.asarray(source[axis].values, float), source["configuration"].values
        whole = np.isfinite(q).all(axis=1)
        if not whole.any():
            raise InvalidInputError(f"{path} holds no posture. Play another file.")
        kept = None if measured is None else measured[whole]
        return cls(Path(path), axis, unit, values[whole], q[whole], np.flatnonzero(whole), kept)


class PlayedModel(Model):
    """A model whose posture is a row of a playback; criteria and limits are those of the state.

    Attributes:
        playback: the postures.
        row: which one is shown.
    """

    playback: Playback
    row: int

    def __init__(
        self,
        stance: Stance,
        playback: Playback,
        words: Sequence[str] = (),
        *,
        criteria: Sequence[Criterion] | None = None,
        limits: Limits | None = None,
    ) -> None:
        """Begin with the first row; the other arguments are those of `Model`."""
        super().__init__(stance, words, criteria=criteria, limits=limits)
        self.playback, self.row = playback, 0
        self._along: dict[State, tuple[np.ndarray, np.ndarray]] = {}

    def posture(self, state: State) -> Stance:
        """The posture of the row, whatever the state asks for."""
        return self._at(self.row)

    def _at(self, row: int) -> Stance:
        # In closed loop a foot may be off its place by a little: it is shown where it was.
        return self.stance.at(self.playback.configurations[row], check=False)

    def view(self, state: State, revision: int = 0, last: View | None = None) -> View:
        """What the row looks like; where no criterion can be told, the robot without them."""
        row = self.row
        here = self._at(row)
        try:
            return replace(self._view(here, state, revision), row=row)
        except CopsenseError as error:
            parts = posture_parts(here)
            return View(state, revision, criteria=(), reason=str(error), row=row, **parts)

    def measured(self, row: int) -> Float[np.ndarray, "k 3"] | None:
        """Measured centres of pressure of a row in the world [m]; None where there are none."""
        if self.playback.measured is None:
            return None
        found = []
        for cop, place in zip(self.playback.measured[row], self._at(row).placements, strict=True):
            if np.all(np.isfinite(cop)):
                found.append(place.act(np.array([*cop, 0.0])))
        return np.array(found).reshape(-1, 3)

    def add_curve(self, view: View, stale: Stale = lambda: False) -> View:
        """The view with the least margins over the rows."""
        if "curve" not in view.state.overlays:
            return view
        key = replace(view.state, coordinates={}, overlays=frozenset())
        if key not in self._along:
            rows = np.unique(np.linspace(0, len(self.playback) - 1, _CURVE_POINTS).astype(int))
            names, limits = self.criteria_of(view.state), self.limits_of(view.state)
            margins = []
            for row in rows:
                if stale():
                    return view
                here = self._at(int(row))
                margins.append([least_margin(here, c, limits) for c in names.values()])
            self._along = {key: (self.playback.values[rows], np.array(margins).T)}
        values, found = self._along[key]
        order = np.argsort(values)
        return replace(view, curve_y=values[order], curve_margin=found[:, order])

    def code(self, state: State) -> tuple[str, str]:
        """What of the row can be said: no command, but Python."""
        kind = (
            "from copsense.simulation import Recording as File"
            if self.playback.axis == "time"
            else "from copsense.sweeps import Sweep as File"
        )
        value, number = self.playback.values[self.row], int(self.playback.rows[self.row])
        lines = (
            f"{kind}\n\n# {self.playback.axis} = {value:.6g} {self.playback.unit}\n"
            f"q = File.load({str(self.playback.path)!r})['configuration'].values[{number}]"
        )
        python = replace(state, coordinates={}, held=False).to_python(lines, ".at(q)")
        return f"# row {number} of {self.playback.path}", python


def frame_rows(playback: Playback, rate: float = 25.0) -> tuple[list[int], float]:
    """Rows to show one after the other, and the seconds between them.

    A recording goes at the speed it happened, a sweep once in five seconds.

    Args:
        playback: the postures.
        rate: frames a second.
    """
    if playback.axis == "time":
        seconds = float(playback.values[-1] - playback.values[0])
    else:
        seconds = SWEEP_SECONDS
    count = max(2, min(math.ceil(seconds * rate) + 1, 2000))
    wanted = np.linspace(playback.values[0], playback.values[-1], count)
    rows = [int(np.argmin(np.abs(playback.values - value))) for value in wanted]
    return rows, max(seconds, 1e-3) / (count - 1)
