"""URDF: its faults, what a parser drops from it, and a base that is written into it."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections import Counter, defaultdict
from collections.abc import Iterator

from copsense.listing import listed
from copsense.xml_names import wrong_names
from copsense.xml_numbers import read_numbers, wrong_number

_JOINT_TYPES = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")
_SHAPES = ("box", "cylinder", "sphere", "mesh")
_NAMES = ("name", "link", "joint", "type", "filename")
# How many numbers an attribute of an element holds.
_NUMBERS = {
    "origin": {"xyz": 3, "rpy": 3},
    "axis": {"xyz": 3},
    "mass": {"value": 1},
    "inertia": dict.fromkeys(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), 1),
    "limit": dict.fromkeys(("lower", "upper", "effort", "velocity"), 1),
    "mimic": dict.fromkeys(("multiplier", "offset"), 1),
    "link1": {"xyz": 3, "rpy": 3},
    "link2": {"xyz": 3, "rpy": 3},
}
# Attributes without which the parser drops the element, or rejects the file.
_NEEDED = {"mass": ("value",), "limit": ("effort", "velocity")}


def without_namespace(root: ET.Element) -> bool:
    """Take the default namespace off every name, as URDF's parser does; whether there was one."""
    space, brace, _ = root.tag.partition("}")
    if not brace:
        return False
    for element in root.iter():
        if isinstance(element.tag, str):
            element.tag = element.tag.removeprefix(space + brace)
    return True


def strip_numbers(root: ET.Element) -> bool:
    """Take the white space off numbers, behind which the parser drops them; whether there was any.

    It drops an ``<inertial>`` whose mass is ``"1.2 "``, and with it the mass.
    """
    found = False
    for element in root.iter():
        for key, value in element.items():
            if value != value.strip() and key not in _NAMES and read_numbers(value):
                element.set(key, value.strip())
                found = True
    return found


def xacro_left(root: ET.Element) -> tuple[str, ...]:
    """What of xacro a file still holds: elements, and attributes with ``${...}`` or ``$(...)``."""
    found = []
    for element in root.iter():
        if name := _xacro_name(element):
            found.append(name)
        for key, value in element.items():
            if "${" in value or "$(" in value:
                found.append(f"{key}={value!r}")
    return tuple(dict.fromkeys(found))


def take_out_xacro(root: ET.Element) -> tuple[str, ...]:
    """Take out the xacro that stands beside links and joints, which URDF's parser passes over.

    Returns:
        A note that says what was taken out; none where nothing was.
    """
    beside = [element for element in root if _xacro_name(element)]
    for element in beside:
        root.remove(element)
    if not beside:
        return ()
    names = listed(list(dict.fromkeys(map(_xacro_name, beside))))
    verb = "is" if len(beside) == 1 else "are"
    return (
        f"{names} {verb} xacro that was not expanded, and left out: links and joints that it would "
        "add are not there. If there are any, expand the file first: xacro FILE > robot.urdf.",
    )


def _xacro_name(element: ET.Element) -> str:
    """How a file writes an element of xacro; empty for another."""
    space, _, name = str(element.tag).rpartition("}")
    return f"<xacro:{name}>" if "xacro" in space else ""


def urdf_faults(root: ET.Element) -> Iterator[str]:
    """What the parser rejects without saying where, drops, or takes for something else."""
    links, joints = root.findall("link"), root.findall("joint")
    names = [link.get("name", "") for link in links]
    if not root.get("name"):
        yield "the <robot> has no name"
    if not links:
        yield "it has no link"
    yield from wrong_names("link", links)
    yield from wrong_names("joint", joints)
    for joint in joints:
        yield from _joint_faults(joint, names)
    for body in links:
        yield from _inertial_faults(body)
    yield from _mimic_faults(joints)
    for element in root:
        if isinstance(element.tag, str) and element.tag.rpartition("}")[2] == "loop_joint":
            yield from _loop_faults(element, names)
    yield from _tree_faults(names, joints)


def _mimic_faults(joints: list[ET.Element]) -> Iterator[str]:
    leaders = {
        joint.get("name", ""): mimic.get("joint", "")
        for joint in joints
        if (mimic := joint.find("mimic")) is not None
    }
    names = {joint.get("name", "") for joint in joints}
    for follower, leader in leaders.items():
        if leader not in names:
            yield f"joint {follower!r} mimics {leader!r}, which is not a joint of the file"
    for follower in leaders:
        chain = [follower]
        while chain[-1] in leaders and leaders[chain[-1]] not in chain:
            chain.append(leaders[chain[-1]])
        if leaders.get(chain[-1]) == follower:
            yield f"joint {follower!r} mimics itself" + (
                f" through {', '.join(map(repr, chain[1:]))}" if chain[1:] else ""
            )
            return


