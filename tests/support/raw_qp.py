"""The same QP from raw data of the robot and the soles, for independent solvers.

Nothing of copsense's matrices enters: gravity is inverse dynamics at rest, Jacobians are frame
Jacobians moved to the contact, soles are vertices. Forces *and* torques are variables and the
statics are nv equality rows, in units of the weight.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import clarabel
import numpy as np
import pinocchio as pin
import piqp
import scipy.optimize
import scipy.sparse
from scipy.spatial import ConvexHull, QhullError


@dataclass(frozen=True)
class Raw:
    """minimise 1/2 x' P x + c' x subject to E x = e, C x <= d, over x = (f, tau) / weight."""

    P: np.ndarray
    c: np.ndarray
    E: np.ndarray
    e: np.ndarray
    C: np.ndarray
    d: np.ndarray
    weight: float
    m: int


def raw_problem(case):
    stance, limits = case.stance, case.limits
    model, data = stance.robot.model, stance.robot.model.createData()
    zero = np.zeros(model.nv)
    weight = sum(body.mass for body in model.inertias) * 9.81
    G = pin.rnea(model, data, stance.q, zero, zero)
    J = np.vstack([contact_jacobian(stance, data, contact) for contact in stance.contacts])
    m, n, nb = len(J), model.nv - model.joints[1].nv, model.joints[1].nv
    E = np.hstack([J.T, np.vstack([np.zeros((nb, n)), np.eye(n)])])
    P = np.zeros((m + n, m + n))
    P[:m, :m], P[m:, m:] = case.wrench_weight, case.torque_weight
    c = np.concatenate([-case.wrench_weight @ case.reference / weight, np.zeros(n)])
    size = np.abs(P).max()
    C, d = [], []
    first = 0
    for contact in stance.contacts:
        rows, bounds = contact_inequalities(contact, limits)
        full = np.zeros((len(rows), m + n))
        columns = list(contact.components)
        full[:, first : first + len(columns)] = rows[:, columns]
        first += len(columns)
        C.append(full)
        d.append(bounds / weight)
    bound = joint_bounds(stance, limits.torque)
    for i in np.flatnonzero(np.isfinite(bound)):
        for sign in (1.0, -1.0):
            row = np.zeros((1, m + n))
            row[0, m + i] = sign
            C.append(row)
            d.append([bound[i] / weight])
    C, d = np.vstack([np.zeros((0, m + n)), *C]), np.concatenate([np.zeros(0), *d])
    norms = np.linalg.norm(C, axis=1)
    norms[norms == 0] = 1.0
    return Raw(P / size, c / size, E, G / weight, C / norms[:, None], d / norms, weight, m)


def contact_jacobian(stance, data, contact):
    model = stance.robot.model
    frame = model.getFrameId(contact.frame)
    on_frame = pin.SE3(np.array(contact.rotation), np.array(contact.offset))
    local = pin.computeFrameJacobian(model, data, stance.q, frame, pin.ReferenceFrame.LOCAL)
    moved = on_frame.toActionMatrixInverse() @ local
    if contact.kind == "point":  # on flat ground, whose axes are the world's
        pin.framesForwardKinematics(model, data, stance.q)
        return (data.oMf[frame].rotation @ on_frame.rotation) @ moved[:3]
    return moved[list(contact.components)]


def contact_inequalities(contact, limits):
    """Rows over (fx, fy, fz, mx, my, mz) and bounds, in newtons and metres."""
    rows, bounds = [], []
    fx, fy, fz, mx, my, mz = np.eye(6)
    if limits.normal_force is not None:
        rows.append(-fz)
        bounds.append(-limits.normal_force)
    mu = contact.friction if limits.friction == "contact" else limits.friction
    if mu is not None:
        if contact.kind == "planar":
            rows += [fy - mu * fz, -fy - mu * fz]
        elif mu == 0:
            rows += [fx, -fx, fy, -fy]
        else:
            # Inside the polygon of the tangential forces mu (cos, sin) that fz = 1 allows.
            angles = 2 * np.pi * np.arange(limits.friction_sides) / limits.friction_sides
            corners = mu * np.column_stack([np.cos(angles), np.sin(angles)])
            rows += inside(corners, fx, fy, fz)
        bounds += [0.0] * (len(rows) - len(bounds))
    if limits.cop_margin is not None and contact.polygon is not None:
        # f_z p = (-my, mx) within f_z times the sole.
        sole = contact.polygon
        if contact.kind == "planar":
            low, high = sole[:, 1].min(), sole[:, 1].max()
            rows += [mx - (high - limits.cop_margin) * fz, (low + limits.cop_margin) * fz - mx]
        else:
            rows += inside(sole, -my, mx, fz, limits.cop_margin)
        bounds += [0.0] * (len(rows) - len(bounds))
    if contact.kind == "surface":
        if limits.torsion == "cone":
            rows += list(wrench_cone(contact.polygon, mu, limits.friction_sides))
        elif limits.torsion is not None:
            own = limits.torsion == "contact"
            coefficient = contact.torsional_friction if own else limits.torsion
            if coefficient is not None:
                rows += [mz - coefficient * fz, -mz - coefficient * fz]
        bounds += [0.0] * (len(rows) - len(bounds))
    return np.array(rows).reshape(-1, 6), np.array(bounds)


def inside(corners, u, v, w, margin=0.0):
    """Rows that hold where (u, v) / w is inside counter-clockwise corners by a margin."""
    rows = []
    for (ax, ay), (bx, by) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        ex, ey = bx - ax, by - ay
        # cross(edge, p - a) >= margin |edge|
        rows.append(-(ex * (v - ay * w) - ey * (u - ax * w)) + margin * np.hypot(ex, ey) * w)
        if len(corners) == 2:  # a line: not before its beginning either
            rows.append(-(ex * (u - ax * w) + ey * (v - ay * w)) / np.hypot(ex, ey) + margin * w)
    return rows


def generators(polygon, mu, sides):
    """Wrenches of unit normal force at a sole's vertices along a pyramid's edges (k, 6)."""
    found = []
    for x, y in polygon:
        for angle in 2 * np.pi * np.arange(sides) / sides:
            force = np.array([mu * np.cos(angle), mu * np.sin(angle), 1.0])
            found.append(np.concatenate([force, np.cross([x, y, 0.0], force)]))
    return np.array(found)


def wrench_cone(polygon, mu, sides):
    """Faces of the cone of the generators: the hull of its section, in its own principal axes."""
    points = generators(polygon, mu, sides)[:, [0, 1, 3, 4, 5]]
    middle = points.mean(axis=0)
    _, size, axes = np.linalg.svd(points - middle, full_matrices=False)
    turns = np.random.default_rng(1).normal(size=(8, 5, 5))
    for turn in (np.eye(5), *(np.linalg.qr(turn)[0] for turn in turns)):
        try:
            hull = ConvexHull((points - middle) @ axes.T / size @ turn.T)
        except QhullError:  # rounding merges facets of so regular a section: look from elsewhere
            continue
        normals = hull.equations[:, :5] @ turn / size @ axes
        offsets = hull.equations[:, 5] - normals @ middle
        return np.insert(normals, 2, offsets, axis=1)
    raise AssertionError("no view of the cone's section could be hulled")


def joint_bounds(stance, torque):
    n = len(stance.robot.torque_names)
    if torque is None:
        return np.full(n, np.inf)
    if isinstance(torque, Mapping):
        return np.array([torque.get(name, np.inf) for name in stance.robot.torque_names])
    return np.full(n, float(torque))


def solve_clarabel(raw):
    """(x, multipliers) of clarabel, or None with its verdict."""
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-12
    settings.max_iter = 200
    A = scipy.sparse.csc_matrix(np.vstack([raw.E, raw.C]))
    cones = [clarabel.ZeroConeT(len(raw.e))]
    if len(raw.d):
        cones.append(clarabel.NonnegativeConeT(len(raw.d)))
    b = np.concatenate([raw.e, raw.d])
    P = scipy.sparse.csc_matrix(np.triu(raw.P))
    found = clarabel.DefaultSolver(P, raw.c, A, b, cones, settings).solve()
    return str(found.status), np.array(found.x), np.array(found.z)[len(raw.e) :]


def solve_piqp(raw):
    solver = piqp.DenseSolver()
    solver.settings.eps_abs = solver.settings.eps_rel = 1e-12
    solver.settings.eps_duality_gap_abs = solver.settings.eps_duality_gap_rel = 1e-12
    solver.settings.max_iter = 500
    free = np.full(len(raw.d), -np.inf)
    solver.setup(raw.P, raw.c, raw.E, raw.e, raw.C, free, raw.d)
    status = solver.solve()
    return str(status), np.array(solver.result.x), np.array(solver.result.z_u)


def polish(raw, x, z):
    """The exact optimum with the rows that an interior-point solution holds; its KKT error.

    Rows may depend on each other, so the multipliers are found by non-negative least squares.
    """
    held = np.flatnonzero(z > raw.d - raw.C @ x)
    B = np.vstack([raw.E, raw.C[held]])
    K = np.block([[raw.P, B.T], [B, np.zeros((len(B), len(B)))]])
    right = np.concatenate([-raw.c, raw.e, raw.d[held]])
    y = np.linalg.lstsq(K, right, rcond=1e-13)[0]
    y += np.linalg.lstsq(K, right - K @ y, rcond=1e-13)[0]
    x = y[: len(raw.c)]
    return x, kkt_error(raw, x, held)


def kkt_error(raw, x, held):
    """Largest violation of the optimality conditions of x, its held rows pressing at best."""
    gradient = raw.P @ x + raw.c
    size = max(np.abs(gradient).max(), 1e-9)
    # E' nu + C_a' l = -gradient, nu free (both signs), l >= 0.
    columns = np.hstack([raw.E.T, -raw.E.T, raw.C[held].T])
    rest = scipy.optimize.nnls(columns, -gradient / size, maxiter=10000)[1]
    return max(
        rest,
        np.abs(raw.E @ x - raw.e).max(),
        np.max(raw.C @ x - raw.d, initial=0.0),
        np.max(np.abs(raw.C[held] @ x - raw.d[held]), initial=0.0),
    )
