"""Parameter: one dimension, mass or stiffness of a robot, and what a unit more of it changes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from copsense.arrays import finite_number
from copsense.content import FrozenMapping, ShortRepr, freeze
from copsense.errors import InvalidInputError
from copsense.magnitudes import check_length

# Kind of a parameter -> the group that it is compared in.
GROUPS = {
    "sole_length": "lengths",
    "sole_width": "lengths",
    "sole_front": "lengths",
    "sole_back": "lengths",
    "sole_outer": "lengths",
    "sole_inner": "lengths",
    "sole_left": "lengths",
    "sole_right": "lengths",
    "ankle_height": "lengths",
    "hip_width": "lengths",
    "hip_length": "lengths",
    "length": "lengths",
    "mass": "masses",
    "stiffness": "stiffnesses",
    "spring": "stiffnesses",
}
_LONGEST = 5.0  # m: no part of a robot is so long


@dataclass(frozen=True)
class Stretch:
    """A sole that is stretched along one of its axes, one end in place.

    A point of it at x moves by (x - `fixed`) / `extent` per metre.

    Attributes:
        axis: 0 along the contact's x, 1 along its y.
        fixed: where it does not move [m].
        extent: of the sole along that axis [m].
    """

    axis: int
    fixed: float
    extent: float


@dataclass(frozen=True, eq=False, repr=False)
class Alteration(ShortRepr):
    """What one unit more of a parameter changes; everything but a servo's compliance is linear.

    Attributes:
        joints: joint of the model -> how its place on the link that carries it moves (3,), that
            link's axes.
        contacts: contact -> how its frame moves on its link (3,), the link's axes.
        masses: joint -> how much more its link weighs, at its own centre of mass.
        stretches: joint -> (3,) u and the length by which its link is stretched along u: a point x
            of it moves by (u . x / length) u, and its mass stays.
        soles: contact -> how its sole is stretched.
        servos: motors whose stiffness grows.
        springs: joints whose spring's stiffness grows.
    """

    joints: Mapping[int, Float[np.ndarray, " 3"]] = field(default_factory=dict)
    contacts: Mapping[str, Float[np.ndarray, " 3"]] = field(default_factory=dict)
    masses: Mapping[int, float] = field(default_factory=dict)
    stretches: Mapping[int, tuple[Float[np.ndarray, " 3"], float]] = field(default_factory=dict)
    soles: Mapping[str, Stretch] = field(default_factory=dict)
    servos: tuple[str, ...] = ()
    springs: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Own the mappings and their arrays."""
        for name in ("joints", "contacts"):
            owned = {key: _own(value) for key, value in getattr(self, name).items()}
            object.__setattr__(self, name, FrozenMapping(owned))
        stretched = {j: (_own(u), length) for j, (u, length) in self.stretches.items()}
        object.__setattr__(self, "stretches", FrozenMapping(stretched))
        freeze(self, "masses", "soles")

    @property
    def shapes(self) -> bool:
        """Whether it moves joints or contacts on their links, so that the posture follows."""
        return bool(self.joints or self.contacts)

    @classmethod
    def together(cls, parts: Iterable[Alteration]) -> Alteration:
        """Several at once, of links, soles and motors that are not the same."""
        given = list(parts)
        joints: dict[int, np.ndarray] = {}
        for each in given:
            for joint, moved in each.joints.items():
                joints[joint] = joints.get(joint, np.zeros(3)) + moved
        return cls(
            joints,
            {name: d for each in given for name, d in each.contacts.items()},
            {joint: m for each in given for joint, m in each.masses.items()},
            {joint: s for each in given for joint, s in each.stretches.items()},
            {name: s for each in given for name, s in each.soles.items()},
            tuple(name for each in given for name in each.servos),
            tuple(name for each in given for name in each.springs),
        )


@dataclass(frozen=True, eq=False, repr=False)
class Parameter(ShortRepr):
    """One dimension, mass or stiffness of a robot, or of several parts that change together.

    Attributes:
        name: such as ``"hip_width"``, ``"mass@upper_leg"`` or ``"sole_front@l_sole"``.
        kind: of `GROUPS`.
        where: the contacts, links or joints that have it.
        nominal: what it is, of several parts the mean [m, kg, or N m/rad, N/m of a slide].
        unit: the unit.
        size: what a hundred per cent of it are, such as the length of a sole of which one edge
            moves.
        alteration: what one unit more changes.
        low: what it must stay above.
    """

    name: str
    kind: str
    where: tuple[str, ...]
    nominal: float
    unit: str
    size: float
    alteration: Alteration
    low: float = -np.inf

    @property
    def group(self) -> str:
        """Lengths, masses or stiffnesses: what it is compared with."""
        return GROUPS[self.kind]

    def checked(self, value: object) -> float:
        """A value that it may have.

        Raises:
            InvalidInputError: a length or mass that nothing has, a sole without room, a stiffness
                that holds nothing.
        """
        what = f"{self.name} [{self.unit}]"
        number = finite_number(value, what)
        if self.unit == "m":
            check_length(number, self.name, _LONGEST)
        if not number > self.low:
            raise InvalidInputError(
                f"{what} is {number:g}. Give more than {self.low:.4g}: it is {self.nominal:.4g} "
                "now."
            )
        return number


def _own(vector: Float[np.ndarray, " 3"]) -> Float[np.ndarray, " 3"]:
    found = np.array(vector, dtype=float)
    found.flags.writeable = False
    return found
