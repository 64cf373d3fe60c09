"""Centres of pressure as a differentiable function for PyTorch.

`CopFunction` is a module: its input is a batch of postures, its output where each contact's centre
of pressure is, or also how far it is from the sole's edge and how far the CoM may travel, with
exact gradients. The work is done by the compiled batch on the processor; nothing is done posture by
posture in Python.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from copsense.extras import require

require("torch", "copsense.torch")

import numpy as np
import torch

from copsense.criterion import Criterion
from copsense.errors import InvalidInputError
from copsense.learning.cop_map import CopMap
from copsense.limits import Limits
from copsense.stance import Stance

_DTYPES = (torch.float64, torch.float32)
_TWICE = (
    "copsense gives first derivatives only: a second derivative through the centre of pressure was "
    "asked for. Detach its gradient, or take finite differences of it."
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

    cop: torch.Tensor
    margin: torch.Tensor
    travel: torch.Tensor
    valid: torch.Tensor


class CopFunction(torch.nn.Module):  # type: ignore[misc]
    """Centres of pressure as a function of the posture.

    Inputs are what `copsense.learning.CopMap` takes: values of named coordinates (..., k), or
    whole configurations (..., nq), in float64 or float32 on the processor. Everything is computed
    in float64.

    Attributes:
        map: the function of NumPy's arrays behind it.
    """

    map: CopMap

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
            invalid: what becomes of a posture that cannot be evaluated: ``"raise"`` an error, or
                ``"mask"`` it.
            threads: threads that share the postures.
        """
        super().__init__()
        self.map = CopMap(
            stance,
            criterion,
            coordinates,
            limits,
            within=within,
            invalid=invalid,
            threads=threads,
        )

    @property
    def start(self) -> torch.Tensor:
        """The inputs of the stance itself (k,), float64."""
        return torch.from_numpy(self.map.start)

    def extra_repr(self) -> str:
        """What is computed of what."""
        return repr(self.map)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Centres of pressure (..., nc, 2), contact axes [m].

        Args:
            x: the inputs (..., k).

        Raises:
            InvalidInputError: another type, shape, or device than the processor.
            UnreachablePostureError: a posture cannot be evaluated, and none may be left out.
        """
        return _Cop.apply(_checked(x, self.map), self.map, False)[0]

    def values(self, x: torch.Tensor) -> CopValues:
        """Centres of pressure, margins and travels, and which postures are valid.

        The travel's gradient is by differences of fourth order: four evaluations for each input,
        and none where it is not asked for.

        Args:
            x: the inputs (..., k).

        Raises:
            InvalidInputError: another type, shape, or device than the processor.
            UnreachablePostureError: a posture cannot be evaluated, and none may be left out.
        """
        return CopValues(*_Cop.apply(_checked(x, self.map), self.map, True)[:4])


def _checked(x: torch.Tensor, cops: CopMap) -> torch.Tensor:
    if not isinstance(x, torch.Tensor):
        raise InvalidInputError(
            f"the input is of type {type(x).__name__}. Give a torch.Tensor (torch.as_tensor)."
        )
    cops.check_shape(x.shape)
    if x.dtype not in _DTYPES:
        raise InvalidInputError(
            f"the input is of {x.dtype}. Give torch.float64, or torch.float32: both are computed "
            "in float64 and come back as they were given."
        )
    if x.device.type != "cpu":
        raise InvalidInputError(
            f"the input is on {x.device}, but the compiled batch runs on the processor. Give "
            "x.cpu(); its output goes back with .to(x.device), and the gradient with it."
        )
    return x


def _numpy(tensor: torch.Tensor, last: int) -> np.ndarray:
    """A tensor's rows in float64, all but the last axes in one."""
    array = tensor.detach().numpy().astype(np.float64, copy=False)
    return array.reshape(-1, *array.shape[array.ndim - last :])


