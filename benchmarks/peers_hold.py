"""A controller that keeps the joints where they are: the pipe's test, and a pattern for others.

Started like a peer, see peers_pipe.py. It can be set up to fail in several ways.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from peers_pipe import State, Step, Times, serve

STIFFNESS, DAMPING = 20.0, 0.4  # Nm/rad, Nm s/rad: no more, for the lightest joints at 1 kHz


def hold(q: np.ndarray, v: np.ndarray, posture: np.ndarray, torques: np.ndarray) -> np.ndarray:
    """Springs and dampers on the joints, about torques that carry the weight."""
    return torques - STIFFNESS * (q[7:] - posture[7:]) - DAMPING * v[6:]


def build(setup: dict[str, Any]) -> tuple[dict[str, Any], Step]:
    """As `setup` wants it: with its joints the other way round, a false mass, an early end ..."""
    torques = dict(zip(setup["joints"], setup["torques"], strict=True))
    joints = list(reversed(setup["joints"])) if setup.get("reversed") else list(setup["joints"])
    joints += setup.get("more", [])
    hello = {"joints": joints, "mass": setup["mass"] * setup.get("heavier", 1.0)}
    hello |= {"com": setup["com"], "versions": []}
    print("what a library prints does not get between the frames")

    def step(state: State) -> tuple[Times, np.ndarray, np.ndarray]:
        if state.time >= setup.get("dies", np.inf):
            os._exit(7)
        if state.time >= setup.get("raises", np.inf):
            raise RuntimeError("out of ideas")
        at_rest = np.array([torques[joint] for joint in joints])
        wrenches = np.full((len(setup["contacts"]), 6), np.nan)
        return (3e-6, 2e-6, 1e-6), hold(state.q, state.v, state.posture, at_rest), wrenches

    return hello, step


if __name__ == "__main__":
    serve(build)
