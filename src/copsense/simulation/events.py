"""EventDetector: when a contact tips, lifts or slips, and when a run is over."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from copsense.arrays import finite_number
from copsense.simulation.simulator import Snapshot
from copsense.stance import Stance


@dataclass(frozen=True)
class Thresholds:
    """What counts as a tip, a lift, a slip or a fall.

    Attributes:
        tilt: a sole that has turned by more than this has tipped [rad].
        lift: a contact whose origin is higher than this above its plane has lifted [m].
        slip: a contact with a corner (or the point) farther than this from its place, along the
            plane, has slipped [m].
        fall: a CoM lower than this share of its initial height is a fall.
        base_tilt: a base that has turned by more than this is a fall [rad].
        speed: a motion with a joint faster than this has diverged [rad/s, m/s].
    """

    tilt: float = 0.00873  # 0.5 degrees
    lift: float = 2e-3
    slip: float = 2e-2
    fall: float = 0.75
    base_tilt: float = 0.785
    speed: float = 200.0

    def __post_init__(self) -> None:
        """Validate the thresholds: each must be positive."""
        for name in ("tilt", "lift", "slip", "fall", "base_tilt", "speed"):
            finite_number(getattr(self, name), f"the threshold {name}", positive=True)


@dataclass(frozen=True)
class Event:
    """Something that may end a run.

    Attributes:
        kind: ``"tip"``, ``"lift"``, ``"slip"``, ``"fall"``, ``"diverged"``, ``"engine"``,
            ``"controller"`` or ``"stopped"``.
        time: [s].
        message: what happened, as a sentence.
        contact: the name of the contact concerned, or empty.
    """

    kind: str
    time: float
    message: str
    contact: str = ""


class EventDetector:
    """Checks every snapshot of one run."""

    def __init__(self, stance: Stance, thresholds: Thresholds) -> None:
        """Store where the contacts, the base and the CoM start."""
        self._names, self._limits = stance.contact_names, thresholds
        self._normals = np.array([p.rotation[:, 2] for p in stance.placements])
        self._origins = np.array([p.translation for p in stance.placements])
        self._turns = np.array([c.kind != "point" for c in stance.contacts])
        self._axes = np.array([p.rotation for p in stance.placements])
        self._corners = [c.sole.vertices if c.sole else np.zeros((1, 2)) for c in stance.contacts]
        self._reach = np.array([np.linalg.norm(c, axis=1).max() for c in self._corners])
        # For `_stands`: a point has no sole that could turn; the chord of a turn by `tilt`.
        self._soles = self._turns.astype(float)[:, None, None]
        self._farthest = float(self._reach.max())
        self._chord = 2.0 * math.sin(min(thresholds.tilt, math.pi) / 2)
        self._ground = float(self._origins[:, 2].mean())
        self._height = float(stance.com[2]) - self._ground
        self._base = stance.q[3:7]
        self._joints = stance.robot.dof_names
        self._model = stance.robot.model
        self._data = self._model.createData()

    def contact_event(self, now: Snapshot) -> Event | None:
        """The first contact that has tipped, lifted or slipped, if any."""
        if self._stands(now):
            return None
        tilts = self.tilts(now)
        lifts = np.einsum("ij,ij->i", now.positions - self._origins, self._normals)
        for k, name in enumerate(self._names):
            if self._turns[k] and tilts[k] > self._limits.tilt:
                side = "" if now.wrenches[k, 2] > 0 else ", unloaded"
                message = f"{name} tipped: turned by {np.degrees(tilts[k]):.2f} deg{side}"
                return Event("tip", now.time, message, name)
            if lifts[k] > self._limits.lift:
                message = f"{name} left the ground by {lifts[k] * 1e3:.1f} mm"
                return Event("lift", now.time, message, name)
        slips = self.slips(now)
        k = int(np.argmax(slips))
        if slips[k] > self._limits.slip:
            message = (
                f"{self._names[k]} slipped by {slips[k] * 1e3:.1f} mm, more than "
                f"{self._limits.slip * 1e3:g} mm"
            )
            return Event("slip", now.time, message, self._names[k])
        return None

    def _stands(self, now: Snapshot) -> bool:
        """Whether all contacts together have moved less than would be an event of one.

        At nearly every step this is all that has to be computed. A turn by an angle a moves what
        is at a distance r by at most 2 r sin(a / 2), and R - R_0 has the norm 2 sqrt(2) sin(a / 2).
        """
        moved = (now.positions - self._origins).ravel()
        turned = ((now.rotations - self._axes) * self._soles).ravel()
        far, chord = math.sqrt(moved.dot(moved)), math.sqrt(turned.dot(turned) / 2)
        limits = self._limits
        return (
            chord <= self._chord
            and far <= limits.lift
            and far + self._farthest * chord <= limits.slip
        )

    def slips(self, now: Snapshot) -> np.ndarray:
        """How far each contact's farthest corner has moved along the plane (nc,) [m].

        For a contact below the threshold this is an upper bound.
        """
        moved = now.positions - self._origins
        heading = np.abs((now.rotations[:, :, 0] * self._axes[:, :, 1]).sum(axis=1))
        # A chord is at most sqrt(2) times the sine of a turn of up to 90 degrees.
        found = np.sqrt((moved * moved).sum(axis=1)) + 1.5 * self._reach * heading
        for k in np.flatnonzero(found > self._limits.slip):
            turned = (now.rotations[k] - self._axes[k])[:, :2] @ self._corners[k].T
            across = self._axes[k][:, :2].T @ (moved[k][:, None] + turned)
            found[k] = np.linalg.norm(across, axis=0).max()
        return found

    def tilts(self, now: Snapshot) -> np.ndarray:
        """Angle of each contact frame's z axis from its plane's normal (nc,) [rad]."""
        z = now.rotations[:, :, 2]
        along = np.einsum("ij,ij->i", z, self._normals)
        across = np.linalg.norm(z - along[:, None] * self._normals, axis=1)
        return np.where(self._turns, np.arctan2(across, along), 0.0)

    def com(self, now: Snapshot) -> np.ndarray:
        """Centre of mass (3,), world [m]."""
        return pin.centerOfMass(self._model, self._data, now.q).copy()

    def end_event(self, now: Snapshot, com_height: float) -> Event | None:
        """A fall or a divergence, which ends a run."""
        joints = now.v[6:]
        fastest = int(np.abs(joints).argmax()) if len(joints) else -1
        speed = float(joints[fastest]) if fastest >= 0 else 0.0
        if abs(speed) > self._limits.speed:
            return Event(
                "diverged",
                now.time,
                f"the motion diverged: joint {self._joints[fastest]} moves at {speed:.0f} rad/s; "
                "the gains are unstable, a push was too strong, or a foot has left the ground",
            )
        height = com_height - self._ground
        if height < self._limits.fall * self._height:
            return Event("fall", now.time, f"fell: the CoM is {height:.3f} m over the ground")
        # |cos| of half the angle between two unit quaternions.
        turned = 2.0 * math.acos(min(1.0, abs(float(self._base.dot(now.q[3:7])))))
        if turned > self._limits.base_tilt:
            return Event(
                "fall", now.time, f"fell: the base has turned {np.degrees(turned):.0f} deg"
            )
        return None
