"""MujocoSimulator: a stance in MuJoCo, with the robot and contacts that the analysis uses.

`load_mujoco` imports the package for everything in `copsense.simulation`. Before the first step,
mass matrix, bias forces, centre of mass, springs, loads and loops are compared with Pinocchio's.
"""

from __future__ import annotations

import os
import sys
from ctypes.util import find_library
from typing import Any

import numpy as np
import pinocchio as pin
from jaxtyping import Float, Int

from copsense.arrays import check_type, is_finite
from copsense.closing import close
from copsense.errors import (
    EngineMismatchError,
    InvalidInputError,
    UnknownNameError,
)
from copsense.extras import require
from copsense.simulation.contact_wrenches import ContactWrenches
from copsense.simulation.mujoco_drives import DriveForces
from copsense.simulation.mujoco_model import build_model
from copsense.simulation.physics_settings import PhysicsSettings
from copsense.simulation.simulator import SimulatorStoppedError, Snapshot
from copsense.stance import Stance, check_stance

_AGREEMENT = 1e-8  # of mass matrix, bias and CoM, relative to their size


class MujocoSimulator:
    """A stance in MuJoCo: torque-controlled joints, soles on planes.

    The support points of a contact touch the plane of that contact and nothing else. The rest of
    the robot passes through the ground; a run ends with the fall before that matters.

    Args:
        stance: robot, start configuration and contacts.
        settings: time step and contact model.
        wrenches: how contact wrenches are measured: ``"contacts"`` sums the engine's contact
            forces; ``"sensors"`` reads a six-axis sensor between each foot and the joint above it
            and adds the foot's weight, as on a real robot.

    Raises:
        MissingExtraError: mujoco is not installed.
        InvalidInputError: the robot or a contact cannot be simulated.
        EngineMismatchError: MuJoCo's model of the robot differs from Pinocchio's.
    """

    def __repr__(self) -> str:
        """Robot, contacts and settings."""
        return f"MujocoSimulator({self._stance!r}, {self.settings!r})"

    def __init__(
        self,
        stance: Stance,
        settings: PhysicsSettings | None = None,
        *,
        wrenches: str = "contacts",
    ) -> None:
        """Build the model and compare the engines."""
        check_stance(stance)
        if settings is not None:
            remedy = "Give PhysicsSettings(time_step=1e-3), say, or leave it out."
            check_type(settings, PhysicsSettings, "a value of PhysicsSettings", remedy)
        if wrenches not in ("contacts", "sensors"):
            raise UnknownNameError("source of wrenches", wrenches, ("contacts", "sensors"))
        self._stance, self._nq = stance, stance.robot.model.nq
        self.settings: PhysicsSettings = settings or PhysicsSettings()
        self._mujoco = load_mujoco()
        self._source = wrenches
        sensors = wrenches == "sensors"
        self._model = build_model(self._mujoco, stance, self.settings, sensors=sensors)
        self._data = self._mujoco.MjData(self._model)
        self._wrenches = ContactWrenches(
            self._mujoco, self._model, self._data, stance, sensors=sensors
        )
        joints = [self._model.joint(name) for name in stance.robot.joint_names]
        self._columns = _indices([*range(6), *(int(j.dofadr[0]) for j in joints)])
        self._joints = _indices([int(j.dofadr[0]) for j in joints])
        self._positions = _indices([int(j.qposadr[0]) for j in joints])
        self._sites = _indices(
            [self._model.site(f"contact {name}").id for name in stance.contact_names]
        )
        # Views of the engine's memory: to ask it for them takes longer than to read them.
        data = self._data
        self._qpos, self._qvel, self._applied = data.qpos, data.qvel, data.qfrc_applied
        self._site_positions = data.site_xpos
        self._site_axes = data.site_xmat.reshape(-1, 3, 3)
        self._warnings = data.warning.number
        entries = stance.robot.position_entries
        self._is_plain = np.array([not circle for _, circle in entries], dtype=bool)
        self._plain = np.array([i for i, circle in entries if not circle], dtype=int)
        self._round = np.array([i for i, circle in entries if circle], dtype=int)
        self._contact_of_pair = self._wrenches.contact_of_pairs()
        self._friction = self._model.pair_friction.copy()
        driven = bool(stance.robot.drives or stance.loads)
        self._drive = DriveForces(self._mujoco, self._model, data, stance) if driven else None
        self._compare()
        self.reset()

    @property
    def stance(self) -> Stance:
        """Robot and contacts; its configuration is where a simulation starts."""
        return self._stance

    @property
    def time_step(self) -> float:
        """Duration of one step [s]."""
        return self.settings.time_step

    def reset(self, velocity: Float[np.ndarray, " nv"] | None = None) -> Snapshot:
        """Put the robot at the stance's configuration, time zero; see `Simulator.reset`."""
        self._mujoco.mj_resetData(self._model, self._data)
        self._model.pair_friction[:] = self._friction
        still = np.zeros(self._stance.robot.model.nv)
        self._move(self._stance.q, still if velocity is None else velocity)
        self._mujoco.mj_forward(self._model, self._data)
        # Without a warm start the same start gives the same run.
        self._data.qacc_warmstart[:] = 0.0
        return self._snapshot(measured=False)

    def step(
        self,
        torques: Float[np.ndarray, " n"],
        external: Float[np.ndarray, " nv"] | None = None,
    ) -> Snapshot:
        """Advance by one time step; see `Simulator.step`."""
        applied = self._command(torques)
        if external is not None:
            base = pin.Quaternion(*self._qpos[3:7]).matrix()
            applied[:3] = base @ external[:3]
            applied[3:6] = external[3:6]
            applied[self._joints] += external[6:]
        return self._advance(1)

    def repeat(self, torques: Float[np.ndarray, " n"], steps: int) -> Snapshot:
        """Advance by several time steps; see `RepeatingSimulator.repeat`."""
        if self._stance.loads:  # they follow their links from step to step
            for _ in range(steps - 1):
                self.step(torques)
            return self.step(torques)
        self._command(torques)
        return self._advance(steps)

    def _command(self, torques: np.ndarray) -> np.ndarray:
        """The engine's generalised forces, those of the motors written."""
        # Motors and pushes are generalised forces, without MuJoCo's gears and ranges.
        applied = self._applied
        if self._drive is None:
            applied[self._joints] = torques
        else:
            applied[self._joints] = self._drive.on_joints(torques)
            self._drive.apply_loads()
        applied[:6] = 0.0
        return applied

    def _advance(self, steps: int) -> Snapshot:
        """Let the engine go on under the forces written."""
        data, before = self._data, float(self._data.time)
        shown = self._mujoco.get_mju_user_warning()
        self._mujoco.set_mju_user_warning(_quiet)  # else it writes a log file here
        self._mujoco.mj_step(self._model, data, steps)
        self._mujoco.set_mju_user_warning(shown)
        warned = self._fatal_warnings() if any(self._warnings.tolist()) else []
        if warned or not data.time > before:
            raise SimulatorStoppedError(
                f"MuJoCo stopped ({', '.join(warned) or 'it reset itself'}): the motion diverged",
                before,
            )
        if not (is_finite(self._qpos) and is_finite(self._qvel)):
            raise SimulatorStoppedError("the motion is no longer finite", before)
        return self._snapshot(measured=True)

    def set_friction(self, friction: float, contact: str | None = None) -> None:
        """Change the ground's friction, under one contact or all, until the next reset."""
        chosen = np.ones(len(self._contact_of_pair), dtype=bool)
        if contact is not None:
            chosen = self._contact_of_pair == self._stance.contact_names.index(contact)
        self._model.pair_friction[chosen, :2] = friction

    def altered(self, stance: Stance) -> MujocoSimulator:
        """The same simulator with another robot on the same contacts."""
        return MujocoSimulator(stance, self.settings, wrenches=self._source)

    def _fatal_warnings(self) -> list[str]:
        """Names of the engine's warnings since the reset after which its state is not valid."""
        kinds = self._mujoco.mjtWarning
        return [name for name in _FATAL if self._warnings[int(getattr(kinds, name))]]

    def _move(self, q: np.ndarray, v: np.ndarray) -> None:
        """Write a configuration and velocity of Pinocchio into MuJoCo's state."""
        x, y, z, w = q[3:7]
        self._data.qpos[:7] = [*q[:3], w, x, y, z]
        # A continuous joint is (cos, sin) in Pinocchio and an angle in MuJoCo.
        self._data.qpos[self._positions] = self._stance.robot.joint_positions(q)
        self._data.qvel[self._columns] = v
        self._data.qvel[:3] = pin.Quaternion(w, x, y, z).matrix() @ v[:3]

    def _snapshot(self, *, measured: bool) -> Snapshot:
        turned = self._qpos[3:7]
        q = np.empty(self._nq)
        q[:3], q[3:6], q[6] = self._qpos[:3], turned[1:], turned[0]
        angles = self._qpos[self._positions]
        if len(self._round):
            q[self._plain] = angles[self._is_plain]
            turns = angles[~self._is_plain]
            q[self._round], q[self._round + 1] = np.cos(turns), np.sin(turns)
        else:
            q[7:] = angles
        v = self._qvel[self._columns].copy()
        # MuJoCo's base: linear velocity in world axes, angular in its own.
        v[:3] = _turned_back(turned.tolist(), v[:3].tolist())
        rotations = self._site_axes[self._sites].copy()
        positions = self._site_positions[self._sites].copy()
        if measured:
            wrenches = self._wrenches.measure(positions, rotations)
        else:
            wrenches = np.zeros((len(positions), 6))
        return Snapshot(self._data.time, q, v, wrenches, positions, rotations)

    def _compare(self) -> None:
        """Compare both engines at the start, and at a nearby posture in motion."""
        robot, random = self._stance.robot, np.random.default_rng(0)
        model, zero = robot.model, np.zeros(robot.model.nv)
        for size in (0.0, 0.3):
            q = pin.integrate(model, self._stance.q, size * random.uniform(-1, 1, model.nv))
            v = size * random.uniform(-1, 1, model.nv)
            if self._drive is not None:
                q = close(robot, q)
            self._move(q, v)
            self._mujoco.mj_forward(self._model, self._data)
            M = np.zeros((model.nv, model.nv))
            self._mujoco.mj_fullM(self._model, self._data, M)
            world = np.eye(model.nv)
            world[:3, :3] = pin.Quaternion(*self._data.qpos[3:7]).matrix()
            M = world.T @ M[self._columns][:, self._columns] @ world
            bias = world.T @ self._data.qfrc_bias[self._columns]
            # MuJoCo differentiates the base's linear velocity in world axes, Pinocchio in its own.
            drift = zero.copy()
            drift[:3] = np.cross(v[3:6], v[:3])
            pairs = {
                "mass matrix": (M, pin.crba(model, model.createData(), q)),
                "bias": (bias, pin.nonLinearEffects(model, model.createData(), q, v) - M @ drift),
                "centre of mass": (
                    self._data.subtree_com[1],
                    pin.centerOfMass(model, model.createData(), q),
                ),
            }
            if self._drive is not None:
                pairs |= self._drive.pairs(q, self._columns, world)
            for what, (here, there) in pairs.items():
                off = float(np.abs(here - there).max(initial=0.0))
                off /= max(1.0, float(np.abs(there).max(initial=0.0)))
                if not off <= _AGREEMENT:
                    raise EngineMismatchError(
                        f"MuJoCo and Pinocchio disagree on the {what} of {robot.name!r}, "
                        f"relatively by {off:.1e}. A joint or an inertia of this robot is not "
                        "supported. Simplify the robot's description."
                    )


