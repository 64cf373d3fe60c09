"""Logs: what a robot recorded of itself, read from whatever format, beside what criteria say."""

from __future__ import annotations

from copsense.logs.comparing import compare_log
from copsense.logs.finding import Finding
from copsense.logs.log import Log, WrenchSeries
from copsense.logs.log_comparison import LogComparison
from copsense.logs.log_map import BaseMap, JointsMap, LogMap, WrenchMap
from copsense.logs.log_reading import read_log
from copsense.logs.log_statics import LogStatics
from copsense.logs.sway_fit import SlopeEstimate, Sway

__all__ = [
    "BaseMap",
    "Finding",
    "JointsMap",
    "Log",
    "LogComparison",
    "LogMap",
    "LogStatics",
    "SlopeEstimate",
    "Sway",
    "WrenchMap",
    "WrenchSeries",
    "compare_log",
    "read_log",
]
