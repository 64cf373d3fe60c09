"""
Which criterion does a log follow?
==================================

A robot that sways records joints and contact wrenches. Which criterion shares its load like that,
at rest or with the inertia of the motion? The log of this example is of a simulation; that of a
real robot is read in the same way.
"""

import tempfile
from pathlib import Path

import copsense
from copsense.controllers import Sine
from copsense.logs import compare_log, read_log
from copsense.simulation import Scenario

stance = copsense.load_stance("icub")
sway = Scenario(2.4, Sine(0.008, 1.0), control_period=4e-3)
recording = copsense.balance(stance, copsense.minimum_torque(), sway)
with tempfile.TemporaryDirectory() as folder:
    log = read_log(recording.save(Path(folder) / "sway.nc"))
found = compare_log(log, stance, [copsense.minimum_torque()], skip=0.4, postures=60)
print(found)
figure = found.plot()

# %%
# At 1 Hz statics know a quarter of it: the motion's inertia does the rest. With it, minimum torque
# is what was measured.

load = found.slopes["load"]
assert abs(load["measured"].value / load["minimum-torque, in motion"].value - 1) < 0.05
assert load["minimum-torque, at rest"].value < 0.3 * load["measured"].value
