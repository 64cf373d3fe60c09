"""DrivenTorques: a momentum rate shared among contacts, loops and motors that are not everywhere.

Where joints have no motor, or are tied together, accelerations are decided first and forces after
them. With forces x of contacts, loops and couplings, C their rows, and N = M dv + h less what loads
and springs do, the accelerations are those of least 1/2 dv' M dv - p' dv (Gauss' principle; p the
posture's motor torques on the joints) among those that

    close everything      C dv + drift = 0
    motors cannot change  u' N = 0, u the motions that motors, contacts and loops leave free
    have the momentum     M_b dv + h_b = the wanted wrench on the base, as far as the others allow
                          without violent motions

so that a joint without a motor follows. Then the load is shared as at rest (`LoadProblem.of`), with
N in the place of gravity: rows of base and of joints without motors are equations, the motors'
torques are what is left. With a motor on every joint this is [Romano2016] Eq. (19), (20).

With M = L L' and z = L' dv the momentum's rows are the first six of z, and the cost is its length.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.linalg import lapack

from copsense.controllers.driven_dynamics import DrivenDynamics
from copsense.controllers.sharing import ShareLoad
from copsense.load_problem import LoadProblem
from copsense.stance import Stance
from copsense.unheld import vanishing

_RANK = 1e-5  # pivots, relative, under which a constraint says what others say
_CALM = 20.0  # 1/s: how fast motions that no motor holds are to come to rest
# Singular values under which a change of the momentum is not forced: the share of it that is the
# base's, where admissible accelerations cause it; of robots that stand well, from 0.4 to 1.
_REACH = 0.1


class DrivenTorques:
    """Torques of the motors, and forces of contacts and loops, for a wanted momentum rate."""

    def __init__(self, stance: Stance, dynamics: DrivenDynamics) -> None:
        """Count the motions that no motor holds."""
        self._robot, self._dynamics = stance.robot, dynamics
        self._nb = stance.robot.unactuated_nv
        self._free = stance.unheld_motions.shape[1]

    def inertia(self) -> Float[np.ndarray, " k"]:
        """What each motor alone accelerates, base free and loops closed (k,); 0 if held fast."""
        dyn, robot = self._dynamics, self._robot
        inverse = np.linalg.inv(dyn.M)
        rows = dyn.C[len(dyn.J) :]
        held = rows @ inverse
        inverse -= held.T @ np.linalg.pinv(held @ rows.T, hermitian=True) @ held
        moved = [robot.joint_torques(each) for each in np.eye(len(robot.torque_names))]
        joints = np.array(moved).reshape(-1, robot.model.nv - 6)
        mobility = np.einsum("ij,ij->i", joints, joints @ inverse[6:, 6:])
        least = _RANK**2 * mobility.max(initial=0.0)
        return np.divide(1.0, mobility, out=np.zeros_like(mobility), where=mobility > least)

    def speeds(self, velocity: Float[np.ndarray, " nv"]) -> Float[np.ndarray, " k"]:
        """What of a velocity the motors see (k,)."""
        joints, actuation = velocity[6:], self._robot.actuation
        return joints if actuation is None else np.asarray(actuation.matrix.T.dot(joints))

    def compute(
        self,
        share: ShareLoad,
        base_wrench: Float[np.ndarray, " 6"],
        posture: Float[np.ndarray, " k"],
        beyond: Float[np.ndarray, " nv"],
        ahead: Float[np.ndarray, " nv"],
    ) -> tuple[np.ndarray, np.ndarray]:
        """Motor torques (k,) and stacked forces x (c,).

        Args:
            share: which of the forces to take.
            base_wrench: the wanted wrench of everything but gravity on the base, base axes.
            posture: torques of the motors that keep the posture.
            beyond: velocity beyond the reference's (nv,), of which motions that no motor holds are
                damped.
            ahead: the reference's acceleration (nv,), or zeros.
        """
        dyn, robot, nb = self._dynamics, self._robot, self._nb
        M, C, known = dyn.M, dyn.C, dyn.h + dyn.load
        L = lapack.dpotrf(M, lower=1)[0]
        down = robot.by_drive(C.T)  # forces on the base, on free joints, on motors
        nv, c = C.shape[1], len(C)
        right = np.zeros((nv, c + self._free + 2), order="F")
        right[:, :c] = C.T
        demand = -dyn.drift
        if self._free:
            u = robot.from_drives(vanishing(down[:nb], self._free, nv))
            Mu = right[:, c : c + self._free] = M.dot(u)
            demand = np.concatenate([demand, -u.T.dot(known)])
            right[:, -1] = -_CALM * u.dot(u.T.dot(Mu).dot(u.T.dot(beyond)))
        right[:6, -2] = base_wrench - dyn.h[:6]
        right[6:, -1] += robot.joint_torques(posture)
        right[:, -1] += M.dot(ahead)
        solved = lapack.dtrtrs(L, right, lower=1, overwrite_b=1)[0]
        least, Z = _equations(solved[:, :-2], demand)
        # What is left of the momentum's rows, z_b = the wanted ones, then the posture.
        left, s, across = np.linalg.svd(Z[:6])
        across, rest = across[: len(s)], across[len(s) :]
        # 1/s, but where a change of momentum would take violent motions it fades out.
        gain = np.where(s > _REACH, 1.0 / np.maximum(s, _REACH), s / _REACH**2)
        wanted = left[:, : len(s)].T.dot(solved[:6, -2] - least[:6])
        pull = Z.T.dot(solved[:, -1])
        y = across.T.dot(gain * wanted + (1.0 - s * gain) * across.dot(pull))
        y += rest.T.dot(rest.dot(pull))
        N = robot.by_drive(L.dot(least + Z.dot(y)) + known)
        # How N follows the wrench on the base, in the directions in which that can be chosen.
        seen = int(np.sum(s > _REACH))
        wish = left[:, :seen].T.dot(lapack.dtrtrs(L[:6, :6], np.eye(6), lower=1)[0])
        follow = robot.by_drive(L.dot(Z.dot((across[:seen].T / s[:seen]).dot(wish))))
        inertia = M[6:, 6:]
        if robot.actuation is not None:
            inertia = robot.actuation.inverse @ inertia @ robot.actuation.inverse.T
        problem = LoadProblem(down[:nb], N[:nb], down[nb:], N[nb:], inertia, follow)
        forces = share(problem)
        missed = problem.base_map[:6].dot(forces) - problem.base_wrench[:6]
        return problem.torques(forces) + follow[nb:].dot(missed), forces


def _equations(
    columns: Float[np.ndarray, "nv c"], right: Float[np.ndarray, " c"]
) -> tuple[Float[np.ndarray, " nv"], Float[np.ndarray, "nv z"]]:
    """The smallest z with columns' z = right, and an orthonormal basis of those without effect."""
    nv, c = columns.shape
    factor, order, tau, _, _ = lapack.dgeqp3(columns)
    pivots = np.abs(factor.diagonal())
    r = int(np.sum(pivots > _RANK * pivots[0]))
    reflectors = np.zeros((nv, nv), order="F")
    k = min(nv, c)
    reflectors[:, :k] = factor[:, :k]
    Q = lapack.dorgqr(reflectors, tau, overwrite_a=1)[0]
    y = lapack.dtrtrs(np.asfortranarray(factor[:r, :r]), right[order[:r] - 1], trans=1)[0]
    return Q[:, :r].dot(y), Q[:, r:]
