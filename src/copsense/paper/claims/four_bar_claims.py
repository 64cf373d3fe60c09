"""evaluate_four_bar_claims: every claim the paper makes about the four-bar, judged by numbers."""

from __future__ import annotations

from copsense.paper.claims.claim import CheckedClaim, EvaluatedClaim, evaluate_claims
from copsense.paper.claims.cop_claims import COP_CLAIMS
from copsense.paper.claims.force_claims import FORCE_CLAIMS
from copsense.paper.claims.lemma_claims import LEMMA_CLAIMS
from copsense.paper.claims.modelling_claims import MODEL_CLAIMS
from copsense.paper.closed_form.dimensions import FourBar
from copsense.paper.closed_form.discrepancy import angle_at

FOUR_BAR_CLAIMS: tuple[CheckedClaim[FourBar], ...] = (
    *MODEL_CLAIMS,
    *LEMMA_CLAIMS,
    *FORCE_CLAIMS,
    *COP_CLAIMS,
)


def evaluate_four_bar_claims(four_bar: FourBar) -> tuple[EvaluatedClaim, ...]:
    """Evaluate every claim of Sections I to IV and VI about the four-bar.

    Args:
        four_bar: the linkage; ``FourBar()`` is the paper's. Its CoM must be able to go a foot
            distance from the centre, kappa l > d, since the claims speak of a foot's unloading.

    Returns:
        One row per claim, in the groups model, formulas, forces, CoPs.

    Raises:
        InvalidInputError: the CoM cannot go that far.
    """
    angle_at(four_bar, four_bar.rod_length)  # says what to change, before any claim is tried
    return evaluate_claims(FOUR_BAR_CLAIMS, four_bar)
