"""Whole postures: configurations as inputs, taken to the nearest posture on the contacts."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from copsense.batch.postures.nearest_postures import NearestPostures
from copsense.stance import Stance

_UNIT = 1e-3  # by which a quaternion's length may miss one before its row is wrong
_UPRIGHT = 1e-6  # cosine of the pitch under which roll and yaw turn about one axis


class WholePostures:
    """Configurations (N, nq) as the numbers that `NearestPostures` takes, and gradients back.

    Attributes:
        chart: the search.
    """

    chart: NearestPostures

    def __init__(self, stance: Stance) -> None:
        """Find where each number stands in a configuration."""
        self.chart = NearestPostures(stance)
        model = stance.robot.model
        self._nq, self._nb = int(model.nq), int(stance.robot.base_nv)
        joints = list(model.joints)[2:]
        self._plain = np.array([j.idx_q for j in joints if j.nq == 1], dtype=int)
        self._plain_v = np.array([j.idx_v for j in joints if j.nq == 1], dtype=int)
        self._round = np.array([j.idx_q for j in joints if j.nq == 2], dtype=int)
        self._round_v = np.array([j.idx_v for j in joints if j.nq == 2], dtype=int)
        if self._nb != 6:  # x, y, cosine and sine of a planar base
            self._round = np.append(2, self._round)
            self._round_v = np.append(2, self._round_v)
        root = model.jointPlacements[1]
        self._root, self._origin = np.array(root.rotation), np.array(root.translation)
        self._angles = np.array([unit == "rad" for unit in self.chart.units])

    def values(self, q: Float[np.ndarray, "N nq"]) -> tuple[np.ndarray, list[tuple[int, str]]]:
        """The numbers of each configuration (N, nv), and which rows are wrong, and why."""
        x = np.zeros((len(q), len(self.chart.names)))
        x[:, self._plain_v] = q[:, self._plain]
        x[:, self._round_v] = np.arctan2(q[:, self._round + 1], q[:, self._round])
        if self._nb != 6:
            x[:, :2] = q[:, :2]
            off = np.abs(np.hypot(q[:, self._round], q[:, self._round + 1]) - 1.0).max(axis=1)
            return x, [(int(i), "a cosine and sine is off the unit circle") for i in _beyond(off)]
        x[:, :3] = q[:, :3] @ self._root.T + self._origin
        R = self._rotations(q)
        level = np.hypot(R[:, 0, 0], R[:, 1, 0])
        x[:, 3] = np.arctan2(R[:, 2, 1], R[:, 2, 2])
        x[:, 4] = np.arctan2(-R[:, 2, 0], level)
        x[:, 5] = np.arctan2(R[:, 1, 0], R[:, 0, 0])
        off = np.abs(np.linalg.norm(q[:, 3:7], axis=1) - 1.0)
        wrong = [(int(i), "the base's quaternion is not of unit length") for i in _beyond(off)]
        upright = np.flatnonzero(~(level > _UPRIGHT))
        wrong += [(int(i), "the base pitches by 90 deg: roll and yaw are one") for i in upright]
        return x, wrong

    def moved(self, x: Float[np.ndarray, "N nv"], q: Float[np.ndarray, "N nq"]) -> np.ndarray:
        """By how much configurations differ from such numbers, the most of each row [m, rad]."""
        way = self.values(q)[0] - x
        turns = way[:, self._angles]
        way[:, self._angles] = turns - 2 * np.pi * np.round(turns / (2 * np.pi))
        return np.asarray(np.abs(way).max(axis=1, initial=0.0))

    def pull(
        self, q: Float[np.ndarray, "N nq"], gradient: Float[np.ndarray, "N o nv"]
    ) -> Float[np.ndarray, "N o nq"]:
        """Gradients over these numbers as gradients over the entries of configurations."""
        out = np.zeros((*gradient.shape[:2], self._nq))
        out[..., self._plain] = gradient[..., self._plain_v]
        c, s = q[:, self._round], q[:, self._round + 1]
        turn = gradient[..., self._round_v] / (c * c + s * s)[:, None]
        out[..., self._round], out[..., self._round + 1] = -s[:, None] * turn, c[:, None] * turn
        if self._nb != 6:
            out[..., :2] = gradient[..., :2]
            return out
        out[..., :3] = gradient[..., :3] @ self._root
        # Angles turn about axes a: w = a (d angles), and over w the gradient is a^-T (g).
        R = self._rotations(q)
        level = np.hypot(R[:, 0, 0], R[:, 1, 0])
        axes = np.zeros((len(q), 3, 3))  # columns: of roll, pitch, yaw, world
        axes[:, :, 0] = R[:, :, 0]
        axes[:, 0, 1], axes[:, 1, 1] = -R[:, 1, 0] / level, R[:, 0, 0] / level
        axes[:, 2, 2] = 1.0
        world = gradient[..., 3:6] @ np.linalg.inv(axes)
        local = world @ R  # on the angular velocity in base axes
        out[..., 3:7] = local @ _quaternion_rates(q[:, 3:7])
        return out

    def _rotations(self, q: np.ndarray) -> np.ndarray:
        """Orientations of the base in the world (N, 3, 3)."""
        x, y, z, w = (q[:, 3:7] / np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)).T
        R = np.empty((len(q), 3, 3))
        R[:, 0] = np.column_stack(
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)]
        )
        R[:, 1] = np.column_stack(
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)]
        )
        R[:, 2] = np.column_stack(
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]
        )
        return np.asarray(self._root @ R)


def _beyond(off: np.ndarray) -> np.ndarray:
    return np.flatnonzero(~(off <= _UNIT))


def _quaternion_rates(quaternion: np.ndarray) -> np.ndarray:
    """Angular velocity in body axes per change of a quaternion's entries x, y, z, w (N, 3, 4)."""
    length = np.linalg.norm(quaternion, axis=1, keepdims=True)
    x, y, z, w = (quaternion / length).T
    E = np.empty((len(quaternion), 3, 4))
    E[:, 0] = np.column_stack([w, z, -y, -x])
    E[:, 1] = np.column_stack([-z, w, x, -y])
    E[:, 2] = np.column_stack([y, -x, w, -z])
    return np.asarray(2.0 * E / length[:, :, None])
