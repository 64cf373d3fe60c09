"""
Where the limits are, and what they cost
========================================

Friction, soles and motors bound what the contacts can do. Three regions of the centre of mass say
so: where any equilibrium exists, where the motors can hold it too, and where a criterion's own
wrenches need no clipping.
"""

import copsense
from copsense.plots import plot_regions

stance = copsense.load_stance("icub")
limits = copsense.Limits(normal_force=10.0, friction=1 / 3, torsion=1 / 75, torque="model")

# %%
# On its way to the left, which limit does the CoM meet first? The sensitivity predicts it, the path
# knows it. And where it binds, the other foot has to pay: its slope jumps.

for criterion in (copsense.minimum_wrench(1.0), copsense.minimum_torque()):
    travel = copsense.scan.limit_travel(stance, criterion, limits)
    found = copsense.scan.next_active_set_change(stance, criterion, limits)
    print(
        f"{criterion.name}: {travel.first.name} after {travel.first.exact * 1e3:.1f} mm "
        f"(first order {travel.first.first_order * 1e3:.1f}); "
        f"slopes {found.before[:, 1].round(2)} -> {found.after[:, 1].round(2)}"
    )

assert abs(found.value - 0.0459) < 1e-4

# %%
# The regions, from above.

criteria = [copsense.minimum_wrench(1.0), copsense.minimum_torque()]
regions = copsense.com_regions(stance, criteria, limits)
path = copsense.lateral_sweep(stance, -0.05, 0.05, 21)
data = copsense.sweep(path, criteria)
figure = plot_regions(regions, data).figure
for name, area in regions.areas.items():
    print(f"{name}: {area * 1e4:.0f} cm2")
assert regions["minimum-torque"].area < regions["and torque limits"].area

# %%
# A criterion for this robot and these limits: torque weights that let the CoM go farther.

family = copsense.design.families(stance)["length"]
sides = copsense.lateral_sweep(stance, -0.08, 0.08, 17)
designed = copsense.design_criterion(sides, limits, family, grid=5)
print(f"L = {designed.score.parameters['characteristic_length']:.3f} m")
print(f"travel {designed.score.travel * 1e3:.1f} mm, until {designed.score.first_limit}")
assert designed.score.travel > max(baseline.travel for baseline in designed.baselines)
