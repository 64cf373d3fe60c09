"""The analysis of one posture: what ``copsense analyse`` prints, as a result in Python."""

from copsense.analysis.limit_analysis import LimitAnalysis
from copsense.analysis.stance_analysis import Analysis, analyse

__all__ = ["Analysis", "LimitAnalysis", "analyse"]
