"""What a page shows: its fenced blocks, by language."""

import re
from pathlib import Path

FENCE = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def blocks(page: Path, *languages: str) -> list[str]:
    """The code of a page's blocks in these languages, in order."""
    return [code for name, code in FENCE.findall(page.read_text("utf-8")) if name in languages]


def commands(page: Path, *languages: str) -> list[str]:
    """The command lines of a page's shell blocks: without prompt, output and comments, in one line.

    In a console block only what follows a prompt is a command; in an sh block everything is.
    """
    lines = []
    for name, code in FENCE.findall(page.read_text("utf-8")):
        if name not in languages:
            continue
        for line in code.replace("\\\n", " ").splitlines():
            typed = line.removeprefix("$ ") if line.startswith("$ ") or name == "sh" else ""
            typed = re.sub(r"\s+# .*$", "", typed).strip()
            if typed and not typed.startswith("#"):
                lines.append(" ".join(typed.split()))
    return lines
