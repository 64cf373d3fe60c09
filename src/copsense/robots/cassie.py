"""Cassie: Agility's biped with rods and leaf springs, from the SDF of example-robot-data.

Two things of the file are not taken as they stand:

- Its rods end in a ball and a hinge. The hinges' axes lean with the rods, so that a knee bent by
  0.3 rad would wind the heel's leaf spring by 0.28 rad. The robot's rods have balls at either end;
  here the hinge is a universal joint, which keeps a rod from spinning.
- Four leaf springs hold the pelvis up, and nothing but their own balance says how far they bend.
  They are held straight, at rest, by couplings, whose torques are those that bend them.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin

from copsense.contact import Contact
from copsense.drives import Coupling
from copsense.errors import ModelLoadError
from copsense.robot import Robot

SIDES = ("left", "right")
MOTORS = tuple(
    f"{side}-{joint}-op" for side in SIDES for joint in ("roll", "yaw", "pitch", "knee", "foot")
)
# Leaf spring -> the joint that leads its coupling, of ratio 0.
_LEAVES = {"knee-shin-joint": "knee-op", "tarsus-spring-joint": "shin-tarsus-joint"}
# Hinge of a rod -> where the rod's other end is, in the rod.
_HINGES = {"achilles-spring-joint": (0.0, 0.0, 0.0), "crank-rod-joint": (1.0, 0.0, 0.0)}
# The cylinder under a foot, which touches flat ground along a line.
_CENTRE = np.array([0.01, 0.045, 0.0])
_RADIUS = 0.0168
_ENDS = {"toe": 0.09, "heel": -0.09}
_LEAN = 0.695  # rad, from the foot's -x axis to where the toes point


def cassie_robot(file: Path) -> Robot:
    """Cassie with ten motors, its loops closed by rods, its leaf springs straight.

    Args:
        file: ``cassie_v2.sdf``.

    Raises:
        ModelLoadError: the file is another.
    """
    root = ET.fromstring(file.read_text(encoding="utf-8"))
    for side in SIDES:
        for hinge, other in _HINGES.items():
            joint = root.find(f"model/joint[@name='{side}-{hinge}']")
            if joint is None or joint.get("type") != "revolute":
                raise ModelLoadError(
                    f"{file} has no hinge {side}-{hinge}. Install the release of "
                    "example-robot-data that copsense asks for."
                )
            _make_universal(joint, np.array(other))
    robot = Robot.from_sdf(ET.tostring(root, encoding="unicode"), name="cassie")
    couplings = tuple(
        Coupling(f"{side}-{leaf}", f"{side}-{leader}", 0.0)
        for side in SIDES
        for leaf, leader in _LEAVES.items()
    )
    notes = (
        "The rods' hinges are universal joints here: the file's would wind the leaf springs.",
        "The leaf springs are held straight by couplings, whose torques are those that bend them.",
    )
    drives = replace(robot.drives, motors=MOTORS, couplings=couplings)
    assert robot.description is not None
    # Where its meshes are: the text above has no folder of its own.
    description = replace(robot.description, package_dirs=(str(file.parents[4]),))
    model = _with_ends(robot)
    return replace(robot, model=model, notes=notes, drives=drives, description=description)


def cassie_contacts() -> tuple[Contact, ...]:
    """Toe and heel of each foot: the ends of the line on which its cylinder stands."""
    return tuple(
        Contact(f"{side}-{end}", kind="point", friction=0.7) for side in SIDES for end in _ENDS
    )


def cassie_posture() -> dict[str, float]:
    """Knees and hips as the SRDF's ``standing`` has them [rad], with leaf springs straight."""
    angles = {
        "pitch-op": 0.1924,
        "knee-op": -0.2274,
        "shin-tarsus-joint": 0.2274,
        "foot-op": -1.7514,
        "tarsus-crank-joint": -1.7514,
        "crank-rod-joint[0]": 1.7514,
    }
    return {f"{side}-{joint}": angle for side in SIDES for joint, angle in angles.items()}


def _with_ends(robot: Robot) -> pin.Model:
    """The model with a frame at the toe and at the heel of each foot, on its underside."""
    model = robot.model.copy()
    down = np.array([math.sin(_LEAN), math.cos(_LEAN), 0.0])
    ahead = np.array([-math.cos(_LEAN), math.sin(_LEAN), 0.0])
    for side in SIDES:
        index = robot.frame_id(f"{side}-foot")
        foot = model.frames[index]
        for end, along in _ENDS.items():
            there = pin.SE3(np.eye(3), _CENTRE + _RADIUS * down + along * ahead)
            place = foot.placement * there
            kind = pin.FrameType.OP_FRAME
            model.addFrame(pin.Frame(f"{side}-{end}", foot.parentJoint, index, place, kind))
    return model


def _make_universal(joint: ET.Element, other: np.ndarray) -> None:
    """Give a rod's hinge a second axis, across the first and across the rod."""
    numbers = [float(word) for word in joint.findtext("pose", "0 0 0 0 0 0").split()]
    here = pin.SE3(pin.rpy.rpyToMatrix(*numbers[3:]), np.array(numbers[:3]))
    across = np.cross([0.0, 0.0, 1.0], here.actInv(other))
    joint.set("type", "universal")
    axis = ET.SubElement(ET.SubElement(joint, "axis2"), "xyz")
    axis.text = " ".join(repr(float(c)) for c in across / np.linalg.norm(across))
