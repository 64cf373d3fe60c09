"""Sensitivity: how fast each centre of pressure moves when the posture does."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import ArrayLike

from copsense.arrays import array_property, finite_array, finite_number, read_only
from copsense.blas import one_blas_thread
from copsense.content import freeze
from copsense.cop import contact_cops
from copsense.criterion import Criterion, check_criterion
from copsense.errors import InvalidInputError, SensitivityMismatchError
from copsense.limits import Limits
from copsense.polygon import ON_EDGE
from copsense.posture import retract
from copsense.stance import Stance, check_stance
from copsense.statics import (
    PROJECT,
    ActiveSetChange,
    ConstrainedEquilibrium,
    StaticEquilibrium,
    WrenchPolicy,
    is_admissible,
    solve_equilibrium,
)

_STEP = 1e-3  # rad and m: the fourth-order stencil's error is near its least here
# The stencil's error falls with the fourth power where derivatives are large: shares of the step.
_SHORTER = (1.0, 0.1, 0.01)
STILL = 1e-12  # gains under which nothing moves
HELD = 1e-9  # gains of a centre of pressure that limits hold at a vertex
_LISTED = 6  # contacts that the representation lists


@dataclass(frozen=True, eq=False, repr=False)
class CopSensitivity:
    """The static centre-of-pressure sensitivity of a stance ([Romano2016] Eq. (11)).

    Attributes:
        equilibrium: the equilibrium differentiated.
        basis: admissible motions Z (nv, p) that the matrices refer to, orthonormal columns.
        cop: centres of pressure (nc, 2), contact axes [m].
        matrix: eta = d cop / d xi along the columns of the basis (nc, 2, p).
        wrench_derivative: d wrenches (nc, 6, p), contact axes.
        torque_derivative: d torques (n, p).
    """

    equilibrium: StaticEquilibrium
    basis: Float[np.ndarray, "nv p"]
    cop: Float[np.ndarray, "nc 2"]
    matrix: Float[np.ndarray, "nc 2 p"]
    wrench_derivative: Float[np.ndarray, "nc 6 p"]
    torque_derivative: Float[np.ndarray, "n p"]

    def __post_init__(self) -> None:
        """Own the arrays."""
        freeze(self, "basis", "cop", "matrix", "wrench_derivative", "torque_derivative")

    def __repr__(self) -> str:
        """The equilibrium, and where each contact's CoP is and how it moves with the CoM."""
        names = self.equilibrium.stance.contact_names
        lines = [
            f"  {name}: CoP ({x * 1e3:.1f}, {y * 1e3:.1f}) mm, |dCoP/dCoM| {gain:.3f}"
            for name, (x, y), gain in zip(
                names, self.cop, np.linalg.norm(self.com_gain, 2, axis=(1, 2)), strict=True
            )
        ]
        if len(lines) > _LISTED:
            lines[_LISTED:] = [f"  and {len(names) - _LISTED} more contacts"]
        return "\n".join([f"CopSensitivity of {self.equilibrium!r}", *lines])

    @array_property
    def gradient(self) -> Float[np.ndarray, "nc 2 nv"]:
        """The sensitivity as a gradient over velocities, projected on the admissible motions.

        Free of the choice of basis: its product with an admissible motion is that motion's rate.
        """
        return self.matrix @ self.basis.T

    def along(self, tangent: ArrayLike, rate: float = 1.0) -> Float[np.ndarray, "nc 2"]:
        """d cop / d coordinate along a path.

        Args:
            tangent: the path's tangent (nv,), admissible: J t = 0 within 1e-6.
            rate: d coordinate along that tangent, such as a joint's entry of it.

        Raises:
            InvalidInputError: the motion moves a contact, or the coordinate stands still.
        """
        t = finite_array(tangent, "the tangent", (len(self.basis),), "a velocity")
        if not is_admissible(self.equilibrium.stance, t):
            raise InvalidInputError(f"the tangent moves a contact. {PROJECT}")
        rate = finite_number(rate, "the coordinate's rate along the path")
        if not abs(rate) > 1e-12 * max(1.0, float(np.abs(t).max())):
            raise InvalidInputError(
                "the coordinate does not change along this path: there is no derivative with "
                "respect to it. Choose a coordinate that moves, or another path."
            )
        return self.gradient @ t / rate

    def one_sided(
        self, tangent: ArrayLike, *, side: int, rate: float = 1.0
    ) -> Float[np.ndarray, "nc 2"]:
        """d cop / d coordinate just before (side -1) or after (+1) this point of a path.

        The two differ where a limit is touched without pressing; elsewhere both are `along`.

        Args:
            tangent: the path's tangent (nv,), admissible: J t = 0 within 1e-6.
            side: -1 or +1.
            rate: d coordinate along that tangent.

        Raises:
            InvalidInputError: besides the reasons of `along`, another side, or no way was found on
                that side: the limits may be infeasible there.
        """
        if side not in (1, -1):
            raise InvalidInputError(f"the side is -1 (before) or +1 (after), got {side}.")
        both = self.along(tangent, rate)
        equilibrium, t = self.equilibrium, np.asarray(tangent, dtype=float)
        if not isinstance(equilibrium, ConstrainedEquilibrium):
            return both
        forces = equilibrium.rates(side * (t if rate > 0 else -t)).forces
        wrenches = equilibrium.stance.unstack(forces)
        return side * cop_rates(equilibrium, self.cop, wrenches) / abs(rate)

    def next_active_set_change(self, tangent: ArrayLike) -> ActiveSetChange | None:
        """The next limit to begin or cease to press along a path, to first order.

        `copsense.scan.next_active_set_change` finds the exact one on the lateral path.

        Args:
            tangent: the path's tangent (nv,), admissible: J t = 0 within 1e-6. Its negative looks
                the other way.

        Returns:
            The first change along the tangent, its `travel` in metres of horizontal CoM; None
            where nothing changes, as without limits.

        Raises:
            InvalidInputError: the motion moves a contact, or leaves the CoM over one point.
        """
        equilibrium = self.equilibrium
        t = finite_array(tangent, "the tangent", (len(self.basis),), "a velocity")
        if not is_admissible(equilibrium.stance, t):
            raise InvalidInputError(f"the tangent moves a contact. {PROJECT}")
        speed = float(np.linalg.norm(equilibrium.stance.com_jacobian[:2] @ t))
        if not speed > STILL * max(1.0, float(np.abs(t).max())):
            raise InvalidInputError(
                "the centre of mass stays over one point along this path: there is no travel to "
                "measure by. Choose a path that moves it sideways."
            )
        if not isinstance(equilibrium, ConstrainedEquilibrium):
            return None
        return equilibrium.next_active_set_change(t / speed)

    def nearest_active_set_change(self) -> ActiveSetChange | None:
        """The limit that begins or ceases to press first, whichever way the CoM moves.

        Along the motions `com_motions`, in the horizontal direction that comes to a change first,
        to first order: within its `travel` [m] no limit changes the gains abruptly. What is only
        touched here, and what presses leaves free to move, is met at once, travel 0. More in
        `ConstrainedEquilibrium.nearest_active_set_change`.

        Returns:
            That change; None where nothing changes, as without limits.

        Raises:
            InvalidInputError: the tie-break alone presses on a limit, and when it lets go is not
                followed.
        """
        if not isinstance(self.equilibrium, ConstrainedEquilibrium):
            return None
        return self.equilibrium.nearest_active_set_change(self.com_motions)

    def along_joint(self, tangent: ArrayLike, joint: str) -> Float[np.ndarray, "nc 2"]:
        """d cop / d joint along a path with this tangent [m/rad, or m/m of a prismatic joint]."""
        index = self.equilibrium.stance.robot.velocity_index(joint)
        t = finite_array(tangent, "the tangent", (len(self.basis),), "a velocity")
        return self.along(t, float(t[index]))

    @property
    def com_motions(self) -> Float[np.ndarray, "nv 2"]:
        """The admissible motion of least kinetic energy per unit of CoM x and y velocity.

        See `Stance.com_motions`.
        """
        return self.equilibrium.stance.com_motions

    @array_property
    def com_gain(self) -> Float[np.ndarray, "nc 2 2"]:
        """Gamma = d cop / d CoM, dimensionless, independent of the chart.

        Rows: CoP x, y in contact axes; columns: CoM x, y in world axes.
        """
        return self.matrix.dot(self._com_coordinates)

    @array_property
    def load_gain(self) -> Float[np.ndarray, "nc 2"]:
        """Change of each contact's share of the weight, f_z / (m g), per CoM travel [1/m].

        Columns: CoM x, y in world axes.
        """
        return self._wrench_gain[:, 2] / self.equilibrium.stance.robot.weight

    @array_property
    def _wrench_gain(self) -> Float[np.ndarray, "nc 6 2"]:
        """Change of the wrenches per CoM travel, CoM x and y in world axes."""
        return self.wrench_derivative.dot(self._com_coordinates)

    @array_property
    def _com_coordinates(self) -> Float[np.ndarray, "p 2"]:
        """The motions `com_motions` in the basis."""
        return np.asarray(self.basis.T.dot(self.com_motions))

    @array_property
    def unloading_travel(self) -> Float[np.ndarray, " nc"]:
        """How far the CoM may move before a contact carries no load, to first order [m].

        Signed as the load, infinite where the load does not change.
        """
        return self.load_travel(self.equilibrium.wrenches[:, 2])

    def load_travel(self, loads: Float[np.ndarray, " nc"]) -> Float[np.ndarray, " nc"]:
        """How far the CoM may move to first order before loads are used up (nc,) [m].

        Args:
            loads: of each contact [N]; with those of the equilibrium it is `unloading_travel`.
        """
        share = loads / self.equilibrium.stance.robot.weight
        speed = np.linalg.norm(self.load_gain, axis=1)
        still = speed <= STILL
        return np.where(still, np.copysign(np.inf, share), share / np.where(still, 1.0, speed))

    @array_property
    def worst_case_gain(self) -> Float[np.ndarray, " nc"]:
        """Largest CoP speed over motions of given kinetic energy, times sqrt(mass).

        sqrt(m) sigma_max(eta (Z' M Z)^(-1/2)), dimensionless: metres of CoP per metre that the
        whole mass would move.
        """
        # The largest singular value, 0 where the contacts leave nothing to move.
        motions = self.equilibrium.stance.energy_motions
        speeds = [
            np.linalg.svd(eta @ motions, compute_uv=False).max(initial=0.0) for eta in self.gradient
        ]
        return np.sqrt(self.equilibrium.stance.robot.mass) * np.array(speeds)

    @property
    def com_travel(self) -> Float[np.ndarray, " nc"]:
        """How far the CoM may move before a contact tips, to first order of the slack [m].

        The slack of an edge is ``s = w (b - a . p)``, with w the contact's share of the weight,
        a the edge's outward normal and b its offset. It is affine in the CoM wherever the wrenches
        are, so that ``|s| / |grad s|`` with ``grad s = (b - a . p) grad w - w a' Gamma`` is exact
        for such criteria. The least of a sole's edges counts, see `tipping_edge`. Negative where
        the CoP is off the sole already or the contact pulls; infinite where no edge comes nearer
        (a point contact, or a contact without a sole). Where limits hold the CoP at a vertex, all
        edges are met at once, as the contact loses its load. A sole that is a line tips over its
        side as soon as the CoP leaves it.
        """
        return self._tipping[0]

    @property
    def tipping_edge(self) -> Int[np.ndarray, " nc"]:
        """Index of the sole's edge that `com_travel` goes to (nc,); -1 where it goes to none.

        Edge i of a contact's polygon goes from its vertex i to the next; of a sole that is a line,
        0 and 1 are its ends, 2 and 3 its sides.
        """
        return self._tipping[1]

    @cached_property
    def _tipping(self) -> tuple[Float[np.ndarray, " nc"], Int[np.ndarray, " nc"]]:
        # s = w (b - a p) is linear in the wrench: one row gives the slack and its rate.
        wrenches = self.equilibrium.wrenches.reshape(-1)
        return self.slack_travel(self.equilibrium.stance.edge_rows.dot(wrenches))

    def slack_travel(
        self, slacks: Float[np.ndarray, " e"]
    ) -> tuple[Float[np.ndarray, " nc"], Int[np.ndarray, " nc"]]:
        """How far the CoM may move to first order before slacks of the soles' edges are used up.

        Args:
            slacks: of each edge, as rows of `Stance.edge_rows` [m]; with those of the equilibrium
                the answer is `com_travel` and `tipping_edge`.

        Returns:
            The distance of each contact (nc,) [m], and the edge that it goes to.
        """
        stance, slack = self.equilibrium.stance, np.array(slacks)
        rate = stance.edge_rows.dot(self._wrench_gain.reshape(-1, 2))
        for rows in stance.line_edges:
            slack[rows][np.abs(slack[rows]) <= ON_EDGE] = 0.0  # whatever side rounding puts it
        # An edge that stands still and is passed already leaves no way back.
        distance = np.where(slack < -ON_EDGE, -np.inf, np.inf)
        speed = np.hypot(rate[:, 0], rate[:, 1])
        np.divide(slack, speed, out=distance, where=speed > STILL)
        travel, edge = np.full(len(self.cop), np.inf), np.full(len(self.cop), -1)
        # Plain numbers: the four of a contact would take NumPy longer.
        gains = self.com_gain.reshape(-1, 4).tolist()
        held = [max(map(abs, gain)) < HELD for gain in gains]
        for k, rows in enumerate(stance.edges):
            if rows.stop > rows.start and held[k]:
                # At a vertex that limits hold it meets all edges at once, where the load is gone.
                fall = np.hypot(*self.load_gain[k])
                if fall > STILL:
                    share = self.equilibrium.wrenches[k, 2] / stance.robot.weight
                    travel[k], edge[k] = share / fall, 0
            elif rows.stop > rows.start:
                nearest = int(distance[rows].argmin())
                travel[k] = distance[rows][nearest]
                edge[k] = nearest if travel[k] < np.inf else -1
        return read_only(travel), read_only(edge)


