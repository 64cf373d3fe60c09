"""identify_log: which criterion explains a robot's own log."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from copsense.arrays import check_type, finite_number, whole_number
from copsense.contact import Contact
from copsense.design import Family
from copsense.errors import InvalidInputError
from copsense.identification.fitting import Progress
from copsense.identification.identifying import Identification, identify
from copsense.identification.measurements import Measurements
from copsense.logs.comparing import SKIPPED, align_log
from copsense.logs.log import Log
from copsense.robot import Robot
from copsense.stance import Stance

ROWS = 500  # that are evaluated at most


def identify_log(
    log: Log,
    robot: str | Path | Robot | Stance,
    families: Sequence[Family | str] | None = None,
    *,
    contacts: Sequence[str | Contact] | None = None,
    inertia: bool = True,
    skip: float = SKIPPED,
    postures: int = ROWS,
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
        progress: called with the rows evaluated.

    Raises:
        CopsenseError: as `compare_log` and `identify`.
    """
    check_type(log, Log, "a log", "Give what copsense.logs.read_log returns.")
    skip = finite_number(skip, "the beginning of a log to skip [s]")
    postures = whole_number(postures, "the number of postures of a log", least=20)
    aligned = align_log(log, robot, contacts=contacts, postures=len(log.times))
    late = log.times[aligned.rows] >= skip
    if not late.any():
        raise InvalidInputError(
            f"{log.source} is over before {skip:g} s. Skip less of its beginning."
        )
    every = -(-int(late.sum()) // postures)
    rows, motion = aligned.rows[late][::every], aligned.motion
    torques = None if aligned.torques is None else aligned.torques[late][::every]
    stances = []
    for row in rows:
        # The feet are where the joints put them, millimetres off one plane.
        here = Stance(aligned.robot, motion.configurations[row], aligned.contacts, check=False)
        if inertia:
            here = here.moving(motion.velocities[row], motion.accelerations[row])
        stances.append(here)
    measured = Measurements.of(stances, aligned.wrenches[rows], torques)
    return identify(measured, families, progress=progress)
