"""Everything that the report on [Romano2016] shows, computed; nothing is drawn here."""

from copsense.paper.reproduce.closed_loop import sway_in_simulation
from copsense.paper.reproduce.everything import LIMITS, SWAY_FREQUENCY, reproduce_paper
from copsense.paper.reproduce.real_robot import RECORDED, RealFinding, RealRobot
from copsense.paper.reproduce.reproduction import Reproduction, UnitOfLength, WithinLimits

__all__ = [
    "LIMITS",
    "RECORDED",
    "SWAY_FREQUENCY",
    "RealFinding",
    "RealRobot",
    "Reproduction",
    "UnitOfLength",
    "WithinLimits",
    "reproduce_paper",
    "sway_in_simulation",
]
