"""Optimisation: the posture, placement and weights that do best within constraints.

`optimise` looks for the stance with the largest travel, margin or push, or the least gain or
torque; `pareto_front` for what one of them costs of another.
"""

from copsense.optimisation.objectives import QUANTITIES, Quantity
from copsense.optimisation.optimising import optimise
from copsense.optimisation.optimum import Binding, ExactTravel, Front, Optimum, Valuation
from copsense.optimisation.pareto_fronts import pareto_front

__all__ = [
    "QUANTITIES",
    "Binding",
    "ExactTravel",
    "Front",
    "Optimum",
    "Quantity",
    "Valuation",
    "optimise",
    "pareto_front",
]
