"""
A better posture
================

From which side is the iCub the easiest to push over, and where should its centre of mass be so that
this takes the most? The search moves it ahead or back, and keeps two degrees of every knee.
"""

import numpy as np

import copsense
from copsense.plots import plot_optimum

stance = copsense.load_stance("icub")
found = copsense.optimise(
    stance,
    objective="push",
    over={"com_x": 0.05},  # to either side of where it is [m]
    reserve={"knee": float(np.radians(2.0))},
    starts=1,
)
print(found)
figure = plot_optimum(found)

# %%
# The optimum is not at an end of the range: ahead the sides get stronger and the front weaker, and
# the best place is where a push to a side and one to the front take the same.

limited = [each.name for each in found.binding if each.kind == "objective"]
print("limited by", "; ".join(limited))
assert found.converged
assert any("+x (front)" in name for name in limited)
assert found.after.quantities["push"] > 1.05 * found.before.quantities["push"]
