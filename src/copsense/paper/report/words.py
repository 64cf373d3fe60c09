"""Words of the report that follow from the numbers: the summary, the limits, the commands."""

from __future__ import annotations

import math
from collections import Counter

from copsense.limits import Limits
from copsense.paper.claims import Sway, Verdict
from copsense.paper.claims.icub_sweep import SHORT, TORQUE, WRENCH
from copsense.paper.errata import EvaluatedErratum
from copsense.paper.reproduce import Reproduction

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
    words = []
    if limits.normal_force is not None:
        words.append(f"normal force of each foot over {limits.normal_force:g} N")
    if limits.friction is not None:
        given = "the contacts' own" if limits.friction == "contact" else f"{limits.friction:.3g}"
        words.append(f"friction coefficient {given} (pyramid of {limits.friction_sides} sides)")
    if limits.torsion is not None:
        given = {"contact": "the contacts' own", "cone": "that of the sole's friction"}.get(
            str(limits.torsion), f"{limits.torsion} m"
        )
        if not isinstance(limits.torsion, str):
            given = f"{limits.torsion:.3g} m"
        words.append(f"torsion {given}")
    if isinstance(limits.cop_margin, float):
        inside = f" by {limits.cop_margin * 1e3:g} mm" if limits.cop_margin else ""
        words.append(f"CoP inside the sole{inside}")
    if limits.torque == "model":
        words.append("the model's torque limits, which are real for the legs only")
    elif limits.torque is not None:
        words.append(f"torques of {limits.torque:g} N m at most")
    return ", ".join(words)


def limits_option(limits: Limits) -> str:
    """The same as `--limits` takes them."""
    given = {
        "normal-force": limits.normal_force,
        "friction": limits.friction,
        "sides": limits.friction_sides,
        "cop-margin": limits.cop_margin,
        "torsion": limits.torsion,
        "torque": limits.torque,
    }
    usual = {name.replace("_", "-"): f.default for name, f in Limits.__dataclass_fields__.items()}
    usual["sides"] = usual["friction-sides"]

    def text(value: object) -> str:
        return (
            "off" if value is None else f"{value:.6g}" if isinstance(value, float) else f"{value}"
        )

    return ",".join(f"{n}={text(value)}" for n, value in given.items() if value != usual[n])


def differs(evaluated: EvaluatedErratum) -> bool:
    """Whether a number shows that the print differs from what holds."""
    return evaluated.discrepancy is not None and evaluated.discrepancy.as_printed > _ROUNDING


def limits(reproduction: Reproduction) -> tuple[str, ...]:
    """What this reproduction does not show."""
    facts = reproduction.sweep_facts
    lateral = facts.at(facts.series[WRENCH].slope[:, 0] / facts.hip_rate, 0.0)
    changed = ", ".join(reproduction.changed_at_sole)
    return (
        "Section V's figures are measurements on a robot under closed-loop control. "
        + (
            "Here the claims are judged twice: on equilibria, and in closed loop in simulation; "
            "estimation of the contact forces, joint friction and sensor noise are in neither."
            if reproduction.sway
            else "Here each posture is an equilibrium: velocities, the controller's feedback, "
            "estimation of the contact forces and sensor noise are not in it."
        ),
        "The paper's own measurements are not at hand; the claims of Section V are judged by "
        "whether they hold for the quasi-static motion they describe. The real robot's log is of "
        "another experiment, of normal forces alone, under a controller that is not stated.",
        "The amplitude of the CoM's sine is not printed. The static sweep goes from over one foot "
        "to over the other, as the text describes the motion.",
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


def _balance_commands(sway: Sway | None) -> tuple[str, ...]:
    if sway is None:
        return ()
    narrow, wide = sway.amplitude, sway.limited_amplitude
    within = limits_option(sway.limits)
    period = f" --control-period {float(sway.left.attrs['control_period']) * 1e3:g}ms"
    runs = [
        ("minimum-wrench", narrow, "", ""),
        ("minimum-wrench", -narrow, "_right", ""),
        ("minimum-torque", narrow, "", ""),
        *((name, wide, "_within", f" --limits {within}") for name in sway.limited),
    ]
    return (
        *(
            f"copsense balance icub --criterion {name} --reference sine:{amplitude:g}:"
            f"{sway.frequency:g}{limits}{period} --output {name}{suffix}.nc "
            f"--plot {name}{suffix}.png"
            for name, amplitude, suffix, limits in runs
        ),
        f"copsense benchmark icub{period} --output benchmark.csv --plot benchmark.png",
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
    within = limits_option(reproduction.within_limits.limits)
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
            f"{sweep} --limits {within} --output icub_within.nc",
            f"copsense analyse icub --limits {within}",
            f"copsense design icub --family joints --limits {within}",
        ),
        "closed-loop": _balance_commands(reproduction.sway),
        "beyond": (
            f"copsense sweep icub {span} --criterion minimum-wrench "
            f"--characteristic-length {facts.half:g} --output icub_short.nc",
            "copsense analyse icub --com-y 0.03 --along l_hip_roll --check",
        ),
    }
