"""Posture inputs: what a function of the posture is given, and the postures that it means."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from copsense.batch import PostureBatch, PostureChart
from copsense.batch.postures.chart_gradient import ChartGradient
from copsense.learning.whole_postures import WholePostures
from copsense.stance import Stance


class PostureInputs:
    """Coordinates of a chart, or whole configurations.

    Attributes:
        chart: finds the postures.
        names: of the inputs.
        start: the inputs of the stance itself.
    """

    chart: PostureChart
    names: tuple[str, ...]
    start: Float[np.ndarray, " k"]

    def __init__(self, stance: Stance, coordinates: Sequence[str] | None, within: float) -> None:
        """Find out what the inputs mean.

        Args:
            stance: gives robot and contacts.
            coordinates: of a chart; None for whole configurations.
            within: how far a configuration may be from its contacts [m, rad].
        """
        self._within = within
        self._whole = WholePostures(stance) if coordinates is None else None
        if self._whole is not None:
            self.chart = self._whole.chart
            self.names = tuple(f"q[{i}]" for i in range(int(stance.robot.model.nq)))
            self.start = np.array(stance.q)
        else:
            self.chart = PostureChart(stance, coordinates or ())
            self.names, self.start = self.chart.names, np.array(self.chart.values)
        self._gradient = ChartGradient(self.chart)

    @property
    def description(self) -> str:
        """The inputs in words."""
        if self._whole is not None:
            return f"a configuration ({len(self.names)} entries)"
        return ", ".join(self.names)

    def pull(
        self,
        x: Float[np.ndarray, "N k"],
        q: Float[np.ndarray, "N nq"],
        gradient: Float[np.ndarray, "N outputs nv"],
    ) -> Float[np.ndarray, "N outputs k"]:
        """Gradients over velocities as gradients over the inputs; NaN where there is none."""
        pulled = self._gradient.pull(q, gradient)
        return pulled if self._whole is None else self._whole.pull(x, pulled)

    def solve(
        self, x: np.ndarray, out: PostureBatch | None = None
    ) -> tuple[slice | np.ndarray, np.ndarray, dict[int, str]]:
        """Look for the postures.

        Args:
            x: the inputs, a posture in each row.
            out: memory for as many postures.

        Returns:
            Which rows have a posture, the configurations of these, and why the others have none.
        """
        reasons: dict[int, str] = {}
        finite = np.isfinite(x).all(axis=1)
        for i in np.flatnonzero(~finite):
            reasons[int(i)] = "an input is not a finite number"
        values = x
        if self._whole is not None:
            values, wrong = self._whole.values(np.where(finite[:, None], x, self.start))
            reasons |= {i: why for i, why in wrong if i not in reasons}
        good = np.ones(len(x), dtype=bool)
        good[list(reasons)] = False
        rows = np.flatnonzero(good)
        given = values if len(rows) == len(x) else values[rows]
        batch = self.chart.solve(given, out if out is not None and len(out) == len(rows) else None)
        q = batch.configurations
        if not batch.converged.all():
            for i in np.flatnonzero(~batch.converged):
                reasons[int(rows[i])] = str(batch.reasons[i])
            rows, q = rows[batch.converged], q[batch.converged]
        if self._whole is not None:
            moved = self._whole.moved(values[rows], q)
            near = moved <= self._within
            for i in np.flatnonzero(~near):
                reasons[int(rows[i])] = (
                    f"{moved[i]:.3g} (m or rad) from the nearest posture with the contacts in "
                    f"place, more than the {self._within:g} allowed (within=)"
                )
            rows, q = rows[near], q[near]
        return (rows if reasons else slice(None)), q, reasons
