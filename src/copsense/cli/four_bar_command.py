"""``copsense four-bar``: the paper's linkage in closed form."""

from __future__ import annotations

import math
from typing import Any

import click

from copsense.cli.printing import echo_json
from copsense.cli.units import ANGLE, LENGTH, Quantity
from copsense.errors import InvalidInputError, UnknownNameError

MASS = Quantity("kg")


@click.command(
    "four-bar",
    epilog="\b\nExamples:\n"
    "  copsense four-bar --xi 86deg\n"
    "  copsense four-bar --leg-length 0.5 --rod-length 0.14 --leg-mass 8.25 --body-mass 16.5 "
    "--xi 86deg --criterion minimum-torque --json",
)
@click.option(
    "--leg-length", type=LENGTH, default=0.5, show_default=True, metavar="LENGTH", help="l [m]."
)
@click.option(
    "--rod-length", type=LENGTH, default=0.14, show_default=True, metavar="LENGTH", help="d [m]."
)
@click.option(
    "--leg-mass", type=MASS, default=8.25, show_default=True, metavar="KG", help="m_l [kg]."
)
@click.option(
    "--body-mass", type=MASS, default=16.5, show_default=True, metavar="KG", help="m_b [kg]."
)
@click.option(
    "--xi",
    type=ANGLE,
    default=math.pi / 2,
    show_default="90",
    metavar="ANGLE",
    help="Angle between rod and leg, over 0 and under 180 degrees; 90 stands upright.",
)
@click.option(
    "--criterion",
    default="minimum-torque",
    show_default=True,
    metavar="NAME",
    help="minimum-wrench, minimum-torque, weighted-torque or minimum-tangential.",
)
@click.option(
    "--characteristic-length",
    type=LENGTH,
    default=1.0,
    show_default=True,
    metavar="LENGTH",
    help="L [m] of minimum-wrench and minimum-tangential.",
)
@click.option(
    "--hip-weight",
    type=float,
    default=1.0,
    show_default=True,
    help="Weight of the hips' torques in weighted-torque.",
)
@click.option(
    "--ankle-weight", type=float, default=1.0, show_default=True, help="The same of the ankles."
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def four_bar(
    leg_length: float,
    rod_length: float,
    leg_mass: float,
    body_mass: float,
    xi: float,
    criterion: str,
    as_json: bool,
    **parameters: float,
) -> None:
    """The planar four-bar linkage of [Romano2016] in closed form.

    Axes as in the paper: x right, y up, left foot at -x, moments counter-clockwise. Wrenches are
    [fx, fy, mz], ground on foot [N, N, N m].
    """
    from copsense.arrays import finite_number
    from copsense.paper import FOUR_BAR_CRITERIA, FourBar, solve_four_bar

    if criterion not in FOUR_BAR_CRITERIA:
        raise UnknownNameError("criterion of the four-bar", criterion, FOUR_BAR_CRITERIA)
    if not 0.0 < xi < math.pi:
        raise InvalidInputError(
            f"--xi is {math.degrees(xi):g} degrees. Give an angle over 0 and under 180 degrees, at "
            "which the linkage is collapsed, such as 85, 85deg or 1.5rad; 90 stands upright."
        )
    for name, value in parameters.items():  # also of those that this criterion does not use
        finite_number(value, f"--{name.replace('_', '-')}", positive=True)
    own = {k: v for k, v in parameters.items() if k in FOUR_BAR_CRITERIA[criterion].defaults}
    linkage = FourBar(leg_length, rod_length, leg_mass, body_mass)
    solution = solve_four_bar(linkage, xi, criterion, **own)
    sides = ("left", "right")
    answer: dict[str, Any] = {
        **solution.to_dict(),
        "criterion": criterion,
        "parameters": {
            "leg_length": leg_length,
            "rod_length": rod_length,
            "leg_mass": leg_mass,
            "body_mass": body_mass,
            "xi": xi,
            **own,
        },
    }
    if as_json:
        echo_json(answer)
        return
    click.echo(
        f"{criterion} at xi = {math.degrees(xi):.6g} deg, "
        f"CoM at ({solution.com[0]:.4f}, {solution.com[1]:.4f}) m"
    )
    click.echo("from the left foot (x right, y up)\n")
    click.echo("foot    fx [N]      fy [N]      mz [N m]    CoP [mm]   dCoP/dxi [m/rad]  dCoP/dCoM")
    for k, side in enumerate(sides):
        fx, fy, mz = solution.wrenches[k]
        click.echo(
            f"{side:6}{fx:10.3f}  {fy:10.3f}  {mz:10.4f}  {solution.cop[k] * 1e3:10.3f}"
            f"  {solution.sensitivity[k]:15.6f}  {solution.cop_per_com[k]:9.4f}"
        )
    torques = ", ".join(f"{name} {value:.4f}" for name, value in answer["torques"].items())
    click.echo(f"\ntorques [N m]: {torques}")
