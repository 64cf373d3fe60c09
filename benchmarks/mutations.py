"""Files and option lines broken at random: nothing may end in a traceback or be read wrongly.

Seeded mutations of URDFs, MJCFs, stance files and option lines are given to copsense. Each must be
accepted and agree with a referee (the file's own masses summed; MuJoCo's compiler), or be rejected
by an error of copsense's own. What is neither is printed with its seed.

Run: .venv/bin/python benchmarks/mutations.py [--count 10000] [--seed 0] [--only urdf]
"""

from __future__ import annotations

import argparse
import contextlib
import io
import math
import random
import re
import sys
import tempfile
import traceback
import warnings
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

import copsense
from copsense.errors import CopsenseError

# Of all mutations; an option line that is accepted takes half a second.
_SHARES = {"urdf": 0.4, "mjcf": 0.3, "stance": 0.25, "options": 0.05}
VALUES = [
    "",
    "0",
    "-1",
    "nan",
    "inf",
    "-inf",
    "1e308",
    "1e-300",
    "abc",
    "1 2",
    "0 0 0",
    "1,5",
    "--",
]
_LINK = """<link name="{name}"><inertial><origin xyz="0 0 -0.1"/><mass value="{mass}"/>
  <inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><origin xyz="0.02 0 -0.03"/><geometry><box size="0.2 0.08 0.02"/></geometry>
  </collision></link>"""
_JOINT = """<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>
  <origin xyz="{place}" rpy="0 0 0"/><axis xyz="{axis}"/>
  <limit lower="-2" upper="2" effort="80" velocity="5"/></joint>"""
_AXES = ["0 0 1", "1 0 0", "0 1 0", "0 1 0", "0 1 0", "1 0 0"]
_LEGS = [f"{side}{k}" for side in "lr" for k in range(6)]
POSTURE = {"2": -0.4, "3": 0.8, "4": -0.4}


def urdf() -> str:
    """A biped of six joints a leg."""
    parts = [_LINK.format(name="trunk", mass=12.0)]
    for side, y in (("l", 0.1), ("r", -0.1)):
        parent = "trunk"
        for k, axis in enumerate(_AXES):
            name, drop = f"{side}{k}", -0.3 if k in (3, 4) else 0.0
            parts.append(_LINK.format(name=name, mass=1.0 + 0.1 * k))
            place = f"0 {y if k == 0 else 0} {drop}"
            parts.append(
                _JOINT.format(name=f"j_{name}", parent=parent, child=name, place=place, axis=axis)
            )
            parent = name
    return '<?xml version="1.0"?>\n<robot name="biped">\n' + "\n".join(parts) + "\n</robot>\n"


def mjcf() -> str:
    """The same in MuJoCo's format."""
    legs = []
    for side, y in (("l", 0.1), ("r", -0.1)):
        inside = '<geom type="box" size="0.1 0.04 0.01" pos="0.02 0 -0.03" mass="0.6"/>'
        for k in reversed(range(6)):
            place = f"0 {y if k == 0 else 0} {-0.3 if k in (3, 4) else 0.0}"
            inside = (
                f'<body name="{side}{k}" pos="{place}"><joint name="j_{side}{k}" axis="{_AXES[k]}" '
                f'range="-110 110"/><geom type="sphere" size="0.03" mass="0.9"/>\n{inside}</body>'
            )
        legs.append(inside)
    return (
        '<mujoco model="biped">\n<default><joint damping="0.1"/></default>\n<worldbody>\n'
        '<geom type="plane" size="1 1 1"/>\n<body name="trunk" pos="0 0 1"><freejoint/>'
        '<geom type="box" size="0.1 0.1 0.2" mass="12"/>\n' + "\n".join(legs) + "\n</body>\n"
        "</worldbody>\n<actuator>"
        + "".join(
            f'<motor joint="j_{s}{k}" ctrlrange="-1 1" gear="80"/>\n'
            for s in "lr"
            for k in range(6)
        )
        + "</actuator>\n</mujoco>\n"
    )


