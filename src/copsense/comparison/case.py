"""Case: robot, posture, controller, conditions and trial, one frozen value with a stable key."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any

from copsense.comparison.choices import Conditions, ControllerChoice, PostureChoice, RobotChoice
from copsense.comparison.trials import Falls, Trial
from copsense.controllers import controller_code
from copsense.errors import InvalidInputError
from copsense.provenance import digest, plain, versions

IDEAL = Conditions()


@dataclass(frozen=True)
class Case:
    """One robot in one posture under one controller, in some conditions and one trial.

    Attributes:
        robot: the robot and its soles.
        posture: how it stands.
        controller: what balances it.
        trial: what it has to do.
        conditions: what disturbs it.
        trial_name: of the trial in results; default its kind.
    """

    robot: RobotChoice
    posture: PostureChoice
    controller: ControllerChoice
    trial: Trial
    conditions: Conditions = IDEAL
    trial_name: str = ""

    def __post_init__(self) -> None:
        """Set the default name; reject falls without limits."""
        object.__setattr__(self, "trial_name", self.trial_name or self.trial.kind)
        if isinstance(self.trial, Falls) and not self.controller.limited:
            raise InvalidInputError(
                f"falls of {self.controller.name!r} cannot be scored: without limits it depends on "
                "chance whether a robot that tipped falls. Give limits (--limits), or leave out "
                "falls."
            )

    @property
    def label(self) -> tuple[str, str, str, str, str]:
        """Names of robot, posture, controller, conditions and trial."""
        return (
            self.robot.name,
            self.posture.name,
            self.controller.name,
            self.conditions.name,
            self.trial_name,
        )

    @property
    def parameters(self) -> dict[str, Any]:
        """Everything that the scores depend on, as plain data."""
        return deepcopy(self._parameters)

    @cached_property
    def _parameters(self) -> dict[str, Any]:
        parts = ("robot", "posture", "controller", "trial", "conditions")
        found = {name: plain(getattr(self, name)) for name in parts}
        if self.robot.tables is None:  # as in tables that were made before there were any
            del found["robot"]["tables"]
        if files := self.robot.files:
            content = b"".join(file.read_bytes() for file in files)
            found["robot"]["content"] = hashlib.sha256(content).hexdigest()[:12]
        if self.controller.source:
            content = controller_code(self.controller.source)
            found["controller"]["content"] = hashlib.sha256(content).hexdigest()[:12]
        return found | {"software": versions(("mujoco", "pin"))}

    @cached_property
    def key(self) -> str:
        """A short name, the same for the same parameters in every process."""
        return digest(self._parameters)[:12]


def make_plan(
    robots: Sequence[RobotChoice],
    postures: Sequence[PostureChoice],
    controllers: Sequence[ControllerChoice],
    trials: Sequence[Trial] | Mapping[str, Trial],
    conditions: Sequence[Conditions] = (IDEAL,),
) -> tuple[Case, ...]:
    """Every robot in every posture under every controller in all conditions and trials.

    Args:
        robots: which robots.
        postures: how they stand.
        controllers: what balances them.
        trials: what they have to do; a mapping gives names.
        conditions: what disturbs them.
    """
    named = trials if isinstance(trials, Mapping) else {trial.kind: trial for trial in trials}
    return tuple(
        Case(robot, posture, controller, trial, condition, name)
        for robot, posture, condition, (name, trial), controller in product(
            robots, postures, conditions, named.items(), controllers
        )
    )
