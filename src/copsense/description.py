"""Description: the text a robot is read from, checked before a parser guesses what it means."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from copsense.errors import ModelLoadError

Language = Literal["urdf", "mjcf"]

_ROOTS: dict[Language, str] = {"urdf": "robot", "mjcf": "mujoco"}
_JOINT_TYPES = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")
# How many numbers an attribute of a URDF's element holds.
_URDF_NUMBERS = {
    "origin": {"xyz": 3, "rpy": 3},
    "axis": {"xyz": 3},
    "mass": {"value": 1},
    "inertia": dict.fromkeys(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), 1),
    "limit": dict.fromkeys(("lower", "upper", "effort", "velocity"), 1),
}
# Attributes of an MJCF's bodies, inertials and joints that hold numbers; the parser reads a word as
# whatever comes next in memory or as zero.
_MJCF_NUMBERS = {"pos": 3, "quat": 4, "axis": 3, "mass": 1, "diaginertia": 3, "fullinertia": 6}


@dataclass(frozen=True)
class Description:
    """The text a robot was read from, kept so that its collision geometry can be read later.

    Attributes:
        text: the XML.
        language: ``"urdf"`` or ``"mjcf"``.
        package_dirs: folders in which ``package://`` meshes are looked up.
        path: the file the text came from, if any.
        notes: what the text says and is not used, a sentence each; `Robot.notes` holds them.
        frames: names of bodies, sites or joints of the robot that is meant, where an MJCF holds
            several things.
        root: name of a body of the robot that is meant, or None.
    """

    text: str = field(repr=False)
    language: Language
    package_dirs: tuple[str, ...] = ()
    path: Path | None = None
    notes: tuple[str, ...] = ()
    frames: tuple[str, ...] = ()
    root: str | None = None


def is_file(path: Path) -> bool:
    """Whether a path names a file; a name that no file can have (too long) does not."""
    try:
        return path.is_file()
    except OSError:
        return False


def is_folder(path: Path) -> bool:
    """Whether a path names a folder."""
    try:
        return path.is_dir()
    except OSError:
        return False


def load_description(
    source: str | Path,
    language: Language | None = None,
    package_dirs: Iterable[str | Path] = (),
    *,
    frames: Iterable[str] = (),
    root: str | None = None,
) -> Description:
    """Read a description and check what its parser would ignore without a word.

    Args:
        source: path of the file, or the XML itself.
        language: what it must be; None takes what its first element says.
        package_dirs: folders that hold the packages of ``package://`` meshes.
        frames: as of `Description`.
        root: as of `Description`.

    Raises:
        ModelLoadError: the file is missing, or is not a valid URDF or MJCF; the message says why.
    """
    kind = language.upper() if language else "URDF or MJCF"
    is_text = isinstance(source, str) and source.lstrip("\ufeff \t\r\n").startswith("<")
    if not isinstance(source, str | Path):
        raise ModelLoadError(
            f"{source!r} is not a path. Give the path of a {kind} file, or its text."
        )
    path = None if is_text else Path(source)
    if path is not None and not is_file(path):
        what = f"{path} is a folder" if is_folder(path) else f"no file at {str(source)[:300]!r}"
        raise ModelLoadError(f"{what}. Give the path of a {kind} file, or its text.")
    name = str(path or "the text given")
    try:
        text = (
            str(source).lstrip("\ufeff") if path is None else path.read_text(encoding="utf-8-sig")
        )
        document = ET.fromstring(text.encode())
    except OSError as error:
        raise ModelLoadError(f"{name} cannot be read: {error}. Choose a readable file.") from None
    except (UnicodeDecodeError, ET.ParseError) as error:
        raise ModelLoadError(
            f"{name} is not XML in UTF-8: {error}. Give a {kind} file that is whole."
        ) from None
    found = next((known for known, tag in _ROOTS.items() if tag == document.tag), None)
    if found is None or found != (language or found):
        starts = " and ".join(
            f"{known.upper()} with <{_ROOTS[known]}>"
            for known in ([language] if language else _ROOTS)
        )
        hint = f"Use load_robot or Robot.from_{found} for this one." if found else "Give such one."
        raise ModelLoadError(f"{name} starts with <{document.tag}>, {starts}. {hint}")
    faults = list(_urdf_faults(document) if found == "urdf" else _mjcf_faults(document))
    if faults:
        more = f" (and {len(faults) - 5} more)" if len(faults) > 5 else ""
        raise ModelLoadError(
            f"{name} is not a valid {found.upper()}: {'; '.join(faults[:5])}{more}. "
            "Correct the file."
        )
    return Description(
        text,
        found,
        tuple(str(folder) for folder in package_dirs),
        path,
        frames=tuple(frames),
        root=root,
    )


def _urdf_faults(root: ET.Element) -> Iterator[str]:
    """What the parser rejects without saying where, or takes for something else."""
    links, joints = root.findall("link"), root.findall("joint")
    names = [link.get("name", "") for link in links]
    if not root.get("name"):
        yield "the <robot> has no name"
    if not links:
        yield "it has no link"
    for kind, elements in (("link", links), ("joint", joints)):
        for name, times in Counter(e.get("name", "") for e in elements).items():
            if not name:
                yield f"a {kind} has no name"
            elif times > 1:
                yield f"{times} {kind}s are named {name!r}"
    children = []
    for joint in joints:
        where = f"joint {joint.get('name', '')!r}"
        if joint.get("type") not in _JOINT_TYPES:
            yield f"{where} is of type {joint.get('type')!r}, not {', '.join(_JOINT_TYPES)}"
        for end in ("parent", "child"):
            element = joint.find(end)
            link = None if element is None else element.get("link")
            if link not in names:
                yield f"the {end} link {link!r} of {where} does not exist"
            elif end == "child":
                children.append(link)
        yield from _wrong_numbers(joint, where)
        axis = joint.find("axis")
        if axis is not None and joint.get("type") not in ("fixed", "floating"):
            numbers = _numbers(axis.get("xyz", "1 0 0"))
            if numbers and not any(numbers):
                yield f"the axis of {where} has no direction"
    for body in links:
        where, inertial = f"link {body.get('name', '')!r}", body.find("inertial")
        if inertial is not None:
            yield from _wrong_numbers(inertial, where)
            mass = inertial.find("mass")
            numbers = None if mass is None else _numbers(mass.get("value", ""))
            if numbers and numbers[0] < 0:
                yield f"the mass of {where} is negative, {numbers[0]:g} kg"
    for child, count in Counter(children).items():
        if count > 1:
            yield f"link {child!r} is the child of {count} joints: it must be a tree"
    if links and not set(names) - set(children):
        yield "every link is the child of another: it must be a tree with one root"


def _mjcf_faults(root: ET.Element) -> Iterator[str]:
    if root.find("worldbody/body") is None and root.find(".//include") is None:
        yield "its <worldbody> has no <body>"
    for body in root.iterfind("worldbody//body"):
        where = f"body {body.get('name', '')!r}"
        for element in [body, *body.findall("inertial"), *body.findall("joint")]:
            inside = where if element is body else f"{element.tag} of {where}"
            for attribute, count in _MJCF_NUMBERS.items():
                yield from _wrong_number(element, attribute, count, inside)


def _wrong_numbers(parent: ET.Element, where: str) -> Iterator[str]:
    for element in parent:
        for attribute, count in _URDF_NUMBERS.get(element.tag, {}).items():
            yield from _wrong_number(element, attribute, count, f"<{element.tag}> of {where}")


def _wrong_number(element: ET.Element, attribute: str, count: int, where: str) -> Iterator[str]:
    text = element.get(attribute)
    if text is None:
        return
    numbers = _numbers(text)
    if numbers is None or len(numbers) != count:
        need = "one finite number" if count == 1 else f"{count} finite numbers"
        yield f"{attribute}={text!r} in the {where} is not {need}"


def _numbers(text: str) -> list[float] | None:
    """The finite numbers in a text, or None where it holds anything else."""
    try:
        numbers = [float(word) for word in text.split()]
    except ValueError:
        return None
    return numbers if all(map(math.isfinite, numbers)) else None
