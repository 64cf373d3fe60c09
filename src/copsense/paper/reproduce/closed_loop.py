"""Closed loop: the experiments of [Romano2016] Section V, in simulation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from copsense.controllers import BalancingController, PathReference, Sine, lateral_reference
from copsense.criterion import Criterion
from copsense.limits import Limits
from copsense.paper.claims import Sway
from copsense.simulation import MujocoSimulator, Recording, Scenario, rollout
from copsense.simulation.prediction import farther_side, predict, predict_lean
from copsense.stance import Stance

# s between two commands, of four physics steps: the robot's own loops run at 100 Hz to 1 kHz.
CONTROL_PERIOD = 4e-3
_RECORD = 0.02  # s between recorded rows
_FARTHER = 1.5  # amplitudes: as far a lean is followed to its first edge


def sway_in_simulation(
    stance: Stance,
    wrench: Criterion,
    torque: Criterion,
    limits: Limits,
    *,
    amplitude: float = 0.042,
    limited_amplitude: float = 0.07,
    frequency: float = 0.05,
    periods: float = 1.0,
    progress: Callable[[str, int, int], object] | None = None,
) -> Sway:
    """Sway a robot's CoM sideways under both criteria, and within limits.

    Args:
        stance: robot, contacts and the posture to sway about.
        wrench: criterion 1, run once to each side.
        torque: criterion 2.
        limits: of the runs within limits.
        amplitude: of the CoM's sine [m]; the paper does not print its own.
        limited_amplitude: of the runs within limits [m].
        frequency: of the sine [Hz].
        periods: how long each run lasts, unless a foot tips.
        progress: called as ``progress(run, done, total)`` with control steps.

    Raises:
        MissingExtraError: MuJoCo is not installed.
        EngineMismatchError: MuJoCo sees another robot than Pinocchio.
    """
    simulator = MujocoSimulator(stance)
    reference = lateral_reference(stance, Sine(amplitude, frequency))
    scenario = Scenario(periods / frequency, reference, control_period=CONTROL_PERIOD)
    total = round(scenario.duration / scenario.control_period)

    def run(
        name: str, criterion: Criterion, along: PathReference, within: Limits | None = None
    ) -> Recording:
        done = 0

        def advance(steps: int) -> None:
            nonlocal done
            done += steps
            if progress:
                progress(name, done, total)

        advance(0)
        recording = rollout(
            simulator,
            BalancingController(stance, criterion, limits=within),
            replace(scenario, reference=along, name=name),
            until="tip",
            record_period=_RECORD,
            progress=advance,
        )
        advance(total - done)
        attached = predict(along, criterion, within).attach(recording)
        if within is None:
            # The sway may turn before a foot would tip, and looks to one side: a lean continues.
            side = farther_side(along.signal)
            lean = predict_lean(stance, criterion, side * _FARTHER * amplitude)
            return attached.with_attributes(
                static_excursion=side * lean.excursion,
                static_first_order=side * lean.first_order,
            )
        return attached

    mirrored = PathReference(reference.path, Sine(-amplitude, frequency))
    wide = lateral_reference(stance, Sine(limited_amplitude, frequency))
    return Sway(
        amplitude,
        limited_amplitude,
        frequency,
        run("closed loop: minimum wrench, left", wrench, reference),
        run("closed loop: minimum wrench, right", wrench, mirrored),
        run("closed loop: minimum torque", torque, reference),
        {
            criterion.name: run(f"closed loop: {criterion.name}, limits", criterion, wide, limits)
            for criterion in (wrench, torque)
        },
        limits,
    )
