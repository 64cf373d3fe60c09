"""Single: one posture at a time, for a controller's loop, without allocating anything.

Handing many arrays from Python to compiled code takes longer than the statics. Everything that
does not change is therefore packed into two arrays, all results lie in a third, and compiled code
is told where they are.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from copsense.batch.choice import Choices
from copsense.batch.kernel import Out, run
from copsense.batch.lanes import as_tuple, compiled, floats_at, whole_at, workspace
from copsense.batch.layout import Feet, Layout, Tree
from copsense.batch.result import BatchResult, array_names
from copsense.batch.rows import Rows

_ROWS = len(Rows._fields)


class Single:
    """A kernel for one configuration at a time, its memory and its results.

    Attributes:
        result: one row, overwritten by every call.
        doubtful: above zero where the clear path must answer, by criterion (nk,).
    """

    def __init__(
        self,
        layout: Layout,
        choices: Choices,
        rows: Rows,
        empty: BatchResult,
        *,
        nq: int,
        gains: bool,
    ) -> None:
        """Pack what does not change, and let the results share one array."""
        ints, floats = pack(layout, choices, rows, gains, len(empty.criteria))
        names, nk = [n for n in array_names() if n != "tipping_edge"], len(empty.criteria)
        arrays = [getattr(empty, name) for name in names]
        values = np.concatenate([*[a.ravel() for a in arrays], np.ones(nk)])
        ends = np.cumsum([0] + [a.size for a in arrays])
        views: dict[str, Any] = {
            name: values[start : start + a.size].reshape(a.shape)
            for name, a, start in zip(names, arrays, ends[:-1], strict=True)
        }
        self.result = replace(empty, **views)
        self.doubtful = values[ends[-1] :]
        self._q = np.zeros(nq)
        edges = self.result.tipping_edge
        self._memory = (ints, floats, self._q, values, edges, workspace(rows.size, width=1))
        self._places = [number for a in self._memory for number in (a.ctypes.data, a.size)]

    def evaluate(self, q: np.ndarray) -> bool:
        """Fill the result for a configuration (nq,); whether any criterion is in doubt."""
        np.copyto(self._q, q)
        return bool(run_single(*self._places))


def pack(
    layout: Layout, choices: Choices, rows: Rows, gains: bool, names: int
) -> tuple[np.ndarray, np.ndarray]:
    """A layout and the criteria served as whole numbers and as floats.

    Results have room for `names` criteria in all.
    """
    tree, feet = layout.parts
    counts = [
        len(tree.parent),
        len(feet.body),
        len(feet.support),
        len(feet.member),
        feet.held,
        feet.unknowns,
        len(choices.kind),
        len(feet.edges),
        int(gains),
        names,
    ]
    whole = [tree.parent, tree.kind, tree.column, feet.body, feet.point, feet.order, feet.first]
    whole += [feet.support, feet.group, feet.member, feet.anchor, feet.rest, feet.edge_first]
    whole += [choices.column, choices.kind, np.array(rows)]
    real = [tree.placement, tree.mass, tree.moment, tree.inertia, tree.carried, tree.gravity]
    real += [tree.level, feet.placement, feet.axes, feet.plane, feet.edges, choices.joint]
    real += [choices.force, choices.moment, np.array([feet.weight])]
    ints = np.concatenate([np.array(counts), *[a.ravel() for a in whole]]).astype(np.int64)
    return ints, np.concatenate([a.ravel() for a in real]).astype(float)


@compiled
def run_single(
    ints_at: int,
    ints_size: int,
    floats_from: int,
    floats_size: int,
    q_at: int,
    q_size: int,
    values_at: int,
    values_size: int,
    edges_at: int,
    edges_size: int,
    W_at: int,
    W_size: int,
) -> bool:
    """Unpack, and evaluate one configuration into `values`, as `Single` lays out.

    Arrays come as addresses and sizes: to hand over an array takes an allocation, and to count its
    owners a quarter of the call.

    Returns whether a criterion is in doubt, which takes NumPy longer to tell.
    """
    ints, floats = whole_at(ints_at, ints_size), floats_at(floats_from, floats_size)
    q = floats_at(q_at, q_size).reshape(1, q_size)
    values, W = floats_at(values_at, values_size), floats_at(W_at, W_size)
    b, nc, ns, ng, held, unknowns, nk, ne, gains = (
        ints[0],
        ints[1],
        ints[2],
        ints[3],
        ints[4],
        ints[5],
        ints[6],
        ints[7],
        ints[8],
    )
    tipped = whole_at(edges_at, edges_size)
    nr, i = ints[9], 10
    parent, kind, column = ints[i : i + b], ints[i + b : i + 2 * b], ints[i + 2 * b : i + 3 * b]
    i += 3 * b
    body, point = ints[i : i + nc], ints[i + nc : i + 2 * nc]
    order, first = ints[i + 2 * nc : i + 3 * nc], ints[i + 3 * nc : i + 4 * nc]
    i += 4 * nc
    support, group = ints[i : i + ns], ints[i + ns : i + 2 * ns]
    i += 2 * ns
    member = ints[i : i + ng * nc].reshape(ng, nc)
    i += ng * nc
    anchor, rest = ints[i : i + b], ints[i + b : i + 2 * b - 1 - ns]
    i += 2 * b - 1 - ns
    edge_first = ints[i : i + nc + 1]
    i += nc + 1
    columns, kinds = ints[i : i + nk], ints[i + nk : i + 2 * nk]
    rows = Rows(*as_tuple(ints[i + 2 * nk :], _ROWS))
    placement, f = floats[: 12 * b].reshape(b, 12), 12 * b
    mass, moment = floats[f : f + b], floats[f + b : f + 4 * b].reshape(b, 3)
    inertia, carried = floats[f + 4 * b : f + 10 * b].reshape(b, 6), floats[f + 10 * b : f + 11 * b]
    f += 11 * b
    gravity, level = floats[f : f + 3], floats[f + 3 : f + 9].reshape(2, 3)
    f += 9
    place, axes = floats[f : f + 12 * nc].reshape(nc, 12), floats[f + 12 * nc : f + 21 * nc]
    plane = floats[f + 21 * nc : f + 27 * nc].reshape(nc, 6)
    f += 27 * nc
    edges = floats[f : f + 3 * ne].reshape(ne, 3)
    f += 3 * ne
    joint = floats[f : f + nk * b].reshape(nk, b)
    f += nk * b
    force, arm, weight = floats[f : f + nk], floats[f + nk : f + 2 * nk], floats[f + 2 * nk]
    tree = Tree(parent, kind, column, placement, mass, moment, inertia, carried, gravity, level)
    feet = Feet(
        body,
        point,
        place,
        axes.reshape(nc, 9),
        plane,
        order,
        held,
        first,
        unknowns,
        support,
        group,
        member,
        anchor,
        rest,
        edges,
        edge_first,
        weight,
    )
    nv = b + 5
    a0 = nr * 6 * nc
    a1 = a0 + nr * (b - 1)
    a2 = a1 + nr * 2 * nc
    a3 = a2 + nr * 2 * nc * nv
    a4 = a3 + nr * 4 * nc * gains
    a5 = a4 + nr * nc * gains
    a6 = a5 + nr * nc
    a7 = a6 + nr * nc
    out = Out(
        values[:a0].reshape(1, nr, 6 * nc),
        values[a0:a1].reshape(1, nr, b - 1),
        values[a1:a2].reshape(1, nr, 2 * nc),
        values[a2:a3].reshape(1, nr, 2 * nc * nv),
        values[a3:a4].reshape(gains, nr, 4 * nc),
        values[a4:a5].reshape(gains, nr, nc),
        tipped.reshape(gains, nr, nc),
        values[a5:a6].reshape(1, nr, nc),
        values[a6:a7].reshape(1, nr, nc),
        values[a7 : a7 + 3].reshape(1, 3),
        values[a7 + 3 : a7 + 3 + nr].reshape(1, nr),
    )
    run(tree, feet, Choices(columns, kinds, joint, force, arm), rows, q, out, W, 0, 1, 1)
    doubt = 0.0
    for column in range(nr):
        doubt += values[a7 + 3 + column]
    return doubt > 0.0
