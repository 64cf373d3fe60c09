"""ERRATA: every place where the paper's printed text differs from what holds.

"S-" and "S+" say that the left foot is at -x and at +x; c = cos(xi), s = sin(xi).
"""

from __future__ import annotations

import math
from functools import partial

from copsense.paper.closed_form.dimensions import FourBar
from copsense.paper.errata import errata_forms as forms
from copsense.paper.errata import errata_statements as statements
from copsense.paper.errata.erratum import Erratum, EvaluatedErratum
from copsense.paper.errata.quantities import (
    as_printed,
    cop,
    load,
    load_over_foot,
    moment,
    redundancy,
    right_foot_jacobian_entry,
    sensitivity,
    sine_of_pole,
)

_PAPERS = FourBar()
_POLE = math.degrees(statements.pole(_PAPERS))
# 14 deg needs kappa sin(14 deg) = d/l
_NEEDED = _PAPERS.kappa * math.sin(math.radians(14.0))

ERRATA: tuple[Erratum, ...] = (
    Erratum(
        "(8)",
        "q = chi(xi) for all q in Q",
        "for q on the constraint set, locally",
        "the feet fix all but p = nv - rank J coordinates",
    ),
    Erratum(
        "(10)",
        "the CoP of any contact frame",
        "the normal must be e3 and the origin on the contact plane",
        "in general p = (n x m + (n . p0) f) / (n . f)",
        statements.sensor_frame,
    ),
    Erratum(
        "(12)",
        "d/dt dL/dv + dL/dq = [0; tau]",
        "d/dt dL/dv - dL/dq = [0; tau] + J'f",
        "at rest dL/dq = -G",
        statements.lagrange,
    ),
    Erratum(
        "Hypothesis 1-i with (5), (9), (20), (25)",
        "M^-1",
        "massless feet make M singular, of rank 5 of 7",
        "at equilibrium any SPD matrix in place of M^-1 gives the same f",
        statements.point_masses,
    ),
    Erratum(
        "(13), J_CL, (16), (17), (29), (31)",
        "left and right as in Fig. 1",
        "these are in S+; (15) alone is in S-",
        "(28) holds in either",
        forms.handedness,
    ),
    Erratum(
        "J_CR",
        "$-d / 2 + l c3$",
        "$-d / 2 - l c3$",
        "the sign of l c3",
        forms.right_jacobian,
        printed_quantities=(as_printed("J_CR", 1, 2),),
        holding_quantities=(right_foot_jacobian_entry,),
    ),
    Erratum(
        "(15)",
        "f_y / (m g) = $1 / (2 (1 + d² / 4)) + d (5 d ± 6 l c) / (10 (d² + 4))$, "
        "m_z / (m g) = $6 l c / (5 (d² + 4))$",
        "f_y / (m g) = $1 / 2 ± kappa d l c / (d² + 4)$, m_z / (m g) = $2 kappa l c / (d² + 4)$",
        "6/5 and 6/10 are 2 kappa and kappa with kappa = 3/5 (m_b = m_l / 2), against Hypothesis "
        "1-iii, kappa = 3/4; in S-",
        partial(
            forms.form_check,
            equation="(15)",
            criterion="minimum-wrench",
            quantity="wrenches",
            hypothesis="kappa = 3/5, left at -x",
        ),
        (
            as_printed("(15)", 1, over_weight=True),
            as_printed("(15)", 2, over_weight=True),
        ),
        (load("minimum-wrench"), moment("minimum-wrench")),
    ),
    Erratum(
        "(16)",
        "eta(±x) = $-60 l s (d² + 4) / (5 d² ± 6 l d c + 20)²$",
        "eta(±x) = $-4 kappa l s (d² + 4) / (d² + 4 ± 2 kappa l d c)²$",
        "kappa = 3/5, and L and R swapped against (15); the differentiation is right",
        partial(
            forms.form_check,
            equation="(16)",
            criterion="minimum-wrench",
            quantity="sensitivity",
            hypothesis="kappa = 3/5, left at +x",
        ),
        (as_printed("(16)"),),
        (sensitivity("minimum-wrench"),),
    ),
    Erratum(
        "Appendix A, SCoP",
        "SCoP(±x) = $12 l c / (5 d² ± 6 l d c + 20)$",
        "SCoP(±x) = $4 kappa l c / (d² + 4 ± 2 kappa l d c)$",
        "kappa = 3/5, and L and R swapped against (15)",
        partial(
            forms.form_check,
            equation="Appendix A",
            criterion="minimum-wrench",
            quantity="cop",
            hypothesis="kappa = 3/5, left at +x",
        ),
        (as_printed("Appendix A"),),
        (cop("minimum-wrench"),),
    ),
    Erratum(
        "(17)",
        "left and right as in (15)",
        "exact for kappa = 3/4 in S+",
        "against (15), left and right are swapped",
        forms.wrong_hand,
    ),
    Erratum(
        "(26)",
        "(2 - ...)",
        "[2 1_6; 0] - ...",
        "the 2 stands for a matrix of n + 6 rows",
    ),
    Erratum(
        "Appendix B, P",
        "I with the centre of mass as origin",
        "I about the base origin",
        "",
    ),
    Erratum(
        "Appendix B, Lambda",
        "Lambda' e3 = 1_6",
        "Lambda' e3 = e3",
        "P' e3 = 0",
    ),
    Erratum(
        "(25)-(28)",
        "A^+ A = 1 since A has more rows than the system has DoF",
        "A must have full column rank",
        "true on the four-bar, false on the iCub (23 > 12): use tau = G_j - J_j' f",
        statements.column_rank,
    ),
    Erratum(
        "(29)",
        "two rows",
        "Delta is m g / 2 times ($kappa l c² / (d s)$, $kappa l c / d$, $d / 2$)",
        "the third row is missing",
        forms.third_row,
        holding_quantities=(redundancy(0), redundancy(1), redundancy(2)),
    ),
    Erratum("(32)", "rho in SCoP_L", "lambda in SCoP_L", "", forms.left_arm),
    Erratum(
        "(33)",
        "SCoP(±x) = $9 l d c / (20 d ± 6 l c)$",
        "SCoP(±x) = $kappa l d c / (2 (d ± kappa l c))$",
        "printed = (31) with Delta_1 and Delta_2 halved once more and kappa = 3/5",
        forms.halved_twice,
        (as_printed("(33)"),),
        (cop("minimum-torque"),),
    ),
    Erratum(
        "(18)",
        "eta(±x) = $-45 d² l s / (10 d ± 3 l c)²$",
        "eta(±x) = $-kappa l d² s / (2 (d ± kappa l c)²)$",
        "the derivative of (33), and so as wrong",
        forms.printed_torque_sensitivity,
        (as_printed("(18)"),),
        (sensitivity("minimum-torque"),),
    ),
    Erratum(
        "Lemma 3",
        "minimum tangential force is equivalent to minimum wrench norm",
        "only with the minimum-wrench tie-break and feet at equal height",
        "minimum tangential force alone leaves a 2-D family on the four-bar, 4-D in space",
        statements.tie_break,
    ),
    Erratum(
        "Section IV-B, text after (18)",
        "CoM over a foot: f_y = m g there",
        "f_y = $3 m g / 4$",
        "(1/2 + a/2) m g with share a = 1/2; printed (17) itself says so",
        statements.load_over_a_foot,
        holding_quantities=(load_over_foot,),
    ),
    Erratum(
        "Section IV-B, text on Fig. 3b",
        "divergence around ±14 deg",
        f"sin(Delta xi) = $d / (kappa l)$: {_POLE:.1f} deg for l = {_PAPERS.leg_length:g} m, "
        f"d = {_PAPERS.rod_length:g} m, kappa = 3/4",
        f"14 deg needs d/l = {_NEEDED:.3f}",
        statements.divergence,
        holding_quantities=(sine_of_pole,),
    ),
)


def evaluate_errata(four_bar: FourBar) -> tuple[EvaluatedErratum, ...]:
    """Evaluate every erratum on one linkage, in the order of ERRATA.

    Args:
        four_bar: its CoM must be able to go a foot distance from the centre: kappa l > d.

    Raises:
        InvalidInputError: the CoM cannot go that far.
    """
    return tuple(
        EvaluatedErratum(erratum, None if erratum.check is None else erratum.check(four_bar))
        for erratum in ERRATA
    )