def stance_file() -> str:
    """A stance of the URDF."""
    joints = "".join(f"j_{s}{k} = {a}\n" for s in "lr" for k, a in POSTURE.items())
    contacts = "".join(
        f'[[contacts]]\nframe = "{s}5"\noffset_m = [0.0, 0.0, -0.04]\nfriction = 0.7\n'
        "sole_m = [[-0.08, -0.04], [0.12, -0.04], [0.12, 0.04], [-0.08, 0.04]]\n"
        for s in "lr"
    )
    return (
        f'robot = "biped.urdf"\ncriteria = ["minimum-torque"]\n[posture_rad]\n{joints}'
        f"[limits]\nfriction = 0.6\nnormal_force = 0.0\n{contacts}"
        '[[loads]]\nframe = "trunk"\nforce_N = [0.0, 2.0, -10.0]\n'
    )


OPTIONS = [
    "analyse icub --com-y 0.03 --criterion minimum-torque --json",
    "analyse icub --limits friction=0.33,torque=40 --joint l_knee=-20",
    "analyse solo12 --contact FL_FOOT:point --contact FR_FOOT:point --contact HL_FOOT:point",
    "push icub --at root_link --point 0:0:0.2 --limits friction=0.6",
    "sweep icub --com-y -0.02:0.02:3 --limits friction=0.5",
    "analyse icub --load l_hand=0:0:-20 --payload r_hand=2 --width 0.18",
    "four-bar --xi 0.2",
]


def mutate_text(text: str, rng: random.Random) -> str:
    """One to three changes: of a number, an attribute, a character, a line, or an element."""
    for _ in range(rng.choice([1, 1, 1, 2, 3])):
        text = rng.choice([_number, _quoted, _character, _line, _word, _bytes])(text, rng)
    return text


def _number(text: str, rng: random.Random) -> str:
    found = list(re.finditer(r"-?\d+(\.\d+)?", text))
    if not found:
        return text
    at = rng.choice(found)
    return text[: at.start()] + rng.choice(VALUES) + text[at.end() :]


def _quoted(text: str, rng: random.Random) -> str:
    found = list(re.finditer(r'"[^"\n]*"', text))
    if not found:
        return text
    at, other = rng.choice(found), rng.choice(found)
    new = rng.choice([other.group(), f'"{rng.choice(VALUES)}"'])
    return text[: at.start()] + new + text[at.end() :]


def _character(text: str, rng: random.Random) -> str:
    i = rng.randrange(max(1, len(text)))
    return (
        text[:i]
        + rng.choice(["", "<", ">", '"', "&", "/", " ", "\0", "é", "[", "="])
        + text[i + 1 :]
    )


def _line(text: str, rng: random.Random) -> str:
    lines = text.split("\n")
    i, j = rng.randrange(len(lines)), rng.randrange(len(lines))
    change = rng.randrange(3)
    if change == 0:
        del lines[i]
    elif change == 1:
        lines.insert(j, lines[i])
    else:
        lines[i], lines[j] = lines[j], lines[i]
    return "\n".join(lines)


def _word(text: str, rng: random.Random) -> str:
    words = sorted(set(re.findall(r"[a-z_]{3,}", text)))
    if not words:
        return text
    one, other = rng.choice(words), rng.choice(words)
    at = rng.choice(list(re.finditer(re.escape(one), text)))
    return text[: at.start()] + rng.choice([other, one[::-1], one.upper(), ""]) + text[at.end() :]


def _bytes(text: str, rng: random.Random) -> str:
    i = rng.randrange(max(1, len(text)))
    return text[:i] + text[i + rng.randrange(1, 40) :]


def judge_urdf(text: str) -> str:
    """Load and stand; the referee sums the masses that the file holds."""
    robot = copsense.load_robot(text)
    root = ET.fromstring(text.replace("\0", ""))
    masses = [float(m.get("value", "nan")) for m in root.findall("link/inertial/mass")]
    if not math.isclose(robot.mass, sum(masses), rel_tol=1e-9):
        return f"mass {robot.mass}, the file says {sum(masses)}"
    return _stands(robot, [f"{s}5" for s in "lr"])


def judge_mjcf(text: str) -> str:
    """Load and stand; the referee is MuJoCo's compiler."""
    import mujoco

    mujoco.set_mju_user_warning(lambda _: None)
    robot = copsense.load_robot(text)
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        model = mujoco.MjModel.from_xml_string(text)
    except ValueError as error:
        return f"accepted what MuJoCo rejects: {error}"
    roots = [i for i in range(1, model.nbody) if model.body_parentid[i] == 0]
    if not any(math.isclose(robot.mass, model.body_subtreemass[i], rel_tol=1e-9) for i in roots):
        return f"mass {robot.mass}, MuJoCo has {[float(model.body_subtreemass[i]) for i in roots]}"
    return _stands(robot, [f"{s}5" for s in "lr"])


