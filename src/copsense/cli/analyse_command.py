"""``copsense analyse``: one posture, and which way of sharing the load keeps its feet planted."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from copsense.cli.criterion_options import criterion_options, read_criteria
from copsense.cli.limit_options import read_limits
from copsense.cli.limit_text import (
    add_limits,
    add_regions,
    limit_verdict,
    presses,
    print_limits,
    print_regions,
)
from copsense.cli.printing import echo_json
from copsense.cli.quantities import read_positions
from copsense.cli.stance_options import read_stance, stance_options
from copsense.errors import InvalidInputError

if TYPE_CHECKING:
    from copsense.sensitivity import CopSensitivity
    from copsense.stance import Stance


@click.command(
    epilog="Examples: copsense analyse icub --com-y 0.03 --along l_hip_roll --plot icub.png; "
    "copsense analyse icub --limits friction=0.33,torque=model --regions regions.png"
)
@stance_options
@criterion_options
@click.option("--com-x", type=float, metavar="M", help="World x of the CoM; default held.")
@click.option("--com-y", type=float, metavar="M", help="World y of the CoM; default the middle.")
@click.option(
    "--joint", "joints", multiple=True, metavar="JOINT=DEG", help="Hold a joint there [deg]."
)
@click.option(
    "--along",
    metavar="JOINT",
    help="Report the sensitivity per this joint too, along the lateral path of the CoM.",
)
@click.option("--check", is_flag=True, help="Audit the derivatives against finite differences.")
@click.option("--plot", "picture", type=click.Path(), help="Draw the stance: .png, .svg or .pdf.")
@click.option(
    "--regions",
    type=click.Path(),
    help="Draw the regions of the CoM that the limits leave, and tell their areas: .png, .svg or "
    ".pdf. Needs --limits.",
)
@click.option("--force", is_flag=True, help="Overwrite the pictures.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def analyse(
    robot: str,
    criteria: tuple[str, ...],
    characteristic_length: float,
    limits: str | None,
    com_x: float | None,
    com_y: float | None,
    joints: tuple[str, ...],
    along: str | None,
    check: bool,
    picture: str | None,
    regions: str | None,
    force: bool,
    as_json: bool,
    **options: Any,
) -> None:
    """Analyse one posture of ROBOT: centre of pressure, margin and sensitivity of each contact.

    ROBOT is a name from `copsense robots`, or the path of a URDF or MJCF. Lengths in the answer
    are along the contact's axes: x forward, y left, z the normal.
    """
    from copsense.posture import solve_posture
    from copsense.robots import sole_notes
    from copsense.sensitivity import check_sensitivity, cop_sensitivity
    from copsense.storage import check_output

    for drawn in filter(None, (picture, regions)):
        check_output(drawn, suffixes=(".png", ".svg", ".pdf"), overwrite=force)
    if picture is not None and regions is not None and Path(picture) == Path(regions):
        raise InvalidInputError("--plot and --regions name one file. Give each its own.")
    within = read_limits(limits)
    if regions is not None and (within is None or not within.any):
        raise InvalidInputError(
            "regions of the CoM are those that limits leave. Give --limits too, such as "
            "--limits friction=0.33,torque=model."
        )
    chosen = read_criteria(criteria, characteristic_length)
    home = read_stance(robot, **options)
    held = read_positions(joints, home.robot)
    if along is not None:
        home.robot.velocity_index(along)
    planar = home.robot.base_nv != 6
    x = com_x if com_x is not None else None if planar else float(home.com[0])
    y = com_y if com_y is not None else float(home.com[1])
    posture = solve_posture(home, com=(x, y, None), joints=held)
    stance, tangent = posture.stance, posture.tangents[:, 0 if planar else 1]
    results = {c.name: cop_sensitivity(stance, c, within) for c in chosen}
    if check:
        for criterion in chosen:
            check_sensitivity(stance, criterion, within)
    answer = _answer(stance, results, tangent, along)
    if within is not None and within.any:
        add_limits(answer, stance, chosen, results, within, tangent)
    if regions is not None:
        assert within is not None
        add_regions(answer, stance, chosen, within, regions, overwrite=force)
    answer.setdefault("notes", []).extend(sole_notes(stance))
    answer["notes"] += [
        f"{joint} is {math.degrees(excess):.1f} deg beyond its limit."
        if unit == "rad"
        else f"{joint} is {excess * 1e3:.1f} mm beyond its limit."
        for joint, unit, excess in zip(
            stance.robot.torque_names,
            stance.robot.torque_units,
            stance.joint_limit_excess.tolist(),
            strict=True,
        )
        if excess > 1e-6
    ]
    answer["checked"] = check
    if picture is not None:
        from copsense.plots import plot_stance, save_figure

        save_figure(plot_stance(stance, list(results.values())), picture, overwrite=force)
        answer["plot"] = picture
    if as_json:
        echo_json(answer)
    else:
        _print(answer, along, home.robot.joint_unit(along) if along else "rad")


def _answer(
    stance: Stance, results: dict[str, CopSensitivity], tangent: Any, along: str | None
) -> dict[str, Any]:
    """The analysis as plain data."""
    from copsense.cop import total_center_of_pressure

    robot = stance.robot
    criteria: dict[str, Any] = {}
    for name, result in results.items():
        equilibrium, per_contact = result.equilibrium, {}
        slope = result.along(tangent)
        joint_slope = result.along_joint(tangent, along) if along else None
        for k, contact in enumerate(stance.contacts):
            row: dict[str, Any] = {
                "wrench": equilibrium.wrenches[k],
                "load_share": float(equilibrium.wrenches[k, 2]) / robot.weight,
                "pulling": contact.name in equilibrium.pulling,
                "cop": result.cop[k],
                "cop_slope": slope[k],
                "cop_gain": result.com_gain[k],
                "worst_case_gain": float(result.worst_case_gain[k]),
                "com_travel": float(result.com_travel[k]),
                "unloading_travel": float(result.unloading_travel[k]),
            }
            if joint_slope is not None:
                row[f"cop_per_{along}"] = joint_slope[k]
            if contact.sole:
                margin = contact.sole.margin(result.cop[k])
                row |= {"margin": margin.distance, "margin_side": margin.side}
            per_contact[contact.name] = row
        criteria[name] = {
            "contacts": per_contact,
            "torques": dict(zip(robot.torque_names, equilibrium.torques.tolist(), strict=True)),
            "torque_norm": float((equilibrium.torques**2).sum() ** 0.5),
            "residual": equilibrium.residual(),
            "total_cop": total_center_of_pressure(equilibrium),
        }
    return {
        "robot": robot.name,
        "mass": robot.mass,
        "com": stance.com,
        "rank": stance.rank,
        "admissible_motions": stance.admissible_motions.shape[1],
        "contacts": [
            {"name": c.name, "frame": c.frame, "kind": c.kind, "position": p.translation}
            for c, p in zip(stance.contacts, stance.placements, strict=True)
        ],
        "criteria": criteria,
    }


def _print(answer: dict[str, Any], along: str | None, unit: str) -> None:
    per, scale = ("mm/mm", 1.0) if unit == "m" else ("mm/deg", 1e3 * math.pi / 180)
    com = ", ".join(f"{round(value, 4) + 0.0:+.4f}" for value in answer["com"])
    click.echo(f"{answer['robot']}: {answer['mass']:.2f} kg, CoM ({com}) m, world axes")
    click.echo(
        f"{len(answer['contacts'])} contacts, {answer['admissible_motions']} admissible motions"
    )
    width = max(len(c["name"]) for c in answer["contacts"])
    for name, row in answer["criteria"].items():
        click.echo(
            f"\n{name}: torque norm {row['torque_norm']:.2f} N m, residual {row['residual']:.1e} N"
        )
        head = f"  {'contact':{width}}   load  CoP x, y [mm]     margin [mm]          "
        head += "dCoP_y/dCoM_y  worst gain  CoM travel [mm]: tips  unloads"
        click.echo(head + (f"  dCoP_y/d{along} [{per}]" if along else ""))
        clipped = presses(row)
        for contact, c in row["contacts"].items():
            margin = "-"
            if "margin" in c:
                margin = f"{c['margin'] * 1e3:6.1f} to {c['margin_side']}"
            tips, unloads = (
                "clipped"
                if clipped
                else f"{c[key] * 1e3:.1f}"
                if math.isfinite(c[key])
                else "never"
                for key in ("com_travel", "unloading_travel")
            )
            x, y = (round(value * 1e3, 2) + 0.0 for value in c["cop"])
            line = (
                f"  {contact:{width}}  {c['load_share']:5.3f}  {x:+7.2f}, {y:+7.2f}"
                f"   {margin:20} {c['cop_gain'][1][1]:12.3f}"
                f"  {c['worst_case_gain']:10.3f}  {tips:>21}  {unloads:>7}"
            )
            if along:
                line += f"  {c[f'cop_per_{along}'][1] * scale:12.3f}"
            click.echo(line + ("  PULLING" if c["pulling"] else ""))
        if "limit_travel" in row:
            click.echo(
                "  slopes and gains: of the wrenches as the limits clip them; how far the CoM may "
                "go stands below"
                if clipped
                else "  tips, unloads: in the worst direction, to first order; along y, see below"
            )
            print_limits(row)
    click.echo("\n" + _verdict(answer))
    for note in answer["notes"]:
        click.echo(f"note: {note}", err=True)
    if answer["checked"]:
        click.echo("derivatives agree with finite differences to 1e-7 relative")
    if "regions" in answer:
        print_regions(answer["regions"])
    if "plot" in answer:
        click.echo(f"drawn: {answer['plot']}")


def _verdict(answer: dict[str, Any]) -> str:
    """One sentence: which criterion lets the CoM travel farthest before a contact tips."""
    if all("limit_travel" in row for row in answer["criteria"].values()):
        return limit_verdict(answer)
    reach = {
        name: min(
            (c[key], f"{contact} {word}")
            for contact, c in row["contacts"].items()
            for key, word in (("com_travel", "tips"), ("unloading_travel", "unloads"))
        )
        for name, row in answer["criteria"].items()
    }
    blind = [
        c["name"]
        for c in answer["contacts"]
        if c["kind"] != "point"
        and any("margin" not in row["contacts"][c["name"]] for row in answer["criteria"].values())
    ]
    if blind:
        return (
            f"No sole is known under {', '.join(blind)}, so when it tips is not either: give "
            "--sole X0:X1:Y0:Y1."
        )
    best = max(reach, key=lambda name: reach[name][0])
    distance, event = reach[best]
    if distance < 0:
        return f"Every criterion has a contact that tips or pulls; nearest to standing: {best}."
    if not math.isfinite(distance):
        return "No contact tips or unloads, to first order."
    others = ", ".join(f"{n} {reach[n][0] * 1e3:.1f} mm" for n in reach if n != best)
    return (
        f"{best} keeps the feet planted longest: to first order the CoM may move "
        f"{distance * 1e3:.1f} mm before {event}" + (f" ({others})." if others else ".")
    )
