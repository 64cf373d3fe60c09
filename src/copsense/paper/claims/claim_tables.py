"""Every claim of the paper by its subject, and their evaluation.

The paper shows measurements on a robot; what a quasi-static motion should show is computed on a
sweep of postures, and what a simulated robot shows on its recordings.
"""

from __future__ import annotations

from copsense.paper.claims.closed_loop_claims import SWAY_CLAIMS
from copsense.paper.claims.cop_claims import COP_CLAIMS
from copsense.paper.claims.force_claims import FORCE_CLAIMS
from copsense.paper.claims.icub_cop_claims import ICUB_COP_CLAIMS
from copsense.paper.claims.icub_force_claims import ICUB_FORCE_CLAIMS
from copsense.paper.claims.icub_sweep import LateralSweep
from copsense.paper.claims.lemma_claims import LEMMA_CLAIMS
from copsense.paper.claims.modelling_claims import MODELLING_CLAIMS
from copsense.paper.claims.sway_runs import Sway
from copsense.paper.claims.verdict import Claim, EvaluatedClaim, evaluate_claims
from copsense.paper.closed_form.dimensions import FourBar
from copsense.sweeps import Sweep

FOUR_BAR_CLAIMS: tuple[Claim[FourBar], ...] = (
    *MODELLING_CLAIMS,
    *LEMMA_CLAIMS,
    *FORCE_CLAIMS,
    *COP_CLAIMS,
)
ICUB_CLAIMS: tuple[Claim[LateralSweep], ...] = (*ICUB_FORCE_CLAIMS, *ICUB_COP_CLAIMS)


def evaluate_four_bar_claims(four_bar: FourBar) -> tuple[EvaluatedClaim, ...]:
    """Evaluate every claim of Sections I to IV and VI about the four-bar.

    Args:
        four_bar: the linkage; ``FourBar()`` is the paper's. Its CoM must be able to go a foot
            distance from the centre, kappa l > d, since the claims speak of a foot's unloading.

    Returns:
        One row per claim, in the groups modelling, lemmas, forces, CoPs.

    Raises:
        InvalidInputError: the CoM cannot go that far.
    """
    four_bar.angle_at(four_bar.rod_length)  # says what to change, before any claim is tried
    return evaluate_claims(FOUR_BAR_CLAIMS, four_bar)


def evaluate_icub_claims(dataset: Sweep, four_bar: FourBar) -> tuple[EvaluatedClaim, ...]:
    """Evaluate the claims of Sections V and VI about the iCub on a lateral sweep.

    Args:
        dataset: see `LateralSweep.from_dataset`.
        four_bar: the linkage that the iCub is compared with.

    Raises:
        InvalidInputError: the sweep does not hold what the claims are about.
    """
    return evaluate_claims(ICUB_CLAIMS, LateralSweep.from_dataset(dataset, four_bar))


def evaluate_sway_claims(sway: Sway) -> tuple[EvaluatedClaim, ...]:
    """Evaluate the claims of Section V on a robot's recordings in closed loop."""
    return evaluate_claims(SWAY_CLAIMS, sway)
