"""``copsense reproduce``: the paper reproduced, as a report."""

from __future__ import annotations

import importlib.util
import shlex
import sys

import click

from copsense.cli.limit_options import limits_option, read_limits
from copsense.cli.option_lists import SectionedCommand
from copsense.errors import InvalidInputError


@click.command(
    cls=SectionedCommand,
    epilog="\b\nExamples:\n"
    "  copsense reproduce --output reproduction\n"
    "  copsense reproduce --log com-sinusoid.mat --log-robot model.urdf",
)
@click.option(
    "--output",
    type=click.Path(),
    default="reproduction",
    show_default=True,
    help="Folder for the report, its figures and data.",
)
@click.option(
    "--postures",
    type=click.IntRange(min=21),
    default=141,
    show_default=True,
    help="Postures of the iCub's lateral sweep.",
)
@click.option("--static", is_flag=True, help="Leave the closed loop in MuJoCo out.")
@click.option(
    "--log",
    "log_file",
    type=click.Path(),
    metavar="FILE",
    help="A real robot's log for Section V, such as the public one that docs/logs.md names.",
)
@click.option("--log-robot", metavar="ROBOT", help="Whose log it is: a URDF, MJCF, SDF or preset.")
@limits_option
@click.option("--force", is_flag=True, help="Overwrite an earlier reproduction.")
@click.option("--quiet", is_flag=True, help="No progress.")
def reproduce(
    output: str,
    postures: int,
    static: bool,
    log_file: str | None,
    log_robot: str | None,
    limits: str | None,
    force: bool,
    quiet: bool,
) -> None:
    """Reproduce [Romano2016] on the four-bar and on the iCub, statically and in closed loop.

    Every claim of the paper is tested (holds, holds if, does not hold), every figure drawn, and one
    self-contained HTML report written. With --log, a real robot's own log is put beside Section V.
    The last line printed is the report's path. Limits are those of the report's section on them; by
    default, what public configurations for this robot use.
    """
    from copsense.paper.report import write_report
    from copsense.paper.reproduce import LIMITS, SWAY_FREQUENCY, reproduce_paper
    from copsense.reports import check_report_folder

    if (log_file is None) != (log_robot is None):
        raise InvalidInputError("--log and --log-robot belong together. Give both or neither.")
    check_report_folder(output, overwrite=force)
    within = read_limits(limits) or LIMITS
    if not static and importlib.util.find_spec("mujoco") is None:
        click.echo(
            'note: without MuJoCo the closed loop is left out (pip install "copsense[sim]").',
            err=True,
        )
        static = True
    command = f"copsense {shlex.join(sys.argv[1:])}"
    from tqdm import tqdm

    form = "{desc} {n}/{total} [{elapsed}]"
    # A bar on a terminal, a line a stage elsewhere (disable=None: not on a terminal).
    with tqdm(total=0, disable=quiet or None, leave=False, bar_format=form) as bar:
        stages: list[str] = []

        def show(stage: str, done: int, total: int) -> None:
            if stage not in stages:
                stages.append(stage)
                if bar.disable and not quiet:
                    click.echo(f"{stage} ...", err=True)
                bar.reset(total)
                bar.set_description_str(stage, refresh=False)
            bar.update(done - bar.n)

        result = reproduce_paper(
            postures=postures,
            limits=within,
            sway_frequency=None if static else SWAY_FREQUENCY,
            real_log=None if log_file is None or log_robot is None else (log_file, log_robot),
            progress=show,
        )
        path = write_report(result, output, overwrite=force, command=command)
    click.echo(str(path))
