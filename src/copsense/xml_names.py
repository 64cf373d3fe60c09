"""Names in XML: of elements that must have one each of their own."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Iterator, Sequence


def wrong_names(kind: str, elements: Sequence[ET.Element]) -> Iterator[str]:
    """Report elements without a name, and names that several have.

    Args:
        kind: what they are, such as ``"link"``.
        elements: all of that kind.
    """
    for name, times in Counter(each.get("name", "") for each in elements).items():
        if not name:
            yield f"a {kind} has no name"
        elif times > 1:
            yield f"{times} {kind}s are named {name!r}"
