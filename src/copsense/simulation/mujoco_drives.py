"""A robot's drives and loads in MuJoCo: springs, couplings, loops, motors, and forces on links.

Couplings and loops are MuJoCo's equalities, which are soft: a force lam opens a loop as a spring
would that in the equality's own time constant answers with a share 1 - d of lam, d the engine's
largest impedance. What is left of that is divided by `STIFFER`, through the engine's own measure of
the inertia behind an equality.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
from jaxtyping import Float, Int

from copsense.closures import RANK, Closures, joined
from copsense.loads import apply_loads, load_places, load_wrench
from copsense.simulation.physics_settings import PhysicsSettings
from copsense.stance import Stance

_IMPEDANCE = 0.9999  # the largest that the engine takes


def add_drives(
    mujoco: Any, spec: Any, bodies: dict[int, Any], stance: Stance, settings: PhysicsSettings
) -> None:
    """Add springs, couplings, loops and the places of loads to a model that is being built.

    Args:
        mujoco: the package.
        spec: of the model.
        bodies: joint of the robot's model -> its body.
        stance: robot, contacts and loads.
        settings: of the physics.
    """
    robot = stance.robot
    for name, spring in robot.drives.springs.items():
        joint = spec.joint(name)
        joint.springref = spring.rest
        # A polynomial of the stretch, of which the linear spring comes first.
        joint.stiffness = [spring.stiffness, 0.0, 0.0]
    stiff = {
        "solref": [2.0 * settings.time_step, 1.0],
        "solimp": [_IMPEDANCE, _IMPEDANCE, 1e-3, 0.5, 2.0],
    }
    for k, pair in enumerate(joined(robot)):
        for end, at in (("a", pair.a), ("b", pair.b)):
            _add_site(bodies[at.joint], f"loop {k} {end}", at.placement)
        kind = "WELD" if pair.weld else "CONNECT"
        spec.add_equality(
            name=f"loop {k}",
            type=getattr(mujoco.mjtEq, f"mjEQ_{kind}"),
            objtype=mujoco.mjtObj.mjOBJ_SITE,
            name1=f"loop {k} a",
            name2=f"loop {k} b",
            **stiff,
        )
    for k, coupling in enumerate(robot.drives.couplings):
        follows = spec.add_equality(
            name=f"coupling {k}",
            type=mujoco.mjtEq.mjEQ_JOINT,
            objtype=mujoco.mjtObj.mjOBJ_JOINT,
            name1=coupling.joint,
            name2=coupling.of,
            **stiff,
        )
        # A polynomial in the leader's position, the constant first.
        follows.data = [coupling.offset, coupling.ratio, *[0.0] * (len(follows.data) - 2)]
    for k, at in enumerate(load_places(stance.loads, stance.robot)):
        _add_site(bodies[at.joint], f"load {k}", at.placement)


def driven_joints(stance: Stance) -> set[int]:
    """Joints of the model whose links a loop or a load acts on."""
    ends = {end.joint for pair in joined(stance.robot) for end in (pair.a, pair.b)}
    return ends | {at.joint for at in load_places(stance.loads, stance.robot)}


def quaternion(place: pin.SE3) -> list[float]:
    """The rotation of a placement in MuJoCo's order, w first."""
    x, y, z, w = pin.Quaternion(place.rotation).coeffs()
    return [w, x, y, z]


