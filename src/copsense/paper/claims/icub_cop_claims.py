"""Checks of the claims on the iCub's CoPs and their sensitivity."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from copsense.paper.claims import cop_claims, modelling_claims
from copsense.paper.claims.icub_sweep import SHORT, TORQUE, WRENCH, LateralSweep
from copsense.paper.claims.verdict import Claim, Finding, claim, judge
from copsense.paper.closed_form.between_feet import LEFT, NEARLY, PAPER_LENGTH, RIGHT
from copsense.paper.closed_form.dimensions import FourBar
from copsense.paper.closed_form.discrepancy import EXACT
from copsense.paper.closed_form.four_bar_criteria import solve_four_bar
from copsense.roots import first_zero

_SIMILAR = 0.1  # two curves are similar: within a tenth


@claim(
    "icub-parallel",
    "Section V, Fig. 7",
    "Criterion 1: the two CoPs move almost in parallel, whichever foot is loaded.",
)
def parallel(sweep: LateralSweep) -> Finding:
    """Fig. 7."""

    def spread(name: str) -> float:
        slope = sweep.series[name].slope
        return float(np.abs(slope[:, LEFT] - slope[:, RIGHT]).max())

    own, other = spread(WRENCH), spread(SHORT)
    slopes = sweep.series[WRENCH].slope
    return Finding(
        judge(own < NEARLY and other < NEARLY, own < NEARLY),
        own,
        "1",
        f"largest difference of the two feet's dCoP/dCoM, which go from {slopes.min():.3f} to "
        f"{slopes.max():.3f}, L = 1 m (tolerance {NEARLY})",
        f"d << 2 L; with L = d/2 it is {other:.2f}",
    )


@claim(
    "icub-less-on-support",
    "Section V, Fig. 8",
    "Criterion 2: the loaded foot's CoP moves less than the other one.",
)
def less_on_support(sweep: LateralSweep) -> Finding:
    """Fig. 8: both as travel and at every posture off the centre."""
    slope, y = sweep.series[TORQUE].slope, sweep.com_y
    step = float(np.diff(y).max())
    loaded = np.where(y > 0, slope[:, LEFT], slope[:, RIGHT])
    other = np.where(y > 0, slope[:, RIGHT], slope[:, LEFT])
    off_centre = np.abs(y) > step / 2
    cop = sweep.series[TORQUE].cop
    own, far = np.abs(sweep.over_foot(cop - [sweep.at(c, 0.0) for c in cop.T]))
    return Finding(
        judge(np.all((loaded < other)[off_centre]) and own / far < 1 - NEARLY),
        own / far,
        "1",
        f"travel of the loaded foot's CoP, {own * 1e3:.1f} mm, over the other's, {far * 1e3:.1f} "
        "mm, the CoM going from the centre to over the left foot (less by more than "
        f"{NEARLY}); and it must move less at every posture",
    )


@claim(
    "icub-hip-roll", "Remark 5", "The left hip roll joint can stand for the four-bar's coordinate."
)
def hip_roll_coordinate(sweep: LateralSweep) -> Finding:
    """Remark 5: along this path the joint goes one way, and nearly in proportion to the CoM."""
    monotone = bool(np.all(np.diff(sweep.hip_roll) < 0))
    change = float(np.ptp(sweep.hip_rate) / np.abs(sweep.hip_rate).mean())
    return Finding(
        judge(monotone and change < NEARLY, monotone),
        change,
        "1",
        f"change of d hip roll / d CoM y between the feet, in parts of its mean, "
        f"{sweep.hip_rate.mean():.3f} rad/m (tolerance {NEARLY}); it must keep its sign",
    )


@claim(
    "icub-similar",
    "Remark 5, Fig. 9",
    "The left foot's CoP against hip roll is similar on the four-bar and on the iCub.",
)
def similar(sweep: LateralSweep) -> Finding:
    """Fig. 9: the same joint angle from the centre on both mechanisms."""
    roll = sweep.hip_roll - sweep.at(sweep.hip_roll, 0.0)
    found = {}
    for name in (WRENCH, TORQUE):
        mine = sweep.series[name].cop[:, LEFT]
        theirs = four_bar_left_cop(sweep.four_bar, name, roll)
        difference = np.abs(mine - sweep.at(mine, 0.0) - theirs)
        found[name] = (
            float(difference.max() / np.abs(theirs).max()),
            _centre_slope(sweep, name) / _four_bar_slope(sweep.four_bar, name),
        )
    worst = max(part for part, _ in found.values())
    near = max(abs(ratio - 1) for _, ratio in found.values())
    return Finding(
        judge(worst < _SIMILAR, near < _SIMILAR),
        worst,
        "1",
        "largest difference of the two CoPs at equal hip roll, in parts of the four-bar's largest: "
        f"{found[WRENCH][0]:.3f} under criterion 1, {found[TORQUE][0]:.3f} under criterion 2, on "
        "the unloaded foot with the CoM over the other. Slopes at the centre over the four-bar's: "
        f"{found[WRENCH][1]:.3f} and {found[TORQUE][1]:.3f} (tolerance {_SIMILAR})",
        "near the centre",
    )


@modelling_claims.chart.again("icub-chart")
def chart(sweep: LateralSweep) -> Finding:
    """Remark 2 on the iCub: one posture, one coordinate, two paths."""
    lateral = _centre_slope(sweep, WRENCH)
    return Finding(
        judge(abs(sweep.other_slope / lateral - 1) > NEARLY),
        sweep.other_slope / lateral,
        "1",
        "d CoP y / d l_hip_roll at the centre, criterion 1: "
        f"{sweep.other_slope:.3f} m/rad on a path that sweeps the joint itself, over "
        f"{lateral:.3f} m/rad on the lateral path of the CoM (more than {NEARLY} off 1 depends)",
    )


@cop_claims.lower_sensitivity.again("icub-lower-sensitivity")
def lower_sensitivity(sweep: LateralSweep) -> Finding:
    """The conclusion, foot by foot along the sweep."""
    y = sweep.com_y
    ratio = np.abs(sweep.series[TORQUE].slope / sweep.series[WRENCH].slope)
    short = np.abs(sweep.series[TORQUE].slope / sweep.series[SHORT].slope)
    worst = ratio.max(axis=1)
    crossing = min(first_zero(y, 1 - worst), first_zero(-y[::-1], (1 - worst)[::-1]))
    centre, over = sweep.at(worst, 0.0), max(worst[0], worst[-1])
    loaded = np.where(y > 0, ratio[:, LEFT], ratio[:, RIGHT])
    return Finding(
        judge(np.all(worst < 1 - EXACT), centre < 1 - EXACT and np.all(loaded < 1 - EXACT)),
        crossing,
        "m",
        "CoM travel beyond which the unloaded foot is the more sensitive one under criterion 2, "
        f"{crossing / (2 * sweep.half):.3f} d; with the CoM over a foot it is {over:.2f} times as "
        f"sensitive as under criterion 1, at the centre {centre:.3f} times",
        f"d < 2 L (with L = d/2 the centre's ratio is {sweep.at(short.max(axis=1), 0.0):.2f}), and "
        f"the CoM within {crossing * 1e3:.1f} mm of the centre or the loaded foot only",
    )


def four_bar_left_cop(
    four_bar: FourBar, criterion: str, hip_roll: Float[np.ndarray, " N"]
) -> Float[np.ndarray, " N"]:
    """The four-bar's left CoP, positive to the left, at the hip roll that puts its CoM there [m].

    Positive hip roll moves the CoM to the right on both mechanisms: xi = pi/2 - hip roll.
    """
    own = {"characteristic_length": PAPER_LENGTH} if criterion == WRENCH else {}
    return np.array(
        [-solve_four_bar(four_bar, math.pi / 2 - a, criterion, **own).cop[0] for a in hip_roll]
    )


def _four_bar_slope(four_bar: FourBar, criterion: str) -> float:
    """D left CoP / d hip roll of the four-bar at the centre, as `four_bar_left_cop` [m/rad]."""
    # hip roll = pi/2 - xi and left = -x: the two signs cancel
    return float(solve_four_bar(four_bar, math.pi / 2, criterion).sensitivity[0])


def _centre_slope(sweep: LateralSweep, criterion: str) -> float:
    """D left CoP / d hip roll of the iCub at the centre, along the sweep [m/rad]."""
    return sweep.at(sweep.series[criterion].slope[:, LEFT] / sweep.hip_rate, 0.0)


ICUB_COP_CLAIMS: tuple[Claim[LateralSweep], ...] = (
    parallel,
    less_on_support,
    hip_roll_coordinate,
    similar,
    chart,
    lower_sensitivity,
)
