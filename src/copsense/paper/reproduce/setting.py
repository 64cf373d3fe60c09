"""What a reproduction was computed on and with, in words."""

from __future__ import annotations

import math
import platform

import numpy as np

from copsense.paper.closed_form import FourBar
from copsense.paper.closed_form.between_feet import PAPER_LENGTH
from copsense.paper.reproduce.sideways import feet_distance
from copsense.posture import PostureCost
from copsense.provenance import versions
from copsense.robots import PRESETS
from copsense.stance import Stance
from copsense.sweeps import Sweep

ROBOT = "icub"
_MODEL = "iCubGenova04"


def describe_parameters(
    stance: Stance, lowered: Stance, four_bar: FourBar, lateral: Sweep
) -> dict[str, str]:
    """What was computed on: name -> sentence."""
    cost, half, postures = PostureCost(), feet_distance(stance) / 2, lateral.sizes["posture"]
    drop = float(np.mean([c.offset[2] for c in lowered.contacts])) * 1e3
    deg = ", ".join(
        f"{j} {math.degrees(a):g}" for j, a in PRESETS[ROBOT].posture.items() if j[0] == "l"
    )
    return {
        "four-bar": f"l = {four_bar.leg_length:g} m, d = {four_bar.rod_length:g} m, "
        f"m_l = {four_bar.leg_mass:g} kg, m_b = {four_bar.body_mass:g} kg "
        f"(kappa = {four_bar.kappa:g}), g = {four_bar.gravity:g} m/s²",
        "robot": f"{_MODEL} of icub-models, {stance.robot.mass:.3f} kg, "
        f"{len(stance.robot.torque_names)} joints, gravity "
        f"{float(np.linalg.norm(stance.robot.model.gravity.linear)):g} m/s²",
        "posture": f"left leg and arm, the right mirrored [deg]: {deg}; others 0",
        "contacts": ", ".join(f"{c.name} ({c.kind})" for c in stance.contacts)
        + f", at the model's frames; feet {2 * half:g} m apart; edges of the soles read from the "
        f"collision geometry, whose bottom lies {-drop:.1f} mm under those frames",
        "path": f"{postures} postures, CoM y from {-half:g} m to {half:g} m, CoM x held over the "
        "line of the feet's frames, CoM height free; each posture is the one with the feet in "
        f"place that minimises 1/2 [{cost.base_rotation:g} |base rotation|² + sum of w (joint "
        f"deviation)²], w = {cost.supporting:g} for the legs, {cost.free:g} for torso and arms",
        "criterion 1": "minimum-wrench: least sum over the feet of |force|² + |moment|²/L², "
        f"L = {PAPER_LENGTH:g} m (the paper's; it never says so)",
        "criterion 2": "minimum-torque: least sum of squared joint torques",
        "limits": "none enforced: each CoP goes where the criterion puts it, and its margin to "
        "the sole's edge is reported beside it",
        "accuracy": "largest imbalance left, recomputed by inverse dynamics: "
        f"{float(lateral['residual'].max()):.1e} N or N m; derivatives are analytic",
    }


def find_versions() -> dict[str, str]:
    """Of this package, Python and what it rests on."""
    packages = ("pin", "numpy", "scipy", "xarray", "matplotlib", "mujoco", "icub-models")
    found = {name: text or "not a distribution" for name, text in versions(packages).items()}
    return {
        "copsense": found.pop("copsense"),
        "Python": platform.python_version(),
        "platform": f"{platform.system()} {platform.machine()}",
        **found,
    }
