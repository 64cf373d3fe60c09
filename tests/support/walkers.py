"""Walkers as URDF text: a trunk on legs of hinges, drawn in any axes and any units."""

import numpy as np
import pinocchio as pin

# A leg from the trunk to its foot: joint, axis; thigh and shin follow hip pitch and knee.
FULL = (
    ("yaw", "0 0 1"),
    ("roll", "1 0 0"),
    ("hip", "0 1 0"),
    ("knee", "0 1 0"),
    ("pitch", "0 1 0"),
    ("tilt", "1 0 0"),
)
NO_ANKLE_ROLL = FULL[:5]
PITCH_ONLY = FULL[2:5]
THIGH = SHIN = 0.3
SOLE = 0.05  # m, from the ankle to the underside


def bent(knee=0.8, sides="lr"):
    """Hips and ankles that keep the foot level under a bent knee [rad]."""
    return {
        f"{side}_{name}": angle
        for side in sides
        for name, angle in {"hip": -knee / 2, "knee": knee, "pitch": -knee / 2}.items()
    }


def numbers(values):
    return " ".join(repr(float(v)) for v in values)


def origin(place):
    return (
        f'<origin xyz="{numbers(place.translation)}" '
        f'rpy="{numbers(pin.rpy.matrixToRpy(place.rotation))}"/>'
    )


def shift(x=0.0, y=0.0, z=0.0):
    return pin.SE3(np.eye(3), np.array([x, y, z], dtype=float))


def turned(rotation):
    return pin.SE3(np.asarray(rotation, dtype=float), np.zeros(3))


def walker(
    joints=FULL,
    *,
    legs=None,
    trunk=(0.0, 0.0, 0.2),
    base=None,
    foot=None,
    scale=1.0,
    mass=1.0,
    limits=(-2.5, 2.5),
    box=True,
):
    """A trunk of 12 kg on legs of 3 kg, as URDF text.

    Args:
        joints: of each leg, from the trunk down, with their axes.
        legs: name -> (x, y) of the hip; default one left and one right.
        trunk: its centre of mass over the hips' middle [m].
        base: the trunk's frame, as a rotation from the axes in which x is forward and z up; None
            for those.
        foot: the feet's frames likewise.
        scale: metres per unit of length.
        mass: kilograms per unit of mass.
        limits: of every joint, or joint's name -> limits.
        box: whether the feet have a box of 0.2 x 0.08 m, 0.03 m ahead, under them.
    """
    legs = legs or {"l": (0.0, 0.1), "r": (0.0, -0.1)}
    per = 1.0 / scale
    # They take what is written in upright axes into the link's own.
    base, foot = (turned(np.eye(3) if r is None else np.transpose(r)) for r in (base, foot))

    def link(name, kg, at, more=""):
        at = pin.SE3(at.rotation, at.translation * per)
        inertia = numbers([0.02 / mass * per**2])
        return (
            f'<link name="{name}"><inertial>{origin(at)}<mass value="{kg / mass!r}"/><inertia '
            f'ixx="{inertia}" iyy="{inertia}" izz="{inertia}" ixy="0" ixz="0" iyz="0"/>'
            f"</inertial>{more}</link>"
        )

    parts = [link("trunk", 12.0, base * shift(*trunk))]
    for leg, (x, y) in legs.items():
        parent, at = "trunk", base * shift(x, y, 0.0)
        for k, (name, axis) in enumerate(joints):
            child, last = f"{leg}_{name}_link", k == len(joints) - 1
            low, high = limits.get(name, (-2.5, 2.5)) if isinstance(limits, dict) else limits
            here = shift()
            turn = here
            if last:
                child, turn = f"{leg}_foot", foot
                size = numbers(np.array([0.2, 0.08, 0.02]) * per)
                under = foot * shift(0.03, 0.0, 0.01 - SOLE)
                under = pin.SE3(under.rotation, under.translation * per)
                shape = (
                    f'<collision>{origin(under)}<geometry><box size="{size}"/></geometry>'
                    "</collision>"
                )
                parts.append(link(child, 0.6, foot * shift(0.03, 0.0, -0.04), shape * box))
            else:
                heavy = name in ("hip", "knee")
                parts.append(
                    link(child, 1.2 if heavy else 0.1, shift(0.0, 0.0, -THIGH / 2 * heavy))
                )
            place = at * pin.SE3(turn.rotation.T, np.zeros(3))
            place = pin.SE3(place.rotation, place.translation * per)
            own = turn.rotation @ np.array([float(v) for v in axis.split()])
            parts.append(
                f'<joint name="{leg}_{name}" type="revolute">{origin(place)}'
                f'<parent link="{parent}"/><child link="{child}"/><axis xyz="{numbers(own)}"/>'
                f'<limit lower="{low}" upper="{high}" effort="80" velocity="5"/></joint>'
            )
            drop = {"hip": THIGH, "knee": SHIN}.get(name, 0.0)
            parent, at = child, shift(0.0, 0.0, -drop)
    return '<robot name="walker">' + "".join(parts) + "</robot>"


def with_toes(text, length=0.03, inertia=1e-4):
    """A biped with hinged toes of 80 mm width before its feet, their undersides level."""
    box = (
        f'<collision><origin xyz="{length / 2 + 0.005} 0 0"/><geometry>'
        f'<box size="{length} 0.08 0.02"/></geometry>'
    )
    for side in "lr":
        toe = (
            f'<link name="{side}_toes"><inertial><mass value="0.1"/><inertia ixx="{inertia}" '
            f'ixy="0" ixz="0" iyy="{inertia}" iyz="0" izz="{inertia}"/></inertial>{box}'
            "</collision></link>"
            f'<joint name="{side}_toe" type="revolute"><origin xyz="0.13 0 -0.04"/><parent '
            f'link="{side}_foot"/><child link="{side}_toes"/><axis xyz="0 1 0"/>'
            '<limit lower="-1" upper="1" effort="9" velocity="9"/></joint></robot>'
        )
        text = text.replace("</robot>", toe)
    return text


BIPED = ["l_foot", "r_foot"]
FOUR = {"fl": (0.2, 0.1), "fr": (0.2, -0.1), "hl": (-0.2, 0.1), "hr": (-0.2, -0.1)}
