"""Runs the command line in this process, as its entry point does, and keeps what it said."""

import io
import json
import sys
import warnings
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from unittest.mock import patch

from copsense.cli import main


@dataclass(frozen=True)
class Answer:
    """What a command answered."""

    code: int
    out: str
    err: str

    @property
    def json(self):
        """The answer as JSON, which has no NaN and no infinity."""
        return json.loads(self.out, parse_constant=_reject)

    @property
    def error(self):
        """The one line that says what was wrong."""
        assert self.code == 2, (self.code, self.out, self.err)
        lines = [line for line in self.err.splitlines() if line.startswith("error: ")]
        assert len(lines) == 1, self.err
        assert lines[0].endswith("."), "a message ends with what to do"
        assert "Traceback" not in self.err
        return lines[0]


def copsense(*arguments, together=False):
    """Run ``copsense ARGUMENTS``; an exception that escapes fails the test.

    With ``together`` errors and notes are in the output, where a terminal shows them.
    """
    out = io.StringIO()
    err = out if together else io.StringIO()
    with (
        patch.object(sys, "argv", ["copsense", *map(str, arguments)]),
        redirect_stdout(out),
        redirect_stderr(err),
        warnings.catch_warnings(),  # the command shows warnings itself
    ):
        warnings.simplefilter("default")
        try:
            main()
            code = 0
        except SystemExit as stop:
            code = stop.code or 0
    return Answer(code, out.getvalue(), err.getvalue())


def _reject(constant):
    raise AssertionError(f"{constant} is no JSON")
