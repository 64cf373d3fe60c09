"""The report's section on the closed loop: its figures, its table of runs, its differences."""

from __future__ import annotations

import math

import pandas as pd

from copsense.comparison import CAVEAT, agreement, rank_scores, shown_unit
from copsense.paper.claims import (
    EvaluatedClaim,
    Sway,
    stretch,
)
from copsense.paper.report.sway_plots import (
    plot_sway_cop,
    plot_sway_hip_roll,
    plot_sway_limits,
    plot_sway_load,
)
from copsense.paper.report.words import limit_words
from copsense.plots.style import whole_figure
from copsense.reports import ReportFigure

_SECTION = "closed-loop"


def sway_figures(sway: Sway, claims: tuple[EvaluatedClaim, ...]) -> tuple[ReportFigure, ...]:
    """Figs. 6 to 9 from closed loop, and the sway within limits."""
    found = {claim.claim.identifier: claim for claim in claims}
    load = sway.torque_stretch.load
    tips = [abs(run.tip_travel) * 1e3 for run in (sway.left, sway.right)]
    reach = sway.limited_amplitude * 1e3
    own = found["loop-less-on-support"].number
    off = found["loop-quasi-static"].number * 1e3
    left = float(sway.wrench_stretches[0].margin.min())
    return (
        ReportFigure(
            "loop_6a",
            _SECTION,
            "Fig. 6a in closed loop, minimum wrench, to the left.",
            "The measured vertical forces stay within "
            f"{found['loop-half-weight'].number:.4f} m g of half the weight until a foot tips.",
            "Normal force of both feet against time: two lines at one half.",
            lambda: whole_figure(plot_sway_load(sway.left)),
        ),
        ReportFigure(
            "loop_6b",
            _SECTION,
            "Fig. 6b in closed loop, minimum torque.",
            f"They follow the CoM over the period, from {load.min():.3f} to {load.max():.3f} m g.",
            "Normal force of both feet against time: two opposite waves about one half.",
            lambda: whole_figure(plot_sway_load(sway.torque)),
        ),
        ReportFigure(
            "loop_7a",
            _SECTION,
            "Fig. 7a in closed loop, minimum wrench, to the left.",
            f"Both CoPs move with the CoM until the foot tips, at {_mm(tips[0])} of CoM travel and "
            f"with {left * 1e3:.1f} mm to its sole's edge: contacts of this softness let a sole "
            "with round edges roll early.",
            "CoP y of both feet against time, parallel, until the right foot tips.",
            lambda: whole_figure(plot_sway_cop(sway.left)),
        ),
        ReportFigure(
            "loop_7b",
            _SECTION,
            "Fig. 7b in closed loop, minimum wrench, to the right.",
            f"The mirror image; the left foot tips at {_mm(tips[1])}.",
            "CoP y of both feet against time, parallel, until the left foot tips.",
            lambda: whole_figure(plot_sway_cop(sway.right)),
        ),
        ReportFigure(
            "loop_8",
            _SECTION,
            "Fig. 8 in closed loop, minimum torque.",
            f"The loaded foot's CoP moves {own:.2f} times as far as the other's. Under the lines, "
            "in grey, the static analysis at the CoM of each instant.",
            "CoP y of both feet against time over a full period: the loaded foot's is flatter.",
            lambda: whole_figure(plot_sway_cop(sway.torque)),
        ),
        ReportFigure(
            "loop_9b",
            _SECTION,
            "Fig. 9b in closed loop, CoP of the left foot.",
            "Against the left hip roll joint until a foot tips; the "
            f"static prediction beneath is at most {off:.2f} mm away.",
            "Left CoP against hip roll, both criteria, on top of their static predictions.",
            lambda: whole_figure(
                plot_sway_hip_roll(
                    {
                        "minimum-wrench": [sway.left, sway.right],
                        "minimum-torque": [sway.torque],
                    }
                )
            ),
        ),
        ReportFigure(
            "loop_limits",
            _SECTION,
            f"Within limits, ±{reach:g} mm.",
            "With inequalities in the controller the CoM goes from over one foot to over the "
            "other: each CoP stops short of its edge, and the other foot carries the rest. "
            f"Limits: {limit_words(sway.limits)}; nearer to the edge a sole with round edges rolls "
            "on contacts of this softness. "
            "Dotted: the edges level with the foot's origin; a CoP that moves fore or aft has "
            "others.",
            "CoP y of both feet against time, one panel per criterion, flat near the soles' edges.",
            lambda: plot_sway_limits(sway.limited),
            shape="wide",
        ),
    )


