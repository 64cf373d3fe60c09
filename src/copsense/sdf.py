"""SDF: the links and joints of an SDFormat model, and what of a file is not read.

Links are placed in the model's frame, where every joint is at zero; a joint stands in its child's
frame. Up to version 1.4 an axis is given in the model's frame, from 1.5 in the joint's unless
``<use_parent_model_frame>`` says otherwise, from 1.7 in the frame that ``expressed_in`` names.
Sensors, plugins, drawings and settings of simulators are passed over; an element that is not known
here, or that is known and changes the mechanics, is a fault.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator

from copsense.xml_names import wrong_names
from copsense.xml_numbers import read_numbers

JOINT_TYPES = ("revolute", "continuous", "prismatic", "fixed", "ball", "universal")
LOOP_TYPES = ("revolute", "continuous", "fixed", "ball")
AXES = {"revolute": 1, "continuous": 1, "prismatic": 1, "universal": 2}
WORLD = "world"

# What of each element is read (numbers with their count), and what is passed over.
_READ = {
    "model": {"pose": 6, "static": 0, "link": 0, "joint": 0},
    "link": {"pose": 6, "gravity": 0, "kinematic": 0, "inertial": 0},
    "inertial": {"pose": 6, "mass": 1, "inertia": 0},
    "inertia": dict.fromkeys(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), 1),
    "joint": {"pose": 6, "parent": 0, "child": 0, "axis": 0, "axis2": 0},
    "axis": {"xyz": 3, "use_parent_model_frame": 0, "limit": 0, "dynamics": 0},
    "limit": {"lower": 1, "upper": 1, "effort": 1, "velocity": 1},
    "dynamics": {"damping": 1, "friction": 1, "spring_reference": 1, "spring_stiffness": 1},
}
_PASSED = {
    "model": "self_collide allow_auto_disable enable_wind plugin gripper frame",
    "link": "collision visual sensor projector audio_sink audio_source battery light plugin "
    "particle_emitter self_collide enable_wind must_be_base_link velocity_decay",
    "joint": "physics sensor plugin",
    "axis": "initial_position",
    "limit": "stiffness dissipation",
}
_TRUE = ("1", "true")
_INHERITED = {"axis2": "axis"}


def sdf_model_element(root: ET.Element) -> ET.Element:
    """The model of a file that has no faults."""
    return next(root.iterfind("model"))


def axes_in_model(root: ET.Element) -> bool:
    """Whether the file's version gives axes in the model's frame (before 1.5)."""
    return (_version(root) or (1, 5)) < (1, 5)


def says(element: ET.Element, tag: str) -> bool:
    """Whether a flag inside an element is set."""
    return element.findtext(tag, "").strip().lower() in _TRUE


def sdf_numbers(parent: ET.Element | None, tag: str, default: str) -> list[float]:
    """The numbers of an element inside another, or of a default where it is not there."""
    text = None if parent is None else parent.findtext(tag)
    return read_numbers((text or "").strip() or default) or []


def end_of(joint: ET.Element, end: str) -> str:
    """Name of the link at a joint's ``"parent"`` or ``"child"`` end."""
    return joint.findtext(end, "").strip()


def roots_and_joints(
    model: ET.Element,
) -> tuple[list[str], list[ET.Element], list[ET.Element], list[ET.Element]]:
    """How the joints of a model join its links.

    Returns:
        Links that hang on no other; joints to the world; joints of the tree, the first of the file
        for each child; joints that close loops.
    """
    joints = model.findall("joint")
    world = [joint for joint in joints if end_of(joint, "parent") == WORLD]
    tree: dict[str, ET.Element] = {}
    loops = []
    for joint in joints:
        if joint in world:
            continue
        if end_of(joint, "child") in tree:
            loops.append(joint)
        else:
            tree[end_of(joint, "child")] = joint
    names = [link.get("name", "") for link in model.findall("link")]
    return [name for name in names if name not in tree], world, list(tree.values()), loops


def sdf_notes(root: ET.Element) -> Iterator[str]:
    """What is assumed of a file without faults, or not used, a sentence each."""
    model = sdf_model_element(root)
    for joint in roots_and_joints(model)[1]:
        yield (
            f"Joint {joint.get('name', '')!r} ties link {end_of(joint, 'child')!r} to the world; "
            "it is left out, and the robot floats."
        )
    bare = [e.get("name", "") for e in model.findall("link") if e.find("inertial/mass") is None]
    if bare:
        yield f"Links {', '.join(bare)} have no <mass>: they have 1 kg, as the format says."


def sdf_faults(root: ET.Element) -> Iterator[str]:
    """What keeps a file from being read as it is meant, a clause each."""
    models = root.findall("model")
    if _version(root) is None:
        yield f"its version is {root.get('version')!r}, not 1.x"
        return
    others = [str(e.tag) for e in root if isinstance(e.tag, str) and e.tag != "model"]
    if others:
        yield f"it holds <{others[0]}>, which is not read: give the file of one model"
        return
    if len(models) != 1:
        named = ", ".join(repr(model.get("name", "")) for model in models)
        yield f"it holds {len(models)} models ({named or 'none'}) and not one"
        return
    model = models[0]
    for joint in model.findall("joint"):
        if joint.get("type") not in JOINT_TYPES:
            yield (
                f"joint {joint.get('name', '')!r} is of type {joint.get('type')!r}, not "
                f"{', '.join(JOINT_TYPES)}"
            )
    yield from _element_faults(model, "the model")
    links, joints = model.findall("link"), model.findall("joint")
    if not links:
        yield "it has no link"
    yield from wrong_names("link", links)
    yield from wrong_names("joint", joints)
    names = {link.get("name", "") for link in links}
    for joint in joints:
        yield from _joint_faults(joint, names)
    yield from _tree_faults(model, names)


