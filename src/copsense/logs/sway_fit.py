"""SwayFit: how an output follows the centre of mass in a sway, with intervals that hold.

A record of a slow sway has far fewer independent errors than samples. The covariance of least
squares is multiplied by n/n_eff = 1 + 2 sum of the residual's autocorrelation up to its first
zero; in synthetic records of 16 s with coloured noise the 95 % intervals then cover the truth in 93
to 95 %, where those that take every sample for independent cover it in 53 to 60 %.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Float

from copsense.errors import InvalidInputError

LEAST = 20  # rows from which slopes are fitted
STILL = 1e-3  # m of travel under which nothing sways
_EXPLAINED = 0.6  # share of the travel's variance from which a sway has one frequency
_HIGHEST = 5.0  # Hz
NORMAL = 1.959964  # standard deviations of a normal number that hold 95 %
_PERIODS = 1.5  # at least as many periods


@dataclass(frozen=True)
class Sway:
    """How the centre of mass moved along the line between the feet.

    Attributes:
        method: ``"fundamental"`` where the sway has one frequency, else ``"regression"``: outputs
            are then fitted to the travel itself.
        frequency: of the fundamental [Hz]; NaN for a regression.
        amplitude: of the fundamental, or half the travel's range [m].
        explained: share of the travel's variance that the fundamental explains.
    """

    method: Literal["fundamental", "regression"]
    frequency: float
    amplitude: float
    explained: float


@dataclass(frozen=True, repr=False)
class SlopeEstimate:
    """How much an output changes per travel of the centre of mass.

    Attributes:
        value: the part in phase with the travel, as a static law would have it.
        low: lower end of its 95 % interval.
        high: upper end.
        phase: of the output after the travel [rad]; negative is late, NaN for a regression.
        middle: the output with the centre of mass in the middle of its travel.
        samples: how many were fitted.
        effective: how many independent ones they are worth.
        encoders: standard deviation that the encoders' constant errors give the value; it is in
            the interval.
    """

    value: float
    low: float
    high: float
    phase: float
    middle: float
    samples: int
    effective: float
    encoders: float = 0.0

    def __repr__(self) -> str:
        """Value and interval."""
        return f"{type(self).__name__}({self.value:.4g} [{self.low:.4g}, {self.high:.4g}])"

    def widened(self, encoders: float) -> SlopeEstimate:
        """The same with a standard deviation of the encoders' in its interval, as a square."""
        half = math.hypot(0.5 * (self.high - self.low), NORMAL * encoders)
        return replace(self, low=self.value - half, high=self.value + half, encoders=encoders)

    def place_of(self, other: SlopeEstimate) -> Literal["inside", "on the edge", "outside"]:
        """Where another slope lies against this interval: on the edge if only intervals meet."""
        if self.low <= other.value <= self.high:
            return "inside"
        return "on the edge" if other.low <= self.high and other.high >= self.low else "outside"

    def to_dict(self) -> dict[str, float | int]:
        """Plain data, the phase in degrees too."""
        return {
            "value": self.value,
            "low": self.low,
            "high": self.high,
            "phase_deg": math.degrees(self.phase),
            "middle": self.middle,
            "samples": self.samples,
            "effective_samples": self.effective,
            "encoders": self.encoders,
        }


