"""Design: the criterion that lets the CoM travel farthest, in a family with a few weights."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
import scipy.optimize
from jaxtyping import Float
from scipy.interpolate import CubicHermiteSpline

from copsense.criterion import (
    Criterion,
    minimum_torque,
    minimum_wrench,
    mixed,
    weighted_torque,
)
from copsense.errors import CopsenseError, InvalidInputError, UnknownNameError
from copsense.limits import Limits
from copsense.margins import margin_table
from copsense.path import PosturePath
from copsense.posture import supporting_joints
from copsense.sensitivity import cop_sensitivity
from copsense.stance import Stance

Objective = Literal["travel", "gain"]
NO_LIMIT = "none within the path"  # a score's first limit where the path ends before any
_PARTS = ("hip", "knee", "ankle")
_ROUNDING = 1e-9  # m
_BAD = 1e3  # objective of a criterion that fails on the path


@dataclass(frozen=True, eq=False)
class Family:
    """Criteria with a few positive parameters, searched on a logarithmic scale.

    Attributes:
        name: as `copsense design --family` knows it.
        parameters: their names.
        bounds: lowest and highest value of each.
        build: parameters -> criterion.
    """

    name: str
    parameters: tuple[str, ...]
    bounds: tuple[tuple[float, float], ...]
    build: Callable[[Sequence[float]], Criterion]


@dataclass(frozen=True)
class Score:
    """How a criterion does along a path.

    Attributes:
        criterion: its name.
        parameters: its parameters.
        travel: smallest CoM travel from the path's middle to the first limit, either side [m].
        first_limit: the limit met there.
        worst_gain: largest norm of dCoP/dCoM of any contact at any posture within `range`.
        torque_norm: root mean square of the norm of the torques over these postures [N m].
        range: how far to either side of the middle gain and torques are taken [m].
    """

    criterion: str
    parameters: Mapping[str, float]
    travel: float
    first_limit: str
    worst_gain: float
    torque_norm: float
    range: float


@dataclass(frozen=True, eq=False)
class Design:
    """A designed criterion beside the paper's two.

    Attributes:
        criterion: the best one found.
        score: how it does.
        baselines: the minimum wrench (L = 1 m) and the minimum torque on the same path.
        candidates: every criterion of the family that was looked at on a grid.
        pareto: those of them that no other beats in both the objective and the torque norm,
            by rising torque norm.
        objective: ``"travel"`` or ``"gain"``.
        family: name of the family.
    """

    criterion: Criterion
    score: Score
    baselines: tuple[Score, ...]
    candidates: tuple[Score, ...]
    pareto: tuple[Score, ...]
    objective: Objective
    family: str


def design_criterion(
    path: PosturePath,
    limits: Limits,
    family: Family,
    *,
    objective: Objective = "travel",
    grid: int = 9,
    progress: Callable[[int], object] | None = None,
) -> Design:
    """Choose the parameters of a family that do best along a path.

    A grid over the parameters, then a simplex search from its best point.

    Args:
        path: postures to either side of its middle one, such as a lateral sweep.
        limits: what ends the travel.
        family: the criteria to choose from, see `families`.
        objective: ``"travel"`` maximises the smallest travel to a limit; ``"gain"`` minimises the
            largest norm of dCoP/dCoM over the postures that both of the paper's criteria can hold.
        grid: values per parameter.
        progress: called with 1 after each point of the grid.

    Raises:
        InvalidInputError: a path with failures or too few postures, or no criterion that works.
        UnknownNameError: another objective.
    """
    if objective not in ("travel", "gain"):
        raise UnknownNameError("objective", objective, ("travel", "gain"))
    if len(path) < 5 or path.failures:
        raise InvalidInputError(
            f"a design needs a path of 5 postures or more without failures; this one has "
            f"{len(path)} and {len(path.failures)}. Sweep less far."
        )
    if grid < 2:
        raise InvalidInputError(f"the grid needs 2 values a parameter or more, got {grid}.")
    axes = [np.log(np.geomspace(low, high, grid)) for low, high in family.bounds]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, len(axes))

    both = (minimum_wrench(1.0), minimum_torque())
    reach = min(score(path, limits, criterion, {}).travel for criterion in both)
    baselines = tuple(score(path, limits, criterion, {}, reach) for criterion in both)

    def judge(logs: np.ndarray) -> Score | None:
        values = [float(v) for v in np.exp(logs)]
        named = dict(zip(family.parameters, values, strict=True))
        try:
            return score(path, limits, family.build(values), named, reach)
        except CopsenseError:
            return None

    def cost(found: Score | None) -> float:
        if found is None:
            return _BAD
        return -found.travel if objective == "travel" else found.worst_gain

    looked: list[tuple[np.ndarray, Score]] = []
    for point in points:
        found = judge(point)
        if found:
            looked.append((point, found))
        if progress:
            progress(1)
    if not looked:
        raise InvalidInputError(
            f"no criterion of the family {family.name!r} works along this path. Try another."
        )
    # Of equals, such as where the path ends before any limit, the one that strains least.
    start = min(looked, key=lambda pair: (round(cost(pair[1]), 9), pair[1].torque_norm))
    refined = scipy.optimize.minimize(
        lambda logs: cost(judge(logs)),
        start[0],
        method="Nelder-Mead",
        bounds=[(np.log(a), np.log(b)) for a, b in family.bounds],
        options={"xatol": 1e-2, "fatol": 1e-6, "maxfev": 40 * len(axes)},
    )
    best = judge(refined.x) or start[1]
    if cost(best) > cost(start[1]) - _ROUNDING:
        best = start[1]
    candidates = (*(s for _, s in looked), best)
    chosen = family.build([best.parameters[name] for name in family.parameters])
    return Design(
        chosen,
        best,
        baselines,
        candidates,
        pareto(candidates, cost),
        objective,
        family.name,
    )


def score(
    path: PosturePath,
    limits: Limits,
    criterion: Criterion,
    parameters: Mapping[str, float],
    within: float | None = None,
) -> Score:
    """How a criterion does along a path.

    Between the path's postures the limits' slacks are cubics through their values and derivatives:
    the travel errs with the fourth power of the postures' distance.

    Args:
        path: postures to either side of its middle one.
        limits: what ends the travel.
        criterion: what to judge.
        parameters: kept in the score.
        within: how far from the middle gain and torques are taken [m]; default the travel.

    Raises:
        CopsenseError: the criterion fails at a posture of the path.
    """
    middle = len(path) // 2
    table = margin_table(path.stances[middle], limits)
    rows, rates, gains, norms = [], [], [], []
    for stance, tangent in zip(path.stances, path.tangents, strict=True):
        result = cop_sensitivity(stance, criterion)
        equilibrium = result.equilibrium
        # Slacks are nearer to straight lines than distances, whose f_z falls towards a limit.
        rows.append(table.slack(equilibrium.forces, equilibrium.torques))
        df, dtau = (d[:, 0] for d in equilibrium.derivative(tangent[:, None]))
        rates.append(table.slack(df, dtau) - table.slack(0.0 * df, 0.0 * dtau))
        gains.append(max(np.linalg.norm(gain, 2) for gain in result.com_gain))
        norms.append(float(np.sum(equilibrium.torques**2)))
    along = path.values - path.values[middle]
    ends = [_first_zero(np.array(rows), np.array(rates), along, middle, side) for side in (1, -1)]
    travel, row = min(ends)
    reach = travel if within is None else within
    taken = np.abs(along) <= reach + _ROUNDING  # a posture at the very end counts on either side
    reached = table.names[row] if row >= 0 else NO_LIMIT
    return Score(
        criterion.name,
        dict(parameters),
        travel,
        reached,
        float(np.max(np.array(gains)[taken])),
        float(np.sqrt(np.mean(np.array(norms)[taken]))),
        reach,
    )


def families(stance: Stance) -> dict[str, Family]:
    """The families that can be designed at a stance, by name.

    ``length``: the minimum wrench's characteristic length. ``joints``: torque weights of hips,
    knees and ankles, told by the joints' names, or else by their place between contact and base;
    the last group counts 1. ``mix``: the minimum torque with a share of the minimum wrench.
    """
    groups = joint_groups(stance)
    free = tuple(groups)[:-1]

    def joints(values: Sequence[float]) -> Criterion:
        weights = dict.fromkeys(stance.robot.torque_names, 1.0)
        for name, value in zip(free, values, strict=True):
            weights |= dict.fromkeys(groups[name], value)
        return weighted_torque(weights, name="designed-torque")

    def mix(values: Sequence[float]) -> Criterion:
        length, share = values
        return mixed((minimum_torque(), 1.0), (minimum_wrench(length), share), name="designed-mix")

    found = [
        Family(
            "length",
            ("characteristic_length",),
            ((0.01, 3.0),),
            lambda values: minimum_wrench(values[0], name="designed-wrench"),
        ),
        Family("mix", ("characteristic_length", "wrench_share"), ((0.01, 3.0), (1e-4, 1.0)), mix),
    ]
    if free:
        bounds = ((1e-2, 1e2),) * len(free)
        found.append(Family("joints", tuple(f"{g}_weight" for g in free), bounds, joints))
    return {family.name: family for family in found}


def joint_groups(stance: Stance) -> dict[str, tuple[str, ...]]:
    """Supporting joints in groups that share a torque weight."""
    mask = supporting_joints(stance)[stance.robot.base_nv :] > 0
    supporting = [n for n, on in zip(stance.robot.torque_names, mask, strict=True) if on]
    groups = {part: tuple(n for n in supporting if part in n.lower()) for part in _PARTS}
    groups = {part: names for part, names in groups.items() if names}
    if len(groups) > 1 and sum(len(names) for names in groups.values()) == len(supporting):
        return groups
    depth: dict[str, list[str]] = {}
    for contact in stance.contacts:
        for place, joint in enumerate(stance.limb(contact)):
            names = depth.setdefault(f"joint{place + 1}", [])
            name = stance.robot.model.names[joint]
            if name not in names:
                names.append(name)
    return {place: tuple(names) for place, names in depth.items()}


def _first_zero(
    values: Float[np.ndarray, "N r"],
    rates: Float[np.ndarray, "N r"],
    along: Float[np.ndarray, " N"],
    middle: int,
    side: int,
) -> tuple[float, int]:
    """Travel at which a slack first reaches zero on one side, and its row; -1 if none does."""
    if np.any(values[middle] < 0):
        return 0.0, int(np.argmin(values[middle]))
    indices = list(range(middle, len(along)) if side > 0 else range(middle, -1, -1))
    for i, j in pairwise(indices):
        crossed = np.flatnonzero((values[i] >= 0) & (values[j] < 0))
        roots = []
        for row in crossed:
            ends = sorted((i, j))
            slack = CubicHermiteSpline(along[ends], values[ends, row], rates[ends, row])
            roots.append(float(scipy.optimize.brentq(slack, along[i], along[j], xtol=_ROUNDING)))
        if roots:
            first = int(np.argmin(np.abs(roots)))
            return abs(roots[first]), int(crossed[first])
    return float(abs(along[indices[-1]])), -1


def pareto(candidates: Sequence[Score], cost: Callable[[Score], float]) -> tuple[Score, ...]:
    """Candidates that no other beats in both cost and torque norm, by rising torque norm."""
    best, kept = np.inf, []
    for found in sorted(candidates, key=lambda s: (s.torque_norm, cost(s))):
        if cost(found) < best:
            best = cost(found)
            kept.append(found)
    return tuple(kept)
