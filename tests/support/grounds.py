"""Stances on uneven ground: planes that are tilted, of different heights, or walls."""

from dataclasses import replace

import numpy as np

import copsense
from copsense import Contact, Plane


def off_centre(stance, seed=0, size=0.05):
    """A nearby posture without symmetry, the contacts in place."""
    Z = stance.admissible_motions
    coordinates = size * np.random.default_rng(seed).standard_normal(Z.shape[1])
    return copsense.posture.retract(stance, Z @ coordinates)


def on_tilted_planes(stance, *, tilt, step, seed=0):
    """The same robot standing with each foot on its own plane.

    Args:
        stance: on flat ground.
        tilt: largest slope of a plane along x and along y.
        step: largest height of a plane over the ground [m].
        seed: of the slopes and heights.
    """
    rng = np.random.default_rng(seed)
    contacts = []
    for contact, place in zip(stance.contacts, stance.placements, strict=True):
        x, y, _ = place.translation
        slope = rng.uniform(-tilt, tilt, 2)
        plane = Plane((x, y, rng.uniform(0, step)), (slope[0], slope[1], 1.0))
        contacts.append(replace(contact, plane=plane))
    return copsense.robots.stand(stance.robot, contacts, stance.q)


def with_hand(stance, frame, normal):
    """The same posture with a hand's point on a plane (wall or table) through where it is."""
    place = stance.with_contacts([Contact(frame)]).placements[0]
    x, y, z = (float(c) for c in place.translation)
    hand = Contact(frame, kind="point", name="hand", plane=Plane((x, y, z), normal))
    return stance.with_contacts([*stance.contacts, hand])
