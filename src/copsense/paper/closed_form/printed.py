"""PrintedForm: the paper's formulas letter for letter, right or wrong.

Nothing here is corrected: `copsense.paper.errata` says what holds instead. Each function takes the
linkage and the angle xi [rad]; the printed 4, 20 or 1 that stands for a squared metre is kept, so
lengths are in metres. Rows and entries go left, right, and each form says where "left" is, for the
paper's equations do not agree. lambda and rho go from the CoM to the left and to the right foot.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from types import MappingProxyType

import numpy as np
from jaxtyping import Float

from copsense.paper.closed_form.dimensions import FourBar
from copsense.paper.closed_form.linkage import Hand, Linkage

Array = Float[np.ndarray, "..."]


@dataclass(frozen=True)
class PrintedForm:
    """One formula as printed.

    Attributes:
        equation: its number in [Romano2016], or its name where it has none.
        quantity: what it gives, with the shape and the unit.
        hand: where "left" must be for the form to come nearest to what holds.
        evaluate: linkage and xi [rad] to the value.
        kappa: the mass ratio that its numbers stand for; None where the form shows it.
    """

    equation: str
    quantity: str
    hand: Hand
    evaluate: Callable[[FourBar, float], Array]
    kappa: Fraction | None = None


def mass_matrix_coupling(four_bar: FourBar, xi: float) -> Float[np.ndarray, "3 4"]:
    """M_bj, [Romano2016] Eq. (13), at q1 = q3 = xi [kg m, kg m²]."""
    l, d, m_l = four_bar.leg_length, four_bar.rod_length, four_bar.leg_mass
    s1 = s3 = np.sin(xi)
    c1 = c3 = np.cos(xi)
    left = (l**2 * s1**2 - l * c1 * (d - l * c1)) / 2
    right = (l**2 * s3**2 + l * c3 * (d + l * c3)) / 2
    return np.asarray(
        m_l / 2 * np.array([[l * s1, 0, l * s3, 0], [-l * c1, 0, -l * c3, 0], [left, 0, right, 0]])
    )


def left_foot_jacobian(four_bar: FourBar, xi: float) -> Float[np.ndarray, "3 7"]:
    """J_CL, [Romano2016, Section IV-A], at theta = 0 and q1 = xi [m, 1].

    Printed with R(theta) before columns of three; read as turning their first two entries.
    """
    l, d = four_bar.leg_length, four_bar.rod_length
    s1, c1 = np.sin(xi), np.cos(xi)
    theta, hip, ankle = [l * s1, d / 2 - l * c1, 1], [l * s1, -l * c1, 1], [0, 0, 1]
    return np.column_stack([np.eye(3)[:, :2], theta, hip, ankle, np.zeros((3, 2))])


def right_foot_jacobian(four_bar: FourBar, xi: float) -> Float[np.ndarray, "3 7"]:
    """J_CR, [Romano2016, Section IV-A], at theta = 0 and q3 = xi [m, 1]."""
    l, d = four_bar.leg_length, four_bar.rod_length
    s3, c3 = np.sin(xi), np.cos(xi)
    theta, hip, ankle = [l * s3, -d / 2 + l * c3, 1], [l * s3, -l * c3, 1], [0, 0, 1]
    return np.column_stack([np.eye(3)[:, :2], theta, np.zeros((3, 2)), hip, ankle])


def configuration(four_bar: FourBar, xi: float) -> Float[np.ndarray, "7"]:
    """Posture q = chi(xi), [Romano2016] Eq. (14) [m, rad]."""
    l, d = four_bar.leg_length, four_bar.rod_length
    e1, e2 = np.eye(2)
    base = d * e1 / 2 + l * np.sin(xi) * e2 + l * np.cos(xi) * e1
    return np.concatenate([base, [0, xi, np.pi - xi, xi, np.pi - xi]])


def minimum_wrench_wrenches(four_bar: FourBar, xi: float) -> Float[np.ndarray, "2 3"]:
    """f_L and f_R of criterion 1, [Romano2016] Eq. (15) [N, N, N m]."""
    l, d, mg = four_bar.leg_length, four_bar.rod_length, four_bar.weight
    c = np.cos(xi)
    even, moment = 1 / (2 * (1 + d**2 / 4)), 6 * l * c / (5 * (d**2 + 4))
    f_L = [0, even + d * (5 * d - 6 * l * c) / (10 * (d**2 + 4)), moment]
    f_R = [0, even + d * (5 * d + 6 * l * c) / (10 * (d**2 + 4)), moment]
    return np.asarray(mg * np.array([f_L, f_R]))


def minimum_wrench_cop(four_bar: FourBar, xi: float) -> Float[np.ndarray, "2"]:
    """SCoP_L and SCoP_R of criterion 1, [Romano2016, Appendix A] [m]."""
    l, d, c = four_bar.leg_length, four_bar.rod_length, np.cos(xi)
    left = 12 * l * c / (5 * d**2 + 6 * l * d * c + 20)
    right = 12 * l * c / (5 * d**2 - 6 * l * d * c + 20)
    return np.array([left, right])


def minimum_wrench_sensitivity(four_bar: FourBar, xi: float) -> Float[np.ndarray, "2"]:
    """eta_L and eta_R of criterion 1, [Romano2016] Eq. (16) [m/rad]."""
    l, d, c, s = four_bar.leg_length, four_bar.rod_length, np.cos(xi), np.sin(xi)
    left = -60 * l * s * (d**2 + 4) / (5 * d**2 + 6 * l * d * c + 20) ** 2
    right = -60 * l * s * (d**2 + 4) / (5 * d**2 - 6 * l * d * c + 20) ** 2
    return np.array([left, right])


def _shared_wrenches(four_bar: FourBar, xi: float, half_kappa: float) -> Float[np.ndarray, "2 3"]:
    """The terms that Eqs. (17) and (31) have in common; `half_kappa` is 3/8 in Eq. (17)."""
    l, d, mg = four_bar.leg_length, four_bar.rod_length, four_bar.weight
    c, s = np.cos(xi), np.sin(xi)
    (lam1, lam2), (rho1, rho2) = Linkage(four_bar, Hand.LEFT_AT_PLUS_X).com_to_feet(xi)
    tangential, vertical = half_kappa * l * c**2 / (d * s), half_kappa * l * c / d
    turn_L = vertical * (lam2 * c / s - lam1) + d / 4
    turn_R = vertical * (rho2 * c / s - rho1) + d / 4
    f_L = np.array([0, 1 / 2, -lam1 / 2]) + np.array([tangential, vertical, turn_L])
    f_R = np.array([0, 1 / 2, -rho1 / 2]) - np.array([tangential, vertical, turn_R])
    return np.asarray(mg * np.array([f_L, f_R]))


def minimum_torque_wrenches(four_bar: FourBar, xi: float) -> Float[np.ndarray, "2 3"]:
    """f_L and f_R of criterion 2, [Romano2016] Eq. (17) [N, N, N m]."""
    return _shared_wrenches(four_bar, xi, 3 / 8)


def minimum_torque_sensitivity(four_bar: FourBar, xi: float) -> Float[np.ndarray, "2"]:
    """eta_L and eta_R of criterion 2, [Romano2016] Eq. (18) [m/rad]."""
    l, d, c, s = four_bar.leg_length, four_bar.rod_length, np.cos(xi), np.sin(xi)
    left = -45 * d**2 * l * s / (10 * d + 3 * l * c) ** 2
    right = -45 * d**2 * l * s / (10 * d - 3 * l * c) ** 2
    return np.array([left, right])


def torque_redundancy(four_bar: FourBar, xi: float) -> Float[np.ndarray, "2"]:
    """Delta of criterion 2, [Romano2016] Eq. (29): two rows, where Eq. (24) takes three [N]."""
    l, d, mg, kappa = four_bar.leg_length, four_bar.rod_length, four_bar.weight, four_bar.kappa
    c, s = np.cos(xi), np.sin(xi)
    return np.asarray(mg / 2 * np.array([kappa * l * c**2 / (d * s), kappa * l * c / d]))


def minimum_torque_wrenches_any_masses(four_bar: FourBar, xi: float) -> Float[np.ndarray, "2 3"]:
    """f_L and f_R of criterion 2, [Romano2016] Eq. (31) [N, N, N m]."""
    return _shared_wrenches(four_bar, xi, four_bar.kappa / 2)


def redundancy_cop(four_bar: FourBar, xi: float) -> Float[np.ndarray, "2"]:
    """SCoP_L and SCoP_R from Delta, [Romano2016] Eq. (32), rho in both rows as printed [m].

    Delta in parts of m g: the two rows of Eq. (29), and d/4, which Eq. (31) adds for the third.
    """
    D1, D2 = torque_redundancy(four_bar, xi) / four_bar.weight
    D3 = four_bar.rod_length / 4
    _, (rho1, rho2) = Linkage(four_bar, Hand.LEFT_AT_PLUS_X).com_to_feet(xi)
    left = (-rho1 / 2 + rho2 * D1 - rho1 * D2 + D3) / (1 / 2 + D2)
    right = (-rho1 / 2 - rho2 * D1 + rho1 * D2 - D3) / (1 / 2 - D2)
    return np.array([left, right])


def minimum_torque_cop(four_bar: FourBar, xi: float) -> Float[np.ndarray, "2"]:
    """SCoP_L and SCoP_R of criterion 2, [Romano2016] Eq. (33) [m]."""
    l, d, c = four_bar.leg_length, four_bar.rod_length, np.cos(xi)
    left = 9 * l * d * c / (20 * d + 6 * l * c)
    right = 9 * l * d * c / (20 * d - 6 * l * c)
    return np.array([left, right])


def divergence_angles(four_bar: FourBar, xi: float) -> Float[np.ndarray, "2"]:
    """Delta xi at which a CoP of Fig. 3b diverges: a number in the text of Section IV-B [rad]."""
    return np.radians([-14.0, 14.0])


_S_MINUS, _S_PLUS = Hand.LEFT_AT_MINUS_X, Hand.LEFT_AT_PLUS_X
HYPOTHESIS_KAPPA = Fraction(3, 4)  # Hypothesis 1-iii: the rod weighs two legs
_K34, _K35 = HYPOTHESIS_KAPPA, Fraction(3, 5)

PRINTED_FORMS: Mapping[str, PrintedForm] = MappingProxyType(
    {
        form.equation: form
        for form in (
            PrintedForm("(13)", "M_bj (3, 4) [kg m, kg m²]", _S_PLUS, mass_matrix_coupling),
            PrintedForm("J_CL", "left foot's Jacobian (3, 7)", _S_PLUS, left_foot_jacobian),
            PrintedForm("J_CR", "right foot's Jacobian (3, 7)", _S_PLUS, right_foot_jacobian),
            PrintedForm("(14)", "q = chi(xi) (7,) [m, rad]", _S_PLUS, configuration),
            PrintedForm("(15)", "f (2, 3) [N, N m]", _S_MINUS, minimum_wrench_wrenches, _K35),
            PrintedForm("(16)", "eta (2,) [m/rad]", _S_PLUS, minimum_wrench_sensitivity, _K35),
            PrintedForm("(17)", "f (2, 3) [N, N m]", _S_PLUS, minimum_torque_wrenches, _K34),
            PrintedForm("(18)", "eta (2,) [m/rad]", _S_PLUS, minimum_torque_sensitivity, _K35),
            PrintedForm("(29)", "Delta (2,) [N]", _S_PLUS, torque_redundancy),
            PrintedForm(
                "(31)", "wrenches (2, 3) [N, N m]", _S_PLUS, minimum_torque_wrenches_any_masses
            ),
            PrintedForm("(32)", "SCoP (2,) [m]", _S_PLUS, redundancy_cop),
            PrintedForm("(33)", "SCoP (2,) [m]", _S_PLUS, minimum_torque_cop, _K35),
            PrintedForm("Appendix A", "SCoP (2,) [m]", _S_PLUS, minimum_wrench_cop, _K35),
            PrintedForm("14 deg", "angles of divergence (2,) [rad]", _S_PLUS, divergence_angles),
        )
    }
)
