"""rollout: run a controller and a simulator through a scenario, and record it."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import Literal

import numpy as np

from copsense.arrays import check_type, finite_number, is_finite
from copsense.blas import one_blas_thread
from copsense.controllers.controller import Controller, Observation, ask, controller_name
from copsense.controllers.target import PathReference, Target, lateral_reference
from copsense.criterion import Criterion
from copsense.errors import ControllerError, InvalidInputError, UnknownNameError
from copsense.extras import require
from copsense.limits import Limits
from copsense.provenance import made_by
from copsense.simulation.actuation import Actuation
from copsense.simulation.events import Event, EventDetector, Thresholds
from copsense.simulation.push_forces import PushForces
from copsense.simulation.recorder import Recorder
from copsense.simulation.recording import Recording
from copsense.simulation.scenario import Scenario
from copsense.simulation.sensors import Sensors
from copsense.simulation.simulator import (
    AlterableSimulator,
    RepeatingSimulator,
    Simulator,
    SimulatorStoppedError,
)
from copsense.stance import Stance

_PLACE = 1e-5  # m, rad: contacts closer than this are at the same place
_REPORT = 50  # control periods between two calls of `progress`


def rollout(
    simulator: Simulator,
    controller: Controller,
    scenario: Scenario,
    *,
    until: Literal["tip", "fall"] = "tip",
    record_period: float = 5e-3,
    thresholds: Thresholds | None = None,
    progress: Callable[[int], object] | None = None,
    stop: Callable[[], bool] | None = None,
) -> Recording:
    """Run a scenario in closed loop.

    The robot starts at the stance's configuration with the reference's velocity.

    Args:
        simulator: the robot on its contacts; it is reset first.
        controller: a callable observation -> torques (n,) or `Command`.
        scenario: what to do and what disturbs it.
        until: ``"tip"`` ends with the first contact that tips, lifts or slips, ``"fall"`` with a
            fall or the end of the scenario.
        record_period: time between two rows of the record [s], rounded to control periods.
        thresholds: what counts as a tip or a fall.
        progress: called with the number of control periods done since the last call.
        stop: called before every control period; true ends the run.

    Returns:
        What was recorded. It has the centre of mass, wrenches (measured and commanded), CoPs,
        margins, torques and joints over time, why the run ended and which contact tipped first.
        The record up to an early end is kept.

    Raises:
        CopsenseError: the scenario does not fit the robot or the simulator.
        ControllerError: the controller failed before anything was recorded.
    """
    require("xarray", "a recording")
    finite_number(record_period, "the time between two rows [s]", positive=True)
    remedy = "Give MujocoSimulator(stance), or what has its stance, time_step, reset and step."
    check_type(simulator, Simulator, "a simulator", remedy)
    check_type(scenario, Scenario, "a scenario", "Give Scenario(duration, reference).")
    if thresholds is not None:
        check_type(thresholds, Thresholds, "a value of Thresholds", "Give Thresholds(tilt=...).")
    if until not in ("tip", "fall"):
        raise UnknownNameError("end of a rollout", until, ("tip", "fall"))
    # The matrices of a step are small: with more BLAS threads it is many times slower.
    with one_blas_thread():
        return _run(
            simulator,
            controller,
            scenario,
            until,
            record_period,
            thresholds or Thresholds(),
            progress,
            stop,
        )


def _run(
    simulator: Simulator,
    controller: Controller,
    scenario: Scenario,
    until: Literal["tip", "fall"],
    record_period: float,
    thresholds: Thresholds,
    progress: Callable[[int], object] | None,
    stop: Callable[[], bool] | None,
) -> Recording:
    believed, dt = simulator.stance, simulator.time_step
    name, n = controller_name(controller), len(believed.robot.torque_names)
    scenario.check_stance(believed)
    steps = scenario.steps_per_control(dt)
    reference = scenario.reference
    if not isinstance(reference, PathReference):
        reference = lateral_reference(believed, reference)
    _check_same(believed, reference.path.stances[0], "the reference")
    made_for = getattr(controller, "stance", None)
    if isinstance(made_for, Stance):
        _check_same(believed, made_for, f"controller {name!r}")
    if scenario.model_error:
        simulator = _alterable(simulator, "a model error").altered(
            scenario.model_error.applied(believed)
        )
    changes = deque(scenario.friction)
    ground = _alterable(simulator, "a change of friction") if changes else None
    stance, robot = simulator.stance, simulator.stance.robot
    actuation = Actuation(scenario.motors, robot, dt)
    # Where nothing acts between two commands, the states between them are not needed.
    repeating = (
        simulator
        if steps > 1 and actuation.plain and isinstance(simulator, RepeatingSimulator)
        else None
    )
    sensors, pushes = Sensors(scenario, believed), PushForces(scenario, stance, dt)
    watch, recorder = EventDetector(stance, thresholds), Recorder(stance)
    every = max(1, round(record_period / scenario.control_period))
    count = round(scenario.duration / scenario.control_period)
    if count < 1:
        raise InvalidInputError(
            f"the scenario lasts {scenario.duration:g} s, less than a control period. Make it "
            "longer."
        )
    # A sine starts at full speed, and so does the robot: torques that make up for a jump in the
    # velocity would tip light feet.
    start = reference.at(0.0).velocity
    now = simulator.reset(start) if np.any(start) else simulator.reset()
    tip, tip_com, reported = None, None, 0
    end = Event("completed", scenario.duration, "completed")
    for number in range(count):
        time = number * scenario.control_period
        if stop and len(recorder) and stop():
            end = Event("stopped", time, "stopped")
            break
        target = reference.at(time)
        while ground is not None and changes and changes[0].start <= time + 1e-9:
            change = changes.popleft()
            ground.set_friction(change.friction, change.contact)
        q, v = sensors.read(now)
        try:
            observation = _shown(time, q, v, target, now.wrenches)
            command = ask(controller, observation, n)
            here = now
            if repeating is not None and pushes.rest(now.time, scenario.control_period):
                torques = actuation.apply(command.torques)
                now = repeating.repeat(torques, steps)
            else:
                for _ in range(steps):
                    torques = actuation.apply(command.torques)
                    now = simulator.step(torques, pushes.at(now))
            if not (is_finite(now.q) and is_finite(now.v)):
                now = here
                raise SimulatorStoppedError("the motion is no longer finite", time)
            now = sensors.measured(now)
        except ControllerError as error:
            if not len(recorder):
                raise
            end = Event("controller", time, str(error))
            break
        except SimulatorStoppedError as error:
            end = Event("engine", error.time, str(error))
            break
        com = watch.com(now)
        contact = watch.contact_event(now) if tip is None else None
        if contact:
            tip, tip_com = contact, com
        over = watch.end_event(now, com[2])
        ends = over or (contact if until == "tip" else None)
        if number % every == 0 or ends or number == count - 1:
            recorder.add(here, now, target, command, torques, watch.tilts(now))
        if ends:
            end = ends
            if tip and tip is not ends:  # and how it ended
                then = ends.message.partition(";")[0]
                end = replace(ends, message=f"{tip.message}; then {then}")
            break
        if progress and number - reported >= _REPORT:
            progress(number - reported)
            reported = number
    if progress:
        progress(number + 1 - reported)
    if not len(recorder):
        raise ControllerError(
            f"the first torques of controller {name!r} ended the simulation: {end.message}. "
            "Lower its gains."
        )
    criterion = getattr(controller, "criterion", None)
    criteria = [criterion] if isinstance(criterion, Criterion) else []
    within = getattr(controller, "limits", None)
    attributes = {
        "controller": name,
        "scenario": scenario.name,
        "seed": scenario.seed,
        "control_period": scenario.control_period,
        "time_step": dt,
        **made_by(stance, criteria, within if isinstance(within, Limits) else None),
    }
    return recorder.recording(end, tip, tip_com, attributes)


def _alterable(simulator: Simulator, what: str) -> AlterableSimulator:
    if not isinstance(simulator, AlterableSimulator):
        raise InvalidInputError(
            f"{type(simulator).__name__} cannot simulate {what}: it has no altered() and "
            "set_friction(). Use MujocoSimulator, or leave it out of the scenario."
        )
    return simulator


def _shown(
    time: float, q: np.ndarray, v: np.ndarray, target: Target, wrenches: np.ndarray
) -> Observation:
    """What the controller receives, read-only."""
    q, v, wrenches = q.view(), v.view(), wrenches.view()
    for seen in (q, v, wrenches):
        seen.setflags(write=False)
    return Observation(time, q, v, target, wrenches)


def _check_same(here: Stance, there: Stance, what: str) -> None:
    """Reject what is made for another robot, or for other contacts."""
    ours, theirs = here.robot.joint_names, there.robot.joint_names
    if ours != theirs:
        raise InvalidInputError(
            f"{what} is made for {there.robot.name!r} with {len(theirs)} joints, the simulator is "
            f"of {here.robot.name!r} with {len(ours)}. Use the same stance for both."
        )
    if here.robot.torque_names != there.robot.torque_names:
        raise InvalidInputError(
            f"{what} is made for a robot whose motors are {', '.join(there.robot.torque_names)}, "
            f"the simulator's are {', '.join(here.robot.torque_names)}. Use the same drives for "
            "both."
        )
    place, other = (np.array([p.homogeneous for p in s.placements]) for s in (here, there))
    if here.contact_names != there.contact_names or np.abs(place - other).max() > _PLACE:
        raise InvalidInputError(
            f"{what} is made for other contacts, or contacts elsewhere, than the simulator. Use "
            "the same stance for both."
        )
