"""The command line: arguments in, results out, exit code 0 done, 1 some rows failed, 2 bad usage.

Commands parse and print; what they print is computed by functions that any Python program can
call. A command is imported when it runs, and NumPy, Pinocchio and the rest when it computes.
"""

from __future__ import annotations

import os
import sys
import warnings
from typing import Any

import click

from copsense._version import __version__
from copsense.cli.lazy_group import LazyGroup, Place
from copsense.cli.printing import echo_notes
from copsense.errors import CopsenseError, MissingExtraError
from copsense.extras import EXTRA_OF

_COMMANDS = {
    name: Place(f"copsense.cli.{name.replace('-', '_')}_command", function, summary)
    for name, function, summary in (
        ("robots", "robots", "List the robots known by name."),
        ("inspect", "inspect", "Inspect a robot: joints, motors, feet, and how it stands."),
        ("analyse", "analyse", "Analyse one posture: CoP, margin and sensitivity of each contact."),
        ("explore", "explore", "Explore a robot in the browser."),
        ("sweep", "sweep", "Sweep the CoM or a joint and evaluate every posture."),
        ("plot", "plot", "Draw a sweep that `copsense sweep` wrote."),
        ("map", "map_command", "Map the sensitivity over a whole space of postures."),
        ("push", "push", "Push a robot that stands: how hard, from where, and what yields first."),
        ("design", "design", "Design the weights of a criterion that goes farther."),
        ("optimise", "optimise", "Optimise the posture: travel, margins, pushes, gain or torques."),
        ("hardware", "hardware", "Say which millimetre or gram of a robot buys most travel."),
        ("balance", "balance", "Balance a robot in simulation, beside the static prediction."),
        ("log", "log", "Compare a robot's own log with what every criterion says."),
        ("identify", "identify", "Identify which criterion explains a robot's own log."),
        ("benchmark", "benchmark", "Compare balancing controllers in simulation."),
        ("four-bar", "four_bar", "Solve the paper's four-bar linkage in closed form."),
        ("reproduce", "reproduce", "Reproduce the paper and write a report."),
    )
}


@click.group(
    cls=LazyGroup,
    places=_COMMANDS,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="\b\nExamples:\n"
    "  copsense analyse icub --com-y 0.03\n"
    "  copsense sweep icub --com-y -0.07:0.07:57 --output icub.nc\n"
    "Each command's --help shows examples of its own.\n"
    "Exit codes: 0 done, 1 some rows failed or a robot fell, 2 bad usage or input.",
)
@click.version_option(__version__, "-V", "--version", prog_name="copsense")
def copsense() -> None:
    """How fast does the centre of pressure under each foot move when the posture does?

    Static centre-of-pressure sensitivity of legged robots, after Romano et al., arXiv:1610.01495.
    """


def main() -> None:
    """Run the command line; an error of copsense is a line, not a traceback."""
    warnings.showwarning = _show_warning
    # The matrices are small: more BLAS threads than one cost more than they bring. Read when NumPy
    # is first imported, which is after this.
    for variable in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"):
        os.environ.setdefault(variable, "1")
    try:
        code = _run()
        sys.stdout.flush()
        sys.exit(code)
    except CopsenseError as error:
        where = "".join(f" {note}" for note in getattr(error, "__notes__", ()))
        click.echo(f"error: {error}{where}", err=True)
    except click.ClickException as error:
        error.show()
    except (click.Abort, KeyboardInterrupt):
        click.echo("stopped; nothing half-written is left behind.", err=True)
        sys.exit(130)
    except ImportError as error:
        click.echo(f"error: {_unloadable(error)}", err=True)
    except BrokenPipeError:
        sys.stderr.close()  # the reader of our output has seen enough
        sys.exit(0)
    except OSError as error:
        # Standard output: files have errors of their own.
        click.echo(f"error: the answer could not be printed: {error}.", err=True)
    sys.exit(2)


def _run() -> int:
    try:
        return copsense.main(standalone_mode=False) or 0
    except SystemExit:
        return 0  # click leaves so when the reader of our output has seen enough


def _unloadable(error: ImportError) -> str:
    """What is missing when a package that copsense needs cannot be loaded."""
    package = (error.name or "").partition(".")[0]
    if isinstance(error, ModuleNotFoundError) and package in EXTRA_OF:
        return str(MissingExtraError(package, EXTRA_OF[package], "this command"))
    remedy = "Install it again: pip install --force-reinstall copsense."
    if ".so" in str(error):
        # Pinocchio's wheels take OpenMP from the system, which slim containers leave out.
        remedy = "Install that library of the system (libgomp on Debian: apt install libgomp1)."
    return f"a package that copsense needs cannot be loaded: {error}. {remedy}"


def _show_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    echo_notes([str(message)])
