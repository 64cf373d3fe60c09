"""
How sure is a centre of pressure?
=================================

Links weigh something else than the model says, encoders are off, floors slope. Say by how much, and
each centre of pressure has its ellipse, each source its part of it, and the travel what is left.
"""

import numpy as np

import copsense
from copsense.plots import plot_stance
from copsense.uncertainty import propagate_uncertainty, sample_models

stance = copsense.load_stance("icub")
criterion = copsense.minimum_torque()
spread = propagate_uncertainty(stance, criterion, samples=10)  # as a careful laboratory knows it
for source, part in spread.shares["l_sole"].items():
    print(f"{source}: {part:.2f} of the variance under the left foot")
left = spread.travels["+y"]
likely, worst = left.likely * 1e3, left.worst * 1e3
print(f"travel {left.travel * 1e3:.1f} mm, likely {likely:.1f}, at worst {worst:.1f}")
figure = plot_stance(stance, [copsense.cop_sensitivity(stance, criterion)], [spread])

# %%
# Three quarters are of a floor that may slope by half a degree: the CoM is 0.55 m high, and goes 5
# mm to a side on it. A level would tell more than better scales.

slope = 0.00873 * float(stance.com[2])  # half a degree [rad] times the height
print(f"half a degree is {slope * 1e3:.1f} mm at the height of the CoM")
assert spread.shares["l_sole"]["slope of the ground"] > 0.7

# %%
# The ellipse is a first order. Whole models with random errors say the same, as well as a hundred
# of them can: a deviation from N samples is good to 1/sqrt(2 N).

count = 100
errors = np.random.default_rng(0).standard_normal((count, len(spread.sources))) * spread.deviations
sampled = sample_models(stance, criterion, spread.sources, errors).std(axis=0)
expected = np.sqrt(np.diagonal(spread.covariance, axis1=1, axis2=2))
assert np.allclose(sampled, expected, rtol=3 / np.sqrt(2 * count))
