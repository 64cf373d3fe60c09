"""Formula: a formula written as plain text, which can be evaluated and typeset in LaTeX.

Factors stand side by side, as on paper: ``4 kappa l c / (d² + 4 ± 2 kappa l d c)``. One quotient
per product, so that nothing depends on how ``a / b c`` is read. ± and ∓ take the sign of a side.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

from copsense.errors import InvalidInputError

_TOKEN = re.compile(r"\s*(\d+(?:\.\d+)?|[A-Za-z][A-Za-z0-9_]*|[-+±∓/()²])")
_GREEK = {"kappa", "xi", "eta", "lambda", "rho"}

Value = Callable[[Mapping[str, float], int], float]


@dataclass(frozen=True)
class _Part:
    """A part of a formula: its value, given the letters and a side, and its LaTeX."""

    value: Value
    latex: str
    bracketed: bool = False


@dataclass(frozen=True)
class Formula:
    """A formula in plain text.

    Attributes:
        text: as the module describes; a letter may have an index, as in ``m_l``.
    """

    text: str

    @cached_property
    def _parsed(self) -> _Part:
        return _Parser(self.text).whole()

    @property
    def latex(self) -> str:
        """The formula in LaTeX."""
        return self._parsed.latex

    def evaluate(self, letters: Mapping[str, float], side: int = 1) -> float:
        """The value.

        Args:
            letters: what each letter stands for.
            side: +1 for the upper signs of ± and ∓, -1 for the lower ones.

        Raises:
            InvalidInputError: the text is not a formula, or has a letter that is not among those.
        """
        return self._parsed.value(letters, side)


class _Parser:
    """Recursive descent: a sum of products, each with one quotient at most."""

    def __init__(self, text: str) -> None:
        self.text, self.tokens, at = text, list[str](), 0
        while text[at:].strip():
            found = _TOKEN.match(text, at)
            if not found:
                raise self.error(f"{text[at:].strip()[0]!r} is not part of one")
            self.tokens.append(found[1])
            at = found.end()
        self.tokens.append("")

    def error(self, why: str) -> InvalidInputError:
        return InvalidInputError(f"{self.text!r} is not a formula: {why}.")

    def take(self) -> str:
        return self.tokens.pop(0)

    def whole(self) -> _Part:
        found = self.sum()
        if self.tokens != [""]:
            raise self.error(f"{self.tokens[0]!r} is left over")
        return found

    def sum(self) -> _Part:
        sign = self.take() if self.tokens[0] in {"-", "±", "∓"} else "+"
        terms = [(sign, self.product())]
        text = {"+": "", "-": "-"}.get(sign, f"{_SIGNS[sign]} ") + terms[0][1].latex
        while self.tokens[0] in _SIGNS:
            sign = self.take()
            terms.append((sign, self.product()))
            text += f" {_SIGNS[sign]} {terms[-1][1].latex}"

        def value(letters: Mapping[str, float], side: int) -> float:
            signs = {"+": 1, "-": -1, "±": side, "∓": -side}
            return sum(signs[sign] * part.value(letters, side) for sign, part in terms)

        return _Part(value, text)

    def product(self) -> _Part:
        over = self.factors()
        if self.tokens[0] != "/":
            return _Part(_product(over), " ".join(part.latex for part in over))
        self.take()
        under = [self.power()]
        if self.tokens[0] == "/" or self.starts_factor():
            raise self.error("put what is divided by in brackets")
        top, bottom = _product(over), _product(under)
        plain = [(p.latex[1:-1] if p.bracketed else p.latex) for p in (over[0], under[0])]
        head = plain[0] if len(over) == 1 else " ".join(part.latex for part in over)
        return _Part(
            lambda letters, side: top(letters, side) / bottom(letters, side),
            rf"\frac{{{head}}}{{{plain[1]}}}",
        )

    def starts_factor(self) -> bool:
        return bool(re.match(r"[A-Za-z0-9(]", self.tokens[0]))

    def factors(self) -> list[_Part]:
        found = [self.power()]
        while self.starts_factor():
            found.append(self.power())
        return found

    def power(self) -> _Part:
        base = self.atom()
        if self.tokens[0] != "²":
            return base
        self.take()
        return _Part(lambda letters, side: base.value(letters, side) ** 2, f"{base.latex}^2")

    def atom(self) -> _Part:
        token = self.take()
        if token == "(":
            inner = self.sum()
            if self.take() != ")":
                raise self.error("a bracket is not closed")
            return _Part(inner.value, f"({inner.latex})", bracketed=True)
        if re.fullmatch(r"\d.*", token):
            number = float(token)
            return _Part(lambda letters, side: number, token)
        if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", token):
            raise self.error(f"a factor is missing before {token or 'its end'!r}")

        def value(letters: Mapping[str, float], side: int) -> float:
            if token not in letters:
                raise self.error(f"{token!r} is not one of {', '.join(letters)}")
            return letters[token]

        return _Part(value, _letter(token))


_SIGNS = {"+": "+", "-": "-", "±": r"\pm", "∓": r"\mp"}


def _product(parts: list[_Part]) -> Value:
    return lambda letters, side: math.prod(part.value(letters, side) for part in parts)


def _letter(name: str) -> str:
    stem, _, index = name.partition("_")
    if not index and re.fullmatch(r"[a-z]\d", name):
        stem, index = name[0], name[1]
    shown = rf"\{stem}" if stem in _GREEK else stem
    return f"{shown}_{{{index}}}" if index else shown
