"""propagate_uncertainty: what a model's errors make of wrenches, CoPs, margins and travels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from jaxtyping import Float

from copsense.arrays import array_property, check_type, whole_number
from copsense.blas import one_blas_thread
from copsense.content import freeze
from copsense.cop import contact_cops
from copsense.criterion import Criterion, check_criterion
from copsense.errors import CopsenseError, InvalidInputError
from copsense.limits import Limits, optional_limits
from copsense.listing import listed
from copsense.margins import LimitMargin, margin_table
from copsense.path import LateralPath
from copsense.scan import PathScan
from copsense.sensitivity import cop_rates
from copsense.stance import Stance, check_stance
from copsense.statics import StaticEquilibrium, WrenchPolicy, solve_equilibrium
from copsense.uncertainty.path_travel import RobustTravel, direct_rates, robust_travel
from copsense.uncertainty.perturbation import perturbed, perturbed_limits
from copsense.uncertainty.source import Source
from copsense.uncertainty.source_changes import change_of, check_uncertain, row_change
from copsense.uncertainty.source_list import sources_of
from copsense.uncertainty.uncertainty_tables import Uncertainty

# What ends a travel where no limits are given: a contact tips or carries no load.
PLANTED = Limits(friction=None, torsion=None)
SIDES = {"+y": 1, "-y": -1}
STRAIGHT = 0.05  # of a spread, that what is not linear may add before it is said
SAMPLES = 50
_FAR = 5.0  # standard deviations from carrying no load, from which the tail is not felt
_STILL = 1e-9  # m, of a centre of pressure that does not move
_LISTED = 4  # contacts that a representation lists


@dataclass(frozen=True, eq=False, repr=False)
class Spread:
    """What errors make of one criterion at one posture.

    The errors are independent, each with its standard deviation. Everything is exact to first
    order; `nonlinearity` and `RobustTravel.exact` say how far that carries.

    Attributes:
        equilibrium: of the model as it is.
        sources: what may be off (p in all).
        sigmas: how many standard deviations ellipses and worst cases go.
        cop: centres of pressure (nc, 2), contact axes [m].
        force_rates: d forces per unit of each source (m, p), of the contacts, contact axes.
        torque_rates: d torques (n, p).
        cop_rates: d cop (nc, 2, p).
        margins: of each contact or joint to each kind of limit, by the model.
        margin_rates: of these margins, each of its nearest row (g, p).
        worst_margins: what is left of each where every source is off its worst way (g,); of all
            its rows the least.
        likely_margins: the same in the worst direction of the ellipsoid of errors (g,).
        travels: side, ``"+y"`` or ``"-y"`` -> what is left of the travel.
        nonlinearity: of each contact's centre of pressure (nc,), by which share samples of whole
            models lie farther out than to first order, or less far, along that axis of the ellipse
            where it is more; NaN without samples.
        lost_samples: how many samples had no answer, as a contact that carries no load.
    """

    equilibrium: StaticEquilibrium
    sources: tuple[Source, ...]
    sigmas: float
    cop: Float[np.ndarray, "nc 2"]
    force_rates: Float[np.ndarray, "m p"]
    torque_rates: Float[np.ndarray, "n p"]
    cop_rates: Float[np.ndarray, "nc 2 p"]
    margins: tuple[LimitMargin, ...]
    margin_rates: Float[np.ndarray, "g p"]
    worst_margins: Float[np.ndarray, " g"]
    likely_margins: Float[np.ndarray, " g"]
    travels: dict[str, RobustTravel]
    nonlinearity: Float[np.ndarray, " nc"]
    lost_samples: int

    def __post_init__(self) -> None:
        """Own the arrays."""
        freeze(
            self,
            "cop",
            "force_rates",
            "torque_rates",
            "cop_rates",
            "margin_rates",
            "worst_margins",
            "likely_margins",
            "travels",
            "nonlinearity",
        )

    def __repr__(self) -> str:
        """How far each contact's CoP spreads, and what is left of the travels."""
        names = self.equilibrium.stance.contact_names
        cops = ", ".join(
            f"{name} {axes[0] * 1e3:.1f} x {axes[1] * 1e3:.1f} mm"
            for name, axes in zip(names[:_LISTED], self.axes[:_LISTED], strict=True)
        )
        more = f" and {len(names) - _LISTED} more" if len(names) > _LISTED else ""
        ways = "".join(
            f"; to {side} {t.travel * 1e3:.1f} mm, {t.worst * 1e3:.1f} at worst"
            for side, t in self.travels.items()
            if np.isfinite(t.travel)
        )
        return f"Spread({len(self.sources)} sources: {cops}{more}{ways})"

    @property
    def deviations(self) -> Float[np.ndarray, " p"]:
        """Standard deviation of each source (p,), each in its unit."""
        return np.array([source.deviation for source in self.sources])

    @array_property
    def covariance(self) -> Float[np.ndarray, "nc 2 2"]:
        """Covariance of each contact's centre of pressure, contact axes [m^2]."""
        spread = self.cop_rates * self.deviations
        return np.asarray(spread @ spread.transpose(0, 2, 1))

    @array_property
    def axes(self) -> Float[np.ndarray, "nc 2"]:
        """Half axes of each ellipse, the longer first, `sigmas` standard deviations [m]."""
        values = np.linalg.eigvalsh(self.covariance)[:, ::-1]
        return self.sigmas * np.sqrt(np.maximum(values, 0.0))

    @array_property
    def headings(self) -> Float[np.ndarray, " nc"]:
        """Direction of each ellipse's longer half axis, from the contact's x to its y [rad].

        Between -pi/2 and pi/2.
        """
        vectors = np.linalg.eigh(self.covariance)[1][:, :, 1]
        ahead = np.where(vectors[:, :1] < 0, -vectors, vectors)
        return np.arctan2(ahead[:, 1], ahead[:, 0])

    @array_property
    def outlines(self) -> Float[np.ndarray, "nc 64 2"]:
        """Points round each ellipse, contact axes [m]."""
        angle = np.linspace(0.0, 2 * np.pi, 64)
        circle = np.array([np.cos(angle), np.sin(angle)])
        values, vectors = np.linalg.eigh(self.covariance)
        root = vectors * np.sqrt(np.maximum(values, 0.0))[:, None, :]
        return self.cop[:, None, :] + self.sigmas * (root @ circle).transpose(0, 2, 1)

    @array_property
    def worst_outlines(self) -> Float[np.ndarray, "nc k 2"]:
        """Corners of where each centre of pressure can be, every source off by `sigmas` at most.

        Contact axes [m]; to first order a polygon with two edges along what each source does.
        """
        edges = self.sigmas * self.deviations[:, None] * self.cop_rates.transpose(0, 2, 1)
        edges = np.where((edges[..., 1] < 0)[..., None], -edges, edges)  # all to one side
        order = np.argsort(np.arctan2(edges[..., 1], edges[..., 0]), axis=1)
        edges = np.take_along_axis(edges, order[..., None], axis=1)
        ends = np.cumsum(2 * edges, axis=1) - edges.sum(axis=1, keepdims=True)
        return self.cop[:, None, :] + np.concatenate([ends, -ends], axis=1)

    @property
    def shares(self) -> dict[str, dict[str, float]]:
        """Contact -> group of sources -> its share of the variance of the centre of pressure.

        Of both axes together; the largest first. Empty where nothing moves it.
        """
        return {
            name: self._shared(self.cop_rates[k])
            for k, name in enumerate(self.equilibrium.stance.contact_names)
        }

    def strongest(self, contact: str, most: int = 3) -> dict[str, float]:
        """The sources that make most of the variance of a contact's centre of pressure.

        Args:
            contact: its name.
            most: how many.

        Returns:
            Name of a source -> its share, the largest first.
        """
        k = self.equilibrium.stance.contact_names.index(contact)
        part = ((self.cop_rates[k] * self.deviations) ** 2).sum(axis=0)
        total = float(part.sum())
        if not total > 0:
            return {}
        return {self.sources[i].name: float(part[i]) / total for i in np.argsort(-part)[:most]}

    def travel_shares(self, side: str) -> dict[str, float]:
        """Group of sources -> its share of the variance of the travel to one side."""
        return self._shared(self.travels[side].rates[None])

    @property
    def may_unload(self) -> tuple[str, ...]:
        """Contacts whose normal force is within five standard deviations of none.

        Their centre of pressure is a quotient by what may be zero.
        """
        stance = self.equilibrium.stance
        normal = self.equilibrium.wrenches[:, 2]
        spread = np.linalg.norm(stance.unstack(self.force_rates)[:, 2] * self.deviations, axis=1)
        near = zip(stance.contact_names, normal, spread, strict=True)
        return tuple(name for name, force, size in near if force < _FAR * size)

    @property
    def notes(self) -> tuple[str, ...]:
        """Where the first order does not carry, a sentence each."""
        found = []
        names = self.equilibrium.stance.contact_names
        bent = [n for n, x in zip(names, self.nonlinearity, strict=True) if x > STRAIGHT]
        if bent:
            worst = float(np.nanmax(self.nonlinearity))
            found.append(
                f"the ellipses of {listed(bent)} hold to first order only: sampled models spread "
                f"by {worst:.0%} more or less. For errors so large sample more of them "
                "(copsense.uncertainty.sample_models)."
            )
        if self.may_unload:
            found.append(
                f"{listed(self.may_unload)} may carry no load within {_FAR:g} deviations: "
                "a centre of pressure there has no finite spread, whatever the ellipse."
            )
        if self.lost_samples:
            found.append(
                f"{self.lost_samples} of the sampled models have no answer: joints cannot follow "
                "the contacts, a contact carries no load, or no wrench meets the limits."
            )
        for side, each in self.travels.items():
            if each.nonlinearity > STRAIGHT:
                found.append(
                    f"at worst {each.worst * 1e3:.1f} mm of the travel to {side} are left to first "
                    f"order, {each.exact * 1e3:.1f} mm exactly."  # type: ignore[operator]
                )
        return tuple(found)

    def to_dict(self) -> dict[str, Any]:
        """Plain data, infinities kept; SI units."""
        stance = self.equilibrium.stance
        return {
            "sigmas": self.sigmas,
            "sources": len(self.sources),
            "contacts": {
                name: {
                    "covariance": self.covariance[k],
                    "half_axes": self.axes[k],
                    "heading": float(self.headings[k]),
                    "shares": self.shares[name],
                    "strongest": self.strongest(name),
                    "nonlinearity": float(self.nonlinearity[k]),
                }
                for k, name in enumerate(stance.contact_names)
            },
            "margins": [
                {
                    "name": margin.name,
                    "where": margin.where,
                    "kind": margin.kind,
                    "unit": margin.unit,
                    "margin": margin.value,
                    "likely": float(likely),
                    "worst": float(worst),
                }
                for margin, likely, worst in zip(
                    self.margins, self.likely_margins, self.worst_margins, strict=True
                )
            ],
            "travels": {
                side: {
                    "limit": each.limit,
                    "travel": each.travel,
                    "likely": each.likely,
                    "worst": each.worst,
                    "worst_exact": each.exact,
                    "shares": self.travel_shares(side),
                }
                for side, each in self.travels.items()
            },
            "lost_samples": self.lost_samples,
            "notes": list(self.notes),
        }

    def _shared(self, rates: Float[np.ndarray, "k p"]) -> dict[str, float]:
        part = ((rates * self.deviations) ** 2).sum(axis=0)
        total = float(part.sum())
        groups: dict[str, float] = {}
        for source, size in zip(self.sources, part.tolist(), strict=True):
            groups[source.group] = groups.get(source.group, 0.0) + size
        if not total > 0:
            return {}
        return {g: x / total for g, x in sorted(groups.items(), key=lambda item: -item[1])}


