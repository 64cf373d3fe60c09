"""Lexicographic: of a program's optima, the one that a second cost prefers.

    f* = argmin 1/2 f' H f - g' f   subject to   E' f = e,   A f <= b

is not unique where some F has E' F = 0 and H F = 0. The second cost 1/2 f' H2 f - g2' f then
decides among f* + F z, within the same rows; what the first presses stays pressed.

The first is solved by proximal steps, which add d/2 |F' (f - f_k)|^2: they end at an optimum of
the first cost itself, with its exact multipliers. The second is a program over z.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from jaxtyping import Float, Int

from copsense.content import ShortRepr
from copsense.errors import UndeterminedWrenchError, UnsolvedError
from copsense.statics.program import Optimum, Program

_PROXIMAL = 1e-6  # curvature of a proximal step, relative to the cost's largest
_FARTHEST = 1e-12  # the least that a step is made to curve, likewise
_STEPS = 60
_EXACT = 1e-3  # of the tolerance: an optimum that good needs no further step
_SETTLED = 1e-11  # of the unit: steps shorter than that are none
_NULL = 1e-10  # curvature of the second cost, relative, that leaves forces undetermined
_BLIND = 1e-9  # share of a row that F must leave for it to limit z


@dataclass(frozen=True, eq=False, repr=False)
class TiedOptimum(ShortRepr):
    """The optimum of a program that the second cost chose.

    Attributes:
        first: an optimum of the first cost, with its multipliers; its x is the one chosen.
        tied: rows (k,) that press on the second cost alone.
    """

    first: Optimum
    tied: Int[np.ndarray, " k"]


class Lexicographic:
    """A program whose cost leaves directions free, and the cost that decides there.

    Attributes:
        program: of the first cost.
        free: F, orthonormal (m, z).
        H: of the second cost (m, m).
        g: likewise (m,).
    """

    program: Program
    free: Float[np.ndarray, "m z"]
    H: Float[np.ndarray, "m m"]
    g: Float[np.ndarray, " m"]

    def __init__(
        self,
        program: Program,
        free: Float[np.ndarray, "m z"],
        H: Float[np.ndarray, "m m"],
        g: Float[np.ndarray, " m"],
    ) -> None:
        """Take both costs.

        Raises:
            UndeterminedWrenchError: the second cost leaves forces undetermined too.
        """
        self.program, self.free, self.H, self.g = program, free, H, g
        self._size = float(program.curvature[-1]) or 1.0
        over = np.linalg.eigvalsh(free.T @ H @ free)
        if over[0] <= _NULL * float(np.abs(H).max(initial=0.0)):
            raise UndeterminedWrenchError(
                "the tie-break leaves wrenches undetermined too. Use minimum_wrench("
                "characteristic_length), which never does."
            )

    def solve(self, pressing: float) -> TiedOptimum:
        """The optimum.

        Args:
            pressing: multipliers, relative to the largest gradient, under which a row does not
                press.

        Raises:
            NoPointError: no x respects the rows.
            UnsolvedError: no x was found that meets the optimality conditions.
        """
        program = self.program
        first, strong = self._first(pressing)
        # Where the first cost presses, z may not lead away: A_s F z = 0.
        G = self._left_free(strong)
        slack = np.maximum(program.b - program.A @ first.x, 0.0)
        rows = program.A @ G / program.scale[:, None]
        seen = np.flatnonzero(np.linalg.norm(rows, axis=1) > _BLIND)
        seen = np.setdiff1d(seen, strong)
        if not G.shape[1]:
            return TiedOptimum(first, np.zeros(0, dtype=int))
        choice = Program(
            G.T @ self.H @ G,
            G.T @ (self.g - self.H @ first.x),
            np.zeros((G.shape[1], 0)),
            np.zeros(0),
            rows[seen],
            slack[seen] / program.scale[seen],
            program.unit,
        )
        second = choice.solve()
        there = Optimum(first.x + G @ second.x, first.equality, first.multipliers, first.error)
        least = pressing * choice.gradient_size(second.x)
        return TiedOptimum(there, seen[second.multipliers > least])

    def _first(self, pressing: float) -> tuple[Optimum, Int[np.ndarray, " a"]]:
        """An optimum of the first cost, and the rows that press there."""
        program, F, step = self.program, self.free, _PROXIMAL * self._size
        best: Optimum | None = None
        x = program.start
        for k in range(_STEPS):
            H, g = program.H + step * F @ F.T, program.g + step * F @ (F.T @ x)
            try:
                near = Program(
                    H, g, program.E, program.e, program.A, program.b, program.unit
                ).solve()
            except UnsolvedError:
                if best is None:
                    raise
                break  # as flat as rounding lets it be
            found = self._polished(near, self._pressing(near, pressing))
            if best is None or found.error < best.error:
                best = found
            moved, x = float(np.abs(F.T @ (near.x - x)).max()), near.x
            if found.error <= _EXACT * program.tolerance or moved <= _SETTLED * program.unit:
                break
            if k:  # slow where the cost itself is nearly as flat: step farther
                step = max(step / 10, _FARTHEST * self._size)
        assert best is not None
        if best.error > program.tolerance:
            raise UnsolvedError(best.error)
        # Not those that only the steps pulled against.
        return best, self._pressing(best, pressing)

    def _pressing(self, at: Optimum, pressing: float) -> Int[np.ndarray, " a"]:
        program = self.program
        least = pressing * program.gradient_size(at.x)
        return np.flatnonzero(at.multipliers * program.scale > least)

    def _polished(self, near: Optimum, strong: Int[np.ndarray, " a"]) -> Optimum:
        """The same with the last proximal step's own pull taken out."""
        program, G = self.program, self._left_free(strong)
        x, nu, pressing = self.hold(strong, program.g, program.e, program.b[strong])
        x = x + G @ (G.T @ near.x)
        l = np.zeros(len(program.b))
        l[strong] = pressing
        error = program.violation(x, nu, l)
        own = program.violation(near.x, near.equality, near.multipliers)
        if error <= own:
            return Optimum(x, nu, l, error)
        return Optimum(near.x, near.equality, near.multipliers, own)

    def optimum(self, held: Int[np.ndarray, " a"]) -> Optimum:
        """The optimum with these independent rows held, whatever the others say."""
        program = self.program
        x, nu, pressing = self.hold(held, program.g, program.e, program.b[held])
        G = self._left_free(held)
        if G.shape[1]:
            x = x + G @ self._move(G, self.g - self.H @ x)
        l = np.zeros(len(program.b))
        l[held] = pressing
        return Optimum(x, nu, l, program.violation(x, nu, l))

    def hold(
        self, held: Int[np.ndarray, " a"], g: np.ndarray, e: np.ndarray, b: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """As `Program.hold` of the first cost; of several x the smallest along what is free."""
        p, G = self.program, self._left_free(held)
        definite = Program(p.H + self._size * G @ G.T, p.g, p.E, p.e, p.A, p.b, p.unit)
        return definite.hold(held, g, e, b)

    def choose(
        self, held: Int[np.ndarray, " a"], change: Float[np.ndarray, "m p"]
    ) -> Float[np.ndarray, "m p"]:
        """What the second cost adds to a derivative along what these rows leave free.

        Args:
            held: rows that press.
            change: of the second cost's gradient, that along its own multipliers taken away.
        """
        G = self._left_free(held)
        if not G.shape[1]:
            return np.zeros_like(change)
        return np.asarray(G @ self._move(G, -change))

    def _move(self, G: np.ndarray, pull: np.ndarray) -> np.ndarray:
        return np.asarray(scipy.linalg.solve(G.T @ self.H @ G, G.T @ pull, assume_a="pos"))

    def _left_free(self, held: Int[np.ndarray, " a"]) -> Float[np.ndarray, "m y"]:
        """F_a: what is free with these rows held."""
        F = self.free
        if not len(held):
            return F
        rows = self.program.A[held] @ F / self.program.scale[held, None]
        _, s, vt = np.linalg.svd(rows)
        return np.asarray(F @ vt[int(np.sum(s > _BLIND)) :].T)
