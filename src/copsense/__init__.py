"""Static centre-of-pressure sensitivity for legged robots.

The public names, in the order of the flow: a robot stands on contacts (a stance); a criterion
shares its load among them (an equilibrium); each contact has a centre of pressure, and a
sensitivity of it; limits clip the wrenches, and say how far the centre of mass may go; a sweep
evaluates many, and a design chooses the criterion.
"""

from copsense._version import __version__
from copsense.contact import Contact, Plane, rectangle
from copsense.cop import (
    EdgeMargin,
    center_of_pressure,
    com_projection,
    contact_cops,
    edge_margin,
    foot_rotation_indicator,
    total_center_of_pressure,
    zero_moment_point,
)
from copsense.criterion import (
    CRITERIA,
    Criterion,
    TorqueTerm,
    WrenchTerm,
    criterion_named,
    minimum_tangential,
    minimum_torque,
    minimum_wrench,
    mixed,
    reference_wrench,
    weighted_torque,
)
from copsense.design import Design, design_criterion, families
from copsense.errors import CopsenseError
from copsense.limits import Limits
from copsense.maps import Axis, Grid, Sample, load_map, map_postures, map_summary
from copsense.margins import limit_margins
from copsense.path import LateralPath, PosturePath, joint_sweep, lateral_sweep, path_through
from copsense.posture import Posture, PostureCost, retract, solve_posture
from copsense.regions import ComRegion, com_region, criterion_region
from copsense.robot import Robot
from copsense.robots import (
    PRESETS,
    four_bar_angles,
    four_bar_robot,
    load_robot,
    load_stance,
    sole_notes,
    stand,
)
from copsense.scan import PathScan, limit_travel, next_active_set_change
from copsense.sensitivity import (
    CopSensitivity,
    check_sensitivity,
    cop_sensitivity,
    finite_difference_sensitivity,
)
from copsense.sole import Sole, read_sole
from copsense.stance import Stance
from copsense.statics import (
    ConstrainedEquilibrium,
    StaticEquilibrium,
    solve_equilibrium,
    wrench_policy,
)
from copsense.storage import load_results, write_results
from copsense.sweep_margins import with_limit_margins
from copsense.sweeps import failed_rows, sweep

__all__ = [
    "CRITERIA",
    "PRESETS",
    "Axis",
    "ComRegion",
    "ConstrainedEquilibrium",
    "Contact",
    "CopSensitivity",
    "CopsenseError",
    "Criterion",
    "Design",
    "EdgeMargin",
    "Grid",
    "LateralPath",
    "Limits",
    "PathScan",
    "Plane",
    "Posture",
    "PostureCost",
    "PosturePath",
    "Robot",
    "Sample",
    "Sole",
    "Stance",
    "StaticEquilibrium",
    "TorqueTerm",
    "WrenchTerm",
    "__version__",
    "center_of_pressure",
    "check_sensitivity",
    "com_projection",
    "com_region",
    "contact_cops",
    "cop_sensitivity",
    "criterion_named",
    "criterion_region",
    "design_criterion",
    "edge_margin",
    "failed_rows",
    "families",
    "finite_difference_sensitivity",
    "foot_rotation_indicator",
    "four_bar_angles",
    "four_bar_robot",
    "joint_sweep",
    "lateral_sweep",
    "limit_margins",
    "limit_travel",
    "load_map",
    "load_results",
    "load_robot",
    "load_stance",
    "map_postures",
    "map_summary",
    "minimum_tangential",
    "minimum_torque",
    "minimum_wrench",
    "mixed",
    "next_active_set_change",
    "path_through",
    "read_sole",
    "rectangle",
    "reference_wrench",
    "retract",
    "sole_notes",
    "solve_equilibrium",
    "solve_posture",
    "stand",
    "sweep",
    "total_center_of_pressure",
    "weighted_torque",
    "with_limit_margins",
    "wrench_policy",
    "write_results",
    "zero_moment_point",
]
