"""report_figures: the figures of the report, with what is said of each."""

from __future__ import annotations

import numpy as np

from copsense.criterion import minimum_torque, minimum_wrench
from copsense.paper.claims.icub_sweep import TORQUE, WRENCH
from copsense.paper.report.closed_loop_section import sway_figures
from copsense.paper.report.paper_plots import (
    plot_criteria_curves,
    plot_figure_3,
    plot_figure_9a,
    plot_figure_9b,
    plot_leaning_robot,
    plot_unit_of_length,
)
from copsense.paper.report.real_section import real_figures
from copsense.paper.report.report_scenes import lateral_run
from copsense.paper.reproduce import Reproduction
from copsense.plots import (
    plot_cop,
    plot_limited,
    plot_load,
    plot_regions,
    plot_results,
    plot_sensitivity,
    plot_soles,
    plot_torques,
)
from copsense.plots.style import Figure, whole_figure
from copsense.reports import ReportFigure
from copsense.sensitivity import cop_sensitivity
from copsense.statics import ActiveSetChange
from copsense.sweeps import Sweep

_CEILING = 30.0  # mm/deg: Fig. 5 has a pole


def report_figures(reproduction: Reproduction) -> tuple[ReportFigure, ...]:
    """The figures, in the report's order; nothing is drawn until asked."""
    return (
        *_overview(reproduction),
        *_four_bar(reproduction),
        *_icub(reproduction),
        *_beyond(reproduction),
        *_limits(reproduction),
        *(sway_figures(reproduction.sway, reproduction.sway_claims) if reproduction.sway else ()),
        *real_figures(reproduction.real),
    )


def _overview(reproduction: Reproduction) -> tuple[ReportFigure, ...]:
    both, facts = paper_criteria(reproduction), reproduction.sweep_facts
    first, second = (facts.planted(name) * 1e3 for name in (WRENCH, TORQUE))
    return (
        ReportFigure(
            "overview",
            "overview",
            "The iCub leaning from foot to foot.",
            "Top left: where the CoPs go on the soles, seen from above. Top right: each foot's CoP "
            "against the CoM, the soles as grey bands between their edges; a line is dotted where "
            f"the CoP is off its sole, beyond ±{first:.1f} mm of CoM travel under minimum wrench "
            f"and ±{second:.1f} mm under minimum torque. Bottom left: who carries the weight. "
            "Bottom right: how far the CoM may still go before the first foot tips, to first "
            "order; it vanishes where a dotted line begins.",
            "Four panels: CoP tracks on the two soles from above; CoP of each foot against CoM y "
            "between the sole's edges; load share of each foot; CoM travel left until a foot tips.",
            lambda: plot_results(both),
            shape="wide",
        ),
        ReportFigure(
            "robot",
            "overview",
            "The robot in the middle of the path and at its ends, from behind.",
            "Lines join the joints; a cross is the CoM, a ring its projection on the ground, dots "
            "the CoP of each foot: orange under minimum wrench, blue under minimum torque.",
            "Three stick figures of the iCub from behind: the CoM over the right foot, between the "
            "feet and over the left one, with the CoPs of both criteria on the soles.",
            lambda: _draw_robot(reproduction),
            shape="wide",
        ),
    )


