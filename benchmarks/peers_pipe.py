"""The pipe between copsense's closed loop and a controller in another process.

Needs the standard library and NumPy alone: both sides import it, each in its own environment.
Frames go to the child's standard input and come back on its standard output, one answer a request:

    kind (1 byte), length of the body (4 bytes, little-endian), body

    J  UTF-8 JSON: the first frame each way, below
    S  one state and target to answer; the answer is S
    T  any number of states, answered one after the other and timed; the answer is T
    E  UTF-8 text, from the child instead of an answer: what went wrong; it ends after that

Bodies of S and T are little-endian float64. A request is rows of `width(n)` numbers, n joints in
the order that the child named, configurations and velocities as in Pinocchio (a free-flyer, then
joints of one number each; quaternion x, y, z, w; base velocity in its own axes):

    time, q (7 + n), v (6 + n), centre of mass, its velocity and acceleration (3 each, world),
    target configuration (7 + n), target velocity (6 + n)

The answer S is: three times [s], torques (n), contact wrenches (6 per contact, contact axes, force
first; NaN where not known). The answer T is the three times of every state, a row each. They are
measured in the child, without the pipe: the whole call, targets handed over and results read; of
that, kinematics and solver; of that, the solver.

The child is sent {"urdf", "joints", "contacts", "mass", "start", ...} and answers {"joints",
"mass", "com", "versions"}: what its own model says, which the parent compares.
"""

from __future__ import annotations

import contextlib
import json
import os
import select
import struct
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any

import numpy as np

_HEAD = struct.Struct("<cI")
_SAME = 1e-9  # relative, of masses and centres of mass


class PipeError(Exception):
    """The other side has ended, or has reported that it cannot continue."""


def width(n: int) -> int:
    """Numbers in a state with its target, of n joints."""
    return 1 + 2 * (7 + n) + 2 * (6 + n) + 9


def read_frame(file: IO[bytes], wait: float | None = None) -> tuple[bytes, bytes]:
    """The next frame, kind and body; `wait` is the longest silence to accept [s]."""
    kind, length = _HEAD.unpack(_read(file, _HEAD.size, wait))
    return kind, _read(file, length, wait)


def write_frame(file: IO[bytes], kind: bytes, body: bytes) -> None:
    """Send a frame."""
    try:
        file.write(_HEAD.pack(kind, len(body)) + body)
        file.flush()
    except OSError:
        raise PipeError("it does not listen any more") from None


def _read(file: IO[bytes], size: int, wait: float | None) -> bytes:
    parts = b""
    while len(parts) < size:
        if wait is not None and not select.select([file], [], [], wait)[0]:
            raise PipeError(f"it was silent for {wait:g} s")
        part = os.read(file.fileno(), size - len(parts))
        if not part:
            raise PipeError("it ended")
        parts += part
    return parts


# --- the child's side -----------------------------------------------------------------------------


class State:
    """One row of a request, by name."""

    def __init__(self, row: np.ndarray, n: int) -> None:
        """Cut the row up."""
        ends = np.cumsum([1, 7 + n, 6 + n, 3, 3, 3, 7 + n, 6 + n])
        time_, self.q, self.v, self.com, self.com_velocity, self.com_acceleration, q, v, _ = (
            np.split(row, ends)
        )
        self.time, self.posture, self.velocity = float(time_[0]), q, v


Times = tuple[float, float, float]
Step = Callable[[State], tuple[Times, np.ndarray, np.ndarray]]


def serve(build: Callable[[dict[str, Any]], tuple[dict[str, Any], Step]]) -> None:
    """Be the child: build a controller from the first frame, then answer until the pipe closes.

    Args:
        build: what came first -> what to answer, and the controller. That takes a `State` and
            returns the three times, torques and wrenches.
    """
    requests, answers = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print must not get between the frames
    try:
        hello, step = build(json.loads(read_frame(requests)[1]))
        n = len(hello["joints"])
        write_frame(answers, b"J", json.dumps(hello).encode())
        while True:
            try:
                kind, body = read_frame(requests)
            except PipeError:
                return
            states = [State(row, n) for row in np.frombuffer(body, "<f8").reshape(-1, width(n))]
            if kind == b"T":
                times = np.array([step(state)[0] for state in states])
                write_frame(answers, b"T", times.astype("<f8").tobytes())
            else:
                seconds, torques, wrenches = step(states[0])
                answer = np.concatenate([seconds, torques, np.ravel(wrenches)])
                write_frame(answers, b"S", answer.astype("<f8").tobytes())
    except Exception as error:
        with contextlib.suppress(PipeError):
            write_frame(answers, b"E", f"{type(error).__name__}: {error}".encode())
        raise SystemExit(1) from None


# --- the parent's side ----------------------------------------------------------------------------


