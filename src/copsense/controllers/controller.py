"""Controller: what a balancing law sees and returns, and how its answer is checked."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from copsense.arrays import finite_array
from copsense.controllers.target import Target
from copsense.errors import ControllerError, InvalidInputError


@dataclass(frozen=True, eq=False)
class Observation:
    """What a controller knows at one instant.

    Attributes:
        time: since the start [s].
        q: measured configuration (nq,): base position, quaternion (x, y, z, w), joints.
        v: measured velocity (nv,): the base in its own frame, then the joints.
        target: what the robot should do now.
        wrenches: measured wrench of the environment at each contact (nc, 6), contact axes, force
            first [N, Nm]; zero before the first step.
    """

    time: float
    q: Float[np.ndarray, " nq"]
    v: Float[np.ndarray, " nv"]
    target: Target
    wrenches: Float[np.ndarray, "nc 6"]


@dataclass(frozen=True, eq=False)
class Command:
    """A controller's answer, with the contact wrenches that it means to cause.

    Attributes:
        torques: joint torques (n,) in the robot's order [Nm, N].
        wrenches: the wrenches it expects at the contacts (nc, 6), contact axes, or None.
    """

    torques: Float[np.ndarray, " n"]
    wrenches: Float[np.ndarray, "nc 6"] | None = None


@runtime_checkable
class Controller(Protocol):
    """State in, torques out: any callable, a function or an object with ``__call__``."""

    def __call__(self, observation: Observation) -> Command | Float[np.ndarray, " n"]:
        """The torques to apply until the next call, alone or in a `Command`."""


def controller_name(controller: object) -> str:
    """How a controller is called in results.

    Raises:
        InvalidInputError: it cannot be called.
    """
    if not callable(controller):
        raise InvalidInputError(
            f"{controller!r} is no controller. Give a callable observation -> torques, such as "
            "BalancingController(stance, minimum_torque())."
        )
    for attribute in ("name", "__name__"):
        if isinstance(found := getattr(controller, attribute, None), str):
            return found
    return type(controller).__name__


def ask(
    controller: Controller | Callable[[Observation], object], observation: Observation, n: int
) -> Command:
    """Call a controller and check what it returns.

    Args:
        controller: the controller.
        observation: what it sees.
        n: how many torques there must be.

    Raises:
        ControllerError: it raised, or returned no finite torques (n,); the message says when.
    """
    when = f"controller {controller_name(controller)!r} at {observation.time:.3f} s"
    try:
        answer = controller(observation)
    except (Exception, SystemExit) as error:
        raise ControllerError(
            f"{when} raised {type(error).__name__}: {error}. Mend the controller at this state."
        ) from error
    torques: Any = answer.torques if isinstance(answer, Command) else answer
    wrenches = answer.wrenches if isinstance(answer, Command) else None
    try:
        # Copies: a controller may fill the same array again.
        return Command(
            _own(torques, "what it returned", (n,), "a torque per joint [Nm]"),
            None
            if wrenches is None
            else _own(
                wrenches,
                "the wrenches of the command",
                observation.wrenches.shape,
                "a row per contact, force first [N, Nm]",
            ),
        )
    except InvalidInputError as error:
        raise ControllerError(f"{when}: {error}") from None


def _own(values: Any, what: str, shape: tuple[int, ...], meaning: str) -> np.ndarray:
    """A finite array of one's own."""
    usual = isinstance(values, np.ndarray) and values.dtype == np.float64
    if usual and values.shape == shape and np.all(np.isfinite(values)):  # the quick way
        return values.copy()
    return finite_array(values, what, shape, meaning).copy()
