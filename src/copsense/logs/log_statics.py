"""LogStatics: what a criterion says at the postures of a log, at rest and with their inertia."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from copsense.contact import Contact
from copsense.content import ShortRepr, freeze
from copsense.cop import LEAST_LOAD, load_shares, wrench_cops
from copsense.criterion import Criterion
from copsense.errors import CopsenseError
from copsense.load_problem import LoadProblem
from copsense.logs.log_motion import LogMotion
from copsense.robot import Robot
from copsense.stance import Stance
from copsense.statics import share_load


@dataclass(frozen=True, eq=False, repr=False)
class LogStatics(ShortRepr):
    """What a criterion says at the postures of a log.

    Attributes:
        criterion: its name.
        inertia: whether the recorded motion's inertia is in the load, or the robot is at rest.
        wrenches: of the ground on each contact, contact axes (M, nc, 6) [N, Nm].
        torques: of the motors (M, n) [Nm].
    """

    criterion: str
    inertia: bool
    wrenches: Float[np.ndarray, "M nc 6"]
    torques: Float[np.ndarray, "M n"]

    def __post_init__(self) -> None:
        """Own the arrays."""
        freeze(self, "wrenches", "torques")

    @property
    def name(self) -> str:
        """Criterion, and at rest or in motion."""
        return f"{self.criterion}, {'in motion' if self.inertia else 'at rest'}"

    @property
    def shares(self) -> Float[np.ndarray, "M nc"]:
        """Each contact's share of the normal forces (M, nc)."""
        return load_shares(self.wrenches)

    @property
    def cops(self) -> Float[np.ndarray, "M nc 2"]:
        """Centre of pressure of each contact in its own frame (M, nc, 2) [m]."""
        return loaded_cops(self.wrenches)


def loaded_cops(wrenches: Float[np.ndarray, "M nc 6"]) -> Float[np.ndarray, "M nc 2"]:
    """Centres of pressure [m]; NaN under next to no normal force."""
    normal = np.abs(wrenches[:, :, 2])
    return wrench_cops(wrenches, normal > LEAST_LOAD * np.nansum(normal, axis=1, keepdims=True))


def log_statics(
    robot: Robot,
    contacts: Sequence[Contact],
    criteria: Sequence[Criterion],
    motion: LogMotion,
    rows: Int[np.ndarray, " M"],
    advance: Callable[[int], object],
) -> tuple[LogStatics, ...]:
    """Every criterion at rows of a motion, at rest and with its inertia.

    The load at rest is G(q), in motion N = rnea(q, v, a), shared in the same way.

    Args:
        robot: the robot.
        contacts: its contacts.
        criteria: what shares the load.
        motion: where the rows are.
        rows: which.
        advance: called with the postures done.

    Raises:
        CopsenseError: a criterion has no answer at a posture; the message names the row.
    """
    nc, n, M = len(contacts), len(robot.torque_names), len(rows)
    wrenches = np.empty((len(criteria), 2, M, nc, 6))
    torques = np.empty((len(criteria), 2, M, n))
    for m, row in enumerate(rows):
        # The feet are where the joints put them, millimetres off one plane.
        stance = Stance(robot, motion.configurations[row], tuple(contacts), check=False)
        moving = stance.moving(motion.velocities[row], motion.accelerations[row])
        problems = LoadProblem.of(stance), LoadProblem.of(moving)
        for c, criterion in enumerate(criteria):
            for k, problem in enumerate(problems):
                try:
                    forces, torque = share_load(stance, criterion, problem)
                except CopsenseError as error:
                    error.add_note(f"It is row {row} of the log.")
                    raise
                wrenches[c, k, m], torques[c, k, m] = stance.unstack(forces), torque
        advance(1)
    return tuple(
        LogStatics(criterion.name, bool(k), wrenches[c, k], torques[c, k])
        for c, criterion in enumerate(criteria)
        for k in (0, 1)
    )
