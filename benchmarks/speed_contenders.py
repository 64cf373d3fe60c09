"""What a user of Pinocchio does per posture, for `speed.py`: finite differences, and analytically.

Plain Pinocchio and NumPy, each written as cheaply as we know. Each is a function of a configuration
that returns, for minimum wrench (L = 1 m) and minimum torque: wrenches (2, 12), torques (2, n),
CoPs (2, 4), their sensitivities along the columns of Z (2, 4, p), and Z (nv, p). `analytic` adds
the loads' sensitivities (2, 2, p).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pinocchio as pin

STEP = 1e-4  # rad and m: central differences err least near here


class Statics:
    """A model with two flat feet, whose frames are the contact frames."""

    def __init__(self, model: pin.Model, frames: list[str]) -> None:
        """Look the frames up, and keep the memory."""
        self.model, self.data = model, model.createData()
        self.frames = [model.getFrameId(frame) for frame in frames]
        self.K = np.zeros((18, 18))
        self.right = np.zeros(18)

    def terms(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Generalised gravity (nv,) and contact Jacobian (12, nv), contact axes."""
        model, data = self.model, self.data
        pin.computeJointJacobians(model, data, q)
        J = np.vstack([pin.getFrameJacobian(model, data, f, pin.LOCAL) for f in self.frames])
        return pin.computeGeneralizedGravity(model, data, q), J

    def wrenches(self, G: np.ndarray, J: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Wrenches (2, 12) of both criteria, and the multipliers of their statics (2, 6).

        Minimum wrench: f = J_b y, (J_b' J_b) y = G_b. Minimum torque, where nu is (y, tau):
        [-J_j J_j', J_b; J_b', 0] [f; y] = [-J_j G_j; G_b].
        """
        Jb, Jj, K, right = J[:, :6], J[:, 6:], self.K, self.right
        y = np.linalg.solve(Jb.T @ Jb, G[:6])
        K[:12, :12], K[:12, 12:], K[12:, :12] = -(Jj @ Jj.T), Jb, Jb.T
        right[:12], right[12:] = -(Jj @ G[6:]), G[:6]
        x = np.linalg.solve(K, right)
        return np.array([Jb @ y, x[:12]]), G[6:], np.array([y, x[12:]])


def cops(f: np.ndarray) -> np.ndarray:
    """CoPs (2, 4) of wrenches (2, 12): (-m_y, m_x) / f_z of each foot."""
    w = f.reshape(2, 2, 6)
    return np.stack([-w[..., 4] / w[..., 2], w[..., 3] / w[..., 2]], axis=-1).reshape(2, 4)


def tangents(J: np.ndarray) -> np.ndarray:
    """Orthonormal basis of the motions that leave the contacts in place (nv, p)."""
    return np.linalg.qr(J.T, mode="complete")[0][:, len(J) :]


def finite_differences(
    model: pin.Model, frames: list[str], *, retract: bool
) -> Callable[[np.ndarray], tuple[np.ndarray, ...]]:
    """Central differences along Z: two statics for each direction.

    With `retract`, each displaced posture is put back on the contacts by one Newton step
    dq = -J^+ e, e the feet's errors. Without it the feet leave by a second order in the step, the
    same either way, which central differences cancel.
    """
    at = Statics(model, frames)

    def evaluate(q: np.ndarray) -> tuple[np.ndarray, ...]:
        G, J = at.terms(q)
        f, Gj, _ = at.wrenches(G, J)
        Z = tangents(J)
        p, torques = cops(f), Gj - f @ J[:, 6:]
        if retract:
            pin.updateFramePlacements(model, at.data)
            home = [at.data.oMf[frame].copy() for frame in at.frames]
        eta = np.empty((2, 4, Z.shape[1]))
        for i, z in enumerate(Z.T):
            sides = []
            for step in (STEP, -STEP):
                moved = pin.integrate(model, q, step * z)
                if retract:
                    _, Jm = at.terms(moved)
                    pin.updateFramePlacements(model, at.data)
                    error = np.concatenate(
                        [
                            pin.log6(at.data.oMf[frame].actInv(place)).vector
                            for frame, place in zip(at.frames, home, strict=True)
                        ]
                    )
                    moved = pin.integrate(model, moved, Jm.T @ np.linalg.solve(Jm @ Jm.T, error))
                sides.append(cops(at.wrenches(*at.terms(moved))[0]))
            eta[:, :, i] = (sides[0] - sides[1]) / (2 * STEP)
        return f, torques, p, eta, Z

    return evaluate


def analytic(model: pin.Model, frames: list[str]) -> Callable[[np.ndarray], tuple[np.ndarray, ...]]:
    """Pinocchio's derivatives, and one adjoint solve for a criterion's four CoPs and two loads.

    With A = d(G - J' f)/dq at fixed f and D = d(J nu)/dq at fixed nu, nu = (y, tau):

        minimum wrench: J_b' df = A_b dq, df = J_b dy + D dq
        minimum torque: J_b' df = A_b dq, J_b dy - J_j J_j' df = -(D + J_j A_j) dq
    """
    at = Statics(model, frames)
    data = at.data
    places = [(model.frames[f].parentJoint, model.frames[f].placement) for f in at.frames]
    still = np.zeros(model.nv)
    zero = pin.StdVec_Force()
    zero.extend([pin.Force.Zero() for _ in range(model.njoints)])

    def derivatives(q: np.ndarray, f: np.ndarray, nu: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        for (joint, place), start in zip(places, (0, 6), strict=True):
            force = place.act(pin.Force(f[start : start + 6]))
            zero[joint] = force
        A = pin.computeStaticTorqueDerivatives(model, data, q, zero)
        pin.computeForwardKinematicsDerivatives(model, data, q, nu, still)
        D = np.vstack(
            [
                pin.getFrameVelocityDerivatives(model, data, frame, pin.LOCAL)[0]
                for frame in at.frames
            ]
        )
        return A, D

    def evaluate(q: np.ndarray) -> tuple[np.ndarray, ...]:
        G, J = at.terms(q)
        f, Gj, y = at.wrenches(G, J)
        Jb, Jj = J[:, :6], J[:, 6:]
        p, torques = cops(f), Gj - f @ Jj
        Z = tangents(J)
        eta, loads = np.empty((2, 4, Z.shape[1])), np.empty((2, 2, Z.shape[1]))
        for c in range(2):
            nu = np.concatenate([y[c], torques[c] if c else still[6:]])
            A, D = derivatives(q, f[c], nu)
            # dp = (-dm_y - p_x df_z, dm_x - p_y df_z) / f_z
            C = np.zeros((12, 6))
            for k in (0, 1):
                C[6 * k + 2, 4 + k] = 1.0  # the loads
                share = 1.0 / f[c, 6 * k + 2]
                C[6 * k + 4, 2 * k], C[6 * k + 3, 2 * k + 1] = -share, share
                C[6 * k + 2, 2 * k : 2 * k + 2] = -share * p[c, 2 * k : 2 * k + 2]
            if c:
                right = np.zeros((18, 6))
                right[:12] = C
                u = np.linalg.solve(at.K, right)  # symmetric: its own adjoint
                g = u[12:].T @ A[:6] - u[:12].T @ (D + Jj @ A[6:])
            else:
                # df = D dq + J_b (J_b' J_b)^-1 (A_b - J_b' D) dq
                u = np.linalg.solve(Jb.T @ Jb, Jb.T @ C)
                g = u.T @ A[:6] + (C - Jb @ u).T @ D
            both = g @ Z
            eta[c], loads[c] = both[:4], both[4:]
        return f, torques, p, eta, Z, loads

    return evaluate


def analytic_with_gains(
    model: pin.Model, frames: list[str], soles: list[tuple[np.ndarray, np.ndarray]]
) -> Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """The same with CoM gains (2, 2, 2, 2) and travels (2, 2), for the reference path.

    The motion of least kinetic energy per unit of CoM velocity, then the slack of every edge, with
    outward normals a and offsets b of each sole: s = w (b - a p), ds = (b - a p) dw - w a dp. The
    load's rate takes another adjoint, so that the wrenches' derivatives along Z are solved for.
    """
    evaluate, data = analytic(model, frames), model.createData()
    weight = pin.computeTotalMass(model) * np.linalg.norm(model.gravity.linear)

    def extended(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        f, _, p, eta, Z, loads = evaluate(q)
        M = pin.crba(model, data, q, pin.Convention.WORLD)
        Jc = pin.jacobianCenterOfMass(model, data, q)[:2] @ Z
        S = np.linalg.solve(Z.T @ M @ Z, Jc.T)
        motion = S @ np.linalg.inv(Jc @ S)
        gains = (eta @ motion).reshape(2, 2, 2, 2)
        shares, rates = f.reshape(2, 2, 6)[:, :, 2] / weight, loads @ motion / weight
        travel = np.empty((2, 2))
        for c in range(2):
            for k, (a, b) in enumerate(soles):
                margin = b - a @ p[c, 2 * k : 2 * k + 2]
                rate = margin[:, None] * rates[c, k] - shares[c, k] * (a @ gains[c, k])
                travel[c, k] = (shares[c, k] * margin / np.hypot(rate[:, 0], rate[:, 1])).min()
        return gains, travel

    return extended


def gradient(answer: tuple[np.ndarray, ...]) -> dict[str, Any]:
    """An answer in the kernel's shapes, the sensitivities as projected gradients."""
    f, torques, p, eta, Z = answer[:5]
    return {
        "wrenches": f.reshape(2, 2, 6),
        "torques": torques,
        "cops": p.reshape(2, 2, 2),
        "gradient": (eta @ Z.T).reshape(2, 2, 2, -1),
    }
