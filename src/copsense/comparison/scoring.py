"""Scoring: what each trial measures, and what the statics predict for it."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace
from functools import singledispatch
from typing import Any

import numpy as np

from copsense.comparison.bisection import Bracket, bisect
from copsense.comparison.case_runner import CaseRunner
from copsense.comparison.score import Score, failed
from copsense.comparison.score_kinds import SCORES
from copsense.comparison.trials import Breaking, Falls, Lean, PushToTip, Rest, Sway
from copsense.controllers import Hold, Sine
from copsense.simulation import Motors, Noise, Push, Recording
from copsense.simulation.prediction import predict_impulse
from copsense.simulation.recording import SETTLING
from copsense.statics import solve_equilibrium

_START = 0.2  # s before a push
_AFTER = 1.0  # s to watch after a push
_ROWS = 0.1  # s between the rows of runs of which only the end is scored
_FASTEST = 0.5  # m/s of the CoM: any larger push tips a contact


def score_trial(runner: CaseRunner) -> list[Score]:
    """The scores of a case.

    Raises:
        CopsenseError: the case could not be run.
    """
    return _score(runner.case.trial, runner)


@singledispatch
def _score(trial: Any, runner: CaseRunner) -> list[Score]:
    raise TypeError(f"{trial!r} is not a trial")


@_score.register
def _lean(trial: Lean, runner: CaseRunner) -> list[Score]:
    sign = 1.0 if trial.side == "left" else -1.0
    reference, reach = runner.lean(trial.reach, trial.speed, sign)
    expected, note = runner.statics(reference)
    ramp = reference.signal
    run = runner.run(reference, ramp.duration + 0.5, record_period=_ROWS)  # type: ignore[attr-defined]
    tipped = bool(run.attrs["tip_contact"])
    tip = abs(float(run["tip_com"].sel(com_axis="y")) - float(runner.stance.com[1]))
    reason = _and(str(run.attrs["end_reason"]), note)
    row = _with_contact(Score("tip_excursion", "failed", reason=reason), run)
    if tipped:
        step = trial.speed * float(run.attrs["control_period"])
        row = _measured(row, tip, step)
    elif run.completed:
        reason = _and(f"nothing tipped up to {reach * 1e3:.1f} mm", note)
        row = replace(row, status="bound", low=reach, high=math.inf, reason=reason)
    if expected is None:
        return [row]
    return [
        replace(
            row,
            predicted=_known(expected.excursion),
            first_order=_known(expected.first_order),
            predicted_contact=expected.contact,
        )
    ]


@_score.register
def _sway(trial: Sway, runner: CaseRunner) -> list[Score]:
    reference = runner.reference(Sine(trial.amplitude, trial.frequency))
    expected, note = runner.statics(reference)
    run = runner.run(reference, trial.seconds)
    reason = _and(str(run.attrs["end_reason"]), note)
    rows = {name: Score(name, "failed", reason=reason) for name in trial.scores}
    margin = rows["smallest_margin"]
    if run.completed:
        late = run.settled
        smallest = late["margin"].min().item()
        if math.isfinite(smallest):
            margin = _measured(margin, smallest)
        else:
            reason = _and("no contact has a sole's edge", note)
            margin = replace(margin, status="none", reason=reason)
        error = (late["com"] - late["com_target"]).sel(com_axis="y").values
        torque = late["torque"].values
        y = trial.amplitude * np.sin(2 * np.pi * trial.frequency * late["time"].values)
        for name, value in (
            ("com_error", float(np.sqrt(np.mean(error**2)))),
            ("torque_norm", float(np.linalg.norm(torque, axis=1).mean())),
            ("torque_peak", float(np.abs(torque).max())),
        ):
            rows[name] = _measured(rows[name], value)
            if expected is not None and name != "com_error":
                on_path, first_order = getattr(expected, name)(y)
                rows[name] = replace(rows[name], predicted=on_path, first_order=first_order)
    elif run.attrs["tip_contact"]:  # a CoP reached the edge
        rows = {
            name: _with_contact(replace(row, status="tipped"), run) for name, row in rows.items()
        }
        margin = replace(rows["smallest_margin"], status="bound", low=-math.inf, high=0.0)
    if expected is not None:
        on_path, first_order = expected.smallest_margin(*_extent(trial))
        margin = replace(margin, predicted=_known(on_path), first_order=_known(first_order))
    return [margin, *(rows[name] for name in trial.scores[1:])]


@_score.register
def _push(trial: PushToTip, runner: CaseRunner) -> list[Score]:
    sign = 1.0 if trial.side == "left" else -1.0
    lean, _ = runner.lean(None, 5e-3, sign)
    expected, note = runner.statics(lean)
    reference = runner.reference(Hold())
    largest = trial.largest or _FASTEST * runner.stance.robot.mass
    tips: dict[float, Recording] = {}

    def survives(impulse: float) -> bool:
        force = (0.0, sign * impulse / trial.duration, 0.0)
        push = Push(force, start=_START, duration=trial.duration)
        run = runner.run(
            reference, _START + trial.duration + _AFTER, push=push, record_period=_ROWS
        )
        if not run.completed:
            tips[impulse] = run
        return run.completed

    found = bisect(survives, 0.0, largest, 2 * trial.resolution)
    row = _bracketed("tip_impulse", found, "a push of", note)
    if found.failed in tips:
        row = _with_contact(row, tips[found.failed])
    if expected is None:
        return [row]
    return [
        replace(
            row,
            predicted=_impulse(runner, expected.excursion, trial.duration),
            first_order=_impulse(runner, expected.first_order, trial.duration),
            predicted_contact=expected.contact,
        )
    ]


@_score.register
def _rest(trial: Rest, runner: CaseRunner) -> list[Score]:
    run = runner.run(runner.reference(Hold()), trial.duration)
    reason = str(run.attrs["end_reason"])
    if not run.completed:
        return failed(trial.scores, reason)
    late = run.sel(time=slice(0.8 * trial.duration, None))
    static = solve_equilibrium(runner.stance, runner.criterion, runner.limits).wrenches
    wrench = float(np.abs(late["wrench"].values - static).max()) / runner.stance.robot.weight
    off = np.abs((late["cop"] - late["cop_command"]).values)
    cop = float(np.nanmax(off)) if np.isfinite(off).any() else math.nan
    first = _measured(Score("wrench_error", "failed", predicted=0.0, reason=reason), wrench)
    if not math.isfinite(cop):
        return [first, Score("cop_error", "none", reason="no centre of pressure is commanded")]
    return [first, _measured(Score("cop_error", "failed", predicted=0.0, reason=reason), cop)]


@_score.register
def _falls(trial: Falls, runner: CaseRunner) -> list[Score]:
    from scipy.stats import binomtest

    reference, mass = runner.reference(Hold()), runner.stance.robot.mass
    noise = Noise(trial.position_noise, trial.velocity_noise)
    ends: Counter[str] = Counter()
    for repeat in range(trial.repeats):
        draw = np.random.default_rng([trial.seed, repeat])
        start, side = _START + 0.5 * draw.random(), draw.choice([-1.0, 1.0])
        force = side * trial.velocity * mass / trial.duration
        push = Push((0.0, force, 0.0), start=start, duration=trial.duration)
        run = runner.run(
            reference,
            start + trial.duration + trial.watch,
            until="fall",
            push=push,
            record_period=_ROWS,
            noise=noise,
            seed=int(draw.integers(2**31)),
        )
        ends[str(run.attrs["end_kind"])] += 1
    fell = trial.repeats - ends.pop("completed", 0)
    low, high = map(float, binomtest(fell, trial.repeats).proportion_ci(0.95, "wilson"))
    # A robot without contact diverges, mostly before its CoM is down.
    kinds = ", ".join(f"{kind} {count}" for kind, count in sorted(ends.items()))
    reason = f"{fell} of {trial.repeats} fell" + (f": {kinds}" if fell else "")
    return [
        Score(
            "fall_rate", "measured", fell / trial.repeats, low, high,
            runs=trial.repeats, reason=reason,
        )
    ]  # fmt: skip


@_score.register
def _breaking(trial: Breaking, runner: CaseRunner) -> list[Score]:
    reference = runner.reference(Sine(trial.amplitude, trial.frequency))
    values = dict(runner.case.conditions.values or {})
    motors, noise = values.get("motors", Motors()), values.get("noise", Noise())
    runs: dict[float, Recording] = {}

    def survives(value: float) -> bool:
        changes: dict[str, Any]
        if trial.parameter == "velocity_noise":
            changes = {"noise": replace(noise, velocity=value)}
        elif trial.parameter == "torque_limit":
            limit = dict.fromkeys(runner.leg_joints, value)
            changes = {"motors": replace(motors, limit=limit)}
        else:
            changes = {"motors": replace(motors, **{trial.parameter: value})}
        run = runner.run(reference, 1.0 / trial.frequency, record_period=_ROWS, **changes)
        runs[value] = run
        return run.completed

    assert trial.mild is not None
    assert trial.severe is not None
    assert trial.step is not None
    found = bisect(survives, trial.mild, trial.severe, trial.step)
    row = _bracketed(trial.scores[0], found, f"a {trial.parameter.replace('_', ' ')} of")
    if found.failed in runs:
        row = _with_contact(row, runs[found.failed])
    if trial.parameter != "torque_limit":
        return [row]
    expected, note = runner.statics(reference)
    if expected is None:
        return [replace(row, reason=_and(row.reason, note))]
    names = runner.stance.robot.torque_names
    legs = [names.index(joint) for joint in runner.leg_joints]
    y = np.linspace(-trial.amplitude, trial.amplitude, 201)
    on_path, first_order = expected.torque_peak(y, legs)
    return [replace(row, predicted=on_path, first_order=first_order)]


def _with_contact(row: Score, run: Recording) -> Score:
    """A row with the contact that tipped, lifted or slipped first in a run, and how."""
    kind = str(run.attrs["tip_kind"])
    return replace(row, contact=str(run.attrs["tip_contact"]), how=f"{kind}s" if kind else "")


def _extent(trial: Sway) -> tuple[float, float]:
    """Least and largest CoM y of the scored part of a sway, from its start [m]."""
    begin = SETTLING * trial.frequency if trial.seconds > SETTLING else 0.0
    turns = np.arange(math.ceil(2 * begin - 0.5), math.floor(2 * trial.periods - 0.5) + 1)
    at = np.concatenate([[begin, trial.periods], 0.25 + 0.5 * turns])  # periods
    y = trial.amplitude * np.sin(2 * np.pi * at)
    return float(y.min()), float(y.max())


def _bracketed(name: str, found: Bracket, what: str, note: str = "") -> Score:
    """The score that a bisection gives."""
    low, high = found.ends
    unit, larger = SCORES[name].unit, SCORES[name].larger
    measured = math.isfinite(found.survived) and math.isfinite(found.failed)
    if measured:
        reason = f"survives {what} {found.survived:.4g} {unit}, not {found.failed:.4g}"
        return Score(
            name, "measured", (low + high) / 2, low, high,
            runs=found.runs, reason=_and(reason, note),
        )  # fmt: skip
    # Nothing failed, or everything did: one end is open.
    nothing = math.isfinite(found.survived)
    reason = f"survives even {what}" if nothing else f"does not survive even {what}"
    reason += f" {low:.4g} {unit}"
    above = nothing if larger else not nothing
    low, high = (low, math.inf) if above else (-math.inf, high)
    return Score(name, "bound", low=low, high=high, runs=found.runs, reason=_and(reason, note))


def _measured(row: Score, value: float, resolution: float = 0.0) -> Score:
    """The row with its value and its resolution, at least that of its kind of score."""
    half = max(resolution, SCORES[row.score].resolution)
    return replace(row, status="measured", value=value, low=value - half, high=value + half)


def _impulse(runner: CaseRunner, excursion: float, duration: float) -> float:
    if not math.isfinite(excursion):
        return math.nan
    return predict_impulse(runner.stance, excursion, duration, runner.gains)


def _known(value: float) -> float:
    """The value, or NaN if nothing is predicted to happen."""
    return value if math.isfinite(value) else math.nan


def _and(reason: str, note: str) -> str:
    return "; ".join(filter(None, (reason, note)))
