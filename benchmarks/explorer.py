"""What the explorer costs: the first view, updates while a slider is dragged, and memory.

    python benchmarks/explorer.py [ROBOT ...]

Starts `copsense explore` for each robot, connects as a browser does (viser's protocol, without
drawing) and drags the slider of the CoM's y. Complete updates have the posture, the numbers and the
command of the position that was asked for. Run it on an idle machine, with warm caches. Writes
benchmarks/explorer.md.
"""

from __future__ import annotations

import json
import os
import re
import statistics
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "tests"))

from support.viser_client import Client  # noqa: E402

ROBOTS = ("icub", "talos", "g1", "anymal_c", "cassie", "four_bar")
MOVES = 100
RATE = 20.0  # Hz, of the slider events that a browser sends
HEADS = (
    "robot",
    "first view [s]",
    "updates/s",
    "CPU of one [ms]",
    "within limits",
    "CPU [ms]",
    "of 20 a second",
    "memory [MB]",
)


def start(robot: str) -> tuple[subprocess.Popen[str], str]:
    """The command, and its address."""
    command = [sys.executable, "-m", "copsense", "explore", robot, "--no-browser", "--json"]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )
    assert process.stdout
    told = json.loads("".join(process.stdout.readline() for _ in range(4)))
    return process, told["url"]


def asked(millimetres: float) -> str:
    """What the command of a position has."""
    return rf"--com-y {round(millimetres / 1e3, 9)!r}m\b"


def cpu_time(process: int) -> float:
    """User and system time of a process [s]."""
    words = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")


def flat_out(client: Any, process: int, first: float) -> tuple[str, str]:
    """Updates a second, each asked for when the one before is complete, and their CPU time."""
    begun, before = time.monotonic(), cpu_time(process)
    for i in range(MOVES):
        value = first + 0.1 * i
        client.slide("com_y [mm]", value)
        client.until(asked(value))
    rate = MOVES / (time.monotonic() - begun)
    return f"{rate:.0f}", f"{1e3 * (cpu_time(process) - before) / MOVES:.0f}"


def dragged(client: Any, first: float) -> float:
    """Complete updates a second of a slider that is dragged at `RATE`."""
    seen, begun = 0, time.monotonic()
    for i in range(MOVES):
        value = first + 0.1 * i
        client.slide("com_y [mm]", value)
        try:
            client.until(asked(value), seconds=1 / RATE)
            seen += 1
        except TimeoutError:
            pass
        time.sleep(max(begun + (i + 1) / RATE - time.monotonic(), 0.0))
    return seen / (time.monotonic() - begun)


def measure(robot: str) -> tuple[str, ...]:
    """A row of the table."""
    firsts = []
    for _ in range(3):
        begun = time.monotonic()
        process, url = start(robot)
        with Client(url) as client:
            client.until(rf"copsense analyse {robot}<")
            firsts.append(time.monotonic() - begun)
            if len(firsts) == 3:
                free = flat_out(client, process.pid, 1.0)
                client.slide("wrenches within limits", True)
                client.until("--limits ")
                held = flat_out(client, process.pid, 0.5)
                client.slide("wrenches within limits", False)
                share = dragged(client, 1.05)
                status = Path(f"/proc/{process.pid}/status").read_text()
        process.terminate()
        process.wait(20)
    most = re.search(r"VmHWM:\s+(\d+)", status)
    assert most
    first = statistics.median(firsts)
    memory = int(most[1]) / 1024
    return robot, f"{first:.1f}", *free, *held, f"{share:.1f}", f"{memory:.0f}"


def main() -> None:
    """Measure, print and write the table."""
    rows = [HEADS]
    for robot in sys.argv[1:] or ROBOTS:
        rows.append(measure(robot))
        print("  ".join(f"{head} {cell};" for head, cell in zip(HEADS, rows[-1], strict=True)))
    lines = ["| " + " | ".join(row) + " |" for row in rows]
    lines.insert(1, "|" + "---|" * len(HEADS))
    load = os.getloadavg()[0]
    text = (__doc__ or "").split("\n\n")[2].replace("\n", " ").partition(" Run it")[0]
    (HERE / "explorer.md").write_text(
        f"# What the explorer costs\n\n`python benchmarks/explorer.py`. {text}\n\n"
        + "\n".join(lines)
        + f"\n\nFirst view: from the start of the command to its table in a client, median of 3. "
        f"Updates: each asked for when the one before is complete. Load of this run: "
        f"{load:.1f} on {os.cpu_count()} cores.\n"
    )


if __name__ == "__main__":
    main()
