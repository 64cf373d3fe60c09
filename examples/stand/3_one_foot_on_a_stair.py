"""
One foot on a stair
===================

Talos puts its left foot on a step of ten centimetres. Nothing in the balance of forces knows how
high a foot stands, so the minimum wrench shares the load as on the flat. The joints do know.
"""

from dataclasses import replace

import copsense
from copsense.plots import plot_robot

flat = copsense.load_stance("talos", contact_at="sole")
left, right = flat.contacts
step = replace(left, plane=copsense.Plane((0.0, 0.0, 0.10)))
stance = copsense.robots.stand(flat.robot, [step, right], flat.q)

shares = {}
for criterion in (copsense.minimum_wrench(1.0), copsense.minimum_torque()):
    for name, place in {"flat": flat, "stair": stance}.items():
        found = copsense.solve_equilibrium(place, criterion)
        shares[criterion.name, name] = found.wrenches[0, 2] / place.robot.weight
        print(
            f"{criterion.name}, {name}: left foot {shares[criterion.name, name]:.3f} of the weight"
        )

# %%
# The leg on the stair is the one that is bent more: its knee has the longer lever, and carries a
# third instead of a half.

figure = plot_robot(
    stance, [copsense.cop_sensitivity(stance, copsense.minimum_torque())], side="right"
).figure

assert abs(shares["minimum-wrench", "stair"] - 0.5) < 1e-3
assert abs(shares["minimum-torque", "stair"] - 0.335) < 1e-3
