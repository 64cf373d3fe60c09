"""Measured wrenches are the engine's forces at each point, summed about each contact."""

import mujoco
import numpy as np
import pytest
from support.standing import icub

import copsense
from copsense.simulation import MujocoSimulator


def heel_and_toe():
    """The iCub on four soles, two on each foot."""
    contacts = [
        copsense.Contact(
            foot,
            name=f"{part} of {foot}",
            polygon=copsense.rectangle((-0.02, 0.02), (-0.03, 0.03)),
            offset=(x, 0.0, -0.0105),
        )
        for foot in ("l_sole", "r_sole")
        for part, x in (("heel", -0.03), ("toe", 0.08))
    ]
    return copsense.load_stance("icub", contacts=contacts)


STANCES = {
    "two soles": icub,
    "heels and toes": heel_and_toe,
    "four points": lambda: copsense.load_stance("solo12"),
}


@pytest.mark.parametrize("name", STANCES)
def test_wrenches_are_the_sum_of_the_engines_points(name):
    stance = STANCES[name]()
    simulator, random = MujocoSimulator(stance), np.random.default_rng(1)
    simulator.reset()
    n, lifted = len(stance.robot.torque_names), False
    for _ in range(40):  # it trembles, tips and begins to fall
        now = simulator.step(0.3 * stance.robot.weight * random.uniform(-1, 1, n) / n)
        expected = summed_by_hand(simulator, now)
        assert np.abs(now.wrenches - expected).max() < 1e-10 * stance.robot.weight
        lifted = lifted or simulator._data.ncon < simulator._model.npair
    assert lifted  # not every point touched all the time


def summed_by_hand(simulator, now):
    model, data, stance = simulator._model, simulator._data, simulator.stance
    wrenches, names = np.zeros((len(stance.contacts), 6)), list(stance.contact_names)
    for i, point in enumerate(data.contact):
        local = np.zeros(6)
        mujoco.mj_contactForce(model, data, i, local)
        force = point.frame.reshape(3, 3).T @ local[:3]
        k = names.index(model.geom(point.geom[1]).name.split(" | ")[0])
        if stance.contacts[k].kind == "point":
            wrenches[k, :3] += stance.placements[k].rotation.T @ force
        else:
            moment = np.cross(point.pos - now.positions[k], force)
            wrenches[k] += np.concatenate([force, moment]) @ np.kron(np.eye(2), now.rotations[k])
    return wrenches
