"""Descriptions of robots with rods, springs, coupled joints and tendons; all our own."""

import mujoco
import numpy as np

_SHIN = """
<body name='{s}_shin' pos='.01 0 -.3'>
  <joint name='{s}_knee' axis='0 1 0' range='-10 140' {knee}/>
  <geom type='capsule' fromto='0 .005 0 0 0 -.28' size='.04' mass='1.7'/>
  {shin}
  <body name='{s}_ankle' pos='0 0 -.3'>
    <joint name='{s}_ankle_pitch' axis='0 1 0' range='-70 70'/>
    <geom type='sphere' size='.02' pos='.004 0 -.005' mass='.25'/>
    <site name='{s}_heel' pos='-.07 0 .01'/>
    <body name='{s}_foot' pos='0 0 -.02'>
      <joint name='{s}_ankle_roll' axis='1 0 0'/>
      <geom name='{s}_sole' type='box' size='.1 .05 .01' pos='.03 0 -.05' mass='.7'/>
    </body></body></body>"""
_LEG = """
<body name='{s}_yawed' pos='0 {y} -.1'>
  <joint name='{s}_yaw' axis='0 0 1' ref='{ref}'/>
  <geom type='sphere' size='.03' mass='.4'/>
  <body name='{s}_thigh'>
    <joint name='{s}_roll' axis='1 0 0'/><joint name='{s}_hip' axis='0 1 0'/>
    <geom type='capsule' fromto='0 0 0 .01 0 -.28' size='.05' mass='2.8'/>
    {shin}
  </body></body>"""
_CRANK = """
<body name='{s}_crank_body' pos='-.02 .01 -.06'>
  <joint name='{s}_crank' axis='0 1 0'/>
  <geom type='capsule' fromto='0 0 0 -.06 0 0' size='.01' mass='.2'/>
  <body name='{s}_rod' pos='-.06 0 0'>
    <joint name='{s}_rod_top' axis='0 1 0'/>
    <geom type='capsule' fromto='0 0 0 .01 0 -.24' size='.008' mass='.3'/>
  </body></body>"""
_ARM = """
<body name='arm' pos='.02 0 .4'>
  <joint name='shoulder' axis='0 1 0'/>
  <geom type='capsule' fromto='0 0 0 .03 0 -.2' size='.03' mass='1.1'/>
  <body name='forearm' pos='.03 0 -.2'>
    <joint name='elbow' axis='0 1 0' {elbow}/>
    <geom type='capsule' fromto='0 0 0 0 .01 -.2' size='.02' mass='.6'/>
  </body></body>"""


def biped(*, shin="", knee="", elbow="", ref="0", tail=""):
    """An MJCF of a biped with one arm: what hangs on its shins, springs, and what follows."""
    legs = "".join(
        _LEG.format(
            s=s, y=y, ref=ref, shin=_SHIN.format(s=s, knee=knee, shin=shin.replace("{s}", s))
        )
        for s, y in (("l", 0.09), ("r", -0.09))
    )
    return (
        "<mujoco model='biped'><worldbody><body name='trunk' pos='0 0 1'><freejoint/>"
        "<geom type='box' size='.1 .15 .2' pos='.02 .003 .2' mass='11'/>"
        f"{legs}{_ARM.format(elbow=elbow)}</body></worldbody>{tail}</mujoco>"
    )


def actuators(*joints, element="motor"):
    """Actuators on joints; of names with a star, on both sides'."""
    names = [j.replace("*", s) for j in joints for s in ("lr" if "*" in j else "x")]
    return "".join(f"<{element} joint='{name}'/>" for name in names)


def sprung_rods(kind="connect"):
    """Ankles pitched by cranks and rods, springs in the knees, a sprung elbow without a motor."""
    ends = "".join(
        f"<connect name='{s} rod' body1='{s}_rod' body2='{s}_ankle' anchor='.01 0 -.24'/>"
        if kind == "connect"
        else f"<weld name='{s} rod' body1='{s}_tip' body2='{s}_ankle'/>"
        for s in "lr"
    )
    on = actuators("*_yaw", "*_roll", "*_hip", "*_knee", "*_ankle_roll", "*_crank", "shoulder")
    return biped(
        shin=_CRANK,
        knee="stiffness='30' springref='40'",
        elbow="stiffness='9' springref='-50'",
        tail=f"<equality>{ends}</equality><actuator>{on}</actuator>",
    )


