"""Description: the text a robot is read from, checked before a parser guesses what it means."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from copsense.errors import ModelLoadError
from copsense.listing import first_few, listed
from copsense.sdf import sdf_faults, sdf_notes
from copsense.urdf import (
    strip_numbers,
    take_out_xacro,
    urdf_faults,
    urdf_notes,
    without_namespace,
    xacro_left,
)
from copsense.written_base import take_out_base
from copsense.xml_numbers import wrong_number

Language = Literal["urdf", "mjcf", "sdf"]

_PREFIXES = {
    "xacro": 'xmlns:xacro="http://www.ros.org/wiki/xacro"',
    "drake": 'xmlns:drake="http://drake.mit.edu"',
}
_ROOTS: dict[Language, str] = {"urdf": "robot", "mjcf": "mujoco", "sdf": "sdf"}
# Attributes of an MJCF's bodies, inertials and joints that hold numbers; the parser reads a word as
# whatever comes next in memory or as zero.
_MJCF_NUMBERS = {"pos": 3, "quat": 4, "axis": 3, "mass": 1, "diaginertia": 3, "fullinertia": 6}


@dataclass(frozen=True)
class Description:
    """The text a robot was read from, kept so that its collision geometry can be read later.

    Attributes:
        text: the XML.
        language: ``"urdf"``, ``"mjcf"`` or ``"sdf"``.
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
        ModelLoadError: the file is missing, or is not a valid URDF, MJCF or SDF; the message
            says why.
    """
    kind = language.upper() if language else "URDF, MJCF or SDF"
    is_text = isinstance(source, str) and source.lstrip("\ufeff \t\r\n").startswith("<")
    if not isinstance(source, str | Path):
        raise ModelLoadError(
            f"{source!r} is not a path. Give the path of a {kind} file, or in Python its text."
        )
    path = None if is_text else Path(source)
    if path is not None and not is_file(path):
        what = f"{path} is a folder" if is_folder(path) else f"no file at {str(source)[:300]!r}"
        raise ModelLoadError(f"{what}. Give the path of a {kind} file (in Python also its text).")
    check_package_dirs(package_dirs)
    name = str(path or "the text given")
    text, document = _parse(source if path is None else path, name, kind)
    changed = without_namespace(document)
    found = next((known for known, tag in _ROOTS.items() if tag == document.tag), None)
    if found is None or found != (language or found):
        starts = [
            f"{known.upper()} with <{_ROOTS[known]}>"
            for known in ([language] if language else _ROOTS)
        ]
        hint = f"Use load_robot or Robot.from_{found} for this one." if found else "Give such one."
        raise ModelLoadError(f"{name} starts with <{document.tag}>, {listed(starts)}. {hint}")
    beside: tuple[str, ...] = ()
    xacro = xacro_left(document) if found == "urdf" else ()
    if xacro:
        beside = take_out_xacro(document)
        if inside := xacro_left(document):
            raise _unexpanded(name, inside)
    faults = list(_FAULTS[found](document))
    if faults and xacro:
        raise _unexpanded(name, xacro)  # what is missing is in there
    if faults:
        more = f" (and {len(faults) - 5} more)" if len(faults) > 5 else ""
        raise ModelLoadError(
            f"{name} is not a valid {found.upper()}: {'; '.join(faults[:5])}{more}. "
            "Correct the file."
        )
    notes: tuple[str, ...] = ()
    if found == "urdf":
        changed |= strip_numbers(document)
        notes = (*beside, *take_out_base(document), *urdf_notes(document))
    elif found == "sdf":
        notes = tuple(sdf_notes(document))
    if changed or notes:
        text = ET.tostring(document, encoding="unicode")
    return Description(text, found, tuple(map(str, package_dirs)), path, notes, tuple(frames), root)


def check_package_dirs(folders: Iterable[str | Path]) -> None:
    """Reject a folder for meshes that is not there.

    Raises:
        ModelLoadError: there is no such folder.
    """
    for folder in folders:
        if not is_folder(Path(folder)):
            raise ModelLoadError(
                f"there is no folder {str(folder)!r} to look meshes up in. Give folders that are "
                "there as package_dirs (--package-dir)."
            )


def _parse(source: str | Path, name: str, kind: str) -> tuple[str, ET.Element]:
    """The text of a file, or a text given, and its XML; in UTF-8 or the encoding it declares.

    Raises:
        ModelLoadError: it cannot be read, or is not XML.
    """
    text = ""
    try:
        if isinstance(source, str):
            text = source.lstrip("\ufeff \t\r\n")
            return text, ET.fromstring(text)
        raw = source.read_bytes()
        try:
            text = raw.decode("utf-8-sig").lstrip()
            return text, ET.fromstring(text)
        except UnicodeDecodeError:
            root = ET.fromstring(raw)
            return ET.tostring(root, encoding="unicode"), root
    except OSError as error:
        raise ModelLoadError(f"{name} cannot be read: {error}. Choose a readable file.") from None
    except (LookupError, ValueError, ET.ParseError) as error:
        for prefix, space in _PREFIXES.items():
            # Elements of a prefix that URDF's parsers do not ask to be declared.
            if "unbound prefix" in str(error) and space not in text and f"<{prefix}:" in text:
                declared = re.sub(r"<robot(?=\s)", f"<robot {space}", text, count=1)
                if declared != text:
                    return _parse(declared, name, kind)
        raise ModelLoadError(
            f"{name} is not XML in UTF-8 or the encoding that it declares: {error}. Give a {kind} "
            "file that is whole."
        ) from None


def _unexpanded(name: str, left: tuple[str, ...]) -> ModelLoadError:
    return ModelLoadError(
        f"{name} is a xacro file that was not expanded: it holds {first_few(left, 3)}, "
        "which no URDF parser reads. Expand it with xacro first: xacro FILE > robot.urdf."
    )


def _mjcf_faults(root: ET.Element) -> Iterator[str]:
    for body in root.iterfind("worldbody//body"):
        where = f"body {body.get('name', '')!r}"
        for element in [body, *body.findall("inertial"), *body.findall("joint")]:
            inside = where if element is body else f"{element.tag} of {where}"
            for attribute, count in _MJCF_NUMBERS.items():
                yield from wrong_number(element, attribute, count, inside)


_FAULTS: dict[Language, Callable[[ET.Element], Iterator[str]]] = {
    "urdf": urdf_faults,
    "mjcf": _mjcf_faults,
    "sdf": sdf_faults,
}
