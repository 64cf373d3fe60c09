"""Export: a view as one page that needs no network and no copsense."""

from __future__ import annotations

import html
from pathlib import Path

import numpy as np

from copsense._version import __version__
from copsense.errors import InvalidInputError
from copsense.explore.drawing import OPACITY, Scene, Shown, criterion_colours, place_camera
from copsense.explore.model import Model
from copsense.explore.playback import PlayedModel, frame_rows
from copsense.explore.server import GuardedServer
from copsense.explore.shape import Shape, load_shape
from copsense.explore.state import State
from copsense.explore.view import View
from copsense.files import check_output, write_beside

_STYLE = """
:root { color-scheme: light dark; }
body { font: 15px/1.45 system-ui, sans-serif; margin: 0 auto; max-width: 70rem; padding: 1rem; }
h1 { font-size: 1.3rem; margin: 0 0 .3rem; }
iframe { width: 100%; height: min(70vh, 42rem); border: 1px solid #8886; border-radius: .4rem; }
table { border-spacing: 0; }
td, th { padding: .1rem .9rem .1rem 0; text-align: left; white-space: nowrap; }
.wide { overflow-x: auto; }
code { overflow-wrap: anywhere; font-size: .85em; }
footer { opacity: .75; font-size: .85em; margin-top: 1rem; }
"""


def page_of(model: Model, state: State, *, meshes: bool = False) -> str:
    """A view as a self-contained page: the robot in 3-D, the table, the command.

    Args:
        model: the stance.
        state: what is shown.
        meshes: show the robot's meshes; the page then holds them and says who made them. If not,
            the stick figure.

    Raises:
        InvalidInputError: the state has no posture.
        MissingExtraError: viser is not installed.
    """
    if isinstance(model, PlayedModel):
        model.row = 0
    view = model.view(state)
    if view.reason:
        raise InvalidInputError(view.reason)
    view = model.add_regions(view)
    films = _frames(model, state, view)
    shape = load_shape(model.stance.robot) if meshes else Shape()
    scene = _scene_html(view, shape, films)
    return _page(model, view, scene, shape.licences)


def export_page(
    model: Model, state: State, path: str | Path, *, meshes: bool = False, overwrite: bool = False
) -> Path:
    """Write `page_of` to a file.

    Raises:
        OutputError: it cannot be written, or is there already.
        InvalidInputError: the state has no posture.
    """
    target = check_output(path, suffixes=(".html",), overwrite=overwrite)
    text = page_of(model, state, meshes=meshes)
    write_beside(target, lambda temporary: temporary.write_text(text, encoding="utf-8"))
    return target


Frame = tuple[View, np.ndarray | None]  # and what was measured


def _frames(model: Model, state: State, view: View) -> tuple[list[Frame], float]:
    """The views of a playback, and the seconds between them; of another model its one view."""
    if not isinstance(model, PlayedModel):
        return [(view, None)], 0.0
    rows, seconds = frame_rows(model.playback)
    found = []
    for row in rows:
        model.row = row
        found.append((model.view(state), model.measured(row)))
    return found, seconds


def _scene_html(view: View, shape: Shape, frames: tuple[list[Frame], float]) -> str:
    """The scene as a page of viser's own client, with a bar to play where there are frames."""
    server = GuardedServer()
    try:
        scene = Scene(server.viser, view, shape, light=True)
        names = [each.name for each in view.criteria]
        shown = Shown(torques=names[-1] if names else "", opacity=OPACITY)
        scene.show(view, shown)
        place_camera(server.viser, view)
        recording = server.viser.get_scene_serializer()
        for each, measured in frames[0] if len(frames[0]) > 1 else []:
            scene.show(each, shown)
            scene.show_reference(measured)
            recording.insert_sleep(frames[1])
        return str(recording.as_html())
    finally:
        server.stop()


def _page(model: Model, view: View, scene: str, licences: tuple[str, ...]) -> str:
    colours = criterion_colours([each.name for each in view.criteria])

    def text(value: object) -> str:
        return html.escape(str(value), quote=True)

    def row(cells: tuple[str, ...]) -> str:
        red, green, blue = colours[cells[0]]
        dot = f'<span style="color:rgb({red},{green},{blue})">&#9679;</span> '
        inside = "".join(f"<td>{dot * (i == 0)}{text(c)}</td>" for i, c in enumerate(cells))
        return f"<tr>{inside}</tr>"

    heads = ("criterion", "contact", "load", "CoP x, y [mm]", "margin [mm]", "CoM travel [mm]")
    table = "".join(f"<th>{head}</th>" for head in heads)
    rows = "".join(row(each) for each in view.rows)
    if isinstance(model, PlayedModel):
        rows += '<tr><td colspan="6">(of the first posture that is played)</td></tr>'
    notes = "".join(f"<li>{text(note)}</li>" for note in view.notes)
    made = "".join(f"<p>{text(each)}</p>" for each in licences)
    name = text(model.stance.robot.name)
    frame = html.escape(scene, quote=True)
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{name}</title><style>{_STYLE}</style></head><body>"
        f"<h1>{name}</h1><p>{text(view.verdict)}.</p>"
        f'<iframe sandbox="allow-scripts" title="{name} in 3-D" srcdoc="{frame}"></iframe>'
        f'<div class="wide"><table><tr>{table}</tr>{rows}</table></div>'
        f"<ul>{notes}</ul><p><code>{text(model.code(view.state)[0])}</code></p>"
        f"<footer>{made}<p>Made by copsense {__version__}; the 3-D view is by viser "
        "(MIT licence).</p></footer></body></html>\n"
    )
