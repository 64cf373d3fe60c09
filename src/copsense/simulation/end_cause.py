"""likely_cause: why a robot tipped or fell, by what the run and the statics show, and the remedy.

Of several reasons the first that fits is said: what is certain before what is likely.
"""

from __future__ import annotations

import numpy as np

from copsense.controllers import BalancingController, Controller
from copsense.controllers.target import PathReference
from copsense.criterion import minimum_wrench
from copsense.errors import CopsenseError
from copsense.freedom import missing_joints, repetition_notes, straight_note
from copsense.listing import listed
from copsense.simulation.at_rest import at_rest_note
from copsense.simulation.physics_settings import PhysicsSettings
from copsense.simulation.prediction import StaticPrediction, farther_side
from copsense.simulation.recording import Recording
from copsense.simulation.scenario import Scenario
from copsense.stance import Stance
from copsense.statics import solve_equilibrium

_NEAR = 0.9  # of the static excursion, from which statics have foretold it
_SAME = 1e-6  # Nm: torques that differ by less are the same
_OTHER = "another criterion (--criterion minimum-wrench, criterion=minimum_wrench(1.0))"
_OUTSIDE = 1e-3  # m, or share of the weight: what is less out of the ground's reach is on its edge


def likely_cause(
    recording: Recording,
    stance: Stance,
    scenario: Scenario,
    controller: Controller,
    prediction: StaticPrediction | None,
) -> str:
    """Why a contact did not stay in its place, or the robot fell, and the remedy.

    Args:
        recording: of the run of this stance in this scenario.
        stance: robot and contacts at the start.
        scenario: what was asked for, its reference a `PathReference`, and what disturbed it.
        controller: what balanced the robot.
        prediction: the statics; None where the controller's criterion is not known.

    Returns:
        A sentence or two; "" where every contact stood to the end, or the run was stopped.
    """
    if recording.end.kind == "stopped" or (recording.completed and recording.tip is None):
        return ""
    known = (
        _unfelt(stance, scenario, controller, prediction)
        or _foretold(recording, scenario, prediction)
        or _disturbed(scenario, recording)
    )
    if known or not isinstance(controller, BalancingController):
        statics = (
            "what statics say of it is not known without its criterion (--criterion)"
            if prediction is None
            else "statics keep every contact in its place"
        )
        return known or f"nothing but the torques of your controller: {statics}."
    return (
        _slack(stance, controller)
        or _out_of_reach(recording, stance)
        or (
            "neither statics nor the wrenches that were asked for say why: the loop itself is "
            "unstable. Lower the gains (--gain, --gains public), or shorten the control period "
            "(--control-period)."
        )
    )


def _unfelt(
    stance: Stance,
    scenario: Scenario,
    controller: Controller,
    prediction: StaticPrediction | None,
) -> str:
    """Forces that no ground gives, asked for between contacts that all but repeat each other."""
    if prediction is None or not prediction.at_rest:
        return ""
    if not isinstance(controller, BalancingController) or not repetition_notes(stance):
        return ""
    start, other = prediction.start.equilibrium, minimum_wrench(1.0)
    ground = scenario.friction_at_start(stance, PhysicsSettings.friction)
    try:
        held = solve_equilibrium(stance, other)
    except CopsenseError:
        return ""
    if at_rest_note(held, other, ground):
        return ""
    here, there = (float(np.linalg.norm(at.torques)) for at in (start, held))
    return (
        f"{_repeated(stance)}. For a torque norm of {here:.4g} Nm where {other.name} needs "
        f"{there:.4g} Nm, {controller.criterion.name} asks for forces between them that no ground "
        f"gives. Take {_OTHER}."
    )


