"""How the softness of the contacts moves the first tip: prints a table.

    python benchmarks/contact_compliance.py [--criterion NAME] [--rectangle]

The iCub leans slowly to the left, on the soles of its meshes or, with --rectangle, on rectangles of
160 x 72 mm. Takes about a minute.
"""

from __future__ import annotations

import argparse
import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy loads its BLAS

import copsense
from copsense.controllers import BalancingController, Ramp, lateral_reference
from copsense.criterion import criterion_named
from copsense.simulation import MujocoSimulator, PhysicsSettings, Scenario, rollout
from copsense.simulation.prediction import predict

CONTACT_TIMES = (8e-3, 4e-3, 2e-3, 1e-3)  # s; 4 ms is the default


def rectangles() -> list[copsense.Contact]:
    """The iCub's contacts with the rectangular soles of its simplified model."""
    return [
        copsense.Contact(
            f"{side}_sole",
            polygon=copsense.rectangle((-0.0535, 0.1065), reach),
            offset=(0.0, 0.0, -0.0105),
        )
        for side, reach in (("l", (-0.031, 0.041)), ("r", (-0.041, 0.031)))
    ]


def main() -> None:
    """Lean once for each contact time."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--criterion", default="minimum-torque", metavar="NAME")
    parser.add_argument("--rectangle", action="store_true", help="rectangular soles")
    chosen = parser.parse_args()
    stance = copsense.load_stance("icub", contacts=rectangles() if chosen.rectangle else None)
    criterion, signal = criterion_named(chosen.criterion), Ramp(0.05)
    reference = lateral_reference(stance, signal)
    static = predict(reference, criterion).excursion
    print("contact time [ms]  tip [mm]  before the static edge [mm]  margin at the tip [mm]")
    for contact_time in CONTACT_TIMES:
        settings = PhysicsSettings(min(1e-3, contact_time / 2), contact_time)
        run = rollout(
            MujocoSimulator(stance, settings),
            BalancingController(stance, criterion),
            Scenario(signal.duration, reference),
            record_period=1e-3,
        )
        tip = float(run["tip_com"].sel(com_axis="y")) - float(stance.com[1])
        margin = float(run["margin"].isel(time=-1).min())
        print(
            f"{contact_time * 1e3:17.0f}  {tip * 1e3:8.2f}  {(static - tip) * 1e3:27.2f}"
            f"  {margin * 1e3:22.2f}",
            flush=True,
        )
    print(f"static prediction: {static * 1e3:.2f} mm")


if __name__ == "__main__":
    main()
