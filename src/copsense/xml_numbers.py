"""Numbers in XML: attributes that must hold so many finite ones."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterator


def wrong_number(element: ET.Element, attribute: str, count: int, where: str) -> Iterator[str]:
    """Report an attribute that is there and does not hold `count` finite numbers.

    Parsers read a word as zero, or as whatever comes next in memory.

    Args:
        element: the element.
        attribute: its attribute.
        count: how many numbers there must be.
        where: how a report calls the element.
    """
    text = element.get(attribute)
    if text is None:
        return
    numbers = read_numbers(text)
    if numbers is None or len(numbers) != count:
        need = "one finite number" if count == 1 else f"{count} finite numbers"
        yield f"{attribute}={text!r} in the {where} is not {need}"


def read_numbers(text: str) -> list[float] | None:
    """The finite numbers in a text, or None where it holds anything else.

    Also what Python takes for a number and no XML parser does: 1_0, digits of other scripts.
    """
    if "_" in text or not text.isascii():
        return None
    try:
        numbers = [float(word) for word in text.split()]
    except ValueError:
        return None
    return numbers if all(map(math.isfinite, numbers)) else None
