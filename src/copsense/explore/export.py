"""Export: a view, or a run of them, as one page that needs no network and no copsense."""

from __future__ import annotations

import html
import shlex
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeAlias

import numpy as np

from copsense._version import __version__
from copsense.errors import InvalidInputError
from copsense.explore.drawing import Colour, criterion_colours
from copsense.explore.film import client_notices, coloured_by, film_html
from copsense.explore.model import Model
from copsense.explore.panel_html import torque_scale_html
from copsense.explore.playback import frame_rows
from copsense.explore.played_model import PlayedModel
from copsense.explore.shape import Shape, load_shape
from copsense.explore.state import State
from copsense.explore.view import View
from copsense.files import check_output, write_beside
from copsense.posture_run import PostureRun

Parts: TypeAlias = tuple[str, str]  # of a page, above its picture and below
RATE = 25.0  # frames a second
_STYLE = """
:root { color-scheme: light dark; }
body { font: 15px/1.45 system-ui, sans-serif; margin: 0 auto; max-width: 70rem; padding: 1rem; }
h1 { font-size: 1.3rem; margin: 0 0 .3rem; }
iframe { width: 100%; height: min(70vh, 42rem); border: 1px solid #8886; border-radius: .4rem; }
table { border-spacing: 0; }
td, th { padding: .1rem .9rem .1rem 0; text-align: left; white-space: nowrap; }
.wide { overflow-x: auto; }
code { overflow-wrap: anywhere; font-size: .85em; }
footer, .marks { opacity: .75; font-size: .85em; }
"""
# A frame without WebGL would stay empty, and say nothing.
_FLAT = (
    '<p id="flat" hidden>This browser has no WebGL, so the picture in 3-D is left out. The numbers '
    "below are its own.</p><script>{const c = document.createElement('canvas'); "
    "if (!(c.getContext('webgl2') || c.getContext('webgl'))) {"
    "document.getElementById('flat').hidden = false; document.querySelector('iframe').remove();}}"
    "</script>"
)
_HEADS = ("criterion", "contact", "load", "CoP x, y [mm]", "margin [mm]", "CoM travel [mm]")
_FILM_HEADS = ("centres of pressure", "least margin [mm]", "of", "at")


def page_of(
    model: Model,
    state: State,
    *,
    meshes: bool = False,
    rate: float = RATE,
    command: str | None = None,
    advance: Callable[[int], object] = lambda _: None,
) -> str:
    """A view, or a run, as a self-contained page: the robot in 3-D, a table, the command.

    Args:
        model: the stance; of a `PlayedModel` the page plays its run.
        state: what is shown.
        meshes: show the robot's meshes; the page then holds them and says who made them. If not,
            the stick figure.
        rate: frames a second of a run.
        command: the line that shows it again; default that of the model, empty for none.
        advance: called with the number of views that are done, `frames_of` in all.

    Raises:
        InvalidInputError: the state has no posture.
        MissingExtraError: viser is not installed.
    """
    shape = load_shape(model.stance.robot) if meshes else Shape()
    if isinstance(model, PlayedModel):
        rows, seconds = frame_rows(model.run, rate)
        views = played_views(model, state, rows, advance)
        scene = film_html(views, seconds, shape, advance)
        body = _run_body(model, rows, views)
        file = ("--recording", model.run.source)
        code = shlex.join(["copsense", "explore", *model.words, *file]) if model.run.python else ""
    else:
        view = model.view(state)
        if view.reason:
            raise InvalidInputError(view.reason)
        advance(1)
        view = model.add_regions(view)
        scene = film_html([view], shape=shape)
        advance(1)
        body, code = _view_body(view), model.code(state)[0]
    code = code if command is None else command
    return _page(model.stance.robot.name, scene, body, code, shape.licences)


def played_views(
    model: PlayedModel,
    state: State,
    rows: Sequence[int],
    advance: Callable[[int], object] = lambda _: None,
) -> list[View]:
    """The views of some rows of a run, in order; of a row that comes again the same.

    Args:
        model: what plays.
        state: what is shown.
        rows: which.
        advance: called with the number of rows that are done.
    """
    found: dict[int, View] = {}
    for row in rows:
        if row not in found:
            model.row = row
            found[row] = model.view(state)
        advance(1)
    model.row = rows[0]
    return [found[row] for row in rows]


def frames_of(model: Model | PostureRun, rate: float = RATE) -> int:
    """How many times `page_of` calls `advance` with 1."""
    run = model.run if isinstance(model, PlayedModel) else model
    return 2 * len(frame_rows(run, rate)[0]) if isinstance(run, PostureRun) else 2


def export_page(
    model: Model,
    state: State,
    path: str | Path,
    *,
    meshes: bool = False,
    overwrite: bool = False,
    rate: float = RATE,
    advance: Callable[[int], object] = lambda _: None,
) -> Path:
    """Write `page_of` to a file.

    Raises:
        OutputError: it cannot be written, or is there already.
        InvalidInputError: the state has no posture.
    """
    target = check_output(path, suffixes=(".html",), overwrite=overwrite)
    text = page_of(model, state, meshes=meshes, rate=rate, advance=advance)
    write_beside(target, lambda temporary: temporary.write_text(text, encoding="utf-8"))
    return target


