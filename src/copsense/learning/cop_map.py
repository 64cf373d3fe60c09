"""CoP map: centres of pressure as a function of coordinates or configurations, with gradients."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Float

from copsense.arrays import check_type, finite_number, whole_number
from copsense.batch import BatchKernel, BatchResult, PostureBatch
from copsense.batch.blocks import fill_blocks
from copsense.criterion import Criterion
from copsense.errors import InvalidInputError, UnknownNameError, UnreachablePostureError
from copsense.learning.evaluation import Evaluation, empty_evaluation
from copsense.learning.posture_inputs import PostureInputs
from copsense.learning.travel_slope import OFFSETS, travel_slopes
from copsense.limits import Limits
from copsense.polygon import Polygon
from copsense.stance import Stance, check_stance

_CHUNK, _LEAST = 2048, 256  # postures that a thread takes at a time, whose numbers stay in caches
_SINGULAR = "there is no gradient: the contacts hold an input fast here, as on a straight leg"
ON_INVALID = ("raise", "mask")


class CopMap:
    """Centres of pressure of a stance as a function of the posture, for many postures at once.

    The inputs of a posture are the values of named coordinates (those of
    `copsense.batch.PostureChart`), whose posture has the contacts in place; or, without names, a
    whole configuration, which is first moved to the nearest one with the contacts in place: the
    smallest change of the base's position, its roll, pitch and yaw, and the joints. One that has to
    move further than `within` is not valid.

    Attributes:
        stance: gives robot and contacts.
        criterion: how the load is shared.
        limits: what wrenches and torques must respect; None for nothing.
        inputs: names of a posture's inputs.
        contacts: names of the contacts.
        within: how far a configuration may be from its contacts [m, rad].
        invalid: ``"raise"`` or ``"mask"``.
        threads: threads that share the postures.
    """

    stance: Stance
    criterion: Criterion
    limits: Limits | None
    inputs: tuple[str, ...]
    contacts: tuple[str, ...]
    within: float
    invalid: str
    threads: int

    def __repr__(self) -> str:
        """Robot, criterion and inputs."""
        robot = self.stance.robot.name
        return f"CopMap({robot!r} under {self.criterion.name} over {self.description})"

    def __init__(
        self,
        stance: Stance,
        criterion: Criterion,
        coordinates: Sequence[str] | None = None,
        limits: Limits | None = None,
        within: float = 1e-3,
        invalid: str = "raise",
        threads: int = 1,
    ) -> None:
        """Set up the search and the statics.

        Args:
            stance: robot and contacts.
            criterion: how the load is shared; a policy has no gradient.
            coordinates: of a `PostureChart`; None for whole configurations.
            limits: what wrenches and torques must respect.
            within: how far a configuration may be from its contacts [m, rad].
            invalid: what becomes of a posture that cannot be evaluated: ``"raise"`` an error, or
                ``"mask"`` it.
            threads: threads that share the postures.

        Raises:
            InvalidInputError: a criterion without gradient, coordinates that leave a choice or
                move a contact, or a robot with loops.
            UnknownNameError: a name that is not a coordinate, or another way to treat what is not
                valid.
        """
        check_stance(stance)
        self.stance = stance
        check_type(
            criterion, Criterion, "the criterion", "A policy q -> wrenches has no exact gradient."
        )
        if invalid not in ON_INVALID:
            raise UnknownNameError("way to treat postures that are not valid", invalid, ON_INVALID)
        self.criterion, self.limits, self.invalid = criterion, limits, invalid
        self.within = finite_number(within, "within", positive=True)
        self.threads = whole_number(threads, "threads")
        self._coordinates = coordinates
        self._postures = PostureInputs(stance, coordinates, self.within)
        self.inputs = self._postures.names
        self._kernels = {
            gains: BatchKernel(stance, [criterion], limits, gains=gains) for gains in (False, True)
        }
        self._ready = False
        self.contacts = stance.contact_names
        self._size = (len(self.contacts), len(self.inputs))
        self._edges = [_all_edges(c.sole) if c.sole is not None else None for c in stance.contacts]

    def __reduce__(self) -> tuple[Any, ...]:
        """Copies and pickles are set up again: machine code belongs to a process."""
        return CopMap, (
            self.stance,
            self.criterion,
            self._coordinates,
            self.limits,
            self.within,
            self.invalid,
            self.threads,
        )

    @property
    def start(self) -> Float[np.ndarray, " k"]:
        """The inputs of the stance itself."""
        return self._postures.start

    @property
    def description(self) -> str:
        """The inputs in words."""
        return self._postures.description

    def check_shape(self, shape: Sequence[int]) -> None:
        """Check that the last axis of an array holds the inputs of a posture.

        Raises:
            InvalidInputError: it does not.
        """
        if not shape or shape[-1] != len(self.inputs):
            raise InvalidInputError(
                f"the input has shape {tuple(shape)}, but its last axis must hold "
                f"{len(self.inputs)} entries: {self.description}. Give (..., {len(self.inputs)})."
            )

    def compile(self) -> None:
        """Have everything compiled now, which otherwise the first call waits for."""
        if not self._ready:
            start, one = self.start[None], empty_evaluation(1, *self._size, everything=True)
            for everything in (False, True):
                self._filler(start, one, {}, everything, 1)()(0, 1)
            self._ready = True

    def evaluate(self, x: Float[np.ndarray, "N k"], *, everything: bool = False) -> Evaluation:
        """Values and gradients.

        Args:
            x: the inputs, a posture in each row [m, rad].
            everything: compute travels and the margins' gradients too.

        Raises:
            UnreachablePostureError: a posture is not valid, and none may be.
        """
        self.compile()
        rows = np.ascontiguousarray(x, dtype=np.float64)
        found = empty_evaluation(len(rows), *self._size, everything=everything)
        reasons: dict[int, str] = {}
        block = min(_CHUNK, max(_LEAST, -(-len(rows) // self.threads)))
        filler = self._filler(rows, found, reasons, everything, block)
        fill_blocks(filler, len(rows), block, self.threads)
        if reasons and self.invalid == "raise":
            raise self._not_valid(reasons, len(rows))
        return replace(found, reasons=reasons)

    def travel_gradient(
        self, x: Float[np.ndarray, "N k"], share: Float[np.ndarray, "N nc"]
    ) -> Float[np.ndarray, "N k"]:
        """Gradients of sums over contacts of share times travel, by differences of fourth order.

        Of the edge that the CoM travels to from the posture itself: where another one is nearer at
        one of the neighbours, those on its other side serve. Zero where nothing is shared, where a
        travel is infinite, and for postures that are not valid.

        Args:
            x: the inputs.
            share: of each contact's travel.

        Raises:
            UnreachablePostureError: a posture has no neighbours to either side to compare with.
        """
        self.compile()
        slope = np.zeros((len(x), len(self.inputs)))
        wanted = np.flatnonzero((share != 0.0).any(axis=1))
        chunk = self.threads * _CHUNK // len(OFFSETS)
        for first in range(0, len(wanted), chunk):
            rows = wanted[first : first + chunk]
            part = np.asarray(x[rows], dtype=np.float64)
            slope[rows], stuck = travel_slopes(self._travels, part, share[rows])
            if stuck:
                raise UnreachablePostureError(
                    f"a posture has no neighbours along {self.inputs[stuck[0]]} to difference the "
                    "travel with: it stands at the end of what is reachable to both sides. Use "
                    "the gradient of cop or margin, or stay away from limits."
                )
        return slope

    def _travels(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Travel and edge (N, nc), and whether there is a posture (N,)."""
        travel = np.full((len(x), len(self.contacts)), np.nan)
        edge = np.full(travel.shape, -1)

        def fill(first: int, stop: int) -> None:
            kept, q, _ = self._postures.solve(x[first:stop])
            result = self._kernels[True].evaluate(q)
            travel[first:stop][kept] = result.com_travel[:, 0]
            edge[first:stop][kept] = result.tipping_edge[:, 0]

        fill_blocks(lambda: fill, len(x), _CHUNK, self.threads)
        return travel, edge, ~np.isnan(travel).any(axis=1)

    def _filler(
        self,
        x: np.ndarray,
        found: Evaluation,
        reasons: dict[int, str],
        everything: bool,
        block: int,
    ) -> Callable[[], Callable[[int, int], None]]:
        """What one thread calls to fill some rows, with memory of its own."""

        def make() -> Callable[[int, int], None]:
            postures = self._postures.chart.empty(block)
            results = self._kernels[everything].empty(block)

            def fill(first: int, stop: int) -> None:
                why = self._fill(x[first:stop], found.rows(first, stop), postures, results)
                reasons.update({first + i: reason for i, reason in why.items()})

            return fill

        return make

    def _fill(
        self, x: np.ndarray, found: Evaluation, postures: PostureBatch, results: BatchResult
    ) -> dict[int, str]:
        """Evaluate the rows of one block; why some of them are not valid."""
        rows, q, reasons = self._postures.solve(x, postures)
        everything = len(results.com_gain) > 0
        out = results if len(q) == len(results) else None
        result = self._kernels[everything].evaluate(q, out=out)
        count, outputs = len(q), 2 * len(self.contacts)
        gradient = result.gradient[:, 0].reshape(count, outputs, -1)
        pulled = self._postures.pull(x[rows], q, gradient)
        cops = result.cops[:, 0]
        good = ~np.isnan(cops).any(axis=(1, 2)) & np.isfinite(pulled).all(axis=(1, 2))
        keep: slice | np.ndarray = slice(None)
        if not good.all():
            numbers = np.arange(len(x))[rows]
            for i in np.flatnonzero(~good):
                reasons[int(numbers[i])] = result.reasons.get((int(i), 0), _SINGULAR)
            rows, keep = numbers[good], good
        if reasons:
            found.clear()
        found.cop[rows], found.valid[rows] = cops[keep], True
        found.margin[rows] = result.margin[keep, 0]
        found.gradient[rows] = pulled[keep].reshape(-1, *found.gradient.shape[1:])
        if everything:
            found.travel[rows] = result.com_travel[keep, 0]
            self._face_inward(found)
        return reasons

    def _face_inward(self, found: Evaluation) -> None:
        """Set the margins' gradients."""
        found.inward[:] = 0.0
        for k, edges in enumerate(self._edges):
            if edges is not None:
                normals, offsets = edges
                distance = offsets - found.cop[:, k] @ normals.T
                nearest = np.abs(distance - found.margin[:, k, None]).argmin(axis=1)
                found.inward[:, k] = np.where(found.valid[:, None], -normals[nearest], 0.0)

    def _not_valid(self, reasons: dict[int, str], count: int) -> UnreachablePostureError:
        first = min(reasons)
        return UnreachablePostureError(
            f"{len(reasons)} of {count} postures of {self.stance.robot.name!r} cannot be "
            f"evaluated; the first, row {first}: {reasons[first].rstrip('.')}. Keep the inputs "
            'where the contacts can be held, or take invalid="mask", which marks such postures '
            "(valid) and gives them no gradient."
        )


def _all_edges(sole: Polygon) -> tuple[np.ndarray, np.ndarray]:
    """Outward normals and offsets of a sole's edges; of a line's ends and sides."""
    normals, offsets = np.array(sole.normals), np.array(sole.offsets)
    if len(sole) != 2:
        return normals, offsets
    return np.vstack([normals, sole.sides[0]]), np.concatenate([offsets, sole.sides[1]])
