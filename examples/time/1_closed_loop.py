"""
In closed loop, until it tips
=============================

MuJoCo simulates the iCub under the paper's controller while its centre of mass leans slowly to the
left. The statics say beforehand when the first foot tips.
"""

import copsense
from copsense.controllers import Ramp
from copsense.simulation import Scenario

stance = copsense.load_stance("icub")
criterion = copsense.minimum_wrench(1.0)
lean = Scenario(2.4, Ramp(0.044, speed=0.02), control_period=4e-3)
recording = copsense.balance(stance, criterion, lean, until="tip")
print(recording)
figure = recording.plot()

# %%
# Statics: along the exact path the first centre of pressure meets its edge after 38.4 mm. In the
# simulation that foot turns by half a degree within a millimetre of it.

path = copsense.lateral_sweep(stance, -0.045, 0.045, 19)
predicted = copsense.PathScan(path, criterion).travel(copsense.Limits()).first
print(f"{predicted.name} after {predicted.exact * 1e3:.1f} mm")
print(f"{recording.tip.message} at {recording.tip_travel * 1e3:.1f} mm")
assert recording.tip.contact == "r_sole"
assert abs(recording.tip_travel - predicted.exact) < 1e-3
