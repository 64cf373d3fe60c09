"""
Friction that binds
===================

Talos stands with its feet half a metre apart, and pushes them outwards. On a wet floor the
criterion's own wrenches ask for more friction than there is; as a quadratic program they stay
within the cone, and the motors pay.
"""

import numpy as np
from matplotlib.figure import Figure

import copsense

stance = copsense.load_stance("talos", contact_at="sole", width=0.5)
criterion = copsense.minimum_torque()
own = copsense.solve_equilibrium(stance, criterion)
asked = float((np.hypot(own.wrenches[:, 0], own.wrenches[:, 1]) / own.wrenches[:, 2]).max())
print(f"the criterion's own wrenches ask for a friction of {asked:.3f}")

coefficients = np.linspace(0.02, 0.3, 15)
pressing, torques = [], []
for friction in coefficients:
    found = copsense.solve_equilibrium(stance, criterion, copsense.Limits(friction=friction))
    pressing.append(len(found.active))
    torques.append(float(np.linalg.norm(found.torques)))

figure = Figure(figsize=(6, 3.6), layout="constrained")
axes = figure.add_subplot()
axes.plot(coefficients, torques, "o-")
axes.axvline(asked, linestyle=":", color="0.4", label="asked for by the criterion")
axes.set_xlabel("friction coefficient of the floor")
axes.set_ylabel("norm of the joint torques [N m]")
axes.legend()

# %%
# Above that coefficient nothing presses and nothing changes. Below it the cone does (each foot's
# cone is a pyramid of eight sides inside it, so it begins to press a little before), and the less
# friction, the more torque: on ice 15 % more.

dry = coefficients > asked / np.cos(np.pi / 8)
assert not any(np.array(pressing)[dry])
assert all(np.array(pressing)[coefficients < asked])
assert np.allclose(np.array(torques)[dry], np.linalg.norm(own.torques), rtol=1e-9)
assert np.all(np.diff(np.array(torques)[coefficients < asked]) < 0)
