"""The presets: robots from packages, their feet and a posture to stand in, as data."""

from __future__ import annotations

import importlib.util
import math
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np
from jaxtyping import Float

from copsense.contact import Contact, rectangle
from copsense.content import ShortRepr, freeze
from copsense.errors import MissingExtraError, ModelLoadError
from copsense.robot import Robot
from copsense.robots.cassie import cassie_contacts, cassie_posture, cassie_robot
from copsense.robots.four_bar import four_bar_angles, four_bar_robot


@dataclass(frozen=True, eq=False, repr=False)
class Preset(ShortRepr):
    """A robot that copsense knows by name.

    Attributes:
        name: what the user types.
        summary: one line for `copsense robots`.
        load: builds the robot.
        contacts: its feet. Offsets and polygons of `sole_from_geometry` presets are completed from
            the collision geometry.
        posture: joint name -> position [rad, or m for a prismatic joint]; others stand at zero.
        base_rpy: orientation of the base, roll, pitch, yaw [rad].
        width: lateral distance between the feet [m], or None to leave it as the posture has it.
        sole_from_geometry: ``"frame"`` reads the polygon only and keeps the contact at the model's
            frame; ``"sole"`` moves the contact to the sole's bottom too; None reads nothing.
    """

    name: str
    summary: str
    load: Callable[[], Robot]
    contacts: tuple[Contact, ...]
    posture: Mapping[str, float] = field(default_factory=dict)
    base_rpy: tuple[float, float, float] = (0.0, 0.0, 0.0)
    width: float | None = None
    sole_from_geometry: str | None = "sole"

    def __post_init__(self) -> None:
        """Own the posture."""
        freeze(self, "posture")


ICUB_JOINTS = (
    "torso_pitch",
    "torso_roll",
    "torso_yaw",
    *(f"{side}_shoulder_{axis}" for side in "lr" for axis in ("pitch", "roll", "yaw")),
    *(f"{side}_elbow" for side in "lr"),
    *(
        f"{side}_{joint}"
        for side in "lr"
        for joint in ("hip_pitch", "hip_roll", "hip_yaw", "knee", "ankle_pitch", "ankle_roll")
    ),
)
"""The 23 joints that [Romano2016] controls."""

ICUB_MODELS = (
    "iCubDarmstadt01",
    "iCubErzelli02",
    "iCubGazeboV2_5",
    "iCubGazeboV2_5_KIT_007",
    "iCubGazeboV2_6",
    "iCubGazeboV2_7",
    "iCubGenova01",
    "iCubGenova02",
    "iCubGenova03",
    "iCubGenova04",
    "iCubGenova11",
    "iCubLisboa01",
    "iCubNancy01",
    "iCubWaterloo01",
)


def _sides(
    angles: Mapping[str, float], left: str, right: str, mirrored: Iterable[str] = ()
) -> dict[str, float]:
    """A symmetric posture [rad] from angles [deg]: `*` in a name becomes each side's letters."""
    posture = {}
    for joint, degrees in angles.items():
        angle = math.radians(degrees)
        posture[joint.replace("*", left)] = angle
        posture[joint.replace("*", right)] = -angle if joint in mirrored else angle
    return posture


_ICUB_POSTURE = _sides(
    {
        "*_hip_pitch": 12.0,
        "*_knee": -10.0,
        "*_ankle_pitch": -2.0,
        "*_shoulder_pitch": -20.0,
        "*_shoulder_roll": 20.0,
        "*_elbow": 45.0,
    },
    "l",
    "r",
)


def _icub(model: str, name: str, joints: tuple[str, ...] | None = None) -> Robot:
    if importlib.util.find_spec("icub_models") is None:
        raise MissingExtraError("icub-models", "icub", f"robot {name!r}")
    import icub_models

    path = Path(icub_models.get_model_file(model))
    # Meshes are package://iCub/..., and the package folder is the one above the robots'.
    share = next(folder.parent for folder in path.parents if folder.name == "iCub")
    robot = Robot.from_urdf(path, name=name, package_dirs=[share])
    return robot.keeping(joints) if joints else robot


