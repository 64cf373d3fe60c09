"""Listing: names as a sentence has them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def listed(names: Sequence[str]) -> str:
    """All of some names: a, b and c."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def counted(number: int, noun: str) -> str:
    """So many of what a noun names: 1 posture, 3 postures."""
    return f"{number} {noun}{'s' * (number != 1)}"


def first_few(names: Iterable[str], most: int = 12) -> str:
    """The first of some names, and how many more there are: a, b and 3 more."""
    known = list(names)
    more = f" and {len(known) - most} more" if len(known) > most else ""
    return ", ".join(known[:most]) + more
