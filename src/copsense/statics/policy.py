"""Policy: a user's own q -> wrenches, validated and named."""

from __future__ import annotations

import reprlib
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Literal, overload

import numpy as np

from copsense.arrays import finite_array
from copsense.criterion import Criterion, check_criterion
from copsense.errors import CopsenseError, InvalidInputError, UndeterminedWrenchError
from copsense.load_problem import LoadProblem
from copsense.stance import Stance

BALANCE = 1e-6  # share of the weight by which wrenches may miss the balance

WrenchPolicy = Callable[[np.ndarray], np.ndarray]


def wrench_policy(
    torques: Callable[[np.ndarray], np.ndarray], stance: Stance, *, name: str | None = None
) -> WrenchPolicy:
    """The wrenches that a user's static torques cause, as a policy ([Romano2016] Eq. (9)).

    Args:
        torques: callable q -> joint torques (n,) that hold the robot at rest.
        stance: gives robot and contacts.
        name: how the policy is called in results; default the callable's own name.

    Raises:
        UndeterminedWrenchError: no torque can feel some wrenches (redundant contacts).
    """

    def policy(q: np.ndarray) -> np.ndarray:
        here = stance.at(q)
        if here.rank < len(here.constraints):
            raise UndeterminedWrenchError(
                "torques do not determine the wrenches here: no torque can feel "
                f"{', '.join(here.redundant_directions)}. Give a policy of wrenches instead.",
                here.redundant_directions,
            )
        balance, names = here.balance.copy(), here.robot.torque_names
        given = finite_array(torques(q), "the torques returned", (len(names),), "one per motor")
        balance[here.robot.base_nv :] -= here.robot.joint_torques(given)
        # J' f = G - B tau: consistent where the torques hold the robot, so any inverse serves.
        return here.unstack(np.linalg.lstsq(here.constraints.T, balance, rcond=None)[0])

    policy.__name__ = name or policy_name(torques)
    return policy


def policy_name(policy: object) -> str:
    """How a policy is called in results: the name of its function, or of its class.

    Raises:
        InvalidInputError: it is not a policy, for it cannot be called.
    """
    if not callable(policy):
        raise InvalidInputError(
            f"{policy!r} is neither a Criterion nor a callable q -> wrenches. Give one of them, "
            "such as criterion_named('minimum-torque')."
        )
    if getattr(policy, "__module__", None) == Criterion.__module__:
        name = getattr(policy, "__name__", "minimum_torque")
        raise InvalidInputError(
            f"{name} is a function that makes a criterion, and none itself. Call it: {name}(...)."
        )
    return str(getattr(policy, "__name__", type(policy).__name__))


@overload
def named_criteria(
    criteria: Iterable[Criterion], what: str, *, policies: Literal[False]
) -> dict[str, Criterion]: ...
@overload
def named_criteria(
    criteria: Iterable[Criterion | WrenchPolicy], what: str
) -> dict[str, Criterion | WrenchPolicy]: ...
def named_criteria(
    criteria: Any, what: str, *, policies: bool = True
) -> Mapping[str, Criterion | WrenchPolicy]:
    """Criteria by their names, in the order given.

    Args:
        criteria: criteria or policies of distinct names, at least one.
        what: how the message calls what needs them, such as ``"a sweep"``.
        policies: whether policies q -> wrenches may be among them, and there has to be one at all.

    Raises:
        InvalidInputError: not a list of criteria and policies, or two have one name.
    """
    if isinstance(criteria, Criterion) or callable(criteria):
        kind = "criterion" if isinstance(criteria, Criterion) else "policy"
        raise InvalidInputError(f"criteria is a single {kind}. Give a list of them.")
    if not isinstance(criteria, Iterable) or isinstance(criteria, str):
        raise InvalidInputError(
            f"{reprlib.repr(criteria)} is not a list of criteria. Give one, such as "
            "[minimum_wrench(1.0), minimum_torque()]."
        )
    chosen = tuple(criteria)
    for each in chosen if not policies else ():
        check_criterion(each)
    names = [c.name if isinstance(c, Criterion) else policy_name(c) for c in chosen]
    if (policies and not names) or len(set(names)) != len(names):
        raise InvalidInputError(
            f"{what} needs criteria of distinct names, got {', '.join(names) or 'none'}. Give at "
            "least one; Criterion.named(...) renames one."
        )
    return dict(zip(names, chosen, strict=True))


def policy_forces(stance: Stance, policy: WrenchPolicy) -> np.ndarray:
    """Stacked forces (m,) of a policy at a stance, rejected if they do not balance gravity."""
    what, nc, m = (
        f"the policy {policy_name(policy)!r}",
        len(stance.contacts),
        len(stance.component_index),
    )
    try:
        returned = policy(stance.q)
    except CopsenseError:
        raise
    except Exception as error:
        raise InvalidInputError(
            f"{what} raised {type(error).__name__}: {error}. Fix it at this posture, or leave the "
            "posture out."
        ) from error
    stacked = isinstance(returned, np.ndarray) and returned.ndim == 1
    wrenches = finite_array(
        returned,
        f"what {what} returned",
        (m,) if stacked else (nc, 6),
        "stacked forces" if stacked else "wrenches in contact axes, force first",
    )
    if not stacked:
        wrenches = stance.stack(wrenches)
    if stance.closures is not None:
        wrenches = _with_loop_forces(stance, wrenches)
    missing = LoadProblem.of(stance).imbalance(wrenches)
    if missing > BALANCE * stance.robot.weight:
        raise InvalidInputError(
            f"the wrenches of {what} do not balance gravity: {missing:.3g} N or Nm remain on "
            "the base. Give what the ground does to the robot, contact axes, force first."
        )
    return wrenches


def _with_loop_forces(stance: Stance, forces: np.ndarray) -> np.ndarray:
    """Contact forces with those behind them that the robot's loops need for the balance."""
    problem, m = LoadProblem.of(stance), len(forces)
    missing = problem.base_wrench - problem.base_map[:, :m] @ forces
    own = np.linalg.lstsq(problem.base_map[:, m:], missing, rcond=1e-10)[0]
    return np.concatenate([forces, own])
