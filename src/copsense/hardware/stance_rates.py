"""What alterations of a robot's hardware change of a stance, and of the posture that follows them.

Three things change per unit of a parameter: the robot at a fixed posture (shapes through virtual
joints, masses through the regressor of gravity), the posture that keeps contacts and centre of mass
in place, and the sole under the centre of pressure.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from copsense import rigid_body
from copsense.arrays import read_only
from copsense.changes import StanceChange
from copsense.contact import Contact, edge_row
from copsense.errors import InvalidInputError, UnreachablePostureError
from copsense.hardware.parameter import Alteration, Parameter, Stretch
from copsense.hardware.virtual_joints import VirtualJoints
from copsense.posture_system import (
    PostureCost,
    bordered,
    cost_derivatives,
    followed_tangents,
    independent_rows,
    posture_weights,
)
from copsense.rigid_body import Attachment
from copsense.stance import Stance


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class HardwareChange(StanceChange):
    """Ways in which a stance changes, shapes of the robot among them, one per column.

    Attributes:
        virtual: the robot whose shape is a motion.
    """

    virtual: VirtualJoints

    def balance(self, stance: Stance, forces: Float[np.ndarray, " c"]) -> Float[np.ndarray, "nv p"]:
        """d(N - J' f) at fixed forces f (c,), rows in the order of `Robot.by_drive`."""
        shaped = self.virtual.balance_rates(stance, forces)
        return super().balance(stance, forces) + stance.robot.by_drive(shaped)

    def constraint(
        self, stance: Stance, velocity: Float[np.ndarray, " nv"]
    ) -> Float[np.ndarray, "c p"]:
        """d(J v) at a fixed velocity v (nv,)."""
        return super().constraint(stance, velocity) + self.virtual.motion_rates(stance, velocity)

    def inertia(
        self, stance: Stance, acceleration: Float[np.ndarray, " nv"]
    ) -> Float[np.ndarray, "nv p"]:
        """d(M a) at a fixed acceleration a (nv,), both in the order of `Robot.by_drive`."""
        robot = stance.robot
        shaped = self.virtual.inertia_rates(stance, robot.from_drives(acceleration))
        return super().inertia(stance, acceleration) + robot.by_drive(shaped)


@dataclass(frozen=True, eq=False, repr=False)
class HardwareRates:
    """How stances of a robot follow its hardware: the one it stands in, and others on its paths.

    Attributes:
        home: the stance.
        parameters: what changes (p in all).
        virtual: the robot whose shape is a motion.
        inertias: links' inertial parameters per unit of each (10 (njoints - 1), p).
        followed: dq per unit of each at `home` (nv, p), contacts and centre of mass in place.
    """

    home: Stance
    parameters: tuple[Parameter, ...]
    virtual: VirtualJoints = field(init=False)
    inertias: Float[np.ndarray, "k p"] = field(init=False)
    followed: Float[np.ndarray, "nv p"] = field(init=False)

    def __post_init__(self) -> None:
        """Lay out the virtual joints and solve for the posture that follows.

        Raises:
            UnreachablePostureError: the joints cannot follow a parameter.
        """
        alterations = [p.alteration for p in self.parameters]
        for name, value in (
            ("virtual", VirtualJoints.of(self.home, alterations)),
            ("inertias", read_only(inertial_rates(self.home, alterations))),
        ):
            object.__setattr__(self, name, value)
        still = np.zeros((self.home.robot.model.nv, len(self.parameters)))
        object.__setattr__(self, "followed", read_only(self._posture_rates(self.home, still)))

    def __repr__(self) -> str:
        """The stance, and how many parameters."""
        return f"HardwareRates({self.home!r}, {len(self.parameters)} parameters)"

    def change_at(self, here: Stance) -> HardwareChange:
        """How a stance of the path through `home` changes, its centre of mass held.

        Args:
            here: the nearest posture to `home` with the centre of mass elsewhere, as a
                `LateralPath` has it.
        """
        moved = self.followed if here is self.home else self._posture_rates(here, self.followed)
        return HardwareChange(
            moved, self._spring_loads(here), None, self.inertias, virtual=self.virtual
        )

    def _spring_loads(self, here: Stance) -> Float[np.ndarray, "nv p"] | None:
        robot = here.robot
        if not any(p.alteration.springs for p in self.parameters):
            return None
        load = np.zeros((robot.model.nv, len(self.parameters)))
        for i, parameter in enumerate(self.parameters):
            for joint in parameter.alteration.springs:
                bent = robot.joint_position(here.q, joint) - robot.drives.springs[joint].rest
                load[robot.velocity_index(joint), i] = bent
        return load

    def _posture_rates(
        self, here: Stance, homed: Float[np.ndarray, "nv p"]
    ) -> Float[np.ndarray, "nv p"]:
        """dq of the posture nearest to `home`, which moves itself by `homed`."""
        robot, nv = here.robot, here.robot.model.nv
        axes = [0, 1] if robot.base_nv == 6 else [1]
        C = np.vstack([here.constraints, here.com_jacobian[axes]])
        A, _, spread = independent_rows(here, C, np.zeros(len(C)))
        weights = posture_weights(here, PostureCost())
        gradient, hessian = cost_derivatives(here, self.home.q, weights)
        multipliers = np.linalg.lstsq(A.T, -gradient, rcond=1e-10)[0]
        of_h = multipliers if spread is None else (spread @ multipliers)[: len(C)]
        rows = len(here.constraints)
        pull = np.zeros(3)
        pull[axes] = of_h[rows:]
        K = bordered(hessian + here.curvature(-of_h[:rows], -pull / robot.mass), A)
        stationarity = self.virtual.curvature_rates(here, -of_h[:rows], -pull / robot.mass)
        stationarity = stationarity + self._pulled(here, pull)
        stationarity = stationarity - _home_matrix(self.home, here, weights) @ homed
        moved = np.vstack([self.virtual.place_rates(here), self._com_rates(here)[axes]])
        if spread is not None:
            folds = len(spread) - len(C)
            if folds and any(p.alteration.shapes for p in self.parameters):
                raise InvalidInputError(
                    f"contacts of robot {robot.name!r} hold some motions to second order only, as "
                    "legs without ankle roll do: how its posture follows its shape is not worked "
                    "out there. Put the feet a little apart or together (width=, --width)."
                )
            moved = np.vstack([moved, np.zeros((folds, moved.shape[1]))])
        found, followed = followed_tangents(here, K, C, -moved, spread, stationarity)
        if not followed.all():
            stuck = [p.name for p, good in zip(self.parameters, followed, strict=True) if not good]
            raise UnreachablePostureError(
                f"the joints of {robot.name!r} cannot follow {', '.join(stuck)}: its contacts "
                "would leave the ground. Leave it out."
            )
        assert found.shape[0] == nv
        return found

    def _com_rates(self, here: Stance) -> Float[np.ndarray, "3 p"]:
        """How fast the centre of mass moves, posture held [m]."""
        found = self.virtual.com_rates(here)
        model, mass = here.robot.model, here.robot.mass
        joints = sorted({j for p in self.parameters for j in _bodies(p.alteration)})
        origins = [Attachment(joint, pin.SE3.Identity()) for joint in joints]
        places = rigid_body.place(here.robot, here.q, origins)[0] if joints else ()
        assert model.njoints * 10 == len(self.inertias) + 10
        for joint, place in zip(joints, places, strict=True):
            pi = self.inertias[10 * (joint - 1) : 10 * joint]
            first = place.rotation @ pi[1:4] + np.outer(place.translation - here.com, pi[0])
            found = found + first / mass
        return found

    def _pulled(self, here: Stance, pull: Float[np.ndarray, " 3"]) -> Float[np.ndarray, "nv p"]:
        """d(J_com' pull) per unit of each, by the masses alone: m J_com is linear in them."""
        regressor = rigid_body.inertial_regressor(here.robot, here.q, gravity=-pull)
        more = self.inertias[::10].sum(axis=0)
        return (
            regressor @ self.inertias - np.outer(here.com_jacobian.T @ pull, more)
        ) / here.robot.mass


def inertial_rates(stance: Stance, alterations: Sequence[Alteration]) -> Float[np.ndarray, "k p"]:
    """Links' inertial parameters per unit of each alteration (10 (njoints - 1), p).

    As ``pin.Inertia.toDynamicParameters``: m, m c, and the inertia about the joint's frame, its
    lower triangle row by row.
    """
    model = stance.robot.model
    found = np.zeros((10 * (model.njoints - 1), len(alterations)))
    for i, change in enumerate(alterations):
        for joint, kg in change.masses.items():
            c = np.array(model.inertias[joint].lever)
            about = (c @ c) * np.eye(3) - np.outer(c, c)
            found[10 * (joint - 1) : 10 * joint, i] += kg * _dynamic(1.0, c, about)
        for joint, (u, length) in change.stretches.items():
            body = model.inertias[joint]
            c, m, central = np.array(body.lever), float(body.mass), np.array(body.inertia)
            spread = np.trace(central) / 2 * np.eye(3) - central + m * np.outer(c, c)
            along = np.outer(u, u) @ spread / length
            grown = along + along.T
            about = np.trace(grown) * np.eye(3) - grown
            first = m * float(u @ c) / length * u
            found[10 * (joint - 1) : 10 * joint, i] += _dynamic(0.0, first, about)
    return found


def sole_rates(contact: Contact, stretch: Stretch) -> Float[np.ndarray, "e 6"]:
    """How the rows of a sole's edges, f_z (b - margin - a . p), change per metre (e, 6).

    An edge's points p move by S (p - fixed): its normal turns as -S a, kept of unit length.
    """
    sole = contact.sole
    assert sole is not None
    S = np.zeros((2, 2))
    S[stretch.axis, stretch.axis] = 1.0 / stretch.extent
    normals, offsets = [*sole.normals], [*sole.offsets]
    if contact.kind == "surface":
        sides = sole.sides
        normals, offsets = [*normals, *sides[0]], [*offsets, *sides[1]]
    rows = []
    for a, b in zip(normals, offsets, strict=True):
        turned = -S @ a + a * float(a @ S @ a)
        point = a * b  # of the edge's line
        moved = S @ point
        moved[stretch.axis] -= stretch.fixed / stretch.extent
        rows.append(edge_row(turned, float(turned @ point + a @ moved)))
    return np.array(rows).reshape(-1, 6)


def _home_matrix(
    home: Stance, here: Stance, weights: Float[np.ndarray, " nv"]
) -> Float[np.ndarray, "nv nv"]:
    """How the cost's gradient falls as what deviations are measured from moves."""
    found = np.diag(weights)
    if here.robot.base_nv == 6:
        # log(exp(-w) exp(r)) = r - J_l^-1(r) w, and J_l^-1(r) is the transpose of J_r^-1(r).
        relative = pin.Quaternion(home.q[3:7]).matrix().T @ pin.Quaternion(here.q[3:7]).matrix()
        found[3:6, 3:6] = weights[3] * pin.Jlog3(relative).T
    return found


def _bodies(change: Alteration) -> set[int]:
    return {*change.masses, *change.stretches}


def _dynamic(
    mass: float, first: Float[np.ndarray, " 3"], about: Float[np.ndarray, "3 3"]
) -> Float[np.ndarray, " 10"]:
    return np.concatenate([[mass], first, about[np.tril_indices(3)]])
