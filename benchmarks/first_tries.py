"""Does a robot that is no preset get through every command, by the line that inspect prints?

    (unpack wheels into PACKAGES, as for robots.py)
    python benchmarks/first_tries.py [--packages PACKAGES] [--only TEXT]

Each robot of `ROBOTS` goes through `copsense inspect` and then, with the options of the line that
it printed and nothing else but what the command itself asks for (`COMMANDS`), through `analyse`,
`sweep`, `balance`, `design`, `map` and `push`, each in a process of its own, once. Where inspect
noted that the contacts hold the CoM sideways, what is moved is its x (`HELD`). Where a command
fails and its notes name the option that helps (`REMEDIES`), it has a second try with that. Writes
a Markdown table, unless --only chose some of the robots; exits with 1 if a command failed.
"""

import argparse
import importlib.metadata
import json
import re
import shlex
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

DATA = "example-robot-data"
ROBOTS = (
    (DATA, "alexander_description/urdf/alexander_v1.lowerBodyOnly.urdf"),
    (DATA, "a1_description/urdf/a1.urdf"),
    (DATA, "go1_description/urdf/go1.urdf"),
    (DATA, "hyq_description/robots/hyq_no_sensors.urdf"),
    (DATA, "b1_description/urdf/b1.urdf"),
    (DATA, "bolt_description/robots/bolt.urdf"),
    (DATA, "quadruped_description/urdf/quadruped.urdf"),
    ("jvrc_description", "jvrc_description/urdf/jvrc1.urdf"),
    ("upkie_description", "upkie_description/urdf/upkie.urdf"),
    ("armar", "armar/description/urdf/armar4_fixed_hands.urdf"),
    ("dm_control", "dm_control/suite/humanoid.xml"),
    ("dm_control", "dm_control/suite/quadruped.xml"),
    ("robosuite", "robosuite/models/assets/robots/gr1/robot.xml"),
    ("robosuite_models", "robosuite_models/assets/robots/h1/robot.xml"),
    ("robosuite_models", "robosuite_models/assets/robots/g1/robot.xml"),
)
COMMANDS = {
    "analyse": "",
    "sweep": "--com-y=-10mm:10mm:5",
    "balance": "--reference ramp:5mm",
    "design": "--family mix --grid 3",
    "map": "--over com_y=-10mm:10mm:5 --output {folder}/map.zarr",
    "push": "",
}
HELD = {
    "sweep": "--com-x=-2mm:2mm:5",
    "balance": "--reference hold",
    "design": "--family mix --grid 3 --com-x=-2mm:2mm:5",
    "map": "--over com_x=-2mm:2mm:5 --output {folder}/map.zarr",
}
REMEDIES = {  # command -> its note or error, with the options to add
    "balance": re.compile(
        r"(?:cannot hold this posture at rest .*Give limits|let them be replaced) "
        r"\((?:copsense balance )?(--limits \S+|--repair-inertia),"
    ),
    "map": re.compile(r"To reach them, map over the height too: (--over \S+)"),
}
SECONDS = 900  # the first map on a machine compiles


def file_of(package, path, packages):
    """Where a robot's file lies, or None."""
    places = [Path(p) / "cmeel.prefix/share/example-robot-data/robots" for p in sys.path]
    for place in places if package == DATA else [packages] if packages else []:
        if (place / path).is_file():
            return place / path
    return None


def run(words):
    """Exit code, output and seconds of one copsense command."""
    start = time.monotonic()
    try:
        done = subprocess.run(
            [sys.executable, "-m", "copsense", *words],
            capture_output=True,
            text=True,
            timeout=SECONDS,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return -1, "", f"no answer in {SECONDS} s", SECONDS
    return done.returncode, done.stdout, done.stderr, time.monotonic() - start


def tried(file):
    """What inspect said of a robot, and what each command answered."""
    code, out, err, _ = run(["inspect", str(file), "--json"])
    if code:
        return {"inspect": (False, err, 0.0)}
    found = json.loads(out)
    if not found["analyse"]:
        return {"inspect": (False, found["reason"], 0.0)}
    options = shlex.split(found["analyse"])[2:]
    held = any("hold the CoM's y fast" in note for note in found["notes"])
    answers = {}
    with tempfile.TemporaryDirectory() as folder:
        for command, text in (COMMANDS | (HELD if held else {})).items():
            words = shlex.split(text.format(folder=folder))
            code, out, err, seconds = run([command, *options, *words])
            remedy = REMEDIES[command].search(err) if code and command in REMEDIES else None
            if remedy:
                again = [word.replace("map.zarr", "again.zarr") for word in words]
                more = shlex.split(remedy[1])
                code, out, err, longer = run([command, *options, *again, *more])
                seconds += longer
            said = (err.strip() or out.strip()) if code else f"with {remedy[1]}" if remedy else ""
            answers[command] = (code == 0, said, seconds)
    return answers


def cell(passed, said, _):
    """A table's cell: what was needed for it to pass, or why it did not."""
    if passed:
        return f"yes, {said}" if said else "yes"
    errors = [line for line in said.splitlines() if line.startswith("error")]
    return (errors or said.splitlines())[-1][:220].replace("|", "/")


def main():
    """The table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--packages", type=Path, help="folder of unpacked wheels")
    parser.add_argument("--only", default="", help="files whose path holds this text")
    parser.add_argument("--output", type=Path, default=Path(__file__).with_name("first_tries.md"))
    parser.add_argument("--jobs", type=int, default=2)
    args = parser.parse_args()
    chosen = [each for each in ROBOTS if args.only in each[1]]
    files = [file_of(*each, args.packages) for each in chosen]
    here = [(each, file) for each, file in zip(chosen, files, strict=True) if file is not None]
    rows = []
    with ThreadPoolExecutor(args.jobs) as pool:
        for (each, _), answers in zip(here, pool.map(lambda h: tried(h[1]), here), strict=True):
            rows.append((each, answers))
            for command, (passed, said, seconds) in answers.items():
                print(f"{each[1]} {command}: {'yes' if passed else 'NO'} {seconds:.1f} s", said)
            sys.stdout.flush()
    failed = sum(not passed for _, answers in rows for passed, _, _ in answers.values())
    lines = [
        "# First tries",
        "",
        f"`python benchmarks/first_tries.py`, copsense {importlib.metadata.version('copsense')}: "
        f"{len(rows)} robots that are no presets, by the line that `copsense inspect` printed, "
        f"each command once, and once more with what its own note says; {failed} answers are an "
        "error.",
        "",
        *(f"- `{command}` {text and f'`{text}`'}" for command, text in COMMANDS.items()),
        "- where the contacts hold the CoM sideways, as inspect notes: "
        + ", ".join(f"`{command} {text}`" for command, text in HELD.items()),
        "",
        "| package | file | " + " | ".join(COMMANDS) + " |",
        "|---" * (2 + len(COMMANDS)) + "|",
    ]
    for (package, path), answers in rows:
        cells = [cell(*answers[c]) if c in answers else "-" for c in COMMANDS]
        lines.append(f"| {package} | {path} | " + " | ".join(cells) + " |")
    if not args.only:
        args.output.write_text("\n".join(lines) + "\n")
        print(f"written: {args.output}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
