"""
Joints held in position
=======================

A robot on position servos minimises nothing on purpose, yet its wrenches are those of least elastic
energy. With all joints alike that is minimum torque. Stiff hips and soft ankles send the load from
foot to foot, soft hips and stiff ankles keep it where it is.
"""

import numpy as np
from matplotlib.figure import Figure

import copsense
from copsense.stiffness import critical_stiffness, stiffness

stance = copsense.load_stance("icub")
feet = np.array([place.translation[1] for place in stance.placements])
distance = abs(feet[0] - feet[1])

servos = {
    "alike": stiffness(2000.0),
    "stiff hips": stiffness({"*hip*": 4000.0, "*ankle*": 1000.0, "*": 2000.0}),
    "stiff ankles": stiffness({"*hip*": 1000.0, "*ankle*": 4000.0, "*": 2000.0}),
}
figure = Figure(figsize=(6, 3.6), layout="constrained")
axes = figure.add_subplot()
moved = {}
for name, criterion in servos.items():
    found = copsense.cop_sensitivity(stance, criterion)
    moved[name] = float(np.abs(found.load_gain[:, 1]).mean() * distance)
    least = critical_stiffness(stance, criterion)
    print(f"{name}: load carries {moved[name]:.2f}; falls at {least:.3f} of these stiffnesses")
axes.bar(list(moved), list(moved.values()))
axes.set_ylabel("part of the CoM's moment that the load carries")

# %%
# Alike is minimum torque to the last digits. And the robot needs joints this stiff to stand at all:
# the weight is an inverted pendulum of m g h a radian, which two ankles alone would hold with half
# of it each.

torque = copsense.cop_sensitivity(stance, copsense.minimum_torque())
assert abs(moved["alike"] - float(np.abs(torque.load_gain[:, 1]).mean() * distance)) < 1e-9
assert moved["stiff ankles"] < 0.2 < 0.75 < moved["stiff hips"]
pendulum = stance.robot.weight * float(stance.com[2])
assert 0.5 < critical_stiffness(stance, stiffness(1.0)) / (pendulum / 2) < 2.0
