"""Static centre-of-pressure sensitivity for legged robots.

The names of every day are here; the rest is in the modules, such as ``copsense.cop`` or
``copsense.maps``. All of them are imported when they are first used.
"""

from __future__ import annotations

import importlib
import pkgutil
from functools import cache
from typing import TYPE_CHECKING, Any

from copsense._version import __version__

if TYPE_CHECKING:
    from copsense.analysis import Analysis, analyse
    from copsense.contact import Contact, Plane, rectangle
    from copsense.criterion import (
        Criterion,
        TorqueTerm,
        WrenchTerm,
        minimum_tangential,
        minimum_torque,
        minimum_wrench,
        mixed,
        weighted_torque,
    )
    from copsense.design import design_criterion
    from copsense.drives import Drives
    from copsense.errors import CopsenseError
    from copsense.limits import Limits
    from copsense.loads import Load
    from copsense.maps import load_map, map_postures
    from copsense.optimisation import optimise
    from copsense.path import PosturePath, joint_sweep, lateral_sweep, path_through
    from copsense.posture import solve_posture
    from copsense.regions import com_regions
    from copsense.robot import Robot
    from copsense.robots import load_robot, load_stance
    from copsense.scan import PathScan
    from copsense.sensitivity import check_sensitivity, cop_sensitivity
    from copsense.simulation import Recording, balance
    from copsense.stance import Stance
    from copsense.statics import solve_equilibrium
    from copsense.sweeps import Sweep, sweep

__all__ = [
    "Analysis",
    "Contact",
    "CopsenseError",
    "Criterion",
    "Drives",
    "Limits",
    "Load",
    "PathScan",
    "Plane",
    "PosturePath",
    "Recording",
    "Robot",
    "Stance",
    "Sweep",
    "TorqueTerm",
    "WrenchTerm",
    "__version__",
    "analyse",
    "balance",
    "check_sensitivity",
    "com_regions",
    "cop_sensitivity",
    "design_criterion",
    "joint_sweep",
    "lateral_sweep",
    "load_map",
    "load_robot",
    "load_stance",
    "map_postures",
    "minimum_tangential",
    "minimum_torque",
    "minimum_wrench",
    "mixed",
    "optimise",
    "path_through",
    "rectangle",
    "solve_equilibrium",
    "solve_posture",
    "sweep",
    "weighted_torque",
]

# Module -> the names that it gives to this one. Type checkers read the imports above.
_HOMES = {
    "copsense.analysis": (
        "Analysis",
        "analyse",
    ),
    "copsense.contact": (
        "Contact",
        "Plane",
        "rectangle",
    ),
    "copsense.criterion": (
        "Criterion",
        "TorqueTerm",
        "WrenchTerm",
        "minimum_tangential",
        "minimum_torque",
        "minimum_wrench",
        "mixed",
        "weighted_torque",
    ),
    "copsense.design": ("design_criterion",),
    "copsense.drives": ("Drives",),
    "copsense.errors": ("CopsenseError",),
    "copsense.limits": ("Limits",),
    "copsense.loads": ("Load",),
    "copsense.maps": (
        "load_map",
        "map_postures",
    ),
    "copsense.optimisation": ("optimise",),
    "copsense.path": (
        "PosturePath",
        "joint_sweep",
        "lateral_sweep",
        "path_through",
    ),
    "copsense.posture": ("solve_posture",),
    "copsense.regions": ("com_regions",),
    "copsense.robot": ("Robot",),
    "copsense.robots": (
        "load_robot",
        "load_stance",
    ),
    "copsense.scan": ("PathScan",),
    "copsense.sensitivity": (
        "check_sensitivity",
        "cop_sensitivity",
    ),
    "copsense.simulation": (
        "Recording",
        "balance",
    ),
    "copsense.stance": ("Stance",),
    "copsense.statics": ("solve_equilibrium",),
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
    return sorted({*__all__, *_modules()})


@cache
def _modules() -> frozenset[str]:
    return frozenset(module.name for module in pkgutil.iter_modules(__path__))
