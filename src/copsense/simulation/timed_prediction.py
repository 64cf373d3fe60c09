"""TimedPrediction: loads and centres of pressure of a sway, with the inertia that it takes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from copsense.content import ShortRepr, freeze
from copsense.controllers.target import PathReference, Sine
from copsense.criterion import Criterion
from copsense.errors import CopsenseError
from copsense.limits import Limits
from copsense.statics import StaticEquilibrium, solve_equilibrium
from copsense.timed_path import Sway


@dataclass(frozen=True, eq=False, repr=False)
class TimedPrediction(ShortRepr):
    """What a sway's contacts carry as it passes each of a path's postures.

    Attributes:
        amplitude: of the sway [m along the path].
        frequency: of it [Hz].
        cops: centre of pressure of each contact (N, nc, 2), contact axes [m]; NaN where unloaded,
            where the sway does not pass, and where nothing within the limits holds the motion.
        loads: normal force of each contact (N, nc) [N]; NaN likewise.
    """

    amplitude: float
    frequency: float
    cops: Float[np.ndarray, "N nc 2"]
    loads: Float[np.ndarray, "N nc"]

    def __post_init__(self) -> None:
        """Own the arrays."""
        freeze(self, "cops", "loads")


def predict_in_motion(
    reference: PathReference, criterion: Criterion, limits: Limits | None = None
) -> TimedPrediction | None:
    """The prediction of a sine along a path, at each of the path's postures.

    A sine passes a place as fast on its way there as on its way back, so that place decides what
    its contacts carry. None for any other signal, and for a sine that stands still.
    """
    signal, path = reference.signal, reference.path
    if not isinstance(signal, Sine) or not signal.amplitude or not path.continuous:
        return None
    sway = Sway(path, 1.0 / signal.frequency, centre=0.0, amplitude=abs(signal.amplitude))
    shape = len(path), len(path.stances[0].contacts)
    cops, loads = np.full((*shape, 2), np.nan), np.full(shape, np.nan)
    for i, value in enumerate(path.values):
        try:
            found = solve_equilibrium(sway.at(float(value)).stance, criterion, limits)
        except CopsenseError:
            continue
        cops[i], loads[i] = cops_or_nan(found), found.wrenches[:, 2]
    return TimedPrediction(abs(signal.amplitude), signal.frequency, cops, loads)


def timed_note(reference: PathReference) -> str:
    """Why a moving reference has no prediction in motion; empty where it has one, or stands."""
    signal = reference.signal
    low, high = signal.extent
    if low == high or (isinstance(signal, Sine) and reference.path.continuous):
        return ""
    what = "a list of configurations" if isinstance(signal, Sine) else f"a {type(signal).__name__}"
    return (
        f"{what} has no prediction in motion, which is of a Sine along a continuous path: the "
        "prediction is static. copsense.timed_path.TimedPath gives single instants."
    )


def cops_or_nan(equilibrium: StaticEquilibrium) -> Float[np.ndarray, "nc 2"]:
    """Centre of pressure of each contact [m]; NaN where it carries no load."""
    w, unloaded = equilibrium.wrenches, equilibrium.unloaded
    loaded = np.array([name not in unloaded for name in equilibrium.stance.contact_names])
    fz = np.where(loaded, w[:, 2], 1.0)
    return np.where(loaded[:, None], np.column_stack([-w[:, 4], w[:, 3]]) / fz[:, None], np.nan)
