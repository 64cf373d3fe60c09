"""Lanes: several postures abreast in one value, and the plain arithmetic on it.

A kernel is written as if for one posture. Its numbers live in the rows of a workspace W (rows,
`WIDTH`), and a value is a row of it: `WIDTH` floats that the processor handles abreast (LLVM's
vector type: one AVX-512 register, two of AVX2, four of SSE2). No lane ever reads another, so a
posture's result does not depend on its neighbours, to the last bit.

This module and `transfer` alone know the vector type; kernels use the functions below, and the
operators + - * / on values and numbers.
"""

from __future__ import annotations

import inspect
import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, register_model

from copsense.batch.workspace import WIDTH

Value = Any  # what a kernel computes with: a float for each lane

_FLAGS = ("contract",)  # a * b + c in one instruction; nothing is reordered
_VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)


class Lanes(types.Type):  # type: ignore[misc]
    """Numba's type of `WIDTH` floats abreast."""

    def __init__(self) -> None:
        """Name it for Numba's messages."""
        super().__init__(name=f"Lanes({WIDTH})")


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):  # type: ignore[misc]
    """How lanes lie in memory: one vector."""

    def __init__(self, dmm: Any, fe_type: Any) -> None:
        super().__init__(dmm, fe_type, _VECTOR)


LANES = Lanes()


def primitive(function: Callable[..., Any]) -> Any:
    """A function that kernels call and that generates LLVM's instructions itself."""
    return intrinsic(inspect.unwrap(function))


def row_pointer(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    """Address in LLVM of a row of a workspace, the first two of the arguments."""
    array = cgutils.create_struct_proxy(sig.args[0])(context, builder, value=args[0])
    row = context.cast(builder, args[1], sig.args[1], types.intp)
    index = builder.mul(row, ir.Constant(row.type, WIDTH))
    return builder.bitcast(builder.gep(array.data, [index]), _VECTOR.as_pointer())


def _spread(context: Any, builder: Any, value: Any, given: Any) -> Any:
    """A value in LLVM; one number is spread over the lanes."""
    if isinstance(given, Lanes):
        return value
    number = context.cast(builder, value, given, types.float64)
    undefined = ir.Constant(_VECTOR, ir.Undefined)
    first = builder.insert_element(undefined, number, ir.Constant(ir.IntType(32), 0))
    mask = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
    return builder.shuffle_vector(first, undefined, mask)


def _spread_all(context: Any, builder: Any, sig: Any, args: Any) -> list[Any]:
    return [_spread(context, builder, a, t) for a, t in zip(args, sig.args, strict=True)]


def _define(operation: Any, instruction: str) -> None:
    """`a operation b` where one of them is lanes."""

    @infer_global(operation)
    class Template(AbstractTemplate):  # type: ignore[misc]
        """The operation's type: lanes."""

        def generic(self, args: Any, kws: Any) -> Any:
            if len(args) != 2 or not any(isinstance(a, Lanes) for a in args):
                return None
            if not all(isinstance(a, Lanes | types.Float | types.Integer) for a in args):
                return None
            return signature(LANES, *args)

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        a, b = _spread_all(context, builder, sig, args)
        return getattr(builder, instruction)(a, b, flags=_FLAGS)

    for left, right in ((Lanes, Lanes), (Lanes, types.Number), (types.Number, Lanes)):
        lower_builtin(operation, left, right)(lower)


_define(operator.add, "fadd")
_define(operator.sub, "fsub")
_define(operator.mul, "fmul")
_define(operator.truediv, "fdiv")


@infer_global(operator.neg)
class _Negative(AbstractTemplate):  # type: ignore[misc]
    """The type of minus lanes: lanes."""

    def generic(self, args: Any, kws: Any) -> Any:
        return signature(LANES, *args) if isinstance(args[0], Lanes) else None


def _negative(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.fneg(args[0])


lower_builtin(operator.neg, Lanes)(_negative)


@primitive
def load(typing: Any, W: Any, row: Any) -> Any:
    """The value in a row of a workspace."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.load(row_pointer(context, builder, sig, args), align=8)

    return LANES(W, row), generate


@primitive
def store(typing: Any, W: Any, row: Any, value: Any) -> Any:
    """Write a value, or one number for all lanes, into a row of a workspace."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        spread = _spread(context, builder, args[2], sig.args[2])
        builder.store(spread, row_pointer(context, builder, sig, args), align=8)
        return context.get_dummy_value()

    return types.void(W, row, value), generate


@primitive
def splat(typing: Any, number: Any) -> Any:
    """One number as a value."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return _spread(context, builder, args[0], sig.args[0])

    return LANES(number), generate


@primitive
def where_less(typing: Any, a: Any, b: Any, then: Any, otherwise: Any) -> Any:
    """`then` where a < b, else `otherwise` (also where a or b is not a number)."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        left, right, yes, no = _spread_all(context, builder, sig, args)
        return builder.select(builder.fcmp_ordered("<", left, right), yes, no)

    return LANES(a, b, then, otherwise), generate


@primitive
def any_less(typing: Any, a: Any, b: Any) -> Any:
    """Whether a < b for any of the postures."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        left, right = _spread_all(context, builder, sig, args)
        less = builder.fcmp_ordered("<", left, right)
        bits = builder.bitcast(less, ir.IntType(WIDTH))
        return builder.icmp_unsigned("!=", bits, ir.Constant(bits.type, 0))

    return types.boolean(a, b), generate


@primitive
def least(typing: Any, x: Any) -> Any:
    """The smallest of a value's numbers."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        kind = ir.FunctionType(ir.DoubleType(), [_VECTOR])
        name = f"llvm.vector.reduce.fmin.v{WIDTH}f64"
        return builder.call(cgutils.get_or_insert_function(builder.module, kind, name), args)

    return types.float64(x), generate


@primitive
def get(typing: Any, W: Any, row: Any, lane: Any) -> Any:
    """One posture's number in a row of a workspace."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.load(_element(context, builder, sig, args), align=8)

    return types.float64(W, row, lane), generate


@primitive
def put(typing: Any, W: Any, row: Any, lane: Any, number: Any) -> Any:
    """Write one posture's number into a row of a workspace."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        value = context.cast(builder, args[3], sig.args[3], types.float64)
        builder.store(value, _element(context, builder, sig, args), align=8)
        return context.get_dummy_value()

    return types.void(W, row, lane, number), generate


def _element(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    pointer = row_pointer(context, builder, sig, args)
    lane = context.cast(builder, args[2], sig.args[2], types.intp)
    return builder.gep(builder.bitcast(pointer, ir.DoubleType().as_pointer()), [lane])


def _map(name: str) -> Any:
    """One of LLVM's functions of a number, lane by lane."""

    def function(typing: Any, x: Any) -> Any:
        def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            kind = ir.FunctionType(_VECTOR, [_VECTOR])
            suffix = f"{name}.v{WIDTH}f64"
            found = cgutils.get_or_insert_function(builder.module, kind, suffix)
            return builder.call(found, _spread_all(context, builder, sig, args))

        return LANES(x), generate

    function.__name__ = name.removeprefix("llvm.")
    return intrinsic(function)


root: Any = _map("llvm.sqrt")
floor: Any = _map("llvm.floor")
magnitude: Any = _map("llvm.fabs")
