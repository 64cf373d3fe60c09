"""
Every way to share the load of a four-bar
=========================================

On the paper's linkage all equilibria are a family of two numbers: the share a of the weight on the
left foot, and the horizontal force h with which the feet push against each other. Every criterion
picks one of them.
"""

import numpy as np
from matplotlib.figure import Figure

from copsense.paper import FourBar, solve_four_bar, solve_four_bar_member

linkage = FourBar(leg_length=0.5, rod_length=0.14)
xi = 1.5  # angle of the legs from the ground [rad]

# %%
# Where the centres of pressure are as the share goes from 0 (moments alone) to 1 (load alone), and
# the members that the paper's two criteria pick:

shares = np.linspace(-0.2, 1.2, 57)
cops = np.array([solve_four_bar_member(linkage, xi, share).cop for share in shares])
figure = Figure(figsize=(6, 3.6), layout="constrained")
axes = figure.add_subplot()
axes.plot(shares, cops * 1e3, label=["left foot", "right foot"])
for name in ("minimum-wrench", "minimum-torque"):
    found = solve_four_bar(linkage, xi, name)
    axes.plot([found.share] * 2, found.cop * 1e3, "o", label=name)
    print(f"{name}: a = {found.share:.3f}, CoP {found.cop * 1e3} mm, slopes {found.cop_per_com}")
axes.set_xlabel("share a of the moment that the load carries")
axes.set_ylabel("CoP to the right of its foot [mm]")
axes.legend()

# %%
# The ankles' torques grow with 1 - a, the hips' with a, in equal measure: least squares is a half.
# The minimum wrench weighs a moment over L = 1 m against a pair of forces d/2 = 70 mm apart.

lever = linkage.rod_length / 2
assert abs(solve_four_bar(linkage, xi, "minimum-torque").share - 0.5) < 1e-12
assert abs(solve_four_bar(linkage, xi, "minimum-wrench").share - lever**2 / (lever**2 + 1)) < 1e-12