def _stands(robot: copsense.Robot, feet: list[str]) -> str:
    posture = {f"j_{s}{k}": a for s in "lr" for k, a in POSTURE.items()}
    known = {j: a for j, a in posture.items() if j in robot.joint_names}
    stance = copsense.load_stance(robot, contacts=feet, posture=known, contact_at="sole")
    found = copsense.solve_equilibrium(stance, copsense.minimum_wrench(1.0))
    numbers = [stance.q, stance.com, found.forces, found.torques]
    if not all(np.all(np.isfinite(each)) for each in numbers):
        return "numbers that are not finite"
    if found.residual() > 1e-6 * robot.weight:
        return f"unbalanced by {found.residual():.3g} N or Nm"
    low = min(place.translation[2] for place in stance.placements)
    return "the CoM lies under its contacts" if stance.com[2] < low else ""


def judge_stance(text: str, folder: Path) -> str:
    """Read a stance file beside its robot."""
    (folder / "stance.toml").write_text(text, encoding="utf-8", errors="surrogateescape")
    stance = copsense.load_stance(folder / "stance.toml")
    return "" if np.all(np.isfinite(stance.q)) else "a configuration that is not finite"


def judge_options(text: str, _: Path) -> str:
    """Run a command line in this process."""
    from click import ClickException
    from click.testing import CliRunner

    from copsense.cli import copsense as command

    run = CliRunner().invoke(command, text.split())
    error = run.exception
    if isinstance(error, ClickException) or (isinstance(error, SystemExit) and error.code):
        raise CopsenseError("bad usage")
    if error is not None and not isinstance(error, SystemExit):
        raise error
    return ""


def cases(kind: str) -> tuple[Callable[[random.Random], str], Callable[[str, Path], str]]:
    """How a kind is mutated, and how it is judged."""
    if kind == "options":
        return lambda rng: mutate_text(rng.choice(OPTIONS), rng).replace("\n", " "), judge_options
    base = {"urdf": urdf, "mjcf": mjcf, "stance": stance_file}[kind]()
    judges = {
        "urdf": lambda text, _: judge_urdf(text),
        "mjcf": lambda text, _: judge_mjcf(text),
        "stance": judge_stance,
    }
    return lambda rng: mutate_text(base, rng), judges[kind]


def judged(judge: Callable[[], str], counts: Counter[str]) -> str:
    """What is wrong with an answer, empty if nothing is; counts what is accepted and rejected."""
    try:
        wrong = judge()
        counts["accepted"] += 1
    except CopsenseError:
        counts["rejected"] += 1
        wrong = ""
    except Exception as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        wrong = f"{type(error).__name__}: {error} ({where.filename}:{where.lineno})"
    return wrong


def report(name: str, counts: Counter[str], bad: list[str]) -> bool:
    """Print what a run found; whether something was wrong."""
    print(f"{name}: " + ", ".join(f"{n} {what}" for what, n in sorted(counts.items())), flush=True)
    for line in bad:
        print(f"  {line}")
    return bool(bad)


def run(kind: str, count: int, seed: int) -> tuple[Counter[str], list[str]]:
    """Try many mutations of a kind.

    Returns:
        How many were accepted and rejected, and what was neither.
    """
    mutate, judge = cases(kind)
    counts: Counter[str] = Counter()
    bad = []
    with tempfile.TemporaryDirectory() as name, contextlib.chdir(name):
        folder = Path(name)
        (folder / "biped.urdf").write_text(urdf())
        for i in range(count):
            text = mutate(random.Random(f"{kind} {seed} {i}"))
            with warnings.catch_warnings(), contextlib.redirect_stderr(io.StringIO()):
                warnings.simplefilter("ignore")
                wrong = judged(partial(judge, text, folder), counts)
            if wrong:
                counts["wrong"] += 1
                bad.append(f"{kind} {seed} {i}: {wrong[:300]}")
    return counts, bad


def main() -> int:
    """Run every kind and print what was found."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--count", type=int, default=10_000, help="mutations in all")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", choices=("urdf", "mjcf", "stance", "options"))
    given = parser.parse_args()
    kinds = [given.only] if given.only else ["urdf", "mjcf", "stance", "options"]
    failed = False
    for kind in kinds:
        share = 1.0 if given.only else _SHARES[kind]
        counts, bad = run(kind, round(given.count * share), given.seed)
        failed |= report(kind, counts, bad)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