class _Cop(torch.autograd.Function):  # type: ignore[misc]
    """Values of a batch; its gradient is kept beside them."""

    @staticmethod
    def forward(x: torch.Tensor, cops: CopMap, travel: bool) -> tuple[torch.Tensor, ...]:
        found = cops.evaluate(_numpy(x, 1), everything=travel)
        batch = x.shape[:-1]

        def as_given(array: np.ndarray) -> torch.Tensor:
            tensor = torch.from_numpy(array)
            kind = tensor.dtype if tensor.dtype == torch.bool else x.dtype
            return tensor.to(kind).reshape((*batch, *array.shape[1:]))

        return tuple(as_given(array) for array in found.arrays(travel))

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: tuple[torch.Tensor, ...]) -> None:
        x, ctx.cops, ctx.travel = inputs
        valid, gradient, inward = output[3:]
        ctx.mark_non_differentiable(valid, gradient, inward)
        ctx.save_for_backward(x, valid, gradient, inward)
        ctx.set_materialize_grads(False)

    @staticmethod
    def backward(ctx: Any, *grads: torch.Tensor | None) -> tuple[torch.Tensor | None, None, None]:
        x, valid, gradient, inward = ctx.saved_tensors
        cop, margin, travel = grads[:3]
        slope = None
        if cop is not None or margin is not None:
            cop = inward.new_zeros(inward.shape) if cop is None else cop
            margin = inward.new_zeros(inward.shape[:-1]) if margin is None else margin
            slope = _Pull.apply(x, cop, margin, valid, gradient, inward)
        if travel is not None and ctx.travel:
            more = _TravelPull.apply(x, travel, valid, ctx.cops)
            slope = more if slope is None else slope + more
        return slope, None, None

    @staticmethod
    def vmap(
        info: Any, in_dims: tuple[Any, ...], x: torch.Tensor, cops: CopMap, travel: bool
    ) -> Any:
        if in_dims[0] is not None:
            x = x.movedim(in_dims[0], 0)
            return _Cop.apply(x, cops, travel), (0,) * 6
        return _Cop.apply(x, cops, travel), (None,) * 6


class _Once(torch.autograd.Function):  # type: ignore[misc]
    """A gradient that is not differentiated once more."""

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: torch.Tensor) -> None:
        """Nothing is kept."""

    @staticmethod
    def backward(ctx: Any, *grads: torch.Tensor | None) -> Any:
        raise InvalidInputError(_TWICE)


class _Pull(_Once):
    """Gradients over CoPs and margins as gradients over the inputs."""

    generate_vmap_rule = True

    @staticmethod
    def forward(
        x: torch.Tensor,  # so that a second derivative passes here
        cop: torch.Tensor,
        margin: torch.Tensor,
        valid: torch.Tensor,
        gradient: torch.Tensor,
        inward: torch.Tensor,
    ) -> torch.Tensor:
        # What comes back through a posture that is not valid may be NaN: it has no gradient.
        on = valid[..., None, None]
        along = torch.where(on, cop + margin[..., None] * inward, torch.zeros_like(inward))
        return torch.einsum("...ij,...ijk->...k", along, gradient)


class _TravelPull(_Once):
    """Gradients over travels as gradients over the inputs."""

    @staticmethod
    def forward(
        x: torch.Tensor, travel: torch.Tensor, valid: torch.Tensor, cops: CopMap
    ) -> torch.Tensor:
        share = np.where(_numpy(valid, 0)[:, None] != 0.0, _numpy(travel, 1), 0.0)
        slope = cops.travel_gradient(_numpy(x, 1), share)
        return torch.from_numpy(slope).to(x.dtype).reshape(x.shape)

    @staticmethod
    def vmap(info: Any, in_dims: tuple[Any, ...], *args: Any) -> Any:
        size = info.batch_size
        tensors = [
            a.movedim(d, 0) if d is not None else a.expand(size, *a.shape)
            for a, d in zip(args[:3], in_dims[:3], strict=True)
        ]
        return _TravelPull.apply(*tensors, args[3]), 0
