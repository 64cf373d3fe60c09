"""One-sided finite differences along a lateral path, whose equilibria change their active set."""

from dataclasses import replace

import numpy as np

import copsense

# 5-point forward difference, error h^4.
FORWARD = np.array([-25.0, 48.0, -36.0, 16.0, -3.0]) / 12


def lateral(stance, y, reference=None):
    """Posture with the CoM at world y, x held if there is one, and the path's tangent there."""
    planar = stance.robot.base_nv == 3
    com = (None if planar else 0.0, float(y), None)
    found = copsense.solve_posture(stance, com=com, reference=reference)
    return found.stance, found.tangents[:, 0 if planar else 1]


def both_sides(stance, y, value, step=2.5e-4):
    """d value / d CoM y before and after y."""
    reference = stance.q
    here, _ = lateral(stance, y, reference)
    sides = []
    for sign in (-1, 1):
        at = [value(lateral(here, y + sign * k * step, reference)[0]) for k in range(5)]
        sides.append(sign * np.tensordot(FORWARD, at, axes=1) / step)
    return sides


def with_vertex(stance, x, out):
    """Each foot on a rectangle, with a vertex at x that stands out of its left edge by that."""
    sole = np.vstack([copsense.rectangle((-0.08, 0.12), (-0.03, 0.03)), [x, 0.03 + out]])
    return stance.with_contacts([replace(c, polygon=sole) for c in stance.contacts])