def cop_sensitivity(
    stance: Stance,
    criterion: Criterion | WrenchPolicy,
    limits: Limits | None = None,
    *,
    step: float = _STEP,
) -> CopSensitivity:
    """The sensitivity of every contact's centre of pressure along the admissible motions.

    Analytic for a `Criterion`; for a policy q -> wrenches by fourth-order central differences along
    the constraint manifold.

    Args:
        stance: robot, configuration and contacts.
        criterion: a `Criterion`, or a callable q -> wrenches (nc, 6) in contact axes.
        limits: what the wrenches and torques must respect; None for nothing. The matrices are then
            those with the pressing limits held; where a limit is only touched the two sides
            differ, see `CopSensitivity.one_sided`.
        step: displacement of the differences [rad, m]; a criterion takes none.

    Raises:
        UnloadedContactError: a contact carries no normal force.
        UndeterminedWrenchError: the criterion does not determine the wrenches.
    """
    if not isinstance(criterion, Criterion):
        return finite_difference_sensitivity(stance, criterion, limits, step=step)
    return sensitivity_of(solve_equilibrium(stance, criterion, limits))


def sensitivity_of(equilibrium: StaticEquilibrium) -> CopSensitivity:
    """The sensitivity at an equilibrium that a `Criterion` chose, without solving it again.

    Raises:
        UnloadedContactError: a contact carries no normal force.
        UndeterminedWrenchError: the wrenches have no derivative at this very posture.
    """
    Z = equilibrium.stance.admissible_motions
    forces, torques = equilibrium.derivative(Z)
    return _sensitivity(equilibrium, Z, equilibrium.stance.unstack(forces), torques)


