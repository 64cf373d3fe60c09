"""MujocoSimulator: a stance in MuJoCo, with the robot and contacts that the analysis uses.

`load_mujoco` imports the package for everything in `copsense.simulation`. Before the first step,
mass matrix, bias forces and centre of mass are compared with Pinocchio's.
"""

from __future__ import annotations

import os
import sys
from ctypes.util import find_library
from typing import Any

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from copsense.errors import (
    EngineMismatchError,
    InvalidInputError,
    UnknownNameError,
)
from copsense.extras import require
from copsense.robot import Robot
from copsense.simulation.mujoco_model import build_model
from copsense.simulation.physics_settings import PhysicsSettings
from copsense.simulation.simulator import SimulatorStoppedError, Snapshot
from copsense.stance import Stance

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

    def __init__(
        self,
        stance: Stance,
        settings: PhysicsSettings | None = None,
        *,
        wrenches: str = "contacts",
    ) -> None:
        """Build the model and compare the engines."""
        if wrenches not in ("contacts", "sensors"):
            raise UnknownNameError("source of wrenches", wrenches, ("contacts", "sensors"))
        self._stance = stance
        self.settings: PhysicsSettings = settings or PhysicsSettings()
        self._mujoco = load_mujoco()
        self._source = wrenches
        self._feet = _feet(stance) if wrenches == "sensors" else ()
        self._model = build_model(self._mujoco, stance, self.settings, sensors=bool(self._feet))
        self._data = self._mujoco.MjData(self._model)
        joints = [self._model.joint(name) for name in stance.robot.joint_names]
        self._columns = np.concatenate([np.arange(6), [int(j.dofadr[0]) for j in joints]])
        self._positions = np.array([int(j.qposadr[0]) for j in joints], dtype=int)
        self._sites = [self._model.site(f"contact {name}").id for name in stance.contact_names]
        points = [self._model.geom(g).name.partition(" | ") for g in range(self._model.ngeom)]
        self._contact_of = np.array(
            [stance.contact_names.index(name) if mark else -1 for name, mark, _ in points]
        )
        self._circles = _circles(stance.robot)
        self._is_plain = np.array([not circle for _, circle in self._circles], dtype=bool)
        self._plain = np.array([i for i, circle in self._circles if not circle], dtype=int)
        self._round = np.array([i for i, circle in self._circles if circle], dtype=int)
        self._fixed_axes = {
            k: world.rotation
            for k, (c, world) in enumerate(zip(stance.contacts, stance.placements, strict=True))
            if c.kind == "point"
        }
        under = self._model.pair_geom2[: self._model.npair]
        self._contact_of_pair = self._contact_of[under]
        self._friction = self._model.pair_friction.copy()
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
        data, before = self._data, float(self._data.time)
        # Motors and pushes are generalised forces, without MuJoCo's gears and ranges.
        data.qfrc_applied[self._columns[6:]] = torques
        data.qfrc_applied[:6] = 0.0
        if external is not None:
            base = pin.Quaternion(*self._data.qpos[3:7]).matrix()
            data.qfrc_applied[:3] = base @ external[:3]
            data.qfrc_applied[3:6] = external[3:6]
            data.qfrc_applied[self._columns[6:]] += external[6:]
        shown = self._mujoco.get_mju_user_warning()
        self._mujoco.set_mju_user_warning(_quiet)  # else it writes a log file here
        self._mujoco.mj_step(self._model, data)
        self._mujoco.set_mju_user_warning(shown)
        warned = [w for w in _FATAL if data.warning[getattr(self._mujoco.mjtWarning, w)].number]
        if warned or not data.time > before:
            raise SimulatorStoppedError(
                f"MuJoCo stopped ({', '.join(warned) or 'it reset itself'}): the motion diverged",
                before,
            )
        if not (np.all(np.isfinite(data.qpos)) and np.all(np.isfinite(data.qvel))):
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

    def _move(self, q: np.ndarray, v: np.ndarray) -> None:
        """Write a configuration and velocity of Pinocchio into MuJoCo's state."""
        x, y, z, w = q[3:7]
        self._data.qpos[:7] = [*q[:3], w, x, y, z]
        # A continuous joint is (cos, sin) in Pinocchio and an angle in MuJoCo.
        self._data.qpos[self._positions] = [
            np.arctan2(q[i + 1], q[i]) if round_ else q[i] for i, round_ in self._circles
        ]
        self._data.qvel[self._columns] = v
        self._data.qvel[:3] = pin.Quaternion(w, x, y, z).matrix() @ v[:3]

    def _snapshot(self, *, measured: bool) -> Snapshot:
        data = self._data
        q = np.empty(self._stance.robot.model.nq)
        w, x, y, z = data.qpos[3:7]
        q[:7] = [*data.qpos[:3], x, y, z, w]
        angles = data.qpos[self._positions]
        q[self._plain] = angles[self._is_plain]
        if len(self._round):
            turns = angles[~self._is_plain]
            q[self._round], q[self._round + 1] = np.cos(turns), np.sin(turns)
        v = data.qvel[self._columns]
        # MuJoCo's base: linear velocity in world axes, angular in its own.
        v[:3] = pin.Quaternion(w, x, y, z).matrix().T @ v[:3]
        rotations = data.site_xmat[self._sites].reshape(-1, 3, 3).copy()
        positions = data.site_xpos[self._sites].copy()
        wrenches = np.zeros((len(self._sites), 6))
        if measured:
            measure = self._sensed if self._feet else self._wrenches
            wrenches = measure(positions, rotations)
        return Snapshot(float(data.time), q, v, wrenches, positions, rotations)

    def _wrenches(self, positions: np.ndarray, rotations: np.ndarray) -> Float[np.ndarray, "nc 6"]:
        """Contact forces of the last step, summed about each contact frame, in its axes."""
        data, found = self._data, self._data.contact
        forces, moments = np.zeros((2, len(self._sites), 3))
        touching = np.flatnonzero(found.efc_address >= 0)
        if len(touching):
            owner, start = self._contact_of[found.geom[touching, 1]], found.efc_address[touching]
            # Elliptic cones: the solver's forces are (normal, tangent, tangent) in the contact's
            # axes, the rows of its frame.
            local = data.efc_force[start[:, None] + _THREE]
            force = np.einsum("ci,cij->cj", local, found.frame[touching].reshape(-1, 3, 3))
            arm = found.pos[touching] - positions[owner]
            np.add.at(forces, owner, force)
            np.add.at(moments, owner, _cross(arm, force))
        if self._fixed_axes:
            rotations = rotations.copy()
        for k, axes in self._fixed_axes.items():
            rotations[k], moments[k] = (
                axes,
                0.0,
            )  # the only moment of a point is that of its ball's radius
        turned = np.stack([forces, moments], axis=1) @ rotations
        return np.asarray(turned.reshape(len(self._sites), 6))

    def _sensed(self, positions: np.ndarray, rotations: np.ndarray) -> Float[np.ndarray, "nc 6"]:
        """Contact wrenches from six-axis sensors above the feet: reading plus foot's weight.

        Exact at rest; in motion the foot's own acceleration is missing, as on a real robot.
        """
        # The sensor measures the wrench of the link above on the foot, about the contact frame.
        wrenches = -self._data.sensordata.reshape(len(self._feet), 6)
        gravity = self._stance.robot.model.gravity.linear
        for k, (mass, lever) in enumerate(self._feet):
            R = rotations[k]
            weight = R.T @ (mass * gravity)
            wrenches[k] -= np.concatenate([weight, np.cross(lever, weight)])
        for k, axes in self._fixed_axes.items():
            wrenches[k, :3] = axes.T @ rotations[k] @ wrenches[k, :3]
            wrenches[k, 3:] = 0.0
        return wrenches

    def _compare(self) -> None:
        """Compare both engines at the start, and at a nearby posture in motion."""
        robot, random = self._stance.robot, np.random.default_rng(0)
        model, zero = robot.model, np.zeros(robot.model.nv)
        for size in (0.0, 0.3):
            q = pin.integrate(model, self._stance.q, size * random.uniform(-1, 1, model.nv))
            v = size * random.uniform(-1, 1, model.nv)
            self._move(q, v)
            self._mujoco.mj_forward(self._model, self._data)
            M = np.zeros((model.nv, model.nv))
            self._mujoco.mj_fullM(self._model, self._data, M)
            world = np.eye(model.nv)
            world[:3, :3] = pin.Quaternion(*self._data.qpos[3:7]).matrix()
            M = world.T @ M[np.ix_(self._columns, self._columns)] @ world
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
            for what, (here, there) in pairs.items():
                off = float(np.abs(here - there).max()) / max(1.0, float(np.abs(there).max()))
                if not off <= _AGREEMENT:
                    raise EngineMismatchError(
                        f"MuJoCo and Pinocchio disagree on the {what} of {robot.name!r}, "
                        f"relatively by {off:.1e}. A joint or an inertia of this robot is not "
                        "supported. Simplify the robot's description."
                    )


