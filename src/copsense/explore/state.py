"""State: what an explorer shows, as plain values that the command line and Python can say too."""

from __future__ import annotations

import json
import math
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any, Literal, NamedTuple

from copsense.arrays import check_type, finite_number
from copsense.content import freeze
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.limits import LIMIT_NAMES, Limits
from copsense.loads import Load
from copsense.path import COM_COORDINATES
from copsense.robots.stance_tables import is_stance_file

_OWN: Literal["own"] = "own"


class Setting(NamedTuple):
    """The value of a coordinate, and its unit."""

    value: float
    unit: Literal["m", "rad"]


@dataclass(frozen=True)
class State:
    """A posture and how it is judged: `to_command` and `to_python` say the very same.

    Attributes:
        words: the words that say to ``copsense analyse`` which stance it starts from: the robot and
            the options of `copsense.cli.stance_options`, or ``--stance FILE``.
        coordinates: coordinate -> its value; what is not named is not asked for.
        held: whether what is not named keeps the stance's value (``--at``, `PostureChart`); if not,
            everything yields and the posture is the nearest one (``--com-y``, ``--joint``), and
            only CoM and joints can be named.
        criteria: how the load is shared, as ``--criterion`` has it; none for the stance file's, or
            the paper's two.
        length: characteristic length L of the norm of wrenches [m].
        limits: what the wrenches respect; None for nothing, ``"own"`` for the stance file's, or
            nothing where it has none.
        overlays: what is drawn beside the robot; it changes no number.
        loads: known forces on the robot, beside the stance's own.
    """

    words: tuple[str, ...] = ()
    coordinates: Mapping[str, Setting] = field(default_factory=dict)
    held: bool = False
    criteria: tuple[str, ...] = ()
    length: float = 1.0
    limits: Limits | Literal["own"] | None = _OWN
    overlays: frozenset[str] = frozenset()
    loads: tuple[Load, ...] = ()

    def __post_init__(self) -> None:
        """Own the values."""
        found = {}
        for name, (value, unit) in self.coordinates.items():
            if unit not in ("m", "rad"):
                raise UnknownNameError(f"unit of {name}", str(unit), ("m", "rad"))
            found[str(name)] = Setting(finite_number(value, f"the coordinate {name}") + 0.0, unit)
        object.__setattr__(self, "coordinates", found)
        object.__setattr__(self, "words", tuple(map(str, self.words)))
        object.__setattr__(self, "criteria", tuple(map(str, self.criteria)))
        object.__setattr__(self, "overlays", frozenset(map(str, self.overlays)))
        object.__setattr__(self, "loads", tuple(self.loads))
        for load in self.loads:
            check_type(load, Load, "a load of a state", "Give copsense.Load(...).")
        length = finite_number(self.length, "the characteristic length L [m]", positive=True)
        object.__setattr__(self, "length", length)
        freeze(self, "coordinates")

    def __eq__(self, other: object) -> bool:
        """Whether the other says the same."""
        return isinstance(other, State) and self.to_dict() == other.to_dict()

    def __hash__(self) -> int:
        """A hash of what it says."""
        return hash(json.dumps(self.to_dict(), sort_keys=True))

    def named(self, name: str, value: float, unit: Literal["m", "rad"]) -> State:
        """The state with one coordinate asked for."""
        return replace(self, coordinates={**self.coordinates, name: Setting(value, unit)})

    @property
    def com(self) -> tuple[float | None, float | None, float | None]:
        """World x, y and z of the CoM that are asked for [m]."""
        asked = self.coordinates
        x, y, z = (asked[n].value if n in asked else None for n in COM_COORDINATES)
        return x, y, z

    @property
    def joints(self) -> dict[str, float]:
        """What else is asked for: joint -> position [rad, m], where the posture is the nearest."""
        return {n: s.value for n, s in self.coordinates.items() if n not in COM_COORDINATES}

    @property
    def at(self) -> dict[str, float] | None:
        """All coordinates [m, rad] where the rest is held; None where it is not."""
        return {n: s.value for n, s in self.coordinates.items()} if self.held else None

    def to_command(self) -> str:
        """The line of the shell that prints the numbers of this state.

        Raises:
            InvalidInputError: limits that differ by contact, which only a stance file can say.
        """
        parts = ["copsense", "analyse", *self.words]
        for name, setting in self.coordinates.items():
            number = f"{setting.value!r}{setting.unit}"
            if self.held:
                parts += ["--at", f"{name}={number}"]
            elif name in COM_COORDINATES:
                parts += [f"--{name.replace('_', '-')}", number]
            else:
                parts += ["--joint", f"{name}={number}"]
        for criterion in self.criteria:
            parts += ["--criterion", criterion]
        if self.length != 1.0:
            parts += ["--characteristic-length", f"{self.length!r}m"]
        if isinstance(self.limits, Limits):
            parts += ["--limits", limits_text(self.limits)]
        for load in self.loads:
            option = "--load" if load.fixed_to == "world" else "--body-load"
            parts += [option, _load_text(load)]
        return shlex.join(parts)

    def to_python(self, before: str = "", posture: str = "{stance}") -> str:
        """The lines of Python that print the numbers of this state.

        A stance that takes more than a name to say is read from a file; a comment says which
        command writes it.

        Args:
            before: lines of its own to put before the analysis.
            posture: what is analysed. In both ``{stance}`` stands for the stance.
        """
        lines, words = ["import copsense"], self.words
        if len(words) == 1 and not is_stance_file(words[0]):
            stance = f"copsense.load_stance({words[0]!r})"
            criteria, limits = "None", "None"
        else:
            lines += ["from copsense.robots import StanceFile"]
            if len(words) == 1 or (len(words) == 2 and words[0] == "--stance"):
                path = words[-1]
            else:
                path = "stance.toml"
                save = shlex.join(["copsense", "analyse", *words, "--save-stance", path])
                lines.append(f"# written by: {save}")
            lines.append(f"file = StanceFile.read({path!r})")
            stance, criteria, limits = "file.stance()", "file.criteria or None", "file.limits"
        if self.criteria:
            lines.insert(1, "from copsense.criterion_text import criterion_from_text")
            each = ", ".join(f"criterion_from_text({c!r}, {self.length!r})" for c in self.criteria)
            criteria = f"[{each}]"
        if not isinstance(self.limits, str):
            limits = "None" if self.limits is None else _limits_code(self.limits)
        if self.loads:
            each = ", ".join(_load_code(load) for load in self.loads)
            lines += [f"stance = {stance}", f"stance = stance.with_loads([*stance.loads, {each}])"]
            stance = "stance"
        arguments = [posture.replace("{stance}", stance), criteria, limits]
        if self.held and self.coordinates:
            arguments.append(f"at={self.at!r}")
        elif self.coordinates:
            com = zip(COM_COORDINATES, self.com, strict=True)
            arguments += [f"{name}={value!r}" for name, value in com if value is not None]
            if self.joints:
                arguments.append(f"joints={self.joints!r}")
        inside = "".join(f"    {each},\n" for each in arguments)
        lines += [before.replace("{stance}", stance)] * bool(before)
        return "\n".join([*lines, f"analysis = copsense.analyse(\n{inside})", "print(analysis)"])

    def to_dict(self) -> dict[str, Any]:
        """Plain data; `from_dict` reads it back."""
        limits = self.limits.to_dict() if isinstance(self.limits, Limits) else self.limits
        return {
            "words": list(self.words),
            "coordinates": {n: [s.value, s.unit] for n, s in self.coordinates.items()},
            "held": self.held,
            "criteria": list(self.criteria),
            "length": self.length,
            "limits": limits,
            "loads": [asdict(load) for load in self.loads],
            "overlays": sorted(self.overlays),
        }

    def to_json(self) -> str:
        """The same as text."""
        return json.dumps(self.to_dict(), allow_nan=False)

    @classmethod
    def from_dict(cls, data: object) -> State:
        """The state that `to_dict` wrote; what is missing has its default.

        Raises:
            InvalidInputError: not such data.
            UnknownNameError: a key that is not known.
        """
        if not isinstance(data, Mapping):
            raise InvalidInputError(
                f"a state is a table, as State.to_dict() writes it; got {data!r}."
            )
        values = dict(data)
        known = tuple(cls.__dataclass_fields__)
        for key in values:
            if key not in known:
                raise UnknownNameError("key of a state", str(key), known)
        try:
            if "coordinates" in values:
                values["coordinates"] = {n: Setting(*s) for n, s in values["coordinates"].items()}
            kinds: dict[str, Callable[[Any], Any]] = {
                "words": tuple,
                "criteria": tuple,
                "overlays": frozenset,
                "loads": _loads,
            }
            for name, kind in kinds.items():
                if not isinstance(values.get(name, []), list):
                    raise TypeError(f"{name} is not a list")
                values[name] = kind(values.get(name, []))
        except (TypeError, AttributeError) as error:
            raise InvalidInputError(
                f"a state as State.to_dict() writes it is expected: {error}."
            ) from None
        if isinstance(values.get("limits"), Mapping):
            values["limits"] = Limits.from_dict(values["limits"])
        return cls(**values)

    @classmethod
    def from_json(cls, text: str) -> State:
        """The state that `to_json` wrote.

        Raises:
            InvalidInputError: not JSON, or not a state.
        """
        try:
            return cls.from_dict(json.loads(text))
        except json.JSONDecodeError as error:
            raise InvalidInputError(
                f"a state is JSON, as State.to_json() writes it: {error}."
            ) from None


