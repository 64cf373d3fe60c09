"""
The load on four points
=======================

A quadruped stands on points, whose centres of pressure cannot move. What its balance says is how
the load goes over from foot to foot, and when one of them is unloaded.
"""

import numpy as np
from matplotlib.figure import Figure

import copsense

stance = copsense.load_stance("anymal_c")
feet = np.array([place.translation for place in stance.placements])
path = copsense.lateral_sweep(stance, -0.1, 0.1, 21)
data = copsense.sweep(path, [copsense.minimum_wrench(1.0), copsense.minimum_torque()])
print(data)

# %%
# Feet at the corners of a rectangle, and forces as small as can be: four forces that are affine in
# the feet's places. Then each foot's share is 1/4 + y/(4 d) when the CoM is y aside, with d half
# the track. It is unloaded where the CoM is over the feet of the other side.

forces = data["wrench"].sel(component="fz") / stance.robot.weight
share = forces.sel(criterion="minimum-wrench", contact="LF_FOOT").values
half_track = float(np.abs(feet[:, 1]).mean())
expected = 0.25 + data.coordinate.values / (4 * half_track)
assert np.allclose(share, expected, atol=2e-3)

# %%
# The torques of the legs say nearly the same.

figure = Figure(figsize=(6, 3.6), layout="constrained")
axes = figure.add_subplot()
for criterion in data.labels("criterion"):
    for contact in ("LF_FOOT", "RF_FOOT"):
        load = forces.sel(criterion=criterion, contact=contact)
        style = "--" if criterion == "minimum-torque" else "-"
        axes.plot(data.coordinate * 1e3, load, style, label=f"{contact}, {criterion}")
axes.set_xlabel("CoM y [mm]")
axes.set_ylabel("share of the weight")
axes.legend()
