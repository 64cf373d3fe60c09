"""Lanes: several postures abreast in one value, and the plain arithmetic on it.

A kernel here is written as if for one posture. Its numbers live in the rows of a workspace W, and
the workspace's shape decides what a number is when Numba compiles the kernel: (rows,) makes it a
float, (rows, 8) eight floats that the processor handles abreast (LLVM's vector type: one AVX-512
register, two of AVX2, four of SSE2). No lane ever reads another, so a posture's result does not
depend on its neighbours, to the last bit.
"""

from __future__ import annotations

import inspect
import operator
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, register_model
from numba.np.unsafe.ndarray import to_fixed_tuple

WIDTH = 8  # postures abreast
CACHE_LINE = 64  # bytes; a row of eight that straddles two of them costs double

_FLAGS = ("contract",)  # a * b + c in one instruction; nothing is reordered
_Function = TypeVar("_Function", bound=Callable[..., Any])

_STAMP = tuple(
    (file.name, file.stat().st_mtime_ns, file.stat().st_size)
    for file in sorted(Path(__file__).parent.glob("*.py"))
)

as_tuple = to_fixed_tuple  # so many entries of an array

# What a kernel computes with: a float, or one per lane. Numba has its own types for them.
Value = Any


def compiled(function: _Function) -> _Function:
    """Compile on first use, keep the machine code on disk, and let other threads run meanwhile."""
    options: dict[str, Any] = {"nogil": True, "fastmath": {"contract"}, "error_model": "numpy"}
    plain = inspect.unwrap(function)  # a checker of shapes may have wrapped it
    try:
        dispatcher = njit(cache=True, **options)(plain)
        # Numba would look at the function's own file alone, and call an older version of a
        # function from another one: machine code is of use while no file of the kernel changes.
        dispatcher._cache._cache_file._source_stamp = _STAMP
    except (RuntimeError, AttributeError):  # nowhere to keep it: compiled in every process
        dispatcher = njit(**options)(plain)
    return dispatcher


def workspace(rows: int, *, width: int = WIDTH) -> np.ndarray:
    """An uninitialised workspace, each row in a cache line of its own: (rows, 8), or (rows,)."""
    spare = CACHE_LINE // 8
    memory = np.zeros(rows * width + spare)
    start = (-memory.ctypes.data % CACHE_LINE) // 8
    aligned = memory[start : start + rows * width]
    return aligned if width == 1 else aligned.reshape(rows, width)


class Lanes(types.Type):  # type: ignore[misc]
    """Numba's type of `WIDTH` floats abreast."""

    def __init__(self, width: int) -> None:
        """One type for each width."""
        self.width = width
        super().__init__(name=f"Lanes({width})")


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, dmm: Any, fe_type: Any) -> None:
        super().__init__(dmm, fe_type, ir.VectorType(ir.DoubleType(), fe_type.width))


_LANES = Lanes(WIDTH)


def _value_type(array: Any) -> Any:
    """What a row of a workspace of this Numba type holds."""
    return types.float64 if array.ndim == 1 else _LANES


def _as(context: Any, builder: Any, value: Any, given: Any, wanted: Any) -> Any:
    """A value in LLVM, spread over the lanes where it is one number."""
    if given == wanted:
        return value
    if not isinstance(given, Lanes):
        value = context.cast(builder, value, given, types.float64)
    if not isinstance(wanted, Lanes):
        return value
    vector = ir.VectorType(ir.DoubleType(), wanted.width)
    first = builder.insert_element(
        ir.Constant(vector, ir.Undefined), value, ir.Constant(ir.IntType(32), 0)
    )
    mask = ir.Constant(ir.VectorType(ir.IntType(32), wanted.width), [0] * wanted.width)
    return builder.shuffle_vector(first, ir.Constant(vector, ir.Undefined), mask)


def _widest(*given: Any) -> Any:
    """The type that a result of these has; None where one of them is no number."""
    if any(isinstance(t, Lanes) for t in given):
        return _LANES
    return types.float64


