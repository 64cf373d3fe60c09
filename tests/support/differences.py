"""Finite differences along the constraint manifold, the judge of every analytic derivative."""

import numpy as np

import copsense

STEP = 1e-3


def along(stance, value, directions, *, step=STEP):
    """d value(stance) along each column of directions (nv, p), as the last axis.

    Fourth-order central differences; each stance is moved and brought back onto its contacts.
    """
    columns = []
    for direction in np.asarray(directions).T:
        at = {
            k: value(copsense.posture.retract(stance, k * step * direction)) for k in (-2, -1, 1, 2)
        }
        columns.append((8 * (at[1] - at[-1]) - (at[2] - at[-2])) / (12 * step))
    return np.stack(columns, axis=-1)


def largest_error(exact, numeric):
    """The largest error of any direction (last axis), relative to that direction's largest entry.

    A direction that hardly moves anything is compared with a thousandth of the greatest.
    """
    exact = np.asarray(exact).reshape(-1, np.shape(exact)[-1])
    numeric = np.asarray(numeric).reshape(exact.shape)
    sizes = np.abs(exact).max(axis=0)
    sizes = np.maximum(sizes, 1e-3 * sizes.max())
    return float((np.abs(exact - numeric).max(axis=0) / sizes).max())


def relative(given, expected):
    """Largest difference of two arrays, relative to the largest entry of the second."""
    given, expected = np.asarray(given), np.asarray(expected)
    assert given.shape == expected.shape
    return float(np.abs(given - expected).max() / np.abs(expected).max())


def outcome(stance, criterion):
    """Everything that a criterion decides at a stance: CoPs, wrenches and torques, end to end."""
    found = copsense.solve_equilibrium(stance, criterion)
    cops = copsense.cop.contact_cops(found)
    return np.concatenate([cops.ravel(), found.wrenches.ravel(), found.torques])


def derivative_errors(stance, criterion):
    """Errors of the analytic derivatives of CoPs, wrenches and torques along every motion."""
    found = copsense.cop_sensitivity(stance, criterion)
    numeric = along(stance, lambda at: outcome(at, criterion), stance.admissible_motions)
    nc = len(stance.contacts)
    cops, wrenches, torques = np.split(numeric, [2 * nc, 8 * nc])
    errors = {
        "wrench": largest_error(found.wrench_derivative, wrenches),
        "torque": largest_error(found.torque_derivative, torques),
    }
    if np.any(found.matrix):  # a point contact's CoP stands still
        errors["cop"] = largest_error(found.matrix, cops)
    else:
        assert not np.any(cops)
    return errors
