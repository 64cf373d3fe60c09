"""Robots that stand in the simulation's tests, and a simulator that only pretends."""

from functools import cache

import numpy as np

import copsense
from copsense.controllers import BalancingController
from copsense.simulation import (
    MujocoSimulator,
    Scenario,
    SimulatorStoppedError,
    Snapshot,
    rollout,
)

C1, C2 = copsense.minimum_wrench(1.0), copsense.minimum_torque()
# Soles of 160 x 72 mm, as the iCub's simplified model has them, with their inner edges 31 mm from
# the contact frames.
SOLES = (("l_sole", (-0.031, 0.041)), ("r_sole", (-0.041, 0.031)))


@cache
def icub(knee=0.0, width=0.14):
    """The iCub on rectangular soles, knees bent [rad]."""
    posture = {}
    for side in "lr":
        posture |= {
            f"{side}_hip_pitch": knee / 2,
            f"{side}_knee": -knee,
            f"{side}_ankle_pitch": -knee / 2,
        }
    contacts = [
        copsense.Contact(
            name, polygon=copsense.rectangle((-0.0535, 0.1065), y), offset=(0.0, 0.0, -0.0105)
        )
        for name, y in SOLES
    ]
    return copsense.load_stance("icub", contacts=contacts, posture=posture, width=width)


@cache
def simulator():
    """One engine for the tests of a process; a rollout resets it."""
    return MujocoSimulator(icub())


@cache
def second_at_rest(criterion):
    """The recording of a second in which nothing disturbs the iCub."""
    return rollout(simulator(), BalancingController(icub(), criterion), Scenario(1.0))


class Statue:
    """A simulator in which nothing ever moves, or which stops when told."""

    time_step = 1e-3

    def __init__(self, stance, stops_at=None):
        self.stance, self.stops_at, self.torques = stance, stops_at, []

    def reset(self):
        self.number = 0
        return self._snapshot()

    def step(self, torques, external=None):
        self.torques.append(np.array(torques))
        self.number += 1
        if self.stops_at is not None and self.number * self.time_step > self.stops_at:
            raise SimulatorStoppedError("told to stop", self.stops_at)
        return self._snapshot()

    def _snapshot(self):
        places = self.stance.placements
        share = np.zeros((len(places), 6))
        share[:, 2] = self.stance.robot.weight / len(places)
        return Snapshot(
            self.number * self.time_step,
            np.array(self.stance.q),
            np.zeros(self.stance.robot.model.nv),
            share,
            np.array([p.translation for p in places]),
            np.array([p.rotation for p in places]),
        )
