"""Words of the report that follow from the numbers: the summary, the limits, the commands."""

from __future__ import annotations

import math
from collections import Counter

from copsense.limits import Limits
from copsense.paper import EvaluatedErratum, Verdict
from copsense.paper.lateral import SHORT, TORQUE, WRENCH
from copsense.reproduction import Reproduction

_LIMITS = "normal-force=10,friction=0.33333,torsion=0.01333,torque=model"
_ROUNDING = 1e-9  # differences below this are rounding


def summary(reproduction: Reproduction) -> tuple[str, ...]:
    """The answer in three sentences."""
    facts = reproduction.sweep_facts
    slope = {n: facts.at(facts.series[n].slope[:, 0], 0.0) for n in (WRENCH, TORQUE, SHORT)}
    reach = {n: facts.planted(n) * 1e3 for n in (WRENCH, TORQUE)}
    found = {c.claim.identifier: c.number for c in reproduction.icub_claims}
    over = facts.over_foot(facts.series[TORQUE].slope)[1]
    over /= facts.over_foot(facts.series[WRENCH].slope)[1]
    verdicts = Counter(claim.verdict for claim in reproduction.claims)
    wrong = sum(differs(e) for e in reproduction.errata)
    return (
        f"On the iCub with its feet {2 * facts.half:g} m apart, choosing the contact wrenches for "
        "minimum torque instead of minimum wrench makes the centres of pressure move "
        f"{slope[TORQUE] / slope[WRENCH]:.2f} times as fast about the symmetric posture "
        f"({slope[TORQUE]:.3f} against {slope[WRENCH]:.3f} metres per metre of CoM travel), and "
        f"keeps both on their soles up to {reach[TORQUE]:.1f} mm of it instead of "
        f"{reach[WRENCH]:.1f} mm.",
        "It is not the less sensitive choice everywhere: beyond "
        f"{found['icub-lower-sensitivity'] * 1e3:.1f} mm the foot that unloads is the more "
        f"sensitive one, {over:.2f} times as much with the CoM over the other foot; and the "
        "comparison rests on the unit of length, for with moments divided by "
        f"L = d/2 = {facts.half:g} m instead of 1 m minimum wrench gives {slope[SHORT]:.3f}, which "
        "is minimum torque's number.",
        f"Of {len(reproduction.claims)} claims of the paper tested, {verdicts[Verdict.HOLDS]} "
        f"hold, {verdicts[Verdict.HOLDS_IF]} hold under a condition, "
        f"and {verdicts[Verdict.DOES_NOT_HOLD]} do not hold; "
        f"{len(reproduction.errata)} places of the printed text need a correction, "
        f"{wrong} of them shown by a number.",
    )


def limit_words(limits: Limits) -> str:
    """Limits as a sentence's part."""
    return (
        f"normal force of each foot over {limits.normal_force:g} N, friction coefficient "
        f"{limits.friction:.3g} (pyramid of {limits.friction_sides} sides), torsion "
        f"{limits.torsion:.3g} m, CoP inside the sole, and the model's torque limits, which are "
        "real for the legs only"
    )


def differs(evaluated: EvaluatedErratum) -> bool:
    """Whether a number shows that the print differs from what holds."""
    return evaluated.discrepancy is not None and evaluated.discrepancy.as_printed > _ROUNDING


def limits(reproduction: Reproduction) -> tuple[str, ...]:
    """What this reproduction does not show."""
    facts = reproduction.sweep_facts
    lateral = facts.at(facts.series[WRENCH].slope[:, 0] / facts.hip_rate, 0.0)
    changed = ", ".join(reproduction.changed_at_sole)
    return (
        "Static part only. Section V's figures are measurements on a robot under closed-loop "
        "control; here each posture is an equilibrium. Velocities, the controller's feedback, "
        "estimation of the contact forces and sensor noise are not in it.",
        "No measured data are at hand, so nothing here is compared with the hardware; the claims "
        "of Section V are judged by whether they hold for the quasi-static motion they describe.",
        "The amplitude of the CoM's sine is not printed. The sweep goes from over one foot to over "
        "the other, as the text describes the motion.",
        "Outside the section on limits none are enforced on the wrenches (Remark 4): where a CoP "
        "leaves its sole, a controller with limits would keep it there and share the load "
        "differently.",
        "The paper says neither which iCub nor which posture: iCubGenova04 in a two-feet posture "
        "of that time, which has the hip height and foot distance that the paper states, stands "
        "for it. Its sole frames lie above the bottom of its collision geometry; the reference "
        "table's last column shows what that changes, and the verdicts "
        + (f"that change are those of {changed}." if changed else "are the same either way."),
        "The length L that makes moments comparable with forces in criterion 1 is not printed "
        "either; 1 m is what the printed formulas amount to.",
        "The sensitivity along a coordinate depends on the path (Remark 2): at the centre it is "
        f"{lateral:.3f} m per radian of hip roll along the CoM's lateral path and "
        f"{facts.other_slope:.3f} where the joint itself is swept.",
        '"Almost", "together" and "constant" are read as within a twentieth, "similar" and '
        '"about" as within a tenth; each claim\'s explanation states its tolerance.',
    )


def commands(reproduction: Reproduction, command: str) -> dict[str, tuple[str, ...]]:
    """Section -> the commands that give its numbers, each of which runs as it stands."""
    fb, facts = reproduction.four_bar, reproduction.sweep_facts
    size = (
        f"--leg-length {fb.leg_length:g} --rod-length {fb.rod_length:g} "
        f"--leg-mass {fb.leg_mass:g} --body-mass {fb.body_mass:g}"
    )
    xi = math.acos(fb.rod_length / 2 / (fb.kappa * fb.leg_length))
    span = f"--com-y {-facts.half:g}:{facts.half:g}:{reproduction.postures}"
    sweep = f"copsense sweep icub {span} --criterion minimum-wrench --criterion minimum-torque"
    return {
        "all": (command,),
        "four-bar": tuple(
            f"copsense four-bar {size} --xi {xi:.4f} --criterion {name}"
            for name in ("minimum-wrench", "minimum-torque")
        ),
        "icub": (
            f"{sweep} --output icub.nc",
            "copsense plot icub.nc --output icub.png",
            f"{sweep} --contact-at sole --output icub_at_sole.nc",
        ),
        "limits": (
            f"{sweep} --limits {_LIMITS} --output icub_within.nc",
            f"copsense analyse icub --limits {_LIMITS}",
            f"copsense design icub --family joints --limits {_LIMITS}",
        ),
        "beyond": (
            f"copsense sweep icub {span} --criterion minimum-wrench "
            f"--characteristic-length {facts.half:g} --output icub_short.nc",
            "copsense analyse icub --com-y 0.03 --along l_hip_roll --check",
        ),
    }
