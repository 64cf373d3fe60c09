"""Controller: what a controller receives and returns, and how its answer is validated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from copsense.arrays import finite_array, is_finite
from copsense.content import ShortRepr
from copsense.controllers.target import Target
from copsense.errors import ControllerError, CopsenseError, InvalidInputError


@dataclass(frozen=True, eq=False, repr=False)
class Observation(ShortRepr):
    """What a controller receives at one instant.

    Attributes:
        time: since the start [s].
        q: measured configuration (nq,): base position, quaternion (x, y, z, w), joints.
        v: measured velocity (nv,): the base in its own frame, then the joints.
        target: where the robot should be now, and how it should move.
        wrenches: measured wrench of the environment at each contact (nc, 6), contact axes, force
            first [N, Nm]; zero before the first step.
    """

    time: float
    q: Float[np.ndarray, " nq"]
    v: Float[np.ndarray, " nv"]
    target: Target
    wrenches: Float[np.ndarray, "nc 6"]


@dataclass(frozen=True, eq=False, repr=False)
class Command(ShortRepr):
    """A controller's torques, with the contact wrenches that they should cause.

    Attributes:
        torques: joint torques (n,) in the robot's order [Nm, N].
        wrenches: the wrenches it expects at the contacts (nc, 6), contact axes, or None.
    """

    torques: Float[np.ndarray, " n"]
    wrenches: Float[np.ndarray, "nc 6"] | None = None


@runtime_checkable
class Controller(Protocol):
    """Any callable from an observation to torques: a function or an object with ``__call__``."""

    def __call__(self, observation: Observation) -> Command | Float[np.ndarray, " n"]:
        """The torques to apply until the next call, alone or in a `Command`."""


def controller_name(controller: object) -> str:
    """What results call a controller.

    Raises:
        InvalidInputError: it is not callable.
    """
    if not callable(controller):
        raise InvalidInputError(
            f"{controller!r} is not a controller. Give a callable observation -> torques, such as "
            "BalancingController(stance, minimum_torque())."
        )
    for attribute in ("name", "__name__"):
        if isinstance(found := getattr(controller, attribute, None), str):
            return found
    return type(controller).__name__


def ask(
    controller: Controller | Callable[[Observation], object], observation: Observation, n: int
) -> Command:
    """Call a controller and validate what it returns.

    Args:
        controller: the controller.
        observation: what it receives.
        n: the number of torques.

    Raises:
        ControllerError: it raised, or did not return n finite torques; the message says when.
    """
    try:
        answer = controller(observation)
    except CopsenseError as error:  # which says itself what to do
        raise ControllerError(
            f"{_when(controller, observation)} found no torques ({type(error).__name__}): {error}"
        ) from error
    except (Exception, SystemExit) as error:
        raise ControllerError(
            f"{_when(controller, observation)} raised {type(error).__name__}: "
            f"{str(error).rstrip('.')}. Fix the controller for this state."
        ) from error
    torques: Any = answer.torques if isinstance(answer, Command) else answer
    wrenches = answer.wrenches if isinstance(answer, Command) else None
    try:
        # Copies: a controller may reuse its arrays.
        return Command(
            _copied(torques, "what it returned", (n,), "a torque per joint [Nm]"),
            None
            if wrenches is None
            else _copied(
                wrenches,
                "the wrenches of the command",
                observation.wrenches.shape,
                "a row per contact, force first [N, Nm]",
            ),
        )
    except InvalidInputError as error:
        raise ControllerError(f"{_when(controller, observation)}: {error}") from None


def _when(controller: object, observation: Observation) -> str:
    return f"controller {controller_name(controller)!r} at {observation.time:.3f} s"


def _copied(values: Any, what: str, shape: tuple[int, ...], meaning: str) -> np.ndarray:
    """A copy of a finite array."""
    usual = isinstance(values, np.ndarray) and values.dtype == np.float64
    if usual and values.shape == shape and is_finite(values):  # the fast path
        return values.copy()
    return finite_array(values, what, shape, meaning).copy()
