"""The command line: arguments in, results out, exit code 0 done, 1 some rows failed, 2 bad usage.

Commands import what they need when they run, so that help is immediate.
"""

from __future__ import annotations

import sys
import warnings
from typing import Any

import click
from threadpoolctl import threadpool_limits

from copsense._version import __version__
from copsense.cli.analyse import analyse
from copsense.cli.balance import balance
from copsense.cli.benchmark import benchmark
from copsense.cli.design import design
from copsense.cli.four_bar_command import four_bar
from copsense.cli.map import map_command
from copsense.cli.reproduce_command import reproduce
from copsense.cli.robots import robots
from copsense.cli.sweep import plot, sweep
from copsense.errors import CopsenseError


@click.group(
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="Exit codes: 0 done, 1 some rows failed, 2 bad usage or input. "
    "Each command's --help shows an example.",
)
@click.version_option(__version__, prog_name="copsense")
def copsense() -> None:
    """How fast does the centre of pressure under each foot move when the posture does?

    Static centre-of-pressure sensitivity of legged robots, after Romano et al., arXiv:1610.01495.
    """


for _command in (
    robots,
    four_bar,
    analyse,
    sweep,
    plot,
    map_command,
    design,
    balance,
    benchmark,
    reproduce,
):
    copsense.add_command(_command)


def main() -> None:
    """Run the command line; an error of copsense is a line, not a traceback."""
    warnings.showwarning = _show_warning
    try:
        code = _run()
        sys.stdout.flush()
        sys.exit(code)
    except CopsenseError as error:
        click.echo(f"error: {error}", err=True)
    except click.ClickException as error:
        error.show()
    except (click.Abort, KeyboardInterrupt):
        click.echo("stopped; nothing half-written is left behind.", err=True)
        sys.exit(130)
    except BrokenPipeError:
        sys.stderr.close()  # whoever read our output has seen enough
        sys.exit(0)
    except OSError as error:
        # Standard output: files have errors of their own.
        click.echo(f"error: the answer could not be printed: {error}.", err=True)
    sys.exit(2)


def _run() -> int:
    try:
        # The matrices are small: more BLAS threads than one cost more than they bring.
        with threadpool_limits(limits=1, user_api="blas"):
            return copsense.main(standalone_mode=False) or 0
    except SystemExit:
        return 0  # click leaves so when whoever read our output has seen enough


def _show_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    click.echo(f"note: {message}", err=True)
