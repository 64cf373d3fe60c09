"""Section V's claims, judged by the robot in closed loop.

"Loaded" is the foot on whose side the CoM is. The paper's robot was real; this one is simulated.
"""

from __future__ import annotations

import numpy as np

from copsense.paper.claims import icub_cop_claims, icub_force_claims
from copsense.paper.claims.sway_runs import Stretch, Sway
from copsense.paper.claims.verdict import Claim, Finding, claim, judge
from copsense.paper.closed_form.between_feet import LEFT, NEARLY, RIGHT

_TRACKED = 1e-4  # m rms: "tracks"
_QUASI_STATIC = 1e-3  # m


@icub_force_claims.half_weight.again("loop-half-weight")
def _half_weight(sway: Sway) -> Finding:
    """Fig. 6a."""
    departure = max(float(np.abs(s.load - 0.5).max()) for s in sway.wrench_stretches)
    return Finding(
        judge(departure < NEARLY),
        departure,
        "m g",
        "largest departure of a measured f_z from m g / 2 until a foot tips, to either side "
        f"(tolerance {NEARLY})",
    )


@icub_force_claims.forces_vary.again("loop-forces-vary")
def _forces_vary(sway: Sway) -> Finding:
    """Fig. 6b."""
    load = sway.torque_stretch.load[:, LEFT]
    own = float(np.ptp(load))
    other = max(float(np.ptp(s.load[:, LEFT])) for s in sway.wrench_stretches)
    return Finding(
        judge(own > 10 * other, own > 2 * other),
        own,
        "m g",
        f"swing of the left foot's measured f_z, from {load.min():.3f} to {load.max():.3f} m g; "
        f"under criterion 1 it is {other:.4f} m g (ten times as much counts as varying)",
        "twice as much counts as varying",
    )


@icub_force_claims.full_period.again("loop-full-period")
def _full_period(sway: Sway) -> Finding:
    """The experiment's outcome."""
    error = sway.torque.tracking_error
    tips = [run.tip_travel * 1e3 for run in (sway.left, sway.right)]
    ends = [run.attrs["tip_contact"] or "no foot" for run in (sway.left, sway.right)]
    tracked = sway.torque.completed and error < _TRACKED
    return Finding(
        judge(tracked and not any(run.completed for run in (sway.left, sway.right))),
        error,
        "m",
        "rms of criterion 2's CoM y error over a full period "
        f"({'completed' if sway.torque.completed else sway.torque.attrs['end_reason']}; tolerance "
        f"{_TRACKED * 1e3:g} mm); under criterion 1 {ends[0]} tips with the CoM at {tips[0]:+.1f} "
        f"mm, and {ends[1]} at {tips[1]:+.1f} mm where it starts to the other side",
    )


@icub_cop_claims.parallel.again("loop-parallel")
def _parallel(sway: Sway) -> Finding:
    """Fig. 7."""

    def spread(found: Stretch) -> float:
        return float(np.ptp(found.cop[:, LEFT] - found.cop[:, RIGHT]) / np.ptp(found.com_y))

    spreads = [spread(s) for s in sway.wrench_stretches]
    slopes = np.array([s.slopes for s in sway.wrench_stretches])
    return Finding(
        judge(max(spreads) < NEARLY),
        max(spreads),
        "1",
        "largest change of the distance between the two measured CoPs, each from its own foot, in "
        f"parts of the CoM's travel (tolerance {NEARLY}); their dCoP/dCoM are "
        f"{slopes.min():.3f} to {slopes.max():.3f}, under criterion 2 the distance changes by "
        f"{spread(sway.torque_stretch):.2f}",
    )


@icub_cop_claims.less_on_support.again("loop-less-on-support")
def _less_on_support(sway: Sway) -> Finding:
    """Fig. 8."""
    found = sway.torque_stretch
    ratios = []
    for side, (loaded, other) in ((1.0, (LEFT, RIGHT)), (-1.0, (RIGHT, LEFT))):
        there = int(np.argmax(side * found.com_y))
        centre = int(np.argmin(np.abs(found.com_y)))
        travel = np.abs(found.cop[there] - found.cop[centre])
        if side * found.com_y[there] > 0.5 * sway.amplitude:
            ratios.append(float(travel[loaded] / travel[other]))
    if not ratios:
        return Finding(judge(False), 1.0, "1", "the CoM never came near a foot")
    return Finding(
        judge(max(ratios) < 1 - NEARLY),
        max(ratios),
        "1",
        "measured travel of the loaded foot's CoP over the other's, from the centre to the end of "
        f"the sway, the worse side (less than one by more than {NEARLY})",
    )


@claim(
    "loop-quasi-static",
    "Section V, Fig. 9",
    "The motion is slow enough for the static analysis to stand for it.",
)
def _quasi_static(sway: Sway) -> Finding:
    """Whether what is measured is what the static analysis says at the same CoM."""

    def departure(found: Stretch) -> float:
        return float(np.nanmax(np.abs(found.cop - found.static_cop)))

    worst = max(departure(s) for s in (*sway.wrench_stretches, sway.torque_stretch))
    return Finding(
        judge(worst < _QUASI_STATIC),
        worst,
        "m",
        "largest distance of a measured CoP from the static one at the same CoM, both criteria, "
        f"until a foot tips (tolerance {_QUASI_STATIC * 1e3:g} mm)",
    )


@claim(
    "loop-limits",
    "Remark 4",
    "Inequalities on the wrenches limit the value of the CoP: the two concepts are complementary.",
)
def _limits(sway: Sway) -> Finding:
    """Remark 4: a sway that tips a foot without inequalities is completed with them."""
    least = min(float(np.nanmin(run["margin"].values[1:])) for run in sway.limited.values())
    ends = [run.completed for run in sway.limited.values()]
    return Finding(
        judge(all(ends) and least > 0),
        least,
        "m",
        "smallest measured margin of a CoP to its sole's edge with limits, the CoM going "
        f"±{sway.limited_amplitude * 1e3:g} mm; {sum(ends)} of {len(ends)} criteria complete the "
        "period with both feet flat",
    )


SWAY_CLAIMS: tuple[Claim[Sway], ...] = (
    _half_weight,
    _forces_vary,
    _full_period,
    _parallel,
    _less_on_support,
    _quasi_static,
    _limits,
)