@one_blas_thread()
def propagate_uncertainty(
    stance: Stance,
    criterion: Criterion | WrenchPolicy,
    uncertainty: Uncertainty | Literal["default"] = "default",
    limits: Limits | None = None,
    *,
    path: LateralPath | None = None,
    samples: int = SAMPLES,
    seed: int = 0,
) -> Spread:
    """What a model's errors make of a criterion's wrenches, CoPs, margins and travels.

    The criterion shares the load of the robot as it truly is; each error is one right-hand side of
    the system that solved the statics. Wrenches and margins are those within the limits, travels
    those of the criterion's own wrenches until the first limit (without limits: until a contact
    tips or carries no load), along the postures that the model gives.

    Args:
        stance: robot, posture and contacts by the model.
        criterion: what shares the load; a policy is rejected.
        uncertainty: how far the model may be off; ``"default"`` is `Uncertainty.default`.
        limits: what wrenches and torques must respect; None for nothing.
        path: the CoM's lateral path through the stance, for several criteria to share.
        samples: models with random errors that are evaluated whole, to see how far the first order
            carries; 0 for none.
        seed: of their errors.

    Raises:
        InvalidInputError: an uncertainty without meaning for this robot, a policy, a stance in
            motion, or one of which parts hang.
        UnknownNameError: an uncertainty of what the robot does not have.
        UnloadedContactError: a contact carries no normal force.
        CopsenseError: the criterion has no solution here.
    """
    check_stance(stance)
    check_uncertain(stance)
    if not isinstance(criterion, Criterion):
        if callable(criterion):
            raise InvalidInputError(
                "a policy q -> wrenches does not say what it does on another robot. Give a "
                "Criterion."
            )
        check_criterion(criterion)
    assert isinstance(criterion, Criterion)
    count = whole_number(samples, "the samples of an uncertainty", least=0)
    within = optional_limits(limits)
    given = Uncertainty.default(stance) if uncertainty == "default" else uncertainty
    remedy = 'Give Uncertainty(links={"*": {"mass_percent": 5.0}}), say, or "default".'
    check_type(given, Uncertainty, "an uncertainty", remedy)
    assert isinstance(given, Uncertainty)
    sources = sources_of(given, stance, within)
    equilibrium = solve_equilibrium(stance, criterion, within)
    cop = contact_cops(equilibrium)
    measured = within or PLANTED
    rows = row_change(stance, measured, sources)
    forces, torques = equilibrium.response(change_of(stance, sources), rows)
    m = len(stance.row_names)
    rates = cop_rates(equilibrium, cop, stance.unstack(forces))
    margins = _margins(equilibrium, measured, rows, forces[:m], torques, given.sigmas, sources)
    scan = PathScan(path or LateralPath(stance), criterion)
    travels = {
        side: robust_travel(scan, way, measured, sources, given.sigmas)
        for side, way in SIDES.items()
    }
    bent, lost = np.full(len(cop), np.nan), 0
    if count:
        bent, lost = _nonlinearity(equilibrium, within, sources, cop, rates, count, seed)
    return Spread(
        equilibrium,
        sources,
        given.sigmas,
        cop,
        forces[:m],
        torques,
        rates,
        *margins,
        travels,
        bent,
        lost,
    )


