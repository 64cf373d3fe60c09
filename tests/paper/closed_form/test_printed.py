"""The printed forms are the paper's letter for letter, right or wrong."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from copsense.paper.closed_form import PRINTED_FORMS, FourBar

# l = 1, d = 2, m g = 1 and xi = 60 deg: the printed fractions by hand
HAND = FourBar(leg_length=1.0, rod_length=2.0, leg_mass=0.25, body_mass=0.5, gravity=1.0)
XI = math.pi / 3
S = math.sqrt(3) / 2


@pytest.mark.parametrize(
    ("equation", "expected"),
    [
        ("(14)", [1.5, S, 0, XI, math.pi - XI, XI, math.pi - XI]),
        ("(15)", [[0, 0.25 + 14 / 80, 3 / 40], [0, 0.25 + 26 / 80, 3 / 40]]),
        ("(16)", [-480 * S / 46**2, -480 * S / 34**2]),
        ("Appendix A", [6 / 46, 6 / 34]),
        # lambda = (1 - 3/8, -3S/4), rho = (-1 - 3/8, -3S/4)
        (
            "(17)",
            [
                [3 / 64 / S, 19 / 32, -5 / 16 + 3 / 32 * (-3 / 8 - 5 / 8) + 1 / 2],
                [-3 / 64 / S, 13 / 32, 11 / 16 - 3 / 32 * (-3 / 8 + 11 / 8) - 1 / 2],
            ],
        ),
        ("(18)", [-180 * S / 21.5**2, -180 * S / 18.5**2]),
        ("(29)", [3 / 64 / S, 3 / 32]),
        (
            "(32)",
            [
                (11 / 16 - 3 * S / 4 * 3 / 64 / S + 11 / 8 * 3 / 32 + 1 / 2) / (19 / 32),
                (11 / 16 + 3 * S / 4 * 3 / 64 / S - 11 / 8 * 3 / 32 - 1 / 2) / (13 / 32),
            ],
        ),
        ("(33)", [9 / 43, 9 / 37]),
        ("14 deg", [-14 * math.pi / 180, 14 * math.pi / 180]),
        (
            "(13)",
            [
                [S / 8, 0, S / 8, 0],
                [-1 / 16, 0, -1 / 16, 0],
                [(3 / 4 - 1 / 2 * 3 / 2) / 16, 0, (3 / 4 + 1 / 2 * 5 / 2) / 16, 0],
            ],
        ),
        (
            "J_CL",
            [[1, 0, S, S, 0, 0, 0], [0, 1, 0.5, -0.5, 0, 0, 0], [0, 0, 1, 1, 1, 0, 0]],
        ),
        (
            "J_CR",
            [[1, 0, S, 0, 0, S, 0], [0, 1, -0.5, 0, 0, -0.5, 0], [0, 0, 1, 0, 0, 1, 1]],
        ),
    ],
)
def test_printed_form_is_the_papers_letter_for_letter(equation, expected):
    given = PRINTED_FORMS[equation].evaluate(HAND, XI)
    np.testing.assert_allclose(given, expected, rtol=1e-12, atol=1e-15)


def test_eq_31_at_three_quarters_is_eq_17_and_at_another_kappa_is_not():
    wrenches, general = (PRINTED_FORMS[name].evaluate for name in ("(17)", "(31)"))
    np.testing.assert_allclose(general(HAND, XI), wrenches(HAND, XI))
    other = replace(HAND, body_mass=0.1)
    assert np.abs(general(other, XI) - wrenches(other, XI)).max() > 1e-3 * other.weight
