"""
A quadruped on uneven ground
============================

Point feet on four planes of different tilt and height. Point contacts have no sole to tip over:
what counts is when a foot unloads.
"""

import numpy as np

import copsense
from copsense.plots import plot_robot

model = copsense.load_robot("solo12")
planes = {
    "FL_FOOT": copsense.Plane((0.0, 0.0, 0.02), (0.15, 0.0, 1.0)),
    "FR_FOOT": copsense.Plane((0.0, 0.0, 0.00), (0.00, 0.2, 1.0)),
    "HL_FOOT": copsense.Plane((0.0, 0.0, -0.02), (0.0, 0.0, 1.0)),
    "HR_FOOT": copsense.Plane((0.0, 0.0, 0.01), (-0.1, -0.1, 1.0)),
}
contacts = [copsense.Contact(foot, kind="point", plane=plane) for foot, plane in planes.items()]
home = copsense.load_stance("solo12")
stance = copsense.robots.stand(model, contacts, home.q)
print(f"{stance.admissible_motions.shape[1]} admissible motions")

# %%
# Which way of sharing the load lets the body go farther before a foot is unloaded?

for criterion in (copsense.minimum_wrench(0.2), copsense.minimum_torque()):
    result = copsense.cop_sensitivity(stance, criterion)
    travel = dict(zip(planes, (result.unloading_travel * 1e3).round(1).tolist(), strict=True))
    print(f"{criterion.name}: CoM travel to unloading [mm] {travel}")
    assert np.all(result.unloading_travel > 0.05)

# %%
# On no common plane the robot still has a centre of pressure on any plane you state. At rest the
# resultant of the contacts is the weight, upwards through the centre of mass:

equilibrium = copsense.solve_equilibrium(stance, copsense.minimum_torque())
plane = copsense.Plane((0.0, 0.0, 0.01), (0.1, 0.0, 1.0))
total = copsense.cop.total_center_of_pressure(equilibrium, plane)
assert np.allclose(total, copsense.cop.com_projection(stance, plane), atol=1e-10)
print("centre of pressure on the plane [m]:", total.round(4))

# %%
# From its right side the uneven ground is seen; each dot is the load's place on a foot.

figure = plot_robot(
    stance, [copsense.cop_sensitivity(stance, copsense.minimum_torque())], side="right"
).figure
