"""balance: one robot, one controller, one scenario in closed loop, beside the static prediction."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Literal

from copsense.controllers import (
    STIFF,
    BalancingController,
    Controller,
    Gains,
    Hold,
    PathReference,
    Ramp,
    Signal,
    Sine,
    lateral_reference,
)
from copsense.criterion import Criterion, check_criterion, minimum_torque
from copsense.errors import InvalidInputError, UndeterminedWrenchError
from copsense.freedom import hanging_notes, repetition_notes
from copsense.limits import Limits, check_limits
from copsense.simulation.control_loop import rollout
from copsense.simulation.end_cause import likely_cause
from copsense.simulation.mujoco_simulator import MujocoSimulator
from copsense.simulation.prediction import predict
from copsense.simulation.recording import Recording
from copsense.simulation.scenario import Scenario
from copsense.simulation.timed_prediction import timed_note
from copsense.stance import Stance, check_stance
from copsense.statics import with_tie_breaks
from copsense.statics.tie_breaks import TIE_BREAK, tie_break_note

_ENGINE_SHARES = (
    "The engine shares the forces that no motor feels by how its contacts yield, not by the "
    "tie-break: single loads and margins that are measured, as of a toe beside its foot, may "
    "differ from the predicted ones and from the limits."
)


def balance(
    stance: Stance,
    criterion: Criterion | None = None,
    reference: Signal | PathReference | Scenario | None = None,
    *,
    limits: Limits | None = None,
    gains: Gains = STIFF,
    feedforward: bool = False,
    controller: Controller | None = None,
    until: Literal["tip", "fall"] = "fall",
    wrenches: Literal["contacts", "sensors"] = "contacts",
    progress: Callable[[int], object] | None = None,
    stop: Callable[[], bool] | None = None,
) -> Recording:
    """Balance a robot in MuJoCo, and record what happened beside the static prediction.

    What ``copsense balance`` runs, in one call.

    Args:
        stance: the robot on its contacts, where it starts.
        criterion: how the load is shared, and predicted; default `minimum_torque`. With a
            `controller` of your own there is a prediction only if you give the criterion.
        reference: how far to the left the CoM goes: `Hold`, `Sine`, `Ramp` or a `PathReference`,
            for as long as it naturally lasts, see `natural_duration`; or a whole `Scenario`, with
            its duration, pushes, noise and the rest. Default: hold still.
        limits: what the controller's wrenches and torques must respect; None for nothing.
        gains: of the built-in controller.
        feedforward: whether the built-in controller knows the reference's posture acceleration.
        controller: another controller than `BalancingController`.
        until: ``"tip"`` ends with the first contact that tips, lifts or slips, ``"fall"`` with a
            fall or the end of the scenario.
        wrenches: measured as the engine's contact forces, or by six-axis sensors over the feet.
        progress: called with the number of control periods done since the last call.
        stop: asked before every control period; true ends the run.

    Returns:
        The recording, with ``static_*`` beside what was measured, and ``likely_cause``, why it
        tipped or fell.

    Raises:
        MissingExtraError: MuJoCo is not installed.
        InvalidInputError: limits for a controller of your own, without a criterion.
        CopsenseError: the scenario does not fit the robot, or the controller failed at the start.
    """
    check_stance(stance)
    if criterion is not None:
        check_criterion(criterion)
    if limits is not None:
        check_limits(limits)
    if controller is not None and criterion is None and limits is not None:
        raise InvalidInputError(
            "limits (--limits) are those of the built-in controller and of the static prediction. "
            "Leave them out, or name the criterion (--criterion) by which your controller is to "
            "be predicted."
        )
    scenario = _scenario(reference)
    scenario.check_stance(stance)
    simulator = MujocoSimulator(stance, wrenches=wrenches)
    scenario.steps_per_control(simulator.time_step)
    signal = scenario.reference
    path = signal if isinstance(signal, PathReference) else lateral_reference(stance, signal)
    predicted = criterion if controller is not None else criterion or minimum_torque()
    notes: tuple[str, ...] = ()
    if predicted is not None:
        tied, notes = with_tie_breaks([stance], {predicted.name: predicted})
        (predicted,) = tied.values()
        if notes:
            notes = (*notes, _ENGINE_SHARES)
    if controller is None:
        assert predicted is not None
        build = partial(BalancingController, gains=gains, limits=limits, feedforward=feedforward)
        try:
            controller = build(stance, predicted)
        except UndeterminedWrenchError:
            # Statics take the least of forces that motors feel within rounding alone.
            if predicted.tie_break is not None:
                raise
            predicted = replace(predicted, tie_break=TIE_BREAK)
            notes = (tie_break_note(predicted.name), _ENGINE_SHARES)
            controller = build(stance, predicted)
    ground = scenario.friction_at_start(stance, simulator.settings.friction)
    prediction = None if predicted is None else predict(path, predicted, limits, ground)
    scenario = replace(scenario, reference=path)
    recording = rollout(
        simulator,
        controller,
        scenario,
        until=until,
        progress=progress,
        stop=stop,
    )
    if prediction is not None and prediction.at_rest:
        notes = (*notes, prediction.at_rest)
    timed = () if prediction is None else filter(None, (timed_note(path),))
    recording = recording.with_notes(
        (*notes, *timed, *repetition_notes(stance), *hanging_notes(stance))
    )
    recording = recording.with_attributes(
        likely_cause=likely_cause(recording, stance, scenario, controller, prediction)
    )
    return recording if prediction is None else prediction.attach(recording)


def natural_duration(reference: Signal | PathReference) -> float:
    """How long a reference lasts [s]: one period, a ramp and 1 s, or 2 s for what stands still."""
    signal = reference.signal if isinstance(reference, PathReference) else reference
    if isinstance(signal, Sine):
        return 1.0 / signal.frequency
    if isinstance(signal, Ramp):
        return signal.duration + 1.0
    return 2.0


def _scenario(reference: Signal | PathReference | Scenario | None) -> Scenario:
    if isinstance(reference, Scenario):
        return reference
    signal: Signal | PathReference = Hold() if reference is None else reference
    if not hasattr(signal, "at"):
        return Scenario(reference=signal)  # its error says what a reference is
    return Scenario(natural_duration(signal), signal, name=type(signal).__name__.lower())
