"""Static centre-of-pressure sensitivity for legged robots.

The names of every day are here; the rest is in the modules, ``copsense.cop`` or ``copsense.maps``,
which are imported when they are first used, as these names are.
"""

from __future__ import annotations

import importlib
import pkgutil
from typing import TYPE_CHECKING, Any

from copsense._version import __version__

if TYPE_CHECKING:
    from copsense.analysis import Analysis, analyse
    from copsense.binding import LimitChange, next_change
    from copsense.contact import Contact, Plane, rectangle
    from copsense.cop import (
        center_of_pressure,
        com_projection,
        contact_cops,
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
    from copsense.margins import limit_margins, limit_travel
    from copsense.path import PosturePath, joint_sweep, lateral_sweep, path_through
    from copsense.polygon import EdgeMargin, Polygon
    from copsense.posture import Posture, PostureCost, retract, solve_posture
    from copsense.regions import ComRegion, com_region, com_regions, criterion_region
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
    from copsense.sensitivity import (
        CopSensitivity,
        check_sensitivity,
        cop_sensitivity,
        finite_difference_sensitivity,
    )
    from copsense.simulation import Recording, balance
    from copsense.sole import Sole, read_sole
    from copsense.stance import Stance
    from copsense.statics import (
        ConstrainedEquilibrium,
        StaticEquilibrium,
        solve_equilibrium,
        wrench_policy,
    )
    from copsense.sweeps import Sweep, sweep

__all__ = [
    "CRITERIA",
    "PRESETS",
    "Analysis",
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
    "LimitChange",
    "Limits",
    "Plane",
    "Polygon",
    "Posture",
    "PostureCost",
    "PosturePath",
    "Recording",
    "Robot",
    "Sample",
    "Sole",
    "Stance",
    "StaticEquilibrium",
    "Sweep",
    "TorqueTerm",
    "WrenchTerm",
    "__version__",
    "analyse",
    "balance",
    "center_of_pressure",
    "check_sensitivity",
    "com_projection",
    "com_region",
    "com_regions",
    "contact_cops",
    "cop_sensitivity",
    "criterion_named",
    "criterion_region",
    "design_criterion",
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
    "load_robot",
    "load_stance",
    "map_postures",
    "map_summary",
    "minimum_tangential",
    "minimum_torque",
    "minimum_wrench",
    "mixed",
    "next_change",
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
    "wrench_policy",
    "zero_moment_point",
]

# Module -> the names that it gives to this one. Type checkers read the imports above.
_HOMES = {
    "copsense.analysis": ("Analysis", "analyse"),
    "copsense.binding": (
        "LimitChange",
        "next_change",
    ),
    "copsense.contact": (
        "Contact",
        "Plane",
        "rectangle",
    ),
    "copsense.cop": (
        "center_of_pressure",
        "com_projection",
        "contact_cops",
        "foot_rotation_indicator",
        "total_center_of_pressure",
        "zero_moment_point",
    ),
    "copsense.criterion": (
        "CRITERIA",
        "Criterion",
        "TorqueTerm",
        "WrenchTerm",
        "criterion_named",
        "minimum_tangential",
        "minimum_torque",
        "minimum_wrench",
        "mixed",
        "reference_wrench",
        "weighted_torque",
    ),
    "copsense.design": (
        "Design",
        "design_criterion",
        "families",
    ),
    "copsense.errors": ("CopsenseError",),
    "copsense.limits": ("Limits",),
    "copsense.maps": (
        "Axis",
        "Grid",
        "Sample",
        "load_map",
        "map_postures",
        "map_summary",
    ),
    "copsense.margins": (
        "limit_margins",
        "limit_travel",
    ),
    "copsense.path": (
        "PosturePath",
        "joint_sweep",
        "lateral_sweep",
        "path_through",
    ),
    "copsense.polygon": (
        "EdgeMargin",
        "Polygon",
    ),
    "copsense.posture": (
        "Posture",
        "PostureCost",
        "retract",
        "solve_posture",
    ),
    "copsense.regions": (
        "ComRegion",
        "com_region",
        "com_regions",
        "criterion_region",
    ),
    "copsense.robot": ("Robot",),
    "copsense.robots": (
        "PRESETS",
        "four_bar_angles",
        "four_bar_robot",
        "load_robot",
        "load_stance",
        "sole_notes",
        "stand",
    ),
    "copsense.sensitivity": (
        "CopSensitivity",
        "check_sensitivity",
        "cop_sensitivity",
        "finite_difference_sensitivity",
    ),
    "copsense.simulation": ("Recording", "balance"),
    "copsense.sole": (
        "Sole",
        "read_sole",
    ),
    "copsense.stance": ("Stance",),
    "copsense.statics": (
        "ConstrainedEquilibrium",
        "StaticEquilibrium",
        "solve_equilibrium",
        "wrench_policy",
    ),
    "copsense.sweeps": (
        "Sweep",
        "sweep",
    ),
}
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names}

if not TYPE_CHECKING:

    def __getattr__(name: str) -> Any:
        """A public name or a module, imported at its first use (PEP 562)."""
        if name in _HOME_OF:
            found = getattr(importlib.import_module(_HOME_OF[name]), name)
        elif name in _modules():
            found = importlib.import_module(f"{__name__}.{name}")
        else:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        globals()[name] = found
        return found


def __dir__() -> list[str]:
    """The public names and the modules."""
    return sorted({*__all__, *_modules(), *globals()})


def _modules() -> set[str]:
    return {module.name for module in pkgutil.iter_modules(__path__)}