def least_margins(run: PostureRun, views: Sequence[View]) -> dict[str, tuple[float, str, float]]:
    """The least margin that a run comes to [m], of which contact, and where along it.

    Args:
        run: what is played.
        views: of some of its rows.

    Returns:
        Criterion at rest or in motion, and ``"measured"``, in order; without those that have none.
    """
    found: dict[str, tuple[float, str, float]] = {}
    soles = [contact.sole for contact in run.stance.contacts]
    for view in views:
        assert view.row is not None
        cops = {f"{c.name}, at rest": c.cop for c in view.criteria}
        for c in view.criteria:
            if c.moving_cop is not None:
                cops[f"{c.name}, in motion"] = c.moving_cop
        if run.measured is not None:
            cops["measured"] = run.measured[view.row]
        for what, places in cops.items():
            for name, sole, cop in zip(view.contacts, soles, places, strict=True):
                margin = float(sole.margins(cop)) if sole and np.isfinite(cop).all() else np.inf
                if margin < found.get(what, (np.inf,))[0]:
                    found[what] = (margin, name, float(run.values[view.row]))
    order = {name: k for k, name in enumerate(c.name for c in views[0].criteria)}
    return dict(
        sorted(found.items(), key=lambda item: order.get(item[0].split(",")[0], len(order)))
    )


def marks_words(run: PostureRun) -> str:
    """What the marks of a film stand for."""
    moving = ", squares those that the recorded motion's inertia asks for"
    measured = ", diamonds what was measured"
    return (
        "Balls are the centres of pressure at rest"
        f"{moving * (run.velocities is not None)}{measured * (run.measured is not None)}."
    )


def _run_body(model: PlayedModel, rows: Sequence[int], views: Sequence[View]) -> Parts:
    run = model.run
    colours = criterion_colours([each.name for each in views[0].criteria])
    ends = f"{run.values[0]:.4g} to {run.values[-1]:.4g} {run.unit}".strip()
    table = [
        (
            what,
            f"{1e3 * margin:+.1f}",
            contact,
            f"{run.axis} = {value:.4g} {run.unit}".strip(),
        )
        for what, (margin, contact, value) in least_margins(run, views).items()
    ]
    marks = f'<p class="marks">{marks_words(run)}</p>{_scale(views[0])}'
    said = (
        f"{run.source}: {len(run)} postures, {run.axis} from {ends}, in {len(views)} frames. "
        "Play, scrub and speed are in the bar under the picture."
    )
    return f"<p>{_text(said)}</p>", f"{marks}{_table(_FILM_HEADS, table, colours)}"


def _view_body(view: View) -> Parts:
    colours = criterion_colours([each.name for each in view.criteria])
    notes = "".join(f"<li>{_text(note)}</li>" for note in view.notes)
    below = _table(_HEADS, view.rows, colours) + _scale(view) + f"<ul>{notes}</ul>" * bool(notes)
    return f"<p>{_text(view.verdict)}.</p>", below


def _scale(view: View) -> str:
    """What the joints' colours stand for."""
    name = coloured_by(view)
    words = torque_scale_html(name)
    return f'<p class="marks">{words[0].upper()}{words[1:]}</p>' * bool(name)


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]], colours: dict[str, Colour]) -> str:
    """A table whose rows begin with a criterion's name, each with its colour."""

    def row(cells: Sequence[str]) -> str:
        colour = colours.get(cells[0].partition(",")[0])
        shade = "" if colour is None else f' style="color:rgb{colour}"'
        dot = f"<span{shade}>&#9679;</span> " if colour is not None else ""
        inside = "".join(f"<td>{dot * (i == 0)}{_text(c)}</td>" for i, c in enumerate(cells))
        return f"<tr>{inside}</tr>"

    head = "".join(f"<th>{each}</th>" for each in heads)
    body = "".join(row(each) for each in rows)
    return f'<div class="wide"><table><tr>{head}</tr>{body}</table></div>' if rows else ""


def _page(name: str, scene: str, body: Parts, code: str, licences: Sequence[str]) -> str:
    name = _text(name)
    made = "".join(f"<p>{_text(each)}</p>" for each in licences)
    frame = (
        f'<iframe sandbox="allow-scripts" title="{name} in 3-D" '
        f'srcdoc="{html.escape(scene, quote=True)}"></iframe>'
    )
    before, after = body
    command = f"<p><code>{_text(code)}</code></p>" * bool(code)
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{name}</title><style>{_STYLE}</style></head><body>"
        f"<h1>{name}</h1>{before}{frame}{_FLAT}{after}{command}"
        f"<footer>{made}<p>Made by copsense {__version__}; the 3-D view is by viser.</p>"
        f"<details><summary>Licences of the 3-D view</summary><pre>{_text(client_notices())}</pre>"
        "</details></footer></body></html>\n"
    )


def _text(value: object) -> str:
    return html.escape(str(value), quote=True)