def coupled_and_tendons():
    """Yaws that mirror each other off their references, ankles by two tendons, servos."""
    coupling = "<joint joint1='r_yaw' joint2='l_yaw' polycoef='.03 -.8 0 0 0'/>"
    tendons = "".join(
        f"<fixed name='{s}_{n}'><joint joint='{s}_ankle_pitch' coef='{a}'/>"
        f"<joint joint='{s}_ankle_roll' coef='{b}'/></fixed>"
        for s in "lr"
        for n, a, b in (("in", 0.9, 0.7), ("out", 1.1, -0.6))
    )
    pulls = "".join(
        f"<motor name='{s}_{n}_motor' tendon='{s}_{n}' gear='12' ctrlrange='-5 5'/>"
        for s in "lr"
        for n in ("in", "out")
    )
    on = actuators("l_yaw", "*_roll", "*_hip", "shoulder", "elbow")
    on += actuators("*_knee", element="position")
    return biped(
        ref="5",
        tail=f"<tendon>{tendons}</tendon><equality>{coupling}</equality>"
        f"<actuator>{pulls}{on}</actuator>",
    )


def at_stance(text, stance):
    """MuJoCo's model and data of a file at a stance's configuration, at rest."""
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    x, y, z, w = stance.q[3:7]
    data.qpos[:7] = [*stance.q[:3], w, x, y, z]
    for joint in stance.robot.joint_names:
        data.joint(joint).qpos[0] = stance.robot.joint_position(stance.q, joint)
    mujoco.mj_forward(model, data)
    return model, data


def contact_push(model, data, found):
    """Generalised forces (nv,) of the contacts' wrenches, by MuJoCo's own Jacobians."""
    stance, total = found.stance, np.zeros(model.nv)
    for contact, place, wrench in zip(
        stance.contacts, stance.placements, found.world_wrenches, strict=True
    ):
        linear, angular = np.zeros((2, 3, model.nv))
        body = model.body(contact.frame).id
        mujoco.mj_jac(model, data, linear, angular, place.translation, body)
        total += linear.T @ wrench[:3] + angular.T @ wrench[3:]
    return total


_LINK = """<link name="{name}"><inertial><origin xyz="{com}"/><mass value="{mass}"/>
<inertia ixx=".02" iyy=".02" izz=".02" ixy="0" ixz="0" iyz="0"/></inertial>{more}</link>"""
_JOINT = """<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>
<origin xyz="{at}"/><axis xyz="{axis}"/>
<limit lower="-1.5" upper="2.2" effort="{effort}" velocity="5"/>{more}</joint>"""
_SOLE = (
    '<collision><origin xyz=".03 0 -.04"/><geometry><box size=".2 .08 .02"/></geometry></collision>'
)
# Joint, parent and child ("*": the side), place, axis, mass and CoM of the child.
_CHAIN = (
    ("yaw", "trunk", "*_yawed", "0 {y} -.1", "0 .6 -.8", 0.4, "0 0 -.02"),
    ("roll", "*_yawed", "*_rolled", "0 0 0", "1 0 0", 0.3, "0 0 0"),
    ("hip", "*_rolled", "*_thigh", "0 0 0", "0 1 0", 2.9, ".01 0 -.15"),
    ("knee", "*_thigh", "*_shin", "0 0 -.3", "0 1 0", 1.9, "0 .005 -.14"),
    ("ankle", "*_shin", "*_ankle_link", "0 0 -.3", "0 1 0", 0.2, "0 0 0"),
    ("ankle_roll", "*_ankle_link", "*_foot", "0 0 0", "1 0 0", 0.6, ".03 0 -.04"),
)
_RODS = (
    ("crank", "*_shin", "*_crank_link", "-.02 0 -.06", "0 1 0", 0.2, "-.02 0 0"),
    ("rod_top", "*_crank_link", "*_rod", "-.06 0 0", "0 1 0", 0.25, "0 0 -.12"),
)


def urdf(*, more=None, effort=None, rods=False, tail=""):
    """A URDF of a biped: `more` in joints, efforts that are not 80, and what follows."""
    links = [_LINK.format(name="trunk", com=".02 .002 .2", mass=12, more="")]
    joints = []
    for s, y in (("l", 0.1), ("r", -0.1)):
        for name, parent, child, at, axis, mass, com in _CHAIN + (_RODS if rods else ()):
            joint, child = f"{s}_{name}", child.replace("*", s)
            sole = _SOLE if child.endswith("foot") else ""
            links.append(_LINK.format(name=child, com=com, mass=mass, more=sole))
            joints.append(
                _JOINT.format(
                    name=joint,
                    parent=parent.replace("*", s),
                    child=child,
                    at=at.format(y=y),
                    axis=axis,
                    effort=(effort or {}).get(joint, 80),
                    more=(more or {}).get(joint, ""),
                )
            )
    return f'<robot name="biped">{"".join(links)}{"".join(joints)}{tail}</robot>'
