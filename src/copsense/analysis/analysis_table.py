"""An analysis as text, as HTML and as a table; all of the same rows."""

from __future__ import annotations

import html as markup
import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from copsense.analysis.limit_lines import clipped, limit_lines
from copsense.analysis.spread_lines import spread_lines
from copsense.analysis.sway_lines import sway_lines
from copsense.extras import require

if TYPE_CHECKING:
    import pandas as pd

Unit = str
_COLUMNS = (
    "contact",
    "load",
    "CoP x, y [mm]",
    "margin [mm]",
    "dCoP_y/dCoM_y",
    "energy gain",
    "CoM travel [mm]: tips",
    "over edge",
    "unloads",
)
_POINT_COLUMNS = ("contact", "load", "dload/dCoM x, y [1/m]", "CoM travel [mm]: unloads")
_TO_THE_LEFT = ("contact", "margin [mm]")  # words; numbers are aligned to the right


def text(data: dict[str, Any], joint_unit: Unit) -> str:
    """The analysis as ``copsense analyse`` prints it, without the notes."""
    lines = [*_heading(data)]
    for name, row in data["criteria"].items():
        columns, cells = _cells(row, joint_unit, data["com_span"])
        widths = [max(map(len, column)) for column in zip(columns, *cells, strict=True)]
        lines += ["", _title(name, row)]
        for line in (columns, *cells):
            padded = [
                word.ljust(width) if column in _TO_THE_LEFT else word.rjust(width)
                for column, word, width in zip(columns, line, widths, strict=True)
            ]
            lines.append(f"  {'  '.join(padded)}".rstrip())
        lines += [f"  {line}" for line in _below(row, data["com_span"])]
    return "\n".join([*lines, "", data["verdict"]])


def html(data: dict[str, Any], joint_unit: Unit) -> str:
    """The analysis for notebooks."""
    parts = [f"<p>{'<br>'.join(map(markup.escape, _heading(data)))}</p>"]
    for name, row in data["criteria"].items():
        columns, cells = _cells(row, joint_unit, data["com_span"])
        head = "".join(f"<th>{markup.escape(column)}</th>" for column in columns)
        body = "".join(
            f"<tr>{''.join(f'<td>{markup.escape(word)}</td>' for word in line)}</tr>"
            for line in cells
        )
        below = "<br>".join(map(markup.escape, _below(row, data["com_span"])))
        parts.append(
            f"<table><caption>{markup.escape(_title(name, row))}</caption><thead><tr>{head}</tr>"
            f"</thead><tbody>{body}</tbody></table>" + (f"<p>{below}</p>" if below else "")
        )
    parts.append(f"<p><strong>{markup.escape(data['verdict'])}</strong></p>")
    notes = "".join(f"<li>{markup.escape(note)}</li>" for note in data["notes"])
    return "\n".join(parts) + (f"<ul>{notes}</ul>" if notes else "")


def table(data: dict[str, Any]) -> pd.DataFrame:
    """A row per criterion and contact, vectors as a column per component."""
    require("pandas", "a table")
    import pandas as pd

    axes = {
        "wrench": ("fx", "fy", "fz", "mx", "my", "mz"),
        "cop_gain": ("x_x", "x_y", "y_x", "y_y"),
    }
    rows = []
    for criterion, found in data["criteria"].items():
        for contact, values in found["contacts"].items():
            row: dict[str, Any] = {"criterion": criterion, "contact": contact}
            for name, value in values.items():
                if getattr(value, "ndim", 0):
                    labels = axes.get(name, ("x", "y"))
                    flat = value.ravel().tolist()
                    row |= {f"{name}_{a}": v for a, v in zip(labels, flat, strict=True)}
                else:
                    row[name] = value
            rows.append(row)
    return pd.DataFrame(rows)


def _below(row: dict[str, Any], span: float) -> tuple[str, ...]:
    """What stands under the table of one criterion."""
    return (*limit_lines(row, span), *sway_lines(row), *spread_lines(row))


def _heading(data: dict[str, Any]) -> Iterator[str]:
    com = ", ".join(f"{round(float(value), 4) + 0.0:+.4f}" for value in data["com"])
    yield f"{data['robot']}: {data['mass']:.2f} kg, CoM ({com}) m, world axes"
    count, motions = len(data["contacts"]), data["admissible_motions"]
    yield (
        f"{count} contact{'s' * (count != 1)}, {motions} admissible motion{'s' * (motions != 1)}"
    )
    margin = data["support_margin"]
    if margin is not None:
        where = "inside" if margin >= 0 else "outside"
        yield (
            f"the centre of pressure of the whole robot is {abs(margin) * 1e3:.1f} mm {where} the "
            "support polygon"
        )


def _title(name: str, row: dict[str, Any]) -> str:
    return f"{name}: torque norm {row['torque_norm']:.2f} N m, residual {row['residual']:.1e} N"


def _cells(row: dict[str, Any], joint_unit: Unit, span: float) -> tuple[list[str], list[list[str]]]:
    """Headings, and a line of words per contact."""
    contacts = row["contacts"]
    if all(c["kind"] == "point" for c in contacts.values()):
        return _point_cells(row, span)
    along = [
        key for key in next(iter(contacts.values())) if key.startswith("cop_per_")
    ]  # one at most
    per, scale = ("mm/mm", 1.0) if joint_unit == "m" else ("mm/deg", 1e3 * math.pi / 180)
    columns = [*_COLUMNS, *(f"dCoP_y/d{key.removeprefix('cop_per_')} [{per}]" for key in along)]
    pulls = any(c["pulling"] for c in contacts.values())
    lines = []
    for name, c in contacts.items():
        x, y = (round(float(value) * 1e3, 2) + 0.0 for value in c["cop"])
        margin = f"{c['margin'] * 1e3:5.1f} to {c['margin_side']}" if "margin" in c else "-"
        edge = "-" if c["tipping_edge"] is None or clipped(row) else str(c["tipping_edge"])
        lines.append(
            [
                name,
                f"{c['load_share']:.3f}",
                f"{x:+.2f}, {y:+7.2f}",
                margin,
                f"{c['cop_gain'][1][1]:.3f}",
                f"{c['worst_case_gain']:.3f}",
                _travel(c["com_travel"], row, span),
                edge,
                _travel(c["unloading_travel"], row, span),
                *(f"{c[key][1] * scale:.3f}" for key in along),
                *(["PULLING" if c["pulling"] else ""] if pulls else []),
            ]
        )
    return columns + [""] * pulls, lines


def _point_cells(row: dict[str, Any], span: float) -> tuple[list[str], list[list[str]]]:
    """The same where every contact is a point: how the load moves, and when one carries none."""
    contacts = row["contacts"]
    pulls = any(c["pulling"] for c in contacts.values())
    lines = []
    for name, c in contacts.items():
        x, y = (round(float(gain), 4) + 0.0 for gain in c["load_gain"])
        lines.append(
            [
                name,
                f"{c['load_share']:.3f}",
                f"{x:+.3f}, {y:+.3f}",
                _travel(c["unloading_travel"], row, span),
                *(["PULLING" if c["pulling"] else ""] if pulls else []),
            ]
        )
    return [*_POINT_COLUMNS] + [""] * pulls, lines


def _travel(travel: float, row: dict[str, Any], span: float) -> str:
    """A travel; farther than the CoM can go with its contacts in place is never, or already so."""
    if clipped(row):
        return "clipped"
    if abs(travel) <= span:
        return f"{travel * 1e3:.1f}"
    return "never" if travel > 0 else "already"
