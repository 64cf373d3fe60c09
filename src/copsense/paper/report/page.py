"""render_page: a reproduction and its pictures as one HTML page."""

from __future__ import annotations

import base64
from collections import Counter
from collections.abc import Iterable, Mapping
from importlib.resources import files

from jinja2 import Environment, StrictUndefined

from copsense.paper.claims import VERDICT_STANDARD, EvaluatedClaim, ReferenceValue, Verdict
from copsense.paper.errata import EvaluatedErratum
from copsense.paper.report.closed_loop_section import (
    score_rows,
    score_words,
    sway_differences,
    sway_rates,
    sway_runs,
)
from copsense.paper.report.report_figure import ReportFigure
from copsense.paper.report.typesetting import typeset
from copsense.paper.report.words import commands, differs, limit_words, limits, summary
from copsense.paper.reproduce import Reproduction
from copsense.statics import ActiveSetChange

_MARKS = {
    Verdict.HOLDS: ("holds", "✓", "hold"),
    Verdict.HOLDS_IF: ("if", "◐", "hold if"),
    Verdict.DOES_NOT_HOLD: ("not", "✗", "do not hold"),
}
_ROUNDING = 1e-9


def render_page(
    reproduction: Reproduction,
    pictures: Mapping[str, bytes],
    figures: Iterable[ReportFigure],
    *,
    command: str,
) -> str:
    """Render the report; the same input gives the same text.

    Args:
        reproduction: what to report.
        pictures: figure's name -> its SVG.
        figures: the figures, in order.
        command: the command line that makes this report.

    Returns:
        HTML that needs no other file and no network.
    """
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters["typeset"] = typeset
    folder = files("copsense.paper.report")
    template = environment.from_string((folder / "report.html.jinja").read_text("utf-8"))
    shown: dict[str, list[dict[str, object]]] = {}
    for figure in figures:
        address = base64.b64encode(pictures[figure.name]).decode("ascii")
        shown.setdefault(figure.section, []).append(
            {"figure": figure, "source": f"data:image/svg+xml;base64,{address}"}
        )
    return template.render(
        style=(folder / "report.css").read_text("utf-8"),
        summary=summary(reproduction),
        counts=_counts(reproduction.claims),
        standard=[(verdict.value.capitalize(), text) for verdict, text in VERDICT_STANDARD.items()],
        claim_tables=(
            ("the four-bar linkage", "four-bar", _claims(reproduction.four_bar_claims)),
            ("the iCub", "icub", _claims(reproduction.icub_claims)),
            *(
                (("the iCub in closed loop", "closed-loop", _claims(reproduction.sway_claims)),)
                if reproduction.sway
                else ()
            ),
        ),
        figures=shown,
        commands=commands(reproduction, command),
        errata=[_erratum(e) for e in reproduction.errata],
        references=_references(reproduction),
        agreeing=sum(r.agrees for r in reproduction.references),
        parameters=reproduction.parameters,
        versions=reproduction.versions,
        timings={stage: f"{s:.2f} s" for stage, s in reproduction.timings.items()},
        limits=limits(reproduction),
        limit_words=limit_words(reproduction.within_limits.limits),
        bindings=[_binding(b) for b in reproduction.within_limits.bindings],
        sway_runs=sway_runs(reproduction.sway) if reproduction.sway else [],
        rates=sway_rates(reproduction.sway) if reproduction.sway else {},
        scores=[] if reproduction.benchmark is None else score_rows(reproduction.benchmark),
        score_words=() if reproduction.benchmark is None else score_words(reproduction.benchmark),
        sway_differences=sway_differences(reproduction.sway) if reproduction.sway else (),
    )


def number(value: float, unit: str = "1") -> str:
    """A number to read: four digits, millimetres for short lengths, no unit if it has none."""
    if unit == "m" and 1e-6 < abs(value) < 1.0:
        return f"{value * 1e3:.4g} mm"
    if abs(value) < _ROUNDING:
        text = f"{value:.0e}" if value else "0"  # its digits say nothing
    else:
        text = f"{value:.1e}" if abs(value) < 1e-4 else f"{value:.4g}"
    return text if unit == "1" else f"{text} {unit}"


def _binding(found: ActiveSetChange) -> dict[str, str]:
    sides = {
        name: "none" if side is None else ", ".join(f"{slope:.3f}" for slope in side[:, 1] + 0.0)
        for name, side in (("before", found.before), ("after", found.after))
    }
    where = f"{found.value * 1e3:+.2f} mm"
    limit = found.name if found.binds else f"{found.name} lets go"
    return {"criterion": found.criterion, "limit": limit, "com_y": where} | sides


def _counts(claims: tuple[EvaluatedClaim, ...]) -> list[dict[str, object]]:
    found = Counter(claim.verdict for claim in claims)
    return [
        {"words": words, "kind": kind, "mark": mark, "count": found[verdict]}
        for verdict, (kind, mark, words) in _MARKS.items()
    ]


def _claims(claims: tuple[EvaluatedClaim, ...]) -> list[dict[str, str]]:
    rows = []
    for evaluated in claims:
        kind, mark, _ = _MARKS[evaluated.verdict]
        rows.append(
            {
                "identifier": evaluated.claim.identifier,
                "where": evaluated.claim.where,
                "statement": evaluated.claim.statement,
                "verdict": evaluated.verdict.value,
                "kind": kind,
                "mark": mark,
                "number": number(evaluated.number, evaluated.unit),
                "explanation": evaluated.explanation,
                "condition": evaluated.condition,
            }
        )
    return rows


def _erratum(evaluated: EvaluatedErratum) -> dict[str, str]:
    erratum, found = evaluated.erratum, evaluated.discrepancy
    row = {
        "where": erratum.equation,
        "printed": erratum.printed,
        "holds": erratum.holds,
        "note": erratum.note,
        "measure": "",
        "off": "",
        "hypothesis": "",
        "agreement": "",
    }
    if found is not None:
        row |= {
            "measure": found.measure,
            "off": number(found.as_printed) if differs(evaluated) else "0",
            "hypothesis": found.hypothesis,
            "agreement": number(found.agreement),
        }
    return row


def _references(reproduction: Reproduction) -> list[dict[str, object]]:
    lowered = reproduction.references_at_sole
    return [
        {
            "quantity": row.quantity,
            "criterion": row.criterion,
            "reference": number(row.reference, row.unit),
            "measured": number(row.measured, row.unit),
            "agrees": row.agrees,
            "difference": _difference(row),
            "lowered": number(low.measured, low.unit),
        }
        for row, low in zip(reproduction.references, lowered, strict=True)
    ]


def _difference(row: ReferenceValue) -> str:
    part = (row.measured - row.reference) / abs(row.reference)
    return f"{round(part, 4) + 0.0:+.2%}"
