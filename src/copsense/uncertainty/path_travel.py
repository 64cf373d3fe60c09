"""RobustTravel: how far the CoM may travel to one side where the model is off.

The path is the one that the model gives; the robot that walks it has the errors, at every posture
(`perturbation.perturbed`). With mu(s, e) the slack of the limit that is met at travel s*, the
travel follows an error e at ds*/de = -(dmu/de) / (dmu/ds), both at the posture where it is met.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from copsense.content import ShortRepr, freeze
from copsense.errors import CopsenseError
from copsense.limits import Limits
from copsense.margins import MarginTable, margin_table
from copsense.path import LateralPath
from copsense.scan import PathScan
from copsense.scan_point import ScanPoint
from copsense.statics import solve_equilibrium
from copsense.uncertainty.perturbation import perturbed, perturbed_limits
from copsense.uncertainty.source import Source
from copsense.uncertainty.source_changes import change_of, row_change

_GRAZING = 1e-9  # of a slack, in weights per metre, that does not cross its bound
_PRECISION = 1e-7  # m, of a travel with errors


@dataclass(frozen=True, eq=False, repr=False)
class RobustTravel(ShortRepr):
    """How far the CoM may go to one side before a limit is met, with errors and without.

    Attributes:
        side: +1 towards world +y, or -1.
        limit: the limit that leaves least of the worst case; None where none is met within reach.
        travel: to it, of the model as it is [m]; infinite where none is met.
        rates: d travel per unit of each source (p,).
        likely: what is left of it along the worst direction of the ellipsoid of errors, to first
            order [m].
        worst: what is left where every source is off at once, each its worst way, to first order.
        exact: the same by that very model's own path of slacks; None where it has no wrenches on
            the way.
    """

    side: int
    limit: str | None
    travel: float
    rates: Float[np.ndarray, " p"]
    likely: float
    worst: float
    exact: float | None

    def __post_init__(self) -> None:
        """Own the rates."""
        freeze(self, "rates")

    @property
    def nonlinearity(self) -> float:
        """How far the exact worst case is from its first order, as a share of what is lost."""
        lost = self.travel - self.worst
        if self.exact is None or not np.isfinite(lost) or lost <= 0:
            return 0.0
        return abs(self.exact - self.worst) / lost


def robust_travel(
    scan: PathScan,
    side: int,
    limits: Limits,
    sources: Sequence[Source],
    sigmas: float,
) -> RobustTravel:
    """What errors leave of the travel along a scan's path to one side.

    Args:
        scan: of the criterion's own wrenches along a `LateralPath`.
        side: +1 towards world +y, or -1.
        limits: what is to be met.
        sources: what may be off.
        sigmas: how many standard deviations.

    Raises:
        CopsenseError: the first posture has no wrenches.
    """
    assert isinstance(scan.path, LateralPath)
    deviations = sigmas * np.array([source.deviation for source in sources])
    found = []
    for met in scan.travel(limits, side).limits:
        if met.exact is None:
            continue
        if not met.exact:  # passed where the path begins: nothing is left to be lost
            still = np.zeros(len(sources))
            found.append(RobustTravel(side, met.name, 0.0, still, 0.0, 0.0, None))
            continue
        point = scan.at(scan.start + side * met.exact)
        rates = _rates(point, side, met.name, limits, sources)
        lost = float(np.linalg.norm(rates * deviations)), float(np.abs(rates) @ deviations)
        likely, worst = (max(met.exact - each, 0.0) for each in lost)
        found.append(RobustTravel(side, met.name, met.exact, rates, likely, worst, None))
    if not found:
        still = np.zeros(len(sources))
        return RobustTravel(side, None, np.inf, still, np.inf, np.inf, None)
    least = min(found, key=lambda each: (each.worst, each.travel))
    if not least.travel:
        return least
    errors = -np.sign(least.rates) * deviations
    exact = exact_travel(scan, side, limits, sources, errors, least.travel)
    return RobustTravel(
        side, least.limit, least.travel, least.rates, least.likely, least.worst, exact
    )


def exact_travel(
    scan: PathScan,
    side: int,
    limits: Limits,
    sources: Sequence[Source],
    errors: Float[np.ndarray, " p"],
    beyond: float,
    *,
    limit: str | None = None,
    precision: float = _PRECISION,
) -> float | None:
    """How far a model with errors goes along a scan's path before the first limit is met [m].

    Args:
        scan: of the path.
        side: +1 or -1.
        limits: what is to be met.
        sources: what is off.
        errors: by how much (p,).
        beyond: where to stop looking [m].
        limit: the only limit to look at; default whichever is met first.
        precision: of the travel [m].

    Returns:
        The travel, zero where a limit is passed at the beginning, `beyond` where none is met up to
        there; None where some posture on the way has no wrenches.
    """
    from scipy.optimize import brentq

    def least(travel: float) -> float:
        stance, _ = scan.path.at(scan.start + side * travel)
        there = perturbed(stance, sources, errors)
        found = solve_equilibrium(there, scan.criterion)
        table = margin_table(there, perturbed_limits(there, limits, sources, errors))
        slack = table.slack(found.contact_forces, found.torques)
        return float(min(s for s, n in zip(slack, table.names, strict=True) if limit in (None, n)))

    try:
        if least(0.0) <= 0:
            return 0.0
        if least(beyond) >= 0:
            return beyond
        return float(brentq(least, 0.0, beyond, xtol=precision))
    except CopsenseError:
        return None


def slack_rates(
    table: MarginTable,
    point: ScanPoint,
    limits: Limits,
    sources: Sequence[Source],
) -> Float[np.ndarray, "r p"]:
    """How the slack of every row of limits changes per unit of each source, at one posture."""
    equilibrium = point.equilibrium
    forces, torques = equilibrium.response(change_of(point.stance, sources))
    return direct_rates(
        table.slack_rates(forces[: len(point.forces)].T, torques.T).T,
        row_change(point.stance, limits, sources),
        equilibrium.forces,
    )


def direct_rates(
    rates: Float[np.ndarray, "r p"],
    rows: Float[np.ndarray, "p r c"] | None,
    forces: Float[np.ndarray, " c"],
) -> Float[np.ndarray, "r p"]:
    """Rates of slacks with what changed rows A add, -dA f."""
    return rates if rows is None else rates - np.einsum("prc,c->rp", rows, forces)


def _rates(
    point: ScanPoint, side: int, name: str, limits: Limits, sources: Sequence[Source]
) -> Float[np.ndarray, " p"]:
    table = margin_table(point.stance, limits)
    slack = table.slack(point.forces, point.torques)
    # Many rows may have one name: it is the one that is met here.
    row = min((i for i, other in enumerate(table.names) if other == name), key=lambda i: slack[i])
    along = side * table.slack_rates(point.force_rates, point.torque_rates)[row]
    by_source = slack_rates(table, point, limits, sources)[row]
    if -along <= _GRAZING * point.stance.robot.weight:
        return np.zeros(len(sources))
    return np.asarray(by_source / -along)