def _loop_faults(loop: ET.Element, links: list[str]) -> Iterator[str]:
    where, ends = f"loop joint {loop.get('name', '')!r}", loop_ends(loop)
    if len(ends) != 2:
        yield f"{where} has {len(ends)} of <link1> and <link2>, not 2"
    for end in ends:
        if end.get("link") not in links:
            yield f"the link {end.get('link')!r} of {where} does not exist"
    yield from _wrong_numbers(loop, where)
    axis = loop.find("axis")
    numbers = read_numbers(axis.get("xyz", "1 0 0")) if axis is not None else ()
    if numbers and not any(numbers):
        yield f"the axis of {where} has no direction"


def loop_ends(loop: ET.Element) -> list[ET.Element]:
    """The two ends of a loop joint; some files call both of them ``link1``."""
    return [end for end in loop if end.tag in ("link1", "link2")]


def _joint_faults(joint: ET.Element, links: list[str]) -> Iterator[str]:
    where, kind = f"joint {joint.get('name', '')!r}", joint.get("type")
    if kind not in _JOINT_TYPES:
        yield f"{where} is of type {kind!r}, not {', '.join(_JOINT_TYPES)}"
    for end in ("parent", "child"):
        if _end(joint, end) not in links:
            yield f"the {end} link {_end(joint, end)!r} of {where} does not exist"
    yield from _wrong_numbers(joint, where)
    axis = joint.find("axis")
    if axis is not None and kind not in ("fixed", "floating"):
        numbers = read_numbers(axis.get("xyz", "1 0 0"))
        if numbers and not any(numbers):
            yield f"the axis of {where} has no direction"
    if kind in ("revolute", "prismatic"):
        if joint.find("limit") is None:
            other = ", or make it continuous" if kind == "revolute" else ""
            yield (
                f"{where} is {kind} and has no <limit>: give it one with lower, upper, effort and "
                f"velocity{other}"
            )
        yield from _missing(joint, "limit", where)


def _inertial_faults(body: ET.Element) -> Iterator[str]:
    where, inertial = f"link {body.get('name', '')!r}", body.find("inertial")
    if inertial is None:
        return
    yield from _wrong_numbers(inertial, where)
    mass = inertial.find("mass")
    if mass is None:
        yield (
            f"the <inertial> of {where} has no <mass>, so that its mass would be lost: give it, or "
            "leave the <inertial> out of a link without mass"
        )
        return
    yield from _missing(inertial, "mass", where)
    numbers = read_numbers(mass.get("value", ""))
    if numbers and numbers[0] < 0:
        yield f"the mass of {where} is negative, {numbers[0]:g} kg"


def _tree_faults(names: list[str], joints: list[ET.Element]) -> Iterator[str]:
    children = [child for j in joints if (child := _end(j, "child")) in names]
    for child, count in Counter(children).items():
        if count > 1:
            yield f"link {child!r} is the child of {count} joints: it must be a tree"
    roots = [name for name in names if name not in children]
    if names and not roots:
        yield "every link is the child of another: it must be a tree with one root"
    elif len(roots) > 1:
        yield (
            f"links {', '.join(map(repr, roots))} are the child of no joint: it must be a tree "
            "with one root, so join them or remove those that do not belong to the robot"
        )
    elif roots:
        held = _below(roots[0], joints)
        lost = [name for name in names if name not in held]
        if lost:
            yield f"links {', '.join(map(repr, lost))} hang on one another and not on the root"


def urdf_notes(root: ET.Element) -> Iterator[str]:
    """What the parser leaves out of a file without faults, a sentence each."""
    for body in root.findall("link"):
        where, inertial = f"link {body.get('name', '')!r}", body.find("inertial")
        if inertial is not None and inertial.find("inertia") is None:
            yield f"The <inertial> of {where} has no <inertia>: its mass is taken as a point."
        for collision in body.findall("collision"):
            shapes = [shape.tag for shape in collision.findall("geometry/*")]
            if not set(shapes) & set(_SHAPES):
                what = ", ".join(f"<{shape}>" for shape in shapes) or "nothing"
                yield (
                    f"A collision shape of {where} is left out: its <geometry> holds {what}, not "
                    f"{', '.join(_SHAPES)}."
                )


def _wrong_numbers(parent: ET.Element, where: str) -> Iterator[str]:
    for element in parent:
        for attribute, count in _NUMBERS.get(element.tag, {}).items():
            yield from wrong_number(element, attribute, count, f"<{element.tag}> of {where}")


def _missing(parent: ET.Element, tag: str, where: str) -> Iterator[str]:
    element = parent.find(tag)
    if element is not None:
        for attribute in _NEEDED[tag]:
            if element.get(attribute) is None:
                yield f"the <{tag}> of {where} has no {attribute}"


def _end(joint: ET.Element, end: str) -> str | None:
    """The link at a joint's ``"parent"`` or ``"child"`` end."""
    element = joint.find(end)
    return None if element is None else element.get("link")


def _below(link: str, joints: list[ET.Element]) -> set[str]:
    """A link and all that hangs on it."""
    children = defaultdict(list)
    for joint in joints:
        if (child := _end(joint, "child")) is not None:
            children[_end(joint, "parent")].append(child)
    held, waiting = {link}, [link]
    while waiting:
        new = set(children[waiting.pop()]) - held
        held |= new
        waiting += new
    return held
