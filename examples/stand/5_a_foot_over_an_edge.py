"""
A foot over an edge
===================

The iCub stands with its toes over the edge of a step: 40 mm of each sole have no ground under them.
The wrenches do not change, for a criterion knows no edges. How far the robot may lean does.
"""

from dataclasses import replace

import numpy as np

import copsense
from copsense.plots import plot_stance

stance = copsense.load_stance("icub")
soles = [contact.polygon for contact in stance.contacts]
front = [sole[:, 0].max() for sole in soles]
shorter = [
    replace(contact, polygon=np.minimum(sole, [toe - 0.04, np.inf]))
    for contact, sole, toe in zip(stance.contacts, soles, front, strict=True)
]
ledge = stance.with_contacts(shorter)

ahead = {}
for name, place in {"on the ground": stance, "over the edge": ledge}.items():
    sensitivity = copsense.cop_sensitivity(place, copsense.minimum_torque())
    edge = np.array([contact.polygon[:, 0].max() for contact in place.contacts])
    ahead[name] = (edge - sensitivity.cop[:, 0]) / sensitivity.com_gain[:, 0, 0]
    print(f"{name}: the CoM may go {ahead[name].min() * 1e3:.1f} mm ahead")

figure = plot_stance(ledge, [sensitivity])

# %%
# Both feet carry alike, and go along with the CoM: 1.00 mm a millimetre. What the ledge takes off
# the soles it takes off the travel.

assert np.allclose(sensitivity.com_gain[:, 0, 0], 1.0, atol=0.01)
assert np.allclose(ahead["on the ground"] - ahead["over the edge"], 0.04, atol=5e-4)
