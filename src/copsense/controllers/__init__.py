"""Balancing controllers: what they track, what they see, and the momentum-based one."""

from copsense.controllers.balancing import BalancingController
from copsense.controllers.controller import Command, Controller, Observation, controller_name
from copsense.controllers.gains import STIFF, Gains, public_gains
from copsense.controllers.limited import ShareWithinLimits
from copsense.controllers.loading import controller_code, load_controller
from copsense.controllers.sharing import Choice, ShareByCriterion, ShareLoad
from copsense.controllers.target import (
    Hold,
    PathReference,
    Ramp,
    Signal,
    Sine,
    Target,
    lateral_reference,
)
from copsense.load_problem import LoadProblem

__all__ = [
    "STIFF",
    "BalancingController",
    "Choice",
    "Command",
    "Controller",
    "Gains",
    "Hold",
    "LoadProblem",
    "Observation",
    "PathReference",
    "Ramp",
    "ShareByCriterion",
    "ShareLoad",
    "ShareWithinLimits",
    "Signal",
    "Sine",
    "Target",
    "controller_code",
    "controller_name",
    "lateral_reference",
    "load_controller",
    "public_gains",
]
