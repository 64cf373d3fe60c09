"""Playback: files of balance, sweep and logs as runs of postures that can be played."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from copsense.description import is_folder
from copsense.errors import InvalidInputError
from copsense.extras import require
from copsense.files import file_at
from copsense.logs import read_log
from copsense.logs.aligned_log import align_log
from copsense.logs.log_motion import put_on_base, smooth_motion, smoothing_window
from copsense.posture_run import PostureRun
from copsense.provenance import model_digest
from copsense.simulation import Recording
from copsense.stance import Stance
from copsense.sweeps import Sweep

RECORDED = ".nc"
SWEEP_SECONDS = 5.0  # that a sweep takes from end to end
_FREQUENCY = 2.0  # Hz: what is slower than this is not smoothed away
_MOST = 2000  # frames of a film


def load_run(
    path: str | Path,
    stance: Stance,
    map_file: str | Path | None = None,
    advance: Callable[[int], object] = lambda _: None,
) -> PostureRun:
    """Read a file of `copsense balance --output` or `copsense sweep --output`, or a robot's log.

    Args:
        path: netCDF of copsense's; anything else is read as a log (`copsense.logs.read_log`), its
            base where the feet put it.
        stance: the robot and the contacts it was made of, or on which the log was recorded.
        map_file: which signal of a log is what; default what its layout says.
        advance: called with the bytes of a log that are read, for a progress bar.

    Raises:
        InvalidInputError: no such file, something else, or of another robot.
        MissingExtraError: a package that its format takes is not installed.
    """
    if not (file_at(path) or is_folder(Path(path))):
        raise InvalidInputError(
            f"no file at {str(path)[:300]!r}. Give a recording of copsense balance (--output "
            "FILE.nc), a sweep (copsense sweep --output FILE.nc), or a robot's own log."
        )
    mapped = "" if map_file is None else f", {str(map_file)!r}"
    if Path(path).suffix == RECORDED:
        if map_file is not None:
            raise InvalidInputError(
                f"a mapping is of a robot's log, and {path} is a file of copsense's. Leave it out."
            )
        found = _load_recorded(path, stance)
    else:
        contacts = stance.contact_names
        log = read_log(path, map_file, robot=stance.robot, contacts=contacts, advance=advance)
        found = align_log(log, stance).run(log)
    return replace(
        found,
        source=str(path),
        python="from copsense.explore.playback import load_run\n\n"
        f"run = load_run({str(path)!r}, {{stance}}{mapped})",
    )


def _load_recorded(path: str | Path, stance: Stance) -> PostureRun:
    require("xarray", "playing a recording")
    try:
        recording = Recording.load(path)
    except InvalidInputError as error:
        try:
            sweep = Sweep.load(path)
        except InvalidInputError:
            raise error from None
        return sweep_run(sweep, stance)
    return recording_run(recording, stance)


def recording_run(recording: Recording, stance: Stance) -> PostureRun:
    """The postures of a recording in time, with the motion that their inertia is of.

    Configurations are smoothed over 50 ms for velocities and accelerations, which are left out
    after the first contact has tipped: the contacts then no longer hold.

    Args:
        recording: of a closed loop.
        stance: what it was made of.

    Raises:
        InvalidInputError: it is of another robot, or holds no posture.
    """
    _check_digest(recording, stance, "the recording")
    times, q = np.asarray(recording["time"].values, float), recording["configuration"].values
    whole = _known(q, "the recording")
    tip = math.inf if recording.tip is None else recording.tip.time
    return PostureRun(
        stance,
        "time",
        "s",
        times[whole],
        q[whole],
        np.flatnonzero(whole),
        recording["cop"].values[whole],
        *_motion(stance, times[whole], np.array(q[whole]), tip),
        "the recording",
    )


def sweep_run(sweep: Sweep, stance: Stance) -> PostureRun:
    """The postures of a sweep along its coordinate.

    Args:
        sweep: the sweep.
        stance: what it was made of.

    Raises:
        InvalidInputError: it is of another robot, or holds no posture.
    """
    _check_digest(sweep, stance, "the sweep")
    axis = str(sweep.attrs["coordinate"])
    values, q = np.asarray(sweep[axis].values, float), sweep["configuration"].values
    whole, unit = _known(q, "the sweep"), str(sweep[axis].attrs.get("units", ""))
    rows = np.flatnonzero(whole)
    return PostureRun(stance, axis, unit, values[whole], q[whole], rows, source="the sweep")


def run_seconds(run: PostureRun) -> float:
    """How long a run takes to play [s]: in time as it happened, otherwise five seconds."""
    return float(abs(run.values[-1] - run.values[0])) if run.axis == "time" else SWEEP_SECONDS


def frame_rows(run: PostureRun, rate: float = 25.0) -> tuple[list[int], float]:
    """Rows to show one after the other, evenly in what they are along, and the seconds between.

    Args:
        run: the postures.
        rate: frames a second, at most.
    """
    seconds = run_seconds(run)
    count = max(2, min(math.ceil(seconds * rate) + 1, _MOST, len(run)))
    wanted = np.linspace(run.values[0], run.values[-1], count)
    rows = [int(np.argmin(np.abs(run.values - value))) for value in wanted]
    return rows, max(seconds, 1e-3) / (count - 1)


def _check_digest(made: Recording | Sweep, stance: Stance, what: str) -> None:
    if made.attrs.get("model_digest") != model_digest(stance):
        raise InvalidInputError(
            f"{what} is of another stance: its robot is {made.attrs.get('robot')!r} "
            f"on {', '.join(str(name) for name in made['contact'].values)}, or one of them "
            "has changed since. Explore the stance that it was made of, with the same options."
        )


def _known(q: np.ndarray, what: str) -> np.ndarray:
    """Rows that hold a posture."""
    whole = np.asarray(np.isfinite(q).all(axis=1))
    if not whole.any():
        raise InvalidInputError(f"{what} holds no posture. Play another file.")
    return whole


def _motion(
    stance: Stance, times: np.ndarray, q: np.ndarray, tip: float
) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Velocities and accelerations, NaN from the tip on; None of what is too short to smooth."""
    if len(times) < 2 or stance.robot.base_nv != 6:
        return None, None
    step = float(times[-1] - times[0]) / (len(times) - 1)
    window = smoothing_window(_FREQUENCY, step)
    late = times > tip - window * step / 2
    if len(times) < window + 2 or late.all():
        return None, None
    base = q[:, :7].copy()

    def stand(rows: np.ndarray, samples: int, every: int) -> np.ndarray:
        return put_on_base(stance.robot, rows, base[::every], "", samples)

    known = np.ones(len(times), dtype=bool)
    motion = smooth_motion(stance.robot, q, window, step, stand, known)
    v, a = motion.velocities.copy(), motion.accelerations.copy()
    v[late], a[late] = np.nan, np.nan
    return v, a
