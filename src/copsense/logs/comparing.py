"""compare_log: a log beside every criterion at the recorded postures."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Float

from copsense.arrays import check_type, finite_number, whole_number
from copsense.blas import one_blas_thread
from copsense.contact import Contact
from copsense.cop import resultant, wrench_cops
from copsense.criterion import Criterion, minimum_torque, minimum_wrench
from copsense.logs.aligned_log import POSTURES, AlignedLog, align_log
from copsense.logs.encoder_bias import biased_records, encoder_error, interval_note, some_rows
from copsense.logs.finding import Finding
from copsense.logs.log import Log
from copsense.logs.log_audit import audit_com, audit_middle, audit_slope
from copsense.logs.log_comparison import MEASURED, LogComparison
from copsense.logs.log_motion import LogMotion, com_rows
from copsense.logs.log_slopes import Slopes, com_travel, log_slopes
from copsense.logs.log_statics import log_statics
from copsense.logs.sway_fit import LEAST, STILL, SlopeEstimate, Sway, find_sway
from copsense.robot import Robot
from copsense.stance import Stance
from copsense.statics import named_criteria

SKIPPED = 3.0  # s at the beginning that are left out of the slopes


@one_blas_thread()
def compare_log(
    log: Log,
    robot: str | Path | Robot | Stance,
    criteria: Sequence[Criterion] | None = None,
    *,
    contacts: Sequence[str | Contact] | None = None,
    base: Literal["feet", "recorded"] = "feet",
    skip: float = SKIPPED,
    postures: int = POSTURES,
    encoders: float = 0.0,
    advance: Callable[[int], object] = lambda _: None,
) -> LogComparison:
    """What a log measured beside what every criterion says at its postures.

    The base stands on the first contact (``"feet"``), or is where the log has it: encoders know
    where one foot is from the other to a millimetre, while a base by motion capture is often tilted
    by a degree. Joints that the log has not are locked at zero.

    Args:
        log: what `read_log` returned.
        robot: a preset's name, a URDF, MJCF or SDF, a `Robot`, or a stance with the contacts.
        criteria: default `minimum_torque()` and `minimum_wrench(1.0)`.
        contacts: default those of the stance or preset, or the frames that the sensors serve.
        base: what puts the base in place.
        skip: the log's beginning that is left out of the slopes [s].
        postures: how many rows are evaluated at most, evenly chosen.
        encoders: standard deviation of each encoder's constant error [rad, or m], which the
            intervals then have in them; 0 leaves it out (`copsense.logs.encoder_bias`).
        advance: called with the number of postures done, for a progress bar.

    Raises:
        UnknownNameError: the robot lacks a joint, or the frame of a sensor.
        InvalidInputError: positions in degrees, a foot without a sensor, no row on which all feet
            are loaded, or no base recorded.
    """
    check_type(log, Log, "a log", "Give what copsense.logs.read_log returns.")
    skip = finite_number(skip, "the beginning of a log to skip [s]")
    postures = whole_number(postures, "the number of postures of a log", least=LEAST)
    encoders = encoder_error(encoders)
    usual = (minimum_torque(), minimum_wrench(1.0)) if criteria is None else criteria
    chosen = tuple(named_criteria(usual, "the comparison of a log", policies=False).values())
    aligned = align_log(log, robot, contacts=contacts, base=base, postures=postures)
    model, feet, motion, rows = aligned.robot, aligned.contacts, aligned.motion, aligned.rows
    findings, notes, wrenches = [*aligned.findings], [*aligned.notes], aligned.wrenches
    statics = log_statics(model, feet, chosen, motion, rows, advance)
    com = com_rows(model, motion.configurations[rows])
    run = aligned.run(log)
    placed = run.stance
    travel, distance = com_travel(placed, com)
    measured, times, window = wrenches[rows], log.times[rows], motion.window
    late = times >= skip
    sway = _sway(times[late], travel[late], skip, notes)
    slopes: Slopes = {}
    if sway is not None:
        sources = {MEASURED: measured} | {s.name: s.wrenches for s in statics}
        late_sources = {name: of[late] for name, of in sources.items()}
        slopes = log_slopes(sway, times[late], travel[late], distance, late_sources, feet)
        if encoders:
            slopes = _widened(slopes, _by_encoders(aligned, log, chosen, sway, skip, encoders))
    findings += _audit_slopes(feet, slopes)
    findings += audit_com(com[:, :2], _total_cop(placed, measured))
    notes.append(
        f"joints smoothed by a Savitzky-Golay filter of {window:.3g} s (cubic); accelerations are "
        "its derivative of the velocity"
    )
    notes.append(interval_note(encoders))
    return LogComparison(
        log,
        model.name,
        model.weight,
        tuple(c.name for c in feet),
        model.torque_names,
        base,
        window,
        times,
        com,
        travel,
        distance,
        measured,
        aligned.torques,
        statics,
        sway,
        slopes,
        skip,
        encoders,
        tuple(findings),
        tuple(notes),
        run,
    )


def _total_cop(stance: Stance, wrenches: Float[np.ndarray, "M nc 6"]) -> Float[np.ndarray, "M 2"]:
    """Total centre of pressure on the ground, z = 0; NaN where moments were not measured."""
    world = np.array([stance.in_world_axes(row) for row in wrenches])
    return wrench_cops(np.concatenate(resultant(stance, world), axis=-1))


def _sway(
    times: Float[np.ndarray, " M"], travel: Float[np.ndarray, " M"], skip: float, notes: list[str]
) -> Sway | None:
    """How the centre of mass moved; None, with a note, where there is nothing to fit."""
    if len(times) < LEAST:
        notes.append(f"fewer than {LEAST} rows after {skip:g} s: no slopes")
        return None
    if np.ptp(travel) < STILL:
        notes.append("the centre of mass moves less than 1 mm: no slopes")
        return None
    return find_sway(times, travel)


def _by_encoders(
    aligned: AlignedLog,
    log: Log,
    criteria: Sequence[Criterion],
    sway: Sway,
    skip: float,
    bias: float,
) -> dict[tuple[str, str], float]:
    """Output and source -> standard deviation of the slope by the encoders' constant errors."""
    late = aligned.rows[log.times[aligned.rows] >= skip]
    rows = late[some_rows(late)]
    robot, feet = aligned.robot, aligned.contacts

    def slopes(motion: LogMotion, measured: Float[np.ndarray, "K nc 6"]) -> Slopes:
        every, q = np.arange(len(rows)), motion.configurations
        statics = log_statics(robot, feet, criteria, motion, every, lambda _: None)
        placed = Stance(robot, q[len(q) // 2], tuple(feet), check=False)
        travel, distance = com_travel(placed, com_rows(robot, q))
        sources = {MEASURED: measured} | {s.name: s.wrenches for s in statics}
        return log_slopes(sway, log.times[rows], travel, distance, sources, feet)

    (unbiased,) = (slopes(*record) for record in biased_records(log, aligned, rows, 0.0))
    squares: dict[tuple[str, str], float] = {}
    for record in biased_records(log, aligned, rows, bias):
        for output, of in slopes(*record).items():
            for source, slope in of.items():
                change = slope.value - unbiased[output][source].value
                squares[output, source] = squares.get((output, source), 0.0) + change**2
    return {key: float(np.sqrt(square)) for key, square in squares.items()}


def _widened(slopes: Slopes, spread: Mapping[tuple[str, str], float]) -> Slopes:
    return {
        output: {source: slope.widened(spread[output, source]) for source, slope in of.items()}
        for output, of in slopes.items()
    }


def _audit_slopes(
    contacts: Sequence[Contact], slopes: dict[str, dict[str, SlopeEstimate]]
) -> list[Finding]:
    load = slopes.get("load", {})
    if MEASURED not in load:
        return []
    names, measured = [c.name for c in contacts], load[MEASURED]
    others = {name: s for name, s in load.items() if name != MEASURED}
    middles = {name: s.middle for name, s in others.items()}
    return [
        *audit_middle(names, measured.middle, middles),
        *audit_slope(names, measured, list(others.values())),
    ]