def example_file(path: str, name: str) -> tuple[Path, Path]:
    """A file of example-robot-data, a package of data without a Python module; its share folder."""
    folders = [Path(entry) / "cmeel.prefix" / "share" for entry in sys.path]
    folders.append(Path(sys.prefix) / "share")
    for share in folders:
        file = share / "example-robot-data" / "robots" / path
        if file.is_file():
            return file, share
    raise MissingExtraError("example-robot-data", "robots", f"robot {name!r}")


def _example(path: str, name: str, locked: tuple[str, ...] = ()) -> Robot:
    file, share = example_file(path, name)
    robot = Robot.from_urdf(file, name=name, package_dirs=[share])
    keep = [j for j in robot.joint_names if not any(part in j for part in locked)]
    return robot.keeping(keep) if locked else robot


def _cassie() -> Robot:
    return cassie_robot(example_file("cassie_description/robots/cassie_v2.sdf", "cassie")[0])


def _frame_rotation(x: str, y: str, z: str) -> Float[np.ndarray, "3 3"]:
    """Contact axes given as signed axes of the model's frame, such as ``"+x", "-z", "+y"``."""
    return np.column_stack(
        [(-1.0 if axis[0] == "-" else 1.0) * np.eye(3)["xyz".index(axis[1])] for axis in (x, y, z)]
    )


def _icub_named(model: str) -> Preset:
    # The oldest iCub's sole frames have their x axis up.
    turn = _frame_rotation("+z", "-y", "+x") if model == "iCubLisboa01" else np.eye(3)
    return Preset(
        model,
        f"{model} with all its joints, contacts at the soles' bottom",
        partial(_icub, model, model),
        (Contact("l_sole", rotation=turn), Contact("r_sole", rotation=turn)),
        _ICUB_POSTURE,
        base_rpy=(0.0, 0.0, math.pi),
    )


def _points(*frames: str) -> tuple[Contact, ...]:
    return tuple(Contact(frame, kind="point", friction=0.7) for frame in frames)


_HUMAN_FOOT = Contact(
    "left_foot",
    # Its frames have y up; the sole is the lowest centimetre of the foot's drawing.
    rotation=_frame_rotation("+x", "-z", "+y"),
    offset=(0.0, -0.0765, 0.0),
    polygon=rectangle((-0.06, 0.20), (-0.05, 0.05)),
)

