"""Closures: what a robot's own loops and couplings demand of its motion, and their forces.

Each demands rows of zero velocity, J_l v = 0, and answers with forces lam: J_l' lam beside the
contacts' J' f.

    coupling    v_i - a v_j
    ball        of R_2' (p_1 - p_2), the gap in the axes of frame b; lam turns with frame b
    weld        J_1 - J_2, each in its frame's axes, which coincide
    pin         two balls on its axis

The gap is seen from a link of the loop: in world axes, what moves an open loop as a whole would
change it, and the rows would lose their rank as the loop closes.

Rows that say what others say already (a planar loop has one) are dropped by an orthonormal basis of
what J_l spans.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from copsense import rigid_body
from copsense.arrays import array_property
from copsense.content import ShortRepr, freeze
from copsense.drives import Loop
from copsense.errors import InvalidInputError, OpenLoopError
from copsense.rigid_body import Attachment
from copsense.robot import Robot

# Singular values, relative, under which a row depends on others: the root of the tolerance on
# postures, where Newton's search ends on a motion that exists to first order only.
RANK = 1e-6
OPEN = 1e-6  # m or rad: how far from closed a loop or coupling may be
_ARM = 0.1  # distance between the two balls of a pin [m]
_AXES = "xyz"


@dataclass(frozen=True)
class Joined:
    """Two attachments that are kept together, rows of J_l.

    Attributes:
        a: the first.
        b: the second.
        weld: whether they are held fast; otherwise their points stay together.
        name: what results call it.
    """

    a: Attachment
    b: Attachment
    weld: bool
    name: str

    @property
    def size(self) -> int:
        """Number of rows."""
        return 6 if self.weld else 3


@dataclass(frozen=True, eq=False, repr=False)
class Closures(ShortRepr):
    """The loops and couplings of a robot at a configuration.

    Attributes:
        robot: the robot.
        q: configuration (nq,).
    """

    robot: Robot
    q: Float[np.ndarray, " nq"]

    def __post_init__(self) -> None:
        """Own the configuration."""
        freeze(self, "q")

    @cached_property
    def _ends(self) -> tuple[tuple[pin.SE3, ...], Float[np.ndarray, "e 6 nv"]]:
        return rigid_body.place(self.robot, self.q, _attachments(self.robot))

    @property
    def names(self) -> tuple[str, ...]:
        """What each row keeps together (l,)."""
        return _names(self.robot)

    @array_property
    def error(self) -> Float[np.ndarray, " l"]:
        """How far each row is from closed (l,) [m, rad]."""
        places, found = self._ends[0], []
        for k, pair in enumerate(joined(self.robot)):
            a, b = places[2 * k], places[2 * k + 1]
            if pair.weld:
                found.append(pin.log6(b.actInv(a)).vector)
            else:
                found.append(b.rotation.T @ (a.translation - b.translation))
        for coupling in self.robot.drives.couplings:
            follower = self.robot.joint_position(self.q, coupling.joint)
            leader = self.robot.joint_position(self.q, coupling.of)
            found.append(np.array([follower - coupling.ratio * leader - coupling.offset]))
        return np.concatenate(found)

    def check(self) -> None:
        """Reject a configuration that leaves a loop or coupling open.

        Raises:
            OpenLoopError: it does, by more than `OPEN`.
        """
        error = np.abs(self.error)
        worst = int(error.argmax())
        if error[worst] > OPEN:
            raise OpenLoopError(
                f"{self.names[worst]} of robot {self.robot.name!r} is open by "
                f"{error[worst]:.3g} (m or rad). copsense.load_stance and solve_posture close "
                "loops and couplings; give a configuration in which they are closed."
            )

    @array_property
    def jacobian(self) -> Float[np.ndarray, "l nv"]:
        """J_l, every row."""
        places, local = self._ends
        nv, found = self.robot.model.nv, []
        for k, pair in enumerate(joined(self.robot)):
            a, b = local[2 * k], local[2 * k + 1]
            if pair.weld:
                found.append(a - b)
            else:
                A, B = places[2 * k], places[2 * k + 1]
                gap = B.rotation.T @ (A.translation - B.translation)
                found.append(B.rotation.T @ A.rotation @ a[:3] - b[:3] + pin.skew(gap) @ b[3:])
        for coupling in self.robot.drives.couplings:
            row = np.zeros((1, nv))
            row[0, self.robot.velocity_index(coupling.joint)] = 1.0
            row[0, self.robot.velocity_index(coupling.of)] = -coupling.ratio
            found.append(row)
        return np.concatenate(found)

    @array_property
    def basis(self) -> Float[np.ndarray, "l r"]:
        """Orthonormal basis of what J_l spans: lam = basis @ z."""
        u, s, _ = np.linalg.svd(self.jacobian, full_matrices=False)
        return np.ascontiguousarray(u[:, s > RANK * max(1.0, s.max(initial=0.0))])

    @array_property
    def independent(self) -> Float[np.ndarray, "r nv"]:
        """The rows that do not depend on each other, basis' J_l."""
        return self.basis.T @ self.jacobian

    def forces(self, lam: Float[np.ndarray, " l"]) -> dict[int, pin.Force]:
        """Forces of the loops as spatial forces: joint of the model -> force in its axes.

        Those of couplings are not among them: they act between joints.
        """
        found: dict[int, pin.Force] = {}
        for k, pair, part in self._pairs(lam):
            a, b = self._ends[0][2 * k : 2 * k + 2]
            if pair.weld:
                on_a = on_b = pin.Force(part)
            else:
                on_b = pin.Force(part, np.zeros(3))
                on_a = pin.Force(a.rotation.T @ b.rotation @ part, np.zeros(3))
            for attached, force in ((pair.a, on_a), (pair.b, -on_b)):
                rigid_body.add_force(found, attached.joint, attached.placement.act(force))
        return found

    def turning(self, lam: Float[np.ndarray, " l"]) -> Float[np.ndarray, "nv nv"]:
        """What d(J_l' lam)/dq has beside that of forces that turn with their own links.

        A ball's force on frame a turns with frame b instead.
        """
        nv = self.robot.model.nv
        found = np.zeros((nv, nv))
        places, local = self._ends
        for k, pair, part in self._pairs(lam):
            if not pair.weld:
                a, b = local[2 * k], local[2 * k + 1]
                R = places[2 * k].rotation.T @ places[2 * k + 1].rotation
                found -= a[:3].T @ R @ pin.skew(part) @ (b[3:] - R.T @ a[3:])
        return found

    def _pairs(
        self, lam: Float[np.ndarray, " l"]
    ) -> list[tuple[int, Joined, Float[np.ndarray, " _"]]]:
        """Number, ends and forces of each pair."""
        found, row = [], 0
        for k, pair in enumerate(joined(self.robot)):
            found.append((k, pair, lam[row : row + pair.size]))
            row += pair.size
        return found

    def motion_derivative(self, velocity: Float[np.ndarray, " nv"]) -> Float[np.ndarray, "l nv"]:
        """D_l = d(J_l v)/dq at fixed v, every row; of a closed loop, along its motions."""
        moved = rigid_body.velocity_derivatives(
            self.robot, self.q, velocity, _attachments(self.robot)
        )
        (places, local), found = self._ends, []
        for k, pair in enumerate(joined(self.robot)):
            a, b = moved[2 * k], moved[2 * k + 1]
            if pair.weld:
                found.append(a - b)
                continue
            Ja, Jb = local[2 * k], local[2 * k + 1]
            R = places[2 * k + 1].rotation.T @ places[2 * k].rotation
            speed = Ja[:3] @ velocity
            turned = pin.skew(R @ speed) @ Jb[3:] - R @ pin.skew(speed) @ Ja[3:]
            found.append(R @ a[:3] + turned - b[:3])
        couplings = len(self.robot.drives.couplings)
        return np.concatenate([*found, np.zeros((couplings, len(velocity)))])


