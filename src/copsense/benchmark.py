"""Benchmark: how far a controller leans, or is pushed, before a foot tips, beside the prediction.

Scores of one robot, criterion and posture are rows; a run that fails is a row with its reason. The
prediction uses the law that the controller applies: it tells theory from physics, and ranks
controllers by what physics says. Falls are no score: without limits they follow chance more than
the criterion.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass

import numpy as np
import pandas as pd

from copsense.arrays import finite_number
from copsense.controllers import (
    STIFF,
    BalancingController,
    Gains,
    Hold,
    Ramp,
    lateral_reference,
)
from copsense.criterion import Criterion
from copsense.errors import CopsenseError
from copsense.simulation import MujocoSimulator, PhysicsSettings, Push, Scenario, rollout
from copsense.simulation.prediction import predict, predict_lean
from copsense.stance import Stance

_AFTER = 1.0  # s to watch after a push
_LEAN = 0.12  # of the CoM's height: how far to look for the first edge


@dataclass(frozen=True)
class LeanScore:
    """A slow lateral lean to the first tip.

    Attributes:
        posture: what the caller calls the stance.
        controller: the controller's name.
        excursion: CoM y from the start when a contact first ceased to stand [m]; NaN where none
            did before the ramp's end, or the run failed.
        predicted: the same by the static analysis along the exact path [m].
        first_order: by CoP and sensitivity at the start alone [m].
        contact: which contact tipped.
        predicted_contact: which should.
        torque_norm: mean norm of the torques until then [Nm].
        torque_peak: largest torque until then [Nm].
        reason: why the run ended, or failed.
    """

    posture: str
    controller: str
    excursion: float
    predicted: float
    first_order: float
    contact: str
    predicted_contact: str
    torque_norm: float
    torque_peak: float
    reason: str


def score_lean(
    stance: Stance,
    criterion: Criterion,
    reach: float,
    *,
    posture: str = "",
    speed: float = 5e-3,
    gains: Gains = STIFF,
    settings: PhysicsSettings | None = None,
    progress: Callable[[int], object] | None = None,
) -> LeanScore:
    """Lean slowly up to `reach` [m], its sign says to which side, until a contact tips."""
    nan = np.nan
    try:
        signal = Ramp(reach, speed)
        reference = lateral_reference(stance, signal)
        prediction = predict(reference, criterion)
        recording = rollout(
            MujocoSimulator(stance, settings),
            BalancingController(stance, criterion, gains),
            Scenario(signal.duration + 0.5, reference),
            progress=progress,
        )
    except CopsenseError as error:
        return LeanScore(posture, criterion.name, nan, nan, nan, "", "", nan, nan, str(error))
    torque, attributes = recording["torque"].values, recording.attrs
    tip = float(recording["tip_com"].sel(com_axis="y")) - float(stance.com[1])
    return LeanScore(
        posture,
        criterion.name,
        abs(tip),
        prediction.excursion,
        prediction.first_order,
        str(attributes["tip_contact"]),
        prediction.contact,
        float(np.linalg.norm(torque, axis=1).mean()),
        float(np.abs(torque).max()),
        str(attributes["end_reason"]),
    )


@dataclass(frozen=True)
class ImpulseScore:
    """The least push that tips a contact, by bisection.

    Attributes:
        posture: what the caller calls the stance.
        controller: the controller's name.
        impulse: half-way between the largest push that tipped nothing and the smallest that did
            [N s]; NaN where not even the largest tried did.
        resolution: half the distance between these two [N s].
        predicted: `predict_impulse` from the static excursion [N s].
        contact: which contact tipped at the smallest.
        runs: how many rollouts it took.
    """

    posture: str
    controller: str
    impulse: float
    resolution: float
    predicted: float
    contact: str
    runs: int


def score_impulse(
    stance: Stance,
    criterion: Criterion,
    *,
    posture: str = "",
    largest: float = 20.0,
    resolution: float = 0.25,
    duration: float = 0.05,
    gains: Gains = STIFF,
    progress: Callable[[int], object] | None = None,
) -> ImpulseScore:
    """Push the base to the left, harder and harder, until a contact tips.

    Args:
        stance: robot, posture and contacts.
        criterion: how the controller shares the load.
        posture: what to call the stance.
        largest: impulse to try first [N s].
        resolution: bisect until the two ends are nearer than twice this [N s].
        duration: of each push [s].
        gains: of the controller.
        progress: called with the number of rollouts done since the last call.
    """
    finite_number(largest, "the largest impulse [N s]", positive=True)
    finite_number(resolution, "the resolution of the impulse [N s]", positive=True)
    simulator = MujocoSimulator(stance)
    controller = BalancingController(stance, criterion, gains)
    reference = lateral_reference(stance, Hold())
    lean = predict_lean(stance, criterion, _LEAN * float(stance.com[2]))
    predicted = predict_impulse(stance, lean.excursion, duration, gains)
    runs, tipped = 0, ""

    def tips(impulse: float) -> str:
        push = Push((0.0, impulse / duration, 0.0), start=0.2, duration=duration)
        scenario = Scenario(0.2 + duration + _AFTER, reference, (push,))
        recording = rollout(simulator, controller, scenario)
        if progress:
            progress(1)
        ended = recording.attrs["end_kind"] != "completed"
        return str(recording.attrs["tip_contact"] or recording.attrs["end_kind"]) if ended else ""

    low, high = 0.0, largest
    tipped, runs = tips(high), 1
    if not tipped:
        return ImpulseScore(posture, criterion.name, np.nan, np.nan, predicted, "", runs)
    while high - low > 2 * resolution:
        middle = (low + high) / 2
        found, runs = tips(middle), runs + 1
        if found:
            high, tipped = middle, found
        else:
            low = middle
    return ImpulseScore(
        posture, criterion.name, (low + high) / 2, (high - low) / 2, predicted, tipped, runs
    )


def predict_impulse(
    stance: Stance, excursion: float, duration: float, gains: Gains = STIFF
) -> float:
    """The least lateral push that tips a contact, by the static excursion and no fitted number.

    The CoM is a mass m under the controller's law, a = -kp y - kd v + F/m, and acts on the soles
    as if it stood at rest at y + (h/g)(kp y + kd v): there is where the static analysis is asked.

    Args:
        stance: gives mass and height of the CoM.
        excursion: the static excursion d to the first tip [m].
        duration: of the push [s].
        gains: their lateral kp and kd.

    Returns:
        The impulse F * duration [N s].
    """
    kp, kd = gains.com_stiffness[1], gains.com_damping[1]
    ground = float(np.mean([place.translation[2] for place in stance.placements]))
    g = stance.robot.weight / stance.robot.mass
    lever = (float(stance.com[2]) - ground) / g
    dt = 1e-4
    y = v = most = 0.0
    for i in range(round((duration + _AFTER) / dt)):
        # Of a unit impulse.
        push = 1.0 / (stance.robot.mass * duration) if i * dt < duration else 0.0
        v += dt * (push - kp * y - kd * v)
        y += dt * v
        most = max(most, y + lever * (kp * y + kd * v))
    return excursion / most


def score_table(scores: Iterable[LeanScore | ImpulseScore]) -> pd.DataFrame:
    """Scores of one kind as a table, a row each."""
    return pd.DataFrame([asdict(score) for score in scores])


def agreement(table: pd.DataFrame) -> dict[str, float]:
    """How well the predictions of a table of leans hold, over the rows that tipped.

    Returns:
        ``cases``, the mean and the largest absolute error [m], Pearson's ``correlation`` with the
        ends of its 95 % interval (Fisher's z; NaN under four cases).
    """
    known = table[np.isfinite(table["excursion"]) & np.isfinite(table["predicted"])]
    error = np.abs(known["excursion"] - known["predicted"]).to_numpy()
    found = {
        "cases": float(len(known)),
        "mean_error": float(error.mean()) if len(known) else np.nan,
        "largest_error": float(error.max()) if len(known) else np.nan,
        "correlation": np.nan,
        "low": np.nan,
        "high": np.nan,
    }
    if len(known) > 3:
        r = float(np.corrcoef(known["excursion"], known["predicted"])[0, 1])
        z, half = np.arctanh(min(r, 1 - 1e-15)), 1.96 / np.sqrt(len(known) - 3)
        found |= {
            "correlation": r,
            "low": float(np.tanh(z - half)),
            "high": float(np.tanh(z + half)),
        }
    return found
