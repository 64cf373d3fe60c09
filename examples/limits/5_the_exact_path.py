"""
The exact path
==============

A sensitivity is of one posture. Along a path the centres of pressure have a kink wherever a limit
begins to bind; a scan finds it to the micrometre.
"""

import copsense
from copsense.plots import plot_cop
from copsense.polygon import Polygon

stance = copsense.load_stance("icub")
limits = copsense.Limits(friction=1 / 3)
path = copsense.lateral_sweep(stance, -0.06, 0.06, 25)
scan = copsense.PathScan(path, copsense.minimum_torque(), limits)
kink = scan.next_active_set_change()
print(f"{kink.name} after {kink.travel * 1e3:.3f} mm (first order {kink.first_order * 1e3:.1f} mm)")
print(
    f"slopes of the CoPs sideways: {kink.before[:, 1].round(2)}, then {kink.after[:, 1].round(2)}"
)

# %%
# The right foot's centre of pressure has reached its edge and stays there. The left foot's goes
# three times as fast from then on, for the load goes over to it and the whole must follow the
# centre of mass.

there = scan.at(kink.value).sensitivity
axes = plot_cop(copsense.sweep(path, [scan.criterion], limits))
axes.axvline(kink.value * 1e3, linestyle=":", color="0.4")
figure = axes.figure

sole = Polygon(stance.contacts[1].polygon)
assert abs(sole.margins(there.cop[1]).min()) < 1e-6
assert abs(kink.after[1, 1]) < 0.01
assert kink.after[0, 1] > 3 * kink.before[0, 1]

# %%
# Nothing is lost between postures: force by force, the robot's centre of pressure is under its CoM.

forces = scan.at(kink.value).equilibrium
total = copsense.cop.total_center_of_pressure(forces)
assert abs(total[1] - kink.value) < 1e-9
