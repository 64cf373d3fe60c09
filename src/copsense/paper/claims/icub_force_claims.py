"""Checks of the claims on the iCub's masses, its vertical forces and how far its CoM may go."""

from __future__ import annotations

import numpy as np

from copsense.paper.claims import force_claims
from copsense.paper.claims.icub_sweep import SHORT, TORQUE, WRENCH, LateralSweep
from copsense.paper.claims.verdict import Claim, Finding, claim, judge
from copsense.paper.closed_form.between_feet import LEFT, NEARLY, RIGHT

_ABOUT = 0.1  # "about", "in general": within a tenth


@claim(
    "icub-equal-legs",
    "Hypothesis 1-ii",
    "On the iCub the left leg weighs as much as the right leg.",
)
def equal_legs(sweep: LateralSweep) -> Finding:
    """Hypothesis 1-ii."""
    left, right = sweep.leg_masses
    return Finding(
        judge(abs(left / right - 1) < NEARLY),
        left / right,
        "1",
        f"mass of the left leg, hip to sole, {left:.3f} kg, over the right's, {right:.3f} kg "
        f"(tolerance {NEARLY})",
    )


@claim("icub-body-mass", "Hypothesis 1-iii", "On the iCub the upper body weighs twice a leg.")
def body_mass(sweep: LateralSweep) -> Finding:
    """Hypothesis 1-iii."""
    leg, body = sum(sweep.leg_masses) / 2, sweep.body_mass
    kappa = (leg + body) / (2 * leg + body)
    return Finding(
        judge(abs(body / leg / 2 - 1) < _ABOUT),
        body / leg,
        "1",
        f"mass of all but the legs, {body:.2f} kg, over a leg's, {leg:.2f} kg (claimed 2, "
        f"tolerance a tenth); kappa = {kappa:.3f} instead of 3/4",
    )


@claim("icub-hip-height", "Section V", "The iCub's hips are about 50 cm high.")
def hip_height(sweep: LateralSweep) -> Finding:
    """The comparison of sizes that Section V makes."""
    return Finding(
        judge(abs(sweep.hip_height / 0.5 - 1) < NEARLY),
        sweep.hip_height,
        "m",
        f"height of the hip roll axes over the feet's frames (claimed 0.5, tolerance {NEARLY})",
    )


@claim(
    "icub-half-weight",
    "Section V, Fig. 6a",
    "Criterion 1: the vertical forces change little from half the weight.",
)
def half_weight(sweep: LateralSweep) -> Finding:
    """Fig. 6a."""

    def departure(name: str) -> float:
        return float(np.abs(sweep.series[name].load - 0.5).max())

    own, other = departure(WRENCH), departure(SHORT)
    return Finding(
        judge(own < NEARLY and other < NEARLY, own < NEARLY),
        own,
        "m g",
        f"largest departure of f_z from m g / 2 between the feet, L = 1 m (tolerance {NEARLY})",
        f"d << 2 L; with L = d/2 it is {other:.3f} m g",
    )


@claim(
    "icub-mirrored",
    "Section V",
    "Criterion 1: towards the right foot the forces behave as towards the left.",
)
def mirrored(sweep: LateralSweep) -> Finding:
    """The text on Fig. 6a; the robot's own asymmetry is what is left."""
    load = sweep.series[WRENCH].load
    mirror = np.interp(-sweep.com_y, sweep.com_y, load[:, RIGHT])
    difference = float(np.abs(load[:, LEFT] - mirror).max())
    return Finding(
        judge(difference < NEARLY * float(np.ptp(load[:, LEFT]))),
        difference,
        "m g",
        "largest difference of the left foot's f_z and the right foot's with the CoM mirrored "
        f"(tolerance: {NEARLY} of its swing)",
    )


