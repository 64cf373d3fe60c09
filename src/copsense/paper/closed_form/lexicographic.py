"""minimise_in_order: objectives on the four-bar's statics, each breaking the last's ties."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from copsense.errors import InvalidInputError
from copsense.paper.closed_form.linkage import Linkage, wrench_balance

# Singular values below this part of the largest count as zero.
_RANK = 1e-9


@dataclass(frozen=True, eq=False)
class Objective:
    """Half the squared norm of `matrix @ f + offset`, f the six wrench components.

    Attributes:
        name: what is minimised.
        matrix: one row per residual.
        offset: the residuals at f = 0.
    """

    name: str
    matrix: Float[np.ndarray, "k 6"]
    offset: Float[np.ndarray, "k"]


@dataclass(frozen=True, eq=False)
class OrderedMinimum:
    """What minimising in order leaves.

    Attributes:
        wrenches: left and right foot, [f_x, f_y, m_z] [N, N m]; the smallest one where ties remain.
        freedom: dimensions of the set of minimisers after each objective.
    """

    wrenches: Float[np.ndarray, "2 3"]
    freedom: tuple[int, ...]

    def cop(self) -> Float[np.ndarray, "2"]:
        """m_z / f_y per foot [m]."""
        return np.asarray(self.wrenches[:, 2] / self.wrenches[:, 1])


def tangential_norm() -> Objective:
    """The horizontal forces [Romano2016, Remark 3]."""
    return Objective("tangential forces", np.eye(6)[[0, 3]], np.zeros(2))


def wrench_norm(characteristic_length: float = 1.0) -> Objective:
    """The wrenches, their moments divided by a length [m] (criterion 1)."""
    L = characteristic_length
    return Objective("wrenches", np.diag([1, 1, 1 / L, 1, 1, 1 / L]), np.zeros(6))


def torque_norm(linkage: Linkage, xi: float) -> Objective:
    """The joint torques, tau = G_j - J_j' f (criterion 2)."""
    return Objective("torques", -linkage.jacobian(xi)[:, 3:].T, linkage.gravity(xi)[3:])


def minimise_in_order(
    linkage: Linkage,
    xi: float,
    objectives: Sequence[Objective],
    *,
    right_foot_raised: float = 0.0,
) -> OrderedMinimum:
    """Minimise the objectives one after the other on the statics of the whole linkage.

    Args:
        linkage: the four-bar.
        xi: angle of its legs [rad].
        objectives: the first matters most; each next one only breaks ties.
        right_foot_raised: height of the right foot over the left one [m], in the balance of the
            wrenches only: no leg changes, so use it with objectives on wrenches.

    Returns:
        The minimum and how many dimensions each objective left free.

    Raises:
        InvalidInputError: no objective was given.
    """
    if not objectives:
        raise InvalidInputError("objectives is empty. Give one at least, such as wrench_norm().")
    arms = linkage.com_to_feet(xi)
    arms[1, 1] += right_foot_raised
    # Eq. (21): X f = m g e2
    X = wrench_balance(arms)
    f = np.linalg.pinv(X) @ (linkage.four_bar.weight * np.eye(3)[1])
    free = _null_space(X)
    freedom = []
    for objective in objectives:
        A = objective.matrix @ free
        f = f - free @ np.linalg.pinv(A, rcond=_RANK) @ (objective.matrix @ f + objective.offset)
        free = free @ _null_space(A)
        freedom.append(free.shape[1])
    return OrderedMinimum(f.reshape(2, 3), tuple(freedom))


def _null_space(A: Float[np.ndarray, "k n"]) -> Float[np.ndarray, "n r"]:
    """Orthonormal columns spanning what `A` sends to zero."""
    if A.shape[1] == 0:
        return np.zeros((0, 0))
    _, s, Vt = np.linalg.svd(A)
    rank = int(np.sum(s > _RANK * s[0])) if s.size and s[0] > 0 else 0
    return np.asarray(Vt[rank:].T)
