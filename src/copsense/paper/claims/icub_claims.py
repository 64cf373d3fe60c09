"""evaluate_icub_claims: Section V's and the conclusion's claims in their static form, judged.

The paper shows measurements; what a quasi-static motion should show is computed here. "Loaded" is
the foot on whose side the CoM is.
"""

from __future__ import annotations

import xarray as xr

from copsense.paper.claims.claim import CheckedClaim, Claim, EvaluatedClaim, evaluate_claims
from copsense.paper.claims.icub_cop_claims import (
    chart,
    hip_roll_coordinate,
    less_on_support,
    lower_sensitivity,
    parallel,
    similar,
)
from copsense.paper.claims.icub_force_claims import (
    body_mass,
    equal_legs,
    forces_vary,
    full_period,
    half_weight,
    hip_height,
    mirrored,
    over_the_foot,
    tends_to_zero,
)
from copsense.paper.claims.icub_sweep import LateralSweep
from copsense.paper.closed_form.dimensions import FourBar

ICUB_CLAIMS: tuple[CheckedClaim[LateralSweep], ...] = (
    CheckedClaim(
        Claim(
            "icub-equal-legs",
            "Hypothesis 1-ii",
            "On the iCub the left leg weighs as much as the right leg.",
        ),
        equal_legs,
    ),
    CheckedClaim(
        Claim(
            "icub-body-mass",
            "Hypothesis 1-iii",
            "On the iCub the upper body weighs twice a leg.",
        ),
        body_mass,
    ),
    CheckedClaim(
        Claim("icub-hip-height", "Section V", "The iCub's hips are about 50 cm high."), hip_height
    ),
    CheckedClaim(
        Claim(
            "icub-half-weight",
            "Section V, Fig. 6a",
            "Criterion 1: the vertical forces change little from half the weight.",
        ),
        half_weight,
    ),
    CheckedClaim(
        Claim(
            "icub-mirrored",
            "Section V",
            "Criterion 1: towards the right foot the forces behave as towards the left.",
        ),
        mirrored,
    ),
    CheckedClaim(
        Claim(
            "icub-forces-vary",
            "Section V, Fig. 6b",
            "Criterion 2: the vertical forces depend on the position of the CoM.",
        ),
        forces_vary,
    ),
    CheckedClaim(
        Claim(
            "icub-over-the-foot",
            "Section V",
            "The robot moves to where its CoM lies over the origin of a foot's frame.",
        ),
        over_the_foot,
    ),
    CheckedClaim(
        Claim(
            "icub-full-period",
            "Section V",
            "One amplitude: criterion 2 tracks a full period of the CoM's sine, criterion 1 does "
            "not.",
        ),
        full_period,
    ),
    CheckedClaim(
        Claim(
            "icub-parallel",
            "Section V, Fig. 7",
            "Criterion 1: the two CoPs move almost in parallel, whichever foot is loaded.",
        ),
        parallel,
    ),
    CheckedClaim(
        Claim(
            "icub-less-on-support",
            "Section V, Fig. 8",
            "Criterion 2: the loaded foot's CoP moves less than the other one.",
        ),
        less_on_support,
    ),
    CheckedClaim(
        Claim(
            "icub-hip-roll",
            "Remark 5",
            "The left hip roll joint can stand for the four-bar's coordinate.",
        ),
        hip_roll_coordinate,
    ),
    CheckedClaim(
        Claim(
            "icub-similar",
            "Remark 5, Fig. 9",
            "The left foot's CoP against hip roll is similar on the four-bar and on the iCub.",
        ),
        similar,
    ),
    CheckedClaim(
        Claim(
            "icub-chart",
            "Remark 2",
            "The value of the sensitivity depends on the choice of the parametrisation.",
        ),
        chart,
    ),
    CheckedClaim(
        Claim(
            "icub-lower-sensitivity",
            "Section VI",
            "Minimising the joint torques gives a lower sensitivity than minimising the wrenches.",
        ),
        lower_sensitivity,
    ),
    CheckedClaim(
        Claim(
            "icub-tends-to-zero",
            "Section VI",
            "Criterion 2: the force on one foot tends to zero as the CoM moves to the other foot.",
        ),
        tends_to_zero,
    ),
)


def evaluate_icub_claims(dataset: xr.Dataset, four_bar: FourBar) -> tuple[EvaluatedClaim, ...]:
    """Evaluate the paper's claims about the iCub on a lateral sweep.

    Args:
        dataset: see `LateralSweep.from_dataset`.
        four_bar: the linkage that the iCub is compared with.

    Returns:
        One row per claim, in the order of ICUB_CLAIMS.

    Raises:
        InvalidInputError: the sweep does not hold what the claims are about.
    """
    return evaluate_claims(ICUB_CLAIMS, LateralSweep.from_dataset(dataset, four_bar))
