"""Constrained equilibrium: a criterion's wrenches within limits, and their one-sided derivatives.

Over the contact forces alone, tau = G_j - J_j' f, a criterion within limits is the QP

    minimise 1/2 f' H f - g' f   subject to   J_b' f = G_b,   A f <= b

with H and g of `Quadratic.over_forces`, a row of A for each contact limit and, for a torque limit
|tau_i| <= t_i, the rows -/+ J_i' f <= t_i -/+ G_i. With the active rows held, f and its
multipliers solve

    [ 0     J_b'   0  ] [nu_b]   [ G_b ]
    [ J_b  -H    -A_a'] [ f  ] = [ -g  ]
    [ 0    -A_a    0  ] [ l  ]   [-b_a ]

and along an admissible V the same matrix gives the derivatives. Where a row is weakly active (on
its bound without pressing) the derivative depends on the side. It is the optimum of a QP of its
own: same cost, the pressing rows held, and the weak ones not to be crossed.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import scipy.linalg
from jaxtyping import Bool, Float, Int

from copsense.arrays import array_property, owned
from copsense.changes import StanceChange
from copsense.content import ShortRepr, freeze
from copsense.criterion import Criterion
from copsense.errors import (
    InfeasibleError,
    InvalidInputError,
    UndeterminedWrenchError,
    UnsolvedError,
)
from copsense.limits import LimitRows, Limits, limit_rows
from copsense.listing import first_few
from copsense.load_problem import LoadProblem
from copsense.quadratic import Quadratic
from copsense.stance import Stance
from copsense.statics.equilibrium import StaticEquilibrium, require_balance
from copsense.statics.program import NoPointError, Program
from copsense.statics.tied_optimum import Lexicographic

_PRESSING = 1e-9  # multipliers, relative to the largest gradient, under which a row does not press
_TOUCHING = 1e-9  # slack, relative to the weight, under which a row is on its bound
_APART = 1e-9  # share that the pressing rows leave of a row that does not depend on them
_ROUNDING = 1e-13  # slack, relative to the weight, that is none however little they leave
_RATES_TOLERANCE = 1e-6  # violation of an optimality condition of a one-sided derivative
_CLOSING = 1e-9  # share of what is left of a limit, per unit of motion, that does not count
_STILL = 1e-9  # rates, in shares of the weight or gradient per unit of motion, of none
_SINGULAR = 1e-11  # eigenvalues of the cost, relative, that leave forces undetermined


@dataclass(frozen=True)
class ActiveLimit:
    """A limit that holds with equality.

    Attributes:
        name: such as ``"l_sole: CoP at the +y (left) edge"`` or ``"torque of l_knee"``.
        kind: ``"normal force"``, ``"friction"``, ``"cop"``, ``"torsion"``, ``"wrench cone"`` or
            ``"torque"``.
        multiplier: how hard the criterion presses against it; 0 where it only touches, or where
            only the tie-break presses.
    """

    name: str
    kind: str
    multiplier: float

    @property
    def weak(self) -> bool:
        """Whether the limit is only touched, so that the two sides differ."""
        return self.multiplier == 0.0


@dataclass(frozen=True, eq=False, repr=False)
class ActiveSetChange(ShortRepr):
    """The next limit to begin or cease to press along a motion, or the nearest of all motions.

    A prediction to first order from one posture has the first five; what a search along a path
    finds (`copsense.scan.next_active_set_change`) has them all.

    Attributes:
        criterion: the criterion's name.
        name: the limit's name.
        kind: as of `ActiveLimit`.
        binds: whether it begins to bind; False where it ceases to.
        travel: how far along the motion, in units of it: of the CoM's, metres; of a path, of its
            coordinate.
        first_order: of a search, the travel predicted where it began; infinite if no change was. It
            may be another limit's.
        value: of a search, the path's coordinate there, such as world y of the CoM [m].
        before: d CoP / d coordinate of each contact just before the change (nc, 2), contact axes;
            None where a contact carries no load there, and has no centre of pressure.
        after: the same just after; None too where the limits leave no way forward.
    """

    criterion: str
    name: str
    kind: str
    binds: bool
    travel: float
    first_order: float = np.nan
    value: float = np.nan
    before: Float[np.ndarray, "nc 2"] | None = None
    after: Float[np.ndarray, "nc 2"] | None = None

    def __post_init__(self) -> None:
        """Own the slopes."""
        freeze(self, "before", "after")


@dataclass(frozen=True, eq=False, repr=False)
class Rates(ShortRepr):
    """One-sided derivatives of a constrained equilibrium along a motion.

    Attributes:
        forces: d f (m,).
        torques: d tau (n,).
        multipliers: d l (r,), zero where a row stays inactive.
        slack: d (b - A f) (r,).
    """

    forces: Float[np.ndarray, " m"]
    torques: Float[np.ndarray, " n"]
    multipliers: Float[np.ndarray, " r"]
    slack: Float[np.ndarray, " r"]

    def __post_init__(self) -> None:
        """Own the arrays."""
        freeze(self, "forces", "torques", "multipliers", "slack")


@dataclass(frozen=True, eq=False, repr=False)
class ConstrainedEquilibrium(StaticEquilibrium):
    """An equilibrium within limits; see `StaticEquilibrium` for the rest.

    Attributes:
        limits: the limits.
        names: what each row limits (r,).
        kinds: the kind of each row (r,).
        slack: b - A f (r,), non-negative [N, Nm].
        row_multipliers: l (r,), non-negative, zero off the active rows.
    """

    limits: Limits
    names: tuple[str, ...]
    kinds: tuple[str, ...]
    slack: Float[np.ndarray, " r"]
    row_multipliers: Float[np.ndarray, " r"]
    _problem: _Problem = field(kw_only=True)

    def __post_init__(self) -> None:
        """Own the arrays."""
        super().__post_init__()
        for name in ("slack", "row_multipliers"):
            object.__setattr__(self, name, owned(getattr(self, name)))

    def __repr__(self) -> str:
        """As `StaticEquilibrium`, with the active limits."""
        active = first_few((limit.name for limit in self.active), 4) or "none"
        return f"{super().__repr__()[:-1]}; active limits: {active})"

    @property
    def active(self) -> tuple[ActiveLimit, ...]:
        """The limits that hold with equality, the hardest pressed first."""
        touching = np.flatnonzero(self._problem.strong | self._problem.weak)
        order = sorted(touching, key=lambda i: -self.row_multipliers[i])
        return tuple(
            ActiveLimit(self.names[i], self.kinds[i], float(self.row_multipliers[i])) for i in order
        )

    def optimality(self) -> float:
        """Largest violation of the QP's optimality conditions.

        Balance and limits in shares of the weight, stationarity and complementarity in shares of
        the cost's gradient (of a millionth of what forces of the weight have, where it cancels);
        recomputed from the stance. The QP is without the tie-break.
        """
        robot = self.stance.robot
        base = robot.in_drives(self.multipliers)[: robot.unactuated_nv]
        program = _Problem(self.stance, self._criterion, self.limits).program
        return program.violation(self.forces, base, self.row_multipliers)

    def derivative(
        self,
        directions: Float[np.ndarray, "nv p"],
        load_rate: Float[np.ndarray, "nv p"] | None = None,
    ) -> tuple[Float[np.ndarray, "m p"], Float[np.ndarray, "n p"]]:
        """Derivatives with the pressing limits held, and the touching ones ignored.

        Where nothing only touches this is the derivative; elsewhere use `rates`.

        Args:
            directions: velocities V with J V = 0, as columns.
            load_rate: how N changes besides, as of `StaticEquilibrium.derivative`.
        """
        return self.response(StanceChange(directions, load_rate))

    def response(
        self, change: StanceChange, rows: Float[np.ndarray, "p r m"] | None = None
    ) -> tuple[Float[np.ndarray, "m p"], Float[np.ndarray, "n p"]]:
        """As of `StaticEquilibrium`, with the pressing limits held and the touching ones ignored.

        Args:
            change: of posture, load, contact frames and masses.
            rows: how the rows A of the limits change besides (p, r, m), as with a coefficient of
                friction; in the order of `names`.
        """
        solved = self._problem.differentiate(self, change, self.pressing, rows)
        return solved[0], solved[1]

    @array_property
    def pressing(self) -> Int[np.ndarray, " a"]:
        """Rows that press."""
        return np.flatnonzero(self._problem.strong)

    def pressing_after(self, direction: Float[np.ndarray, " nv"]) -> Int[np.ndarray, " a"]:
        """Rows that press once an admissible motion has begun."""
        pushes = self._problem.weak & (self.rates(direction).multipliers > 0)
        return np.flatnonzero(self._problem.strong | pushes)

    def rates(self, direction: Float[np.ndarray, " nv"]) -> Rates:
        """The one-sided derivative along an admissible motion: what happens when it begins."""
        return self._problem.rates(self, direction)

    def next_active_set_change(self, direction: Float[np.ndarray, " nv"]) -> ActiveSetChange | None:
        """The first change of the pressing limits along an admissible motion, to first order.

        The ratio test: a limit off its bound closes in at the rate of its slack (of a centre of
        pressure f_z (b - a p)), a pressing one eases at the rate of its multiplier. What is only
        touched here has taken a side already. None if nothing closes in.
        """
        self._problem.check_followed(np.flatnonzero(self._problem.tied), self.row_multipliers)
        rates = self.rates(direction)
        strong, touching = self._problem.strong, self._problem.strong | self._problem.weak
        left = np.where(touching, self.row_multipliers, self.slack)
        closing = -np.where(touching, rates.multipliers, rates.slack)
        nearer = (closing > _CLOSING * np.abs(left)) & (strong | ~touching)
        nearer &= ~self._problem.both_ways
        if not np.any(nearer):
            return None
        travel = np.where(nearer, left / np.where(nearer, closing, 1.0), np.inf)
        i = int(np.argmin(travel))
        name, kind, binds = self.names[i], self.kinds[i], not strong[i]
        return ActiveSetChange(self._criterion.name, name, kind, binds, float(travel[i]))

    def nearest_active_set_change(
        self, motions: Float[np.ndarray, "nv p"]
    ) -> ActiveSetChange | None:
        """The change of the pressing limits that the least motion meets, to first order.

        Of all motions ``motions @ c`` with c of length 1, the one that comes to a change first: a
        limit off its bound is its slack away over the length of the slack's rates, a pressing one
        its multiplier over the length of the multiplier's. What is only touched here, and what
        presses leaves free to move, is met at once. None if nothing moves.

        Where more limits meet than can press independently, several choices of them press as well,
        and the travel is that of the one at hand: another may leave the derivatives as they are.

        Args:
            motions: velocities V with J V = 0, as columns.

        Raises:
            InvalidInputError: the tie-break alone presses on a limit.
        """
        i, travel = self.nearest_changing_row(motions)
        if i < 0:
            return None
        binds = not self._problem.strong[i]
        return ActiveSetChange(self._criterion.name, self.names[i], self.kinds[i], binds, travel)

    def nearest_changing_row(self, motions: Float[np.ndarray, "nv p"]) -> tuple[int, float]:
        """The row that changes there, an index into `names`, and the travel; -1 and inf for none.

        Args:
            motions: as of `nearest_active_set_change`, which says the same in words.

        Raises:
            InvalidInputError: the tie-break alone presses on a limit.
        """
        return self._problem.nearest_change(self, motions)

    @property
    def _criterion(self) -> Criterion:
        assert isinstance(self.criterion, Criterion)
        return self.criterion


def solve_constrained(
    stance: Stance, criterion: Criterion, limits: Limits
) -> ConstrainedEquilibrium:
    """The equilibrium that a criterion chooses within limits.

    Args:
        stance: robot, configuration and contacts.
        criterion: what to minimise.
        limits: what to respect.

    Raises:
        UnbalancedError: joints without a motor cannot be held at all.
        InfeasibleError: no wrench respects the limits; says which demand how much more.
        UndeterminedWrenchError: several wrenches are equally good, and no tie-break chooses.
        UnsolvedError: no solver found wrenches that meet the optimality conditions.
    """
    problem = _Problem(stance, criterion, limits)
    return problem.equilibrium(limits, *problem.solve())


def distance_to_change(
    stance: Stance,
    criterion: Criterion,
    limits: Limits,
    pressing: Int[np.ndarray, " a"],
    tangent: Float[np.ndarray, " nv"],
) -> tuple[Float[np.ndarray, " r"], Float[np.ndarray, " r"]]:
    """How far each row is from changing sides if these rows press, and its rate along a motion.

    The slack of a row off its bound, in shares of the weight; the multiplier of one that presses,
    in shares of the cost's gradient. These rows are the criterion's choice as long as none is
    negative. The rates are exact where a distance is zero: the shares are held.
    """
    problem = _Problem(stance, criterion, limits)
    optimum = (problem.program if problem.tie is None else problem.tie).optimum(pressing)
    multipliers = optimum.multipliers
    slack = problem.b - problem.A.dot(optimum.x)
    gradient = problem.program.gradient_size(optimum.x)
    if problem.tie is not None:
        pressed = np.abs(multipliers) * problem.scale > _PRESSING * gradient
        problem.check_followed(pressing, np.where(pressed, multipliers, 0.0))
    found = problem.equilibrium(limits, optimum.x, optimum.equality, multipliers, slack)
    held = np.flatnonzero(multipliers)
    along = StanceChange(tangent[:, None])
    _, _, _, bound = problem.rates_of_data(found, along)
    df, _, dl = problem.differentiate(found, along, held)
    distance = slack / (problem.weight * problem.scale)
    rate = (bound - problem.A.dot(df))[:, 0] / (problem.weight * problem.scale)
    distance[pressing] = (multipliers * problem.scale)[pressing] / gradient
    rate[pressing] = 0.0
    rate[held] = dl[:, 0] * problem.scale[held] / gradient
    return distance, rate


class _Problem:
    """The QP of a stance, a criterion and limits."""

    def __init__(self, stance: Stance, criterion: Criterion, limits: Limits) -> None:
        self.stance, self.criterion = stance, criterion
        self.nb, self.weight = stance.robot.unactuated_nv, stance.robot.weight
        self.load = load = LoadProblem.of(stance)
        self.quadratic: Quadratic = criterion.at(stance)
        self.W = self.quadratic.torque_weight(load)
        self.H, self.g = self.quadratic.over_forces(load)
        rows: LimitRows = limit_rows(stance, limits)
        self.A, self.b = rows.over_forces(load)
        # A contact's row has no joint, and no sign.
        self.joint = np.concatenate([np.full(len(rows.bound), -1), rows.joint])
        self.sign = np.concatenate([np.zeros(len(rows.bound)), rows.sign])
        # Row of the normal force under a centre of pressure; -1 for any other limit.
        self.normal = np.concatenate([rows.normals, np.full(len(rows.joint), -1)])
        self.names, self.kinds = rows.all_names, rows.all_kinds
        E, e = load.base_map.T, load.base_wrench
        self.program = Program(
            self.H, self.g, E, e, self.A, self.b, self.weight, known=load.equations
        )
        self.scale = self.program.scale
        self.strong = self.weak = self.tied = np.zeros(len(self.b), dtype=bool)
        self.tie: Lexicographic | None = self._tie()

    def _tie(self) -> Lexicographic | None:
        """What decides the forces that no cost sees; None where there are none.

        Raises:
            UndeterminedWrenchError: there are, and the criterion has no tie-break.
        """
        curvature = self.program.curvature
        if not len(curvature) or curvature[0] > _SINGULAR * curvature[-1]:
            return None
        second = self.criterion.tie_break
        if second is None:
            looped = (
                self.stance.closures is not None and not self.criterion.at(self.stance).active.any()
            )
            if looped:
                raise UndeterminedWrenchError(
                    f"within limits, criterion {self.criterion.name!r} leaves the forces in the "
                    "loops undetermined, which motors feel and it does not weigh. Give it a share "
                    "of the torques, mixed((criterion, 1.0), (minimum_torque(), 1e-3)), or take "
                    "these alone (--criterion minimum-torque)."
                )
            raise UndeterminedWrenchError(
                f"criterion {self.criterion.name!r} leaves wrenches undetermined. Give it a "
                "tie_break such as minimum_wrench(1.0), a small share of another criterion, "
                "mixed((criterion, 1.0), (minimum_wrench(1.0), 1e-3)), or take that alone "
                "(--criterion minimum-wrench)."
            )
        self.second: Quadratic = second.at(self.stance)
        if self.second.inertia:
            raise InvalidInputError(
                f"criterion {second.name!r} follows the inertia and cannot be a tie-break. Use "
                "minimum_wrench, minimum_torque or constant weights."
            )
        H, g = self.second.over_forces(self.load)
        values, vectors = self.program.modes
        free = values <= _SINGULAR * values[-1]
        return Lexicographic(self.program, self.program.null @ vectors[:, free], H, g)

    def solve(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Forces, multipliers of the base's balance and of the rows, slack."""
        require_balance(self.stance, self.load)  # what no limit is to blame for
        tied = np.zeros(0, dtype=int)
        try:
            if self.tie is None:
                found = self.program.solve()
            else:
                chosen = self.tie.solve(_PRESSING)
                found, tied = chosen.first, chosen.tied
        except NoPointError as error:
            demands = dict.fromkeys(self.names[i] for i in error.rows)
            raise InfeasibleError(error.violation, tuple(demands)) from None
        f, multipliers = found.x, found.multipliers
        slack = self.b - self.A.dot(f)
        self.strong = multipliers * self.scale > _PRESSING * self.program.gradient_size(f)
        multipliers[~self.strong] = 0.0
        self.tied = np.isin(np.arange(len(self.b)), tied) & ~self.strong
        self.strong = self.strong | self.tied
        self.weak = self._touching(slack)
        slack[self.strong] = 0.0
        return f, found.equality, multipliers, slack

    def _touching(self, slack: np.ndarray) -> np.ndarray:
        """Which rows are on their bounds without pressing.

        The slack is taken along what the pressing rows leave free: of an edge that is nearly the
        line of one that presses, how far the centre of pressure is from where the two meet.
        """
        near = slack / (self.weight * self.scale)
        touching = (near <= _TOUCHING) & ~self.strong
        rows = np.flatnonzero(touching)
        if not len(rows) or not np.any(self.strong):
            return touching
        # Coordinates in which the cost is |x|^2 / 2, as those of the compiled active set.
        C = self.program.reduced_cost
        if self.tie is not None:
            free = self.program.null.T.dot(self.tie.free)
            C = C + self.program.curvature[-1] * free.dot(free.T)
        a = scipy.linalg.solve_triangular(
            np.linalg.cholesky(C), self.program.null.T.dot(self.A.T), lower=True
        )
        a = a / np.maximum(np.linalg.norm(a, axis=0), 1e-300)
        held, s, _ = np.linalg.svd(a[:, self.strong], full_matrices=False)
        held = held[:, s > _APART]
        share = np.linalg.norm(a[:, rows] - held.dot(held.T.dot(a[:, rows])), axis=0)
        far = near[rows] > np.maximum(_TOUCHING * share, _ROUNDING)
        touching[rows[far & (share > _APART)]] = False
        return touching

    def equilibrium(
        self,
        limits: Limits,
        f: np.ndarray,
        base: np.ndarray,
        multipliers: np.ndarray,
        slack: np.ndarray,
    ) -> ConstrainedEquilibrium:
        """The equilibrium of these forces; `base` are the multipliers of the base's balance."""
        # Stationarity: J nu = W_f (f - f_ref) + A_c' l, with nu_j = W tau + s l.
        robot = self.stance.robot
        nu = np.zeros(self.nb + len(self.load.torque_offset))
        nu[: self.nb] = base
        nu[self.nb :] = self.W.dot(self.load.torques(f))
        torque = self.joint >= 0
        np.add.at(nu, self.nb + self.joint[torque], (self.sign * multipliers)[torque])
        return ConstrainedEquilibrium(
            self.stance,
            self.criterion,
            f,
            self.load.torques(f),
            robot.from_drives(nu),
            limits,
            self.names,
            self.kinds,
            slack,
            multipliers,
            _problem=self,
        )

    def differentiate(
        self,
        at: ConstrainedEquilibrium,
        change: StanceChange,
        held: np.ndarray,
        rows: np.ndarray | None = None,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """d f, d tau and d l of the held rows as the stance changes, with these rows held."""
        return self._hold(at, change, held, self.rates_of_data(at, change, rows), rows)

    def _hold(
        self,
        at: ConstrainedEquilibrium,
        change: StanceChange,
        held: np.ndarray,
        data: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
        rows: np.ndarray | None = None,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What `differentiate` gives, from `rates_of_data`."""
        base, joints, cost, bound = data
        if self.tie is None:
            df, _, dl = self.program.hold(held, cost, base, bound[held])
        else:
            df, _, dl = self.tie.hold(held, cost, base, bound[held])
            second = self._second_change(at, change, held, joints, df, rows)
            df = df + self.tie.choose(held, second)
        return df, joints - self.load.joint_map.dot(df), dl

    def rates_of_data(
        self, at: ConstrainedEquilibrium, change: StanceChange, rows: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """How the QP's data change at fixed f and l: d(G - J'f), dg - dH f, d(b - A f).

        The first in two parts, base and joints; the second with the multipliers' part.
        """
        load = change.balance(self.stance, at.forces)
        base, joints = load[: self.nb], load[self.nb :]
        weighted = self.W.dot(joints)
        if self.quadratic.inertia:
            weighted = weighted + self.quadratic.torque_weight_change(
                self.stance, self.load, at.torques, change
            )
        cost = change.constraint(self.stance, at.multipliers)
        cost += self.load.joint_map.T.dot(weighted)
        bound = np.zeros((len(self.b), load.shape[1]))
        torque = self.joint >= 0
        bound[torque] = -self.sign[torque, None] * joints[self.joint[torque]]
        if rows is not None:
            cost -= np.einsum("prm,r->mp", rows, at.row_multipliers)
            bound -= np.einsum("prm,m->rp", rows, at.forces)
        return base, joints, cost, bound

    def _second_change(
        self,
        at: ConstrainedEquilibrium,
        change: StanceChange,
        held: np.ndarray,
        joints: np.ndarray,
        df: np.ndarray,
        rows: np.ndarray | None = None,
    ) -> np.ndarray:
        """How the tie-break's gradient changes, what its multipliers take up left out.

        At the optimum H2 f - g2 = E w - H y - A_a' l for some w, y, l. That stays so as the stance
        changes, and F_a' [E  H  A_a'] = 0 removes the unknown derivatives of these; as
        `kkt.TieBreak` does it.
        """
        tie, robot = self.tie, self.stance.robot
        assert tie is not None
        still = np.zeros(self.program.E.shape[1])
        pull = tie.g - tie.H.dot(at.forces)
        w, y, l = self._adjoint(held, pull, still)
        W2 = self.second.torque_weight(self.load)
        turn = np.zeros(self.nb + len(self.load.torque_offset))
        turn[: self.nb] = -w
        turn[self.nb :] = self.W.dot(self.load.joint_map.dot(y)) - W2.dot(at.torques)
        torque = self.joint[held] >= 0
        on = held[torque]
        np.add.at(turn, self.nb + self.joint[on], -self.sign[on] * l[torque])
        moved = change.constraint(self.stance, robot.from_drives(turn))
        moved -= self.load.joint_map.T.dot(W2.dot(joints))
        if rows is not None:
            moved += np.einsum("prm,r->mp", rows[:, held], l)
        return np.asarray(moved + tie.H.dot(df))

    def _adjoint(
        self, held: np.ndarray, pull: np.ndarray, still: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        assert self.tie is not None
        y, w, l = self.tie.hold(held, pull, still, np.zeros(len(held)))
        return w, y, l

    def rates(self, at: ConstrainedEquilibrium, v: np.ndarray) -> Rates:
        """The one-sided derivative: minimise 1/2 df' H df - c' df with what presses held."""
        strong, weak = np.flatnonzero(self.strong), np.flatnonzero(self.weak)
        if self.tie is not None:
            return self._tied_rates(at, v, strong, weak)
        along = StanceChange(v[:, None])
        base, joints, c, bound = (x[:, 0] for x in self.rates_of_data(at, along))
        E = np.hstack([self.load.base_map.T, self.A[strong].T])
        e = np.concatenate([base, bound[strong]])
        pressed = self.program.hold(strong, c, base, bound[strong])[0]
        size = float(np.abs(pressed).max())
        unit = max(size if np.isfinite(size) else 0.0, float(np.abs(e).max()), 1e-300)
        try:
            found = Program(
                self.H, c, E, e, self.A[weak], bound[weak], unit, _RATES_TOLERANCE
            ).solve()
        except (NoPointError, UnsolvedError):
            raise InvalidInputError(
                "what is touched or pressed at this very posture leaves no way along this motion "
                f"that was found ({', '.join(self.names[i] for i in [*strong, *weak])}). The "
                "limits may become infeasible there, or be degenerate: move a little along the "
                "path."
            ) from None
        df, multipliers = found.x, np.zeros(len(self.b))
        multipliers[strong], multipliers[weak] = -found.equality[self.nb :], found.multipliers
        slack = bound - self.A @ df
        slack[strong] = 0.0
        slack[multipliers != 0] = 0.0
        return Rates(df, joints - self.load.joint_map @ df, multipliers, slack)

    @cached_property
    def both_ways(self) -> Bool[np.ndarray, " r"]:
        """Rows of torques that are held at nothing, whichever of the two presses."""
        pairs = np.flatnonzero(self.joint >= 0).reshape(-1, 2)
        slack = (self.b[pairs[:, 0]] + self.b[pairs[:, 1]]) / self.scale[pairs[:, 0]]
        held = np.zeros(len(self.b), dtype=bool)
        held[pairs[slack <= _TOUCHING * self.weight]] = True
        return held

    def nearest_change(self, at: ConstrainedEquilibrium, motions: np.ndarray) -> tuple[int, float]:
        """The row that changes sides first along what these motions span, and its travel."""
        self.check_followed(np.flatnonzero(self.tied), at.row_multipliers)
        strong, along = np.flatnonzero(self.strong), StanceChange(motions)
        data = self.rates_of_data(at, along)
        df, _, dl = self._hold(at, along, strong, data)
        rates = data[3] - self.A.dot(df)
        rates[strong] = dl
        left, unit = np.maximum(at.slack, 0.0), self.weight * self.scale
        left[strong] = at.row_multipliers[strong]
        unit[strong] = self.program.gradient_size(at.forces) / self.scale[strong]
        speed = np.linalg.norm(rates, axis=1)
        moves = (speed > _STILL * unit) & ~self.tied & ~self.both_ways
        if not np.any(moves):
            return -1, np.inf
        travel = np.where(moves, left / np.where(moves, speed, 1.0), np.inf)
        i = int(np.argmin(travel))
        return i, float(travel[i])

    def _tied_rates(
        self, at: ConstrainedEquilibrium, v: np.ndarray, strong: np.ndarray, weak: np.ndarray
    ) -> Rates:
        """The one-sided derivative where a tie-break decides, and nothing is only touched."""
        if len(weak):
            raise InvalidInputError(
                "what is touched at this very posture leaves it to the tie-break on which side "
                f"the wrenches go ({', '.join(self.names[i] for i in weak)}). Move a little along "
                "the path."
            )
        along = StanceChange(v[:, None])
        df, torques, dl = (x[:, 0] for x in self.differentiate(at, along, strong))
        multipliers = np.zeros(len(self.b))
        multipliers[strong] = dl
        multipliers[self.tied] = 0.0
        bound = self.rates_of_data(at, along)[3][:, 0]
        slack = bound - self.A.dot(df)
        slack[strong] = 0.0
        return Rates(df, torques, multipliers, slack)

    def check_followed(self, rows: np.ndarray, multipliers: np.ndarray) -> None:
        """Reject rows on which the tie-break alone may press: its easing is not followed.

        Raises:
            InvalidInputError: there are such rows.
        """
        if self.tie is None:
            return
        seen = np.linalg.norm(self.A[rows] @ self.tie.free, axis=1) > _PRESSING * self.scale[rows]
        alone = rows[seen & (multipliers[rows] == 0.0)]
        if len(alone):
            raise InvalidInputError(
                "the tie-break alone presses on "
                f"{', '.join(self.names[i] for i in alone)}, and when it lets go is not followed. "
                "Give the criterion a small share of another instead, mixed((criterion, 1.0), "
                "(minimum_wrench(1.0), 1e-3)), or take that alone (--criterion minimum-wrench)."
            )
