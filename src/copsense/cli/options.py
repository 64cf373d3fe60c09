"""Options that several commands share, and how their values are read."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TypeVar

import click
from tqdm import tqdm

from copsense.errors import InvalidInputError, UnknownNameError

if TYPE_CHECKING:
    from copsense.contact import Contact
    from copsense.criterion import Criterion
    from copsense.limits import Limits
    from copsense.stance import Stance

F = TypeVar("F", bound=Callable[..., Any])


limits_option = click.option(
    "--limits",
    metavar="NAME=VALUE,...",
    help="Inequalities that the wrenches must respect, solved as a QP: normal-force [N], "
    "friction, sides, cop-margin [m], torsion [m, or cone], torque [N m, or model]. "
    "Those not named keep their default (normal-force=0, cop-margin=0, contacts' own "
    "friction); off switches one off. Example: friction=0.33,torque=model.",
)


def stance_options(command: F) -> F:
    """The robot, how it stands, and what it must respect."""
    options = [
        click.argument("robot"),
        click.option(
            "--contact",
            "contacts",
            multiple=True,
            metavar="FRAME[:KIND]",
            help="Contact frame; KIND is surface (default) or point. Repeatable; a preset "
            "has its own.",
        ),
        click.option(
            "--contact-at",
            type=click.Choice(["frame", "sole"]),
            help="Put surface contacts at the model's frame, or at the sole's bottom as the "
            "collision geometry shows it.",
        ),
        click.option(
            "--sole",
            metavar="X0:X1:Y0:Y1",
            help="Rectangle of every surface contact's sole in its contact frame [m], instead of "
            "the collision geometry's.",
        ),
        click.option(
            "--sole-height",
            type=float,
            metavar="M",
            help="Height of the contact plane over the model's frames, along its normal [m].",
        ),
        click.option(
            "--package-dir",
            "package_dirs",
            multiple=True,
            type=click.Path(file_okay=False),
            help="Folder in which package:// meshes are looked up. Repeatable.",
        ),
        click.option(
            "--posture",
            multiple=True,
            metavar="JOINT=DEG",
            help="Joint position that the posture stays nearest to [deg]. Repeatable.",
        ),
        click.option(
            "--base-yaw",
            type=float,
            metavar="DEG",
            help="Heading of the base [deg], so that the robot faces +x; a preset has its own.",
        ),
        click.option("--width", type=float, metavar="M", help="Distance between two feet [m]."),
        limits_option,
    ]
    return _with(options, command)


def criterion_options(command: F) -> F:
    """Which criteria share the load."""
    options = [
        click.option(
            "--criterion",
            "criteria",
            multiple=True,
            metavar="NAME",
            help="How the load is shared: minimum-wrench, minimum-torque, limit-weighted-torque, "
            "inertia-weighted-torque or minimum-tangential. Repeatable; default the first two.",
        ),
        click.option(
            "--characteristic-length",
            type=float,
            default=1.0,
            show_default=True,
            metavar="M",
            help="Length L [m] that makes moments comparable with forces in minimum-wrench.",
        ),
    ]
    return _with(options, command)


def _with(options: Sequence[Callable[[Any], Any]], command: F) -> F:
    for option in reversed(options):
        command = option(command)
    return command


def read_stance(
    robot: str,
    contacts: tuple[str, ...],
    contact_at: Any,
    sole: str | None,
    sole_height: float | None,
    package_dirs: tuple[str, ...],
    posture: tuple[str, ...],
    base_yaw: float | None,
    width: float | None,
) -> Stance:
    """The stance that the options of `stance_options` describe."""
    from copsense.robots import PRESETS, load_robot, load_stance

    if sole_height is not None:
        if contact_at == "sole":
            raise InvalidInputError(
                "--sole-height and --contact-at sole both say where the contacts are. Give one."
            )
        contact_at = "frame"  # moved by the height, and no farther
    # A preset is passed by name, so that its feet and posture come along.
    source = robot if robot in PRESETS else load_robot(robot, package_dirs=package_dirs)
    angles = {joint: math.radians(deg) for joint, deg in read_assignments(posture).items()}
    return load_stance(
        source,
        contacts=_read_contacts(robot, contacts, sole, sole_height),
        contact_at=contact_at,
        package_dirs=package_dirs,
        posture=angles,
        base_rpy=None if base_yaw is None else (0.0, 0.0, math.radians(base_yaw)),
        width=width,
    )


def _read_contacts(
    robot: str, texts: tuple[str, ...], sole: str | None, sole_height: float | None
) -> list[str | Contact] | None:
    """``FRAME[:KIND]`` options as contacts; a frame alone takes what its preset knows of it."""
    from dataclasses import replace

    from copsense.contact import COMPONENTS, Contact, rectangle
    from copsense.robots import PRESETS

    known = PRESETS[robot].contacts if robot in PRESETS else ()
    contacts: list[Contact] = [] if texts else list(known)
    for text in texts:
        frame, colon, kind = text.partition(":")
        if colon and kind not in COMPONENTS:
            raise UnknownNameError("kind of contact", kind, COMPONENTS)
        own = next((c for c in known if c.frame == frame), Contact(frame))
        contacts.append(replace(own, kind=kind) if colon else own)  # type: ignore[arg-type]
    described = sole is not None or sole_height is not None
    if described and contacts and all(c.kind == "point" for c in contacts):
        raise InvalidInputError(
            "--sole and --sole-height describe a sole, and every contact is a point. Leave them "
            "out, or give a surface contact: --contact FRAME:surface."
        )
    if sole is not None:
        polygon = rectangle(*_read_rectangle(sole))
        contacts = [replace(c, polygon=polygon) if c.kind != "point" else c for c in contacts]
    if sole_height is not None:
        if not math.isfinite(sole_height):
            raise InvalidInputError(f"--sole-height is {sole_height}. Give a finite height [m].")
        contacts = [_raised(c, sole_height) if c.kind != "point" else c for c in contacts]
    return list(contacts) or None


def _raised(contact: Contact, height: float) -> Contact:
    """The contact with its plane that high over the model's frame, along its own z."""
    from dataclasses import replace

    x, y, z = (float(c) * height for c in contact.rotation[:, 2])
    return replace(contact, offset=(x, y, z))


