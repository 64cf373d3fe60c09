"""What C++ parsers print: caught, so that it can be shown or left out."""

from __future__ import annotations

import os
import re
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def caught_parser_output() -> Iterator[list[str]]:
    """Catch what is written to the process's standard error while a C++ parser runs.

    Yields:
        A list that is filled when the block ends, however it ends: each message once, without the
        level and the line of C++ that it came from.
    """
    messages: list[str] = []
    try:
        sys.stderr.flush()
        kept = os.dup(2)
    except (OSError, ValueError, AttributeError):  # there is no standard error to catch
        yield messages
        return
    with tempfile.TemporaryFile() as caught:
        os.dup2(caught.fileno(), 2)
        try:
            yield messages
        finally:
            os.dup2(kept, 2)
            os.close(kept)
            caught.seek(0)
            messages += _messages(caught.read().decode(errors="replace"))


def _messages(text: str) -> list[str]:
    """Urdfdom's ``Error:   what`` and ``at line N in file`` as the whats, each once."""
    lines = [re.sub(r"^(Error|Warning|Info|Debug):\s*", "", line) for line in text.splitlines()]
    said = [line.strip() for line in lines if not re.match(r"\s*at line \d+ in ", line)]
    return list(dict.fromkeys(filter(None, said)))