def finite_difference_sensitivity(
    stance: Stance,
    criterion: Criterion | WrenchPolicy,
    limits: Limits | None = None,
    *,
    step: float = _STEP,
) -> CopSensitivity:
    """The same sensitivity from equilibria alone: (8 (g(h) - g(-h)) - (g(2h) - g(-2h))) / 12h.

    Each equilibrium is solved at a posture moved along a basis vector and pulled back onto the
    manifold.
    """
    check_stance(stance)
    step = finite_number(step, "the step of the differences [rad, m]", positive=True)
    Z = stance.admissible_motions
    wrenches, torques = [], []
    for z in Z.T:
        at = {
            s: solve_equilibrium(retract(stance, s * step * z), criterion, limits)
            for s in (-2, -1, 1, 2)
        }
        wrenches.append(
            (8 * (at[1].wrenches - at[-1].wrenches) - (at[2].wrenches - at[-2].wrenches))
            / (12 * step)
        )
        torques.append(
            (8 * (at[1].torques - at[-1].torques) - (at[2].torques - at[-2].torques)) / (12 * step)
        )
    equilibrium = solve_equilibrium(stance, criterion, limits)
    return _sensitivity(equilibrium, Z, np.stack(wrenches, -1), np.stack(torques, -1))


@one_blas_thread()
def check_sensitivity(
    stance: Stance,
    criterion: Criterion,
    limits: Limits | None = None,
    *,
    tolerance: float = 1e-7,
    step: float = _STEP,
) -> None:
    """Compare the analytic sensitivity with finite differences at a stance.

    Args:
        stance: where to compare.
        criterion: the criterion to differentiate.
        limits: what it must respect; the active ones must be the same at every difference.
        tolerance: largest difference allowed, relative to the largest entry of each.
        step: displacement of the differences [rad, m]; a tenth and a hundredth of it are tried
            where they differ.

    Raises:
        SensitivityMismatchError: they differ by more; the message says where and by how much, and
            whether the differences decide at all.
    """
    finite_number(tolerance, "the tolerance")
    if callable(criterion):
        raise InvalidInputError(
            "a policy is differentiated numerically: there is nothing to compare. Give a Criterion."
        )
    check_criterion(criterion)
    exact = cop_sensitivity(stance, criterion, limits)
    before: dict[str, np.ndarray] = {}
    for shorter in _SHORTER:
        numeric = _compared(
            finite_difference_sensitivity(stance, criterion, limits, step=shorter * step)
        )
        off = {
            what: (_apart(numeric[what], own), _apart(numeric[what], before.get(what, own)))
            for what, own in _compared(exact).items()
        }
        what, (error, unsure) = max(off.items(), key=lambda each: each[1][0])
        if error <= tolerance:
            return
        before = numeric
    if unsure > tolerance:
        why = (
            f"The differences themselves change by {unsure:.0e} from one step to a shorter one, so "
            "they do not decide: a contact may be about to unload, a leg straight, or contacts and "
            "loops may all but repeat each other. Move the posture a little."
        )
    else:
        why = "No step of them explains it: please report it, with the robot and the posture."
    raise SensitivityMismatchError(
        f"the analytic derivative of the {what} differs from finite differences by {error:.2e} "
        f"relative, over {tolerance:.0e}. {why}"
    )


