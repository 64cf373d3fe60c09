"""
A reward for standing well
==========================

A robot that learns to stand is rewarded for what keeps it standing. Here a reward is made of how
far the centre of mass may go before a foot tips, and its gradient leads a batch of postures to one
that is better than where each of them began. `copsense.torch` has the same function for PyTorch.
"""

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

import copsense
from copsense.jax import CopFunction

stance = copsense.load_stance("icub")
names = ("com_x", "com_y", "com_z", "roll", "torso_roll")
balance = CopFunction(stance, copsense.minimum_torque(), names, invalid="mask")

# %%
# The reward: the shorter of the two feet's travels, in centimetres, less what it costs to be away
# from a height of 52 cm. A posture out of reach gets -10 and has no gradient.


def reward(x):
    """Of each posture of a batch."""
    values = balance.values(x)
    travel = values.travel.min(-1)
    height = 1e4 * (x[..., 2] - 0.52) ** 2
    return jnp.where(values.valid, 100.0 * travel - height, -10.0)


# %%
# Eight postures around the stance, led uphill together.

draw = np.random.default_rng(0).uniform(-1.0, 1.0, (8, 5))
x = balance.start - jnp.array([0.0, 0.0, 0.025, 0.0, 0.0]) + draw * [0.01, 0.01, 0.004, 0.05, 0.05]
rate = jnp.array([1e-6, 1e-6, 1e-6, 1e-4, 1e-4]) * 5.0  # metres and radians are of other sizes
uphill = jax.jit(jax.value_and_grad(lambda at: (reward(at).sum(), reward(at)), has_aux=True))
history = []
for step in range(61):
    (_, rewards), slope = uphill(x)
    history.append(rewards)
    if step % 20 == 0:
        print(f"step {step:2}: reward {rewards.min():5.2f} to {rewards.max():5.2f} cm")
    x = x + rate * slope

travel = np.array(balance.values(x).travel.min(-1))
print(f"CoM travel of the best: {travel.max() * 1e3:.1f} mm")
assert (rewards > history[0]).all()
assert abs(travel.max() - 0.0458) < 5e-4

# %%
# From wherever they begin, they come to the same height of the reward.

figure = Figure(figsize=(6, 3), layout="constrained")
axes = figure.subplots()
axes.plot(np.array(history))
axes.set(xlabel="step", ylabel="reward [cm]")
axes.grid(alpha=0.3)
