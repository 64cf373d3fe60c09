"""Workspace: the memory of a kernel, and where each number of a posture stands in it.

A workspace is an array (rows, `WIDTH`): a row for each number, a column for each of the postures
that are computed abreast. Blocks of rows are known by their first row, their **offset**.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from copsense.batch.layout import RobotLayout

WIDTH = 8  # postures abreast
_CACHE_LINE = 64  # bytes; a row of eight that straddles two of them costs double


class Offsets(NamedTuple):
    """First row of each block of a workspace. World axes, positions from the base's origin o.

    A twist is (velocity at o, angular velocity), a wrench (force, moment about o).

    Attributes:
        q: configuration (nq,).
        flag: above zero where the reference must answer for every criterion.
        doubt: the same for the criterion in hand.
        base: the base's origin in the world (3,).
        rotation: of each body, three columns (n + 1, 9); the third is the joint's axis a.
        position: of each body's origin (n + 1, 3).
        first_moment: h of each body and all it carries (n + 1, 3).
        screw: s of each joint, the twist that its unit velocity gives what it carries (n + 1, 6).
        moment_rate: dh/dq of each joint (n + 1, 3).
        weight: dh/dq x g of each joint (n + 1, 3).
        gravity: G of each joint (n + 1,).
        foot_rotation: contact axes, three columns (nc, 9).
        foot: origin of each contact frame, r (nc, 3).
        spread: centroid (3,) and inverse second moment (9,) of three held points.
        held_row: torque of each support joint per wrench on the held contacts, d (ns, 6).
        Q: the loop matrix, then its orthonormal factor, by columns (r, ns).
        R: its triangular factor, by rows (r, r).
        T: R^-1 (r, r).
        Qw: the same for a criterion with weights, rows of the wrenches below (r, ns + 6 nc).
        Rw: its triangular factor (r, r).
        Tw: Rw^-1 (r, r).
        right: right-hand side of the least squares (ns + 6 nc,).
        C: what completes Q to the row space of J, joints' part by columns (6, ns).
        L: inverse of the Cholesky factor of 1 + C'C (6, 6).
        level: gradient of the CoM moment along the two level directions, projected (2, nv).
        unknown: y or its adjoint (r,).
        six: coefficients of two projections (2, 2, 6).
        felt: gradients on the support joints (2, ns), then memory for another (ns,).
        along: two gradients' parts along Q (2, r), or two motions' along Y (2, r + 6).
        load: b, what the contacts' wrenches sum up to (6,).
        nothing: zeros (6,).
        wrench: phi of each contact (nc, 6).
        group: their sums by group (ng, 6).
        inner: mu of each contact, the adjoint's wrenches (nc, 6).
        inner_group: their sums by group (ng, 6).
        rate: lambda of each support joint (ns,).
        twist: rotation of xi (3,).
        middle: centroid of the contacts (3,) and the inverse 3 x 3 of the least wrench (9,).
        torque: of each joint (n + 1,).
        lever_arm: A of each support joint (ns, 6).
        turning: Omega of each support joint's body (ns, 3).
        pull: T summed over each support joint and those it carries (ns, 6).
        contact_wrench: in contact axes, about the contact frames' origins (nc, 6).
        cop: (nc, 2).
        gradient: of the CoPs (nc, 2, nv).
        inertia: of each body and what it carries, about o (n + 1, 6).
        H: M, then its factor L, by rows (nv, nv).
        diagonal: of M, then 1 / that of L (nv,).
        Y: L^-T J', then its orthonormal factor, by columns (r + 6, 6 + ns).
        RY: its triangular factor (r + 6, r + 6).
        motion: of unit CoM velocity along x and y (2, nv).
        gain: Gamma (nc, 2, 2).
        load_gradient: of a contact's share of the weight (nv,).
        load_gain: its change per CoM x and y (nc, 2).
        margin: distance of each CoP to its sole's edge (nc,).
        travel: of the CoM before a contact tips (nc,).
        edge: the sole's edge it tips over (nc,).
        unloading: travel of the CoM before a contact carries no load (nc,).
        size: rows in all.
    """

    q: int
    flag: int
    doubt: int
    base: int
    rotation: int
    position: int
    first_moment: int
    screw: int
    moment_rate: int
    weight: int
    gravity: int
    foot_rotation: int
    foot: int
    spread: int
    held_row: int
    Q: int
    R: int
    T: int
    Qw: int
    Rw: int
    Tw: int
    right: int
    C: int
    L: int
    level: int
    unknown: int
    six: int
    felt: int
    along: int
    load: int
    nothing: int
    wrench: int
    group: int
    inner: int
    inner_group: int
    own: int
    nu: int
    rate: int
    twist: int
    middle: int
    torque: int
    lever_arm: int
    turning: int
    pull: int
    contact_wrench: int
    cop: int
    gradient: int
    inertia: int
    H: int
    diagonal: int
    Y: int
    RY: int
    motion: int
    gain: int
    load_gradient: int
    load_gain: int
    margin: int
    travel: int
    edge: int
    unloading: int
    size: int


def workspace(rows: int) -> np.ndarray:
    """A workspace (rows, WIDTH), each row in a cache line of its own."""
    memory = np.zeros(rows * WIDTH + _CACHE_LINE // 8)
    start = (-memory.ctypes.data % _CACHE_LINE) // 8
    return memory[start : start + rows * WIDTH].reshape(rows, WIDTH)


def workspace_offsets(layout: RobotLayout, nq: int) -> Offsets:
    """Lay the blocks of a workspace out one after another."""
    n, nc = len(layout.tree.parent) - 1, len(layout.feet.body)
    ns, r, ng = len(layout.feet.support), layout.feet.unknowns, len(layout.feet.member)
    nv = n + 6
    sizes = {
        "q": nq,
        "flag": 1,
        "doubt": 1,
        "base": 3,
        "rotation": 9 * (n + 1),
        "position": 3 * (n + 1),
        "first_moment": 3 * (n + 1),
        "screw": 6 * (n + 1),
        "moment_rate": 3 * (n + 1),
        "weight": 3 * (n + 1),
        "gravity": n + 1,
        "foot_rotation": 9 * nc,
        "foot": 3 * nc,
        "spread": 12,
        "held_row": 6 * ns,
        "Q": r * ns,
        "R": r * r,
        "T": r * r,
        "Qw": r * (ns + 6 * nc),
        "Rw": r * r,
        "Tw": r * r,
        "right": ns + 6 * nc,
        "C": 6 * ns,
        "L": 36,
        "level": 2 * nv,
        "unknown": r,
        "six": 24,
        "felt": 3 * ns,
        "along": 2 * (r + 6),
        "load": 6,
        "nothing": 6,
        "wrench": 6 * nc,
        "group": 6 * ng,
        "inner": 6 * nc,
        "inner_group": 6 * ng,
        "own": 6 * nc,
        "nu": ns,
        "rate": ns,
        "twist": 3,
        "middle": 12,
        "torque": n + 1,
        "lever_arm": 6 * ns,
        "turning": 3 * ns,
        "pull": 6 * ns,
        "contact_wrench": 6 * nc,
        "cop": 2 * nc,
        "gradient": 2 * nc * nv,
        "inertia": 6 * (n + 1),
        "H": nv * nv,
        "diagonal": nv,
        "Y": (r + 6) * (6 + ns),
        "RY": (r + 6) * (r + 6),
        "motion": 2 * nv,
        "gain": 4 * nc,
        "load_gradient": nv,
        "load_gain": 2 * nc,
        "margin": nc,
        "travel": nc,
        "edge": nc,
        "unloading": nc,
    }
    starts, end = {}, 0
    for name, size in sizes.items():
        starts[name], end = end, end + size
    return Offsets(**starts, size=end)
