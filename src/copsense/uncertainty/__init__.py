"""Uncertainty: what a model's errors make of wrenches, centres of pressure, margins and travels.

`Uncertainty` says how far masses, joints, contacts and the ground may be off;
`propagate_uncertainty` what follows, exact to first order, and how far that carries.
"""

from copsense.uncertainty.path_travel import RobustTravel
from copsense.uncertainty.perturbation import perturbed, perturbed_limits
from copsense.uncertainty.posture_travel import robust_com_travel
from copsense.uncertainty.propagation import Spread, propagate_uncertainty, sample_models
from copsense.uncertainty.source import Source
from copsense.uncertainty.source_changes import check_uncertain
from copsense.uncertainty.source_list import sources_of
from copsense.uncertainty.uncertainty_tables import Uncertainty

__all__ = [
    "RobustTravel",
    "Source",
    "Spread",
    "Uncertainty",
    "check_uncertain",
    "perturbed",
    "perturbed_limits",
    "propagate_uncertainty",
    "robust_com_travel",
    "sample_models",
    "sources_of",
]
