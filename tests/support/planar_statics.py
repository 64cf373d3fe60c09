"""The four-bar's statics again, body by body, sharing nothing with the package.

Five free bodies (foot, leg, rod, leg, foot), every force and moment between them an unknown, and a
KKT system for the criterion. Works for a complex xi, so that derivatives come by the complex step.

The 18 unknowns: both ground wrenches (6), then per side the force and the torque of leg on foot (3)
and of rod on leg (3), left side first.
"""

from __future__ import annotations

import numpy as np

WRENCHES = slice(0, 6)
TORQUES = [11, 8, 17, 14]  # hip left, ankle left, hip right, ankle right


def _cross(arm, columns):
    """Row that takes the force in `columns` to its moment, for the arm (x, y)."""
    row = np.zeros(18, dtype=complex)
    row[columns[0]], row[columns[1]] = -arm[1], arm[0]
    return row


def balance(four_bar, xi):
    """A z = b: Newton and Euler on each of the five bodies."""
    l, d, g = four_bar.leg_length, four_bar.rod_length, four_bar.gravity
    leg = np.array([l * np.cos(xi), l * np.sin(xi)])
    A, b = [], []

    def equation(terms, right=0.0, row=None):
        row = np.zeros(18, dtype=complex) if row is None else row
        for column, sign in terms:
            row[column] += sign
        A.append(row)
        b.append(right)

    rod_middle = np.array([d / 2, 0.0]) + leg
    rod_moment = np.zeros(18, dtype=complex)
    for ground, ankle, hip, foot in ((0, 6, 9, [0.0, 0.0]), (3, 12, 15, [d, 0.0])):
        foot = np.array(foot)
        # the foot, massless, all acting at one point
        for i in range(3):
            equation([(ground + i, 1.0), (ankle + i, 1.0)])
        # the leg: rod on it at the hip, minus what it does to the foot, and its weight
        equation([(hip, 1.0), (ankle, -1.0)])
        equation([(hip + 1, 1.0), (ankle + 1, -1.0)], four_bar.leg_mass * g)
        about_middle = _cross(leg / 2, (hip, hip + 1)) - _cross(-leg / 2, (ankle, ankle + 1))
        equation([(hip + 2, 1.0), (ankle + 2, -1.0)], 0.0, about_middle)
        rod_moment -= _cross(foot + leg - rod_middle, (hip, hip + 1))
        rod_moment[hip + 2] -= 1.0
    equation([(9, -1.0), (15, -1.0)])
    equation([(10, -1.0), (16, -1.0)], four_bar.body_mass * g)
    equation([], 0.0, rod_moment)
    return np.array(A), np.array(b, dtype=complex)


def minimise(four_bar, xi, weights, *, no_tangential=False):
    """z that minimises sum(weights z²) / 2 subject to the balance (and to f_x = 0 on the left)."""
    A, b = balance(four_bar, xi)
    if no_tangential:
        A, b = np.vstack([A, np.eye(18)[0]]), np.append(b, 0.0)
    n = len(b)
    kkt = np.block([[np.diag(weights), A.T], [A, np.zeros((n, n))]])
    return np.linalg.solve(kkt, np.concatenate([np.zeros(18), b]))[:18]


def wrench_weights(length):
    weights = np.zeros(18)
    weights[WRENCHES] = [1, 1, 1 / length**2] * 2
    return weights


def torque_weights(hip=1.0, ankle=1.0):
    weights = np.zeros(18)
    weights[TORQUES] = [hip, ankle, hip, ankle]
    return weights


def cop(z):
    wrenches = z[WRENCHES].reshape(2, 3)
    return wrenches[:, 2] / wrenches[:, 1]