_THREE = np.arange(3)
_FATAL = ("mjWARN_BADQPOS", "mjWARN_BADQVEL", "mjWARN_BADQACC", "mjWARN_BADCTRL")


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Rows of a x b; np.cross would take longer than the rest of a step."""
    x, y, z = a.T
    u, v, w = b.T
    return np.column_stack([y * w - z * v, z * u - x * w, x * v - y * u])


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


def _circles(robot: Robot) -> list[tuple[int, bool]]:
    """Each joint's index in a configuration, and whether it is stored as (cos, sin)."""
    return [(joint.idx_q, joint.nq == 2) for joint in list(robot.model.joints)[2:]]


def _feet(stance: Stance) -> tuple[tuple[float, np.ndarray], ...]:
    """Mass of the link of each contact, and its centre in the contact frame [m]."""
    robot, found, links = stance.robot, [], set()
    for contact in stance.contacts:
        at = contact.on(robot)
        if at.joint in links or at.joint < 2:
            raise InvalidInputError(
                f"contact {contact.name!r} shares its link with another contact, or is on the "
                'base: a sensor cannot tell them apart. Measure wrenches from "contacts".'
            )
        links.add(at.joint)
        inertia = robot.model.inertias[at.joint]
        found.append((float(inertia.mass), at.placement.actInv(inertia.lever)))
    return tuple(found)
