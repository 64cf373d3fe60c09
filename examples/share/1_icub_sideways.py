"""
The iCub shifts its weight
==========================

The paper's experiment, at rest: the centre of mass goes from above one foot to above the other,
and two criteria share the load. Which one keeps the soles on the ground for longer?
"""

import copsense
from copsense.plots import plot_results

stance = copsense.load_stance("icub")
path = copsense.lateral_sweep(stance, -0.07, 0.07, 57)  # world y of the CoM [m]
criteria = [copsense.minimum_wrench(1.0), copsense.minimum_torque()]
data = copsense.sweep(path, criteria)

print(data)
figure = plot_results(data)

# %%
# How fast does each centre of pressure follow the centre of mass, in the middle of the path?

middle = data.isel(posture=28)
slopes = middle["cop_slope"].sel(contact="l_sole", axis="y")
for criterion in data.labels("criterion"):
    print(f"{criterion}: dCoP_y/dCoM_y = {float(slopes.sel(criterion=criterion)):.3f}")

assert abs(float(slopes.sel(criterion="minimum-wrench")) - 0.995) < 0.001
assert abs(float(slopes.sel(criterion="minimum-torque")) - 0.506) < 0.001

# %%
# And over which range does every centre of pressure stay in its sole?

for criterion, reach in data.planted_range.items():
    assert reach is not None
    print(f"{criterion}: planted from {reach[0]:+.3f} m to {reach[1]:+.3f} m")

# %%
# The same posture gives another sensitivity along another coordinate. Per radian of the left hip's
# roll, along this very path:

per_hip_roll = slopes / float(middle["tangent"].sel(velocity="l_hip_roll"))
print(per_hip_roll.to_series().round(3).to_string())
assert abs(float(per_hip_roll.sel(criterion="minimum-torque")) + 0.196) < 0.001

# %%
# The same in 3-D (``pip install "copsense[explore]"``): drag to turn it; the bar under it plays and
# scrubs. A notebook shows it likewise, and ``.save("icub.html")`` makes a page to pass on.

data.show(stance)
