"""ContactWrenches: what the ground does at each contact of a MuJoCo simulation."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from jaxtyping import Float

from copsense.errors import InvalidInputError
from copsense.simulation.mujoco_drives import driven_joints
from copsense.stance import Stance

Measure = Callable[
    [Float[np.ndarray, "nc 3"], Float[np.ndarray, "nc 3 3"]], Float[np.ndarray, "nc 2 3"]
]
"""Force and moment about each contact, world axes, from the contacts' positions and axes."""


class ContactWrenches:
    """The wrenches of the last step, by the engine's contact forces or by sensors.

    Args:
        mujoco: the package.
        model: of the stance, by `build_model`.
        data: of the simulation.
        stance: robot and contacts.
        sensors: whether to read six-axis sensors instead of the engine's contact forces.

    Raises:
        InvalidInputError: sensors cannot tell two contacts of one link apart.
    """

    def __init__(
        self, mujoco: Any, model: Any, data: Any, stance: Stance, *, sensors: bool
    ) -> None:
        """Choose how to measure."""
        self._mujoco, self._model, self._data = mujoco, model, data
        names = stance.contact_names
        sites = [model.site(f"contact {name}").id for name in names]
        self._links = np.array([int(model.site_bodyid[site]) for site in sites])
        self._com, self._outer = data.subtree_com[1], data.cfrc_ext
        points = [model.geom(g).name.partition(" | ") for g in range(model.ngeom)]
        self._contact_of = np.array([names.index(name) if mark else -1 for name, mark, _ in points])
        self._points = [k for k, c in enumerate(stance.contacts) if c.kind == "point"]
        self._axes = np.array([stance.placements[k].rotation for k in self._points])
        self._gravity = stance.robot.model.gravity.linear
        self._feet: tuple[tuple[float, np.ndarray], ...] = _feet(stance) if sensors else ()
        # The engine sums by link, which is quicker than to sum here, and takes loads and loops in.
        alone = len(np.unique(self._links)) == len(names) and not (
            stance.loads or stance.robot.drives.loops
        )
        self._measure: Measure = (
            self._by_sensor if sensors else self._by_link if alone else self._by_point
        )

    def contact_of_pairs(self) -> np.ndarray:
        """Index of the contact that each of the model's pairs of geometries belongs to."""
        return np.asarray(self._contact_of[self._model.pair_geom2[: self._model.npair]])

    def measure(
        self, positions: Float[np.ndarray, "nc 3"], rotations: Float[np.ndarray, "nc 3 3"]
    ) -> Float[np.ndarray, "nc 6"]:
        """Wrench of the environment on the robot at each contact, about its frame, in its axes.

        Args:
            positions: of the contact frames, world [m].
            rotations: their axes as columns, world; they turn with the foot.
        """
        axes, found = rotations, self._measure(positions, rotations)
        if self._points:
            # A point's axes do not turn, and its only moment is that of its ball's radius.
            axes = rotations.copy()
            axes[self._points], found[self._points, 1] = self._axes, 0.0
        return np.asarray((found @ axes).reshape(-1, 6))

    def _by_link(self, positions: np.ndarray, rotations: np.ndarray) -> np.ndarray:
        # The engine's own sums: moment, then force, on each link about the robot's CoM.
        self._mujoco.mj_rnePostConstraint(self._model, self._data)
        found: list[float] = []
        cx, cy, cz = self._com.tolist()
        # Written out: for so few numbers NumPy's own product takes four times as long.
        for outer, (px, py, pz) in zip(
            self._outer.take(self._links, axis=0).tolist(), positions.tolist(), strict=True
        ):
            mx, my, mz, fx, fy, fz = outer
            x, y, z = cx - px, cy - py, cz - pz
            found += (fx, fy, fz, mx + y * fz - z * fy, my + z * fx - x * fz, mz + x * fy - y * fx)
        return np.array(found).reshape(-1, 2, 3)

    def _by_point(self, positions: np.ndarray, rotations: np.ndarray) -> np.ndarray:
        points = self._data.contact
        touching = points.efc_address >= 0
        owner = self._contact_of[points.geom[touching, 1]]
        # Elliptic cones: the solver's forces are (normal, tangent, tangent) in the point's axes,
        # the rows of its frame.
        rows = points.efc_address[touching][:, None] + np.arange(3)
        local, frames = self._data.efc_force[rows][:, None], points.frame[touching]
        force = (local @ frames.reshape(-1, 3, 3))[:, 0]
        found = np.zeros((len(positions), 2, 3))
        np.add.at(found[:, 0], owner, force)
        np.add.at(found[:, 1], owner, np.cross(points.pos[touching] - positions[owner], force))
        return found

    def _by_sensor(self, positions: np.ndarray, rotations: np.ndarray) -> np.ndarray:
        """The reading plus the foot's weight.

        Exact at rest; in motion the foot's own acceleration is missing, as on a real robot.
        """
        # A sensor measures the wrench of the link above on the foot, about the contact frame.
        found = -self._data.sensordata.reshape(-1, 2, 3)
        for k, (mass, lever) in enumerate(self._feet):
            weight = rotations[k].T @ (mass * self._gravity)
            found[k, 0] -= weight
            found[k, 1] -= np.cross(lever, weight)
        return np.asarray(found @ rotations.transpose(0, 2, 1))


def _feet(stance: Stance) -> tuple[tuple[float, np.ndarray], ...]:
    """Mass of the link of each contact, and its centre in the contact frame [m]."""
    robot, found, links = stance.robot, [], set()
    pulled = driven_joints(stance)
    for contact in stance.contacts:
        at = contact.on(robot)
        if at.joint in links or at.joint < 2:
            raise InvalidInputError(
                f"contact {contact.name!r} shares its link with another contact, or is on the "
                'base: a sensor cannot tell them apart. Measure wrenches from "contacts".'
            )
        if at.joint in pulled:
            raise InvalidInputError(
                f"a rod or a load acts on the link of contact {contact.name!r} beside the ground: "
                'a sensor over the foot feels both. Measure wrenches from "contacts".'
            )
        links.add(at.joint)
        inertia = robot.model.inertias[at.joint]
        found.append((float(inertia.mass), at.placement.actInv(inertia.lever)))
    return tuple(found)
