"""identify_log: which criterion explains a robot's own log."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Int

from copsense.arrays import check_type, finite_number, whole_number
from copsense.blas import one_blas_thread
from copsense.contact import Contact
from copsense.design import Family, joint_groups
from copsense.errors import InvalidInputError
from copsense.identification.families import identifiable_named
from copsense.identification.fitting import Progress, fit_family
from copsense.identification.identifying import Identification, identify
from copsense.identification.measurements import Measurements
from copsense.identification.parameter_fit import Estimate
from copsense.logs.aligned_log import AlignedLog, align_log
from copsense.logs.comparing import SKIPPED
from copsense.logs.encoder_bias import biased_records, encoder_error, interval_note, some_rows
from copsense.logs.log import Log
from copsense.logs.log_motion import LogMotion
from copsense.robot import Robot
from copsense.stance import Stance

ROWS = 500  # that are evaluated at most


@one_blas_thread()
def identify_log(
    log: Log,
    robot: str | Path | Robot | Stance,
    families: Sequence[Family | str] | None = None,
    *,
    contacts: Sequence[str | Contact] | None = None,
    inertia: bool = True,
    skip: float = SKIPPED,
    postures: int = ROWS,
    encoders: float = 0.0,
    progress: Progress = lambda _: None,
) -> Identification:
    """Which criterion of some families explains a log, as ``copsense identify`` does.

    Args:
        log: what `copsense.logs.read_log` returned.
        robot: a preset's name, a URDF or MJCF, a `Robot`, or a stance with the contacts.
        families: as of `identify`.
        contacts: as of `copsense.logs.compare_log`.
        inertia: whether the recorded motion's inertia is in the loads.
        skip: the log's beginning that is left out [s].
        postures: how many rows are evaluated at most, evenly chosen.
        encoders: as of `copsense.logs.compare_log`.
        progress: called with the rows evaluated.

    Raises:
        CopsenseError: as `compare_log` and `identify`.
    """
    encoders = encoder_error(encoders)
    aligned = _aligned(log, robot, contacts)
    measured = _measurements(
        log, aligned, inertia=inertia, skip=skip, postures=postures, encoders=encoders
    )
    return replace(
        identify(measured, families, progress=progress),
        findings=aligned.findings,
        notes=(*aligned.notes, interval_note(encoders)),
    )


@one_blas_thread()
def hip_ankle_ratio(
    log: Log,
    robot: str | Path | Robot | Stance,
    *,
    contacts: Sequence[str | Contact] | None = None,
    skip: float = SKIPPED,
    encoders: float = 0.0,
) -> Estimate:
    """The torque weight of the hips in shares of the ankles' that explains a log, in motion.

    What `identify_log` finds of the family ``joints``, without its cross-validation.

    Args:
        log: as of `identify_log`, like all others.
        robot: the robot.
        contacts: its contacts.
        skip: the log's beginning that is left out [s].
        encoders: standard deviation of each encoder's constant error [rad, or m].

    Raises:
        InvalidInputError: the names of the robot's joints do not tell hips from ankles.
        CopsenseError: as `identify_log`.
    """
    measured = log_measurements(log, robot, contacts=contacts, skip=skip, encoders=encoders)
    groups = joint_groups(measured.stances[0])
    if not {"hip", "ankle"} <= set(groups):
        raise InvalidInputError(
            "the names of the joints do not tell hips from ankles: no ratio of their weights. Ask "
            "copsense identify --family joints for those of its groups."
        )
    family = identifiable_named(measured.stances[0], "joints")
    return fit_family(family, measured).estimates["hip_weight"]


def log_measurements(
    log: Log,
    robot: str | Path | Robot | Stance,
    *,
    contacts: Sequence[str | Contact] | None = None,
    inertia: bool = True,
    skip: float = SKIPPED,
    postures: int = ROWS,
    encoders: float = 0.0,
) -> Measurements:
    """The rows of a log that `identify_log` fits, for `fit_family` and `identify`.

    Args:
        log: as of `identify_log`, like all others.
        robot: the robot.
        contacts: its contacts.
        inertia: whether the recorded motion's inertia is in the loads.
        skip: the log's beginning that is left out [s].
        postures: how many rows are evaluated at most, evenly chosen.
        encoders: standard deviation of each encoder's constant error [rad, or m].

    Raises:
        CopsenseError: as `compare_log`, or nothing was measured that moves.
    """
    return _measurements(
        log,
        _aligned(log, robot, contacts),
        inertia=inertia,
        skip=skip,
        postures=postures,
        encoders=encoders,
    )


def _aligned(
    log: Log, robot: str | Path | Robot | Stance, contacts: Sequence[str | Contact] | None
) -> AlignedLog:
    check_type(log, Log, "a log", "Give what copsense.logs.read_log returns.")
    return align_log(log, robot, contacts=contacts, postures=len(log.times))


def _measurements(
    log: Log,
    aligned: AlignedLog,
    *,
    inertia: bool,
    skip: float,
    postures: int,
    encoders: float,
) -> Measurements:
    skip = finite_number(skip, "the beginning of a log to skip [s]")
    encoders = encoder_error(encoders)
    postures = whole_number(postures, "the number of postures of a log", least=20)
    late = log.times[aligned.rows] >= skip
    if not late.any():
        raise InvalidInputError(
            f"{log.source} is over before {skip:g} s. Skip less of its beginning (skip=, --skip)."
        )
    every = -(-int(late.sum()) // postures)
    rows, motion = aligned.rows[late][::every], aligned.motion
    torques = None if aligned.torques is None else aligned.torques[late][::every]
    stances = _stances(aligned, motion, rows, inertia)
    measured = Measurements.of(stances, aligned.wrenches[rows], torques)
    if encoders:
        some = some_rows(rows)
        measured = measured.with_encoders(
            some,
            (
                (
                    _stances(aligned, there, np.arange(len(some)), inertia),
                    wrenches,
                    None if torques is None else torques[some],
                )
                for there, wrenches in biased_records(log, aligned, rows[some], encoders)
            ),
        )
    return measured


def _stances(
    aligned: AlignedLog, motion: LogMotion, rows: Int[np.ndarray, " K"], inertia: bool
) -> list[Stance]:
    found = []
    for row in rows:
        # The feet are where the joints put them, millimetres off one plane.
        here = Stance(aligned.robot, motion.configurations[row], aligned.contacts, check=False)
        if inertia:
            here = here.moving(motion.velocities[row], motion.accelerations[row])
        found.append(here)
    return found