@one_blas_thread()
def sample_models(
    stance: Stance,
    criterion: Criterion,
    sources: Sequence[Source],
    errors: Float[np.ndarray, "N p"],
    limits: Limits | None = None,
) -> Float[np.ndarray, "N nc 2"]:
    """Centres of pressure of whole models with given errors, one by one.

    Args:
        stance: by the model.
        criterion: what shares the load.
        sources: what is off, such as `Spread.sources`.
        errors: by how much (N, p), each in its source's unit.
        limits: what the wrenches must respect; None for nothing.

    Returns:
        CoPs (N, nc, 2), contact axes [m]; NaN for a model that has no answer.
    """
    found = np.full((len(errors), len(stance.contacts), 2), np.nan)
    within = optional_limits(limits)
    for i, each in enumerate(errors):
        try:
            there = perturbed(stance, sources, each)
            if within is None:
                equilibrium = solve_equilibrium(there, criterion)
            else:
                own = perturbed_limits(there, within, sources, each)
                equilibrium = solve_equilibrium(there, criterion, own)
            if not equilibrium.pulling:
                found[i] = contact_cops(equilibrium)
        except CopsenseError:
            continue  # counted by the caller, as NaN
    return found


def _nonlinearity(
    equilibrium: StaticEquilibrium,
    limits: Limits | None,
    sources: Sequence[Source],
    cop: np.ndarray,
    rates: np.ndarray,
    count: int,
    seed: int,
) -> tuple[np.ndarray, int]:
    """Share of the spread by which samples differ from the first order, and how many are lost."""
    deviations = np.array([source.deviation for source in sources])
    errors = np.random.default_rng(seed).standard_normal((count, len(sources))) * deviations
    criterion = equilibrium.criterion
    assert isinstance(criterion, Criterion)
    exact = sample_models(equilibrium.stance, criterion, sources, errors, limits)
    good = np.isfinite(exact).all(axis=(1, 2))
    if not good.any():
        return np.full(len(cop), np.nan), count
    linear = np.einsum("kip,np->nki", rates, errors[good])
    shares = np.zeros(len(cop))
    for k, rate in enumerate(rates):
        _, turn = np.linalg.eigh((rate * deviations) @ (rate * deviations).T)
        whole, first = (
            np.sqrt(((x[:, k] @ turn) ** 2).mean(axis=0)) for x in (exact[good] - cop, linear)
        )
        moves = first > _STILL
        shares[k] = np.abs(whole[moves] / first[moves] - 1).max(initial=0.0)
    return shares, int(count - good.sum())


def _margins(
    equilibrium: StaticEquilibrium,
    limits: Limits,
    rows: np.ndarray | None,
    forces: np.ndarray,
    torques: np.ndarray,
    sigmas: float,
    sources: Sequence[Source],
) -> tuple[tuple[LimitMargin, ...], np.ndarray, np.ndarray, np.ndarray]:
    """Margins, their rates, and what is left of them at worst and along the ellipsoid."""
    table = margin_table(equilibrium.stance, limits)
    values = table.values(equilibrium.contact_forces, equilibrium.torques)
    slack = table.slack_rates(forces.T, torques.T).T
    rates = table.value_rates(
        values, direct_rates(slack, rows, equilibrium.forces), equilibrium.contact_forces, forces
    )
    off = rates * (sigmas * np.array([source.deviation for source in sources]))
    worst, likely = values - np.abs(off).sum(axis=1), values - np.linalg.norm(off, axis=1)
    found = tuple(table.margin(each, values) for each in table.groups)
    nearest = [int(each[int(np.argmin(values[each]))]) for each in table.groups]
    return (
        found,
        rates[nearest],
        np.array([worst[each].min() for each in table.groups]),
        np.array([likely[each].min() for each in table.groups]),
    )