@claim(
    "icub-forces-vary",
    "Section V, Fig. 6b",
    "Criterion 2: the vertical forces depend on the position of the CoM.",
)
def forces_vary(sweep: LateralSweep) -> Finding:
    """Fig. 6b."""
    own, other = (float(np.ptp(sweep.series[n].load[:, LEFT])) for n in (TORQUE, WRENCH))
    return Finding(
        judge(own > 10 * other),
        own,
        "m g",
        f"swing of f_z between the feet, criterion 2; under criterion 1 it is {other:.4f} m g (ten "
        "times as much counts as varying)",
    )


@claim(
    "icub-over-the-foot",
    "Section V",
    "The robot moves to where its CoM lies over the origin of a foot's frame.",
)
def over_the_foot(sweep: LateralSweep) -> Finding:
    """Whether the motion that Section V describes keeps the feet flat without limits."""
    reach = {name: sweep.planted(name) for name in (WRENCH, TORQUE)}
    best = max(reach.values())
    # All the load on the foot under the CoM puts its CoP at its origin: the sole must contain that.
    feasible = min(
        sweep.at(sweep.series[WRENCH].margin[:, k], 0.0) for k in (LEFT, RIGHT)
    )  # criterion 1's CoPs are at the origins there
    return Finding(
        judge(sweep.reaches_foot(best), feasible > 0),
        best,
        "m",
        f"farthest the CoM goes with both CoPs in their soles: {reach[TORQUE] * 1e3:.1f} mm under "
        f"criterion 2, {reach[WRENCH] * 1e3:.1f} mm under criterion 1; the foot's origin is at "
        f"{sweep.half * 1e3:.0f} mm",
        "the CoPs are kept in the soles by limits (Remark 4), as shifting the load to that foot "
        "would",
    )


@claim(
    "icub-full-period",
    "Section V",
    "One amplitude: criterion 2 tracks a full period of the CoM's sine, criterion 1 does not.",
)
def full_period(sweep: LateralSweep) -> Finding:
    """The static part of what the experiment met; the amplitude is not printed."""
    first, second = sweep.planted(WRENCH), sweep.planted(TORQUE)
    both = [name for name in (WRENCH, TORQUE) if sweep.reaches_foot(sweep.planted(name))]
    kept = f"{' and '.join(both) or 'neither'} keeps"
    return Finding(
        judge(
            sweep.reaches_foot(second) and not sweep.reaches_foot(first),
            second > first * (1 + NEARLY),
        ),
        second,
        "m",
        "amplitude up to which criterion 2 keeps both CoPs in the soles; criterion 1 up to "
        f"{first * 1e3:.1f} mm",
        "the amplitude, which is not printed, lies between the two; with the CoM over a foot, "
        f"{sweep.half * 1e3:.0f} mm, {kept} them there",
    )


@force_claims.tends_to_zero.again("icub-tends-to-zero")
def tends_to_zero(sweep: LateralSweep) -> Finding:
    """The conclusion's last property."""
    load = sweep.series[TORQUE].load[:, RIGHT]
    falls = bool(np.all(np.diff(load) < 0))
    left = sweep.over_foot(sweep.series[TORQUE].load)[1]
    # f_z is nearly affine in the CoM: extrapolate with the sweep's last stretch.
    rate = (sweep.at(load, sweep.half) - sweep.at(load, sweep.half / 2)) / (sweep.half / 2)
    zero = sweep.half - left / rate if rate < 0 else np.finfo(float).max
    return Finding(
        judge(falls and left < NEARLY, falls and zero < 3 * sweep.half),
        left,
        "m g",
        "f_z on the opposite foot with the CoM over the left one, falling all the way (claimed to "
        f"tend to 0, tolerance {NEARLY})",
        "the CoM continues beyond the foot; extrapolated linearly f_z vanishes at "
        f"{zero * 1e3:.0f} mm, the foot being at {sweep.half * 1e3:.0f} mm",
    )


ICUB_FORCE_CLAIMS: tuple[Claim[LateralSweep], ...] = (
    equal_legs,
    body_mass,
    hip_height,
    half_weight,
    mirrored,
    forces_vary,
    over_the_foot,
    full_period,
    tends_to_zero,
)
