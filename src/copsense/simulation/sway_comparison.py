"""How loads and centres of pressure went in a sway: measured, in motion and at rest."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

if TYPE_CHECKING:
    from copsense.simulation.recording import Recording


_HARMONICS = (1, 2, 3)  # fitted; the first is reported


def compare_sway(recording: Recording) -> dict[str, dict[str, dict[str, tuple[float, float]]]]:
    """Least and greatest load and CoP of each contact before the first tip, beside predictions.

    Args:
        recording: what `copsense.balance` returned.

    Returns:
        Contact -> ``"load"`` [N] and ``"cop_y"`` [m], each -> ``"measured"``, ``"in motion"`` and
        ``"at rest"``, over the part of the path that was walked. Empty without a prediction in
        motion.
    """
    if "timed_cop" not in recording:
        return {}
    stood = recording.before_first_tip
    travel = stood["com"].sel(com_axis="y").values
    if not len(travel):
        return {}
    went = travel - float(recording["com"].sel(com_axis="y").values[0])
    there = recording["static_travel"].values
    on = np.linspace(max(went.min(), there[0]), min(went.max(), there[-1]), 201)
    return {
        name: {
            key: {
                where: _range(values if where == "measured" else along_path(recording, on, values))
                for where, values in each.items()
            }
            for key, each in outputs.items()
        }
        for name, outputs in _outputs(recording, stood).items()
    }


def sway_slopes(recording: Recording) -> dict[str, dict[str, dict[str, float]]]:
    """Fundamentals of load and CoP of each contact per the CoM's, over the last whole period.

    Args:
        recording: what `copsense.balance` returned for a `Sine`.

    Returns:
        Contact -> ``"load"`` [N/m] and ``"cop_y"`` [m/m], each -> ``"measured"``, in phase with
        the CoM, ``"in motion"`` and ``"at rest"``, as predicted for the amplitude of the
        reference. Empty without a prediction in motion, or where a contact tipped or the run ended
        before a period was over.
    """
    if "timed_cop" not in recording:
        return {}
    stood = recording.before_first_tip
    amplitude, frequency = (recording.attrs[f"sway_{x}"] for x in ("amplitude", "frequency"))
    time = stood["time"].values
    kept = time > time[-1] - 1.0 / frequency if len(time) else time
    if not len(time) or time[-1] - time[0] < 1.0 / frequency - 2 * np.diff(time).max(initial=0.0):
        return {}
    phase = 2 * np.pi * frequency * time[kept]
    waves = [wave(k * phase) for k in _HARMONICS for wave in (np.sin, np.cos)]
    fit = np.linalg.pinv(np.column_stack([np.ones_like(phase), *waves]))[1:3]
    com = fit @ stood["com"].sel(com_axis="y").values[kept]
    turn = np.linspace(0.0, 2 * np.pi, 721)[:-1]

    def slope(where: str, values: np.ndarray) -> float:
        if where == "measured":
            return float(fit @ values[kept] @ com / (com @ com))
        passed = along_path(recording, amplitude * np.sin(turn), values)
        return float(2 * np.mean(passed * np.sin(turn)) / amplitude)

    return {
        name: {
            key: {where: slope(where, values) for where, values in each.items()}
            for key, each in outputs.items()
        }
        for name, outputs in _outputs(recording, stood).items()
    }


def along_path(
    recording: Recording, travel: Float[np.ndarray, " k"], values: Float[np.ndarray, " N"]
) -> Float[np.ndarray, " k"]:
    """What was predicted over the path, at other travels of the CoM; NaN beyond what is known.

    Args:
        recording: with a prediction beside it.
        travel: of the CoM from the start [m].
        values: at the path's postures, such as the load of a contact.
    """
    known, there = ~np.isnan(values), recording["static_travel"].values
    if not known.any():
        return np.full_like(travel, np.nan)
    return np.interp(travel, there[known], values[known], left=np.nan, right=np.nan)


def _outputs(
    recording: Recording, stood: Recording
) -> dict[str, dict[str, dict[str, Float[np.ndarray, " k"]]]]:
    """Of each contact, load and CoP y as measured over time, and as predicted over the path."""
    found: dict[str, dict[str, dict[str, Float[np.ndarray, " k"]]]] = {}
    for k, name in enumerate(recording.labels("contact")):
        found[name] = {
            "load": {
                "measured": stood["wrench"].values[:, k, 2],
                "in motion": recording["timed_load"].values[:, k],
                "at rest": recording["static_load"].values[:, k],
            },
            "cop_y": {
                "measured": stood["cop"].values[:, k, 1],
                "in motion": recording["timed_cop"].values[:, k, 1],
                "at rest": recording["static_cop"].values[:, k, 1],
            },
        }
    return found


def _range(values: Float[np.ndarray, " k"]) -> tuple[float, float]:
    known = values[~np.isnan(values)]
    if not len(known):
        return np.nan, np.nan
    return float(known.min()), float(known.max())