def sway_runs(sway: Sway) -> list[dict[str, str]]:
    """A row for each run: how it ended, beside what the static analysis said."""
    rows = []
    for name, run in sway.runs.items():
        stood = stretch(run)
        static = float(run.attrs["static_excursion"])
        limited = name not in ("minimum torque",) and "limits" in name
        rows.append(
            {
                "name": name,
                "amplitude": f"{(sway.limited_amplitude if limited else sway.amplitude) * 1e3:g}",
                "end": f"completes {float(run.attrs['end_time']):.0f} s"
                if run.completed
                else f"{run.attrs['tip_contact']} tips at {float(run.attrs['tip_time']):.2f} s"
                if run.attrs["tip_kind"]
                else str(run.attrs["end_reason"]),
                "tip": _mm(run.tip_travel * 1e3, sign=True),
                "static": "held by the limits" if limited else _mm(static * 1e3, sign=True),
                "error": f"{run.tracking_error * 1e3:.4f} mm",
                "margin": f"{float(stood.margin.min()) * 1e3:.2f} mm",
            }
        )
    return rows


def sway_rates(sway: Sway) -> dict[str, str]:
    """How often torques are commanded and the physics advances [Hz], alike in every run."""
    attributes = sway.left.attrs
    return {
        "control": f"{1.0 / float(attributes['control_period']):g}",
        "physics": f"{1.0 / float(attributes['time_step']):g}",
    }


def score_rows(table: pd.DataFrame) -> list[dict[str, str]]:
    """A row for each score: simulated, predicted, and the controller's rank."""
    ranks = rank_scores(table)["rank"].reindex(table.index)
    return [
        {
            "score": f"{row['trial']}: {str(row['score']).replace('_', ' ')}",
            "posture": str(row["posture"]),
            "controller": str(row["controller"]),
            "value": _quantity(float(row["value"]), row["unit"])
            if row["status"] == "measured"
            else f"{row['status']}: {row['reason']}",
            "path": _quantity(float(row["predicted"]), row["unit"]),
            "first_order": _quantity(float(row["first_order"]), row["unit"]),
            "contact": str(row["contact"]) or "–",
            "rank": "–" if math.isnan(rank) else f"{rank:.0f}",
        }
        for (_, row), rank in zip(table.iterrows(), ranks, strict=True)
    ]


def score_words(table: pd.DataFrame) -> tuple[str, ...]:
    """How well the predictions hold, a line per score, and the caveat."""
    words = []
    for _, row in agreement(table).iterrows():
        name = "along the path" if row["prediction"] == "path" else "to first order"
        r = ""
        if math.isfinite(row["low"]):
            ends = f"{row['low']:.4f} to {row['high']:.4f}"
            r = f", r = {row['correlation']:.4f} (95 % interval {ends})"
        words.append(
            f"{str(row['score']).replace('_', ' ')}, {name}: error "
            f"{_quantity(row['mean_error'], row['unit'])} on average, "
            f"{_quantity(row['largest_error'], row['unit'])} at most{r}, {row['cases']} cases"
        )
    return (*words, CAVEAT)


def sway_differences(sway: Sway) -> tuple[str, ...]:
    """What differs from the experiment of 2017."""
    return (
        "Physics is simulated, and its contacts are rigid soles on rigid ground.",
        f"The amplitude is not printed. {sway.amplitude * 1e3:g} mm lies between what the two "
        "criteria can do without limits, as the paper's outcome has it; the frequency, "
        f"{sway.frequency:g} Hz, is not printed either.",
        "Torques and states are ideal here: no joint friction, no delay, no estimation of contact "
        "forces, gains of our own.",
        "The null space of Eq. (20) is weighted with the inertia; with the Moore-Penrose inverse "
        "that the paper prints, light joints take everything.",
    )


def _quantity(value: float, unit: str) -> str:
    shown, factor = shown_unit(unit)
    return f"{value * factor:.3g} {shown}" if math.isfinite(value) else "–"


def _mm(value: float, *, sign: bool = False) -> str:
    return "–" if not math.isfinite(value) else f"{value:{'+' if sign else ''}.1f} mm"
