"""placo's DynamicsSolver as a balancing controller; started by peers.py, see peers_pipe.py.

Whole-body inverse dynamics in one QP: the feet do not accelerate (hard), the CoM and the posture
follow their targets (soft), and far below them the criterion shares the load: forces and moments
(minimum wrench) or joint torques (minimum torque).
"""

from __future__ import annotations

import tempfile
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import placo
from peers_pipe import State, Step, Times, clock, serve

COM, POSTURE = 1e4, 1.0  # weights: the posture yields to the CoM
SHARE, OFF = 1e-4, 1e-14  # of the criterion that is asked for, and of the one that is not


def build(setup: dict[str, Any]) -> tuple[dict[str, Any], Step]:
    """The robot and the solver."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "robot.urdf"
        file.write_text(setup["urdf"])
        robot = placo.RobotWrapper(str(file), placo.Flags.ignore_collisions)
    joints = list(robot.joint_names())
    robot.state.q = start(setup, joints)
    robot.state.qd = np.zeros(6 + len(joints))
    robot.update_kinematics()
    hello = {
        "joints": joints,
        "mass": robot.total_mass(),
        "com": list(robot.com_world()),
        "versions": [f"{name} {version(name)}" for name in ("placo", "pin", "numpy")],
    }
    solver, gains, feet = placo.DynamicsSolver(robot), setup["gains"], []
    least = setup["criterion"] == "minimum-wrench"
    for contact in setup["contacts"]:
        frame = contact["centre"] if setup["limits"] else contact["name"]
        task = solver.add_frame_task(frame, robot.get_T_world_frame(frame))
        task.configure(frame, "hard")
        for part in (task.position(), task.orientation()):
            part.kp = part.kd = 0.0
        if setup["limits"]:
            foot = solver.add_planar_contact(task)
            foot.length, foot.width = (s - 2 * setup["limits"]["margin"] for s in contact["size"])
            foot.mu = setup["limits"]["friction"]
        else:
            foot = solver.add_fixed_contact(task)
        foot.weight_forces = foot.weight_moments = SHARE if least else OFF
        feet.append(foot)
    solver.torque_cost = OFF if least else SHARE
    com = solver.add_com_task(np.array(setup["com"]))
    com.configure("com", "soft", COM)
    com.kp, com.kd = gains["com"]
    posture = solver.add_joints_task()
    posture.configure("posture", "soft", POSTURE)
    posture.kp, posture.kd = gains["posture"]

    def step(state: State) -> tuple[Times, np.ndarray, np.ndarray]:
        called = clock()
        com.target_world, com.dtarget_world = state.com, state.com_velocity
        com.ddtarget_world = state.com_acceleration
        posture.set_joints(dict(zip(joints, map(float, state.posture[7:]), strict=True)))
        posture.set_joints_velocities(
            dict(zip(joints, map(float, state.velocity[6:]), strict=True))
        )
        began = clock()
        robot.state.q, robot.state.qd = state.q, state.v
        robot.update_kinematics()
        middle = clock()
        result = solver.solve(False)
        ended = clock()
        if not result.success:
            raise RuntimeError(f"the solver found no solution at {state.time:.3f} s")
        wrenches = np.array([np.ravel(foot.wrench) for foot in feet])
        torques = np.array(result.tau)[6:]
        times = (clock() - called, ended - began, ended - middle)
        if setup["limits"]:  # about the soles' centres, in the contact frames' axes
            for k, contact in enumerate(setup["contacts"]):
                wrenches[k, 3:] += np.cross(contact["offset"], wrenches[k, :3])
        return times, torques, wrenches

    return hello, step


def start(setup: dict[str, Any], joints: list[str]) -> np.ndarray:
    """The starting configuration in this model's order of joints."""
    place = dict(zip(setup["joints"], setup["start"][7:], strict=True))
    return np.array(setup["start"][:7] + [place.get(joint, 0.0) for joint in joints])


if __name__ == "__main__":
    serve(build)
