"""The claims on vertical forces: Section IV-B's text, Fig. 4, and the divergence of Fig. 3b."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from copsense.paper.claims.verdict import Claim, Finding, claim, judge
from copsense.paper.closed_form.between_feet import (
    LEFT,
    NEARLY,
    PAPER_LENGTH,
    RIGHT,
    between_feet,
    by_torque,
    by_wrench,
)
from copsense.paper.closed_form.dimensions import FourBar
from copsense.paper.closed_form.discrepancy import EXACT
from copsense.paper.errata.errata_statements import pole

_DEGREE = 0.5  # an angle printed in whole degrees


def _variation(four_bar: FourBar, length: float) -> float:
    """Largest departure of criterion 1's f_y from m g / 2, in parts of m g."""
    loads = between_feet(
        four_bar, lambda u: float(by_wrench(four_bar, u, length).wrenches[RIGHT, 1])
    )
    return float(np.abs(loads / four_bar.weight - 0.5).max())


@claim(
    "constant-force",
    "Section IV-B, after Eq. (16)",
    "If d is small enough, criterion 1 keeps f_y almost at m g / 2, whatever xi is.",
)
def _constant_force(four_bar: FourBar) -> Finding:
    own = _variation(four_bar, PAPER_LENGTH)
    # With a length that shrinks with d, no d is small enough.
    narrow = [replace(four_bar, rod_length=four_bar.rod_length / n) for n in (1, 10, 100)]
    scaled = max(_variation(linkage, linkage.rod_length / 2) for linkage in narrow)
    return Finding(
        judge(own < NEARLY and scaled < NEARLY, own < NEARLY),
        own,
        "m g",
        f"largest departure of f_y from m g / 2 between the feet, L = 1 m (tolerance {NEARLY})",
        f"d << 2 L; with L = d/2 it is {scaled:.3f} m g however small d is",
    )


@claim(
    "force-varies",
    "Section IV-B, Fig. 4",
    "Unlike criterion 1's, criterion 2's vertical forces vary with xi.",
)
def _force_varies(four_bar: FourBar) -> Finding:
    loads = between_feet(four_bar, lambda u: float(by_torque(four_bar, u).wrenches[RIGHT, 1]))
    swing = float(np.ptp(loads) / four_bar.weight)
    other = 2 * _variation(four_bar, PAPER_LENGTH)
    return Finding(
        judge(swing > 10 * other),
        swing,
        "m g",
        f"swing of f_y between the feet, criterion 2; under criterion 1 it is {other:.4f} m g (ten "
        "times as much counts as varying)",
    )


@claim(
    "whole-weight",
    "Section IV-B, after Eq. (18)",
    "Criterion 2: with the CoM on top of a foot, f_y there is m g.",
)
def _whole_weight(four_bar: FourBar) -> Finding:
    load = by_torque(four_bar, four_bar.rod_length / 2).wrenches[RIGHT, 1] / four_bar.weight
    return Finding(
        judge(abs(load - 1.0) < NEARLY),
        load,
        "m g",
        f"f_y on the foot under the CoM (claimed 1, tolerance {NEARLY})",
    )


@claim(
    "null-force",
    "Section IV-B, after Eq. (18)",
    "Criterion 2: the force on the other foot is then null.",
)
def _null_force(four_bar: FourBar) -> Finding:
    load = by_torque(four_bar, four_bar.rod_length / 2).wrenches[LEFT, 1] / four_bar.weight
    return Finding(
        judge(abs(load) < NEARLY),
        load,
        "m g",
        f"f_y on the other foot with the CoM over one (claimed 0, tolerance {NEARLY})",
    )


