"""solve_four_bar: which member of the family each of the paper's criteria picks."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from copsense.arrays import finite_number
from copsense.errors import UnknownNameError
from copsense.paper.closed_form.dimensions import FourBar
from copsense.paper.closed_form.family import FourBarSolution, leg_angle, solve_four_bar_member


@dataclass(frozen=True)
class FourBarCriterion:
    """A criterion as data: which member of the family it picks.

    Attributes:
        name: as `solve_four_bar` knows it.
        defaults: its parameters with their default values; all positive.
        share: a, from the linkage and the parameters.
        equal_hips: whether h makes both hips' torques equal; otherwise h = 0.
    """

    name: str
    defaults: Mapping[str, float] = field(hash=False)
    share: Callable[[FourBar, Mapping[str, float]], float]
    equal_hips: bool


def _wrench_share(four_bar: FourBar, parameters: Mapping[str, float]) -> float:
    """Share a = w d² / (w d² + 4) with w = 1/L², written so that no square overflows."""
    d, L = four_bar.rod_length, parameters["characteristic_length"]
    return (d / math.hypot(d, 2.0 * L)) ** 2


def _torque_share(four_bar: FourBar, parameters: Mapping[str, float]) -> float:
    """Share a = w_a / (w_a + w_h), which minimises w_h a² + w_a (1 - a)²."""
    return 1.0 / (1.0 + parameters["hip_weight"] / parameters["ankle_weight"])


_LENGTH = MappingProxyType({"characteristic_length": 1.0})
_NONE: Mapping[str, float] = MappingProxyType({})
_WEIGHTS = MappingProxyType({"hip_weight": 1.0, "ankle_weight": 1.0})

FOUR_BAR_CRITERIA: Mapping[str, FourBarCriterion] = MappingProxyType(
    {
        criterion.name: criterion
        for criterion in (
            FourBarCriterion("minimum-wrench", _LENGTH, _wrench_share, equal_hips=False),
            FourBarCriterion("minimum-torque", _NONE, lambda _, __: 0.5, equal_hips=True),
            FourBarCriterion("weighted-torque", _WEIGHTS, _torque_share, equal_hips=True),
            # f_x = 0 leaves a family; on feet at equal height the minimum-wrench tie-break then
            # picks criterion 1.
            FourBarCriterion("minimum-tangential", _LENGTH, _wrench_share, equal_hips=False),
        )
    }
)


def solve_four_bar(
    four_bar: FourBar, xi: float, criterion: str, **parameters: float
) -> FourBarSolution:
    """Solve for the equilibrium that a criterion picks.

    Args:
        four_bar: the linkage.
        xi: angle of the legs from the ground, pi/2 upright [rad].
        criterion: a name in FOUR_BAR_CRITERIA. ``"minimum-wrench"`` is [Romano2016] criterion 1,
            ``"minimum-torque"`` criterion 2, ``"minimum-tangential"`` Lemma 3 with ties broken by
            the wrench norm, ``"weighted-torque"`` weighs the squares of hip and ankle torques.
        **parameters: the criterion's own, each positive: ``characteristic_length`` [m] (default 1,
            as the paper means) divides moments in the wrench norm; ``hip_weight`` and
            ``ankle_weight`` (default 1) weigh the torques.

    Returns:
        The equilibrium.

    Raises:
        UnknownNameError: no such criterion, or the criterion has no such parameter.
        InvalidInputError: a number is out of its range, or sin(xi) = 0.
        UnloadedContactError: a foot carries no vertical force.
    """
    if not isinstance(criterion, str) or criterion not in FOUR_BAR_CRITERIA:
        raise UnknownNameError("four-bar criterion", criterion, FOUR_BAR_CRITERIA)
    chosen = FOUR_BAR_CRITERIA[criterion]
    for name in parameters:
        if name not in chosen.defaults:
            raise UnknownNameError(f"parameter of {criterion!r}", name, chosen.defaults)
    values = {
        k: finite_number(parameters.get(k, v), k, positive=True) for k, v in chosen.defaults.items()
    }
    share, xi, h = chosen.share(four_bar, values), leg_angle(xi), 0.0
    if chosen.equal_hips:
        # both hips carry a Q / 2:  h = -a kappa m g l c² / (d s)
        c, s = math.cos(xi), math.sin(xi)
        h = -share * four_bar.kappa * four_bar.weight * four_bar.leg_length * c**2
        h /= four_bar.rod_length * s
    return solve_four_bar_member(four_bar, xi, share, h)
