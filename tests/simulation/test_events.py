"""A contact that turns, rises or slides too far is an event, and nothing less is."""

import numpy as np
import pinocchio as pin
import pytest
from support.standing import icub

import copsense
from copsense.simulation import Snapshot, Thresholds
from copsense.simulation.events import EventDetector

STANCES = {"soles": icub, "points": lambda: copsense.load_stance("solo12")}


@pytest.mark.parametrize("tilt", [0.02, 0.06])
@pytest.mark.parametrize("name", STANCES)
def test_an_event_is_what_exceeds_a_threshold(name, tilt):
    thresholds = Thresholds(tilt, lift=3e-3, slip=5e-3)
    stance, random = STANCES[name](), np.random.default_rng(3)
    watch, seen = EventDetector(stance, thresholds), set()
    for _ in range(600):
        moving = random.integers(2)
        contact, place = stance.contacts[moving], stance.placements[moving]
        # Either or both, about and along any axis or the plane's normal.
        normal, share = place.rotation[:, 2], random.choice([(0, 1), (1, 0), (1, 1)])
        shift, turn = (
            share[i]
            * size
            * random.uniform(0, 2)
            * (normal if random.random() < 0.5 else pin.exp3(random.normal(size=3))[0])
            for i, size in enumerate((5e-3, tilt))
        )
        positions = np.array([p.translation for p in stance.placements])
        rotations = np.array([p.rotation for p in stance.placements])
        positions[moving] += shift
        rotations[moving] = pin.exp3(turn) @ rotations[moving]

        points = contact.kind == "point"
        corners = np.zeros((1, 2)) if points else contact.sole.vertices
        before = place.translation + corners @ place.rotation[:, :2].T
        moved = positions[moving] + corners @ rotations[moving][:, :2].T - before
        slid = np.linalg.norm(moved - np.outer(moved @ normal, normal), axis=1).max()
        tilted = 0.0 if points else np.arccos(min(1.0, rotations[moving][:, 2] @ normal))
        exceeded = {
            "tip": tilted > tilt,
            "lift": shift @ normal > thresholds.lift,
            "slip": slid > thresholds.slip,
        }
        first = next((kind for kind, is_event in exceeded.items() if is_event), None)
        none = np.zeros((len(positions), 6))
        now = Snapshot(0.0, stance.q, np.zeros(stance.robot.model.nv), none, positions, rotations)
        found = watch.contact_event(now)
        assert (found.kind if found else None) == first
        assert not found or found.contact == contact.name
        seen.add(first)
    assert seen == {"lift", "slip", None} | (set() if name == "points" else {"tip"})
