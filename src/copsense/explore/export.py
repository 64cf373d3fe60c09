"""Export: a view as one page that needs no network and no copsense."""

from __future__ import annotations

import html
from pathlib import Path

from copsense._version import __version__
from copsense.errors import InvalidInputError
from copsense.explore.drawing import OPACITY, Scene, Shown, criterion_colours, place_camera
from copsense.explore.model import Model
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
    view = model.view(state)
    if view.reason:
        raise InvalidInputError(view.reason)
    view = model.add_regions(view)
    shape = load_shape(model.stance.robot) if meshes else Shape()
    scene = _scene_html(view, shape)
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


def _scene_html(view: View, shape: Shape) -> str:
    """The scene as a page of viser's own client."""
    server = GuardedServer()
    try:
        scene = Scene(server.viser, view, shape, light=True)
        names = [each.name for each in view.criteria]
        scene.show(view, Shown(torques=names[-1] if names else "", opacity=OPACITY))
        place_camera(server.viser, view)
        return str(server.viser.get_scene_serializer().as_html())
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
        f"<ul>{notes}</ul><p><code>{text(view.state.to_command())}</code></p>"
        f"<footer>{made}<p>Made by copsense {__version__}; the 3-D view is by viser "
        "(MIT licence).</p></footer></body></html>\n"
    )
