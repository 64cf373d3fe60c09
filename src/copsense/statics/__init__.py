"""Equilibrium: the wrenches and torques that a criterion chooses, within limits or without."""

from __future__ import annotations

from copsense.criterion import Criterion
from copsense.errors import InvalidInputError
from copsense.limits import Limits, optional_limits
from copsense.load_problem import LoadProblem
from copsense.stance import Stance, check_stance
from copsense.statics.constrained import (
    ActiveLimit,
    ActiveSetChange,
    ConstrainedEquilibrium,
    Rates,
    distance_to_change,
    solve_constrained,
)
from copsense.statics.equilibrium import (
    PROJECT,
    StaticEquilibrium,
    is_admissible,
    share_load,
    solve_static,
)
from copsense.statics.policy import WrenchPolicy, named_criteria, policy_name, wrench_policy
from copsense.statics.tie_breaks import TIE_BREAK, tie_break_note, with_tie_break, with_tie_breaks

__all__ = [
    "PROJECT",
    "TIE_BREAK",
    "ActiveLimit",
    "ActiveSetChange",
    "ConstrainedEquilibrium",
    "LoadProblem",
    "Rates",
    "StaticEquilibrium",
    "WrenchPolicy",
    "distance_to_change",
    "is_admissible",
    "named_criteria",
    "policy_name",
    "share_load",
    "solve_equilibrium",
    "tie_break_note",
    "with_tie_break",
    "with_tie_breaks",
    "wrench_policy",
]


def solve_equilibrium(
    stance: Stance, criterion: Criterion | WrenchPolicy, limits: Limits | None = None
) -> StaticEquilibrium:
    """The static equilibrium that a criterion chooses ([Romano2016] Eq. (7), (9), Remark 4).

    Args:
        stance: robot, configuration and contacts; in motion (`Stance.moving`) inertia is part of
            the load, and the wrenches are those of the instant.
        criterion: a `Criterion`, or a callable q -> wrenches (nc, 6) in contact axes, such as a
            controller's own.
        limits: what the wrenches and torques must respect; None for nothing. With limits the
            answer is a `ConstrainedEquilibrium`.

    Raises:
        UndeterminedWrenchError: several wrenches are equally good; the message names them.
        InfeasibleError: no wrench respects the limits.
        InvalidInputError: weights that do not fit, a policy whose wrenches do not balance gravity,
            or a policy together with limits.
    """
    check_stance(stance)
    limits = optional_limits(limits)
    if limits is None:
        return solve_static(stance, criterion)
    if not isinstance(criterion, Criterion):
        raise InvalidInputError(
            "limits apply to a Criterion; a policy q -> wrenches has to respect them itself. Leave "
            "limits out, and look at its margins."
        )
    return solve_constrained(stance, criterion, limits)
