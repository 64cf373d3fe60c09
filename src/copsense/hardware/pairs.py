"""Pairs: which links, joints and contacts are the left and the right of one another, by name."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence

_OTHER = {"left": ("right",), "right": ("left",), "l": ("r",), "r": ("l",)}
_HIND = {"front": ("hind", "rear", "back"), "f": ("h", "r", "b")}
_EDGE = r"(?<![A-Za-z])"
# Where a name says its side: left_leg, l_leg and leg_l, LF_LEG, FL_leg, LHip, legL.
_SIDES = tuple(
    re.compile(pattern)
    for pattern in (
        r"left|right|Left|Right|LEFT|RIGHT",
        _EDGE + r"[lrLR](?![A-Za-z])",
        _EDGE + r"[lrLR](?=[fhmbFHMB](?![A-Za-z]))",
        r"(?<=" + _EDGE + r"[fhmbrFHMBR])[lrLR](?![A-Za-z])",
        _EDGE + r"[LR](?=[A-Z][a-z])",
        r"(?<=[a-z0-9])[LR](?![A-Za-z])",
    )
)
_ENDS = (re.compile(r"front|Front|FRONT"), re.compile(_EDGE + r"[fF](?![A-Za-z])"))
_SEPARATORS = re.compile(r"([_\-. ])[_\-. ]+")


def mirrored(names: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """What changes together: a name for it -> the one name, or left and right.

    Args:
        names: of links, joints or contacts, each once.

    Returns:
        In the order of the first of each; a pair is called what both have in common, such as
        ``"upper_leg"``, or by both names where that would be ambiguous.
    """
    return _grouped({name: (name,) for name in names}, _SIDES, _OTHER)


def all_alike(names: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """The same, with the front and the hind pair of four limbs together."""
    return _grouped(mirrored(names), _ENDS, _HIND)


def _grouped(
    groups: Mapping[str, tuple[str, ...]],
    patterns: Sequence[re.Pattern[str]],
    others: Mapping[str, tuple[str, ...]],
) -> dict[str, tuple[str, ...]]:
    """Groups merged with those whose name says the other side."""
    merged: dict[tuple[str, ...], str] = {}
    for name, group in groups.items():
        if any(set(group) <= set(larger) for larger in merged):
            continue
        there, common = next(
            (pair for pair in _counterparts(name, patterns, others) if pair[0] in groups),
            ("", name),
        )
        merged[(*group, *groups[there]) if there else group] = common
    count = Counter(merged.values())
    found = {}
    for group, common in merged.items():
        alone = count[common] == 1 and common
        taken = common in groups and not set(groups[common]) <= set(group)
        found[common if alone and not taken else "+".join(group)] = group
    return found


def _counterparts(
    name: str, patterns: Sequence[re.Pattern[str]], others: Mapping[str, tuple[str, ...]]
) -> Iterator[tuple[str, str]]:
    """Names of the other side that there might be, and what is left without the side."""
    for pattern in patterns:
        for found in pattern.finditer(name):
            side, before, after = found.group(), name[: found.start()], name[found.end() :]
            common = _SEPARATORS.sub(r"\1", before + after).strip("_-. ")
            for other in others.get(side.lower(), ()):
                other = other.upper() if side.isupper() else other
                other = other.capitalize() if side.istitle() and len(side) > 1 else other
                yield before + other + after, common