def find_sway(times: Float[np.ndarray, " N"], travel: Float[np.ndarray, " N"]) -> Sway:
    """The fundamental of a travel, by least squares over its frequency.

    Args:
        times: [s], not necessarily at equal steps.
        travel: of the centre of mass [m], finite.

    Raises:
        InvalidInputError: the centre of mass does not move.
    """
    from scipy.optimize import minimize_scalar

    spread = float(np.var(travel))
    half = 0.5 * float(np.ptp(travel))
    if half < 1e-9:
        raise InvalidInputError(
            "the centre of mass stands still in this log: there is no slope to fit. Give a log "
            "of a motion."
        )
    length = float(times[-1] - times[0])

    def unexplained(frequency: float) -> float:
        design = _harmonic(times, frequency)
        rest = travel - design @ np.linalg.lstsq(design, travel, rcond=None)[0]
        return float(np.var(rest)) / spread

    # A first look on equal steps, four times finer than a period more or less over the record.
    count = len(times)
    even = np.interp(np.linspace(times[0], times[-1], count), times, travel - travel.mean())
    power = np.abs(np.fft.rfft(even, 4 * count))
    grid = np.arange(len(power)) / (4 * length * count / (count - 1))
    inside = (grid >= 0.5 / length) & (grid <= _HIGHEST)
    if not inside.any():  # shorter than half a period of anything that sways
        return Sway("regression", math.nan, half, 0.0)
    at, step = grid[inside][int(np.argmax(power[inside]))], 0.25 / length
    found = minimize_scalar(
        unexplained, bounds=(max(0.3 / length, at - step), at + step), method="bounded"
    )
    explained = 1.0 - float(found.fun)
    if explained < _EXPLAINED or found.x * length < _PERIODS:
        return Sway("regression", math.nan, half, max(0.0, explained))
    design = _harmonic(times, float(found.x))
    fit = np.linalg.lstsq(design, travel, rcond=None)[0]
    return Sway("fundamental", float(found.x), float(np.hypot(fit[1], fit[2])), explained)


def fit_sway(
    sway: Sway,
    times: Float[np.ndarray, " N"],
    travel: Float[np.ndarray, " N"],
    output: Float[np.ndarray, " N"],
    scale: float = 1.0,
) -> SlopeEstimate:
    """The slope of an output over the travel, times a scale.

    The output is fitted to 1, the fundamental of the travel, and the same a quarter period earlier;
    or to 1 and the travel.

    Args:
        sway: of this travel.
        times: [s].
        travel: [m].
        output: such as the load share of a foot; finite.
        scale: what the slope is multiplied with, such as the distance of the feet [m].
    """
    from scipy.stats import t as student

    design, amplitude = np.column_stack([np.ones(len(times)), travel - travel.mean()]), 1.0
    if sway.method == "fundamental":
        harmonic = _harmonic(times, sway.frequency)
        fit = np.linalg.lstsq(harmonic, travel, rcond=None)[0]
        along = harmonic[:, 1:] @ fit[1:]
        # The same motion a quarter of a period earlier: cos -> -sin, sin -> cos.
        ahead = harmonic[:, 2] * -fit[1] + harmonic[:, 1] * fit[2]
        design = np.column_stack([np.ones(len(times)), along, ahead])
    found, *_ = np.linalg.lstsq(design, output, rcond=None)
    residual = output - design @ found
    n, p = design.shape
    worth = n / inflation(residual)
    free = max(1.0, worth - p)
    # sigma^2 (X'X)^-1 n/n_eff, with sigma^2 of the effective degrees of freedom.
    variance = float(residual @ residual) / n * worth / free
    covariance = variance * np.linalg.inv(design.T @ design) * (n / worth)
    half = float(student.ppf(0.975, free) * math.sqrt(max(0.0, covariance[1, 1])))
    value = float(found[1]) * scale * amplitude
    phase = math.nan
    if sway.method == "fundamental":
        phase = math.atan2(float(found[2]), float(found[1]))
    reach = half * abs(scale)
    return SlopeEstimate(value, value - reach, value + reach, phase, float(found[0]), n, worth)


def inflation(residual: Float[np.ndarray, " N"]) -> float:
    """n/n_eff = 1 + 2 sum of the autocorrelation up to its first zero, at least 1."""
    centred = residual - residual.mean()
    power = float(centred @ centred)
    if power <= 1e-30 * len(centred):
        return 1.0
    size = 1 << (2 * len(centred) - 1).bit_length()
    spectrum = np.fft.rfft(centred, size)
    acf = np.fft.irfft(spectrum * np.conj(spectrum), size)[: len(centred)] / power
    below = np.flatnonzero(acf <= 0)
    end = int(below[0]) if below.size else len(acf)
    return float(max(1.0, 1.0 + 2.0 * acf[1:end].sum()))


def _harmonic(times: np.ndarray, frequency: float) -> Float[np.ndarray, "N 3"]:
    angle = 2 * np.pi * frequency * (times - times[0])
    return np.column_stack([np.ones(len(times)), np.cos(angle), np.sin(angle)])
