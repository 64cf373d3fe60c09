"""
A motor that gives out
======================

How much can Talos hold in its left hand? Torques are affine in a load, so that two solutions say at
which load each motor is at its limit.
"""

import numpy as np
from matplotlib.figure import Figure

import copsense

stance = copsense.load_stance("talos", contact_at="sole")
criterion, hand = copsense.minimum_torque(), "gripper_left_base_link"


def holding(kilograms):
    """Talos with a weight in its hand, in the posture it has."""
    weight = (0.0, 0.0, -9.81 * kilograms)
    return stance.with_loads([copsense.Load(hand, force=weight)])


free = copsense.solve_equilibrium(stance, criterion).torques
per_kilogram = copsense.solve_equilibrium(holding(1.0), criterion).torques - free
limits = stance.robot.effort_limits
grows = np.abs(per_kilogram) > 1e-9
left = limits - np.sign(per_kilogram) * free
most = np.divide(left, np.abs(per_kilogram), out=np.full(len(free), np.inf), where=grows)

weakest = np.argsort(most)[:6]
for k in weakest:
    print(f"{stance.robot.torque_names[k]}: {limits[k]:.1f} Nm, reached at {most[k]:.1f} kg")

figure = Figure(figsize=(6, 3.2), layout="constrained")
axes = figure.add_subplot()
axes.barh([stance.robot.torque_names[k] for k in weakest][::-1], most[weakest][::-1])
axes.set_xlabel("held in the left hand when the motor is at its limit [kg]")

# %%
# The weakest is in the arm, whose torques no criterion can choose: with a gram more no equilibrium
# is left.

within = copsense.Limits(torque="model")
first = most.min()
copsense.solve_equilibrium(holding(first - 1e-3), criterion, within)
try:
    copsense.solve_equilibrium(holding(first + 1e-3), criterion, within)
except copsense.CopsenseError as error:
    print(error)
else:
    raise AssertionError("the motor should have given out")
assert stance.robot.torque_names[weakest[0]].startswith("arm_left")
