"""StaticPrediction: where the centres of pressure should be, and how far the robot may lean.

The static analysis along the very path that a closed loop follows. It uses the criterion that the
controller applies, so a comparison holds the theory against physics, not against another law.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from copsense.contact import Contact
from copsense.controllers.target import PathReference, Ramp, Signal, lateral_reference
from copsense.cop import contact_cops
from copsense.criterion import Criterion
from copsense.limits import Limits
from copsense.simulation.physics_settings import PhysicsSettings
from copsense.simulation.recording import Recording
from copsense.stance import Stance
from copsense.statics import solve_equilibrium


@dataclass(frozen=True, eq=False)
class StaticPrediction:
    """Static centres of pressure along a path.

    Attributes:
        values: the path's coordinate, relative to the start (N,) [m].
        cops: centre of pressure of each contact (N, nc, 2), contact axes [m]; NaN where unloaded.
        joints: position of each joint (N, n) [rad, m].
        excursion: how far from the start the path's coordinate may go until a contact's CoP reaches
            an edge, its load is gone, or its force leaves the friction cone [m]; infinite where
            none does on this path.
        contact: the contact that does so first, or nothing.
        how: ``"tips"``, ``"lifts"`` or ``"slips"``, or nothing.
        first_order: the same from wrenches and slopes at the start alone [m].
    """

    values: Float[np.ndarray, " N"]
    cops: Float[np.ndarray, "N nc 2"]
    joints: Float[np.ndarray, "N n"]
    excursion: float
    contact: str
    how: str
    first_order: float

    def attach(self, recording: Recording) -> Recording:
        """A recording with this prediction beside it, over a dimension of its own."""
        what = {"units": "m", "long_name": "static centre of pressure along the path, contact axes"}
        dataset = recording.to_xarray().assign(
            static_cop=(("static", "contact", "axis"), self.cops, what),
            static_joint=(
                ("static", "joint"),
                self.joints,
                {"units": "rad, m", "long_name": "joint position along the path"},
            ),
            static_travel=(
                "static",
                self.values,
                {"units": "m", "long_name": "where on the path, from its start"},
            ),
        )
        return Recording(dataset).with_attributes(
            static_excursion=self.excursion,
            static_contact=self.contact,
            static_how=self.how,
            static_first_order=self.first_order,
        )


def predict(
    reference: PathReference,
    criterion: Criterion,
    limits: Limits | None = None,
    friction: float = PhysicsSettings.friction,
) -> StaticPrediction:
    """The static prediction along a reference's path, from its start at zero outwards.

    The excursion is linear between the path's postures, which a lateral reference has every 2 mm.

    Args:
        reference: the path, and to which side it goes first.
        criterion: how the load is shared.
        limits: within which, if any.
        friction: coefficient of contacts that give none.
    """
    path, nc = reference.path, len(reference.path.stances[0].contacts)
    cops, forces = np.full((len(path), nc, 2), np.nan), np.full((len(path), nc, 3), np.nan)
    for i, here in enumerate(path.stances):
        if i not in path.failures:
            equilibrium = solve_equilibrium(here, criterion, limits)
            forces[i] = equilibrium.wrenches[:, :3] / here.robot.weight
            if not equilibrium.unloaded:
                cops[i] = contact_cops(equilibrium)
    values = np.asarray(path.values, dtype=float)
    margins = [
        # Crossings of zero alone are looked for, so shares of the weight stand beside distances.
        np.column_stack(
            [_edge_distances(path.stances[0], cops[:, k], k), force_gaps(contact, f, friction)]
        )
        for k, (contact, f) in enumerate(
            zip(path.stances[0].contacts, forces.swapaxes(0, 1), strict=True)
        )
    ]
    side = farther_side(reference.signal)
    middle = int(np.argmin(np.abs(values)))
    order = np.arange(middle, len(values)) if side > 0 else np.arange(middle, -1, -1)
    travel = side * values[order]  # the path's postures need not include the very start
    excursion, contact, how, first_order = np.inf, "", "", np.inf
    for k, distances in enumerate(margins):
        ways = ["tips"] * (distances.shape[1] - 2) + ["lifts", "slips"]
        for way, edge in zip(ways, distances[order].T, strict=True):
            if len(travel) > 1 and edge[1] < edge[0] - 1e-12:
                part = edge[0] / (edge[0] - edge[1])
                first_order = min(first_order, travel[0] + part * (travel[1] - travel[0]))
            beyond = np.flatnonzero(edge <= 0)
            if len(beyond):
                i = int(beyond[0])
                at = 0.0
                if i:
                    part = edge[i - 1] / (edge[i - 1] - edge[i])
                    at = float(travel[i - 1] + part * (travel[i] - travel[i - 1]))
                if at < excursion:
                    excursion, contact, how = at, path.stances[0].contact_names[k], way
    robot = path.stances[0].robot
    joints = np.array(
        [[robot.joint_position(s.q, joint) for joint in robot.joint_names] for s in path.stances]
    )
    return StaticPrediction(values, cops, joints, excursion, contact, how, float(first_order))


def predict_lean(
    stance: Stance, criterion: Criterion, reach: float, limits: Limits | None = None
) -> StaticPrediction:
    """The static prediction of a lateral lean up to `reach` [m]; its sign says to which side."""
    return predict(lateral_reference(stance, Ramp(reach)), criterion, limits)


def farther_side(signal: Signal) -> float:
    """To which side a signal goes farther, 1 or -1; as a sine goes as far to both, first."""
    low, high = signal.extent
    if high == -low:
        return -1.0 if signal.at(0.0)[1] < 0 else 1.0
    return 1.0 if high > -low else -1.0


def force_gaps(
    contact: Contact, forces: Float[np.ndarray, "N 3"], friction: float
) -> Float[np.ndarray, "N 2"]:
    """Normal force, and what the friction cone has left; a contact keeps its place above zero.

    Args:
        contact: gives the coefficient, if it has one.
        forces: in contact axes, in any unit.
        friction: the coefficient otherwise.
    """
    mu = friction if contact.friction is None else contact.friction
    tangential = np.hypot(forces[:, 0], forces[:, 1])
    return np.column_stack([forces[:, 2], mu * forces[:, 2] - tangential])


def _edge_distances(stance: Stance, cops: np.ndarray, k: int) -> np.ndarray:
    """Distance of CoPs (N, 2) to each edge of a contact's sole (N, e); none for a point."""
    sole = stance.contacts[k].sole
    return sole.distances(cops) if sole else np.full((len(cops), 1), np.inf)
