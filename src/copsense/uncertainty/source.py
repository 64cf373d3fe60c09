"""Source: one number that the model may have wrong, and by how much."""

from __future__ import annotations

from dataclasses import dataclass

from copsense.arrays import finite_number
from copsense.errors import InvalidInputError, UnknownNameError

# Kind of a source -> what its share of the variance is called.
GROUPS = {
    "mass": "link masses",
    "com": "centres of mass",
    "payload": "payloads",
    "offset": "joint offsets",
    "torque": "torque offsets",
    "slope": "slope of the ground",
    "place": "where contacts stand",
    "height": "heights of the ground",
    "sole": "soles on their links",
    "friction": "friction",
}
# Displacement of a contact -> its component among (x, y, z, about x, y, z), contact axes.
PLACES = {"x": 0, "y": 1, "height": 2, "roll": 3, "pitch": 4, "yaw": 5}
AXES = {"x": 0, "y": 1, "z": 2}
SLOPES = {"roll": 0, "pitch": 1}
_UNITS = {
    "mass": ("kg",),
    "com": ("m",),
    "payload": ("kg",),
    "offset": ("rad", "m"),
    "torque": ("N m", "N"),
    "slope": ("rad",),
    "place": ("m", "rad"),
    "height": ("m",),
    "sole": ("m", "rad"),
    "friction": ("1",),
}


@dataclass(frozen=True)
class Source:
    """A number that the model may have wrong, independent of the others.

    Attributes:
        kind: of `GROUPS`.
        where: link, joint, frame of a payload or contact; ``"ground"`` for its slope.
        part: which of its numbers: x, y or z of a centre of mass in its link's axes; roll or pitch
            of the slope; x, y, height, roll, pitch or yaw of where a contact stands; x, y or yaw
            of a sole on its link. Empty where there is one only.
        deviation: its standard deviation [kg, m, rad, N m, N, or none of friction].
        unit: the deviation's unit.
        point: of a payload, its centre in the frame [m].
    """

    kind: str
    where: str
    part: str
    deviation: float
    unit: str
    point: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        """Reject a kind or unit that there is not, and a deviation that is none."""
        if self.kind not in GROUPS:
            raise UnknownNameError("kind of source", self.kind, GROUPS)
        if self.unit not in _UNITS[self.kind]:
            raise UnknownNameError(f"unit of a {self.kind}", self.unit, _UNITS[self.kind])
        what = f"the standard deviation of the {self.name} [{self.unit}]"
        if finite_number(self.deviation, what) < 0:
            raise InvalidInputError(f"{what} is {self.deviation:g}. Give zero or more.")

    @property
    def group(self) -> str:
        """What its share of the variance is listed under."""
        return GROUPS[self.kind]

    @property
    def name(self) -> str:
        """Such as ``"mass of l_thigh"`` or ``"yaw of l_sole"``."""
        word = {
            "com": f"CoM {self.part}",
            "slope": self.part,
            "place": self.part,
            "sole": f"sole {self.part}",
            "offset": "offset",
        }.get(self.kind, self.kind)
        return f"{word} {'at' if self.kind == 'payload' else 'of'} {self.where}"