@claim(
    "tends-to-zero",
    "Section IV-B, Section VI",
    "Criterion 2: f_y on one foot tends to zero as the CoM moves towards the other foot.",
)
def tends_to_zero(four_bar: FourBar) -> Finding:
    """The load falls all the way; whether it vanishes with the CoM over the other foot."""
    half = four_bar.rod_length / 2
    loads = between_feet(four_bar, lambda u: float(by_torque(four_bar, u).wrenches[LEFT, 1]))
    falls = bool(np.all(np.diff(loads) < 0))
    # f_y is affine in the CoM: extrapolate to where it vanishes.
    zero = half - loads[-1] * 2 * half / (loads[-1] - loads[0])
    return Finding(
        judge(falls and zero < half * (1 + EXACT), falls and zero < 2 * half * (1 + EXACT)),
        zero,
        "m",
        "CoM travel from the centre at which f_y of the opposite foot vanishes; the foot is at "
        f"{half:g} m",
        f"the CoM continues beyond the foot by {zero - half:.3g} m",
    )


@claim(
    "diverges-at-14-deg",
    "Section IV-B, Fig. 3b",
    "Criterion 2's CoPs diverge around Delta xi = ±14 deg.",
)
def _diverges_at_14_deg(four_bar: FourBar) -> Finding:
    angle = math.degrees(pole(four_bar))
    over = [
        math.degrees(math.pi / 2 - linkage.angle_at(linkage.rod_length / 2))
        for linkage in (four_bar, four_bar.with_kappa(0.6))
    ]
    # the pole is where sin(Delta xi) = d / (kappa l)
    needed = four_bar.kappa * math.sin(math.radians(14.0))
    narrow = replace(four_bar, rod_length=needed * four_bar.leg_length)
    return Finding(
        judge(abs(angle - 14.0) < _DEGREE, abs(math.degrees(pole(narrow)) - 14.0) < _DEGREE),
        angle,
        "deg",
        f"Delta xi at which a foot unloads under criterion 2 (claimed 14, tolerance {_DEGREE}). "
        f"The CoM is over a foot at {over[0]:.1f} deg ({over[1]:.1f} deg for kappa = 3/5)",
        f"d/l = {needed:.3f}; the lengths of Fig. 3 are not printed, and Section V's give "
        f"{four_bar.rod_length / four_bar.leg_length:.3f}",
    )


@claim(
    "divergence-is-unloading", "Fig. 3b", "The asymptotes are where a vertical force goes to zero."
)
def _divergence_is_unloading(four_bar: FourBar) -> Finding:
    near = [by_torque(four_bar, (1 - gap) * four_bar.rod_length) for gap in (1e-2, 1e-4, 1e-6)]
    forces = np.array([found.wrenches[LEFT, 1] for found in near]) / four_bar.weight
    moments = np.array([found.wrenches[LEFT, 2] for found in near])
    cops = np.array([found.cop[LEFT] for found in near])
    # f_y -> 0 in proportion to the gap while m_z does not: the CoP is their quotient
    unloads = forces[-1] < 1e-5 and np.ptp(moments) < 0.02 * moments[0]
    return Finding(
        judge(unloads and cops[-1] > 1e3 * cops[0]),
        forces[-1],
        "m g",
        "f_y on the diverging foot one millionth short of the divergence; its CoP is "
        f"{cops[-1] / four_bar.rod_length:.1e} d there, and its moment has changed by "
        f"{np.ptp(moments) / moments[0]:.1%} in the last hundredth",
    )


@claim(
    "divergent-foot", "Section IV-B", "The CoP that diverges is that of the non-supporting foot."
)
def _divergent_foot(four_bar: FourBar) -> Finding:
    found = by_torque(four_bar, (1 - 1e-6) * four_bar.rod_length)
    diverging = int(np.argmax(np.abs(found.cop)))
    carried = found.wrenches[1 - diverging, 1] / four_bar.weight
    return Finding(
        judge(carried > 1 - NEARLY),
        carried,
        "m g",
        f"f_y on the foot whose CoP stays finite (tolerance {NEARLY}); that CoP is "
        f"{found.cop[1 - diverging] / four_bar.rod_length:.3f} d from the foot's point",
    )


FORCE_CLAIMS: tuple[Claim[FourBar], ...] = (
    _constant_force,
    _force_varies,
    _whole_weight,
    _null_force,
    tends_to_zero,
    _diverges_at_14_deg,
    _divergence_is_unloading,
    _divergent_foot,
)
