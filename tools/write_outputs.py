"""Write what the commands of a page print under them, in the page.

Follows pages in an empty folder, and replaces each output that no longer holds. What leaves lines
out by "..." stays as long as the rest holds; the tests compare in the same way.

Run: .venv/bin/python tools/write_outputs.py docs/tutorials/my_robot.md ...
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from support.commands import copsense
from support.sessions import Reader, difference, steps


def run(*arguments: str) -> tuple[int, str]:
    """A command of copsense, in this process."""
    answer = copsense(*arguments, together=True)
    return answer.code, answer.out


def write_outputs(page: Path) -> None:
    """Follow a page, and put right what it shows."""
    text = page.read_text("utf-8")
    said = []
    with tempfile.TemporaryDirectory() as name:
        os.chdir(name)
        sys.path.insert(0, name)
        reader = Reader(Path(name), run)
        for step in steps(page):
            start = time.process_time()
            said.append((step, reader.follow(step)))
            if step.kind != "file":
                what = step.text.strip().splitlines()[-1]
                print(f"{time.process_time() - start:6.1f} s  {what[:100]}", flush=True)
    for step, output in reversed(said):
        if step.kind == "command" and step.shown and difference(step.shown, output):
            first, last = step.span
            text = text[:first] + output.strip("\n") + "\n" + text[last:]
    page.write_text(text, "utf-8")


if __name__ == "__main__":
    for page in [Path(name).resolve() for name in sys.argv[1:]]:
        write_outputs(page)
