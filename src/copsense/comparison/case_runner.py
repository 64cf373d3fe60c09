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
from copsense.criterion import Criterion
from copsense.errors import ControllerError, CopsenseError, UnreachablePostureError
from copsense.limits import Limits
from copsense.simulation import MujocoSimulator, Push, Recording, Scenario, rollout
from copsense.simulation.prediction import StaticPrediction, predict
from copsense.simulation.scenario import LONGEST
from copsense.stance import Stance

_SHORTER = 0.85  # a lean out of reach is tried again, shorter by this factor


class CaseRunner:
    """What the trials of `scoring` work with.

    Args:
        case: what to run.
        progress: called with the simulated time since the last call [s].
    """

    def __init__(self, case: Case, progress: Callable[[float], object] | None = None) -> None:
        """Store the case; everything else is loaded when first used."""
        self.case = case
        self.criterion: Criterion = case.controller.build_criterion()
        self.limits: Limits | None = case.controller.limits
        self._progress = progress

    @cached_property
    def stance(self) -> Stance:
        """The robot in the case's posture."""
        return self.case.robot.stance(self.case.posture)

    @cached_property
    def gains(self) -> Gains:
        """The controller's gains, which also predict a push."""
        return self.case.controller.gains_of(self.stance.robot)

    def make_controller(self) -> Controller:
        """A new controller for each run: it may have memory."""
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
        record_period: float = 5e-3,
        **changes: Any,
    ) -> Recording:
        """One run in the case's conditions, with a push or changed fields added.

        Args:
            reference: what it follows.
            duration: how long [s].
            until: what ends it early, as in `rollout`.
            push: beside those of the conditions.
            record_period: time between two rows [s]; how and where a run ends does not depend on
                it.
            changes: fields of the scenario.

        Raises:
            ControllerError: the controller failed during the run, so nothing was measured.
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
            record_period=record_period,
            progress=None if tick is None else lambda n: tick(n * scenario.control_period),
        )
        if run.attrs["end_kind"] == "controller":
            raise ControllerError(str(run.attrs["end_reason"]))
        return run

    def lean(self, reach: float | None, speed: float, sign: float) -> tuple[PathReference, float]:
        """The reference of a lateral lean, and how far it goes [m].

        Without a reach it goes until the CoM is over the outermost contact, or as far as the robot
        can lean.
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
        """The static prediction along a reference, or None and the reason."""
        try:
            return predict(reference, self.criterion, self.limits, self._friction), ""
        except CopsenseError as error:
            return None, f"no static prediction: {error}"

    @property
    def _friction(self) -> dict[str, float]:
        """Of the ground under each contact when a run starts."""
        changes = (self.case.conditions.values or {}).get("friction", ())
        scenario = Scenario(LONGEST, friction=changes)
        return scenario.friction_at_start(self.stance, self._simulator.settings.friction)

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
