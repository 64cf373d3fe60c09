"""``copsense explore``: a robot in the browser."""

from __future__ import annotations

import socket
import sys
from pathlib import Path
from typing import Any

import click

from copsense.cli.criterion_options import criterion_options
from copsense.cli.limit_options import read_limits
from copsense.cli.option_lists import SectionedCommand
from copsense.cli.printing import echo_json, echo_written, progress_bar
from copsense.cli.stance_memory import remembered_stance, written
from copsense.cli.stance_options import read_stance, stance_options, standing_options
from copsense.cli.units import read_coordinates, read_positions
from copsense.errors import InvalidInputError

_NOT_WHERE_IT_STANDS = ("limits", "save_stance", "force_stance")  # of `standing_options`


@click.command(
    cls=SectionedCommand,
    epilog="\b\nExamples:\n"
    "  copsense explore icub\n"
    "  copsense explore my.urdf --contact l_foot --contact r_foot --contact-at sole\n"
    "  copsense explore talos --com-y 30mm --limits friction=0.5,torque=model\n"
    "  copsense explore icub --com-y 30mm --export icub.html\n"
    "  copsense explore icub --recording run.nc",
)
@stance_options
@criterion_options
@click.option(
    "--port", type=click.IntRange(0, 65535), default=0, help="Where to listen; 0 for any free port."
)
@click.option(
    "--host",
    default="127.0.0.1",
    show_default=True,
    help="Address of this machine to listen at; another than the default can be reached from the "
    "network, by the whole address with its token.",
)
@click.option("--no-browser", is_flag=True, help="Print the address alone; do not open it.")
@click.option("--no-meshes", is_flag=True, help="Show the stick figure, not the robot's meshes.")
@click.option("--dark", is_flag=True, help="A dark page.")
@click.option("--light", is_flag=True, help="Draw less, for machines without a GPU.")
@click.option(
    "--export",
    type=click.Path(),
    help="Write the view as one self-contained page (.html), and do not listen. It shows the stick "
    "figure; see --meshes.",
)
@click.option(
    "--meshes",
    is_flag=True,
    help="Put the robot's meshes into the page of --export, and name who made them: who passes "
    "the page on passes them on.",
)
@click.option(
    "--recording",
    type=click.Path(dir_okay=False),
    help="Play a file of copsense balance or copsense sweep (.nc), or a robot's own log, instead "
    "of moving the robot: measured centres of pressure beside the criteria's at rest and in "
    "motion; with --export as a film in the page.",
)
@click.option(
    "--map",
    "map_file",
    metavar="MAP.toml",
    help="Which signal of a log is what, as copsense log --save-map writes it.",
)
@click.option("--force", is_flag=True, help="Overwrite the page.")
@click.option("--json", "as_json", is_flag=True, help="Print the address as JSON.")
def explore(
    robot: str | None,
    criteria: tuple[str, ...],
    characteristic_length: float,
    limits: str | None,
    port: int,
    host: str,
    no_browser: bool,
    no_meshes: bool,
    light: bool,
    dark: bool,
    export: str | None,
    meshes: bool,
    recording: str | None,
    map_file: str | None,
    force: bool,
    as_json: bool,
    **options: Any,
) -> None:
    """Show ROBOT in the browser, with sliders for its posture, criteria and limits.

    ROBOT is a name from `copsense robots`, the path of a URDF, MJCF or SDF, or a stance file
    (.toml). What is shown has the numbers of `copsense analyse`; "copy command" gives the line that
    prints them. Only this machine can connect, and only by the whole address that is printed.
    Ctrl-C ends it. In Python: copsense.explore.
    """
    from copsense.extras import require
    from copsense.files import check_output

    require("viser", "an explorer in the browser")
    if export is not None:
        check_output(export, suffixes=(".html",), overwrite=force)
    elif meshes or force:
        raise InvalidInputError("--meshes and --force are of the page that --export writes.")
    from copsense.explore import Model, Setting, State

    within = read_limits(limits)
    # The sliders begin where the options put the robot: the stance is the one before that.
    asked = {f"com_{axis}": options.pop(f"com_{axis}") for axis in "xyz"}
    joints, at = options.pop("joints"), options.pop("at")
    kept, overwrite = options.pop("save_stance"), options.pop("force_stance")
    stance = read_stance(robot, **options)
    file = remembered_stance()
    words = stance_words(sys.argv[1:])
    criteria_of_file = file.criteria or None if file else None
    limits_of_file = file.limits if file else None
    if recording is None and map_file is not None:
        raise InvalidInputError("--map is of a log that --recording plays.")
    if recording is None:
        model = Model(stance, words, criteria=criteria_of_file, limits=limits_of_file)
    else:
        from copsense.explore.playback import load_run
        from copsense.explore.played_model import PlayedModel

        if joints or at or any(value is not None for value in asked.values()):
            raise InvalidInputError(
                "--recording says where the robot is, and so do --com-x, --com-y, --com-z, --joint "
                "and --at. Give one of them."
            )
        size = Path(recording).stat().st_size if Path(recording).is_file() else None
        with progress_bar(size, f"reading {Path(recording).name}", "B") as advance:
            run = load_run(recording, stance, map_file, advance)
        model = PlayedModel(run, words, criteria=criteria_of_file, limits=limits_of_file)
    coordinates = {n: Setting(v, "m") for n, v in asked.items() if v is not None}
    for name, value in read_positions(joints, stance.robot).items():
        coordinates[name] = Setting(value, stance.robot.joint_unit(name))
    held = read_coordinates(at, stance)
    if held and coordinates:
        raise InvalidInputError(
            "--at says where the CoM and the joints are, and so do --com-x, --com-y, --com-z and "
            "--joint. Give --at alone, or the others alone."
        )
    for name, value in held.items():
        coordinates[name] = Setting(value, model.coordinates[name].unit)
    state = State(
        model.words,
        coordinates,
        bool(held),
        criteria,
        characteristic_length,
        "own" if limits is None or within is None else within,
        frozenset({"curve"}),
    )
    model.criteria_of(state)  # or an error before the window opens
    if kept is not None:
        source, folders = (file.source, file.package_dirs) if file else (robot or "", ())
        folders = options["package_dirs"] or folders
        written(model.posture(state), kept, source, overwrite, folders)
    if export is not None:
        from copsense.explore.export import export_page, frames_of

        with progress_bar(frames_of(model), "drawing", "frame") as advance:
            export_page(model, state, Path(export), meshes=meshes, overwrite=force, advance=advance)
        echo_written(export)
        return
    _serve(model, state, port, host, no_browser, not no_meshes, light, dark, as_json)


