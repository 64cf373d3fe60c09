"""Centre of pressure, zero-moment point and foot rotation indicator."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import ArrayLike

from copsense.arrays import finite_array, read_only
from copsense.contact import Plane
from copsense.errors import InvalidInputError, UnknownNameError, UnloadedContactError
from copsense.polygon import EdgeMargin, Polygon
from copsense.rigid_body import link_momentum_rate, momentum_rate
from copsense.stance import Stance
from copsense.statics import StaticEquilibrium

LEAST_LOAD = 1e-3  # share of the weight: measured under less, a contact has no centre of pressure
_SIGNS = read_only(np.array([-1.0, 1.0]))  # of (m_y, m_x)
_LEVEL = 1e-6  # m, or 1 - cosine: how far contacts may be from one horizontal plane


def contact_cops(equilibrium: StaticEquilibrium) -> Float[np.ndarray, "nc 2"]:
    """Centre of pressure of each contact in its own frame [m] ([Romano2016] Eq. (10)).

    p = (-m_y, m_x) / f_z. A point contact's is its origin.

    Raises:
        UnloadedContactError: a contact carries no normal force.
    """
    if equilibrium.unloaded:
        raise UnloadedContactError(equilibrium.unloaded)
    return wrench_cops(equilibrium.wrenches)


def wrench_cops(
    wrenches: Float[np.ndarray, "*n 6"], loaded: Bool[np.ndarray, "*n"] | None = None
) -> Float[np.ndarray, "*n 2"]:
    """Where wrenches on flat contacts have their centre of pressure, p = (-m_y, m_x) / f_z [m].

    Args:
        wrenches: in contact axes, about the contact frames [N, Nm].
        loaded: which of them have one; the others are NaN. Default all.
    """
    normal = wrenches[..., 2:3]
    if loaded is not None:
        normal = np.where(loaded[..., None], normal, np.nan)
    return np.asarray(wrenches[..., 4:2:-1] * _SIGNS / normal)


def load_shares(wrenches: Float[np.ndarray, "*n nc 6"]) -> Float[np.ndarray, "*n nc"]:
    """Each contact's share of the normal forces of all."""
    normal = wrenches[..., 2]
    return np.asarray(normal / normal.sum(axis=-1, keepdims=True))


def edge_margin(polygon: ArrayLike, point: ArrayLike) -> EdgeMargin:
    """How far a centre of pressure is inside a sole, and the edge that is nearest.

    Args:
        polygon: vertices (k, 2) of the sole, in any order, such as `Contact.polygon` [m].
        point: (2,) in the same axes [m].
    """
    return Polygon.hull(polygon).margin(point)


def center_of_pressure(
    force: ArrayLike, moment: ArrayLike, plane: Plane | None = None
) -> Float[np.ndarray, " 3"]:
    """Where on a plane a force and a moment about the origin have no tipping moment.

    p = (n x m + (n . p0) f) / (n . f), all in the same axes.

    Args:
        force: resultant force (3,) [N].
        moment: resultant moment (3,) about the axes' origin [Nm].
        plane: default z = 0.

    Raises:
        UnloadedContactError: the force has no component along the normal.
    """
    f = finite_array(force, "the force", (3,), "x, y, z [N]")
    m = finite_array(moment, "the moment", (3,), "x, y, z [Nm]")
    plane = plane or Plane()
    n, p0 = np.array(plane.normal), np.array(plane.point)
    along = float(n @ f)
    if abs(along) <= 1e-12 * max(1.0, float(np.linalg.norm(f))):
        raise UnloadedContactError(("the plane",))
    return np.asarray((np.cross(n, m) + (n @ p0) * f) / along)


def total_center_of_pressure(
    equilibrium: StaticEquilibrium, plane: Plane | None = None
) -> Float[np.ndarray, " 3"]:
    """Centre of pressure of the whole robot on a plane, in the world [m]."""
    return center_of_pressure(*resultant(equilibrium.stance, equilibrium.world_wrenches), plane)


def support_polygon(stance: Stance) -> Polygon | None:
    """The hull of every sole and point contact on level ground, world x and y [m].

    None where the contacts do not lie in one horizontal plane, or one of them has no sole: there
    the centre of pressure of the whole robot is not confined to such a polygon.
    """
    corners = []
    for contact, place in zip(stance.contacts, stance.placements, strict=True):
        if contact.sole is None and contact.kind != "point":
            return None
        flat = np.zeros((1, 2)) if contact.sole is None else contact.sole.vertices
        local = np.column_stack([flat, np.zeros(len(flat))])
        corners.append(place.translation + local @ place.rotation.T)
        if abs(place.rotation[2, 2] - 1.0) > _LEVEL:
            return None
    points = np.concatenate(corners)
    if np.ptp(points[:, 2]) > _LEVEL:
        return None
    return Polygon.hull(points[:, :2])


