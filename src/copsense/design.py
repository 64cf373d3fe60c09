"""Design: the criterion that lets the CoM travel farthest, in a family with a few weights."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from jaxtyping import Float

from copsense.blas import one_blas_thread
from copsense.content import ShortRepr, freeze
from copsense.criterion import (
    Criterion,
    minimum_torque,
    minimum_wrench,
    mixed,
    weighted_torque,
)
from copsense.errors import CopsenseError, InvalidInputError, UnknownNameError
from copsense.json_data import json_data
from copsense.limits import Limits, check_limits
from copsense.margins import margin_table
from copsense.path import PosturePath, check_path
from copsense.posture_system import supporting_joints
from copsense.scan import PathScan
from copsense.scan_point import ScanPoint
from copsense.stance import Stance
from copsense.statics import TIE_BREAK, with_tie_breaks

if TYPE_CHECKING:
    from copsense.plots.style import Figure

Objective = Literal["travel", "gain"]
NO_LIMIT = "none within the path"  # a score's first limit where the path ends before any
_PARTS = ("hip", "knee", "ankle")
_ROUNDING = 1e-9  # m
_AT_BOUND = 1e-2  # of a parameter's logarithm: the search's resolution
_GRID_POINTS = 343  # 7 values for each of three parameters
_SIMPLEX = (0.5, 0.1, 0.02)  # first steps of the searches, in steps of the grid
_SAME = 1e-6  # relative: less is not a gain
_BAD = 1e3  # objective of a criterion that fails on the path


@dataclass(frozen=True, eq=False, repr=False)
class Family(ShortRepr):
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


@dataclass(frozen=True, repr=False)
class Score(ShortRepr):
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

    def __post_init__(self) -> None:
        """Own the parameters."""
        freeze(self, "parameters")


@dataclass(frozen=True, eq=False, repr=False)
class Design(ShortRepr):
    """A designed criterion beside the paper's two.

    Attributes:
        criterion: the best one found.
        score: how it does.
        baselines: the minimum wrench (L = 1 m) and the minimum torque on the same path.
        alternatives: the best of the minimum wrench over its characteristic length, by the same
            objective, unless that is the family: what one parameter alone achieves.
        candidates: every criterion of the family that was looked at on a grid, and the best.
        pareto: those of them that no other beats in both the objective and the torque norm,
            by rising torque norm.
        objective: ``"travel"`` or ``"gain"``.
        family: name of the family.
        at_bound: parameters whose best value is a bound of the family: farther out may be better.
        robot: name of the robot.
        notes: what to know about it, such as what of its file is not used.
    """

    criterion: Criterion
    score: Score
    baselines: tuple[Score, ...]
    alternatives: tuple[Score, ...]
    candidates: tuple[Score, ...]
    pareto: tuple[Score, ...]
    objective: Objective
    family: str
    at_bound: tuple[str, ...]
    robot: str
    notes: tuple[str, ...] = ()

    @property
    def verdict(self) -> str:
        """What the designed criterion is worth beside the better of the paper's two."""
        if self.objective == "gain":
            best = min(self.baselines, key=lambda s: s.worst_gain)
            change = self.score.worst_gain / best.worst_gain - 1 if best.worst_gain > 0 else 0.0
            better, what = change < -_SAME, "worst gain"
        else:
            best = max(self.baselines, key=lambda s: s.travel)
            own = self.score.travel
            if best.travel == 0:
                beyond = "the paper's two are beyond a limit in the middle already"
                return f"{own * 1e3:.1f} mm, where {beyond}"
            change = own / best.travel - 1
            better, what = change > _SAME, "travel"
        if better:
            return f"{what} {change * 100:+.0f} % over the better of the paper's two"
        found = f"{what} {change * 100:+.1f} %"
        return f"no better than {best.criterion} ({found}): keep {best.criterion}"

    def plot(self) -> Figure:
        """What the design gains, and what it costs, `copsense.plots.plot_design`."""
        from copsense.plots import plot_design

        return plot_design(self)

    def to_dict(self) -> dict[str, Any]:
        """What ``copsense design --json`` prints: plain data, a `Score` as its fields."""
        data = {
            "robot": self.robot,
            "family": self.family,
            "objective": self.objective,
            "best": asdict(self.score),
            "at_bound": self.at_bound,
            "baselines": [asdict(s) for s in self.baselines],
            "alternatives": [asdict(s) for s in self.alternatives],
            "pareto": [asdict(s) for s in self.pareto],
            "notes": self.notes,
        }
        return dict(json_data(data))


