"""Vectors: arithmetic in space on the values of a kernel, and the sine and cosine of angles."""

from __future__ import annotations

import math
from typing import Any

from copsense.batch.compiler import compiled
from copsense.batch.lanes import Value, floor, load, magnitude, store, where_less

Vector = tuple[Any, Any, Any]

# sin and cos by the Cephes library's polynomials (S. Moshier) on |r| <= pi/4, after taking off
# n pi/2 in three parts (Cody and Waite): within 1 ulp of the true value up to `LARGEST_ANGLE`.
LARGEST_ANGLE = 1e5
_HALF_PI = (1.5707963109016418, 1.5893254712295857e-08, 6.123233995736766e-17)


@compiled
def sine_cosine(x: Value) -> tuple[Value, Value]:
    """Sine and cosine of an angle [rad]."""
    n = floor(x * (2.0 / math.pi) + 0.5)
    r = x - n * _HALF_PI[0]
    r = r - n * _HALF_PI[1]
    r = r - n * _HALF_PI[2]
    z = r * r
    s = 1.58962301576546568060e-10 * z - 2.50507477628578072866e-8
    s = s * z + 2.75573136213857245213e-6
    s = s * z - 1.98412698295895385996e-4
    s = s * z + 8.33333333332211858878e-3
    s = s * z - 1.66666666666666307295e-1
    s = r + r * z * s
    c = -1.13585365213876817300e-11 * z + 2.08757008419747316778e-9
    c = c * z - 2.75573141792967388112e-7
    c = c * z + 2.48015872888517045348e-5
    c = c * z - 1.38888888888730564116e-3
    c = c * z + 4.16666666666665929218e-2
    c = 1.0 - 0.5 * z + z * z * c
    # The quadrant n mod 4: odd ones exchange the two, 2 and 3 turn the sine, 1 and 2 the cosine.
    half = n * 0.5
    odd = half - floor(half)  # 0 or 1/2
    quarter = n * 0.25
    turn = quarter - floor(quarter)  # 0, 1/4, 1/2, 3/4
    sine = where_less(odd, 0.25, s, c)
    cosine = where_less(odd, 0.25, c, s)
    sine = where_less(turn, 0.49, sine, -sine)
    cosine = where_less(magnitude(turn - 0.375), 0.2, -cosine, cosine)
    return sine, cosine


@compiled
def load3(W: Any, row: int) -> Vector:
    """Three rows as a vector."""
    return load(W, row), load(W, row + 1), load(W, row + 2)


@compiled
def store3(W: Any, row: int, a: Vector) -> None:
    """A vector into three rows."""
    store(W, row, a[0])
    store(W, row + 1, a[1])
    store(W, row + 2, a[2])


@compiled
def add3(a: Vector, b: Vector) -> Vector:
    """a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@compiled
def sub3(a: Vector, b: Vector) -> Vector:
    """a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@compiled
def scale3(s: Value, a: Vector) -> Vector:
    """s a."""
    return s * a[0], s * a[1], s * a[2]


@compiled
def dot3(a: Vector, b: Vector) -> Value:
    """a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def cross3(a: Vector, b: Vector) -> Vector:
    """a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compiled
def across(W: Any, row: int, a: Vector) -> Vector:
    """R a, the columns of R in nine rows."""
    return add3(
        add3(scale3(a[0], load3(W, row)), scale3(a[1], load3(W, row + 3))),
        scale3(a[2], load3(W, row + 6)),
    )


@compiled
def along(W: Any, row: int, a: Vector) -> Vector:
    """R' a, the columns of R in nine rows."""
    return dot3(load3(W, row), a), dot3(load3(W, row + 3), a), dot3(load3(W, row + 6), a)
