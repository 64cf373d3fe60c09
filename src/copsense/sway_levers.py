"""Sway levers: how much more, or less, a sway moves than the same path at rest.

A sway of angular frequency w along a path multiplies the slope of each output X (a load share, a
centre of pressure) by ``1 + w^2 h_X / g`` with the output's lever

    h_X = -g X_a / X'

X_a by the second derivative of the path's coordinate, X' by the coordinate at rest. Of the net
centre of pressure it is ``h - L_x / m`` on level ground: h the height of the centre of mass and L_x
the angular momentum about it per unit of its velocity along y.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from copsense.arrays import finite_array
from copsense.cop import contact_cops
from copsense.errors import InvalidInputError, UndeterminedWrenchError
from copsense.rigid_body import momentum_map
from copsense.sensitivity import cop_rates
from copsense.stance import Stance, check_at_rest
from copsense.statics import PROJECT, StaticEquilibrium, is_admissible

STATIC_SHARE = 0.05  # of an output's motion: up to here statics are called good enough
_STILL = 1e-9  # slope of a share per metre, or of a CoP, under which nothing moves
NET = "net CoP"


@dataclass(frozen=True)
class SwayLever:
    """What a sway does to one output of the statics.

    Attributes:
        output: ``"net CoP"``, ``"load of l_sole"`` or ``"CoP of l_sole"``.
        lever: h_X [m]; NaN where the output stands still along the path, at rest, and where a joint
            hangs that a sway would leave behind.
        frequency: up to which the statics of this output are within 5 % in a sway [Hz]; NaN
            likewise, infinite where a sway changes nothing.
    """

    output: str
    lever: float
    frequency: float

    def factor(self, period: float) -> float:
        """By how much a sway of a period [s] multiplies the slope at rest; NaN likewise."""
        more = STATIC_SHARE / (period * self.frequency) ** 2
        return 1.0 + math.copysign(more, self.lever)


def lever_outputs(contacts: Sequence[str]) -> tuple[str, ...]:
    """Names of the outputs of `sway_levers`, in its order."""
    return (NET, *(f"{what} of {name}" for name in contacts for what in ("load", "CoP")))


def sway_levers(
    equilibrium: StaticEquilibrium, tangent: Float[np.ndarray, " nv"]
) -> tuple[SwayLever, ...]:
    """The levers of the net CoP, and of each contact's load and CoP, at a posture of a path.

    Of centres of pressure the part along the way on which the CoM goes.

    Args:
        equilibrium: at rest, by a `Criterion`; within limits those that press are held.
        tangent: dq/dcoordinate of the path (nv,).

    Raises:
        InvalidInputError: a stance in motion, a policy, or a tangent that moves a contact.
        UnloadedContactError: a contact carries no normal force.
    """
    stance = equilibrium.stance
    check_at_rest(stance, "the lever of a sway")
    t = finite_array(tangent, "the tangent", (stance.robot.model.nv,), "a velocity")
    if not is_admissible(stance, t):
        raise InvalidInputError(f"the tangent moves a contact. {PROJECT}")
    weight, g = stance.robot.weight, stance.robot.weight / stance.robot.mass
    inertia = stance.mass_matrix @ t
    columns = np.column_stack([t, np.zeros_like(t)])
    loads = np.column_stack([np.zeros_like(t), inertia])
    try:
        rates = equilibrium.derivative(columns, loads)[0]
    except UndeterminedWrenchError:
        # A joint without a motor that hangs is left behind: nothing gives it the path's motion.
        at_rest = equilibrium.derivative(t[:, None])[0]
        rates = np.hstack([at_rest, np.full_like(at_rest, np.nan)])
    change = stance.unstack(rates)  # (nc, 6, 2)
    cops = cop_rates(equilibrium, contact_cops(equilibrium), change)
    along, _, speed = net_lever(stance, t)
    way = np.append(stance.com_jacobian[:2] @ t / speed, 0.0) if speed else np.zeros(3)
    levers = [along if speed else math.nan]
    for load, cop, place in zip(change[:, 2] / weight, cops, stance.placements, strict=True):
        levers += [_ratio(load, g), _ratio((place.rotation.T @ way)[:2] @ cop, g)]
    return tuple(
        SwayLever(output, lever, static_frequency(lever, g))
        for output, lever in zip(lever_outputs(stance.contact_names), levers, strict=True)
    )


def net_lever(stance: Stance, tangent: Float[np.ndarray, " nv"]) -> tuple[float, float, float]:
    """h - L / m of a path, L the angular momentum that moves the net CoP.

    Args:
        stance: a posture.
        tangent: dq/dcoordinate of a path there (nv,).

    Returns:
        The lever along the horizontal direction in which the CoM moves, and across it [m]; and the
        CoM's horizontal speed per unit of the coordinate. All zero where the CoM stands still.
    """
    ground = float(np.mean([place.translation[2] for place in stance.placements]))
    height, mass = float(stance.com[2]) - ground, stance.robot.mass
    _, _, _, ax, ay, _ = (momentum_map(stance.robot, stance.q) @ tangent).tolist()
    vx, vy, _ = (stance.com_jacobian @ tangent).tolist()
    speed = math.hypot(vx, vy)
    if speed <= _STILL * max(1.0, float(np.abs(tangent).max(initial=0.0))):
        return 0.0, 0.0, 0.0
    x, y = height * vx + ay / mass, height * vy - ax / mass
    return (x * vx + y * vy) / speed**2, (y * vx - x * vy) / speed**2, speed


def static_frequency(lever: float, gravity: float) -> float:
    """Up to which frequency a lever [m] lets statics be within 5 % in a sway [Hz]."""
    if lever == 0:
        return math.inf
    return math.sqrt(STATIC_SHARE * gravity / abs(lever)) / (2 * math.pi)


def _ratio(slopes: Float[np.ndarray, " 2"], gravity: float) -> float:
    """-g X_a / X' of an output; NaN where it stands still at rest."""
    at_rest, inertial = slopes.tolist()
    return math.nan if abs(at_rest) <= _STILL else -gravity * inertial / at_rest
