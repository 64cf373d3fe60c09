"""Robots and postures for the tests of the batch."""

import numpy as np

import copsense
from copsense.batch import BatchKernel
from copsense.criterion import TorqueTerm, WrenchTerm, reference_wrench
from copsense.posture_system import supporting_joints
from support.grounds import off_centre, on_tilted_planes, with_hand

WRENCH, TORQUE = copsense.minimum_wrench(0.7), copsense.minimum_torque()


def served(stance):
    """Criteria that the kernel answers itself."""
    n = len(stance.robot.torque_names)
    weights = copsense.weighted_torque(np.linspace(0.5, 3.0, n))
    return [WRENCH, TORQUE, weights, copsense.mixed((WRENCH, 0.3), (TORQUE, 1.0))]


def postures(stance, count, *, seed=0, size=0.2):
    """Random postures on the contacts, as configurations (count, nq)."""
    rng = np.random.default_rng(seed)
    Z, found = stance.admissible_motions, []
    while len(found) < count:
        try:
            moved = copsense.posture.retract(stance, Z @ (size * rng.standard_normal(Z.shape[1])))
            found.append(stance.at(moved.q).q)
        except copsense.CopsenseError:
            continue
    return np.array(found)


def tight(stance, q, share=0.5):
    """Limits that press on about half of these postures, of every kind."""
    own = BatchKernel(stance, served(stance), gains=False).evaluate(q)
    f = own.wrenches
    slip = np.hypot(f[..., 0], f[..., 1]) / np.abs(f[..., 2])
    return copsense.Limits(
        friction=min(float(np.quantile(slip.max(axis=-1), share)) + 0.02, 2.0),
        torque=float(np.quantile(np.abs(own.torques).max(axis=-1), share)),
        torsion=0.02,
        cop_margin=0.005,
    )


def both_feet_and_hands(icub):
    """Four contacts: two soles and both hands, one on a wall and one on a table."""
    stance = with_hand(off_centre(icub), "l_hand", (-1, 0.2, 0.1))
    hand = stance.with_contacts([copsense.Contact("r_hand")]).placements[0].translation
    table = copsense.Plane(tuple(float(c) for c in hand), (0.1, 0.0, 1.0))
    right = copsense.Contact("r_hand", kind="point", name="right hand", plane=table)
    return stance.with_contacts([*stance.contacts, right])


def hand_flat(icub):
    """Three surfaces: two soles and a hand laid flat on a table."""
    stance = off_centre(icub)
    place = stance.with_contacts([copsense.Contact("l_hand")]).placements[0]
    turn = np.array(place.rotation.T)
    palm = copsense.Contact(
        "l_hand",
        rotation=turn,
        name="palm",
        polygon=np.array([[-1.0, -1.0], [1.0, -1.0], [0.0, 1.0]]),
    )
    return stance.with_contacts([*stance.contacts, palm])


CASES = {
    "icub": lambda load: load("icub"),
    "icub, hand on a wall": lambda load: with_hand(
        off_centre(load("icub")), "l_hand", (-1, 0.2, 0.1)
    ),
    "icub, both hands": lambda load: both_feet_and_hands(load("icub")),
    "icub, three surfaces": lambda load: hand_flat(load("icub")),
    "talos on slopes": lambda load: on_tilted_planes(load("talos"), tilt=0.15, step=0.03, seed=2),
    "g1": lambda load: load("g1"),
    "human": lambda load: load("human"),
    "solo12 on slopes": lambda load: on_tilted_planes(load("solo12"), tilt=0.3, step=0.05),
    "anymal_c": lambda load: load("anymal_c"),
    "solo12 on three feet": lambda load: load("solo12").with_contacts(load("solo12").contacts[1:]),
}


def weighed(stance):
    """Criteria with references, with weights of each contact's own, and with full weights."""
    rng = np.random.default_rng(3)
    nc, m, n = len(stance.contacts), len(stance.component_index), len(stance.robot.torque_names)
    held = np.flatnonzero(supporting_joints(stance)[stance.robot.base_nv :])
    coupled, full = np.diag(np.linspace(0.5, 3.0, n)), 0.3 * rng.standard_normal((m, m))
    more = 0.3 * rng.standard_normal((len(held), len(held)))
    coupled[np.ix_(held, held)] += more @ more.T
    reference = np.tile([2.0, -3.0, stance.robot.weight / nc, 1.0, 2.0, 0.5], (nc, 1))
    each = {c.name: [1.0, 2.0, 0.5 + k, 4.0, 3.0, 5.0] for k, c in enumerate(stance.contacts)}
    torques = copsense.weighted_torque(coupled, name="full torque weights")
    whole = WrenchTerm(full @ full.T + np.eye(m), reference)
    return [
        reference_wrench(reference, 0.5),
        copsense.Criterion("full weights", (whole, TorqueTerm(0.1))),
        torques,
        copsense.mixed((torques, 1.0), (copsense.Criterion("each", (WrenchTerm(each),)), 0.2)),
    ]
