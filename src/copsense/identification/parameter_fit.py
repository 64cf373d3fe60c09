"""ParameterFit: the parameters of a family that explain measurements best, and how well known."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from copsense.content import ShortRepr, freeze
from copsense.criterion import Criterion


@dataclass(frozen=True)
class Estimate:
    """A parameter and its 95 % interval.

    Attributes:
        value: the estimate; NaN where the parameter is ``"none"``.
        low: lower end; NaN where it is not identified.
        high: upper end.
        state: ``"identified"``; ``"not identified"``: the measurements do not see it, and it stays
            where it was; ``"none"``: it went to its bound, so that what it scales is not there;
            ``"at bound"``: it went to the other bound.
        encoders: standard deviation that the encoders' constant errors give the parameter's
            logarithm; it is in the interval.
    """

    value: float
    low: float
    high: float
    state: str = "identified"
    encoders: float = 0.0

    def __str__(self) -> str:
        """Value and interval, or why there is none."""
        if self.state != "identified":
            return self.state if math.isnan(self.value) else f"{self.value:.4g} ({self.state})"
        return f"{self.value:.4g} [{self.low:.4g}, {self.high:.4g}]"


@dataclass(frozen=True, eq=False, repr=False)
class ParameterFit(ShortRepr):
    """A family of criteria fitted to measurements.

    Attributes:
        family: its name.
        criterion: the best one found.
        estimates: parameter -> estimate.
        singular_values: of the sensitivity of the scaled measurements to the parameters'
            logarithms, falling; one with next to none is a direction that is not seen.
        directions: the directions that belong to them (p, p), rows over the parameters'
            logarithms.
        unseen: rows of `directions` that the measurements do not determine.
        offsets: of each channel (c,), measured less predicted, its unit.
        errors: root mean square of what is left of each channel (c,).
        effective: how many independent rows they are worth, all channels together.
        steps: of Gauss-Newton.
        converged: whether it settled.
    """

    family: str
    criterion: Criterion
    estimates: Mapping[str, Estimate]
    singular_values: Float[np.ndarray, " p"]
    directions: Float[np.ndarray, "p p"]
    unseen: tuple[int, ...]
    offsets: Float[np.ndarray, " c"]
    errors: Float[np.ndarray, " c"]
    effective: float
    steps: int
    converged: bool

    def __post_init__(self) -> None:
        """Own the arrays and the estimates."""
        freeze(self, "estimates", "singular_values", "directions", "offsets", "errors")

    @property
    def unseen_text(self) -> tuple[str, ...]:
        """The combinations of parameters that are not seen, in words."""
        found = []
        for i in self.unseen:
            powers = self.directions[i]
            powers = powers * np.sign(powers[int(np.argmax(np.abs(powers)))])
            parts = [
                f"{name}^{power:+.2f}"
                for name, power in zip(self.estimates, powers, strict=True)
                if abs(power) > 0.05
            ]
            found.append(" ".join(parts))
        return tuple(found)

    def to_dict(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "family": self.family,
            "parameters": {name: asdict(e) for name, e in self.estimates.items()},
            "singular_values": self.singular_values.tolist(),
            "directions": self.directions.tolist(),
            "not_seen": list(self.unseen_text),
            "offsets": self.offsets.tolist(),
            "errors": self.errors.tolist(),
            "effective_samples": self.effective,
            "steps": self.steps,
            "converged": self.converged,
        }
