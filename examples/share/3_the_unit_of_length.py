"""
The minimum wrench depends on a unit
====================================

A norm that adds forces to moments needs a length. The paper's is 1 m; half the distance between
the feet turns the minimum wrench into the minimum torque's distribution. On the four-bar linkage
both are closed forms, here beside the general solver.
"""

import numpy as np
from matplotlib.figure import Figure

import copsense
from copsense.paper import FourBar, solve_four_bar

linkage = FourBar(leg_length=0.5, rod_length=0.14)
robot = copsense.robots.four_bar_robot(0.5, 0.14, linkage.leg_mass, linkage.body_mass)
feet = [copsense.Contact(foot, kind="planar") for foot in ("l_sole", "r_sole")]
xi = 1.5  # angle between rod and leg [rad]
stance = copsense.Stance(
    robot, robot.configuration(copsense.robots.four_bar_angles(xi)), tuple(feet)
)

# %%
# The paper's x axis points to the robot's right, so left and right keep their names and the
# centre of pressure changes its sign.

for length in (1.0, 0.3, 0.07):
    closed = solve_four_bar(linkage, xi, "minimum-wrench", characteristic_length=length)
    solved = copsense.cop_sensitivity(stance, copsense.minimum_wrench(length))
    print(f"L = {length:4} m: CoP {closed.cop * 1e3} mm, dCoP/dCoM {closed.cop_per_com.round(3)}")
    assert np.allclose(-solved.cop[:, 1], closed.cop, rtol=1e-10)
    assert np.allclose(solved.com_gain[:, 1, 1], closed.cop_per_com, rtol=1e-9)

# %%
# At L = d/2 the two criteria of the paper agree.

torque = solve_four_bar(linkage, xi, "minimum-torque")
print(f"minimum torque: CoP {torque.cop * 1e3} mm")
assert np.allclose(torque.cop, closed.cop, rtol=1e-12)

# %%
# In between, the slope goes from one to the other.

lengths = np.geomspace(0.02, 2.0, 50)
slopes = [
    solve_four_bar(linkage, xi, "minimum-wrench", characteristic_length=length).cop_per_com
    for length in lengths
]
figure = Figure(figsize=(6, 3.6), layout="constrained")
axes = figure.add_subplot()
axes.semilogx(lengths, slopes, label=["left foot", "right foot"])
axes.axvline(0.07, linestyle=":", color="0.4", label="minimum torque")
axes.set_xlabel("L [m]")
axes.set_ylabel("dCoP/dCoM")
axes.legend()
