"""The iCub's CoM swept sideways, and what the claims need to know of the robot."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from copsense.criterion import Criterion, minimum_torque, minimum_wrench
from copsense.paper.claims.icub_sweep import HIP_ROLL, SHORT, TORQUE, WRENCH
from copsense.paper.closed_form.between_feet import PAPER_LENGTH
from copsense.paper.reproduce.clock import Clock
from copsense.paper.reproduce.reproduction import UnitOfLength
from copsense.path import PosturePath, joint_sweep, lateral_sweep
from copsense.sensitivity import cop_sensitivity
from copsense.stance import Stance
from copsense.sweeps import Sweep, sweep

_LENGTHS = 25  # values of L in the figure on the unit of length


def paper_criteria() -> list[Criterion]:
    """The paper's criteria 1 and 2, with its unit of length."""
    return [minimum_wrench(PAPER_LENGTH, name=WRENCH), minimum_torque(name=TORQUE)]


def sweep_sideways(
    stance: Stance, postures: int, clock: Clock, name: str
) -> tuple[Sweep, PosturePath]:
    """The CoM from over the right foot to over the left, every criterion at every posture."""
    half = feet_distance(stance) / 2
    with clock.stage(f"{name}: postures", postures) as advance:
        path = lateral_sweep(stance, -half, half, postures, progress=advance)
    criteria = [*paper_criteria(), minimum_wrench(half, name=SHORT)]
    with clock.stage(f"{name}: sensitivities", postures) as advance:
        swept = sweep(path, criteria, progress=advance)
    robot = stance.robot
    rolls = [robot.joint_position(s.q, HIP_ROLL) for s in path.stances]
    hip = {"units": "rad", "long_name": "position of the left hip roll joint"}
    rate = {"units": "rad/m", "long_name": "d left hip roll / d com_y along the path"}
    extended = (
        swept.to_xarray()
        .assign_coords({HIP_ROLL: ("posture", rolls, hip)})
        .assign({f"{HIP_ROLL}_rate": ("posture", path.joint_rates(HIP_ROLL), rate)})
        .assign_attrs(_facts(stance, criteria[0]))
    )
    return Sweep(extended), path


def vary_unit_of_length(stance: Stance) -> UnitOfLength:
    """Criterion 1 at the centre of the lateral path, over its length L."""
    d = feet_distance(stance)
    path = lateral_sweep(stance, 0.0, 0.0, 1)
    centre, tangent = path.stances[0], path.tangents[0]

    def slope(criterion: Criterion) -> float:
        return float(cop_sensitivity(centre, criterion).along(tangent)[:, 1].mean())

    lengths = np.geomspace(d / 14, 2.0, _LENGTHS)
    return UnitOfLength(
        lengths=lengths,
        icub=np.array([slope(minimum_wrench(length)) for length in lengths]),
        closed_form=lengths**2 / (lengths**2 + d**2 / 4),
        minimum_torque=slope(minimum_torque()),
        distance=d,
    )


def feet_distance(stance: Stance) -> float:
    """Lateral distance of the feet [m], to the micrometre that the ends of the sweep need."""
    return round(float(np.ptp([place.translation[1] for place in stance.placements])), 6)


def _facts(stance: Stance, criterion: Criterion) -> dict[str, float]:
    """What the claims need to know of the robot beyond the sweep."""
    model, data = stance.robot.model, stance.robot.model.createData()
    pin.forwardKinematics(model, data, stance.q)
    legs = [
        sum(model.inertias[j].mass for j in model.subtrees[model.getJointId(f"{s}_hip_pitch")])
        for s in "lr"
    ]
    height = np.mean([data.oMi[model.getJointId(f"{s}_hip_roll")].translation[2] for s in "lr"])
    feet = np.mean([place.translation[2] for place in stance.placements])
    return {
        "left_leg_mass": float(legs[0]),
        "right_leg_mass": float(legs[1]),
        "body_mass": float(stance.robot.mass - sum(legs)),
        "hip_height": float(height - feet),
        "joint_path_slope": _joint_path_slope(stance, criterion),
    }


def _joint_path_slope(stance: Stance, criterion: Criterion) -> float:
    """D left CoP y / d hip roll [m/rad] where the joint itself is swept and the CoM left free."""
    now = stance.robot.joint_position(stance.q, HIP_ROLL)
    path: PosturePath = joint_sweep(stance, HIP_ROLL, now, now, 1)
    return float(cop_sensitivity(path.stances[0], criterion).along(path.tangents[0])[0, 1])