@lru_cache(maxsize=32)
def joined(robot: Robot) -> tuple[Joined, ...]:
    """The pairs that a robot's loops keep together, in the order of the rows; of a pin, two."""
    found: list[Joined] = []
    for loop in robot.drives.loops:
        for sign in (-0.5, 0.5) if loop.kind == "pin" else (0.0,):
            along = sign * _ARM * np.array(loop.axis) / np.linalg.norm(loop.axis)
            a = _attached(robot, loop, loop.frame_a, np.array(loop.offset_a) + along)
            b = _attached(robot, loop, loop.frame_b, np.array(loop.offset_b) + along)
            name = f"{loop.name} ({'-+'[sign > 0]})" if sign else loop.name
            found.append(Joined(a, b, loop.kind == "weld", name))
    return tuple(found)


def _attached(robot: Robot, loop: Loop, name: str, point: np.ndarray) -> Attachment:
    frame = robot.frame(name)
    if frame.parentJoint == 0:
        raise InvalidInputError(
            f"frame {name!r} of loop {loop.name!r} is fixed in the world. A loop joins two links "
            "of the robot; make what touches the world a contact."
        )
    return Attachment(int(frame.parentJoint), frame.placement * pin.SE3(np.eye(3), point))


@lru_cache(maxsize=32)
def _attachments(robot: Robot) -> tuple[Attachment, ...]:
    return tuple(end for pair in joined(robot) for end in (pair.a, pair.b))


@lru_cache(maxsize=32)
def _names(robot: Robot) -> tuple[str, ...]:
    six = [f"{kind}{axis}" for kind in "fm" for axis in _AXES]
    names = [f"{pair.name} {six[i]}" for pair in joined(robot) for i in range(pair.size)]
    names += [f"coupling of {coupling.joint}" for coupling in robot.drives.couplings]
    return tuple(names)
