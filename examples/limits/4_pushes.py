"""
How hard may it be pushed?
==========================

A slow push on the hips of the iCub, from any side: what could any equilibrium answer, what do the
paper's criteria, and what yields first?
"""

import copsense
from copsense.plots import plot_pushes
from copsense.pushes import push_limits

stance = copsense.load_stance("icub")
limits = copsense.Limits(friction=0.5)
criteria = [copsense.minimum_wrench(1.0), copsense.minimum_torque()]
pushes = push_limits(stance, "root_link", criteria, limits)
print(pushes)
figure = plot_pushes(pushes).figure

# %%
# From behind it can be pushed until it tips over its toes, whatever the criterion: force times
# height is weight times the distance to the toes.

toes = min(
    (place.translation + place.rotation @ [*contact.polygon.max(axis=0), 0.0])[0]
    for contact, place in zip(stance.contacts, stance.placements, strict=True)
)
tipping = stance.robot.weight * (toes - stance.com[0]) / pushes.point[2]
assert abs(pushes.any.largest((1, 0)) / tipping - 1) < 1e-3

# %%
# To a side any equilibrium could use both feet's width. Each criterion leaves one foot at its edge
# long before: a third, or less than a half, of what the feet could answer.

for criterion, region in zip(criteria, pushes.criteria, strict=True):
    part = region.largest((0, 1)) / pushes.any.largest((0, 1))
    print(f"{criterion.name}: {part:.2f} of what is possible to the left")
    assert part < 0.45
