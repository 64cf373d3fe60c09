"""Limits: what the ground and the motors allow, as rows a' f <= b on the stacked contact forces."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cache, cached_property, lru_cache
from typing import Any, Literal

import numpy as np
from jaxtyping import Float, Int

from copsense.arrays import array_property, check_type, finite_number, owned, read_only
from copsense.contact import Contact, edge_row
from copsense.content import ByContent, ShortRepr, own, plain, show
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.load_problem import LoadProblem
from copsense.magnitudes import doubt_friction
from copsense.polygon import Polygon
from copsense.robot import Robot
from copsense.stance import Stance, check_stance
from copsense.wrench_cone import unit_cone

_ROUNDING = 1e-9  # m
_CONE_VERTICES = 24  # a sole with more vertices is too fine for its exact wrench cone

_SHAPES = ("friction_sides",)  # fields of `Limits` that limit nothing themselves
_FOR_EACH = ("normal_force", "friction", "cop_margin")  # those that may be a mapping of contacts
# What a limit may be but a number.
LIMIT_WORDS: dict[str, tuple[str, ...]] = {
    "friction": ("contact",),
    "torsion": ("contact", "cone"),
    "torque": ("model",),
}

TorqueLimits = Literal["model"] | Mapping[str, float] | float


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Limits(ByContent):
    """What contact wrenches and torques must respect; None switches a limit off.

    Limits are given by keyword; they compare and hash by content. The first three may be a mapping,
    contact's name -> value; a contact that it does not name is not limited so.

    Attributes:
        normal_force: least normal force of every contact [N]; in a mapping negative where a
            contact may pull, such as a hand that grips.
        friction: Coulomb coefficient of every contact; ``"contact"`` takes the contacts' own and
            leaves those without one unlimited; None switches friction off.
        friction_sides: sides of the pyramid inscribed in the friction cone, at least 3.
        cop_margin: how far inside the sole's edges the centre of pressure must stay [m].
        torsion: torsional coefficient [m], ``|m_z| <= coefficient f_z``;
            ``"contact"`` takes the contacts' own; ``"cone"`` the exact wrench cone of the sole
            (moments that the sole's friction can carry, Caron et al. 2015), which contains the
            friction and centre-of-pressure limits too; None switches it off.
        torque: ``"model"`` for the model's effort limits, a number for every joint, or joint ->
            limit [Nm]; None switches it off. Placeholders of the model (see
            `Robot.effort_limits`) do not count as limits: `torque_placeholders` names them.
    """

    normal_force: float | Mapping[str, float] | None = 0.0
    friction: float | Mapping[str, float] | Literal["contact"] | None = "contact"
    friction_sides: int = 8
    cop_margin: float | Mapping[str, float] | None = 0.0
    torsion: float | Literal["contact", "cone"] | None = "contact"
    torque: TorqueLimits | None = None

    def __post_init__(self) -> None:
        """Own the torque limits; reject numbers that limit nothing or everything."""
        given = self.torque
        for flag in given.values() if isinstance(given, Mapping) else (given,):
            if isinstance(flag, bool | np.bool_):
                raise InvalidInputError(f"a torque limit is {flag}. Give a number [Nm], or None.")
        object.__setattr__(self, "torque", own(self.torque))
        for name in (each for each in _limiting() if each != "torque"):
            value = getattr(self, name)
            if isinstance(value, str):
                allowed = LIMIT_WORDS.get(name, ())
                if value not in allowed:
                    raise UnknownNameError(f"{name} limit", value, allowed)
            elif isinstance(value, Mapping) and name in _FOR_EACH:
                each = {contact: _bound(name, bound, contact) for contact, bound in value.items()}
                object.__setattr__(self, name, own(each))
            elif value is not None:
                object.__setattr__(self, name, _bound(name, value))
        sides: object = self.friction_sides
        number = float(sides) if isinstance(sides, int | float | np.integer) else float("nan")
        if not (number >= 3 and number.is_integer()):
            raise InvalidInputError(
                f"a friction pyramid has a whole number of sides, 3 or more; got "
                f"{self.friction_sides}."
            )
        object.__setattr__(self, "friction_sides", int(number))
        if isinstance(self.torque, str):
            if self.torque != "model":
                raise UnknownNameError("torque limit", self.torque, ("model",))
        elif self.torque is not None:
            given = (
                self.torque if isinstance(self.torque, Mapping) else {"every joint": self.torque}
            )
            for joint, value in given.items():
                if not (isinstance(value, int | float) and value >= 0):
                    raise InvalidInputError(
                        f"torque limits must be non-negative numbers [Nm], got {value} for {joint}."
                    )

    def _fields(self) -> tuple[object, ...]:
        return tuple(getattr(self, each.name) for each in fields(self))

    def __repr__(self) -> str:
        """Every limit; of many torque limits the first few."""
        shown = (
            f"{name}={show(value) if isinstance(value, dict) else repr(value)}"
            for name, value in self.to_dict().items()
        )
        return f"Limits({', '.join(shown)})"

    def to_dict(self) -> dict[str, Any]:
        """Plain data of every field, for JSON or TOML: `from_dict` reads it back."""
        return {each.name: plain(getattr(self, each.name)) for each in fields(self)}

    @classmethod
    def from_dict(cls, data: object) -> Limits:
        """The limits that `to_dict` wrote; a field that is missing has its default.

        Raises:
            InvalidInputError: not a table of limits, or a value that limits nothing.
            UnknownNameError: an unknown key.
        """
        if not isinstance(data, Mapping):
            raise InvalidInputError(
                f"limits in a file are a table, as Limits.to_dict() writes it; this is {data!r}."
            )
        known = tuple(each.name for each in fields(cls))
        for key in data:
            if key not in known:
                raise UnknownNameError("limit", str(key), known)
        return cls(**data)

    @property
    def any(self) -> bool:
        """Whether anything is limited."""
        return any(getattr(self, name) is not None for name in _limiting())


def _limiting() -> Iterator[str]:
    """The fields of `Limits` that limit something."""
    return (each.name for each in fields(Limits) if each.name not in _SHAPES)


# Each limit as --limits names it -> its attribute of `Limits`.
LIMIT_NAMES = {
    {"friction_sides": "sides"}.get(each.name, each.name.replace("_", "-")): each.name
    for each in fields(Limits)
}


def _bound(name: str, value: object, contact: str = "") -> float:
    """A limit's number; only the normal force of a named contact may be negative."""
    what = f"limit {name}" + (f" of contact {contact!r}" if contact else "")
    number = finite_number(value, what)
    if number < 0 and not (contact and name == "normal_force"):
        named = " A contact that may pull is named: {contact: value}." * (name == "normal_force")
        raise InvalidInputError(
            f"{what} must be a non-negative number or None, got {value}.{named}"
        )
    if name == "friction":
        doubt_friction(number, what)
    return number


def _of(limit: float | Mapping[str, float] | None, contact: Contact) -> float | None:
    """What a limit is for one contact."""
    return limit.get(contact.name) if isinstance(limit, Mapping) else limit


def friction_of(contact: Contact, limits: Limits) -> float | None:
    """The coefficient of friction that limits give a contact; None where it is not limited."""
    if isinstance(limits.friction, str):
        return contact.friction
    return _of(limits.friction, contact)


NO_LIMITS = Limits(normal_force=None, friction=None, cop_margin=None, torsion=None)


@dataclass(frozen=True, eq=False, repr=False)
class LimitRows(ShortRepr):
    """Limits at a stance. Contact rows are constant along a path, torque limits are not.

    Attributes:
        matrix: A (r, m) of the contact rows, A f <= bound, over stacked forces.
        bound: (r,).
        names: what each row limits, such as ``"l_sole: CoP at the +y edge"``.
        contacts: index of the contact of each row (r,).
        kinds: ``"normal force"``, ``"friction"``, ``"cop"``, ``"torsion"`` or ``"wrench cone"``.
        torque: limit of the size of each joint's torque (n,) [Nm]; infinite where there is none.
        joints: name of each of these joints (n,).
        normals: row of the stacked forces that a centre of pressure is under, its contact's normal
            force; -1 for any other limit (r,).
    """

    matrix: Float[np.ndarray, "r m"]
    bound: Float[np.ndarray, " r"]
    names: tuple[str, ...]
    contacts: tuple[int, ...]
    kinds: tuple[str, ...]
    torque: Float[np.ndarray, " n"]
    joints: tuple[str, ...]
    normals: Int[np.ndarray, " r"]

    @array_property
    def joint(self) -> Int[np.ndarray, " k"]:
        """Joint of each torque row (k,): two rows, s tau <= t, for each joint with a limit."""
        return np.repeat(np.flatnonzero(np.isfinite(self.torque)), 2)

    @array_property
    def sign(self) -> Float[np.ndarray, " k"]:
        """The sign s of each torque row (k,): +1, -1 in turn."""
        return np.tile([1.0, -1.0], len(self.joint) // 2)

    @cached_property
    def torque_names(self) -> tuple[str, ...]:
        """What each torque row limits (k,)."""
        return tuple(f"torque of {self.joints[i]}" for i in self.joint)

    @cached_property
    def all_names(self) -> tuple[str, ...]:
        """What each row of `over_forces` limits (r + k,)."""
        return self.names + self.torque_names

    @cached_property
    def all_kinds(self) -> tuple[str, ...]:
        """The kind of each row of `over_forces` (r + k,)."""
        return self.kinds + ("torque",) * len(self.joint)

    def excess(self, problem: LoadProblem, forces: Float[np.ndarray, " m"]) -> float:
        """By how much forces exceed the limit that they exceed most [N, Nm]; negative within all.

        The largest of A f - b of `over_forces`, without its rows.
        """
        contacts = self.matrix.dot(forces[: self.matrix.shape[1]]) - self.bound
        torques = np.abs(problem.torques(forces)) - self.torque
        return max(float(contacts.max(initial=-np.inf)), float(torques.max(initial=-np.inf)))

    def over_forces(
        self, problem: LoadProblem
    ) -> tuple[Float[np.ndarray, "r m"], Float[np.ndarray, " r"]]:
        """A and b of A f <= b with the torque rows after the contacts': tau = tau_0 - J' f.

        s tau_i <= t_i is the row -s J_i' f <= t_i - s tau_0i.
        """
        joint, s = self.joint, self.sign
        # Forces of loops and couplings, behind the contacts', have no limit of their own.
        more = problem.joint_map.shape[1] - self.matrix.shape[1]
        matrix = np.pad(self.matrix, ((0, 0), (0, more))) if more else self.matrix
        A = np.vstack([matrix, -s[:, None] * problem.joint_map[joint]])
        bound = self.torque[joint] - s * problem.torque_offset[joint]
        return A, np.concatenate([self.bound, bound])


def check_limits(limits: object) -> None:
    """Reject what is not limits.

    Raises:
        InvalidInputError: it is something else, such as a table of them.
    """
    remedy = 'Give Limits(friction=0.33, torque="model"), say, or Limits.from_dict(...) of a table.'
    check_type(limits, Limits, "a value of Limits", remedy)


def optional_limits(limits: Limits | None) -> Limits | None:
    """The limits, None where they limit nothing.

    Raises:
        InvalidInputError: they are neither limits nor None.
    """
    if limits is None:
        return None
    check_limits(limits)
    return limits if limits.any else None


def limit_rows(stance: Stance, limits: Limits) -> LimitRows:
    """The rows of limits at a stance.

    Raises:
        InvalidInputError: a limit needs what a contact does not have (a sole, a coefficient), or a
            sole is too narrow for its margin.
        UnknownNameError: a torque limit names no joint.
    """
    check_stance(stance)
    check_limits(limits)
    return _rows(stance.robot, tuple(stance.contacts), limits)


@lru_cache(maxsize=32)  # a path's postures share theirs
def _rows(robot: Robot, contacts: tuple[Contact, ...], limits: Limits) -> LimitRows:
    return rows_of(contacts, limits, _torque_limits(robot, limits.torque), robot.torque_names)


def rows_of(
    contacts: Sequence[Contact],
    limits: Limits,
    torque: Float[np.ndarray, " n"],
    joints: tuple[str, ...],
) -> LimitRows:
    """The same of contacts and joints' torque limits (n,) alone, forces stacked in their order."""
    known = [contact.name for contact in contacts]
    for what in _FOR_EACH:
        given = getattr(limits, what)
        for name in given if isinstance(given, Mapping) else ():
            if name not in known:
                raise UnknownNameError(f"contact in the limit {what}", name, known)
    matrix, bound, names, owners, kinds, normals = [], [], [], [], [], []
    m = sum(len(contact.components) for contact in contacts)
    start = 0
    for k, contact in enumerate(contacts):
        rows = slice(start, start := start + len(contact.components))
        for kind, name, normal, b in _contact_rows(contact, limits):
            row = np.zeros(m)
            row[rows] = normal[list(contact.components)]
            matrix.append(row)
            bound.append(b)
            names.append(f"{contact.name}: {name}")
            owners.append(k)
            kinds.append(kind)
            normals.append(rows.start + contact.normal_row if kind == "cop" else -1)
    return LimitRows(
        read_only(np.array(matrix).reshape(-1, m)),
        read_only(np.array(bound, dtype=float)),
        tuple(names),
        tuple(owners),
        tuple(kinds),
        owned(torque),
        joints,
        read_only(np.array(normals, dtype=int)),
    )


def torque_limits(stance: Stance, limits: TorqueLimits | None) -> Float[np.ndarray, " n"]:
    """Limit of the size of each joint's torque [Nm], infinite where there is none.

    Raises:
        UnknownNameError: a limit names no joint.
    """
    return _torque_limits(stance.robot, limits)


def _torque_limits(robot: Robot, limits: TorqueLimits | None) -> Float[np.ndarray, " n"]:
    names = robot.torque_names
    if limits is None:
        return np.full(len(names), np.inf)
    if isinstance(limits, str):
        return robot.effort_limits
    if isinstance(limits, Mapping):
        for joint in limits:
            if joint not in names:
                raise UnknownNameError("joint in the torque limits", joint, names)
        return np.array([float(limits.get(joint, np.inf)) for joint in names])
    return np.full(len(names), float(limits))


def torque_placeholders(stance: Stance) -> tuple[str, ...]:
    """Joints whose effort limit in the model is a placeholder: none, zero, or absurdly large."""
    robot = stance.robot
    pairs = zip(robot.torque_names, robot.effort_limits, strict=True)
    return tuple(name for name, limit in pairs if np.isinf(limit))


Row = tuple[str, str, Float[np.ndarray, " 6"], float]


def _contact_rows(contact: Contact, limits: Limits) -> list[Row]:
    """Rows of one contact over its six components: kind, name, normal, bound."""
    rows: list[Row] = []
    least = _of(limits.normal_force, contact)
    if least is not None:
        rows.append(("normal force", "normal force", _unit(2) * -1.0, -least))
    mu = friction_of(contact, limits)
    if mu is not None:
        rows += _pyramid_rows(contact, mu, limits.friction_sides)
    margin = _of(limits.cop_margin, contact)
    if margin is not None and contact.sole:
        _require_room(contact, contact.sole, margin)
        rows += _cop_rows(contact, contact.sole, margin)
    if limits.torsion == "cone" and contact.kind == "surface":
        rows += _cone_rows(contact, mu, limits.friction_sides)
    torsion = contact.torsional_friction
    if limits.torsion == "cone":
        torsion = None
    elif not isinstance(limits.torsion, str):
        torsion = limits.torsion
    if torsion is not None and contact.kind == "surface":
        for sign, side in ((1.0, "left"), (-1.0, "right")):
            row = sign * _unit(5) - torsion * _unit(2)
            rows.append(("torsion", f"torsion to the {side}", row, 0.0))
    return rows


def _pyramid_rows(contact: Contact, mu: float, sides: int) -> list[Row]:
    """The pyramid inscribed in |f_t| <= mu f_z, with a vertex along x."""
    if contact.kind == "planar":
        return [
            ("friction", f"slips to {word}y", sign * _unit(1) - mu * _unit(2), 0.0)
            for sign, word in ((1.0, "-"), (-1.0, "+"))
        ]
    rows: list[Row] = []
    reach = mu * np.cos(np.pi / sides)
    for i in range(sides):
        angle = 2 * np.pi * (i + 0.5) / sides
        row = np.cos(angle) * _unit(0) + np.sin(angle) * _unit(1) - reach * _unit(2)
        rows.append(
            ("friction", f"slips towards {np.degrees(angle + np.pi) % 360:.0f} deg", row, 0.0)
        )
    return rows


def _cop_rows(contact: Contact, sole: Polygon, margin: float) -> list[Row]:
    """a . p <= b - margin for each edge, with p = (-m_y, m_x) / f_z and f_z >= 0."""
    edges = list(zip(sole.normals, sole.offsets - margin, sole.edge_names, strict=True))
    if len(sole) == 2 and contact.kind == "surface":
        # A sole that is a line has two sides too, which leave no room across it.
        names = [f"the {sole.side(2 + i)} side" for i in range(2)]
        edges += zip(*sole.sides, names, strict=True)
    return [("cop", f"CoP at {name}", -edge_row(a, b), 0.0) for a, b, name in edges]


def _require_room(contact: Contact, sole: Polygon, margin: float) -> None:
    """Reject a sole without a point that far from its edges: it could carry no load at all."""
    x = 0.0 if contact.kind == "planar" else None
    inside = sole.vertices.mean(axis=0)
    if x is not None:
        inside = np.array([x, np.mean(sole.section("y", x) or np.nan)])
    if sole.margins(inside) >= margin:
        return  # a point that proves it
    room = _room(sole, x)
    if margin > room + _ROUNDING:
        raise InvalidInputError(
            f"the sole of {contact.name!r} has no point {margin:g} m inside its edges: the "
            f"innermost one is {room:.3g} m inside. Give a smaller cop_margin."
        )


@cache
def _room(sole: Polygon, x: float | None) -> float:
    return sole.room(x)


def _cone_rows(contact: Contact, mu: float | None, sides: int) -> list[Row]:
    """Faces of the cone of wrenches that friction forces at the sole's vertices can make up."""
    sole = contact.sole
    if mu is None or sole is None or len(sole) < 3:
        raise InvalidInputError(
            f"the wrench cone of contact {contact.name!r} needs a friction coefficient and a sole "
            "of three points or more. Give both, or another torsion limit."
        )
    if len(sole) > _CONE_VERTICES:
        raise InvalidInputError(
            f"the sole of {contact.name!r} has {len(sole)} vertices; its exact wrench cone "
            f"is made for {_CONE_VERTICES} at most. Give a simpler polygon, such as "
            "rectangle(...) (--sole X0:X1:Y0:Y1)."
        )
    faces = unit_cone(sole, mu, sides)
    return [("wrench cone", f"wrench cone, face {i}", row, 0.0) for i, row in enumerate(faces)]


def _unit(component: int) -> Float[np.ndarray, " 6"]:
    return np.eye(6)[component]
