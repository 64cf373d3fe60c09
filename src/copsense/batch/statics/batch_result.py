"""Batch result: equilibria and sensitivities in arrays, the posture first."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from copsense.batch.statics.limit_result import CHANGES, LimitResult, limit_arrays
from copsense.batch.statics.limit_states import IMPOSSIBLE, UNLOADED
from copsense.content import FrozenMapping, freeze
from copsense.errors import InvalidInputError
from copsense.listing import counted
from copsense.stance import Stance


@dataclass(frozen=True, eq=False)
class BatchResult:
    """Equilibria and sensitivities of N postures under nk criteria.

    A row that failed is NaN throughout, and `reasons` says why.

    Attributes:
        criteria: their names.
        contacts: names of the contacts.
        wrenches: of the environment on the robot, contact axes, force first [N, Nm].
        torques: joint torques [Nm, or N for a prismatic joint].
        cops: centres of pressure, contact axes [m].
        gradient: of the CoPs over velocities, projected on the admissible motions, as
            `CopSensitivity.gradient`.
        com_gain: d cop / d CoM, as `CopSensitivity.com_gain`; empty where not asked for.
        com_travel: first-order distance of the CoM to tipping, as `CopSensitivity.com_travel` [m];
            empty where not asked for.
        tipping_edge: index of the sole's edge that it goes to, as `CopSensitivity.tipping_edge`; -1
            where it goes to none, empty where not asked for.
        unloading_travel: first-order distance of the CoM to where a contact carries no load, as
            `CopSensitivity.unloading_travel` [m]; empty where not asked for.
        margin: signed distance of each CoP to its sole's nearest edge [m]; infinite without a sole.
        load_share: f_z / (m g) of each contact.
        com: centre of mass in the world [m].
        reasons: (posture, criterion index) -> why that row failed.
        limits: how the postures stand to their limits; None without limits.
    """

    criteria: tuple[str, ...]
    contacts: tuple[str, ...]
    wrenches: Float[np.ndarray, "N nk nc 6"]
    torques: Float[np.ndarray, "N nk n"]
    cops: Float[np.ndarray, "N nk nc 2"]
    gradient: Float[np.ndarray, "N nk nc 2 nv"]
    com_gain: Float[np.ndarray, "G nk nc 2 2"]
    com_travel: Float[np.ndarray, "G nk nc"]
    tipping_edge: Int[np.ndarray, "G nk nc"]
    unloading_travel: Float[np.ndarray, "G nk nc"]
    margin: Float[np.ndarray, "N nk nc"]
    load_share: Float[np.ndarray, "N nk nc"]
    com: Float[np.ndarray, "N 3"]
    reasons: Mapping[tuple[int, int], str] = field(default_factory=dict)
    limits: LimitResult | None = None

    def __post_init__(self) -> None:
        """Own the reasons; the arrays may be the caller's."""
        freeze(self, "reasons")

    def __len__(self) -> int:
        """Number of postures."""
        return len(self.com)

    def __repr__(self) -> str:
        """Its size, criteria and contacts."""
        failed = f", {len(self.reasons)} failed" if self.reasons else ""
        return (
            f"BatchResult({counted(len(self), 'posture')}{failed}; "
            f"criteria {', '.join(self.criteria)}; contacts {', '.join(self.contacts)})"
        )

    @property
    def nbytes(self) -> int:
        """Size of all arrays [B]."""
        return sum(array.nbytes for array in arrays_of(self).values())


GAINS = ("com_gain", "com_travel", "tipping_edge", "unloading_travel")
"""Arrays that a batch fills only where it is asked for them."""


def nothing(name: str) -> float:
    """What an array holds where there is no answer."""
    return -1 if name == "tipping_edge" else np.nan


def array_names() -> tuple[str, ...]:
    """Names of a result's arrays."""
    others = ("criteria", "contacts", "reasons", "limits")
    return tuple(f.name for f in fields(BatchResult) if f.name not in others)


def arrays_of(result: BatchResult) -> dict[str, np.ndarray]:
    """A result's arrays by name."""
    return {name: getattr(result, name) for name in array_names()}


