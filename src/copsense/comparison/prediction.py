"""What the statics say of a trial: along the exact path, and to first order from its start.

Both use the law that the controller applies, so a comparison holds theory against physics.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from copsense.controllers import STIFF, Gains, PathReference
from copsense.cop import contact_cops
from copsense.criterion import Criterion
from copsense.limits import Limits
from copsense.sensitivity import cop_sensitivity
from copsense.simulation import PhysicsSettings
from copsense.simulation.prediction import farther_side, force_gaps, predict
from copsense.stance import Stance
from copsense.statics import solve_equilibrium

_AFTER = 1.0  # s: the law has answered a push by then


@dataclass(frozen=True, eq=False)
class Statics:
    """Static margins and torques along a lateral path, and their tangents at its start.

    Attributes:
        values: the path's coordinate, CoM y from the start (N,) [m].
        margins: smallest distance of a CoP to its sole's edge (N,) [m]; infinite without soles.
        torques: static joint torques (N, n) [Nm].
        excursion: distance along the path to the first tip, lift or slip, to the signal's side [m];
            infinite where nothing does.
        contact: which contact does so first, or nothing.
        first_order: the same by CoPs, forces and sensitivity at the start alone [m].
        edges: distance of every CoP to every edge at the start (e,) [m].
        edge_slopes: their derivative along the path at the start (e,).
        torque_start: torques at the start (n,) [Nm].
        torque_slope: their derivative along the path at the start (n,) [Nm/m].
    """

    values: Float[np.ndarray, " N"]
    margins: Float[np.ndarray, " N"]
    torques: Float[np.ndarray, "N n"]
    excursion: float
    contact: str
    first_order: float
    edges: Float[np.ndarray, " e"]
    edge_slopes: Float[np.ndarray, " e"]
    torque_start: Float[np.ndarray, " n"]
    torque_slope: Float[np.ndarray, " n"]

    def smallest_margin(self, low: float, high: float) -> tuple[float, float]:
        """Smallest margin for CoM y between two values [m]: on the path, and to first order."""
        y = np.linspace(low, high, 401)
        path = float(np.interp(y, self.values, self.margins).min())
        if not len(self.edges):
            return path, np.inf
        ends = [self.edges + self.edge_slopes * end for end in (low, high)]
        return path, float(np.min(ends))

    def torque_norm(self, y: Float[np.ndarray, " k"]) -> tuple[float, float]:
        """Mean norm of the torques over values of CoM y [Nm]: on the path, and to first order."""
        norms = np.linalg.norm(self.torques, axis=1)
        first = np.linalg.norm(self.torque_start + np.outer(y, self.torque_slope), axis=1)
        return float(np.interp(y, self.values, norms).mean()), float(first.mean())

    def torque_peak(
        self, y: Float[np.ndarray, " k"], joints: list[int] | None = None
    ) -> tuple[float, float]:
        """Largest torque over values of CoM y [Nm]: on the path, and to first order.

        Args:
            y: values of CoM y [m].
            joints: which joints to look at; default all.
        """
        at = list(range(self.torques.shape[1])) if joints is None else joints
        peaks = np.abs(self.torques[:, at]).max(axis=1)
        first = self.torque_start[at] + np.outer(y, self.torque_slope[at])
        return float(np.interp(y, self.values, peaks).max()), float(np.abs(first).max())


def statics(
    reference: PathReference,
    criterion: Criterion,
    limits: Limits | None = None,
    friction: float = PhysicsSettings.friction,
) -> Statics:
    """The statics along a reference's path, its start at zero; see `predict`.

    Raises:
        CopsenseError: no equilibrium somewhere on the path, such as beyond the limits.
    """
    path, prediction = reference.path, predict(reference, criterion, limits, friction)
    values = np.asarray(path.values, dtype=float)
    low, high = reference.signal.extent
    wanted = (values > low - 3e-3) & (values < high + 3e-3)  # the path's spacing, and some
    use = [i for i in range(len(values)) if wanted[i] and i not in path.failures]
    margins, torques = np.full(len(use), np.inf), []
    for row, i in enumerate(use):
        equilibrium = solve_equilibrium(path.stances[i], criterion, limits)
        torques.append(equilibrium.torques)
        if equilibrium.unloaded:
            continue
        cops = contact_cops(equilibrium)
        for contact, cop in zip(path.stances[i].contacts, cops, strict=True):
            if contact.sole:
                margins[row] = min(margins[row], float(contact.sole.margins(cop)))
    start = int(np.argmin(np.abs(values)))
    here = cop_sensitivity(path.stances[start], criterion, limits)
    tangent = path.tangents[start]
    slopes = here.gradient @ tangent
    edges, rates = [np.zeros(0)], [np.zeros(0)]
    for k, contact in enumerate(path.stances[start].contacts):
        if contact.sole:
            edges.append(contact.sole.distances(here.cop[k]))
            rates.append(-contact.sole.normals @ slopes[k])
    # The path's posture nearest to the start is a little off it.
    off = float(values[start])
    rate = np.concatenate(rates)
    distance = np.concatenate(edges) - off * rate
    torque_slope = here.torque_derivative @ (here.basis.T @ tangent)
    # A contact may lift or slip instead: all that a point can do.
    weight = path.stances[start].robot.weight
    force_rates = (here.wrench_derivative @ (here.basis.T @ tangent))[:, :3] / weight
    forces = here.equilibrium.wrenches[:, :3] / weight - off * force_rates
    gaps, gap_rates = [], []
    for contact, force, force_rate in zip(
        path.stances[start].contacts, forces, force_rates, strict=True
    ):
        gaps.append(force_gaps(contact, force[None], friction)[0])
        size = float(np.hypot(*force[:2]))
        sideways = force[:2] @ force_rate[:2] / size if size else float(np.hypot(*force_rate[:2]))
        straight = np.array([0.0, 0.0, force_rate[2]])
        gap_rates.append(force_gaps(contact, straight[None], friction)[0] - [0.0, sideways])
    left = np.concatenate([distance, *gaps])
    outwards = np.concatenate([rate, *gap_rates]) * farther_side(reference.signal)
    closing = outwards < -1e-12
    travel = (left[closing] / -outwards[closing]).min() if closing.any() else np.inf
    return Statics(
        values[use],
        margins,
        np.array(torques),
        prediction.excursion,
        prediction.contact,
        float(travel),
        distance,
        rate,
        here.equilibrium.torques - off * torque_slope,
        torque_slope,
    )


def predict_impulse(
    stance: Stance, excursion: float, duration: float, gains: Gains = STIFF
) -> float:
    """The least lateral push that tips a contact, by the static excursion and no fitted number.

    The CoM is a mass m under the controller's law, a = -kp y - kd v + F/m, and acts on the soles
    as if it stood at rest at y + (h/g)(kp y + kd v): there is where the static analysis is asked.

    Args:
        stance: gives mass and height of the CoM.
        excursion: the static excursion d to the first tip [m].
        duration: of the push [s].
        gains: their lateral kp and kd.

    Returns:
        The impulse F * duration [N s].
    """
    kp, kd = gains.com_stiffness[1], gains.com_damping[1]
    ground = float(np.mean([place.translation[2] for place in stance.placements]))
    g = stance.robot.weight / stance.robot.mass
    lever = (float(stance.com[2]) - ground) / g
    dt = 1e-4
    y = v = most = 0.0
    for i in range(round((duration + _AFTER) / dt)):
        # Of a unit impulse.
        push = 1.0 / (stance.robot.mass * duration) if i * dt < duration else 0.0
        v += dt * (push - kp * y - kd * v)
        y += dt * v
        most = max(most, y + lever * (kp * y + kd * v))
    return excursion / most