class PipeController:
    """A controller in another process, for `copsense.simulation.rollout`.

    Args:
        command: starts the child.
        setup: its first frame, with at least ``joints``, ``mass``, ``com`` and ``contacts``.
        name: how it is called in results.
        log: a file for what the child prints, or None.
        patience: longest silence to accept [s].
    """

    def __init__(
        self,
        command: list[str],
        setup: dict[str, Any],
        *,
        name: str,
        log: Path | None = None,
        patience: float = 60.0,
    ) -> None:
        """Start the child and compare its robot with ours."""
        self.name, self._patience = name, patience
        self.seconds: list[np.ndarray] = []
        threads = ("OPENBLAS", "OMP", "MKL")
        environment = os.environ | {f"{key}_NUM_THREADS": "1" for key in threads}
        # The child's packages are its own environment's.
        for key in ("PYTHONPATH", "PYTHONHOME"):
            environment.pop(key, None)
        self._log = (log or Path(os.devnull)).open("ab")
        self.process = subprocess.Popen(
            command,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            bufsize=0,
        )
        try:
            self.hello = json.loads(self._ask(b"J", json.dumps(setup).encode()))
            self._order = self._compare(setup)
        except BaseException:
            self.close()
            raise
        self._contacts = len(setup["contacts"])

    def _compare(self, setup: dict[str, Any]) -> np.ndarray:
        """Where the child's joints stand in ours, if both have the same robot."""
        ours, theirs = list(setup["joints"]), list(self.hello["joints"])
        if sorted(ours) != sorted(theirs) or len(set(theirs)) != len(theirs):
            odd = sorted(set(ours) ^ set(theirs)) or "one is there twice"
            raise PipeError(f"{self.name} has another robot: its joints differ ({odd})")
        pairs = {"mass": (setup["mass"], self.hello["mass"])}
        pairs |= {"centre of mass": (setup["com"], self.hello["com"])}
        for what, (mine, other) in pairs.items():
            if not np.allclose(mine, other, rtol=_SAME, atol=_SAME):
                raise PipeError(f"{self.name} has another robot: {what} {other}, ours is {mine}")
        return np.array([ours.index(joint) for joint in theirs], dtype=int)

    def _ask(self, kind: bytes, body: bytes) -> bytes:
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        try:
            write_frame(self.process.stdin, kind, body)
            answer, body = read_frame(self.process.stdout, self._patience)
        except PipeError as error:
            # Its last message is more useful than the fact that it ended.
            with contextlib.suppress(PipeError):
                answer, body = read_frame(self.process.stdout, 0.1)
                if answer == b"E":
                    raise PipeError(f"{self.name} failed: {body.decode()}") from None
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.process.wait(1.0)
            code = self.process.poll()
            raise PipeError(f"{self.name}: {error} (exit status {code})") from None
        if answer == b"E":
            raise PipeError(f"{self.name} failed: {body.decode()}")
        if answer != kind:
            raise PipeError(f"{self.name} answered {answer!r} to {kind!r}")
        return body

    def _row(self, seen: Any) -> np.ndarray:
        """An observation as a row of a request, in the child's order of joints."""
        target, at = seen.target, self._order
        joints7, joints6 = np.r_[0:7, 7 + at], np.r_[0:6, 6 + at]
        return np.concatenate(
            [
                [seen.time],
                seen.q[joints7],
                seen.v[joints6],
                target.com,
                target.com_velocity,
                target.com_acceleration,
                target.posture[joints7],
                target.velocity[joints6],
            ]
        )

    def answer(self, seen: Any) -> tuple[np.ndarray, np.ndarray]:
        """Torques (n,) in our order, and wrenches (nc, 6), NaN where not known."""
        numbers = np.frombuffer(self._ask(b"S", self._row(seen).astype("<f8").tobytes()), "<f8")
        n = len(self._order)
        if numbers.size != 3 + n + 6 * self._contacts:
            raise PipeError(f"{self.name} answered {numbers.size} numbers")
        self.seconds.append(numbers[:3].copy())
        torques = np.empty(n)
        torques[self._order] = numbers[3 : 3 + n]
        return torques, numbers[3 + n :].reshape(-1, 6).copy()

    def __call__(self, observation: Any) -> Any:
        """What `copsense.controllers.Controller` asks for."""
        from copsense.controllers import Command

        torques, wrenches = self.answer(observation)
        return Command(torques, wrenches if np.all(np.isfinite(wrenches)) else None)

    def times(self, observations: list[Any]) -> np.ndarray:
        """The three times at each of some states (N, 3) [s]."""
        rows = np.array([self._row(seen) for seen in observations])
        return np.frombuffer(self._ask(b"T", rows.astype("<f8").tobytes()), "<f8").reshape(-1, 3)

    def close(self) -> None:
        """End the child."""
        for pipe in (self.process.stdin, self.process.stdout):
            if pipe:
                with contextlib.suppress(OSError):
                    pipe.close()
        try:
            self.process.wait(1.0)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self._log.close()


def clock() -> float:
    """The clock that both sides measure with [s]."""
    return time.perf_counter()
