"""Identification: which criterion explains the forces or torques that a robot measured."""

from copsense.identification.fitting import fit_family
from copsense.identification.identifying import Identification, identify
from copsense.identification.log_identification import (
    hip_ankle_ratio,
    identify_log,
    log_measurements,
)
from copsense.identification.measurements import EncoderErrors, Measurements
from copsense.identification.parameter_fit import Estimate, ParameterFit

__all__ = [
    "EncoderErrors",
    "Estimate",
    "Identification",
    "Measurements",
    "ParameterFit",
    "fit_family",
    "hip_ankle_ratio",
    "identify",
    "identify_log",
    "log_measurements",
]
