"""Hardware: which millimetre or gram of a robot buys most travel of its centre of mass.

`hardware_parameters` are a robot's sole sizes, ankle height, hip width, link lengths, link masses
and stiffnesses; `hardware_effects` says what each buys, exact to first order and checked by whole
pipelines, and `hardware_sweep` follows one of them over a range.
"""

from copsense.hardware.altered_travel import ChangedTravel, changed_travel
from copsense.hardware.changed_robot import changed
from copsense.hardware.effects import HardwareEffects, hardware_effects
from copsense.hardware.parameter import Alteration, Parameter, Stretch
from copsense.hardware.parameter_list import hardware_parameters, parameter_named
from copsense.hardware.travel_end import EndRates, TravelEnd
from copsense.hardware.value_sweep import HardwareSweep, hardware_sweep

__all__ = [
    "Alteration",
    "ChangedTravel",
    "EndRates",
    "HardwareEffects",
    "HardwareSweep",
    "Parameter",
    "Stretch",
    "TravelEnd",
    "changed",
    "changed_travel",
    "hardware_effects",
    "hardware_parameters",
    "hardware_sweep",
    "parameter_named",
]