@one_blas_thread()
def design_criterion(
    path: PosturePath,
    limits: Limits,
    family: Family | str,
    *,
    objective: Objective = "travel",
    grid: int = 9,
    progress: Callable[[int], object] | None = None,
) -> Design:
    """Choose the parameters of a family that do best along a path.

    A grid over the parameters, then ever narrower simplex searches from the best point.

    Args:
        path: postures to either side of its middle one, such as a lateral sweep; those that were
            not reached, and what lies beyond them on either side, are left out, and ``notes`` say
            so.
        limits: what ends the travel.
        family: the criteria to choose from, one of `families` or its name.
        objective: ``"travel"`` maximises the smallest travel to a limit; ``"gain"`` minimises the
            largest norm of dCoP/dCoM over the postures that both of the paper's criteria can hold.
        grid: values per parameter.
        progress: called with how many more criteria are done with, of `design_size` in all.

    Raises:
        UnreachablePostureError: the middle of the path was not reached.
        InvalidInputError: too few postures around the middle, or no criterion that works.
        UnknownNameError: another objective, or no family of that name.
    """
    check_path(path)
    check_limits(limits)
    family = family_named(path.stances[0], family)
    if objective not in ("travel", "gain"):
        raise UnknownNameError("objective", objective, ("travel", "gain"))
    whole, path = path, path.reached()
    if len(path) < 5:
        raise InvalidInputError(
            f"a design needs 5 postures of the path or more, around its middle; {len(path)} of "
            f"{len(whole)} were reached there. Give more of them, nearer together."
        )
    if grid < 2:
        raise InvalidInputError(f"the grid needs 2 values a parameter or more, got {grid}.")
    part: tuple[str, ...] = ()
    if len(path) < len(whole):
        part = (
            f"the path's {len(path)} postures around its middle are used, {path.coordinate} "
            f"{path.values[0]:.4g} to {path.values[-1]:.4g} {path.unit}; of those beyond, "
            f"{len(whole.failures)} were not reached.",
        )
    # What only the torques choose may leave forces that contacts exert against each other.
    usual = {c.name: c for c in (minimum_wrench(1.0), minimum_torque())}
    tied, notes = with_tie_breaks(path.stances, usual)
    both = tuple(tied.values())
    if notes:
        family = replace(family, build=partial(_tied, family.build))
    reach = min(score(path, limits, criterion, {}).travel for criterion in both)
    baselines = tuple(score(path, limits, criterion, {}, reach) for criterion in both)

    def judge(family: Family, values: Sequence[float]) -> Score | None:
        named = dict(zip(family.parameters, values, strict=True))
        try:
            return score(path, limits, family.build(values), named, reach)
        except CopsenseError:
            return None

    def cost(found: Score | None) -> float:
        if found is None:
            return _BAD
        return -found.travel if objective == "travel" else found.worst_gain

    looked, best = _search(family, judge, cost, grid, progress)
    if best is None:
        raise InvalidInputError(
            f"no criterion of the family {family.name!r} works along this path. Try another."
        )
    other = (
        _search(LENGTHS, judge, cost, grid, progress)[1] if family.name != LENGTHS.name else None
    )
    candidates = (*looked, best)
    values = [best.parameters[name] for name in family.parameters]
    at_bound = tuple(
        name
        for name, value, bounds in zip(family.parameters, values, family.bounds, strict=True)
        if min(abs(np.log(value / bound)) for bound in bounds) <= _AT_BOUND
    )
    return Design(
        family.build(values),
        best,
        baselines,
        (other,) if other else (),
        candidates,
        pareto(candidates, cost),
        objective,
        family.name,
        at_bound,
        path.stances[0].robot.name,
        (*path.stances[0].robot.notes, *part, *notes),
    )


def design_size(family: Family, grid: int) -> int:
    """How many criteria a design of a family looks at, at most.

    Args:
        family: the family.
        grid: values per parameter.
    """
    searches = [family] if family.name == LENGTHS.name else [family, LENGTHS]
    counts = [len(each.parameters) for each in searches]
    return sum(grid**count + len(_SIMPLEX) * _calls(count) for count in counts)


