"""
A map of postures
=================

Where over the ground, and how high, should the iCub have its centre of mass while it holds a
kilogram in its left hand? Each posture of a grid is solved with the feet in place, and stored in a
file that xarray opens.
"""

import tempfile
from pathlib import Path

import copsense
from copsense.maps import Axis, Grid, marginal
from copsense.plots import plot_map

stance = copsense.load_stance("icub").with_loads([copsense.Load("l_hand", force=(0, 0, -9.81))])
grid = Grid((Axis("com_y", -0.03, 0.03, 9), Axis("com_z", 0.49, 0.51, 3)))
criteria = [copsense.minimum_wrench(1.0), copsense.minimum_torque()]
with tempfile.TemporaryDirectory() as folder:
    file = Path(folder) / "icub.zarr"
    summary = copsense.map_postures(stance, grid, criteria, file)
    dataset = copsense.load_map(file).load()
figure = plot_map(
    [marginal(dataset, quantity=name) for name in ("least_com_travel", "largest_com_gain")]
)

# %%
# The summary has the worst postures, and percentiles of all.

for name, found in summary.criteria.items():
    worst = found.worst_travel[0]
    half = found.travel_percentiles[50.0] * 1e3
    print(f"{name}: half of the postures have {half:.1f} mm of travel or less,")
    what = f"{worst.contact} {worst.event}"
    print(f"    the worst {worst.value * 1e3:.1f} mm: {worst.coordinates}, {what}")

# %%
# The load pulls to the left, so the robot does best with its own centre of mass to the right: by as
# much as the load's moment shifts the centre of pressure, m d / M = 5 mm. The nearest posture of
# the grid is the best one.

travel = dataset["least_com_travel"].sel(criterion="minimum-wrench").values
best = float(dataset["com_y"].values[travel.argmax()])
hand = float(stance.applied.points[0][1])
expected = -1.0 * hand / stance.robot.mass
print(f"best at {best * 1e3:+.1f} mm, by the lever {expected * 1e3:+.1f} mm")
assert summary.criteria["minimum-wrench"].counts["evaluated"] == 27
assert abs(best - expected) < 0.0075 / 2
