"""render_page: a reproduction and its pictures as one HTML page."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping

from copsense.paper.claims import VERDICT_STANDARD, EvaluatedClaim, ReferenceValue, Verdict
from copsense.paper.errata import EvaluatedErratum
from copsense.paper.report.closed_loop_section import (
    score_rows,
    score_words,
    sway_differences,
    sway_rates,
    sway_runs,
)
from copsense.paper.report.real_section import real_commands, real_reach, real_rows, real_words
from copsense.paper.report.words import commands, differs, limit_words, limits, summary
from copsense.paper.reproduce import Reproduction
from copsense.paper.reproduce.real_robot import PUBLIC_PLACE
from copsense.reports import ReportFigure, ReportScene, read_number, render_template
from copsense.statics import ActiveSetChange

_MARKS = {
    Verdict.HOLDS: ("holds", "✓", "hold"),
    Verdict.HOLDS_IF: ("if", "◐", "hold if"),
    Verdict.DOES_NOT_HOLD: ("not", "✗", "do not hold"),
}


def render_page(
    reproduction: Reproduction,
    pictures: Mapping[str, bytes],
    figures: Iterable[ReportFigure],
    scenes: Iterable[ReportScene] = (),
    *,
    command: str,
) -> str:
    """Render the report; the same input gives the same text.

    Args:
        reproduction: what to report.
        pictures: figure's name -> its SVG.
        figures: the figures, in order.
        scenes: the views in 3-D.
        command: the command line that makes this report.

    Returns:
        HTML that needs no other file and no network.
    """
    values = {
        "summary": summary(reproduction),
        "counts": _counts(reproduction.claims),
        "standard": [
            (verdict.value.capitalize(), text) for verdict, text in VERDICT_STANDARD.items()
        ],
        "claim_tables": (
            ("the four-bar linkage", "four-bar", _claims(reproduction.four_bar_claims)),
            ("the iCub", "icub", _claims(reproduction.icub_claims)),
            *(
                (("the iCub in closed loop", "closed-loop", _claims(reproduction.sway_claims)),)
                if reproduction.sway
                else ()
            ),
        ),
        "commands": commands(reproduction, command),
        "real": {
            "words": real_words(reproduction.real),
            "rows": real_rows(reproduction.real),
            "reach": real_reach(reproduction.real),
            "commands": real_commands(),
            "place": PUBLIC_PLACE,
        },
        "errata": [_erratum(e) for e in reproduction.errata],
        "references": _references(reproduction),
        "agreeing": sum(r.agrees for r in reproduction.references),
        "parameters": reproduction.parameters,
        "versions": reproduction.versions,
        "timings": {stage: f"{s:.2f} s" for stage, s in reproduction.timings.items()},
        "limits": limits(reproduction),
        "limit_words": limit_words(reproduction.within_limits.limits),
        "bindings": [_binding(b) for b in reproduction.within_limits.bindings],
        "sway_runs": sway_runs(reproduction.sway) if reproduction.sway else [],
        "rates": sway_rates(reproduction.sway) if reproduction.sway else {},
        "scores": [] if reproduction.benchmark is None else score_rows(reproduction.benchmark),
        "score_words": ()
        if reproduction.benchmark is None
        else score_words(reproduction.benchmark),
        "sway_differences": sway_differences(reproduction.sway) if reproduction.sway else (),
    }
    package = "copsense.paper.report"
    return render_template("reproduction", [package], figures, pictures, values, scenes)


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
                "number": read_number(evaluated.number, evaluated.unit),
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
            "off": read_number(found.as_printed) if differs(evaluated) else "0",
            "hypothesis": found.hypothesis,
            "agreement": read_number(found.agreement),
        }
    return row


def _references(reproduction: Reproduction) -> list[dict[str, object]]:
    lowered = reproduction.references_at_sole
    return [
        {
            "quantity": row.quantity,
            "criterion": row.criterion,
            "reference": read_number(row.reference, row.unit),
            "measured": read_number(row.measured, row.unit),
            "agrees": row.agrees,
            "difference": _difference(row),
            "lowered": read_number(low.measured, low.unit),
        }
        for row, low in zip(reproduction.references, lowered, strict=True)
    ]


def _difference(row: ReferenceValue) -> str:
    part = (row.measured - row.reference) / abs(row.reference)
    return f"{round(part, 4) + 0.0:+.2%}"