def _version(root: ET.Element) -> tuple[int, int] | None:
    major, _, minor = root.get("version", "").partition(".")
    if major != "1" or not minor.isdigit():
        return None
    return 1, int(minor)


def _element_faults(element: ET.Element, where: str) -> Iterator[str]:
    """Elements and attributes that are not known, and words in place of numbers."""
    kind = _INHERITED.get(element.tag, element.tag)
    for flag, wrong in (("static", True), ("kinematic", True), ("gravity", False)):
        given = element.find(flag)
        if given is not None and says(element, flag) is wrong and flag in _READ[kind]:
            yield f"{where} has <{flag}>{(given.text or '').strip()}</{flag}>"
    if element.get("auto", "false").lower() in _TRUE:
        yield f'{where} has auto="{element.get("auto")}"'
    for child in element:
        if not isinstance(child.tag, str) or child.tag in _PASSED.get(kind, "").split():
            continue
        count = _READ[kind].get(child.tag)
        if count is None:
            yield f"<{child.tag}> in {where} is not known here"
        elif count and not (child.tag == "pose" and not (child.text or "").strip()):
            numbers = read_numbers(child.text or "")
            # Bounds may be written as infinite.
            if numbers is None and child.tag in ("lower", "upper", "effort", "velocity"):
                numbers = [0.0] if (child.text or "").strip().lstrip("+-") == "inf" else None
            if numbers is None or len(numbers) != count:
                need = "one finite number" if count == 1 else f"{count} finite numbers"
                yield f"<{child.tag}> in {where} is {(child.text or '').strip()!r}, not {need}"
        if child.tag == "pose":
            yield from _pose_faults(child, where)
        elif _INHERITED.get(child.tag, child.tag) in _READ:
            named = f"{child.tag} {child.get('name')!r}" if child.get("name") else f"<{child.tag}>"
            inside = named if child.tag in ("link", "joint") else f"{named} of {where}"
            yield from _element_faults(child, inside)


def _pose_faults(pose: ET.Element, where: str) -> Iterator[str]:
    for attribute, harmless in (
        ("frame", ("",)),
        ("relative_to", ("", "__model__") if where.startswith("link") else ("",)),
        ("degrees", ("", "0", "false")),
        ("rotation_format", ("", "euler_rpy")),
    ):
        if pose.get(attribute, "") not in harmless:
            yield f'the <pose> of {where} has {attribute}="{pose.get(attribute)}"'


def _joint_faults(joint: ET.Element, links: set[str]) -> Iterator[str]:
    where, kind = f"joint {joint.get('name', '')!r}", joint.get("type", "")
    for end in ("parent", "child"):
        name = end_of(joint, end)
        if name not in links and not (name == WORLD and end == "parent"):
            yield f"the {end} {name!r} of {where} is not a link of the model"
    for tag in ("axis", "axis2")[: AXES.get(kind, 0)]:
        axis = joint.find(tag)
        if axis is None:
            yield f"{where} has no <{tag}>"
            continue
        if not any(sdf_numbers(axis, "xyz", "0 0 1")):
            yield f"the <{tag}> of {where} has no direction"
        frame = axis.find("xyz")
        spoken = "" if frame is None else frame.get("expressed_in", "")
        if spoken not in ("", "__model__"):
            yield f'the <xyz> of {where} has expressed_in="{spoken}"'
    if kind in ("universal", "ball") and any(
        sdf_numbers(axis.find("dynamics"), "spring_stiffness", "0")[:1] not in ([], [0.0])
        for axis in joint
        if axis.tag.startswith("axis")
    ):
        yield f"{where}, of type {kind}, has a spring"


def _tree_faults(model: ET.Element, names: set[str]) -> Iterator[str]:
    roots, world, tree, loops = roots_and_joints(model)
    if names and len(roots) != 1:
        listed = ", ".join(map(repr, roots)) or "no link"
        yield f"{listed} hang{'s' if len(roots) == 1 else ''} on no joint: it must be one root"
        return
    for joint in world:
        if end_of(joint, "child") not in roots:
            yield f"joint {joint.get('name', '')!r} ties a link to the world that is not the root"
    for joint in loops:
        kind = joint.get("type", "")
        if kind in JOINT_TYPES and kind not in LOOP_TYPES:
            yield (
                f"joint {joint.get('name', '')!r} closes a loop and is of type {kind!r}, not "
                f"{', '.join(LOOP_TYPES)}"
            )
    held, before = set(roots), 0
    while len(held) != before:
        before = len(held)
        held |= {end_of(j, "child") for j in tree if end_of(j, "parent") in held}
    lost = sorted(names - held)
    if lost:
        yield f"links {', '.join(map(repr, lost))} hang on one another and not on the root"
