"""Uncertainty: how far a model may be off, as tables of standard deviations by name.

    sigmas = 2.0                      # how far the worst case and the ellipses go
    [links."*"]
    mass_percent = 5.0
    com_m = 0.005
    [contacts.l_sole]
    yaw_deg = 1.0

Names may be patterns: ``"*hip*"`` is of every one that it fits, ``"*"`` of the rest, and neither of
what it has no meaning for.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from copsense.arrays import check_keys, finite_array, finite_number
from copsense.content import ByContent, FrozenMapping, plain
from copsense.errors import CopsenseError, InvalidInputError, ModelLoadError
from copsense.files import read_toml
from copsense.magnitudes import check_length
from copsense.robots.stance_tables import list_of, read_payload, table_of
from copsense.stance import Stance

LINK_KEYS = ("mass_percent", "mass_kg", "com_m")
JOINT_KEYS = ("offset_deg", "offset_m", "torque_Nm", "torque_N")
GROUND_KEYS = ("roll_deg", "pitch_deg")
CONTACT_KEYS = (
    "x_m",
    "y_m",
    "height_m",
    "roll_deg",
    "pitch_deg",
    "yaw_deg",
    "sole_x_m",
    "sole_y_m",
    "sole_yaw_deg",
    "friction",
)
_LONGEST = 1.0  # m: no robot is known so badly
_WIDEST = 45.0  # degrees
_TABLES = {"links": LINK_KEYS, "joints": JOINT_KEYS, "contacts": CONTACT_KEYS}
Table = Mapping[str, Mapping[str, Any]]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Uncertainty(ByContent):
    """How far a model may be off: standard deviations of independent errors.

    Attributes:
        links: link or pattern -> ``mass_percent`` or ``mass_kg``, and ``com_m`` (a number for each
            axis of the link, or three). A link that is fixed to another counts as part of it.
        joints: joint or pattern -> ``offset_deg`` (``offset_m`` of a slide), how far the joint
            truly stands from where its encoder has it, and ``torque_Nm`` (``torque_N``), a torque
            beside its motor's, as of friction in the gear.
        ground: ``roll_deg`` and ``pitch_deg`` of the slope of everything that the robot stands on,
            as `Plane.sloping` takes them.
        contacts: contact or pattern -> ``x_m``, ``y_m``, ``height_m``, ``roll_deg``, ``pitch_deg``
            and ``yaw_deg`` of where it stands, contact axes; ``sole_x_m``, ``sole_y_m`` and
            ``sole_yaw_deg`` of its sole on the link; and ``friction``, of its coefficient.
        payloads: tables of ``frame``, ``mass_kg`` and ``com_m``, as in a stance file; the mass is
            a standard deviation.
        sigmas: how many standard deviations ellipses and worst cases go.
    """

    links: Table = field(default_factory=dict)
    joints: Table = field(default_factory=dict)
    ground: Mapping[str, float] = field(default_factory=dict)
    contacts: Table = field(default_factory=dict)
    payloads: Sequence[Mapping[str, Any]] = ()
    sigmas: float = 2.0

    def __post_init__(self) -> None:
        """Check every number and own the tables.

        Raises:
            UnknownNameError: a key that its table does not have.
            InvalidInputError: a number that is not a standard deviation, or none at all.
        """
        number = finite_number(self.sigmas, "sigmas of an uncertainty", positive=True)
        object.__setattr__(self, "sigmas", number)
        for name, keys in _TABLES.items():
            tables = table_of(getattr(self, name), name)
            checked = {
                str(of): FrozenMapping(
                    _checked(table_of(table, f'{name}."{of}"'), keys, f'[{name}."{of}"]')
                )
                for of, table in tables.items()
            }
            object.__setattr__(self, name, FrozenMapping(checked))
        ground = _checked(table_of(self.ground, "ground"), GROUND_KEYS, "[ground]")
        object.__setattr__(self, "ground", FrozenMapping(ground))
        payloads = []
        given = list(self.payloads) if isinstance(self.payloads, tuple) else self.payloads
        for each in list_of(given, "payloads"):
            payload = read_payload(each)
            what = f"mass_kg of the payload at {payload['frame']!r}"
            _deviation(payload["mass"], what)
            payloads.append(
                FrozenMapping(
                    {
                        "frame": payload["frame"],
                        "mass_kg": float(payload["mass"]),
                        "com_m": payload["com"],
                    }
                )
            )
        object.__setattr__(self, "payloads", tuple(payloads))
        if not any((*self.links.values(), *self.joints.values(), *self.contacts.values())) and not (
            self.ground or self.payloads
        ):
            raise InvalidInputError(
                "an uncertainty says nothing that is uncertain. Give a table, such as "
                '[links."*"] with mass_percent = 5.0.'
            )

    @classmethod
    def default(cls, stance: Stance) -> Uncertainty:
        """What a careful laboratory knows of its robot and its floor, where it has a meaning.

        Masses to 5 %, centres of mass to 5 mm along each axis, encoders to 0.25 degrees, feet to
        2 mm and 0.5 degrees where they stand, the floor level to 0.5 degrees and even to 1 mm.

        Args:
            stance: the robot on its contacts; one that lives in a plane has no pitch.
        """
        planar = stance.robot.base_nv != 6
        ground = {k: v for k, v in DEFAULT["ground"].items() if not (planar and k == "pitch_deg")}
        return cls.from_dict({**DEFAULT, "ground": ground})

    @classmethod
    def from_dict(cls, data: object) -> Uncertainty:
        """The uncertainty that `to_dict` wrote, or a file holds.

        Raises:
            UnknownNameError: an unknown key.
            InvalidInputError: a value that is not a standard deviation.
        """
        table = table_of(data, "an uncertainty")
        check_keys(table, tuple(f.name for f in fields(cls)), "an uncertainty")
        for name in (*_TABLES, "ground"):
            inner = table_of(table.get(name, {}), name)
            for of, each in inner.items() if name in _TABLES else ():
                table_of(each, f'{name}."{of}"')
        list_of(table.get("payloads", []), "payloads")
        return cls(**table)

    @classmethod
    def read(cls, path: str | Path) -> Uncertainty:
        """Read a TOML file.

        Raises:
            ModelLoadError: no such file, or not TOML.
            UnknownNameError: a key that such a file does not have.
            InvalidInputError: a value that is not a standard deviation.
        """
        where, remedy = Path(path), 'Give a .toml file of standard deviations, or "default".'
        data = read_toml(where, "uncertainty", remedy, ModelLoadError)
        try:
            return cls.from_dict(data)
        except CopsenseError as error:
            error.add_note(f"It is in the uncertainty {where}.")
            raise

    def to_dict(self) -> dict[str, Any]:
        """Plain data, as `from_dict` reads it and a file holds it."""
        found: dict[str, Any] = {"sigmas": self.sigmas}
        for name in (*_TABLES, "ground"):
            found[name] = plain(getattr(self, name))
        found["payloads"] = [
            {**payload, "com_m": list(payload["com_m"])} for payload in self.payloads
        ]
        return {key: value for key, value in found.items() if value not in ({}, [])}

    def _fields(self) -> tuple[object, ...]:
        return tuple(getattr(self, each.name) for each in fields(self))

    def __repr__(self) -> str:
        """How much is said of what."""
        said = ", ".join(
            f"{name} {', '.join(found) or 'none'}"
            for name in ("links", "joints", "ground", "contacts")
            if (found := getattr(self, name))
        )
        loads = f"; {len(self.payloads)} payloads" if self.payloads else ""
        return f"Uncertainty({said or 'nothing else'}{loads}; {self.sigmas:g} standard deviations)"


DEFAULT: dict[str, Any] = {
    "links": {"*": {"mass_percent": 5.0, "com_m": 0.005}},
    "joints": {"*": {"offset_deg": 0.25}},
    "ground": {"roll_deg": 0.5, "pitch_deg": 0.5},
    "contacts": {"*": {"x_m": 0.002, "y_m": 0.002, "height_m": 0.001, "yaw_deg": 0.5}},
}


def _checked(table: Mapping[str, Any], keys: Sequence[str], where: str) -> dict[str, Any]:
    """A table with its numbers checked; of ``com_m`` three of them."""
    check_keys(table, keys, where)
    if "mass_percent" in table and "mass_kg" in table:
        raise InvalidInputError(f"{where} has mass_percent and mass_kg. Give one of them.")
    found: dict[str, Any] = {}
    for key, value in table.items():
        what = f"{key} in {where}"
        if key == "com_m" and not isinstance(value, int | float):
            each = finite_array(value, what, (3,), "standard deviations along x, y, z [m]").tolist()
            found[key] = tuple(_deviation(number, what) for number in each)
            continue
        number = _deviation(value, what)
        found[key] = (number,) * 3 if key == "com_m" else number
    for key, value in found.items():
        for number in value if isinstance(value, tuple) else (value,):
            if key.endswith("_m"):
                check_length(number, f"{key} in {where}", _LONGEST)
            if key.endswith("_deg") and number > _WIDEST:
                raise InvalidInputError(
                    f"{key} in {where} is {number:g} degrees. Give less than {_WIDEST:g}: what is "
                    "known worse is not known to first order."
                )
            if key == "mass_percent" and number >= 100:
                raise InvalidInputError(
                    f"{key} in {where} is {number:g}. Give less than 100 per cent of the mass."
                )
    return found


def _deviation(value: object, what: str) -> float:
    number = finite_number(value, what)
    if number < 0 or math.copysign(1.0, number) < 0:
        raise InvalidInputError(f"{what} is {number:g}. Give a standard deviation, zero or more.")
    return number
