"""
A payload in the hand
=====================

The iCub takes two kilograms into its left hand: first without moving, then leaning the other way
until the centre of mass of both is where its own was.
"""

import numpy as np

import copsense
from copsense.plots import plot_robot
from copsense.posture import carry_payload

free = copsense.load_stance("icub")
leaning = carry_payload(free, "l_hand", 2.0)
still = copsense.Stance(leaning.robot, free.q, free.contacts)

criterion = copsense.minimum_torque()
for name, stance in {"free": free, "still": still, "leaning": leaning}.items():
    found = copsense.cop_sensitivity(stance, criterion)
    share = found.equilibrium.wrenches[:, 2] / stance.robot.weight
    print(
        f"{name}: CoM y {stance.com[1] * 1e3:+5.1f} mm, left foot {share[0]:.2f} of the weight, "
        f"then {found.com_travel.min() * 1e3:.0f} mm of travel"
    )

# %%
# Holding still, the CoM moves towards the hand: of all that hangs on the feet the payload is a part
# of 2 in 35. Leaning, the loads are even again.

moved = still.com - free.com
hand = free.com + moved * leaning.robot.mass / 2.0  # where the payload must be, by the lever
print(f"hand at {np.round(hand, 3)} m")
balanced = copsense.solve_equilibrium(leaning, criterion).wrenches[:, 2] / leaning.robot.weight
assert abs(moved[1] / hand[1] - 2.0 / (free.robot.mass + 2.0)) < 1e-9
assert np.allclose(balanced, 0.5, atol=0.05)

axes = plot_robot(free, label="free", color="#9aa4ae")
plot_robot(leaning, ax=axes, label="leaning", color="#d55e00")
figure = axes.figure
