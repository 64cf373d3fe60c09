"""Equilibrium: the wrenches and torques that a criterion chooses, within limits or without."""

from __future__ import annotations

from copsense.criterion import Criterion
from copsense.equilibrium.constrained import (
    ActiveLimit,
    ConstrainedEquilibrium,
    Rates,
    solve_constrained,
)
from copsense.equilibrium.law import WrenchLaw, law_name, wrench_law
from copsense.equilibrium.static import PROJECT, StaticEquilibrium, is_admissible, solve_static
from copsense.errors import InvalidInputError
from copsense.limits import Limits
from copsense.stance import Stance

__all__ = [
    "PROJECT",
    "ActiveLimit",
    "ConstrainedEquilibrium",
    "Rates",
    "StaticEquilibrium",
    "WrenchLaw",
    "is_admissible",
    "law_name",
    "solve_equilibrium",
    "wrench_law",
]


def solve_equilibrium(
    stance: Stance, criterion: Criterion | WrenchLaw, limits: Limits | None = None
) -> StaticEquilibrium:
    """The static equilibrium that a criterion chooses ([Romano2016] Eq. (7), (9), Remark 4).

    Args:
        stance: robot, configuration and contacts.
        criterion: a `Criterion`, or a callable q -> wrenches (nc, 6) in contact axes, such as a
            controller's own.
        limits: what the wrenches and torques must respect; None for nothing. With limits the
            answer is a `ConstrainedEquilibrium`.

    Raises:
        UndeterminedWrenchError: several wrenches are equally good; the message names them.
        InfeasibleError: no wrench respects the limits.
        InvalidInputError: weights that do not fit, a law whose wrenches do not balance gravity, or
            a law together with limits.
    """
    if limits is None or not limits.any:
        return solve_static(stance, criterion)
    if not isinstance(criterion, Criterion):
        raise InvalidInputError(
            "limits apply to a Criterion; a law q -> wrenches has to respect them itself. Leave "
            "limits out, and look at its margins."
        )
    return solve_constrained(stance, criterion, limits)
