"""What a page has its reader do, in order: files to write, commands with their output, Python."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

FENCE = re.compile(r"^```(\w+)( slow)?\n(.*?)^```$", re.MULTILINE | re.DOTALL)
NAMED = re.compile(r"\A# (\w[\w.-]*\.\w+)\n")  # a block that begins with its file's name
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?")
ELISION = "..."  # on a line of its own: lines that are left out
NOISE = 1e-9  # a number this small is rounding: its digits differ from machine to machine


@dataclass(frozen=True)
class Step:
    """One thing to do: a ``file`` to write, a ``command`` to type, or ``python`` to run.

    ``shown`` is what the page has under a command, ``span`` where that stands in the page's text.
    """

    kind: str
    text: str
    name: str = ""
    shown: str = ""
    span: tuple[int, int] = (0, 0)
    slow: bool = False

    @property
    def code(self) -> int:
        """The exit code that what is shown says: bad input, a run that failed, or done."""
        return 2 if self.shown.startswith("error: ") else int("\n  likely cause: " in self.shown)


def steps(page: Path) -> Iterator[Step]:
    """What a page's blocks have its reader do."""
    for block in FENCE.finditer(page.read_text("utf-8")):
        language, slow, code = block[1], bool(block[2]), block[3]
        named = NAMED.match(code)
        if named:
            yield Step("file", code, name=named[1], slow=slow)
        elif language == "python":
            yield Step("python", code, slow=slow)
        elif language in ("console", "sh"):
            yield from _typed(
                code, block.start(3), slow, prompt="$ " if language == "console" else ""
            )


def _typed(code: str, start: int, slow: bool, prompt: str) -> Iterator[Step]:
    """The commands of a block; in a console block with the lines that follow each."""
    command = re.compile(
        rf"^{re.escape(prompt)}(?P<typed>(?:.*\\\n)*.*)\n"
        + (r"(?P<shown>(?:(?!\$ ).*\n)*)" if prompt else ""),
        re.MULTILINE,
    )
    for found in command.finditer(code):
        typed = re.sub(r"\s+# .*$", "", found["typed"].replace("\\\n", " "), flags=re.MULTILINE)
        typed = " ".join(typed.split())
        if not typed or typed.startswith("#"):
            continue
        span = (start + found.end("typed") + 1, start + found.end())
        shown = found["shown"] if prompt else ""
        yield Step("command", typed, shown=shown, span=span, slow=slow)


def difference(shown: str, said: str) -> str:
    """How what a page shows differs from what was said; empty if it does not.

    Numbers may differ by one in the last digit that is shown, and noise by as much as it likes.
    """
    lines = [line.rstrip() for line in said.strip("\n").splitlines()]
    parts = _parts(shown)
    at = 0
    for index, part in enumerate(parts):
        starts = range(at, len(lines) - len(part) + 1)
        if index == 0:
            starts = starts[:1]
        elif index == len(parts) - 1:
            starts = starts[-1:]
        fits = [
            start for start in starts if all(map(same_line, part, lines[start : start + len(part)]))
        ]
        if not fits or (len(parts) == 1 and len(part) != len(lines)):
            return _explained(part, lines[at:])
        at = fits[0] + len(part)
    return ""


def _parts(shown: str) -> list[list[str]]:
    """The lines that are shown, in groups between elisions."""
    parts: list[list[str]] = [[]]
    for line in shown.strip("\n").splitlines():
        if line.strip() == ELISION:
            parts.append([])
        else:
            parts[-1].append(line.rstrip())
    return parts


def _explained(part: list[str], lines: list[str]) -> str:
    """Two texts, the page's and what was said."""
    return "the page shows\n" + "\n".join(part) + "\nand it said\n" + "\n".join(lines)


def same_line(shown: str, said: str) -> bool:
    """Whether two lines are the same up to the last digit of their numbers."""
    if " ".join(NUMBER.sub("0", shown).split()) != " ".join(NUMBER.sub("0", said).split()):
        return False
    return all(map(_same_number, NUMBER.findall(shown), NUMBER.findall(said)))


def _same_number(shown: str, said: str) -> bool:
    """Whether two numbers differ by no more than one in the last digit."""
    mantissa, _, exponent = shown.partition("e")
    digits = len(mantissa.partition(".")[2])
    step = 10.0 ** (int(exponent or 0) - digits)
    apart = abs(float(shown) - float(said))
    return (
        apart <= 1.01 * step * bool(digits or exponent)
        or max(abs(float(shown)), abs(float(said))) < NOISE
    )


class Reader:
    """Someone who does what a page says, in a folder of his own.

    ``run`` is how a command of copsense is run, its arguments in and (exit code, output) out; the
    rest goes to a shell.
    """

    def __init__(self, folder: Path, run: Callable[..., tuple[int, str]]):
        self.folder, self.run = folder, run
        self.names = {"__name__": "page"}  # of the page's Python, one program

    def follow(self, step: Step) -> str:
        """Do what a step says; what it printed. A step that fails is an assertion error."""
        if step.kind == "file":
            (self.folder / step.name).write_text(step.text, "utf-8")
        elif step.kind == "python":
            exec(compile(step.text, "page", "exec"), self.names)
        elif not step.text.startswith("pip install"):  # it is installed
            code, said = self._typed(step.text)
            assert code == step.code, f"{step.text}\nended with {code}:\n{said}"
            return said
        return ""

    def _typed(self, line: str) -> tuple[int, str]:
        words = shlex.split(line)
        if words[0] == "copsense" and not set("|&;<>$") & set(line):
            return self.run(*words[1:])
        paths = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
        done = subprocess.run(
            ["sh", "-c", line],
            cwd=self.folder,
            env=os.environ | {"PATH": paths},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        return done.returncode, done.stdout