_LISTED = (
    Preset(
        "icub",
        "iCubGenova04 reduced to the 23 joints and the posture of [Romano2016]",
        partial(_icub, "iCubGenova04", "icub", ICUB_JOINTS),
        (Contact("l_sole"), Contact("r_sole")),
        _ICUB_POSTURE,
        base_rpy=(0.0, 0.0, math.pi),
        width=0.14,
        sole_from_geometry="frame",
    ),
    Preset(
        "four_bar",
        "the planar four-bar linkage of [Romano2016] Section IV",
        four_bar_robot,
        (Contact("l_sole", kind="planar"), Contact("r_sole", kind="planar")),
        four_bar_angles(np.pi / 2),
        sole_from_geometry=None,
    ),
    Preset(
        "talos",
        "PAL Robotics Talos, half sitting",
        partial(_example, "talos_data/robots/talos_reduced.urdf", "talos", ("gripper", "head")),
        (Contact("left_sole_link"), Contact("right_sole_link")),
        _sides(
            {"leg_*_3_joint": -23.6, "leg_*_4_joint": 49.2, "leg_*_5_joint": -25.7}, "left", "right"
        )
        | _sides(
            {"arm_*_1_joint": 14.8, "arm_*_2_joint": 9.9, "arm_*_4_joint": -30.1},
            "left",
            "right",
            mirrored=("arm_*_1_joint", "arm_*_2_joint"),
        ),
    ),
    Preset(
        "romeo",
        "SoftBank Romeo, half sitting",
        partial(_example, "romeo_description/urdf/romeo_small.urdf", "romeo"),
        (Contact("l_sole"), Contact("r_sole")),
        _sides(
            {
                "*HipPitch": -20.0,
                "*KneePitch": 40.0,
                "*AnklePitch": -20.0,
                "*ShoulderPitch": 86.0,
                "*ShoulderYaw": 17.0,
            },
            "L",
            "R",
            mirrored=("*ShoulderYaw",),
        ),
    ),
    Preset(
        "g1",
        "Unitree G1, 29 joints",
        partial(_example, "g1_description/urdf/g1_29dof_rev_1_0.urdf", "g1"),
        (Contact("left_ankle_roll_link"), Contact("right_ankle_roll_link")),
        _sides(
            {
                "*_hip_pitch_joint": -15.0,
                "*_knee_joint": 30.0,
                "*_ankle_pitch_joint": -15.0,
                "*_shoulder_roll_joint": 12.0,
            },
            "left",
            "right",
            mirrored=("*_shoulder_roll_joint",),
        ),
    ),
    Preset(
        "human",
        "a human model of 74.7 kg with the proportions of an adult",
        partial(_example, "human_description/robots/human.urdf", "human"),
        (
            _HUMAN_FOOT,
            Contact(
                "right_foot",
                rotation=_HUMAN_FOOT.rotation,
                offset=_HUMAN_FOOT.offset,
                polygon=_HUMAN_FOOT.polygon,
            ),
        ),
        _sides(
            {"*_hip_Z": 15.0, "*_knee_Z": 30.0, "*_ankle_Z": 15.0, "*_elbow_Z": 10.0},
            "left",
            "right",
        ),
        base_rpy=(math.pi / 2, 0.0, 0.0),
        sole_from_geometry=None,
    ),
    Preset(
        "solo12",
        "Open Dynamic Robot Initiative Solo 12, a quadruped on point feet",
        partial(_example, "solo_description/robots/solo12.urdf", "solo12"),
        _points("FL_FOOT", "FR_FOOT", "HL_FOOT", "HR_FOOT"),
        _sides({"F*_HFE": 45.0, "F*_KFE": -90.0, "H*_HFE": -45.0, "H*_KFE": 90.0}, "L", "R"),
        sole_from_geometry=None,
    ),
    Preset(
        "anymal_c",
        "ANYbotics ANYmal C, a quadruped on point feet",
        partial(_example, "anymal_c_simple_description/urdf/anymal.urdf", "anymal_c"),
        _points("LF_FOOT", "RF_FOOT", "LH_FOOT", "RH_FOOT"),
        _sides({"*F_HFE": 40.0, "*F_KFE": -57.0, "*H_HFE": -40.0, "*H_KFE": 57.0}, "L", "R"),
        sole_from_geometry=None,
    ),
    Preset(
        "go2",
        "Unitree Go2, a quadruped on point feet",
        partial(_example, "go2_description/urdf/go2.urdf", "go2"),
        _points("FL_foot", "FR_foot", "RL_foot", "RR_foot"),
        _sides({"*L_thigh_joint": 51.6, "*L_calf_joint": -103.0}, "F", "R")
        | _sides({"*R_thigh_joint": 51.6, "*R_calf_joint": -103.0}, "F", "R"),
        sole_from_geometry=None,
    ),
    Preset(
        "cassie",
        "Agility Cassie, ten motors and rods, on the lines under its feet; leaf springs straight",
        _cassie,
        cassie_contacts(),
        cassie_posture(),
        sole_from_geometry=None,
    ),
    *(_icub_named(model) for model in ICUB_MODELS),
)

PRESETS: dict[str, Preset] = {preset.name: preset for preset in _LISTED}


_SHARED: ContextVar[dict[str, Robot] | None] = ContextVar("shared presets", default=None)


@contextmanager
def shared_presets(kept: dict[str, Robot] | None = None) -> Iterator[None]:
    """Inside, a preset's robot and the meshes of its feet are read once.

    For code that loads the same robot again and again, and changes no model that it is given.

    Args:
        kept: name -> robot, filled here, to go on with in another such block.
    """
    token = _SHARED.set({} if kept is None else kept)
    try:
        yield
    finally:
        _SHARED.reset(token)


def preset_robot(preset: Preset) -> Robot:
    """Build a preset's robot, or give the one that `shared_presets` keeps.

    Raises:
        MissingExtraError: the package that holds it is not installed.
        ModelLoadError: the installed package has no such file.
    """
    shared = _SHARED.get()
    if shared is not None and preset.name in shared:
        return shared[preset.name]
    try:
        robot = preset.load()
    except FileNotFoundError as error:
        raise ModelLoadError(
            f"robot {preset.name!r} is not in the installed package: {error}"
        ) from None
    if shared is not None:
        shared[preset.name] = robot
    return robot