class DriveForces:
    """What motors, held torques and loads do to a MuJoCo simulation.

    Args:
        mujoco: the package.
        model: of the stance, by `build_model`.
        data: of the simulation.
        stance: robot, contacts and loads.
    """

    def __init__(self, mujoco: Any, model: Any, data: Any, stance: Stance) -> None:
        """Look up where the loads act."""
        robot = stance.robot
        self._mujoco, self._model, self._data = mujoco, model, data
        self._robot, self._loads = robot, stance.loads
        self._held = np.zeros(len(robot.dof_names))
        for joint, torque in robot.drives.held.items():
            self._held[robot.velocity_index(joint) - robot.base_nv] = torque
        self._loops = bool(robot.drives.loops or robot.drives.couplings)
        self._sites = [model.site(f"load {k}").id for k in range(len(stance.loads))]
        self._bodies = [int(model.site_bodyid[site]) for site in self._sites]

    def on_joints(self, torques: Float[np.ndarray, " k"]) -> Float[np.ndarray, " n"]:
        """Torques of the motors and of what is held, on the joints (n,)."""
        return np.asarray(self._robot.joint_torques(torques) + self._held)

    def apply_loads(self) -> None:
        """Put the loads on the links where they are now."""
        if not self._loads:
            return
        data = self._data
        # After a step the engine's places are those of its beginning.
        self._mujoco.mj_kinematics(self._model, data)
        self._mujoco.mj_comPos(self._model, data)
        data.xfrc_applied[:] = 0.0
        for load, site, body in zip(self._loads, self._sites, self._bodies, strict=True):
            place = pin.SE3(data.site_xmat[site].reshape(3, 3), data.site_xpos[site])
            wrench = load_wrench(load, place)
            arm = place.translation - data.xipos[body]
            data.xfrc_applied[body, :3] += wrench[:3]
            data.xfrc_applied[body, 3:] += wrench[3:] + np.cross(arm, wrench[:3])

    def pairs(
        self,
        q: Float[np.ndarray, " nq"],
        columns: slice | Int[np.ndarray, " nv"],
        world: Float[np.ndarray, "nv nv"],
    ) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """What both engines say of springs, loads and closures where the simulation is now.

        Args:
            q: configuration, loops closed.
            columns: of the engine's velocity, in the order of the robot's.
            world: to the engine's velocity from the robot's.

        Returns:
            What is compared -> the engine's answer, Pinocchio's.
        """
        robot, data, nv = self._robot, self._data, self._model.nv
        self.apply_loads()
        acting = np.zeros(nv)
        for body, wrench in enumerate(data.xfrc_applied):
            point = data.xipos[body]
            mujoco_apply = self._mujoco.mj_applyFT
            mujoco_apply(self._model, data, wrench[:3], wrench[3:], point, body, acting)
        data.xfrc_applied[:] = 0.0
        springs = robot.joint_forces(q)
        springs[robot.base_nv :] -= self._held
        loads = apply_loads(self._loads, robot, q).balanced
        here, there = _row_space(self._closure_rows()[:, columns] @ world), np.zeros((nv, nv))
        if self._loops:
            there = _row_space(Closures(robot, q).jacobian)
        return {
            "springs": (world.T @ data.qfrc_passive[columns], springs),
            "loads": (world.T @ acting[columns], loads),
            "loops and couplings": (here, there),
        }

    def _closure_rows(self) -> Float[np.ndarray, "l nv"]:
        """Jacobian of the engine's equalities, by its own velocities."""
        data, nv = self._data, self._model.nv
        rows = np.zeros((data.nefc, nv))
        if self._mujoco.mj_isSparse(self._model):
            where = data.efc_J_rownnz, data.efc_J_rowadr, data.efc_J_colind
            self._mujoco.mju_sparse2dense(rows, np.ravel(data.efc_J), *map(np.ravel, where))
        else:
            rows = np.reshape(data.efc_J, (-1, nv))[: data.nefc]
        kinds = np.array(data.efc_type[: data.nefc])
        return np.array(rows[kinds == int(self._mujoco.mjtConstraint.mjCNSTR_EQUALITY)])


def _row_space(rows: Float[np.ndarray, "l nv"]) -> Float[np.ndarray, "nv nv"]:
    """The projection on what rows span: the same for all rows that demand the same."""
    _, s, vt = np.linalg.svd(rows, full_matrices=False)
    kept = vt[s > RANK * max(1.0, s.max(initial=0.0))]
    return np.asarray(kept.T @ kept)


def _add_site(body: Any, name: str, place: pin.SE3) -> None:
    body.add_site(name=name, pos=place.translation, quat=quaternion(place))
