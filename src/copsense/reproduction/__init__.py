"""reproduce: everything that the report on [Romano2016] shows, computed; nothing is drawn here."""

from copsense.reproduction.reproduce import LIMITS, SWAY_FREQUENCY, reproduce
from copsense.reproduction.result import Reproduction, UnitOfLength, WithinLimits
from copsense.reproduction.sway import sway_in_simulation

__all__ = [
    "LIMITS",
    "SWAY_FREQUENCY",
    "Reproduction",
    "UnitOfLength",
    "WithinLimits",
    "reproduce",
    "sway_in_simulation",
]