def usual_grid(family: Family) -> int:
    """Values per parameter for which a grid has some hundred points, 7 at most.

    The simplex searches go on from the best of them: 7 for up to three parameters, 4 for four.
    """
    points = len(family.parameters)
    return max(2, *(n for n in range(2, 8) if n**points <= _GRID_POINTS))


def _calls(parameters: int) -> int:
    """Criteria that a simplex search looks at, at most."""
    return 40 * parameters


def _search(
    family: Family,
    judge: Callable[[Family, Sequence[float]], Score | None],
    cost: Callable[[Score | None], float],
    grid: int,
    progress: Callable[[int], object] | None = None,
) -> tuple[list[Score], Score | None]:
    """The family's scores on a grid, and the best found from there; None where all fail."""
    import scipy.optimize

    low, high = np.log(np.array(family.bounds)).T
    axes = [np.linspace(a, b, grid) for a, b in zip(low, high, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, len(axes))

    known: dict[bytes, Score | None] = {}  # a search begins and ends where one has been

    def at(logs: np.ndarray) -> Score | None:
        if (key := logs.tobytes()) not in known:
            known[key] = judge(family, values_at(logs))
        return known[key]

    def values_at(logs: np.ndarray) -> list[float]:
        # A bound stays what it was given as.
        return [
            bounds[int(log > a)] if log in (a, b) else float(np.exp(log))
            for log, a, b, bounds in zip(logs, low, high, family.bounds, strict=True)
        ]

    looked: list[tuple[np.ndarray, Score]] = []
    for point in points:
        found = at(point)
        if found:
            looked.append((point, found))
        if progress:
            progress(1)
    scores = [found for _, found in looked]
    report, most = progress or (lambda count: None), _calls(len(axes))
    if not looked:
        report(most * len(_SIMPLEX))
        return scores, None
    # Of equals, such as where the path ends before any limit, the one that strains least.
    where, best = min(looked, key=lambda pair: (round(cost(pair[1]), 9), pair[1].torque_norm))
    for size in _SIMPLEX:
        before = len(known)

        def measure(logs: np.ndarray) -> float:
            if logs.tobytes() not in known:
                report(1)
            return cost(at(logs))

        # Inwards from a bound: clipped to it, the simplex would be flat and never leave it.
        step = size * (high - low) / (grid - 1)
        inwards = np.where(where + step <= high, step, -step)
        refined = scipy.optimize.minimize(
            measure,
            where,
            method="Nelder-Mead",
            bounds=list(zip(low, high, strict=True)),
            options={
                "initial_simplex": np.vstack([where, where + np.diag(inwards)]),
                "xatol": 1e-3,
                "fatol": 1e-6,
                "maxfev": most,
            },
        )
        report(most - (len(known) - before))
        found = at(refined.x)
        if found and cost(found) < cost(best) - _ROUNDING:
            where, best = refined.x, found
    return scores, best


def score(
    path: PosturePath,
    limits: Limits,
    criterion: Criterion,
    parameters: Mapping[str, float],
    within: float | None = None,
) -> Score:
    """How a criterion does along a path.

    Between the path's postures the limits' slacks are cubics through their values and derivatives:
    the travel errs with the fourth power of the postures' distance. Postures beyond the travel and
    `within` are not looked at.

    Args:
        path: postures to either side of its middle one.
        limits: what ends the travel.
        criterion: what to judge.
        parameters: kept in the score.
        within: how far from the middle gain and torques are taken [m]; default the travel.

    Raises:
        CopsenseError: the criterion fails at a posture that is looked at.
    """
    scan = PathScan(path, criterion)
    table = margin_table(path.stances[len(path) // 2], limits)

    def slack(point: ScanPoint) -> tuple[Float[np.ndarray, " r"], Float[np.ndarray, " r"]]:
        return (
            table.slack(point.forces, point.torques),
            table.slack_rates(point.force_rates, point.torque_rates),
        )

    travel, reached = np.inf, NO_LIMIT
    for side, end in ((1, path.values[-1]), (-1, path.values[0])):
        # The one side need not be followed farther than the other goes.
        found = scan.first(slack, side, reach=travel, exact=False)
        length = abs(float(end) - scan.start)
        if found and found.travel < travel:
            travel, reached = found.travel, table.names[found.row]
        elif not found and length < travel:
            travel, reached = length, NO_LIMIT
    reach = travel if within is None else within
    # A posture at the very end counts on either side.
    taken = [
        scan.at(value) for value in path.values if abs(value - scan.start) <= reach + _ROUNDING
    ]
    return Score(
        criterion.name,
        dict(parameters),
        travel,
        reached,
        float(max(np.linalg.norm(point.com_gain, 2, axis=(1, 2)).max() for point in taken)),
        float(np.sqrt(np.mean([np.sum(point.torques**2) for point in taken]))),
        reach,
    )


def _tied(build: Callable[[Sequence[float]], Criterion], values: Sequence[float]) -> Criterion:
    return replace(build(values), tie_break=TIE_BREAK)


def _of_length(values: Sequence[float]) -> Criterion:
    return minimum_wrench(values[0], name="designed-wrench")


def _of_mix(values: Sequence[float]) -> Criterion:
    length, share = values
    return mixed((minimum_torque(), 1.0), (minimum_wrench(length), share), name="designed-mix")


def _of_joints(
    joints: tuple[str, ...], groups: tuple[tuple[str, ...], ...], values: Sequence[float]
) -> Criterion:
    weights = dict.fromkeys(joints, 1.0)
    for names, value in zip(groups, values, strict=True):
        weights |= dict.fromkeys(names, value)
    return weighted_torque(weights, name="designed-torque")


LENGTHS = Family(
    "length",
    ("characteristic_length",),
    ((0.01, 3.0),),
    _of_length,
)


def families(stance: Stance) -> dict[str, Family]:
    """The families that can be designed at a stance, by name.

    ``length``: the minimum wrench's characteristic length. ``joints``: torque weights of hips,
    knees and ankles, by the joints' names, or else by their place between contact and base; the
    last group counts 1. ``mix``: the minimum torque with a share of the minimum wrench.
    """
    groups = joint_groups(stance)
    free = tuple(groups)[:-1]

    found = [
        LENGTHS,
        Family(
            "mix", ("characteristic_length", "wrench_share"), ((0.01, 3.0), (1e-4, 1.0)), _of_mix
        ),
    ]
    if free:
        bounds = ((1e-2, 1e2),) * len(free)
        weighed = partial(
            _of_joints, stance.robot.torque_names, tuple(groups[name] for name in free)
        )
        found.append(Family("joints", tuple(f"{g}_weight" for g in free), bounds, weighed))
    return {family.name: family for family in found}


def family_named(stance: Stance, family: Family | str) -> Family:
    """A family that can be designed at a stance, by its name; a `Family` is that one.

    Raises:
        UnknownNameError: no such family.
    """
    if isinstance(family, Family):
        return family
    known = families(stance)
    if family not in known:
        raise UnknownNameError("family", family, known)
    return known[family]


def joint_groups(stance: Stance) -> dict[str, tuple[str, ...]]:
    """Supporting joints in groups that share a torque weight."""
    mask = supporting_joints(stance)[stance.robot.base_nv :] > 0
    motors = set(stance.robot.torque_names)
    joints = zip(stance.robot.dof_names, mask, strict=True)
    supporting = [name for name, on in joints if on and name in motors]
    groups = {part: tuple(n for n in supporting if part in n.lower()) for part in _PARTS}
    groups = {part: names for part, names in groups.items() if names}
    if len(groups) > 1 and sum(len(names) for names in groups.values()) == len(supporting):
        return groups
    depth: dict[str, list[str]] = {}
    for contact in stance.contacts:
        for place, joint in enumerate(stance.limb(contact)):
            names = depth.setdefault(f"joint{place + 1}", [])
            name = stance.robot.model.names[joint]
            if name in motors and name not in names:
                names.append(name)
    return {place: tuple(names) for place, names in depth.items() if names}


def pareto(candidates: Sequence[Score], cost: Callable[[Score], float]) -> tuple[Score, ...]:
    """Candidates that no other beats in both cost and torque norm, by rising torque norm."""
    best, kept = np.inf, []
    for found in sorted(candidates, key=lambda s: (s.torque_norm, cost(s))):
        if cost(found) < best:
            best = cost(found)
            kept.append(found)
    return tuple(kept)