def com_projection(stance: Stance, plane: Plane | None = None) -> Float[np.ndarray, " 3"]:
    """Projection of the centre of mass along gravity onto a plane, in the world [m]."""
    plane = plane or Plane()
    n, down = np.array(plane.normal), stance.robot.model.gravity.linear
    if abs(n @ down) <= 1e-12 * np.linalg.norm(down):
        raise InvalidInputError(
            "the plane is parallel to gravity: the CoM has no projection on it. Give a plane that "
            "the vertical meets."
        )
    return np.asarray(stance.com + down * (n @ (np.array(plane.point) - stance.com)) / (n @ down))


def zero_moment_point(
    stance: Stance, velocity: ArrayLike, acceleration: ArrayLike, plane: Plane | None = None
) -> Float[np.ndarray, " 3"]:
    """Zero-moment point of a motion on a plane, in the world [m].

    Args:
        stance: the configuration; its contacts do not enter.
        velocity: v (nv,), base in its own frame.
        acceleration: dv/dt (nv,).
        plane: default z = 0.
    """
    return center_of_pressure(*_required(stance, velocity, acceleration), plane)


def foot_rotation_indicator(
    stance: Stance,
    contact: str,
    velocity: ArrayLike,
    acceleration: ArrayLike,
    plane: Plane | None = None,
    *,
    other_wrenches: ArrayLike | None = None,
) -> Float[np.ndarray, " 3"]:
    """Foot rotation indicator of a foot (Goswami 1999), in the world [m].

    Where the ground would have to push for the foot to stay at rest while the rest of the robot
    moves as given: the zero-moment point without the foot's own inertia. On the sole it equals the
    centre of pressure; outside, the foot turns.

    Args:
        stance: the configuration and contacts.
        contact: name of the foot's contact.
        velocity: v (nv,).
        acceleration: dv/dt (nv,).
        plane: default z = 0.
        other_wrenches: wrenches (nc, 6) of the contacts in contact axes, of which every one but
            the foot's is taken off; default none (single support).
    """
    names = stance.contact_names
    if contact not in names:
        raise UnknownNameError("contact", contact, names)
    force, moment = _required(stance, velocity, acceleration)
    k = names.index(contact)
    foot = stance.robot.frame(stance.contacts[k].frame).parentJoint
    v, a = np.asarray(velocity, float), np.asarray(acceleration, float)
    rate = link_momentum_rate(stance.robot, stance.q, v, a, foot)
    force, moment = force - rate[:3], moment - rate[3:]
    if other_wrenches is not None:
        shape, meaning = (len(names), 6), "in contact axes, force first"
        others = finite_array(other_wrenches, "other_wrenches", shape, meaning).copy()
        others[k] = 0.0
        taken_f, taken_m = resultant(stance, stance.in_world_axes(others))
        force, moment = force - taken_f, moment - taken_m
    return center_of_pressure(force, moment, plane)


def resultant(
    stance: Stance, world: Float[np.ndarray, "*n nc 6"]
) -> tuple[Float[np.ndarray, "*n 3"], Float[np.ndarray, "*n 3"]]:
    """Force [N] and moment [Nm] about the world's origin of wrenches given in world axes."""
    origins = np.array([place.translation for place in stance.placements])
    moments = world[..., 3:] + np.cross(origins, world[..., :3])
    return world[..., :3].sum(axis=-2), moments.sum(axis=-2)


def _required(
    stance: Stance, velocity: ArrayLike, acceleration: ArrayLike
) -> tuple[np.ndarray, np.ndarray]:
    """Force and moment about the world's origin that the environment must supply."""
    model = stance.robot.model
    v = finite_array(velocity, "the velocity", (model.nv,), "the base in its frame, then joints")
    a = finite_array(acceleration, "the acceleration", (model.nv,), "as the velocity")
    rate = momentum_rate(stance.robot, stance.q, v, a)
    force = rate[:3] - stance.robot.mass * model.gravity.linear
    return force, rate[3:] + np.cross(stance.com, force)
