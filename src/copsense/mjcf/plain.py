"""plain: an MJCF by Pinocchio's own reader, where MuJoCo is not installed.

That reader passes over what it does not know. Only what it is known to read as MuJoCo does is let
through to it; `tests/mjcf/test_plain.py` compares the two.
"""

from __future__ import annotations

import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pinocchio as pin

from copsense.description import Description
from copsense.errors import ModelLoadError
from copsense.mjcf.gravity import STANDARD_GRAVITY, usable_gravity
from copsense.mjcf.mjcf_reading import MjcfReading

_REMEDY = 'Install MuJoCo, which reads it: pip install "copsense[sim]"'


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


# What has no say in masses, axes and limits, or is read right.
_SECTIONS = _words(
    "compiler option size statistic visual custom contact sensor keyframe asset default worldbody "
    "actuator tendon equality"
)
_COMPILER = _words(
    "angle eulerseq meshdir texturedir assetdir strippath discardvisual convexhull usethread "
    "fitaabb coordinate autolimits inertiafromgeom"
)
_IN_BODY = _words("body joint freejoint inertial geom site camera light")
_PLACED = _words("name class pos quat euler axisangle xyaxes zaxis user")
_ATTRIBUTES = {
    "body": _PLACED | {"childclass"},
    "inertial": _PLACED | _words("mass diaginertia fullinertia"),
    "site": _PLACED | _words("type size fromto group material rgba"),
    "freejoint": _words("name group"),
    "joint": _words(
        "name class type axis pos range limited armature damping frictionloss group user margin "
        "solreflimit solimplimit solreffriction solimpfriction actuatorfrcrange "
        "actuatorfrclimited stiffness springref springdamper"
    ),
    "geom": _PLACED
    | _words(
        "type size fromto mass density group contype conaffinity condim priority friction solmix "
        "solref solimp margin gap material rgba mesh"
    ),
}
# Lost where a default class gives them.
_NOT_BY_DEFAULT = {"joint": {"pos"}, "geom": {"mesh"}, "site": {"pos", "quat"}}
_NOT_USED = {
    "equality": "equalities ({}) are not used.",
    "tendon": "tendons ({}) are not used.",
    "actuator": "actuators ({}) are not read without MuJoCo: no effort limit comes from them, "
    "and every joint is taken to have a motor.",
}
_DROPPED = ("keyframe", *_NOT_USED)


def read_plain(description: Description) -> MjcfReading:
    """The robot of a simple MJCF; see `copsense.mjcf.read_mjcf`.

    Raises:
        ModelLoadError: the file uses what Pinocchio's reader does not know, or is not an MJCF.
    """
    root = ET.fromstring(description.text.encode())
    what = description.path or "the text given"
    unknown = list(dict.fromkeys(_unknown(root)))
    if unknown:
        more = f" (and {len(unknown) - 5} more)" if len(unknown) > 5 else ""
        raise ModelLoadError(
            f"{what} cannot be read without MuJoCo, for it has {'; '.join(unknown[:5])}{more}. "
            f"{_REMEDY}"
        )
    if root.find("worldbody/body") is None:
        raise ModelLoadError(
            f"{what} holds no robot: its <worldbody> has no <body>. Correct the file."
        )
    notes = tuple(_notes(root))
    gravity = _gravity(root)
    _strip(root)
    _one_joint_a_body(root)
    try:
        with _Written(root) as path:
            model = _floating(path)
    except (ValueError, RuntimeError, LookupError) as error:
        lines = str(error).strip().splitlines() or ["no reason given"]
        raise ModelLoadError(
            f"{what} is not a readable MJCF: {lines[-1].rstrip('.')}. Correct the file."
        ) from None
    used, said = usable_gravity(gravity)
    model.gravity = pin.Motion(used, np.zeros(3))
    return MjcfReading(model, None, (*said, *notes))


def read_shapes(description: Description, model: pin.Model) -> list[pin.GeometryObject]:
    """The collision shapes of an MJCF that `read_plain` reads."""
    root = ET.fromstring(description.text.encode())
    _strip(root)
    _one_joint_a_body(root)
    folder = None if description.path is None else description.path.parent
    for compiler in root.findall("compiler") or [ET.SubElement(root, "compiler")]:
        for name in ("meshdir", "texturedir", "assetdir"):
            # Read from a temporary folder: what is relative to the file stays so.
            if folder is not None and (name == "meshdir" or compiler.get(name)):
                compiler.set(name, str((folder / compiler.get(name, "")).absolute()))
    with _Written(root) as path:
        found = pin.buildGeomFromMJCF(model, path, pin.GeometryType.COLLISION)
    return list(found.geometryObjects)


class _Written:
    """A temporary file that holds a document, for a reader that wants a path."""

    def __init__(self, root: ET.Element) -> None:
        """Remember what to write."""
        self._root = root
        self._folder = tempfile.TemporaryDirectory()

    def __enter__(self) -> str:
        """Return the path."""
        path = Path(self._folder.name) / "model.xml"
        path.write_text(ET.tostring(self._root, encoding="unicode"), encoding="utf-8")
        return str(path)

    def __exit__(self, *_: object) -> None:
        """Remove the file."""
        self._folder.cleanup()


def _floating(path: str) -> pin.Model:
    """The model, with a base that floats."""
    model = pin.buildModelFromMJCF(path)
    if model.njoints > 1 and model.joints[1].shortname() == "JointModelFreeFlyer":
        return model
    base = pin.JointModelFreeFlyer()
    return pin.buildModelAndLegacyConstraintsFromMJCF(path, base, "root_joint")[0]