def _read_rectangle(text: str) -> tuple[tuple[float, float], tuple[float, float]]:
    try:
        x0, x1, y0, y1 = (float(number) for number in text.split(":"))
    except ValueError:
        raise InvalidInputError(
            f"the sole {text!r} is not understood. Give X0:X1:Y0:Y1 [m], such as "
            "-0.07:0.12:-0.045:0.05."
        ) from None
    if not (-math.inf < x0 < x1 < math.inf and -math.inf < y0 < y1 < math.inf):
        raise InvalidInputError(
            f"the sole {text!r} is empty or not finite. Give X0 < X1 and Y0 < Y1 [m]."
        )
    return (x0, x1), (y0, y1)


def read_assignments(
    texts: tuple[str, ...], form: str = "JOINT=DEGREES, such as l_knee=-20"
) -> dict[str, float]:
    """``NAME=NUMBER`` options as a dictionary; `form` tells whoever got one wrong how to write."""
    values = {}
    for text in texts:
        name, equals, number = text.partition("=")
        try:
            values[name] = float(number)
        except ValueError:
            equals = ""
        if not (name and equals):
            raise InvalidInputError(f"{text!r} is not understood. Give {form}.")
    return values


def read_range(text: str) -> tuple[float, float, int]:
    """``START:STOP:COUNT`` as numbers."""
    try:
        start, stop, count = text.split(":")
        return float(start), float(stop), int(count)
    except ValueError:
        raise InvalidInputError(
            f"the range {text!r} is not understood. Give START:STOP:COUNT, such as -0.07:0.07:201."
        ) from None


def read_limits(text: str | None) -> Limits | None:
    """The limits that ``--limits`` describes, or None."""
    from copsense.limits import Limits

    if text is None:
        return None
    names = {
        "normal-force": "normal_force",
        "friction": "friction",
        "sides": "friction_sides",
        "cop-margin": "cop_margin",
        "torsion": "torsion",
        "torque": "torque",
    }
    values: dict[str, Any] = {}
    for part in filter(None, text.split(",")):
        name, _, value = part.partition("=")
        if name in ("off", "none"):
            raise InvalidInputError(
                f"--limits {name} is no limit. Leave --limits out for none at all, or switch one "
                "off by name, such as friction=off."
            )
        if name not in names:
            raise UnknownNameError("limit", name, names)
        if names[name] in values:
            raise InvalidInputError(f"the limit {name} is given twice. Give it once.")
        values[names[name]] = _limit_value(name, value)
    return Limits(**values)


def _limit_value(name: str, value: str) -> float | int | str | None:
    if value == "off" and name != "sides":
        return None
    if value in {
        "friction": ("contact",),
        "torsion": ("contact", "cone"),
        "torque": ("model",),
    }.get(name, ()):
        return value
    try:
        return int(value) if name == "sides" else float(value)
    except ValueError:
        raise InvalidInputError(
            f"the limit {name}={value!r} is no number. Write, say, {name}=8 or {name}=off."
        ) from None


def read_criteria(names: tuple[str, ...], characteristic_length: float) -> list[Criterion]:
    """The criteria named, or the paper's two."""
    from copsense.criterion import criterion_named

    chosen = dict.fromkeys(names or ("minimum-wrench", "minimum-torque"))
    return [criterion_named(name, characteristic_length) for name in chosen]


@contextmanager
def progress_bar(total: int, what: str) -> Iterator[Callable[[int], object]]:
    """A bar with rate and time left on standard error, where somebody is there to see it."""
    with tqdm(total=total, desc=what, unit="posture", disable=None, leave=False) as bar:
        yield bar.update


def echo_json(value: Mapping[str, Any]) -> None:
    """Print JSON; infinities, which JSON lacks, become null."""
    click.echo(json.dumps(_finite(value), indent=2, allow_nan=False))


def _finite(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(k): _finite(v) for k, v in value.items()}
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_finite(v) for v in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
