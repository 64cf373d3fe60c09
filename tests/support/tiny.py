"""A two-legged robot of three links, as text in which a test breaks one thing."""

BOX = '<collision><geometry><box size="0.2 0.1 0.02"/></geometry></collision>'
MESH = '<collision><geometry><mesh filename="package://nowhere/foot.stl"/></geometry></collision>'

_LINK = """
<link name="{name}">
  <inertial><mass value="{mass}"/><origin xyz="0 0 0"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>{foot}
</link>"""
_JOINT = """
<joint name="{name}" type="revolute">
  <parent link="base"/><child link="{child}"/><origin xyz="0 {y} -0.5"/><axis xyz="1 0 0"/>
  <limit effort="10" velocity="1" lower="-1" upper="1"/>
</joint>"""


def urdf(foot=BOX):
    """Links base, left and right; joints left_hip and right_hip; soles 10 mm under the frames."""
    return (
        '<robot name="tiny">'
        + _LINK.format(name="base", mass=2, foot="")
        + _LINK.format(name="left", mass=1, foot=foot)
        + _LINK.format(name="right", mass=1, foot=foot)
        + _JOINT.format(name="left_hip", child="left", y=0.1)
        + _JOINT.format(name="right_hip", child="right", y=-0.1)
        + "</robot>"
    )


def broken(old, new):
    """The URDF with one text replaced; the text must be there."""
    text = urdf()
    assert old in text, old
    return text.replace(old, new, 1)


MJCF = """
<mujoco model="tiny"><worldbody><body name="base" pos="0 0 1"><freejoint/>
  <inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/>
  <body name="left" pos="0 0.1 -0.5"><joint name="left_hip" type="hinge" axis="1 0 0"/>
    <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><geom type="box" size=".1 .05 .01"/></body>
  <body name="right" pos="0 -0.1 -0.5"><joint name="right_hip" type="hinge" axis="1 0 0"/>
    <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><geom type="box" size=".1 .05 .01"/></body>
</body></worldbody></mujoco>"""
FEET = ["left", "right"]
