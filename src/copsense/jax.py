"""Centres of pressure as a differentiable function for JAX.

`CopFunction` is a pure function for `jax.grad`, `jax.jit` and `jax.vmap`: its input is a batch of
postures, its output where each contact's centre of pressure is, or also how far it is from the
sole's edge and how far the CoM may travel, with exact gradients. The work is done by the compiled
batch on the host (`jax.pure_callback`); nothing is done posture by posture in Python.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

from copsense.extras import require

require("jax", "copsense.jax")

import jax
import jax.numpy as jnp
import numpy as np

from copsense.criterion import Criterion
from copsense.errors import InvalidInputError
from copsense.learning.cop_map import CopMap
from copsense.limits import Limits
from copsense.stance import Stance

_TWICE = (
    "copsense gives first derivatives by reverse mode only (jax.grad, jax.vjp, jax.jacrev): "
    "forward mode, or a second derivative through the centre of pressure, was asked for. Take "
    "jax.lax.stop_gradient of its gradient, or finite differences of it."
)


class CopValues(NamedTuple):
    """What a posture says of its balance; of one that is not valid every number is NaN.

    Attributes:
        cop: centres of pressure (..., nc, 2), contact axes [m].
        margin: signed distance of each to its sole's nearest edge (..., nc) [m]; infinite without a
            sole.
        travel: first-order distance of the CoM to tipping (..., nc), as
            `copsense.CopSensitivity.com_travel` [m].
        valid: whether the posture exists and has values (...,).
    """

    cop: jax.Array
    margin: jax.Array
    travel: jax.Array
    valid: jax.Array


class CopFunction:
    """Centres of pressure as a function of the posture.

    Inputs are what `copsense.learning.CopMap` takes: values of named coordinates (..., k), or
    whole configurations (..., nq), in float32, or float64 where JAX has it
    (``jax.config.update("jax_enable_x64", True)``). Everything is computed in float64.

    Attributes:
        map: the function of NumPy's arrays behind it.
    """

    map: CopMap

    def __repr__(self) -> str:
        """What is computed of what."""
        return f"CopFunction({self.map!r})"

    def __init__(
        self,
        stance: Stance,
        criterion: Criterion,
        coordinates: Sequence[str] | None = None,
        limits: Limits | None = None,
        *,
        within: float = 1e-3,
        invalid: str = "raise",
        threads: int = 1,
    ) -> None:
        """Set it up; arguments and errors are those of `copsense.learning.CopMap`.

        Args:
            stance: robot and contacts.
            criterion: how the load is shared.
            coordinates: of a `copsense.batch.PostureChart`; None for whole configurations.
            limits: what wrenches and torques must respect.
            within: how far a configuration may be from its contacts [m, rad].
            invalid: what becomes of a posture that cannot be evaluated: ``"raise"`` an error, which
                JAX hands on as one of its own, or ``"mask"`` it.
            threads: threads that share the postures.
        """
        self.map = CopMap(
            stance,
            criterion,
            coordinates,
            limits,
            within=within,
            invalid=invalid,
            threads=threads,
        )
        self._cop, self._values = (_differentiable(self.map, travel) for travel in (False, True))

    @property
    def start(self) -> jax.Array:
        """The inputs of the stance itself (k,)."""
        return jnp.asarray(self.map.start)

    def __call__(self, x: jax.Array | np.ndarray) -> jax.Array:
        """Centres of pressure (..., nc, 2), contact axes [m].

        Args:
            x: the inputs (..., k).

        Raises:
            InvalidInputError: another type or shape.
        """
        return self._cop(_checked(x, self.map))[0]

    def values(self, x: jax.Array | np.ndarray) -> CopValues:
        """Centres of pressure, margins and travels, and which postures are valid.

        The travel's gradient is by differences of fourth order: four evaluations for each input,
        and none where it is not asked for.

        Args:
            x: the inputs (..., k).

        Raises:
            InvalidInputError: another type or shape.
        """
        return CopValues(*self._values(_checked(x, self.map)))


def _checked(x: jax.Array | np.ndarray, cops: CopMap) -> jax.Array:
    if not isinstance(x, jax.Array | np.ndarray):
        raise InvalidInputError(
            f"the input is of type {type(x).__name__}. Give a jax.Array (jax.numpy.asarray)."
        )
    cops.check_shape(x.shape)
    if x.dtype not in (jnp.float64, jnp.float32):
        raise InvalidInputError(
            f"the input is of {x.dtype}. Give float64, or float32: both are computed in float64 "
            "and come back as they were given."
        )
    return jnp.asarray(x)


def _differentiable(cops: CopMap, travel: bool) -> Any:
    """A function of the inputs with a gradient of its own."""

    @jax.custom_vjp  # type: ignore[untyped-decorator]
    def values(x: jax.Array) -> tuple[jax.Array, ...]:
        return _evaluate(cops, travel, x)[: 4 if travel else 2]

    def forward(x: jax.Array) -> Any:
        *found, gradient, inward = _evaluate(cops, travel, x)
        return tuple(found[: 4 if travel else 2]), (x, found[3], gradient, inward)

    def backward(kept: Any, grads: tuple[Any, ...]) -> tuple[jax.Array]:
        x, valid, gradient, inward = kept
        # What comes back through a posture that is not valid may be NaN: it has no gradient.
        along = jnp.where(valid[..., None, None], grads[0] + grads[1][..., None] * inward, 0.0)
        slope = jnp.einsum("...ij,...ijk->...k", along, gradient)
        if travel:
            share = jnp.where(valid[..., None], grads[2], 0.0)
            slope = slope + _pull_travel(cops, x, share)
        return (_once(slope),)

    values.defvjp(forward, backward)
    return values


def _evaluate(cops: CopMap, travel: bool, x: jax.Array) -> tuple[jax.Array, ...]:
    """cop, margin, travel, valid, gradient and the margins' own."""
    nc, k, batch = len(cops.contacts), len(cops.inputs), x.shape[:-1]
    ends = ((nc, 2), (nc,), (nc if travel else 0,), (), (nc, 2, k), (nc, 2))
    kinds = tuple(jnp.bool_ if end == () else x.dtype for end in ends)

    def compute(given: Any) -> tuple[np.ndarray, ...]:
        rows = np.asarray(given, dtype=np.float64)
        found = cops.evaluate(rows.reshape(-1, k), everything=travel)
        return tuple(
            array.reshape(*rows.shape[:-1], *end).astype(kind)
            for array, end, kind in zip(found.arrays(travel), ends, kinds, strict=True)
        )

    if not isinstance(x, jax.core.Tracer):  # errors as they are, and no detour
        return tuple(jnp.asarray(array) for array in compute(x))
    shapes = tuple(
        jax.ShapeDtypeStruct((*batch, *end), kind) for end, kind in zip(ends, kinds, strict=True)
    )
    return tuple(_call_back(compute, shapes, _once(x)))


def _pull_travel(cops: CopMap, x: jax.Array, share: jax.Array) -> jax.Array:
    """Gradients over travels as gradients over the inputs."""

    def compute(given: Any, weights: Any) -> np.ndarray:
        rows, parts = (np.asarray(a, dtype=np.float64) for a in (given, weights))
        flat = parts.reshape(-1, parts.shape[-1])
        found = cops.travel_gradient(rows.reshape(-1, rows.shape[-1]), flat)
        return found.reshape(rows.shape).astype(x.dtype)

    if not isinstance(x, jax.core.Tracer) and not isinstance(share, jax.core.Tracer):
        return jnp.asarray(compute(x, share))
    return _call_back(compute, jax.ShapeDtypeStruct(x.shape, x.dtype), x, share)


_call_back = partial(jax.pure_callback, vmap_method="broadcast_all")


@jax.custom_jvp  # type: ignore[untyped-decorator]
def _once(x: jax.Array) -> jax.Array:
    """The same; it is not differentiated."""
    return x


@_once.defjvp  # type: ignore[untyped-decorator]
def _reject(primals: Any, tangents: Any) -> Any:
    raise InvalidInputError(_TWICE)
