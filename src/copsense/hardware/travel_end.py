"""TravelEnd: where the CoM's travel to one side ends, and how that place follows the hardware.

With mu(s, p) the slack of the limit that is met at travel s*, of the robot with hardware p on its
own path of postures, ds*/dp = -(dmu/dp) / (dmu/ds) at the posture where it is met.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from copsense.content import ShortRepr, freeze
from copsense.errors import CopsenseError
from copsense.hardware.parameter import Parameter
from copsense.hardware.stance_rates import HardwareRates, sole_rates
from copsense.limits import Limits, limit_rows
from copsense.margins import MarginTable, margin_table
from copsense.quadratic import Quadratic
from copsense.scan import PathScan
from copsense.scan_point import ScanPoint, rates_or_nan
from copsense.stance import Stance
from copsense.statics.kkt import Kkt

SIDES = {"+y": 1, "-y": -1}
TIED = 1e-7  # m: limits and sides met nearer to each other than this are met together
_SOON = 5e-3  # m: limits met so soon after the first are looked at too
_GRAZING = 1e-9  # of a slack, in weights per metre, that does not cross its bound


@dataclass(frozen=True)
class TravelEnd:
    """Where the travel to one side ends.

    Attributes:
        side: ``"+y"`` or ``"-y"``, in the world.
        travel: of the CoM until a limit is met [m]; infinite where none is met.
        limit: its name; None where none is met.
        where: the contact or joint that it is of; empty where none is met.
        reach: how far postures were found [m]: less than asked where the limbs end.
    """

    side: str
    travel: float
    limit: str | None
    where: str
    reach: float


@dataclass(frozen=True, eq=False, repr=False)
class EndRates(ShortRepr):
    """How a travel follows parameters: of the limit that ends it, and of others met soon after.

    Attributes:
        limits: their names (k,), the first being that of the end; none where nothing moves it.
        gaps: how much farther each is met (k,) [m]; of those beyond the first to first order.
        rates: d travel to each per unit of each parameter (k, p).
    """

    limits: tuple[str, ...]
    gaps: Float[np.ndarray, " k"]
    rates: Float[np.ndarray, "k p"]

    def __post_init__(self) -> None:
        """Own the arrays."""
        freeze(self, "gaps", "rates")

    @property
    def rise(self) -> Float[np.ndarray, " p"]:
        """d travel per unit more of each parameter (p,), exact."""
        return self._tied.min(axis=0) if len(self.gaps) else np.zeros(self.rates.shape[1])

    @property
    def fall(self) -> Float[np.ndarray, " p"]:
        """d travel per unit less (p,), exact: the negative of `rise` but where limits tie."""
        return -self._tied.max(axis=0) if len(self.gaps) else np.zeros(self.rates.shape[1])

    def gained(self, amounts: Float[np.ndarray, " p"]) -> Float[np.ndarray, " p"]:
        """What each parameter's own amount more gains of travel (p,), to first order [m].

        Whichever of the limits is then met first ends it.
        """
        if not len(self.gaps):
            return np.zeros(len(amounts))
        return np.asarray((self.gaps[:, None] + self.rates * amounts).min(axis=0))

    @property
    def _tied(self) -> Float[np.ndarray, "k p"]:
        return self.rates[self.gaps <= TIED]


def travel_end(scan: PathScan, side: str, limits: Limits, *, limit: str | None = None) -> TravelEnd:
    """The first limit that the CoM meets on the way to one side, to rounding.

    Args:
        scan: of the criterion's own wrenches along a `LateralPath`.
        side: of `SIDES`.
        limits: what is to be met.
        limit: name of the only one to look at; default whichever is met first.

    Raises:
        CopsenseError: the first posture has no wrenches.
    """
    way, table = SIDES[side], margin_table(scan.begin.stance, limits)
    rows = [i for i, name in enumerate(table.names) if limit in (None, name)]

    def measure(point: ScanPoint) -> tuple[np.ndarray, np.ndarray]:
        slack, rates = (
            table.slack(point.forces, point.torques),
            table.slack_rates(*rates_or_nan(point)),
        )
        return slack[rows], rates[rows]

    try:
        found = scan.first(measure, way)
    except CopsenseError:  # no posture, or no wrenches, further on
        if limit is not None:
            raise
        travel = scan.travel(limits, way)
        first = travel.first
        if first is None or first.exact is None:
            return TravelEnd(side, np.inf, None, "", travel.reach)
        return TravelEnd(side, first.exact, first.name, first.margin.where, travel.reach)
    if found is None:
        far = float(way * (np.asarray(scan.path.values)[-1 if way > 0 else 0] - scan.start))
        return TravelEnd(side, np.inf, None, "", far)
    travelled, row = found.travel, found.row
    if travelled:  # to rounding, by a step of Newton
        slack, rates = (each[row] for each in measure(scan.at(scan.start + way * travelled)))
        if way * rates < 0:
            travelled = max(travelled - float(slack / (way * rates)), 0.0)
    name, where = table.names[rows[row]], table.where[rows[row]]
    return TravelEnd(side, travelled, name, where, travelled)


def end_rates(scan: PathScan, end: TravelEnd, limits: Limits, rates: HardwareRates) -> EndRates:
    """How the travel to one side follows each parameter.

    Args:
        scan: as for `travel_end`, along the path through the home of `rates`.
        end: of `travel_end`; one that is beyond a limit already, or meets none, does not move.
        limits: what is met there.
        rates: of the parameters.
    """
    still = EndRates((), np.zeros(0), np.zeros((0, len(rates.parameters))))
    if end.limit is None or not end.travel:
        return still
    way = SIDES[end.side]
    point = scan.at(scan.start + way * end.travel)
    table = margin_table(point.stance, limits)
    slack = table.slack(point.forces, point.torques)
    along = way * table.slack_rates(point.force_rates, point.torque_rates)
    closing = -along > _GRAZING * point.stance.robot.weight
    gaps = np.where(closing, slack / np.where(closing, -along, 1.0), np.inf)
    # The limit that is met has a gap of rounding, either way.
    met = np.flatnonzero(np.abs(gaps) <= _SOON)
    if not len(met):
        return still
    met = met[np.argsort(gaps[met], kind="stable")]
    moved = slack_rates(table, point, limits, rates)[met] / -along[met, None]
    names = tuple(table.names[i] for i in met)
    return EndRates(names, np.maximum(gaps[met] - gaps[met[0]], 0.0), moved)


def slack_rates(
    table: MarginTable, point: ScanPoint, limits: Limits, rates: HardwareRates
) -> Float[np.ndarray, "r p"]:
    """How the slack of every row of limits changes per unit of each parameter, the CoM held."""
    equilibrium, stance = point.equilibrium, point.stance
    forces, torques = equilibrium.response(rates.change_at(stance))
    forces = forces[: len(point.forces)]
    by_servos = _servo_rates(point, rates.parameters)
    found = table.slack_rates((forces + by_servos[0]).T, (torques + by_servos[1]).T).T
    for i, parameter in enumerate(rates.parameters):
        for contact, rows, change in _sole_rows(stance, limits, parameter):
            own = stance.unstack(point.forces)[contact]
            found[rows, i] += change @ own
    return found


def _sole_rows(
    stance: Stance, limits: Limits, parameter: Parameter
) -> list[tuple[int, np.ndarray, np.ndarray]]:
    """Index of each contact whose sole is stretched, its rows, and how they change (e, 6)."""
    found = []
    rows = limit_rows(stance, limits)
    for k, contact in enumerate(stance.contacts):
        stretch = parameter.alteration.soles.get(contact.name)
        if stretch is None:
            continue
        own = [
            i
            for i, (owner, kind) in enumerate(zip(rows.contacts, rows.kinds, strict=True))
            if owner == k and kind == "cop"
        ]
        if own:
            found.append((k, np.array(own), sole_rates(contact, stretch)))
    return found


def _servo_rates(
    point: ScanPoint, parameters: tuple[Parameter, ...]
) -> tuple[Float[np.ndarray, "m p"], Float[np.ndarray, "n p"]]:
    """How forces and torques follow servos that are stiffer: weights 1/K change by -1/K^2."""
    equilibrium, stance = point.equilibrium, point.stance
    forces = np.zeros((len(point.forces), len(parameters)))
    torques = np.zeros((len(point.torques), len(parameters)))
    if not any(p.alteration.servos for p in parameters):
        return forces, torques
    assert not callable(equilibrium.criterion)
    system = Kkt(stance, equilibrium.criterion)
    weights = np.diag(system.quadratic.torque)
    names = stance.robot.torque_names
    for i, parameter in enumerate(parameters):
        if not parameter.alteration.servos:
            continue
        change = np.zeros(len(names))
        for name in parameter.alteration.servos:
            at = names.index(name)
            change[at] = -(weights[at] ** 2)
        m = len(equilibrium.forces)
        softer = Quadratic(np.diag(change), 0.0, np.zeros((m, m)), np.zeros(m))
        df, dt = system.weight_derivative(equilibrium.forces, equilibrium.multipliers, softer)
        forces[:, i], torques[:, i] = df[: len(forces)], dt
    return forces, torques
