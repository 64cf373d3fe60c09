"""Drives: what holds a robot's joints - motors, springs, transmissions, couplings and rods.

All joints have a motor of their own unless a `Drives` says otherwise. In terms of velocities v and
motor torques t_m,

    joint torques = S t_m        springs: -K (q - q0)        couplings: q_i = a q_j + b

and a `Loop` is a pair of frames that a rod, a pin or a weld keeps together.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from jaxtyping import Float

from copsense.arrays import (
    check_name,
    check_type,
    checked_tuple,
    finite_array,
    finite_number,
    owned,
    read_only,
)
from copsense.content import FrozenMapping, ShortRepr
from copsense.errors import InvalidInputError, UnknownNameError

LoopKind = Literal["ball", "pin", "weld"]
_NAMES = "Give a list of names, such as ['l_knee']."
LOOP_KINDS: tuple[LoopKind, ...] = ("ball", "pin", "weld")


@dataclass(frozen=True)
class Spring:
    """A spring on a joint, beside its motor if it has one: torque -stiffness (q - rest).

    Attributes:
        stiffness: [Nm/rad, or N/m for a prismatic joint].
        rest: position at which it has no torque [rad, or m].
    """

    stiffness: float
    rest: float = 0.0

    def __post_init__(self) -> None:
        """Reject what is not a number; a negative stiffness is a spring over its dead centre."""
        finite_number(self.stiffness, "the stiffness of a spring [Nm/rad, N/m]")
        finite_number(self.rest, "the rest position of a spring [rad, m]")


@dataclass(frozen=True)
class Coupling:
    """A joint that follows another, q_joint = ratio q_of + offset (URDF ``mimic``).

    Attributes:
        joint: the joint that follows; it has no motor of its own.
        of: the joint that leads.
        ratio: a.
        offset: b [rad, or m].
    """

    joint: str
    of: str
    ratio: float = 1.0
    offset: float = 0.0

    def __post_init__(self) -> None:
        """Reject a coupling of a joint to itself, and what is not a number."""
        check_name(self.joint, "the joint of a coupling")
        check_name(self.of, f"what joint {self.joint!r} is coupled to")
        finite_number(self.ratio, f"the ratio of the coupling of {self.joint!r}")
        finite_number(self.offset, f"the offset of the coupling of {self.joint!r}")
        if self.joint == self.of:
            raise InvalidInputError(
                f"joint {self.joint!r} is coupled to itself. Name the joint that it follows."
            )


@dataclass(frozen=True)
class Loop:
    """Two frames of a robot that are kept together: the end of a rod, a pin, a weld.

    Attributes:
        frame_a: name of a frame of the model.
        frame_b: name of the frame that it is kept at.
        kind: ``"ball"`` keeps the two points together (MuJoCo's ``connect``), ``"pin"`` leaves a
            rotation about `axis`, ``"weld"`` leaves nothing.
        offset_a: the point in frame a [m].
        offset_b: the point in frame b [m].
        axis: axis of a pin, in frame a and in frame b alike.
        name: how it is called in results; default ``"frame_a - frame_b"``.
    """

    frame_a: str
    frame_b: str
    kind: LoopKind = "ball"
    offset_a: tuple[float, float, float] = (0.0, 0.0, 0.0)
    offset_b: tuple[float, float, float] = (0.0, 0.0, 0.0)
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    name: str = ""

    def __post_init__(self) -> None:
        """Check the kind and own the vectors."""
        check_name(self.frame_a, "frame_a of a loop")
        check_name(self.frame_b, "frame_b of a loop")
        own = (self.frame_a, tuple(self.offset_a)) == (self.frame_b, tuple(self.offset_b))
        if own and self.kind in LOOP_KINDS:
            raise InvalidInputError(
                f"a loop joins {self.frame_a!r} with itself. Give frames of two links."
            )
        object.__setattr__(self, "name", self.name or f"{self.frame_a} - {self.frame_b}")
        check_name(self.name, "the name of a loop")
        if self.kind not in LOOP_KINDS:
            raise UnknownNameError("kind of loop", str(self.kind), LOOP_KINDS)
        for name in ("offset_a", "offset_b", "axis"):
            vector = finite_array(getattr(self, name), f"{name} of loop {self.name!r}", (3,))
            object.__setattr__(self, name, tuple(float(c) for c in vector))
        if not np.linalg.norm(self.axis) > 0:
            raise InvalidInputError(
                f"the axis of loop {self.name!r} is zero. Give a direction, such as (0, 0, 1)."
            )


@dataclass(frozen=True, eq=False, repr=False)
class Transmission(ShortRepr):
    """Motors that drive several joints together: joint torques = matrix @ motor torques.

    Attributes:
        motors: names of the motors (k,).
        joints: names of the joints that they drive (j,).
        matrix: (j, k), of full column rank; by power, motor speeds = matrix' @ joint speeds.
        effort_limits: largest torque of each motor (k,) [Nm], or None where none is known.
    """

    motors: tuple[str, ...]
    joints: tuple[str, ...]
    matrix: Float[np.ndarray, "j k"]
    effort_limits: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        """Check the shapes and the rank, and own the matrix."""
        for name in ("motors", "joints"):
            names = checked_tuple(getattr(self, name), str, "name", _NAMES)
            object.__setattr__(self, name, names)
        what = f"the matrix of the transmission of {', '.join(self.motors)}"
        matrix = finite_array(
            self.matrix,
            what,
            (len(self.joints), len(self.motors)),
            "a row for each joint, a column for each motor",
        )
        object.__setattr__(self, "matrix", matrix)
        if np.linalg.matrix_rank(matrix) < len(self.motors):
            raise InvalidInputError(
                f"{what} has columns that depend on each other: torques of its motors cannot be "
                "told apart. Give each motor an effect of its own."
            )
        if self.effort_limits is not None:
            try:
                limits = tuple(float(each) for each in self.effort_limits)
            except (TypeError, ValueError):
                limits = ()
            if len(limits) != len(self.motors) or not all(each > 0 for each in limits):
                raise InvalidInputError(
                    f"the effort limits of {', '.join(self.motors)} are {self.effort_limits!r}. "
                    "Give one positive number for each motor, infinity where it has no limit."
                )
            object.__setattr__(self, "effort_limits", limits)


@dataclass(frozen=True, eq=False, repr=False)
class Drives(ShortRepr):
    """What holds a robot's joints.

    Attributes:
        motors: names of the joints with a motor of their own; None for every joint that neither
            follows another nor is driven by a transmission.
        springs: joint name -> its spring.
        held: joint name -> a torque that something else exerts on it [Nm, or N], such as a brake
            or a hand.
        couplings: joints that follow others.
        loops: frames that are kept together.
        transmissions: motors that drive several joints together.
    """

    motors: tuple[str, ...] | None = None
    springs: Mapping[str, Spring] = field(default_factory=dict)
    held: Mapping[str, float] = field(default_factory=dict)
    couplings: tuple[Coupling, ...] = ()
    loops: tuple[Loop, ...] = ()
    transmissions: tuple[Transmission, ...] = ()

    def __post_init__(self) -> None:
        """Own everything, and reject what contradicts itself."""
        if self.motors is not None:
            object.__setattr__(self, "motors", checked_tuple(self.motors, str, "name", _NAMES))
        kinds: dict[str, tuple[type, str]] = {
            "couplings": (Coupling, 'Give Coupling("joint", of="leader"), or several.'),
            "loops": (Loop, 'Give Loop("frame_a", "frame_b"), or several.'),
            "transmissions": (Transmission, "Give Transmission(motors, joints, matrix)."),
        }
        for name, (kind, remedy) in kinds.items():
            given = checked_tuple(getattr(self, name), kind, name.removesuffix("s"), remedy)
            object.__setattr__(self, name, given)
        remedy = 'Give joint -> Spring(stiffness, rest), such as {"l_toe": Spring(40.0)}.'
        check_type(self.springs, Mapping, "a mapping of springs", remedy)
        remedy = 'Give joint -> torque, such as {"neck": 0.3} [Nm].'
        check_type(self.held, Mapping, "a mapping of held torques", remedy)
        for joint in (*self.springs, *self.held):
            check_name(joint, "the joint of a spring or held torque")
        object.__setattr__(self, "springs", FrozenMapping(self.springs))
        for joint, spring in self.springs.items():
            if not isinstance(spring, Spring):
                raise InvalidInputError(
                    f"the spring of joint {joint!r} is {spring!r}. Give Spring(stiffness, rest)."
                )
        held = {
            joint: finite_number(torque, f"the torque held on joint {joint!r}")
            for joint, torque in self.held.items()
        }
        object.__setattr__(self, "held", FrozenMapping(held))
        followers = [coupling.joint for coupling in self.couplings]
        _reject_twice(followers, "follows two joints")
        leaders = {coupling.joint: coupling.of for coupling in self.couplings}
        for joint in followers:
            chain = [joint]
            while chain[-1] in leaders and chain.count(chain[-1]) == 1:
                chain.append(leaders[chain[-1]])
            if chain.count(chain[-1]) > 1:
                raise InvalidInputError(
                    f"joints follow each other in a circle ({' follows '.join(chain)}): none "
                    "leads. Leave one of these couplings out."
                )
        driven = [joint for each in self.transmissions for joint in each.joints]
        _reject_twice(driven, "is driven by two transmissions")
        _reject_twice(self.motors or (), "is named twice among the motors")
        own = set(self.motors or ())
        for joint in followers + driven:
            if joint in own:
                how = "follows another joint" if joint in followers else "has a transmission"
                raise InvalidInputError(
                    f"joint {joint!r} {how} and is named among the motors too. Leave it out there."
                )

    def __bool__(self) -> bool:
        """Whether there is anything but a motor on every joint."""
        return self.motors is not None or any(
            (self.springs, self.held, self.couplings, self.loops, self.transmissions)
        )

    def keeping(self, joints: Iterable[str]) -> Drives:
        """The same drives where only these joints can still move.

        Raises:
            InvalidInputError: a coupling or transmission would be torn apart.
        """
        kept = set(checked_tuple(joints, str, "name", _NAMES))
        tied = [{coupling.joint, coupling.of} for coupling in self.couplings]
        tied += [set(each.joints) for each in self.transmissions]
        for names in tied:
            free = kept.intersection(names)
            if free and len(free) < len(names):
                locked = ", ".join(sorted(names - kept))
                raise InvalidInputError(
                    f"{locked} cannot be locked while {', '.join(sorted(free))} moves: they are "
                    "coupled. Lock all of them, or none."
                )
        return Drives(
            None if self.motors is None else tuple(j for j in self.motors if j in kept),
            {joint: spring for joint, spring in self.springs.items() if joint in kept},
            {joint: torque for joint, torque in self.held.items() if joint in kept},
            tuple(c for c in self.couplings if c.joint in kept),
            self.loops,
            tuple(each for each in self.transmissions if kept.issuperset(each.joints)),
        )

    def without_motors(self, passive: Iterable[str], joints: Iterable[str]) -> Drives:
        """The same drives without motors on some joints; followers have none anyway.

        Args:
            passive: names of joints; of one with several degrees of freedom, all of them.
            joints: label of each degree of freedom behind the base (n,).

        Raises:
            UnknownNameError: a joint is not one of them.
            InvalidInputError: a transmission drives it.
        """
        names = tuple(joints)
        idle = set(_labels(passive, names, "joint without a motor"))
        for each in self.transmissions:
            if shared := idle.intersection(each.joints):
                raise InvalidInputError(
                    f"joint {min(shared)!r} is driven by {', '.join(each.motors)}. Leave it out of "
                    "passive= (--passive), or give drives without that transmission "
                    "(drives=Drives(...))."
                )
        return replace(self, motors=tuple(j for j in self._own(names) if j not in idle))

    def with_motors(self, driven: Iterable[str], joints: Iterable[str]) -> Drives:
        """The same drives with motors on some joints too; arguments and errors alike."""
        names = tuple(joints)
        more = _labels(driven, names, "joint with a motor")
        have = {*self._own(names), *more}
        return replace(self, motors=tuple(joint for joint in names if joint in have))

    def _own(self, names: tuple[str, ...]) -> tuple[str, ...]:
        """The joints with a motor of their own."""
        if self.motors is not None:
            return self.motors
        elsewhere = {coupling.joint for coupling in self.couplings}
        elsewhere |= {joint for each in self.transmissions for joint in each.joints}
        return tuple(joint for joint in names if joint not in elsewhere)

    def on(self, joints: Iterable[str]) -> Actuation | None:
        """Which torques these motors exert on a robot's joints; None if each joint has its own.

        Args:
            joints: label of each degree of freedom behind the base (n,).

        Raises:
            UnknownNameError: a joint is not one of them.
        """
        names = tuple(joints)
        for what, given in (
            ("motor", self.motors or ()),
            ("spring", self.springs),
            ("held torque", self.held),
            ("coupling", [j for each in self.couplings for j in (each.joint, each.of)]),
            ("transmission", [j for each in self.transmissions for j in each.joints]),
        ):
            for joint in given:
                if joint not in names:
                    raise UnknownNameError(f"joint of a {what}", joint, names)
        if self.motors is None and not self.couplings and not self.transmissions:
            return None
        columns: list[tuple[int, str, np.ndarray]] = []
        for joint in self._own(names):
            at = names.index(joint)
            columns.append((at, joint, np.eye(len(names))[at]))
        for each in self.transmissions:
            rows = [names.index(joint) for joint in each.joints]
            for k, motor in enumerate(each.motors):
                column = np.zeros(len(names))
                column[rows] = each.matrix[:, k]
                columns.append((min(rows), motor, column))
        columns.sort(key=lambda entry: entry[0])
        motors = tuple(name for _, name, _ in columns)
        _reject_twice(motors, "is the name of two motors")
        return Actuation(motors, np.array([c for _, _, c in columns]).reshape(-1, len(names)).T)


@dataclass(frozen=True, eq=False, repr=False)
class Actuation(ShortRepr):
    """Which joint torques the motors can exert: S t_m, and what they cannot.

    Attributes:
        motors: names of the motors (k,).
        matrix: S, motor torques to joint torques (n, k).
        inverse: S^+, joint torques to motor torques (k, n).
        free: rows (n - k, n), orthonormal, of what no motor exerts: free @ S = 0.
    """

    motors: tuple[str, ...]
    matrix: Float[np.ndarray, "n k"]
    inverse: Float[np.ndarray, "k n"] = field(init=False)
    free: Float[np.ndarray, "f n"] = field(init=False)

    def __post_init__(self) -> None:
        """Own the matrices; motors of single joints keep their rows as they are."""
        S = owned(self.matrix)
        object.__setattr__(self, "matrix", S)
        n, k = S.shape
        if np.all((S == 0) | (S == 1)) and np.all(S.sum(axis=0) == 1):
            inverse, free = S.T.copy(), np.eye(n)[~S.any(axis=1)]
        else:
            inverse = np.linalg.pinv(S)
            free = np.linalg.svd(S)[0][:, k:].T.copy()
        object.__setattr__(self, "inverse", read_only(inverse))
        object.__setattr__(self, "free", read_only(free))


def _labels(given: Iterable[str], names: tuple[str, ...], what: str) -> list[str]:
    """Joints as the labels of their degrees of freedom."""
    if isinstance(given, str):
        raise InvalidInputError(f"{given!r} is one name. Give a list of joints, [{given!r}].")
    found = []
    for joint in checked_tuple(given, str, "name", _NAMES):
        labels = [name for name in names if name == joint or name.startswith(f"{joint}[")]
        if not labels:
            raise UnknownNameError(what, joint, names)
        found += labels
    return found


def _reject_twice(names: Iterable[str], how: str) -> None:
    seen: set[str] = set()
    for name in names:
        if name in seen:
            raise InvalidInputError(f"{name!r} {how}. Name it once.")
        seen.add(name)
