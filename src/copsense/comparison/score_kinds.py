"""ScoreKind: what each score of a benchmark measures, in which unit, and which end is better."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ScoreKind:
    """What the number of a score is.

    Attributes:
        unit: of value, interval and predictions.
        larger: whether larger values are better.
        meaning: a description.
        resolution: smaller differences come from the engine, not the controller: in the
            simulation a sole sinks by 0.02 mm.
    """

    unit: str
    larger: bool
    meaning: str
    resolution: float = 0.0


SCORES = {
    "tip_excursion": ScoreKind("m", True, "CoM y from the start at the first tip of a lean", 2e-5),
    "tip_impulse": ScoreKind("N s", True, "least lateral push that tips a contact"),
    "smallest_margin": ScoreKind("m", True, "smallest distance of a CoP to its sole's edge", 2e-5),
    "com_error": ScoreKind("m", False, "root mean square of CoM y minus its target", 1e-6),
    "torque_norm": ScoreKind("N m", False, "mean over time of the norm of the joint torques", 1e-2),
    "torque_peak": ScoreKind("N m", False, "largest joint torque", 1e-2),
    "fall_rate": ScoreKind("1", False, "share of perturbed pushes that end in a fall"),
    "wrench_error": ScoreKind("1", False, "wrench at rest off the static one, per weight", 1e-4),
    "cop_error": ScoreKind("m", False, "measured CoP off the commanded one in steady state", 2e-5),
    "breaking_delay": ScoreKind("s", True, "torque delay at which a sway first tips a contact"),
    "breaking_bandwidth": ScoreKind("Hz", False, "torque bandwidth at which a sway first tips"),
    "breaking_velocity_noise": ScoreKind(
        "rad/s", True, "noise of the joint velocities at which a sway first tips a contact"
    ),
    "breaking_torque_limit": ScoreKind(
        "N m", False, "torque limit of the legs at which a sway first tips a contact"
    ),
}
"""The scores, by name."""


def shown_unit(unit: str) -> tuple[str, float]:
    """The unit in which a score is shown, and the factor to it: lengths in millimetres."""
    return ("mm", 1e3) if unit == "m" else (unit, 1.0)
