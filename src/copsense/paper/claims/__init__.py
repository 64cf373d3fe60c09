"""What the paper says, and what the numbers say of it.

To add a claim: put ``@claim(identifier, where, statement)`` over its check in the module of its
subject, and name it in the table at that module's end.
"""

from copsense.paper.claims.claim_tables import (
    FOUR_BAR_CLAIMS,
    ICUB_CLAIMS,
    evaluate_four_bar_claims,
    evaluate_icub_claims,
    evaluate_sway_claims,
)
from copsense.paper.claims.closed_loop_claims import SWAY_CLAIMS
from copsense.paper.claims.icub_sweep import LateralSweep, Series
from copsense.paper.claims.reference_values import ReferenceValue, compare_with_reference
from copsense.paper.claims.sway_runs import (
    Stretch,
    Sway,
    stretch,
)
from copsense.paper.claims.verdict import (
    VERDICT_STANDARD,
    Claim,
    EvaluatedClaim,
    Finding,
    Verdict,
    claim,
    evaluate_claims,
    judge,
)

__all__ = [
    "FOUR_BAR_CLAIMS",
    "ICUB_CLAIMS",
    "SWAY_CLAIMS",
    "VERDICT_STANDARD",
    "Claim",
    "EvaluatedClaim",
    "Finding",
    "LateralSweep",
    "ReferenceValue",
    "Series",
    "Stretch",
    "Sway",
    "Verdict",
    "claim",
    "compare_with_reference",
    "evaluate_claims",
    "evaluate_four_bar_claims",
    "evaluate_icub_claims",
    "evaluate_sway_claims",
    "judge",
    "stretch",
]