def _serve(
    model: Any,
    state: Any,
    port: int,
    host: str,
    no_browser: bool,
    meshes: bool,
    light: bool,
    dark: bool,
    as_json: bool,
) -> None:
    """Listen until Ctrl-C."""
    import signal
    import threading
    import webbrowser

    from copsense.explore.explorer import Explorer

    over = threading.Event()
    with Explorer(
        model, state, port=port, host=host, meshes=meshes, light=light, dark=dark
    ) as explorer:
        # Background jobs of a shell ignore SIGINT; one that is sent, or a SIGTERM, is to end it.
        for each in (signal.SIGINT, signal.SIGTERM):
            signal.signal(each, lambda *_: over.set())
        if as_json:
            echo_json({"url": explorer.url, "seconds": explorer.seconds})
        else:
            click.echo(f"exploring {model.stance.robot.name} at {explorer.url}")
            click.echo("Ctrl-C ends it.", err=True)
        if host not in ("127.0.0.1", "localhost", "::1"):
            click.echo(
                f"note: {host} can be reached from the network; who knows the address can connect. "
                f"From another machine put this one's name or address ({socket.gethostname()}) in "
                "place of the address's own.",
                err=True,
            )
        sys.stdout.flush()
        if not no_browser:
            webbrowser.open(explorer.url)
        while not over.wait(0.5):
            pass


def stance_words(arguments: list[str]) -> list[str]:
    """The words of a command line that say which stance is meant, without the command's name.

    Args:
        arguments: those of the command line, the command's name first.
    """
    own, words, rest = _of_the_window(), [], iter(arguments[1:])
    for word in rest:
        option, equals, _ = word.partition("=")
        if option in own:
            for _ in range(0 if equals else own[option]):
                next(rest, None)
        else:
            words.append(word)
    return words


def _of_the_window() -> dict[str, int]:
    """Options of this command that do not say which stance is meant -> words after each."""
    standing = {param.name for param in click.command()(standing_options(lambda: None)).params}
    standing -= set(_NOT_WHERE_IT_STANDS)
    return {
        option: 0 if param.is_flag else param.nargs
        for param in explore.params
        if isinstance(param, click.Option) and param.name not in standing
        for option in param.opts
    }