def _draw_robot(reproduction: Reproduction) -> Figure:
    run = lateral_run(reproduction)
    stances = [run.at(row) for row in (0, len(run) // 2, len(run) - 1)]
    criteria = minimum_wrench(1.0), minimum_torque()
    return plot_leaning_robot([[cop_sensitivity(s, c) for c in criteria] for s in stances])


def _four_bar(reproduction: Reproduction) -> tuple[ReportFigure, ...]:
    three_a, three_b, four, five = reproduction.four_bar_figures
    found = {c.claim.identifier: c for c in reproduction.four_bar_claims}
    unloads, over = found["diverges-at-14-deg"].number, found["whole-weight"].number
    together = found["cops-follow-com"].number
    return (
        ReportFigure(
            "figure_3a",
            "four-bar",
            "Fig. 3a, four-bar, minimum wrench (L = 1 m).",
            "Both CoPs, each from its own foot, move with the CoM: between the feet their slopes "
            f"are within {together:.1%} of its own.",
            "Left CoP, right CoP and CoM against the leg angle: three nearly equal straight lines.",
            lambda: whole_figure(plot_figure_3(three_a, WRENCH)),
        ),
        ReportFigure(
            "figure_3b",
            "four-bar",
            "Fig. 3b, four-bar, minimum torque.",
            f"Flat on the loaded foot, divergent on the other, which unloads at ±{unloads:.1f}° "
            "(the paper's text says 14°; dashed verticals).",
            "Left and right CoP against the leg angle: each is flat on one side and diverges on "
            "the other, at about 22 degrees.",
            lambda: whole_figure(plot_figure_3(three_b, TORQUE)),
        ),
        ReportFigure(
            "figure_4",
            "four-bar",
            "Fig. 4, four-bar, vertical force on the right foot.",
            "Nearly constant under minimum wrench; under minimum torque it follows the CoM, and is "
            f"{over:.2f} m g, not m g, where the CoM is over the foot.",
            "Load of the right foot against the leg angle: constant at one half for minimum "
            "wrench, rising from below zero to above one for minimum torque.",
            lambda: whole_figure(plot_criteria_curves(four, "load of the right foot, $f_y/(m g)$")),
        ),
        ReportFigure(
            "figure_5",
            "four-bar",
            "Fig. 5, four-bar, norm of the right foot's sensitivity.",
            "Half as large under minimum torque at the centre, and falling as the foot takes the "
            "load; larger, without bound, as it gives the load away (cut at "
            f"{_CEILING:g} mm/deg).",
            "Norm of the sensitivity against the leg angle: flat for minimum wrench; for minimum "
            "torque falling from a pole on the left to near zero on the right.",
            lambda: whole_figure(
                plot_criteria_curves(five, r"$|\eta|$ of the right foot", ceiling=_CEILING)
            ),
        ),
    )


def _icub(reproduction: Reproduction) -> tuple[ReportFigure, ...]:
    lateral, facts = reproduction.lateral, reproduction.sweep_facts
    both, (three_a, three_b) = paper_criteria(reproduction), reproduction.four_bar_figures[:2]
    y = lateral["com_y"].values
    wrench, torque = lateral.subset([WRENCH]), lateral.subset([TORQUE])
    left, right = (
        wrench.subset(postures=np.flatnonzero(side * y >= -1e-9).tolist()) for side in (1, -1)
    )
    loaded, other = facts.over_foot(facts.series[TORQUE].load)
    own, far = (abs(value) * 1e3 for value in facts.over_foot(facts.series[TORQUE].cop))
    slopes = facts.series[WRENCH].slope
    leaves = facts.planted(WRENCH) * 1e3
    reach = float(np.abs(facts.hip_roll).max())

    def figure_9a() -> Figure:
        beside = plot_figure_9b(both, three_a, three_b)
        ax = plot_figure_9a(three_a, three_b, reach)
        ax.set_ylim(beside.get_ylim())
        return whole_figure(ax)

    return (
        ReportFigure(
            "figure_6a",
            "icub",
            "Fig. 6a, iCub, minimum wrench, CoM towards the left foot.",
            "The vertical forces hardly leave half the weight: "
            f"{facts.over_foot(facts.series[WRENCH].load)[0]:.3f} m g on the foot under the CoM.",
            "Load share of both feet against CoM y: two lines at one half.",
            lambda: whole_figure(plot_load(left)),
        ),
        ReportFigure(
            "figure_6b",
            "icub",
            "Fig. 6b, iCub, minimum torque, CoM from foot to foot.",
            f"The forces follow the CoM: {loaded:.3f} m g on the foot under it, {other:.3f} m g on "
            "the other. A full period of the sine goes there and back along these lines.",
            "Load share of both feet against CoM y: two lines that cross at one half.",
            lambda: whole_figure(plot_load(torque)),
        ),
        ReportFigure(
            "figure_7a",
            "icub",
            "Fig. 7a, iCub, minimum wrench, CoM towards the left foot.",
            f"Two parallel lines, {slopes.min():.3f} to {slopes.max():.3f} metres per metre of CoM "
            "travel. The right foot's CoP leaves its sole at "
            f"{leaves:.1f} mm, long before the CoM is over the left foot.",
            "CoP y of both feet against CoM y, moving in parallel; both leave the grey bands that "
            "are the soles.",
            lambda: whole_figure(plot_cop(left)),
        ),
        ReportFigure(
            "figure_7b",
            "icub",
            "Fig. 7b, iCub, minimum wrench, CoM towards the right foot.",
            "The mirror image: the two CoPs move in parallel whichever foot is nearer to the CoM.",
            "CoP y of both feet against CoM y to the right, moving in parallel.",
            lambda: whole_figure(plot_cop(right)),
        ),
        ReportFigure(
            "figure_8",
            "icub",
            "Fig. 8, iCub, minimum torque, CoM from foot to foot.",
            f"The loaded foot's CoP moves {own:.1f} mm from the centre to the end, the other's "
            f"{far:.1f} mm, and it is this one that leaves its sole. Against Fig. 7: flatter about "
            "the centre and on the loaded foot, steeper where a foot gives its load away.",
            "CoP y of both feet against CoM y: each flattens where its foot is loaded and steepens "
            "where it is not.",
            lambda: whole_figure(plot_cop(torque)),
            shape="alone",
        ),
        ReportFigure(
            "figure_9a",
            "icub",
            "Fig. 9a, four-bar, CoP of the left foot.",
            "Both criteria against the leg angle, over the angles that the iCub's hip goes "
            "through; signs as on the iCub (positive to the left).",
            "Left CoP against the leg angle: a straight line for minimum wrench, a bent one for "
            "minimum torque.",
            figure_9a,
        ),
        ReportFigure(
            "figure_9b",
            "icub",
            "Fig. 9b, iCub, CoP of the left foot.",
            "Both criteria against the left hip roll joint on the CoM's lateral path, the "
            "four-bar's curves dashed beneath, the edges of the sole dotted.",
            "Left CoP against hip roll: nearly the same lines as on the four-bar, steeper at the "
            "end under minimum torque.",
            lambda: whole_figure(plot_figure_9b(both, three_a, three_b)),
        ),
    )


def _beyond(reproduction: Reproduction) -> tuple[ReportFigure, ...]:
    both, unit = paper_criteria(reproduction), reproduction.unit_of_length
    found = {c.claim.identifier: c for c in reproduction.icub_claims}
    crossing = found["icub-lower-sensitivity"].number * 1e3
    return (
        ReportFigure(
            "sensitivity",
            "beyond",
            "The sensitivity itself, iCub.",
            "Left: per metre of CoM travel along the sweep. Right: the gain, free of any choice of "
            "path or coordinate: metres of CoP per metre of CoM in the motion of least kinetic "
            f"energy. Beyond ±{crossing:.1f} mm (left) the unloading foot is the more sensitive "
            "one under minimum torque.",
            "Slope and gain of each foot's CoP against CoM y: constant near one for minimum "
            "wrench; between 0.1 and 2.5 for minimum torque.",
            lambda: plot_sensitivity(both),
            shape="wide",
        ),
        ReportFigure(
            "soles",
            "beyond",
            "From above, iCub.",
            "Where each CoP is, coloured by where the CoM is. Under minimum torque the CoPs also "
            "move fore and aft, which the planar four-bar cannot show.",
            "CoP tracks on the two soles from above, one panel per criterion.",
            lambda: plot_soles(both),
            shape="wide",
        ),
        ReportFigure(
            "unit_of_length",
            "beyond",
            "Criterion 1 depends on the unit of length.",
            "The CoP's slope at the centre under minimum wrench, for moments divided by L before "
            "they are added to forces; it goes from 0 to 1. With L = d/2 = "
            f"{unit.distance / 2:g} m it equals minimum torque's.",
            "Slope at the centre against L on a logarithmic axis: an S-shaped curve from 0 to 1 "
            "that crosses minimum torque's line at L = d/2; the iCub's points lie on the closed "
            "form.",
            lambda: whole_figure(plot_unit_of_length(unit)),
            shape="alone",
        ),
        ReportFigure(
            "torques",
            "beyond",
            "What the joints pay, iCub.",
            "Left: norm of the joint torques along the sweep. Right: the range of each joint's "
            "torque. Minimum wrench has the ankles' roll carry what minimum torque shares between "
            "ankles and hips.",
            "Norm of the torques against CoM y, and the range of each of the 23 joints' torques as "
            "bars, for both criteria.",
            lambda: plot_torques(both),
            shape="wide",
        ),
    )


def _limits(reproduction: Reproduction) -> tuple[ReportFigure, ...]:
    within = reproduction.within_limits
    binding: dict[str, list[float]] = {}
    for found in within.bindings:
        binding.setdefault(found.criterion, []).append(found.value)
    areas = {name: f"{region.area * 1e4:.0f} cm²" for name, region in within.regions.items()}
    torques = areas.get("and torque limits")
    return (
        ReportFigure(
            "limits",
            "limits",
            "Within limits, iCub.",
            _binding_words(within.bindings),
            "CoP y of both feet against CoM y, flat at the soles' edges; slopes with jumps where "
            "the limits bind.",
            lambda: plot_limited(within.lateral, binding),
            shape="wide",
        ),
        ReportFigure(
            "regions",
            "limits",
            "Where the CoM may be, iCub.",
            "Nested: where friction and soles allow an equilibrium "
            f"({areas['friction and soles']}), "
            + (f"where the motors do too ({torques}), " if torques else "")
            + "and where each criterion's own wrenches stay within the limits without being "
            f"clipped ({areas[WRENCH]} under minimum wrench, {areas[TORQUE]} under minimum "
            "torque). The joints' posture is held while the weight's line of action moves; a robot "
            "that leans by itself follows the dashed path, and meets its first limit where the "
            "table says.",
            "Nested polygons over the two soles from above: the widest for friction and soles, the "
            "smallest for the criteria's own.",
            lambda: whole_figure(plot_regions(within.regions, paper_criteria(reproduction))),
            shape="alone",
        ),
    )


def _binding_words(bindings: tuple[ActiveSetChange, ...]) -> str:
    """Where the first limit binds, and what happens there."""
    if not bindings:
        return "No other set of limits presses within reach."
    first: dict[str, ActiveSetChange] = {}
    for found in sorted(bindings, key=lambda b: b.travel):
        first.setdefault(found.criterion, found)
    said = " and ".join(f"{b.travel * 1e3:.1f} mm under {name}" for name, b in first.items())
    if not all(b.binds for b in bindings):
        return (
            "Some limits press with the CoM in the middle already. The first change of them comes "
            f"at a CoM travel of {said} (right: verticals)."
        )
    words = f"The first limit binds at a CoM travel of {said} (right: verticals)"
    if all("CoP" in b.name for b in bindings):
        return (
            f"{words}: there the CoP stops at the sole's edge (left), its slope falls to nearly "
            "zero and the other foot's jumps up, because it has to carry what the first no longer "
            "can."
        )
    return f"{words}: there the slopes may jump, for the other foot carries what one no longer can."


def paper_criteria(reproduction: Reproduction) -> Sweep:
    """The lateral sweep under the paper's two criteria."""
    return reproduction.lateral.subset([WRENCH, TORQUE])
