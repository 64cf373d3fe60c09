"""analyse: one posture, and which way of sharing the load keeps its feet planted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from jaxtyping import Float

from copsense.analysis.asked import asked_posture, determined_criteria
from copsense.analysis.limit_analysis import LimitAnalysis, analyse_limits
from copsense.analysis.verdicts import verdict
from copsense.arrays import finite_number
from copsense.blas import one_blas_thread
from copsense.content import freeze
from copsense.cop import support_polygon, total_center_of_pressure
from copsense.criterion import Criterion, minimum_torque, minimum_wrench
from copsense.extras import require
from copsense.freedom import com_span, freedom_notes
from copsense.joint_notes import joint_limit_notes
from copsense.json_data import json_data
from copsense.limits import Limits, limit_rows, optional_limits, torque_placeholders
from copsense.path import LateralPath
from copsense.robots import heading_notes, plausibility_notes, sole_notes
from copsense.sensitivity import CopSensitivity, check_sensitivity, cop_sensitivity
from copsense.stance import Stance, check_at_rest, check_stance
from copsense.statics import (
    StaticEquilibrium,
    WrenchPolicy,
    named_criteria,
)
from copsense.sway_levers import SwayLever, sway_levers
from copsense.uncertainty import Spread, Uncertainty, propagate_uncertainty

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from copsense.explore.showing import ShownPage
    from copsense.plots.style import Figure


@dataclass(frozen=True, eq=False)
class Analysis:
    """The analysis of one posture; printed, it is the table of ``copsense analyse``.

    Attributes:
        stance: the posture.
        tangent: dq/dy (nv,) of the lateral path of the CoM that begins there and stays nearest to
            this posture, to which slopes refer.
        sensitivities: criterion's name -> sensitivity of every contact's CoP; its ``equilibrium``
            holds wrenches and torques.
        limits: what the wrenches respect; None for nothing.
        limit_analyses: criterion's name -> active limits, margins and travels; empty without
            limits.
        along: the joint per which slopes are given too, or None.
        notes: what to know about robot and stance: what of its file is not used, soles, joint
            limits, placeholders.
        checked: whether the derivatives were compared with finite differences.
        period: of the sway asked about [s]; None for none.
        sway: criterion's name -> what a sway about this posture does to its outputs; without
            policies, and empty without a period.
        spreads: criterion's name -> what errors of the model make of its answer; empty without an
            uncertainty.
    """

    stance: Stance
    tangent: Float[np.ndarray, " nv"]
    sensitivities: Mapping[str, CopSensitivity]
    limits: Limits | None
    limit_analyses: Mapping[str, LimitAnalysis]
    along: str | None
    notes: tuple[str, ...]
    checked: bool
    period: float | None = None
    sway: Mapping[str, tuple[SwayLever, ...]] = field(default_factory=dict)
    spreads: Mapping[str, Spread] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Own the tangent and the mappings."""
        freeze(self, "tangent", "sensitivities", "limit_analyses", "sway", "spreads")

    @property
    def equilibria(self) -> dict[str, StaticEquilibrium]:
        """Criterion's name -> its equilibrium."""
        return {name: found.equilibrium for name, found in self.sensitivities.items()}

    @property
    def verdict(self) -> str:
        """One sentence: which criterion lets the CoM travel farthest."""
        return str(self._data["verdict"])

    def to_dict(self) -> dict[str, Any]:
        """What ``copsense analyse --json`` prints: plain data, None for what is infinite.

        Lengths [m], wrenches [N, N m] about the contact frames in contact axes, CoM in world axes.
        """
        return dict(json_data(self._data))

    def to_pandas(self) -> pd.DataFrame:
        """A table with a row per criterion and contact; lengths [m], forces [N], moments [N m]."""
        from copsense.analysis.analysis_table import table

        return table(self._data)

    def to_xarray(self) -> xr.Dataset:
        """The same table over criterion and contact, in SI units."""
        require("xarray", "a dataset")
        found = self.to_pandas().set_index(["criterion", "contact"]).to_xarray()
        found = found.reindex(
            criterion=list(self.sensitivities), contact=list(self.stance.contact_names)
        )
        return found.assign_attrs(robot=self.stance.robot.name, units="SI")

    def plot(self) -> Figure:
        """The robot, and each criterion from above, `copsense.plots.plot_stance`.

        With the ellipses of the centres of pressure where there is an uncertainty.
        """
        from copsense.plots import plot_stance

        spreads = [self.spreads[name] for name in self.sensitivities] if self.spreads else None
        return plot_stance(self.stance, list(self.sensitivities.values()), spreads)

    def show(self) -> ShownPage:
        """The posture in 3-D with these criteria, `copsense.explore.showing.show`."""
        from copsense.explore.showing import show

        return show(self)

    def __str__(self) -> str:
        """The table, without the notes."""
        from copsense.analysis.analysis_table import text

        return text(self._data, self._joint_unit)

    def __repr__(self) -> str:
        """The table and the notes."""
        return "\n".join([str(self), *(f"note: {note}" for note in self.notes)])

    def _repr_html_(self) -> str:
        """The same for notebooks."""
        from copsense.analysis.analysis_table import html

        return html(self._data, self._joint_unit)

    @property
    def _joint_unit(self) -> str:
        return "rad" if self.along is None else self.stance.robot.joint_unit(self.along)

    @cached_property
    def _data(self) -> dict[str, Any]:
        """The analysis as plain data, infinities kept."""
        stance, robot = self.stance, self.stance.robot
        data: dict[str, Any] = {
            "robot": robot.name,
            "mass": robot.mass,
            "com": stance.com,
            "rank": stance.rank,
            "admissible_motions": stance.admissible_motions.shape[1],
            "contacts": [
                {"name": c.name, "frame": c.frame, "kind": c.kind, "position": p.translation}
                for c, p in zip(stance.contacts, stance.placements, strict=True)
            ],
            "com_span": com_span(stance),
            "support_margin": self._support_margin,
            "criteria": {name: self._criterion(name) for name in self.sensitivities},
        }
        data["verdict"] = verdict(data)
        return data | {"notes": list(self.notes), "checked": self.checked}

    @property
    def _support_margin(self) -> float | None:
        """How far the whole robot's centre of pressure is inside the support polygon [m]."""
        outline = support_polygon(self.stance)
        if outline is None or len(outline) < 2:
            return None
        at = total_center_of_pressure(next(iter(self.equilibria.values())))[:2]
        return float(outline.margins(at)) if len(outline) > 2 else -outline.boundary_distance(at)

    def _criterion(self, name: str) -> dict[str, Any]:
        found = self.sensitivities[name]
        equilibrium, robot = found.equilibrium, self.stance.robot
        row = {
            "contacts": self._contacts(found),
            "torques": dict(zip(robot.torque_names, equilibrium.torques.tolist(), strict=True)),
            "torque_norm": float((equilibrium.torques**2).sum() ** 0.5),
            "residual": equilibrium.residual(),
            "total_cop": total_center_of_pressure(equilibrium),
        }
        if name in self.limit_analyses:
            row |= self.limit_analyses[name].to_dict()
        if name in self.spreads:
            row["uncertainty"] = self.spreads[name].to_dict()
        if self.period is not None and name in self.sway:
            row["sway"] = {
                "period": self.period,
                "outputs": {
                    x.output: {
                        "lever": x.lever,
                        "static_frequency": x.frequency,
                        "factor": x.factor(self.period),
                    }
                    for x in self.sway[name]
                },
            }
        return row

    def _contacts(self, found: CopSensitivity) -> dict[str, Any]:
        equilibrium = found.equilibrium
        slope = found.along(self.tangent)
        rows: dict[str, Any] = {}
        for k, contact in enumerate(self.stance.contacts):
            edge = int(found.tipping_edge[k])
            row: dict[str, Any] = {
                "kind": contact.kind,
                "wrench": equilibrium.wrenches[k],
                "load_share": float(equilibrium.wrenches[k, 2]) / self.stance.robot.weight,
                "pulling": contact.name in equilibrium.pulling,
                "cop": found.cop[k],
                "cop_slope": slope[k],
                "cop_gain": found.com_gain[k],
                "worst_case_gain": float(found.worst_case_gain[k]),
                "load_gain": found.load_gain[k],
                "com_travel": float(found.com_travel[k]),
                "tipping_edge": None if edge < 0 else edge,
                "unloading_travel": float(found.unloading_travel[k]),
            }
            if self.along is not None:
                row[f"cop_per_{self.along}"] = found.along_joint(self.tangent, self.along)[k]
            if contact.sole is not None:
                margin = contact.sole.margin(found.cop[k])
                row |= {
                    "margin": margin.distance,
                    "margin_edge": margin.edge,
                    "margin_side": margin.side,
                }
            rows[contact.name] = row
        return rows


