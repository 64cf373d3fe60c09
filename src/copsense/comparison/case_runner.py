"""CaseRunner: a case's robot, simulator and controller, built once and run for each trial."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any, Literal

from copsense.comparison.case import Case
from copsense.controllers import (
    BalancingController,
    Controller,
    Gains,
    PathReference,
    Ramp,
    Signal,
    lateral_reference,
    load_controller,
)
from copsense.errors import ControllerError, CopsenseError, UnreachablePostureError
from copsense.simulation import MujocoSimulator, Push, Recording, Scenario, rollout
from copsense.simulation.prediction import StaticPrediction, predict
from copsense.stance import Stance

_SHORTER = 0.85  # a lean out of reach is tried again, so much shorter


class CaseRunner:
    """What the trials of `score` work with.

    Args:
        case: what to set up.
        progress: called with the simulated time since the last call [s].
    """

    def __init__(self, case: Case, progress: Callable[[float], object] | None = None) -> None:
        """Nothing is loaded before it is needed."""
        self.case, self._progress = case, progress
        self.criterion, self.limits = case.controller.law, case.controller.limits

    @cached_property
    def stance(self) -> Stance:
        """The robot in its posture."""
        return self.case.robot.stance(self.case.posture)

    @cached_property
    def gains(self) -> Gains:
        """Of the controller, and of what predicts a push."""
        return self.case.controller.gains_of(self.stance.robot)

    def make_controller(self) -> Controller:
        """What balances the robot, anew for each run: it may remember."""
        choice = self.case.controller
        if choice.source:
            return load_controller(choice.source, self.stance)
        return BalancingController(
            self.stance, self.criterion, self.gains, limits=self.limits, name=choice.name
        )

    @cached_property
    def _simulator(self) -> MujocoSimulator:
        return MujocoSimulator(self.stance)

    def run(
        self,
        reference: PathReference,
        duration: float,
        *,
        until: Literal["tip", "fall"] = "tip",
        push: Push | None = None,
        **changes: Any,
    ) -> Recording:
        """One rollout in the case's conditions, with a push or changed fields on top.

        Raises:
            ControllerError: the controller failed on the way, which tells nothing of the robot.
        """
        values = dict(self.case.conditions.values or {}) | changes
        if push is not None:
            values["pushes"] = (*values.get("pushes", ()), push)
        scenario = Scenario(duration, reference, **values)
        tick = self._progress
        run = rollout(
            self._simulator,
            self.make_controller(),
            scenario,
            until=until,
            progress=None if tick is None else lambda n: tick(n * scenario.control_period),
        )
        if run.attrs["end_kind"] == "controller":
            raise ControllerError(str(run.attrs["end_reason"]))
        return run

    def lean(self, reach: float | None, speed: float, sign: float) -> tuple[PathReference, float]:
        """The reference of a lateral lean, and how far it goes [m].

        Without a reach it goes until the CoM is over the outermost contact, or as far as the
        robot can.
        """
        if reach is not None:
            return lateral_reference(self.stance, Ramp(sign * reach, speed)), reach
        y = float(self.stance.com[1])
        reach = max(abs(float(place.translation[1]) - y) for place in self.stance.placements)
        while True:
            try:
                return lateral_reference(self.stance, Ramp(sign * reach, speed)), reach
            except UnreachablePostureError:
                reach *= _SHORTER
                if reach < 5e-3:
                    raise

    def reference(self, signal: Signal) -> PathReference:
        """The lateral reference of a signal."""
        return lateral_reference(self.stance, signal)

    def statics(self, reference: PathReference) -> tuple[StaticPrediction | None, str]:
        """What the statics say along a reference; or nothing, and why."""
        try:
            return predict(reference, self.criterion, self.limits, self._friction), ""
        except CopsenseError as error:
            return None, f"no static prediction: {error}"

    @property
    def _friction(self) -> float:
        """Of the ground when a run starts."""
        friction = self._simulator.settings.friction
        for change in (self.case.conditions.values or {}).get("friction", ()):
            if change.start <= 0 and change.contact is None:
                friction = change.friction
        return friction

    @cached_property
    def leg_joints(self) -> tuple[str, ...]:
        """Joints between the base and the contacts."""
        model, names = self.stance.robot.model, set(self.stance.robot.torque_names)
        found: dict[str, None] = {}
        for contact in self.stance.contacts:
            for i in self.stance.limb(contact):
                if model.names[i] in names:
                    found[model.names[i]] = None
        return tuple(found)
