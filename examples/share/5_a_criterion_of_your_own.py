"""
A criterion of your own
=======================

A criterion is a sum of quadratic terms in torques and contact wrenches, so a new one is a value.
This one spares the ankles of Unitree's G1: their torques weigh ten times as much as all others.
"""

import copsense
from copsense.plots import plot_stance

stance = copsense.load_stance("g1", contact_at="sole")
joints = stance.robot.torque_names
spare_ankles = copsense.Criterion(
    "spare-ankles",
    (copsense.TorqueTerm({"*ankle*": 10.0, "*": 1.0}),),
)
criteria = [copsense.minimum_torque(), spare_ankles]
moved = copsense.solve_posture(stance, com=(float(stance.com[0]), 0.02, None)).stance

ankles = [number for number, name in enumerate(joints) if "ankle" in name]
found = [copsense.cop_sensitivity(moved, criterion) for criterion in criteria]
efforts = {}
for each in found:
    torques = each.equilibrium.torques
    name = each.equilibrium.criterion.name
    efforts[name] = float((torques[ankles] ** 2).sum() ** 0.5)
    print(
        f"{name}: ankles {efforts[name]:.2f} Nm, all {(torques**2).sum() ** 0.5:.2f} Nm, "
        f"gain {each.com_gain[:, 1, 1].round(2)}, load per metre {each.load_gain[:, 1].round(2)}"
    )

figure = plot_stance(moved, found)

# %%
# Ankles that do less leave the moment to the load: the CoPs hardly move, and the torques as a whole
# grow by 2 %. Nothing comes for free, but this is cheap. (Derivatives of the new criterion are
# exact, too.)

copsense.check_sensitivity(moved, spare_ankles)
assert efforts["spare-ankles"] < 0.25 * efforts["minimum-torque"]
assert found[1].com_gain[0, 1, 1] < 0.2 * found[0].com_gain[0, 1, 1]