def _foretold(recording: Recording, scenario: Scenario, prediction: StaticPrediction | None) -> str:
    """What statics say of the posture, or of a reference that goes too far or too fast."""
    if prediction is None:
        return ""
    if prediction.at_rest:
        return "the ground cannot give what holds it at rest; a note says what, and the remedy."
    if recording.tip is None or not isinstance(scenario.reference, PathReference):
        return ""
    travel, fast = recording.tip_travel, prediction.quasi_static
    if farther_side(scenario.reference.signal) * travel >= _NEAR * prediction.excursion:
        return (
            f"statics predict it: {prediction.statement}. Ask for less (--reference), or take a "
            "criterion or limits under which the CoM goes farther."
        )
    if not fast.holds:
        return (
            "it moves too fast: in motion the centre of pressure goes up to "
            f"{fast.excess * 1e3:.1f} mm farther than the CoM; at rest, {prediction.statement}. "
            "Ask for a slower sway, or a smaller one (--reference)."
        )
    return ""


def _disturbed(scenario: Scenario, recording: Recording) -> str:
    """What disturbed the robot before, by the words of the options."""
    first = min(recording.end.time, recording.tip.time if recording.tip else np.inf)
    motors, noise = scenario.motors, scenario.noise
    found = {
        "a push": any(push.start <= first for push in scenario.pushes),
        "a change of friction": any(change.start <= first for change in scenario.friction),
        "a mass the controller does not know of": bool(scenario.model_error),
        "delay of the motors": motors.delay > 0.0,
        "bandwidth of the motors": motors.bandwidth is not None,
        "torques cut off at the motors' limit": motors.limit is not None
        and _cut_off(recording.between(0.0, first)),
        "noise": any(vars(noise).values()),
        "odometry": scenario.odometry is not None,
    }
    named = [what for what, there in found.items() if there]
    if not named:
        return ""
    return (
        f"before it there {'was' if len(named) == 1 else 'were'} {listed(named)}. Run it without "
        "to see what the robot stands by itself."
    )


def _cut_off(recording: Recording) -> bool:
    return bool((abs(recording["torque"] - recording["torque_command"]) > _SAME).any())


def _slack(stance: Stance, controller: BalancingController) -> str:
    """Legs and contacts along which no motor feels the load."""
    straight = straight_note(stance)
    if straight:
        return straight
    weighs_wrenches = bool(controller.criterion.at(stance).wrench.any())
    if weighs_wrenches or not repetition_notes(stance):
        return ""
    remedy = f"Take {_OTHER}."
    if not missing_joints(stance):
        remedy = f"Move the posture, or take {_OTHER}."
    return (
        f"{_repeated(stance)}. {controller.criterion.name} shares the forces between them by next "
        f"to nothing. {remedy}"
    )


def _repeated(stance: Stance) -> str:
    """That contacts all but repeat each other, and the joints for lack of which they do."""
    lacking = "; ".join(missing_joints(stance))
    return "contacts that all but repeat each other" + (f": {lacking}" if lacking else "")


def _out_of_reach(recording: Recording, stance: Stance) -> str:
    """The first wrench that was asked for and that no ground gives."""
    weight, time = stance.robot.weight, recording["time"].values
    asked = recording["wrench_command"].values
    cops = recording["cop_command"].values
    found: list[tuple[int, str]] = []
    for k, contact in enumerate(stance.contacts):
        pulls = np.flatnonzero(asked[:, k, 2] < -_OUTSIDE * weight)
        if len(pulls):
            force = -asked[pulls[0], k, 2]
            found.append((int(pulls[0]), f"{contact.name} to pull with {force:.1f} N"))
        if contact.sole is None:
            continue
        margins = np.array(contact.sole.margins(cops[:, k]))
        outside = np.flatnonzero(margins < -_OUTSIDE)
        if len(outside):
            far = -margins[outside[0]] * 1e3
            words = f"{contact.name} for a centre of pressure {far:.1f} mm outside its sole"
            found.append((int(outside[0]), words))
    if not found:
        return ""
    row, words = min(found)
    return (
        f"from {time[row]:.3f} s on the controller asked {words}, which no ground gives. Give it "
        "limits (--limits cop-margin=0, limits=Limits()), within which it asks for what can be had."
    )