def _define(operation: Any, instruction: str) -> None:
    """`a operation b` where one of them is lanes."""

    @infer_global(operation)
    class Template(AbstractTemplate):  # type: ignore[misc]
        def generic(self, args: Any, kws: Any) -> Any:
            lanes = [a for a in args if isinstance(a, Lanes)]
            if len(args) != 2 or not lanes:
                return None
            if not all(isinstance(a, Lanes | types.Float | types.Integer) for a in args):
                return None
            return signature(_LANES, *args)

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        a, b = (
            _as(context, builder, value, given, sig.return_type)
            for value, given in zip(args, sig.args, strict=True)
        )
        return getattr(builder, instruction)(a, b, flags=_FLAGS)

    for left, right in ((Lanes, Lanes), (Lanes, types.Number), (types.Number, Lanes)):
        lower_builtin(operation, left, right)(lower)


_define(operator.add, "fadd")
_define(operator.sub, "fsub")
_define(operator.mul, "fmul")
_define(operator.truediv, "fdiv")


@infer_global(operator.neg)
class _Negative(AbstractTemplate):  # type: ignore[misc]
    def generic(self, args: Any, kws: Any) -> Any:
        return signature(_LANES, *args) if isinstance(args[0], Lanes) else None


def _negative(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.fneg(args[0])


lower_builtin(operator.neg, Lanes)(_negative)


def _primitive(function: Callable[..., Any]) -> Any:
    return intrinsic(inspect.unwrap(function))


def _pointer(context: Any, builder: Any, sig: Any, args: Any) -> tuple[Any, Any]:
    """Address of a row of the workspace, and the type there."""
    value = context.get_value_type(_value_type(sig.args[0]))
    array = cgutils.create_struct_proxy(sig.args[0])(context, builder, value=args[0])
    width = 1 if sig.args[0].ndim == 1 else WIDTH
    row = context.cast(builder, args[1], sig.args[1], types.intp)
    index = builder.mul(row, ir.Constant(row.type, width))
    return builder.bitcast(builder.gep(array.data, [index]), value.as_pointer()), value


@_primitive
def load(typing: Any, W: Any, row: Any) -> Any:
    """The value in a row of a workspace."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        pointer, _ = _pointer(context, builder, sig, args)
        return builder.load(pointer, align=8)

    return _value_type(W)(W, row), generate


@_primitive
def store(typing: Any, W: Any, row: Any, value: Any) -> Any:
    """Write a value, or one number for all lanes, into a row of a workspace."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        pointer, _ = _pointer(context, builder, sig, args)
        spread = _as(context, builder, args[2], sig.args[2], _value_type(sig.args[0]))
        builder.store(spread, pointer, align=8)
        return context.get_dummy_value()

    return types.void(W, row, value), generate


@_primitive
def splat(typing: Any, W: Any, number: Any) -> Any:
    """One number as a value of a workspace."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return _as(context, builder, args[1], sig.args[1], _value_type(sig.args[0]))

    return _value_type(W)(W, number), generate


@_primitive
def where_less(typing: Any, a: Any, b: Any, then: Any, otherwise: Any) -> Any:
    """`then` where a < b, else `otherwise` (also where a or b is not a number)."""
    wanted = _widest(a, b, then, otherwise)

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        left, right, yes, no = (
            _as(context, builder, value, given, sig.return_type)
            for value, given in zip(args, sig.args, strict=True)
        )
        return builder.select(builder.fcmp_ordered("<", left, right), yes, no)

    return wanted(a, b, then, otherwise), generate


@_primitive
def any_less(typing: Any, a: Any, b: Any) -> Any:
    """Whether a < b for any of the postures."""
    wanted = _widest(a, b)

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        left, right = (
            _as(context, builder, value, given, wanted)
            for value, given in zip(args, sig.args, strict=True)
        )
        less = builder.fcmp_ordered("<", left, right)
        if not isinstance(wanted, Lanes):
            return less
        bits = builder.bitcast(less, ir.IntType(wanted.width))
        return builder.icmp_unsigned("!=", bits, ir.Constant(bits.type, 0))

    return types.boolean(a, b), generate


@_primitive
def get(typing: Any, W: Any, row: Any, lane: Any) -> Any:
    """One posture's number in a row of a workspace."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.load(_element(context, builder, sig, args), align=8)

    return types.float64(W, row, lane), generate


@_primitive
def put(typing: Any, W: Any, row: Any, lane: Any, number: Any) -> Any:
    """Write one posture's number into a row of a workspace."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        value = context.cast(builder, args[3], sig.args[3], types.float64)
        builder.store(value, _element(context, builder, sig, args), align=8)
        return context.get_dummy_value()

    return types.void(W, row, lane, number), generate


def _array_at(kind: Any) -> Any:
    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        address, size = (
            context.cast(builder, value, given, types.intp)
            for value, given in zip(args, sig.args, strict=True)
        )
        array = context.make_array(sig.return_type)(context, builder)
        width = context.get_constant(types.intp, 8)
        context.populate_array(
            array,
            data=builder.inttoptr(address, array.data.type),
            shape=cgutils.pack_array(builder, [size]),
            strides=cgutils.pack_array(builder, [width]),
            itemsize=width,
            meminfo=None,
        )
        return array._getvalue()

    return lambda address, size: (types.Array(kind, 1, "C")(address, size), generate)


@_primitive
def floats_at(typing: Any, address: Any, size: Any) -> Any:
    """The floats that lie at an address, whose owner has to outlive them: nobody counts."""
    return _array_at(types.float64)(address, size)


@_primitive
def whole_at(typing: Any, address: Any, size: Any) -> Any:
    """The whole numbers that lie at an address, likewise."""
    return _array_at(types.int64)(address, size)


def _element(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    pointer, _ = _pointer(context, builder, sig, args)
    number = ir.DoubleType().as_pointer()
    lane = context.cast(builder, args[2], sig.args[2], types.intp)
    return builder.gep(builder.bitcast(pointer, number), [lane])


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


@_primitive
def read_lanes(typing: Any, W: Any, row: Any, array: Any, starts: Any) -> Any:
    """Into `WIDTH` rows of a workspace of lanes: array.flat[start :][:WIDTH], a posture each."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        at = [builder.extract_value(args[3], k) for k in range(WIDTH)]
        found = _addresses(context, builder, sig.args[2], args[2], at)
        columns = _transposed(builder, [builder.load(p, align=8) for p in found])
        step = ir.Constant(args[1].type, 1)
        index = args[1]
        for column in columns:
            pointer, _ = _pointer(context, builder, sig, (args[0], index))
            builder.store(column, pointer, align=8)
            index = builder.add(index, step)
        return context.get_dummy_value()

    return types.void(W, types.intp, array, types.UniTuple(types.intp, WIDTH)), generate


@_primitive
def write_lanes(typing: Any, W: Any, row: Any, array: Any, start: Any, stride: Any) -> Any:
    """From `WIDTH` rows: array.flat[start + stride * lane :][:WIDTH] of each posture."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        step = ir.Constant(args[1].type, 1)
        index, rows, at, places = args[1], [], args[3], []
        for _ in range(WIDTH):
            pointer, _kind = _pointer(context, builder, sig, (args[0], index))
            rows.append(builder.load(pointer, align=8))
            index = builder.add(index, step)
            places.append(at)
            at = builder.add(at, args[4])
        found = _addresses(context, builder, sig.args[2], args[2], places)
        for value, place in zip(_transposed(builder, rows), found, strict=True):
            builder.store(value, place, align=8)
        return context.get_dummy_value()

    return types.void(W, types.intp, array, types.intp, types.intp), generate


def _map(name: str) -> Any:
    """One of LLVM's functions of a number, lane by lane."""

    def function(typing: Any, x: Any) -> Any:
        def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            value = context.get_value_type(sig.return_type)
            suffix = f"v{WIDTH}f64" if isinstance(sig.return_type, Lanes) else "f64"
            kind = ir.FunctionType(value, [value])
            found = cgutils.get_or_insert_function(builder.module, kind, f"{name}.{suffix}")
            return builder.call(found, args)

        return _widest(x)(x), generate

    function.__name__ = name.removeprefix("llvm.")
    return intrinsic(function)


root = _map("llvm.sqrt")
floor = _map("llvm.floor")
magnitude = _map("llvm.fabs")
