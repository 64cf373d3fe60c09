"""typeset: the plain text of claims and errata with Greek letters, indices and exponents."""

from __future__ import annotations

import re

from markupsafe import Markup, escape

_GREEK = {
    "xi": "ξ",
    "kappa": "κ",
    "eta": "η",
    "chi": "χ",
    "tau": "τ",
    "lambda": "λ",
    "rho": "ρ",
    "Delta": "Δ",
    "Lambda": "Λ",
}
_LETTER = re.compile(r"(?<![A-Za-z])(d?)(" + "|".join(_GREEK) + r")(?![a-z])")
# an index of one or two letters or digits; l_hip_roll is a name
_INDEX = re.compile(r"(?<![A-Za-z_])([A-Za-zΑ-ω]{1,4}|1)_([A-Za-z0-9]{1,2})(?![A-Za-z0-9_])")
_POWER = re.compile(r"(?<![A-Za-z0-9])(\d(?:\.\d+)?)e([+-])0?(\d+)(?![0-9])")
_RAISED = re.compile(r"\^(-1|\+)")


def typeset(text: str) -> Markup:
    """Typeset a line of plain text; everything else in it is escaped."""
    line = str(escape(text))
    line = _LETTER.sub(lambda m: m[1] + _GREEK[m[2]], line)
    line = line.replace("Δ ξ", "Δξ").replace(" != ", " ≠ ").replace("&lt;&lt;", "≪")
    line = _INDEX.sub(r"\1<sub>\2</sub>", line)
    line = _RAISED.sub(lambda m: f"<sup>{m[1].replace('-', '−')}</sup>", line)
    return Markup(_POWER.sub(_power, line))


def _power(match: re.Match[str]) -> str:
    sign = "−" if match[2] == "-" else ""
    power = f"10<sup>{sign}{match[3]}</sup>"
    return power if match[1] == "1" else f"{match[1]}·{power}"
