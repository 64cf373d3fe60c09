"""The claims on CoPs and their sensitivity: Figs. 3 and 5, Remark 1, the conclusion."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from copsense.paper.claims.verdict import Claim, Finding, claim, judge
from copsense.paper.closed_form.between_feet import (
    LEFT,
    NEARLY,
    PAPER_LENGTH,
    PARTS,
    RIGHT,
    between_feet,
    by_torque,
    by_wrench,
)
from copsense.paper.closed_form.dimensions import FourBar
from copsense.paper.closed_form.discrepancy import EXACT
from copsense.paper.closed_form.four_bar_criteria import solve_four_bar


@claim(
    "cops-follow-com", "Fig. 3a", "Under criterion 1 both feet's CoPs move together with the CoM."
)
def _cops_follow_com(four_bar: FourBar) -> Finding:
    def departure(length: float) -> float:
        # both feet at once
        return float(
            between_feet(
                four_bar,
                lambda u: float(np.abs(by_wrench(four_bar, u, length).cop_per_com - 1.0).max()),
            ).max()
        )

    own, other = departure(PAPER_LENGTH), departure(four_bar.rod_length / 2)
    return Finding(
        judge(own < NEARLY and other < NEARLY, own < NEARLY),
        own,
        "1",
        f"largest |dCoP/dCoM - 1| on either foot between the feet, L = 1 m (tolerance {NEARLY})",
        f"d << 2 L; with L = d/2 it is {other:.2f}",
    )


def _less_sensitive(four_bar: FourBar, ratio: Callable[[float], float], place: str) -> Finding:
    """Judge a ratio of the criteria's sensitivities, a function of criterion 1's length."""
    own, other = ratio(PAPER_LENGTH), ratio(four_bar.rod_length / 4)
    return Finding(
        judge(own < 1 - EXACT and other < 1 - EXACT, own < 1 - EXACT),
        own,
        "1",
        f"sensitivity under criterion 2 over criterion 1 with L = 1 m, {place} (below 1 is less)",
        f"d < 2 L; with L = d/4 it is {other:.2f}",
    )


@claim(
    "flat-at-centre",
    "Fig. 3b, Fig. 5",
    "Criterion 2 is flatter, so less sensitive, around the centre (Delta xi = 0).",
)
def _flat_at_centre(four_bar: FourBar) -> Finding:
    def ratio(length: float) -> float:
        return float(
            by_torque(four_bar, 0.0).cop_per_com[0]
            / by_wrench(four_bar, 0.0, length).cop_per_com[0]
        )

    return _less_sensitive(four_bar, ratio, "at the centre")


@claim("flat-on-support", "Fig. 3b", "Criterion 2 is flatter on the support foot.")
def _flat_on_support(four_bar: FourBar) -> Finding:
    def ratio(length: float) -> float:
        # (1 - a2) (d + 2 a1 u)² / ((1 - a1) (d + 2 a2 u)²) is monotone in u: its supremum is at an
        # end, the centre or the CoM over the foot
        return max(
            float(
                by_torque(four_bar, u).cop_per_com[RIGHT]
                / by_wrench(four_bar, u, length).cop_per_com[RIGHT]
            )
            for u in (0.0, four_bar.rod_length / 2)
        )

    return _less_sensitive(four_bar, ratio, "supremum on the loaded foot between the feet")


@claim(
    "sensitivity-decreases",
    "Section IV-B, Fig. 5",
    "Criterion 2: the sensitivity decreases as the foot supports more of the weight.",
)
def _sensitivity_decreases(four_bar: FourBar) -> Finding:
    # Delta xi > 0 brings the CoM towards the right foot: xi = pi/2 - Delta xi
    norms = np.array(
        [
            abs(solve_four_bar(four_bar, math.pi / 2 - a, "minimum-torque").sensitivity[RIGHT])
            for a in np.radians(np.linspace(0.0, 14.0, 57))
        ]
    )
    return Finding(
        judge(np.all(np.diff(norms) < 0)),
        norms[-1] / norms[0],
        "1",
        "|eta_R| at Delta xi = 14 deg over its value at 0, criterion 2; it must fall at every step",
    )


@claim(
    "smaller-variation", "Remark 1", "Lower sensitivity goes with smaller variations of the CoPs."
)
def _smaller_variation(four_bar: FourBar) -> Finding:
    half = four_bar.rod_length / 2
    torque, wrench = by_torque(four_bar, half), by_wrench(four_bar, half)
    left, right = torque.cop / wrench.cop
    return Finding(
        judge(max(left, right) < 1 - EXACT, right < 1 - EXACT),
        right,
        "1",
        "CoP travel of the loaded foot under criterion 2 over criterion 1, the CoM going from the "
        f"centre to above a foot; of the unloaded foot {left:.3f}, as every share takes it "
        f"{torque.cop[LEFT] / four_bar.rod_length:.2f} d",
        "the loaded foot",
    )


@claim(
    "lower-sensitivity",
    "Section IV, Section VI",
    "Minimising the joint torques gives a lower sensitivity than minimising the wrenches.",
)
def lower_sensitivity(four_bar: FourBar) -> Finding:
    """Foot by foot, with the CoM between the feet."""
    d, own = four_bar.rod_length, by_torque(four_bar, 0.0).share
    other = by_wrench(four_bar, 0.0).share
    # (1 - a2) d² / (d - 2 a2 u)² = (1 - a1) d² / (d - 2 a1 u)², a root in u
    root = math.sqrt((1 - other) / (1 - own))
    # ... and none away from the centre once d >= 2 L, where a1 >= a2
    crossing = (root - 1) / (2 * own * root - 2 * other) if other < own else 0.0
    excess = between_feet(
        four_bar,
        lambda u: float(
            (by_torque(four_bar, u).cop_per_com / by_wrench(four_bar, u).cop_per_com).max()
        ),
    )
    centre = excess[PARTS.size // 2]
    angle = math.degrees(math.pi / 2 - four_bar.angle_at(crossing * d))
    return Finding(
        judge(np.all(excess < 1 - EXACT), centre < 1 - EXACT),
        crossing,
        "d",
        "CoM travel beyond which the unloaded foot is the more sensitive one under criterion 2; "
        f"with the CoM over a foot (0.5 d) it is {excess[-1]:.2f} times as sensitive as under "
        f"criterion 1, at the centre {centre:.3f} times",
        f"d < 2 L, and the CoM within {crossing:.3f} d of the centre ({angle:.1f} deg) or the "
        "loaded foot only",
    )


COP_CLAIMS: tuple[Claim[FourBar], ...] = (
    _cops_follow_com,
    _flat_at_centre,
    _flat_on_support,
    _sensitivity_decreases,
    _smaller_variation,
    lower_sensitivity,
)
