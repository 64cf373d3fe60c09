"""PlayedModel: a model whose posture is a row of a run, at rest and in its motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from copsense.analysis.asked import determined_criteria
from copsense.criterion import Criterion
from copsense.errors import CopsenseError
from copsense.explore.model import Model, Stale, least_values
from copsense.explore.state import State
from copsense.explore.view import CriterionView, View, cops_in_world, posture_parts
from copsense.limits import Limits
from copsense.posture_run import PostureRun
from copsense.simulation.timed_prediction import cops_or_nan
from copsense.stance import Stance
from copsense.statics import solve_equilibrium

_CURVE_POINTS = 60


class PlayedModel(Model):
    """A model whose posture is a row of a run; criteria and limits are those of the state.

    Attributes:
        run: the postures.
        row: which one is shown.
    """

    run: PostureRun
    row: int

    def __init__(
        self,
        run: PostureRun,
        words: Sequence[str] = (),
        *,
        criteria: Sequence[Criterion] | None = None,
        limits: Limits | None = None,
    ) -> None:
        """Begin with the first row; the other arguments are those of `Model`."""
        super().__init__(run.stance, words, criteria=criteria, limits=limits)
        self.run, self.row = run, 0
        self._along: dict[State, tuple[np.ndarray, np.ndarray, np.ndarray]] = {}

    def posture(self, state: State) -> Stance:
        """The posture of the row, whatever the state asks for."""
        return self.run.at(self.row)

    def view(self, state: State, revision: int = 0, last: View | None = None) -> View:
        """What the row looks like; where no criterion has an answer, the robot without them."""
        row = self.row
        here, measured = self.run.at(row), self._measured(row)
        try:
            view = self._view(here, state, revision)
        except CopsenseError as error:
            parts = posture_parts(here)
            view = View(state, revision, criteria=(), reason=str(error), **parts)
            return replace(view, row=row, measured=measured)
        criteria = self._with_motion(view, row)
        return replace(view, criteria=criteria, row=row, measured=measured)

    def _with_motion(self, view: View, row: int) -> tuple[CriterionView, ...]:
        """The criteria's answers, with the centres of pressure of the motion where there is one."""
        moving = self.run.moving(row)
        if moving is None:
            return view.criteria
        limits = self.limits_of(view.state)
        chosen, _ = determined_criteria(self.run.at(row), self.criteria_of(view.state), limits)
        found = []
        for each in view.criteria:
            try:
                cop = cops_or_nan(solve_equilibrium(moving, chosen[each.name], limits))
            except CopsenseError:  # nothing within the limits holds this motion
                found.append(each)
                continue
            world = cops_in_world(moving, cop)
            found.append(replace(each, moving_cop=cop, moving_cop_world=world))
        return tuple(found)

    def _measured(self, row: int) -> np.ndarray | None:
        """Measured centres of pressure of a row in the world (nc, 3) [m], NaN where not."""
        if self.run.measured is None:
            return None
        return cops_in_world(self.run.at(row), self.run.measured[row])

    def add_curve(self, view: View, stale: Stale = lambda: False) -> View:
        """The view with the least margins over the rows."""
        if "curve" not in view.state.overlays:
            return view
        key = replace(view.state, coordinates={}, overlays=frozenset())
        if key not in self._along:
            rows = np.unique(np.linspace(0, len(self.run) - 1, _CURVE_POINTS).astype(int))
            names, limits = self.criteria_of(view.state), self.limits_of(view.state)
            found = []
            for row in rows:
                if stale():
                    return view
                here = self.run.at(int(row))
                found.append([least_values(here, c, limits) for c in names.values()])
            margins, shares = np.array(found).transpose(2, 1, 0)
            self._along = {key: (self.run.values[rows], margins, shares)}
        values, margins, shares = self._along[key]
        order = np.argsort(values)
        return replace(
            view,
            curve_y=values[order],
            curve_criteria=tuple(self.criteria_of(view.state)),
            curve_margin=margins[:, order],
            curve_share=shares[:, order],
        )

    def code(self, state: State) -> tuple[str, str]:
        """What of the row can be said: no command, but Python."""
        run = self.run
        value, number = run.values[self.row], int(run.rows[self.row])
        said = f"# {run.axis} = {value:.6g} {run.unit}".rstrip()
        plain = replace(state, coordinates={}, held=False)
        lines = f"{run.python or '# run: a copsense.posture_run.PostureRun of yours'}\n{said}"
        return f"# row {number} of {run.source}", plain.to_python(lines, f"run.at({self.row})")
