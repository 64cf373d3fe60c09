"""Limit states: how a posture stands to its limits under a criterion, by code."""

WITHIN, PRESSED, IMPOSSIBLE, UNLOADED, UNANSWERED = range(5)
# As `LimitResult.state` names them.
LIMIT_STATES = ("within", "pressed", "infeasible", "unloaded", "unanswered")
