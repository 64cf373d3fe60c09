"""
Your controller under the magnifier
===================================

Any function from the configuration to the contact wrenches has a sensitivity. This one is a
weighted distribution, as many controllers do it: the vertical forces in inverse proportion to the
distance of the CoM from each foot, no tangential force, and what is left as moments.
"""

import numpy as np

import copsense
from copsense.plots import plot_stance

home = copsense.load_stance("talos", contact_at="sole")
stance = copsense.solve_posture(home, com=(float(home.com[0]), 0.02, None)).stance


def inverse_distance(q):
    """Wrenches (2, 6) in contact axes, force first [N, Nm]."""
    here = stance.at(q)
    weight = here.robot.weight
    feet = np.array([place.translation for place in here.placements])
    lever = here.com - feet
    distance = np.linalg.norm(lever[:, :2], axis=1)
    share = distance[::-1] / distance.sum()
    wrenches = np.zeros((2, 6))
    wrenches[:, 2] = share * weight
    # Each foot carries its part of the moment of the weight about itself.
    moment = np.sum([np.cross(lever[k], [0, 0, -share[k] * weight]) for k in range(2)], axis=0)
    wrenches[:, 3:] = -moment / 2
    return wrenches


# %%
# The function is differentiated numerically along the motions that leave the feet in place, the
# criteria analytically.

own = copsense.cop_sensitivity(stance, inverse_distance)
exact = copsense.cop_sensitivity(stance, copsense.minimum_torque())
for name, result in {"inverse distance": own, "minimum torque": exact}.items():
    print(
        f"{name}: gain {result.com_gain[:, 1, 1].round(3)}, "
        f"CoM travel to an edge {(result.com_travel * 1e3).round(1)} mm"
    )

figure = plot_stance(stance, [own, exact])

# All the load follows the CoM, so the moments, and with them the CoPs, hardly have to.
assert np.all(np.abs(own.com_gain[:, 1, 1]) < 0.2)

# %%
# Do not trust the tool either: its derivatives can be audited at your own posture.

copsense.check_sensitivity(stance, copsense.minimum_torque())
