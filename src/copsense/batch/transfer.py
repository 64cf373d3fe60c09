"""Transfer: postures from the rows of NumPy's arrays into a workspace's lanes, and back.

An array has a posture in each row, a workspace has one in each column: squares of `WIDTH` by
`WIDTH` numbers are turned over in registers on the way.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils

from copsense.batch.compiler import compiled, inlined
from copsense.batch.lanes import get, primitive, put, row_pointer
from copsense.batch.workspace import WIDTH


@compiled
def read_postures(W: Any, row: int, values: Any, first: int, count: int) -> None:
    """values[first : first + count] (N, n) into n rows of a workspace.

    The last posture is repeated where they do not fill the lanes. The last square overlaps the one
    before.
    """
    n, last = values.shape[1], first + count - 1
    if n < WIDTH:
        for lane in range(WIDTH):
            for i in range(n):
                put(W, row + i, lane, values[min(first + lane, last), i])
        return
    for block in range(0, n, WIDTH):
        i = min(block, n - WIDTH)
        starts = (
            n * first + i,
            n * min(first + 1, last) + i,
            n * min(first + 2, last) + i,
            n * min(first + 3, last) + i,
            n * min(first + 4, last) + i,
            n * min(first + 5, last) + i,
            n * min(first + 6, last) + i,
            n * min(first + 7, last) + i,
        )
        _read_square(W, row + i, values, starts)


@inlined
def write_postures(W: Any, row: int, values: Any, first: int, count: int, column: int) -> None:
    """n rows of a workspace into values[first : first + count, column] (N, nk, n)."""
    n, stride = values.shape[2], values.shape[1] * values.shape[2]
    if n < WIDTH or count < WIDTH:
        for lane in range(count):
            for i in range(n):
                values[first + lane, column, i] = get(W, row + i, lane)
        return
    start = stride * first + n * column
    for block in range(0, n, WIDTH):
        i = min(block, n - WIDTH)
        _write_square(W, row + i, values, start + i, stride)


@compiled
def write_rows(W: Any, row: int, values: Any, first: int, count: int) -> None:
    """n rows of a workspace into values[first : first + count] (N, n)."""
    for lane in range(count):
        for i in range(values.shape[1]):
            values[first + lane, i] = get(W, row + i, lane)


@primitive
def _read_square(typing: Any, W: Any, row: Any, array: Any, starts: Any) -> Any:
    """array.flat[start :][:WIDTH] of each posture into `WIDTH` rows."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        at = [builder.extract_value(args[3], k) for k in range(WIDTH)]
        found = _addresses(context, builder, sig.args[2], args[2], at)
        columns = _transposed(builder, [builder.load(p, align=8) for p in found])
        index = args[1]
        for column in columns:
            pointer = row_pointer(context, builder, sig, (args[0], index))
            builder.store(column, pointer, align=8)
            index = builder.add(index, ir.Constant(index.type, 1))
        return context.get_dummy_value()

    return types.void(W, types.intp, array, types.UniTuple(types.intp, WIDTH)), generate


@primitive
def _write_square(typing: Any, W: Any, row: Any, array: Any, start: Any, stride: Any) -> Any:
    """`WIDTH` rows into array.flat[start + stride * lane :][:WIDTH] of each posture."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        index, rows, at, places = args[1], [], args[3], []
        for _ in range(WIDTH):
            pointer = row_pointer(context, builder, sig, (args[0], index))
            rows.append(builder.load(pointer, align=8))
            index = builder.add(index, ir.Constant(index.type, 1))
            places.append(at)
            at = builder.add(at, args[4])
        found = _addresses(context, builder, sig.args[2], args[2], places)
        for value, place in zip(_transposed(builder, rows), found, strict=True):
            builder.store(value, place, align=8)
        return context.get_dummy_value()

    return types.void(W, types.intp, array, types.intp, types.intp), generate


def _transposed(builder: Any, rows: list[Any]) -> list[Any]:
    """The columns of a square of lanes: halves are exchanged at distance 1, 2, 4."""
    mask, distance = ir.VectorType(ir.IntType(32), WIDTH), 1
    while distance < WIDTH:
        low = [p if not p & distance else WIDTH + p - distance for p in range(WIDTH)]
        high = [p + distance if not p & distance else WIDTH + p for p in range(WIDTH)]
        for i in range(WIDTH):
            if not i & distance:
                a, b = rows[i], rows[i + distance]
                rows[i] = builder.shuffle_vector(a, b, ir.Constant(mask, low))
                rows[i + distance] = builder.shuffle_vector(a, b, ir.Constant(mask, high))
        distance *= 2
    return rows


def _addresses(context: Any, builder: Any, given: Any, array: Any, starts: list[Any]) -> list[Any]:
    """Addresses of `WIDTH` floats each in a contiguous array, from its flat indices."""
    vector = ir.VectorType(ir.DoubleType(), WIDTH).as_pointer()
    data = cgutils.create_struct_proxy(given)(context, builder, value=array).data
    return [builder.bitcast(builder.gep(data, [start]), vector) for start in starts]
