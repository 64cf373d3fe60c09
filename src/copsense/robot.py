"""Robot: a floating-base rigid-body model, from URDF, MJCF, SDF or a ready ``pin.Model``."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np
import pinocchio as pin
from jaxtyping import Float, Int
from numpy.typing import ArrayLike

from copsense.arrays import (
    array_property,
    check_name,
    check_type,
    checked_tuple,
    finite_array,
    finite_number,
    read_only,
)
from copsense.description import Description, load_description
from copsense.drives import Actuation, Drives
from copsense.errors import InvalidInputError, ModelLoadError, UnknownNameError
from copsense.magnitudes import check_angle, check_joint_position, check_length, doubt_payload
from copsense.mjcf import MjcfReading, read_mjcf
from copsense.parser_output import caught_parser_output
from copsense.sdf_model import read_sdf
from copsense.urdf_drives import read_urdf_drives

# Root joints that let the whole robot move: the base rows of the statics are theirs.
_FLOATING = ("JointModelFreeFlyer", "JointModelPlanar")

# Joints that slide along some of their axes, and the unit along or about each.
_SLIDING = {
    **dict.fromkeys(("PX", "PY", "PZ", "PrismaticUnaligned"), ("m",)),
    "Translation": ("m",) * 3,
    "Planar": ("m", "m", "rad"),
    "FreeFlyer": ("m",) * 3 + ("rad",) * 3,
}

# Joints whose axes depend on their own position: Pinocchio's derivatives leave that out.
_BENT = ("Composite", "SphericalZYX", "Universal", "Ellipsoid", "Mimic")

# Whose frame a name means, where a link, a site and a joint share it.
_NAMED = (
    pin.FrameType.BODY,
    pin.FrameType.OP_FRAME,
    pin.FrameType.FIXED_JOINT,
    pin.FrameType.JOINT,
    pin.FrameType.SENSOR,
)

_ABSURD = 1e9  # lengths [m] and inertias [kg m^2] of no robot, whatever its units were
# Effort limits from here on are a modeller's "no limit", not a motor's.
PLACEHOLDER_EFFORT = 1e4  # Nm, or N
# Positions beyond this are how a parser writes infinity.
_NO_POSITION = 1e30  # rad, or m


@dataclass(frozen=True, eq=False, repr=False)
class Robot:
    """A floating-base robot at no particular posture.

    Attributes:
        name: how the robot is called in results.
        model: the Pinocchio model; never changed after construction.
        description: where it came from, or None for a ready model.
        notes: what its description says and copsense does not use, a sentence each; every command
            prints them.
        drives: which joints have motors, springs and couplings, and the loops among its links.
        payloads: masses that `with_payload` fixed to it; its model holds them already.
        mjcf: what was read from an MJCF, with every joint of the file; None for other robots.
    """

    name: str
    model: pin.Model
    description: Description | None = None
    notes: tuple[str, ...] = ()
    drives: Drives = field(default_factory=Drives)
    payloads: tuple[Payload, ...] = ()
    mjcf: MjcfReading | None = None

    def __post_init__(self) -> None:
        """Reject a model that has no floating base, or whose masses make no sense."""
        model = self.model
        remedy = "Give what pin.buildModelFromUrdf(...) returns, or load_robot(...) a file."
        check_type(model, pin.Model, "a pin.Model", remedy)
        if model.njoints < 2 or model.joints[1].shortname() not in _FLOATING:
            root = model.joints[1].shortname() if model.njoints > 1 else "none"
            raise InvalidInputError(
                f"robot {self.name!r} has no floating base (its first joint is {root}). Build the "
                "pin.Model with pin.JointModelFreeFlyer() as root joint, load it from its URDF, or "
                "put a <freejoint/> in its MJCF."
            )
        stray = [
            model.names[i]
            for i in range(1, model.njoints)
            if list(model.subtrees[i]) != list(range(i, i + len(model.subtrees[i])))
        ]
        if stray:
            raise InvalidInputError(
                f"the joints of robot {self.name!r} are not in depth-first order: those carried by "
                f"{', '.join(stray)} do not follow directly. Pinocchio's derivatives would be "
                "wrong. Add the joints of each limb to its tip before those "
                "of the next limb, or load the robot from its URDF, MJCF or SDF."
            )
        bent = [
            name
            for name, joint in zip(model.names, model.joints, strict=True)
            if any(kind in joint.shortname() for kind in _BENT)
        ]
        if bent:
            raise InvalidInputError(
                f"robot {self.name!r} has joints whose axes turn with their own angles "
                f"({', '.join(bent)}), of which no exact derivative is known here. Make each a "
                "chain of joints with one axis."
            )
        masses = np.array([body.mass for body in model.inertias])
        if not np.all(np.isfinite(masses)) or np.any(masses < 0) or masses.sum() <= 0:
            bad = [model.names[i] for i in range(model.njoints) if not 0 <= masses[i] < np.inf]
            raise InvalidInputError(
                f"robot {self.name!r} has a non-positive mass (total {masses.sum():g} kg"
                + (f", negative or not finite at {', '.join(bad)}" if bad else "")
                + "). Give its links positive masses."
            )
        numbers = [np.append(b.lever, b.inertia) for b in model.inertias]
        placed = [p.homogeneous for p in model.jointPlacements]
        bad = [
            model.names[i]
            for i in range(model.njoints)
            # Comparisons are false for what is not a number.
            if not (np.all(np.abs(numbers[i]) < _ABSURD) and np.all(np.abs(placed[i]) < _ABSURD))
        ]
        if bad:
            finite = all(np.isfinite(each).all() for each in (*numbers, *placed))
            what = f"beyond {_ABSURD:g} m or kg m^2" if finite else "not finite"
            raise InvalidInputError(
                f"robot {self.name!r} has a centre of mass, inertia or placement that is {what} at "
                f"{', '.join(bad)}. Correct the model."
            )
        if not 0 < np.linalg.norm(model.gravity.linear) < np.inf:
            raise InvalidInputError(
                f"the model of robot {self.name!r} has gravity {model.gravity.linear}: without "
                "weight there is nothing to share. Set model.gravity.linear, in m/s^2."
            )
        self._check_drives()

    def _check_drives(self) -> None:
        """Reject drives of joints or frames that are not there, or of no single position."""
        if not isinstance(self.drives, Drives):
            raise InvalidInputError(
                f"the drives of robot {self.name!r} are {self.drives!r}. Give copsense.Drives(...)."
            )
        assert self.actuation is None or len(self.torque_names) <= len(self.dof_names)
        for coupling in self.drives.couplings:
            self.velocity_index(coupling.joint)
            self.velocity_index(coupling.of)
        for joint in (*self.drives.springs, *self.drives.held):
            self.velocity_index(joint)
        for loop in self.drives.loops:
            self.frame(loop.frame_a)
            self.frame(loop.frame_b)

    @classmethod
    def from_urdf(
        cls, source: str | Path, *, name: str | None = None, package_dirs: Iterable[str | Path] = ()
    ) -> Robot:
        """Read a URDF file or its text; a free-flyer base is added, meshes are not needed.

        Args:
            source: path of the file, or the XML itself.
            name: the robot's name; default the one in the file.
            package_dirs: folders that hold the packages of ``package://`` meshes.

        Raises:
            ModelLoadError: the file is missing or not a URDF.
        """
        description = load_description(source, "urdf", package_dirs)
        return cls.from_description(description, name=name)

    @classmethod
    def from_mjcf(
        cls,
        source: str | Path,
        *,
        name: str | None = None,
        frames: Iterable[str] = (),
        root: str | None = None,
    ) -> Robot:
        """Read an MJCF file or its text, as MuJoCo compiles it; a base that is fixed floats.

        Args:
            source: path of the file, or the XML itself.
            name: the robot's name; default the one in the file.
            frames: frames of the robot that is meant, where the file holds several things.
            root: name of a body of the robot that is meant.

        Raises:
            ModelLoadError: the file is missing or not an MJCF, or it takes MuJoCo to read it and
                MuJoCo is not installed.
            InvalidInputError: several robots could be meant.
            UnknownNameError: it has no body named `root`.
        """
        description = load_description(source, "mjcf", frames=frames, root=root)
        return cls.from_description(description, name=name)

    @classmethod
    def from_sdf(cls, source: str | Path, *, name: str | None = None) -> Robot:
        """Read an SDF file or its text; a base that is fixed floats, rods close loops.

        Args:
            source: path of the file, or the XML itself.
            name: the robot's name; default the one in the file.

        Raises:
            ModelLoadError: the file is missing or not an SDF, or holds what is not read.
        """
        return cls.from_description(load_description(source, "sdf"), name=name)

    @classmethod
    def from_model(
        cls, model: pin.Model, *, name: str | None = None, drives: Drives | None = None
    ) -> Robot:
        """Wrap a ready ``pin.Model`` (copied) whose first joint is a floating base."""
        remedy = "Give what pin.buildModelFromUrdf(..., pin.JointModelFreeFlyer()) returns."
        check_type(model, pin.Model, "a pin.Model", remedy)
        return cls(name or model.name or "robot", model.copy(), drives=drives or Drives())

    def with_drives(self, drives: Drives) -> Robot:
        """The same robot with other drives.

        Raises:
            UnknownNameError: a joint or frame is not in the model.
        """
        return replace(self, drives=drives)

    def with_dynamics(self, model: pin.Model, drives: Drives) -> Robot:
        """The same joints and frames with other masses, gravity or drives.

        Args:
            model: a copy of the robot's own of which inertias or gravity were changed; it is kept.
            drives: the drives.

        Raises:
            InvalidInputError: masses that make no sense.
            UnknownNameError: drives of a joint or frame that is not in the model.
        """
        found = replace(self, model=model, drives=drives)
        # Frames are the same, and to look up their names takes longer than the statics.
        found.__dict__["_frame_ids"] = self._frame_ids
        return found

    def without_motors(self, joints: Iterable[str]) -> Robot:
        """The same robot where these joints have no motor.

        Raises:
            UnknownNameError: a joint is not in the model.
            InvalidInputError: a transmission drives one.
        """
        return self.with_drives(self.drives.without_motors(joints, self.dof_names))

    def with_payload(
        self,
        frame: str,
        mass: float,
        *,
        com: tuple[float, float, float] = (0.0, 0.0, 0.0),
        inertia: ArrayLike | None = None,
    ) -> Robot:
        """The same robot with a mass fixed to a frame, which counts as its own from then on.

        The centre of mass, the weight and the inertia are then those of robot and payload; for a
        mass that is not to count as the robot's, hang its weight there (`copsense.Load`).

        Args:
            frame: name of the frame.
            mass: of the payload [kg], not negative.
            com: its centre of mass in the frame [m].
            inertia: its inertia about that centre, frame axes (3, 3) [kg m^2]; default a point.

        Raises:
            UnknownNameError: no such frame.
        """
        at = self.frame(frame)
        kg = finite_number(mass, f"the payload at {frame!r} [kg]")
        if kg < 0:
            raise InvalidInputError(f"the payload at {frame!r} is {mass} kg. Give it a mass.")
        place = finite_array(com, f"the centre of mass of the payload at {frame!r}", (3,), "[m]")
        for lever in place.tolist():
            check_length(lever, f"the centre of mass of the payload at {frame!r}")
        doubt_payload(kg, self.name, self.mass, f"the payload at {frame!r}")
        about = np.zeros((3, 3))
        if inertia is not None:
            about = finite_array(inertia, f"the inertia of the payload at {frame!r}", (3, 3))
        model = self.model.copy()
        model.appendBodyToJoint(
            at.parentJoint, pin.Inertia(kg, np.array(place), np.array(about)), at.placement
        )
        payload = Payload(frame, kg, tuple(float(c) for c in place))  # type: ignore[arg-type]
        return replace(self, model=model, payloads=(*self.payloads, payload))

    @classmethod
    def from_description(cls, description: Description, *, name: str | None = None) -> Robot:
        """Build the model of a description."""
        if description.language == "urdf":
            found = read_urdf_drives(description.text, _build_urdf(description))
            notes, model = (*description.notes, *found.notes), found.model
            return cls(name or model.name or "robot", model, description, notes, found.drives)
        if description.language == "sdf":
            sdf = read_sdf(description.text)
            notes = (*description.notes, *sdf.notes)
            return cls(name or sdf.model.name, sdf.model, description, notes, sdf.drives)
        read = read_mjcf(description)
        notes = (*description.notes, *read.notes)
        title = name or read.model.name or "robot"
        return cls(title, read.model, description, notes, read.drives, mjcf=read)

    def keeping(self, joints: Iterable[str]) -> Robot:
        """The same robot with every other joint locked at zero.

        Args:
            joints: names of the joints that stay free.

        Raises:
            UnknownNameError: a joint is not in the model.
        """
        kept = set(checked_tuple(joints, str, "name", 'Give joints, such as ["l_knee"].'))
        for joint in kept:
            self.joint_id(joint)
        locked = [i for i in range(2, self.model.njoints) if self.model.names[i] not in kept]
        reduced = pin.buildReducedModel(self.model, locked, pin.neutral(self.model))
        return replace(self, model=reduced, drives=self.drives.keeping(kept))

    @cached_property
    def mass(self) -> float:
        """Total mass [kg]."""
        return float(sum(body.mass for body in self.model.inertias))

    @cached_property
    def weight(self) -> float:
        """Magnitude of the weight [N]."""
        return self.mass * float(np.linalg.norm(self.model.gravity.linear))

    @cached_property
    def base_nv(self) -> int:
        """Degrees of freedom of the base: 6, or 3 for a planar robot."""
        return int(self.model.joints[1].nv)

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the actuated joints, in the model's order."""
        return tuple(self.model.names)[2:]

    @cached_property
    def actuation(self) -> Actuation | None:
        """Which joint torques the motors can exert; None where every joint has its own motor."""
        return self.drives.on(self.dof_names)

    @cached_property
    def torque_names(self) -> tuple[str, ...]:
        """One label per entry of the torques: the motor, by default named as its joint."""
        return self.dof_names if self.actuation is None else self.actuation.motors

    @cached_property
    def dof_names(self) -> tuple[str, ...]:
        """One label per degree of freedom behind the base: the joint, with an index if several."""
        labels: list[str] = []
        for joint, name in zip(list(self.model.joints)[2:], self.joint_names, strict=True):
            labels += [name] if joint.nv == 1 else [f"{name}[{i}]" for i in range(joint.nv)]
        return tuple(labels)

    @cached_property
    def unactuated_nv(self) -> int:
        """How many rows of the balance no motor takes part in: the base's, and joints without."""
        return self.base_nv + (0 if self.actuation is None else len(self.actuation.free))

    def by_drive(self, rows: Float[np.ndarray, "nv *p"]) -> Float[np.ndarray, "nv *p"]:
        """Rows of the balance (nv, ...), those that no motor feels first, then one per motor.

        With N = J' f + S t_m the last rows of ``by_drive(N - J' f)`` are t_m, the first are zero.
        """
        if self.actuation is None:
            return rows
        joints = rows[self.base_nv :]
        parts = rows[: self.base_nv], self.actuation.free @ joints, self.actuation.inverse @ joints
        return np.concatenate(parts)

    def from_drives(self, multipliers: Float[np.ndarray, "nv *p"]) -> Float[np.ndarray, "nv *p"]:
        """The transpose of `by_drive`: multipliers of its rows as velocities (nv, ...)."""
        if self.actuation is None:
            return multipliers
        nb, free = self.base_nv, self.unactuated_nv
        joints = self.actuation.free.T @ multipliers[nb:free]
        joints = joints + self.actuation.inverse.T @ multipliers[free:]
        return np.concatenate([multipliers[:nb], joints])

    def in_drives(self, velocities: Float[np.ndarray, "nv *p"]) -> Float[np.ndarray, "nv *p"]:
        """The inverse of `from_drives`: what of velocities (nv, ...) each row of the balance sees.

        The last rows are the speeds of the motors.
        """
        if self.actuation is None:
            return velocities
        joints = velocities[self.base_nv :]
        parts = velocities[: self.base_nv], self.actuation.free @ joints
        return np.concatenate([*parts, self.actuation.matrix.T @ joints])

    def joint_torques(self, torques: Float[np.ndarray, "k *p"]) -> Float[np.ndarray, "n *p"]:
        """Torques on the joints (n, ...) of motor torques (k, ...): S t_m."""
        return torques if self.actuation is None else self.actuation.matrix @ torques

    @cached_property
    def velocity_names(self) -> tuple[str, ...]:
        """One label per entry of a velocity: the base in its own frame, then the joints."""
        six = ("base_vx", "base_vy", "base_vz", "base_wx", "base_wy", "base_wz")
        base = six if self.base_nv == 6 else ("base_vx", "base_vy", "base_w")
        return base + self.dof_names

    @cached_property
    def frame_names(self) -> tuple[str, ...]:
        """Names of every frame in the model."""
        return tuple(frame.name for frame in self.model.frames)

    @cached_property
    def base_frame(self) -> str:
        """Name of the link that is the base; of its joint where no link is named."""
        on_base = [frame for frame in self.model.frames if frame.parentJoint == 1]
        bodies = [frame for frame in on_base if frame.type == pin.FrameType.BODY]
        return str((bodies or on_base)[0].name) if on_base else str(self.model.names[1])

    @cached_property
    def position_limits(self) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
        """Lowest and highest position of each degree of freedom behind the base (n,) [rad, m].

        Infinite where the model has no limit: a joint that turns without end, one of several
        degrees of freedom, or one whose lower limit is not below its upper one.
        """
        lower = np.full(len(self.dof_names), -np.inf)
        upper = np.full(len(self.dof_names), np.inf)
        at, q = self.single_joints
        low, high = self.model.lowerPositionLimit[q], self.model.upperPositionLimit[q]
        lower[at] = np.where((low < high) & (low > -_NO_POSITION), low, -np.inf)
        upper[at] = np.where((low < high) & (high < _NO_POSITION), high, np.inf)
        return read_only(lower), read_only(upper)

    @array_property
    def effort_limits(self) -> Float[np.ndarray, " n"]:
        """The model's effort limit of each motor (k,) [Nm, or N].

        Infinite where the model gives a placeholder: none, zero, or `PLACEHOLDER_EFFORT` and more.
        """
        effort = np.asarray(self.model.upperEffortLimit)[self.base_nv :]
        if self.actuation is not None:
            known = dict(zip(self.dof_names, effort, strict=True))
            for each in self.drives.transmissions:
                limits = each.effort_limits or (np.inf,) * len(each.motors)
                known |= dict(zip(each.motors, limits, strict=True))
            effort = np.array([known[motor] for motor in self.torque_names])
        return np.where((effort > 0) & (effort < PLACEHOLDER_EFFORT), effort, np.inf)

    @cached_property
    def single_joints(self) -> tuple[Int[np.ndarray, " s"], Int[np.ndarray, " s"]]:
        """Joints whose position is one number: their degree of freedom, and their entry of q."""
        single = [joint for joint in list(self.model.joints)[2:] if joint.nq == 1]
        torque = np.array([joint.idx_v - self.base_nv for joint in single], dtype=int)
        position = np.array([joint.idx_q for joint in single], dtype=int)
        return read_only(torque), read_only(position)

    def joint_id(self, name: str) -> int:
        """Index of an actuated joint in the model, or an error that lists the valid ones."""
        if name not in self.joint_names:
            still = self.model.existFrame(name, pin.FrameType.FIXED_JOINT)
            remedy = (
                f"{name!r} is fixed in the file, or locked: it stays where it is." if still else ""
            )
            raise UnknownNameError(f"joint in robot {self.name!r}", name, self.joint_names, remedy)
        return int(self.model.getJointId(name))

    def velocity_index(self, joint: str) -> int:
        """Where a one-degree-of-freedom joint stands in a velocity vector."""
        model_joint = self.model.joints[self.joint_id(joint)]
        if model_joint.nv != 1:
            raise InvalidInputError(
                f"joint {joint!r} has {model_joint.nv} degrees of freedom: it has no single angle. "
                "Name a revolute or prismatic joint."
            )
        return int(model_joint.idx_v)

    @cached_property
    def dof_units(self) -> tuple[str, ...]:
        """Unit of each degree of freedom behind the base: ``"rad"``, or ``"m"`` if it slides."""
        units: list[str] = []
        for joint in list(self.model.joints)[2:]:
            kind = joint.shortname().removeprefix("JointModel")
            units += _SLIDING.get(kind, ("rad",) * joint.nv)
        return tuple(units)

    def joint_unit(self, joint: str) -> Literal["rad", "m"]:
        """Unit of a one-degree-of-freedom joint's position: ``"rad"``, or ``"m"`` if it slides."""
        unit = self.dof_units[self.velocity_index(joint) - self.base_nv]
        return "m" if unit == "m" else "rad"

    def joint_position(self, q: Float[np.ndarray, " nq"], joint: str) -> float:
        """Position [rad or m] of a one-degree-of-freedom joint at a configuration."""
        self.velocity_index(joint)
        model_joint = self.model.joints[self.joint_id(joint)]
        here = q[model_joint.idx_q : model_joint.idx_q + model_joint.nq]
        # A continuous joint is stored as (cos, sin).
        return float(np.arctan2(here[1], here[0]) if model_joint.nq == 2 else here[0])

    @cached_property
    def position_entries(self) -> tuple[tuple[int, bool], ...]:
        """Of each one-degree-of-freedom joint its entry of q, and whether it is (cos, sin) there.

        So is a joint that turns without end.
        """
        joints = [joint for joint in list(self.model.joints)[2:] if joint.nv == 1]
        return tuple((int(joint.idx_q), joint.nq == 2) for joint in joints)

    def joint_positions(self, q: Float[np.ndarray, " nq"]) -> Float[np.ndarray, " s"]:
        """Position of every one-degree-of-freedom joint at a configuration (s,) [rad or m]."""
        entries = self.position_entries
        return np.array([np.arctan2(q[i + 1], q[i]) if circle else q[i] for i, circle in entries])

    def limb(self, joint: int) -> tuple[int, ...]:
        """Joints of the model from the base to one of them and with it, the base's own left out.

        Args:
            joint: its index in the model.
        """
        return tuple(int(i) for i in self.model.supports[joint] if i > 1)

    @cached_property
    def _frame_ids(self) -> dict[str, int]:
        """Index of each frame by its name, the kinds of `_NAMED` taking the name in their order."""
        ids: dict[str, int] = {}
        kinds = [frame.type for frame in self.model.frames]
        for wanted in _NAMED:
            for i, (kind, name) in enumerate(zip(kinds, self.frame_names, strict=True)):
                if kind == wanted:
                    ids.setdefault(name, i)
        return ids

    def frame_id(self, name: str) -> int:
        """Index of a frame in the model, or an error that lists the valid names.

        Descriptions keep the names of links, sites and joints apart, so several frames may share
        one: the link is meant first, then the site, then the joint.
        """
        if name not in self._frame_ids:
            raise UnknownNameError(f"frame in robot {self.name!r}", name, self.frame_names)
        return self._frame_ids[name]

    def joint_forces(self, q: Float[np.ndarray, " nq"]) -> Float[np.ndarray, " nv"]:
        """Torques of the springs and of what is held on the joints (nv,) [Nm, or N]."""
        found = np.zeros(self.model.nv)
        for joint, torque in self.drives.held.items():
            found[self.velocity_index(joint)] = torque
        for joint, spring in self.drives.springs.items():
            stretch = self.joint_position(q, joint) - spring.rest
            found[self.velocity_index(joint)] -= spring.stiffness * stretch
        return found

    def frame(self, name: str) -> pin.Frame:
        """The frame of the model that `frame_id` finds."""
        return self.model.frames[self.frame_id(name)]

    def configuration(
        self, angles: Mapping[str, float] | None = None, *, base_yaw: float = 0.0
    ) -> Float[np.ndarray, " nq"]:
        """A configuration from named joint positions; joints not named stand at zero.

        Args:
            angles: joint name -> position [rad, or m for a prismatic joint].
            base_yaw: rotation of the base about the vertical [rad].

        Raises:
            UnknownNameError: a joint is not in the model.
            InvalidInputError: a position is not finite, or a planar base is given a heading.
        """
        displacement = np.zeros(self.model.nv)
        for joint, angle in (angles or {}).items():
            index = self.velocity_index(joint)
            displacement[index] = self.checked_position(joint, angle)
        if base_yaw:
            if self.base_nv != 6:
                raise InvalidInputError(
                    f"robot {self.name!r} lives in a plane: its base has no heading. Leave the "
                    "base's orientation out."
                )
            displacement[5] = finite_number(base_yaw, "the heading of the base")
            check_angle(float(base_yaw), "the heading of the base")
        return pin.integrate(self.model, pin.neutral(self.model), displacement)

    def checked_position(self, joint: str, position: object) -> float:
        """One position of a joint [rad, or m for a prismatic joint].

        Raises:
            UnknownNameError: the joint is not in the model.
            InvalidInputError: not a finite number, or one that only another unit explains, such as
                degrees.
        """
        index = self.velocity_index(joint) - self.base_nv
        number = finite_number(position, f"the position of joint {joint!r}")
        lower, upper = (float(end[index]) for end in self.position_limits)
        check_joint_position(number, joint, self.joint_unit(joint), lower, upper)
        return number

    def check_configuration(self, q: object) -> Float[np.ndarray, " nq"]:
        """A read-only copy of a configuration that is finite, of the right size and normalised.

        Raises:
            InvalidInputError: wrong shape, NaN or infinity, or an unnormalised quaternion.
        """
        if isinstance(q, np.ndarray) and q.shape == (self.model.nq,) and q.dtype == float:
            array = q if np.isfinite(q).all() else self._configuration(q)
        else:
            array = self._configuration(q)
        if not pin.isNormalized(self.model, array, 1e-6):
            raise InvalidInputError(
                "the configuration q holds a quaternion (or cosine, sine pair) that is not of unit "
                "length. Give it in the order x, y, z, w; pin.normalize(model, q) fixes rounding."
            )
        return read_only(pin.normalize(self.model, array))

    def check_positions(self, q: Float[np.ndarray, " nq"]) -> None:
        """Reject joints of a configuration where only another unit explains them.

        Raises:
            InvalidInputError: degrees, or millimetres, beyond a joint's limits.
        """
        if np.abs(q[3 if self.base_nv == 6 else 2 :]).max(initial=0.0) <= 2 * np.pi:
            return  # no joint turns further: nothing to look at in detail
        lower, upper = self.position_limits
        for at, entry in zip(*self.single_joints, strict=True):
            low, high, position = float(lower[at]), float(upper[at]), float(q[entry])
            if not low <= position <= high:
                check_joint_position(position, self.dof_names[at], self.dof_units[at], low, high)

    def _configuration(self, q: object) -> Float[np.ndarray, " nq"]:
        meaning = (
            f"base position, quaternion (x, y, z, w), then {len(self.joint_names)} joints"
            if self.base_nv == 6
            else f"base position, cosine and sine, then {len(self.joint_names)} joints"
        )
        return finite_array(
            q, f"the configuration q of robot {self.name!r}", (self.model.nq,), meaning
        )

    def __repr__(self) -> str:
        """Name, joints and mass."""
        return f"Robot({self.name!r}, {len(self.dof_names)} joints, {self.mass:.4g} kg)"


@dataclass(frozen=True)
class Payload:
    """A mass fixed to a robot.

    Attributes:
        frame: name of the frame that carries it.
        mass: [kg].
        com: its centre of mass in the frame [m].
    """

    frame: str
    mass: float
    com: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        """Reject what is not a frame, a mass and a point."""
        check_name(self.frame, "the frame of a payload")
        finite_number(self.mass, f"the mass of the payload at {self.frame!r} [kg]")
        finite_array(self.com, f"the centre of the payload at {self.frame!r} [m]", (3,))


def _build_urdf(description: Description) -> pin.Model:
    """The Pinocchio model of a URDF, with a floating base."""
    said: list[str] = []
    try:
        with caught_parser_output() as said:
            return pin.buildModelFromXML(description.text, pin.JointModelFreeFlyer())
    except (ValueError, RuntimeError, LookupError) as error:
        what = description.path or "the text given"
        reason = str(error).strip().splitlines()[-1] if str(error).strip() else "no reason given"
        if said:  # the parser's own reason, which its exception does not hold
            reason = "; ".join(said)
        raise ModelLoadError(
            f"{what} is not a readable URDF: {reason.rstrip('.')}. Correct the file."
        ) from None