def _loads(tables: list[dict[str, Any]]) -> tuple[Load, ...]:
    triples = ("force", "moment", "point")
    found = []
    for table in tables:
        values: dict[str, Any] = {k: tuple(v) if k in triples else v for k, v in table.items()}
        found.append(Load(**values))
    return tuple(found)


def _load_text(load: Load) -> str:
    """A load as ``--load`` has it."""
    at = "" if not any(load.point) else f"@{_numbers(load.point)}"
    moment = f":{_numbers(load.moment)}" if any(load.moment) else ""
    return f"{load.frame}{at}={_numbers(load.force)}{moment}"


def _numbers(values: Sequence[float]) -> str:
    return ":".join(repr(float(value)) for value in values)


def _load_code(load: Load) -> str:
    usual = Load(load.frame)
    more = "".join(
        f", {each.name}={getattr(load, each.name)!r}"
        for each in fields(load)
        if getattr(load, each.name) != getattr(usual, each.name)
    )
    return f"copsense.Load({load.frame!r}{more})"


def limits_text(limits: Limits) -> str:
    """Limits as ``--limits`` has them.

    Raises:
        InvalidInputError: a limit that differs by contact or joint: only a file can say that.
    """
    usual, parts = Limits(), []
    for word, name in LIMIT_NAMES.items():
        value = getattr(limits, name)
        if isinstance(value, Mapping):
            raise InvalidInputError(
                f"{word} differs by contact or joint, which --limits cannot say. Write a stance "
                "file with those limits, and explore that."
            )
        if value != getattr(usual, name):
            said = "off" if value is None else value if isinstance(value, str) else repr(value)
            parts.append(f"{word}={said}")
    return ",".join(parts) or "friction=contact"


def _limits_code(limits: Limits) -> str:
    usual = Limits().to_dict()
    changed = {k: v for k, v in limits.to_dict().items() if v != usual[k]}
    return f"copsense.Limits({', '.join(f'{k}={v!r}' for k, v in changed.items())})"


def weights_text(weights: Mapping[str, float]) -> str:
    """Torque weights as ``--criterion`` has them; the minimum torque's name where all are one.

    Args:
        weights: part of the joints' names -> weight.
    """
    parts = [
        f"{name}={weight!r}" for name, weight in weights.items() if not math.isclose(weight, 1)
    ]
    return f"weighted-torque:{','.join(parts)}" if parts else "minimum-torque"