@one_blas_thread()
def analyse(
    stance: Stance,
    criteria: Sequence[Criterion | WrenchPolicy] | None = None,
    limits: Limits | None = None,
    along: str | None = None,
    *,
    com_x: float | None = None,
    com_y: float | None = None,
    com_z: float | None = None,
    joints: Mapping[str, float] | None = None,
    at: Mapping[str, float] | None = None,
    check: bool = False,
    period: float | None = None,
    uncertainty: Uncertainty | Literal["default"] | None = None,
) -> Analysis:
    """Analyse one posture: centre of pressure, margin and sensitivity of every contact.

    Args:
        stance: the robot on its contacts, such as what `copsense.load_stance` returns.
        criteria: what shares the load, with distinct names; default the paper's two,
            ``minimum_wrench(1.0)`` and ``minimum_torque()``.
        limits: what the wrenches and torques must respect; None for nothing. With limits, the
            criteria must be `Criterion` values.
        along: a joint per which the sensitivity is given too, along the CoM's lateral path.
        com_x: world x of the CoM to move to first [m]; None holds it.
        com_y: world y likewise [m].
        com_z: its height to move to [m]; None leaves it free.
        joints: joint -> position to put it at [rad, or m for a prismatic joint].
        at: coordinate -> value of the posture instead, by name as in
            `copsense.batch.PostureChart` [m, rad]: CoM, base, joints and where the feet stand.
            What is not named keeps the stance's value, where `com_y` alone lets everything else
            yield.
        check: compare the derivatives with finite differences.
        period: of a sideways sway of the CoM about this posture [s]: `Analysis.sway` then says of
            each output what it does to the slope, and up to which frequency statics are within 5 %.
        uncertainty: how far the model may be off, such as
            ``copsense.uncertainty.Uncertainty.read(path)``; ``"default"`` for what is usual.
            `Analysis.spreads` then says what that makes of the answer. The criteria must be
            `Criterion` values.

    Raises:
        InvalidInputError: not a stance, or criteria without distinct names.
        InvalidInputError: `at` beside `com_x`, `com_y`, `com_z` or `joints`.
        UnreachablePostureError: no posture has the CoM and the joints there.
        SensitivityMismatchError: the check failed.
        CopsenseError: a criterion has no solution here.
    """
    check_stance(stance)
    check_at_rest(stance, "an analysis")
    within = optional_limits(limits)
    usual = (minimum_wrench(1.0), minimum_torque())
    chosen = named_criteria(usual if criteria is None else criteria, "an analysis")
    if along is not None:
        stance.robot.velocity_index(along)
    here, tangent = asked_posture(stance, (com_x, com_y, com_z), joints, at)
    chosen, tied = determined_criteria(here, chosen, within)
    found = {name: cop_sensitivity(here, c, within) for name, c in chosen.items()}
    if check:
        for criterion in chosen.values():
            if isinstance(criterion, Criterion):  # a policy's are finite differences themselves
                check_sensitivity(here, criterion, within)
    limited, path = {}, LateralPath(here)  # its postures serve every criterion
    if within is not None:
        for name, criterion in chosen.items():
            assert isinstance(criterion, Criterion)  # cop_sensitivity rejects a policy with limits
            limited[name] = analyse_limits(path, criterion, within, found[name], tangent)
    if period is not None:
        finite_number(period, "the period of a sway [s]", positive=True)
    swayed = {
        name: sway_levers(each.equilibrium, tangent)
        for name, each in found.items()
        if period is not None and isinstance(each.equilibrium.criterion, Criterion)
    }
    spreads = {
        name: propagate_uncertainty(here, criterion, uncertainty, within, path=path)
        for name, criterion in chosen.items()
        if uncertainty is not None
    }
    notes = (
        *here.robot.notes,
        *tied,
        *_limit_notes(here, within, limited),
        *freedom_notes(here),
        *plausibility_notes(here),
        *heading_notes(here),
        *sole_notes(here),
        *joint_limit_notes(here),
        *(f"{name}: {note}" for name, spread in spreads.items() for note in spread.notes),
    )
    return Analysis(
        here, tangent, found, within, limited, along, notes, check, period, swayed, spreads
    )


def _limit_notes(
    stance: Stance, limits: Limits | None, limited: Mapping[str, LimitAnalysis]
) -> list[str]:
    notes = []
    if limits is not None and limits.torque == "model" and torque_placeholders(stance):
        notes.append(
            "no torque limit in the model (a placeholder) for: "
            + ", ".join(torque_placeholders(stance))
        )
    if limits is not None and not limit_rows(stance, limits).all_names:
        notes.append(
            "the limits that are switched on limit nothing here: they need a friction coefficient, "
            "a sole or a torque bound that this stance does not have."
        )
    return notes + [
        f"{name}: the next change of its limits cannot be said: {analysis.unknown}"
        for name, analysis in limited.items()
        if analysis.unknown
    ]
