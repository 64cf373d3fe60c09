"""``copsense hardware``: which millimetre or gram buys most travel."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import click

from copsense.cli.criterion_options import one_criterion_options, read_criterion
from copsense.cli.limit_options import read_limits
from copsense.cli.option_lists import SectionedCommand
from copsense.cli.printing import PICTURES, echo_json, echo_notes, echo_written, progress_bar
from copsense.cli.stance_options import read_stance, stance_options
from copsense.cli.units import Unit, read_quantity, split_assignment
from copsense.errors import InvalidInputError

if TYPE_CHECKING:
    import numpy as np

    from copsense.criterion import Criterion
    from copsense.hardware import HardwareEffects, HardwareSweep, Parameter
    from copsense.stance import Stance

_CHANGE = (
    "NAME=LOW:HIGH, NAME=LOW:HIGH:COUNT, NAME=+-WIDTH or NAME=+-WIDTH:COUNT, such as "
    "hip_width=+-20mm, sole_width=80mm:120mm:9 or mass@chest=8:10"
)
_UNITS: dict[str, Unit] = {"m": "m", "kg": "kg", "N/m": "N/m"}
_COUNT, _MOST = 9, 1000


@click.command(
    cls=SectionedCommand,
    epilog="\b\nExamples:\n"
    "  copsense hardware icub --plot effects.png\n"
    "  copsense hardware icub --change sole_width=80mm:120mm --change hip_width=+-20mm\n"
    "  copsense hardware talos --limits friction=0.4,torque=model --output talos.csv\n"
    "  copsense hardware solo12 --single --json\n"
    "  copsense hardware icub --criterion stiffness:hip=4000,rest=2000 --step 20%",
)
@partial(stance_options, coordinates=False)
@one_criterion_options
@click.option(
    "--change",
    "changes",
    multiple=True,
    metavar="NAME=RANGE",
    help="Sweep one parameter exactly, a robot of its own for each value: LOW:HIGH, with :COUNT "
    f"for other than {_COUNT} values, or +-WIDTH about what it is. Lengths in metres, masses in "
    "kg, or with units. Names as the table has them; KIND@PART is of one side alone. Repeatable.",
)
@click.option(
    "--single", is_flag=True, help="Each foot, link and joint by itself, not left and right alike."
)
@click.option(
    "--rows",
    type=click.IntRange(0),
    default=8,
    show_default=True,
    help="Parameters of each group to list and check, best first; 0 for all.",
)
@click.option(
    "--step",
    default="10%",
    show_default=True,
    metavar="PERCENT",
    help="By how much of its size each listed parameter is changed for the check.",
)
@click.option("--no-check", is_flag=True, help="Leave the checks by whole pipelines out.")
@click.option(
    "--plot",
    "picture",
    type=click.Path(),
    help="Draw what buys most, and the sweeps of --change: .png, .svg or .pdf.",
)
@click.option(
    "--output",
    type=click.Path(),
    help="Write netCDF (.nc) or a table (.csv): of the effects, or of one --change.",
)
@click.option("--force", is_flag=True, help="Overwrite the picture and the output.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def hardware(
    robot: str | None,
    criteria: tuple[str, ...],
    characteristic_length: float,
    limits: str | None,
    changes: tuple[str, ...],
    single: bool,
    rows: int,
    step: str,
    no_check: bool,
    picture: str | None,
    output: str | None,
    force: bool,
    as_json: bool,
    **options: Any,
) -> None:
    """What the soles, ankles, hips, links and servos of ROBOT buy of its CoM's travel.

    Travel is exact, to both sides until --limits (default: contacts that do not pull or slip,
    centres of pressure in their soles). A changed robot stands on the same places, its CoM over the
    same point. Left and right change alike.
    In Python: copsense.hardware.hardware_effects and hardware_sweep.
    """
    from copsense.files import check_output
    from copsense.hardware import hardware_effects, hardware_parameters
    from copsense.hardware.effect_table import effect_table

    if picture is not None:
        check_output(picture, suffixes=PICTURES, overwrite=force)
    if output is not None:
        check_output(output, suffixes=(".nc", ".csv"), overwrite=force)
        if len(changes) > 1:
            raise InvalidInputError(
                "--output writes one table, and each --change has its own. Give one --change."
            )
    share = _percent(step)
    within, criterion = read_limits(limits), read_criterion(criteria, characteristic_length)
    stance = read_stance(robot, **options)
    asked = [_read_change(text, stance, criterion) for text in changes]
    parameters = hardware_parameters(stance, criterion, single=single)
    with progress_bar(None, "hardware", "robot") as update:
        checked = 0 if no_check or changes else rows or len(parameters)
        effects = hardware_effects(
            stance, criterion, within, parameters, step=share, checked=checked, progress=update
        )
        swept = [_swept(effects, parameter, values, update) for parameter, values in asked]
    echo_notes(note for note in effects.notes if note not in stance.robot.notes)
    if picture is not None:
        from copsense.plots import plot_hardware, save_figure

        save_figure(plot_hardware(effects, swept), picture, overwrite=force)
    if output is not None:
        (swept[0] if swept else effects).save(output, overwrite=force)
    if as_json:
        files = {"plot": picture, "output": output}
        answer = effects.to_dict() | {"sweeps": [each.to_dict() for each in swept]}
        echo_json(answer | {what: file for what, file in files.items() if file})
        return
    texts = [str(each) for each in swept] or [effect_table(effects, rows)]
    click.echo("\n\n".join(texts))
    echo_written(picture, output)


def _swept(
    effects: HardwareEffects, parameter: Parameter, values: np.ndarray, update: Any
) -> HardwareSweep:
    from copsense.hardware import hardware_sweep

    return hardware_sweep(
        effects.stance, effects.criterion, parameter, values, nominal=effects, progress=update
    )


def _read_change(text: str, stance: Stance, criterion: Criterion) -> tuple[Parameter, np.ndarray]:
    """``NAME=LOW:HIGH``, ``NAME=LOW:HIGH:COUNT`` or ``NAME=+-WIDTH``: a parameter and its values.

    Raises:
        UnknownNameError: no such parameter.
        InvalidInputError: a range that is not understood, or one that it cannot have.
    """
    import numpy as np

    from copsense.hardware import parameter_named

    name, span = split_assignment(text, _CHANGE)
    parameter = parameter_named(name, stance, criterion)
    parts, count = span.split(":"), str(_COUNT)
    about = span.startswith("+-")
    if len(parts) == (2 if about else 3):
        *parts, count = parts
    try:
        number = int(count)
        if about and len(parts) == 1:
            width = _quantity(parts[0].removeprefix("+-"), parameter)
            low, high = parameter.nominal - width, parameter.nominal + width
        else:
            low, high = (_quantity(part, parameter) for part in parts)
    except InvalidInputError as error:
        raise InvalidInputError(f"--change {text}: {error} Write {_CHANGE}.") from None
    except ValueError:
        raise InvalidInputError(f"{text!r} is not understood. Give {_CHANGE}.") from None
    if not 1 <= number <= _MOST:
        raise InvalidInputError(
            f"--change {text} asks for {number} values. Give a count from 1 to {_MOST}."
        )
    values = np.linspace(low, high, number)
    for value in values.tolist():
        parameter.checked(value)
    return parameter, values


def _quantity(text: str, parameter: Parameter) -> float:
    unit = _UNITS.get(parameter.unit)
    return float(text) if unit is None else read_quantity(text, unit)


def _percent(text: str) -> float:
    try:
        return float(text.removesuffix("%")) / 100
    except ValueError:
        raise InvalidInputError(
            f"--step {text!r} is not understood. Give per cent of a parameter's size, such as 10%."
        ) from None
