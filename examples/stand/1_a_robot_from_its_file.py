"""
A robot from its file
=====================

Any URDF, MJCF or SDF will do. This is IHMC's Alexander without its upper body, of which copsense
knows nothing but the file. What has it to stand on?
"""

import numpy as np

import copsense
from copsense.plots import plot_stance
from copsense.robots.presets import example_file

# Where example-robot-data keeps it; of your own robot, simply its path.
path = "alexander_description/urdf/alexander_v1.lowerBodyOnly.urdf"
file, share = example_file(path, "alexander")
found = copsense.robots.inspect_robot(file, package_dirs=[share])
for foot in found.feet:
    print(foot)

# %%
# The lowest links have a frame over each sole whose x axis points to the left, so the contact is
# turned: x ahead, y left. The soles are read from what is drawn, since the file has no collision
# geometry, and the knees are bent, since straight legs cannot shift the weight.

turned = [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]
bent = {"HIP_Y": -0.26, "KNEE_Y": 0.52, "ANKLE_Y": -0.26}  # rad
upright = copsense.load_stance(
    found.robot,
    contacts=[copsense.Contact(foot.frame, rotation=turned) for foot in found.feet],
    contact_at="sole",
    soles="visual",
    posture={f"{side}_{joint}": bent[joint] for side in ("LEFT", "RIGHT") for joint in bent},
)
sole = upright.contacts[0].polygon
middle = float(sole[:, 0].max() + sole[:, 0].min()) / 2
stance = copsense.solve_posture(upright, com=(middle, 0.0, None)).stance

analysis = copsense.analyse(stance)
print(analysis)
figure = plot_stance(stance, list(analysis.sensitivities.values()))

# %%
# Feet side by side carry the whole moment of a CoM that goes ahead, so that each centre of pressure
# goes with it, millimetre by millimetre. From the middle of a sole of 200 mm it may go 100.

gain = analysis.sensitivities["minimum-wrench"].com_gain
ahead = (sole[:, 0].max() - analysis.sensitivities["minimum-wrench"].cop[:, 0]) / gain[:, 0, 0]
assert np.allclose(gain[:, 0, 0], 1.0, atol=1e-6)
assert np.allclose(ahead, 0.100, atol=1e-3)