def _compared(found: CopSensitivity) -> dict[str, np.ndarray]:
    """What `check_sensitivity` compares."""
    return {
        "centre of pressure": found.matrix,
        "wrench": found.wrench_derivative,
        "torque": found.torque_derivative,
    }


def _apart(a: np.ndarray, b: np.ndarray) -> float:
    """Largest difference, relative to the largest entry; zero where all is still."""
    scale = float(np.abs(b).max(initial=0.0))
    return float(np.abs(a - b).max(initial=0.0)) / scale if scale > STILL else 0.0


def _sensitivity(
    equilibrium: StaticEquilibrium,
    basis: np.ndarray,
    wrench_derivative: np.ndarray,
    torque_derivative: np.ndarray,
) -> CopSensitivity:
    p = read_only(contact_cops(equilibrium))
    matrix = read_only(cop_rates(equilibrium, p, wrench_derivative))
    return CopSensitivity(equilibrium, basis, p, matrix, wrench_derivative, torque_derivative)


def cop_rates(
    equilibrium: StaticEquilibrium,
    cop: Float[np.ndarray, "nc 2"],
    change: Float[np.ndarray, "nc 6 *p"],
) -> Float[np.ndarray, "nc 2 *p"]:
    """Derivatives of the centres of pressure where wrenches change so (nc, 6, ...).

    Quotient rule: dp = (d(-m_y, m_x) - p df_z) / f_z.
    """
    trailing = (1,) * (change.ndim - 2)
    rates = cop.reshape(*cop.shape, *trailing) * -change[:, None, 2]
    rates[:, 0] -= change[:, 4]
    rates[:, 1] += change[:, 3]
    rates /= equilibrium.wrenches[:, 2].reshape(-1, 1, *trailing)
    return rates
