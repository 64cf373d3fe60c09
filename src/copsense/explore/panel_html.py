"""Panel's words: a view's numbers and notes as HTML, every name of a robot escaped."""

from __future__ import annotations

import html
import math
from collections.abc import Mapping

from copsense.errors import InvalidInputError
from copsense.explore.drawing import Colour, effort_colour
from copsense.explore.model import Model
from copsense.explore.state import Setting, State
from copsense.explore.view import View

_CELL = "padding:0 .4em .1em 0;max-width:8em;overflow-wrap:anywhere"


def css(colour: Colour) -> str:
    """A colour as style sheets have it."""
    return f"rgb({colour[0]},{colour[1]},{colour[2]})"


def _text(value: object) -> str:
    return html.escape(str(value), quote=True)


def small_html(text: str) -> str:
    """A remark beside controls."""
    return f'<div style="padding:0 .8em;font-size:.75em;opacity:.8">{_text(text)}</div>'


def status_html(view: View, status: str) -> str:
    """What yields first, or why there is no posture."""
    revision = f'<span id="copsense-revision" hidden>{view.revision}</span>'
    said = f'<div style="opacity:.7">{_text(status)}</div>' if status else ""
    if view.reason:
        said += (
            '<div style="background:#b3261e;color:white;padding:.4em .6em;border-radius:.3em">'
            f"{_text(view.reason)} The last posture is shown.</div>"
        )
    else:
        said += f'<div style="font-weight:600">{_text(view.verdict)}.</div>'
    return f'<div style="padding:0 .8em;font-size:.85em;line-height:1.35">{revision}{said}</div>'


def table_html(view: View, colours: Mapping[str, Colour]) -> str:
    """The table of a view."""
    parts, last = [], ""
    heads = ["contact", "load", "CoP x, y", "margin", "CoM travel"]
    rows = view.rows
    if all(row[4] == "-" for row in rows):  # no contact has a sole
        heads, rows = heads[:3] + heads[4:], [(*row[:4], row[5]) for row in rows]
    for criterion, *words in rows:
        if criterion != last:
            dot = css(colours[criterion])
            parts.append(
                f'<tr><th colspan="5" style="text-align:left;padding-top:.5em">'
                f'<span style="color:{dot}">&#9679;</span> {_text(criterion)}</th></tr>'
            )
            last = criterion
        cells = "".join(f'<td style="{_CELL}">{_text(word)}</td>' for word in words)
        parts.append(f"<tr>{cells}</tr>")
    head = "".join(f'<td style="opacity:.6;padding:0 .3em 0 0">{word}</td>' for word in heads)
    return (
        '<div style="padding:0 .8em;overflow-x:auto"><table style="font-size:.72em;'
        f'border-spacing:0;width:100%"><tr>{head}</tr>{"".join(parts)}</table>'
        f'<div style="font-size:.68em;opacity:.7">lengths in mm; {torque_scale_html()}</div></div>'
    )


def torque_scale_html(criterion: str = "") -> str:
    """What the joints' colours stand for, and of which criterion if it is named."""
    shades = ",".join(css(effort_colour(share)) for share in (0.0, 0.5, 1.0))
    of = f" under {_text(criterion)}" * bool(criterion)
    return (
        f"joints by torque{of}, from none to its limit (the largest, where the model has no "
        'limits): <span style="display:inline-block;width:5em;height:.7em;'
        f'background:linear-gradient(90deg,{shades})"></span>'
    )


def asked_html(state: State, model: Model) -> str:
    """What is asked for."""

    def said(name: str, setting: Setting) -> str:
        scaled = setting.value * 1e3 if setting.unit == "m" else math.degrees(setting.value)
        return f"{name} = {round(scaled, 1) + 0.0:g} {'mm' if setting.unit == 'm' else 'deg'}"

    asked = ", ".join(said(n, s) for n, s in state.coordinates.items())
    return small_html(f"asked for, in world axes: {asked or 'nothing, the stance itself'}")


def copy_html(model: Model, state: State, save: str) -> str:
    """Buttons that copy the Python of a state and the command, where there is one; the command."""
    try:
        command, python = model.code(state)
    except InvalidInputError as error:
        return f'<div style="padding:0 .8em;font-size:.75em">no command: {_text(error)}</div>'
    buttons = "".join(
        '<button style="margin:0 .5em .3em 0;padding:.25em .7em;border-radius:.3em;border:1px solid'
        ' #8888;cursor:pointer;font-size:.8em" data-text="'
        f'{_text(text)}" onclick="navigator.clipboard.writeText(this.dataset.text)'
        ".then(() => {const was = this.innerText; this.innerText = 'copied';"
        f'setTimeout(() => this.innerText = was, 900)}})">{label}</button>'
        for label, text in (("copy command", command), ("copy Python", python))
        if label == "copy Python" or not command.startswith("#")  # of a run's row none does
    )
    saved = f'<div style="font-size:.75em">{_text(save)}</div>' if save else ""
    return (
        f'<div style="padding:0 .8em">{buttons}{saved}<code id="copsense-command" style="display:'
        f'block;font-size:.68em;overflow-wrap:anywhere;opacity:.8">{_text(command)}</code></div>'
    )


def notes_html(view: View) -> str:
    """What binds, and what else to know."""
    lines = [*view.motion_lines, *(view.binding or ()), *view.notes]
    for each in view.criteria:
        lines += [f"{each.name}, active: {'; '.join(each.active[:6])}"] * bool(each.active)
        lines += [f"{each.name}, nearest: {'; '.join(each.nearest)}"] * bool(each.nearest)
    items = "".join(f"<li>{_text(line)}</li>" for line in lines)
    return (
        f'<ul style="padding:0 .8em 0 2em;font-size:.75em;line-height:1.35">{items}</ul>'
        if items
        else ""
    )