def empty_result(
    stance: Stance, criteria: tuple[str, ...], count: int, *, gains: bool
) -> BatchResult:
    """A result of NaN rows to be filled."""
    nk, nc, nv = len(criteria), len(stance.contacts), stance.robot.model.nv
    n = len(stance.robot.torque_names)
    counted = count if gains else 0
    shapes = {
        "wrenches": (count, nk, nc, 6),
        "torques": (count, nk, n),
        "cops": (count, nk, nc, 2),
        "gradient": (count, nk, nc, 2, nv),
        "com_gain": (counted, nk, nc, 2, 2),
        "com_travel": (counted, nk, nc),
        "tipping_edge": (counted, nk, nc),
        "unloading_travel": (counted, nk, nc),
        "margin": (count, nk, nc),
        "load_share": (count, nk, nc),
        "com": (count, 3),
    }
    arrays: dict[str, Any] = {name: np.full(shape, nothing(name)) for name, shape in shapes.items()}
    return BatchResult(criteria, stance.contact_names, **arrays)


def check_out(out: object, expected: BatchResult, count: int, *, gains: bool) -> None:
    """Check that arrays can take the results of so many postures.

    Args:
        out: arrays to be filled.
        expected: what they shall be like, of no posture.
        count: of postures.
        gains: whether gains are asked for.

    Raises:
        InvalidInputError: they cannot; the message says which, and why.
    """
    remedy = f"Make it with BatchKernel.empty({count})."
    if not isinstance(out, BatchResult):
        raise InvalidInputError(f"out is of type {type(out).__name__}. {remedy}")
    for name, array in arrays_of(out).items():
        wanted = getattr(expected, name)
        shape = (count if gains or name not in GAINS else 0, *wanted.shape[1:])
        fits = array.shape == shape and array.dtype == wanted.dtype
        if not (fits and array.flags.carray):
            raise InvalidInputError(
                f"out.{name} is {array.dtype} of shape {array.shape}, or not contiguous and "
                f"writeable; the batch needs {wanted.dtype} of shape {shape}. {remedy}"
            )
    if out.criteria != expected.criteria:
        raise InvalidInputError(
            f"out holds the criteria {', '.join(out.criteria)}, the batch "
            f"{', '.join(expected.criteria)}. {remedy}"
        )
    if (out.limits is None) != (expected.limits is None):
        raise InvalidInputError(f"out is with limits, or the batch is, and not both. {remedy}")
    if out.limits is not None and expected.limits is not None:
        for name, array in limit_arrays(out.limits).items():
            wanted = getattr(expected.limits, name)
            shape = (count if gains or name not in CHANGES else 0, *wanted.shape[1:])
            fits = array.shape == shape and array.dtype == wanted.dtype
            if not (fits and array.flags.carray and out.limits.limits == expected.limits.limits):
                raise InvalidInputError(
                    f"out.limits.{name} does not fit the limits of the batch. {remedy}"
                )


def set_reasons(result: BatchResult, reasons: Mapping[tuple[int, int], str]) -> None:
    """Give a result that was filled its reasons; those of what it held before go."""
    object.__setattr__(result, "reasons", FrozenMapping(reasons))


def clear_unanswered(
    result: BatchResult, limits: LimitResult, doubtful: np.ndarray
) -> dict[tuple[int, int], str]:
    """Clear the rows that the limited kernel found to have no answer; why they have none."""
    state, contacts = limits.state, result.contacts
    without = ((state == IMPOSSIBLE) | (state == UNLOADED)) & (doubtful == 0)
    if not without.any():
        return {}
    for name, array in arrays_of(result).items():
        if name != "com" and len(array):
            array[without] = nothing(name)
    limits.margins[without & (state == IMPOSSIBLE)] = np.nan
    if len(limits.change_travel):  # at a cone's apex multipliers are not the only ones
        limits.change_travel[without], limits.change_limit[without] = np.nan, -1
    reasons: dict[tuple[int, int], str] = {}
    said: dict[int, str] = {}  # of a posture without any wrench, whatever the criterion
    for i, j in np.argwhere(without).tolist():
        if state[i, j] == IMPOSSIBLE:
            if i not in said:
                said[i] = limits.reason(i, j, contacts)
            reasons[i, j] = said[i]
        else:
            reasons[i, j] = limits.reason(i, j, contacts)
    return reasons
