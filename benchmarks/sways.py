"""Sways in simulation beside the prediction at rest and in motion: writes sways.md.

    python benchmarks/sways.py

The iCub sways under minimum torque, by the momentum-based controller of the paper and by the same
with the acceleration of the reference's posture. Takes about two minutes.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy loads its BLAS

import copsense
from copsense.controllers import BalancingController, Sine, lateral_reference
from copsense.simulation import MujocoSimulator, Scenario, rollout
from copsense.simulation.prediction import predict
from copsense.simulation.sway_comparison import sway_slopes

SWAYS = ((0.02, 0.1), (0.02, 0.2), (0.012, 0.5))  # m, Hz
TEXT = """# Sways in simulation

Written by `benchmarks/sways.py`. The iCub sways its centre of mass under minimum torque in MuJoCo;
the fundamental of a foot's load, and of its centre of pressure, per that of the centre of mass over
the last period. *off* is how far the measured slope is from the predicted one, with the inertia of
the sway and without. *With feedforward* the controller knows the acceleration of the reference's
posture (`--feedforward`); *as in the paper* it knows that of the centre of mass.

| controller | sway | output | measured | in motion | off | at rest | off |
| --- | --- | --- | --- | --- | --- | --- | --- |
"""


def main() -> None:
    """Sway by every kind of torques."""
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    stance, criterion = copsense.load_stance("icub"), copsense.minimum_torque()
    lines = [TEXT]
    for amplitude, frequency in SWAYS:
        reference = lateral_reference(stance, Sine(amplitude, frequency))
        prediction = predict(reference, criterion)
        controllers = {
            "with feedforward": BalancingController(stance, criterion, feedforward=True),
            "as in the paper": BalancingController(stance, criterion),
        }
        for name, controller in controllers.items():
            scenario = Scenario((1.0 if frequency < 0.2 else 1.5) / frequency, reference)
            run = rollout(MujocoSimulator(stance), controller, scenario, until="fall")
            slopes = sway_slopes(prediction.attach(run))["l_sole"]
            for key, what in (("load", "load [N/m]"), ("cop_y", "CoP y [mm/mm]")):
                measured, moving, still = slopes[key].values()
                lines.append(
                    f"| {name} | {amplitude * 1e3:g} mm, {frequency:g} Hz | {what} | "
                    f"{measured:.4g} | {moving:.4g} | {measured / moving - 1:+.2%} | {still:.4g} | "
                    f"{measured / still - 1:+.1%} |\n"
                )
                print(lines[-1], end="", flush=True)
    Path(__file__).with_suffix(".md").write_text("".join(lines), encoding="utf-8")


if __name__ == "__main__":
    main()
