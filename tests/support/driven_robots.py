"""Robots with rods, couplings, springs and joints without motors, built here."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from copsense import Contact, Robot, Stance, load_robot, load_stance, solve_posture
from copsense.closing import close
from copsense.drives import Coupling, Drives, Loop, Spring, Transmission

SOLE = np.array([(-0.06, -0.04), (0.12, -0.04), (0.12, 0.04), (-0.06, 0.04)])


def _add(
    model: pin.Model,
    parent: int,
    name: str,
    kind: str,
    place: tuple[float, float, float],
    mass: float,
    com: tuple[float, float, float],
    effort: float = 80.0,
) -> int:
    joint = getattr(pin, f"JointModel{kind}")()
    at = pin.SE3(np.eye(3), np.array(place))
    big = np.full(joint.nv, 3.0)
    i = model.addJoint(
        parent, joint, at, name, np.full(joint.nv, effort), np.full(joint.nv, 20.0), -big, big
    )
    size = 0.05 + 0.3 * abs(com[2])
    inertia = pin.Inertia.FromBox(mass, size, 0.8 * size, 1.2 * size)
    inertia.lever = np.array(com)
    model.appendBodyToJoint(i, inertia, pin.SE3.Identity())
    return i


def _frame(model: pin.Model, joint: int, name: str, place: tuple[float, float, float]) -> None:
    at = pin.SE3(np.eye(3), np.array(place))
    model.addFrame(pin.Frame(name, joint, 0, at, pin.FrameType.OP_FRAME))


def rod_biped_model(rods: bool = True) -> pin.Model:
    """A biped of 26 kg whose ankles pitch by a crank on the shank, a rod, and a pin at the heel."""
    model = pin.Model()
    model.name = "rod_biped"
    base = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "root_joint")
    trunk = pin.Inertia.FromBox(12.0, 0.2, 0.3, 0.4)
    trunk.lever = np.array([0.01, 0.004, 0.15])
    model.appendBodyToJoint(base, trunk, pin.SE3.Identity())
    for side, y in (("l", 0.09), ("r", -0.09)):
        yaw = _add(model, base, f"{side}_hip_yaw", "RZ", (0, y, 0), 0.3, (0, 0, -0.02))
        roll = _add(model, yaw, f"{side}_hip_roll", "RX", (0, 0, -0.03), 0.4, (0, 0, -0.01))
        hip = _add(model, roll, f"{side}_hip", "RY", (0, 0, 0), 2.5, (0.01, 0, -0.15))
        knee = _add(model, hip, f"{side}_knee", "RY", (0, 0, -0.32), 1.6, (0, 0.01, -0.12))
        pitch = _add(model, knee, f"{side}_ankle_pitch", "RY", (0, 0, -0.3), 0.2, (0, 0, -0.01))
        foot = _add(model, pitch, f"{side}_ankle_roll", "RX", (0, 0, -0.01), 0.8, (0.03, 0, -0.03))
        _frame(model, foot, f"{side}_foot", (0, 0, -0.06))
        _frame(model, pitch, f"{side}_heel", (-0.07, 0, -0.0))
        if rods:
            crank = _add(model, knee, f"{side}_crank", "RY", (-0.02, 0, -0.06), 0.15, (-0.02, 0, 0))
            rod = _add(model, crank, f"{side}_rod", "RY", (-0.06, 0, 0.0), 0.25, (0, 0, -0.12))
            _frame(model, rod, f"{side}_rod_end", (0.01, 0, -0.245))
    arm = _add(model, base, "arm", "RY", (0, 0.0, 0.35), 1.2, (0, 0.02, -0.2))
    _add(model, arm, "forearm", "RY", (0, 0, -0.3), 0.7, (0, 0, -0.15))
    _frame(model, model.njoints - 1, "hand", (0, 0, -0.25))
    return model


BENT = {"hip": -0.35, "knee": 0.7, "ankle_pitch": -0.35}


def rod_drives(kind: str = "pin") -> Drives:
    """Motors on hips, knees, cranks and the arm; rods pinned, balled or both to the heels."""
    motors = [
        f"{side}_{joint}"
        for side in "lr"
        for joint in ("hip_yaw", "hip_roll", "hip", "knee", "ankle_roll", "crank")
    ]
    loops = [
        Loop(f"{side}_rod_end", f"{side}_heel", kind, axis=(0, 1, 0), name=f"{side} rod")
        for side in "lr"
    ]
    return Drives(motors=(*motors, "arm", "forearm"), loops=tuple(loops))


def standing(robot: Robot, com_y: float = 0.0, joints: dict[str, float] | None = None) -> Stance:
    """The robot on both soles, bent, loops closed."""
    angles = {f"{side}_{j}": a for side in "lr" for j, a in BENT.items()}
    angles |= {"arm": 0.3, "forearm": -0.9} | (joints or {})
    known = {j: a for j, a in angles.items() if j in robot.joint_names}
    contacts = [Contact(f"{side}_foot", polygon=SOLE) for side in "lr"]
    bare = Stance(robot, robot.configuration(known), contacts, False)
    forward = float(np.mean([place.translation[0] for place in bare.placements])) + 0.01
    return solve_posture(bare, com=(forward, com_y, None)).stance


def everything() -> Robot:
    """Rods, a coupling, a transmission, springs with and without a motor, and a held torque."""
    drives = rod_drives()
    motors = [m for m in drives.motors or () if m not in ("l_hip_yaw", "l_hip_roll", "forearm")]
    motors = [m for m in motors if m != "r_hip_yaw"]
    both = Transmission(
        ("l_left", "l_right"),
        ("l_hip_yaw", "l_hip_roll"),
        np.array([[1.0, -0.6], [0.8, 1.1]]),
        (50.0, 60.0),
    )
    return Robot.from_model(
        rod_biped_model(),
        drives=Drives(
            motors=tuple(motors),
            springs={
                "forearm": Spring(12.0, -0.7),
                "l_knee": Spring(40.0, 0.5),
                "r_ankle_pitch": Spring(25.0, -0.1),
            },
            held={"arm": 0.4},
            couplings=(Coupling("r_hip_yaw", "l_hip_yaw", -0.9, 0.02),),
            loops=drives.loops,
            transmissions=(both,),
        ),
    )


def five_bar_model() -> pin.Model:
    """A quadruped of 14 kg: hips that roll, and legs of two cranks and two rods that meet below."""
    model = pin.Model()
    model.name = "five_bars"
    base = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "root_joint")
    trunk = pin.Inertia.FromBox(9.0, 0.5, 0.25, 0.12)
    trunk.lever = np.array([0.01, 0.003, 0.02])
    model.appendBodyToJoint(base, trunk, pin.SE3.Identity())
    for leg, x, y in (
        ("fl", 0.2, 0.14),
        ("fr", 0.2, -0.14),
        ("hl", -0.2, 0.14),
        ("hr", -0.2, -0.14),
    ):
        roll = _add(model, base, f"{leg}_roll", "RX", (x, y, 0), 0.4, (0, 0, -0.01))
        for way, sign in (("front", 1.0), ("rear", -1.0)):
            at = (0.03 * sign, 0, 0)
            crank = _add(model, roll, f"{leg}_{way}", "RY", at, 0.25, (0, 0, -0.05))
            rod = _add(model, crank, f"{leg}_{way}_rod", "RY", (0, 0, -0.12), 0.15, (0, 0, -0.1))
            _frame(model, rod, f"{leg}_{way}_tip", (0, 0, -0.2))
    return model


def five_bars() -> Stance:
    """The quadruped on four points, motors on hips and cranks, springs in two of the rods."""
    model = five_bar_model()
    legs = ("fl", "fr", "hl", "hr")
    drives = Drives(
        motors=tuple(f"{leg}_{joint}" for leg in legs for joint in ("roll", "front", "rear")),
        springs={"fl_front_rod": Spring(3.0, 0.4), "hr_rear_rod": Spring(2.0, -1.0)},
        loops=tuple(Loop(f"{leg}_rear_tip", f"{leg}_front_tip", "ball") for leg in legs),
    )
    robot = Robot.from_model(model, drives=drives)
    angles = {}
    for leg in legs:
        angles |= {f"{leg}_front": -0.7, f"{leg}_front_rod": 1.0}
        angles |= {f"{leg}_rear": 0.7, f"{leg}_rear_rod": -1.0}
    q = close(robot, robot.configuration(angles), [name for name in angles if "rod" not in name])
    contacts = [Contact(f"{leg}_front_tip", kind="point") for leg in legs]
    return solve_posture(Stance(robot, q, contacts, False), com=(0.01, 0.004, None)).stance


def hand_in_hand() -> Stance:
    """The iCub with its hands on one ball, and no motor in its arms: five motions hang."""
    robot = load_robot("icub")
    idle = ("shoulder", "elbow")
    motors = tuple(n for n in robot.dof_names if not any(word in n for word in idle))
    return load_stance(
        "icub", drives=Drives(motors=motors, loops=(Loop("l_hand", "r_hand", "ball"),))
    )