_FATAL = ("mjWARN_BADQPOS", "mjWARN_BADQVEL", "mjWARN_BADQACC", "mjWARN_BADCTRL")


def _indices(found: list[int]) -> slice | Int[np.ndarray, " k"]:
    """Indices as a slice where they follow each other: it is read at once."""
    first = found[0] if found else 0
    if found == list(range(first, first + len(found))):
        return slice(first, first + len(found))
    return np.array(found, dtype=int)


def _turned_back(quaternion: list[float], vector: list[float]) -> tuple[float, float, float]:
    """R' v for the rotation R of a quaternion (w, x, y, z); a matrix would take far longer."""
    (w, x, y, z), (a, b, c) = quaternion, vector
    p, q, r = 2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)
    return a - w * p + y * r - z * q, b - w * q + z * p - x * r, c - w * r + x * q - y * p


def _quiet(message: str) -> None:
    """Ignore a warning: `step` reads the engine's counters instead."""


def load_mujoco() -> Any:
    """The package mujoco, which the extra `sim` installs."""
    # MuJoCo chooses how to draw off-screen when it is first imported.
    screen = {"DISPLAY", "WAYLAND_DISPLAY", "MUJOCO_GL"} & set(os.environ)
    if sys.platform == "linux" and not screen and find_library("EGL"):
        os.environ["MUJOCO_GL"] = "egl"
    require("mujoco", "simulating a robot")
    try:
        import mujoco
    except RuntimeError as error:  # MUJOCO_GL has an invalid value
        raise InvalidInputError(
            f"MuJoCo does not load: {error}. Leave the variable MUJOCO_GL out, or give egl, osmesa "
            "or glfw."
        ) from None
    return mujoco