def _unknown(root: ET.Element) -> Iterator[str]:
    """What Pinocchio's reader does not know, or reads otherwise than MuJoCo."""
    for section in root:
        if section.tag not in _SECTIONS:
            yield f"<{section.tag}>"
    for element in root.iter():
        if element.tag == "include":
            yield f"<include file={element.get('file')!r}>"
        elif element.get("plugin") or element.tag == "plugin":
            yield "a plugin"
    for compiler in root.findall("compiler"):
        yield from (f"{a}= in <compiler>" for a in sorted(set(compiler.keys()) - _COMPILER))
        if compiler.get("inertiafromgeom", "auto") == "true":
            yield "inertiafromgeom='true'"
        if compiler.get("eulerseq", "xyz") != "xyz":
            yield f"eulerseq={compiler.get('eulerseq')!r}"
        if compiler.get("autolimits", "true") != "true":
            yield "autolimits='false'"
    yield from _unknown_defaults(root)
    worlds = root.findall("worldbody")
    if len(worlds) > 1:
        yield f"{len(worlds)} <worldbody>"
    bodies = [body for world in worlds for body in world.findall("body")]
    if len(bodies) > 1:
        yield f"several bodies in the world ({', '.join(b.get('name', '?') for b in bodies[:5])})"
    for world in worlds:
        yield from (f"<{e.tag}> in the world" for e in world if e.tag not in _IN_BODY)
    for body in bodies:
        yield from _unknown_in(body, outermost=True)


def _unknown_defaults(root: ET.Element) -> Iterator[str]:
    unweighed = any(b.find("inertial") is None for b in root.iterfind("worldbody//body"))
    for default in root.iter("default"):
        for element in default:
            given = set(element.keys())
            if element.tag == "geom" and "0" in _collides(element) and unweighed:
                yield "geoms of a class that do not collide and give bodies their mass"
            wrong = given & _NOT_BY_DEFAULT.get(element.tag, set())
            if element.tag in _ATTRIBUTES:
                wrong |= given - _ATTRIBUTES[element.tag]
            yield from (f"{a}= of a {element.tag} in a <default>" for a in sorted(wrong))


def _unknown_in(body: ET.Element, *, outermost: bool) -> Iterator[str]:
    if not body.get("name"):
        yield "a body without a name"
    where = f"body {body.get('name', '')!r}"
    jointless = not any(e.tag in ("joint", "freejoint") for e in body)
    weighed = body.find("inertial") is not None
    for element in [body, *body]:
        inside = "" if element is body else f" in {where}"
        if element is not body and element.tag not in _IN_BODY:
            yield f"<{element.tag}>{inside}"
            continue
        label = where if element is body else f"a {element.tag}{inside}"
        known = _ATTRIBUTES.get(element.tag)
        if known is not None and (element is body or element.tag != "body"):
            yield from (f"{a}= of {label}" for a in sorted(set(element.keys()) - known))
        if element.tag == "geom" and element.get("mesh") and not weighed:
            yield f"a mesh that gives {where} its mass"
        if element.tag == "geom" and "0" in _collides(element) and not weighed:
            yield f"a geom that does not collide and gives {where} its mass"
        if element.tag == "site" and jointless and not outermost:
            yield f"{label}, which has no joint"
    for child in body.findall("body"):
        yield from _unknown_in(child, outermost=False)


def _collides(geom: ET.Element) -> tuple[str, str]:
    return geom.get("contype", "1").strip(), geom.get("conaffinity", "1").strip()


def _notes(root: ET.Element) -> Iterator[str]:
    """What is passed over, in words."""
    for section, sentence in _NOT_USED.items():
        names = [e.get("name") or e.tag for part in root.findall(section) for e in part]
        if names:
            yield sentence.format(", ".join(dict.fromkeys(names)))
    springs = [j.get("name", "") for j in root.iter("joint") if float(j.get("stiffness", 0))]
    if springs:
        yield f"springs (stiffness) of joints {', '.join(filter(None, springs))} are not used."


def _gravity(root: ET.Element) -> np.ndarray:
    """Gravity of the file (3,) [m/s^2]."""
    gravity = np.array(STANDARD_GRAVITY)
    for option in root.findall("option"):
        if option.get("gravity") is not None:
            gravity = np.array([float(g) for g in option.get("gravity", "").split()])
        if any(flag.get("gravity") == "disable" for flag in option.findall("flag")):
            gravity = np.zeros(3)
    return gravity


def _strip(root: ET.Element) -> None:
    """Remove what no link depends on and the reader stumbles over."""
    for section in _DROPPED:
        for element in root.findall(section):
            root.remove(element)


def _one_joint_a_body(root: ET.Element) -> None:
    """Give each joint of a body with several a body of its own.

    Pinocchio makes one composite joint of them, which has no single angle to name and whose
    derivatives it does not know. Nested bodies without mass move alike, joint by joint.
    """
    for body in list(root.iterfind("worldbody//body")):
        joints = [child for child in body if child.tag == "joint" and child.get("type") != "free"]
        if len(joints) < 2:
            continue
        name, rest = body.get("name", "body"), [c for c in body if c not in joints[:-1]]
        inner = body
        for child in list(body):
            body.remove(child)
        for number, joint in enumerate(joints[:-1]):
            inner.set("name", f"{name}/{joint.get('name', number)}")
            inner.append(joint)
            inner = ET.SubElement(inner, "body")
        inner.set("name", name)  # the last carries the joint, the shapes and the children
        inner.extend(rest)
