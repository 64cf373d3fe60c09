"""ReferenceValue: numbers on the iCub recorded once, to compare every reproduction with.

They are those of iCubGenova04 in the 2016 posture, feet 0.14 m apart, contact frames at l_sole and
r_sole, along the lateral path of the CoM. "sup" is the foot under the CoM, "off" the other one.
Recorded with three or fewer digits: a value agrees within 1 % or within what rounding took.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from copsense.paper.claims.icub_sweep import TORQUE, WRENCH, LateralSweep

_RELATIVE = 0.01


@dataclass(frozen=True)
class ReferenceValue:
    """A recorded number beside the one found.

    Attributes:
        quantity: what it is.
        criterion: under which criterion.
        unit: "1" if it has none.
        reference: the recorded number.
        measured: the number found.
        tolerance: largest difference that agrees, in the unit.
    """

    quantity: str
    criterion: str
    unit: str
    reference: float
    measured: float
    tolerance: float

    @property
    def agrees(self) -> bool:
        """Whether the two are within the tolerance."""
        return abs(self.measured - self.reference) <= self.tolerance


@dataclass(frozen=True)
class _Row:
    """A quantity as it was recorded, and how to measure it again."""

    quantity: str
    unit: str
    recorded: tuple[str, str]  # under criterion 1 and 2, as printed: the digits say how exact
    measure: Callable[[LateralSweep, str], float]


_TABLE = (
    _Row(
        "f_z / (m g), CoM over a foot, sup",
        "1",
        ("0.502", "0.745"),
        lambda s, c: s.over_foot(s.series[c].load)[0],
    ),
    _Row(
        "f_z / (m g), CoM over a foot, off",
        "1",
        ("0.498", "0.255"),
        lambda s, c: s.over_foot(s.series[c].load)[1],
    ),
    _Row(
        "SCoP_y, CoM over a foot, sup",
        "m",
        ("0.069", "0.020"),
        lambda s, c: s.over_foot(s.series[c].cop)[0],
    ),
    _Row(
        "SCoP_y, CoM over a foot, off",
        "m",
        ("0.070", "0.082"),
        lambda s, c: s.over_foot(s.series[c].cop)[1],
    ),
    _Row(
        "dSCoP_y/dCoM_y, centre",
        "1",
        ("0.995", "0.506"),
        lambda s, c: s.at(s.series[c].slope[:, 0], 0.0),
    ),
    _Row(
        "dSCoP_y/dCoM_y, CoM over a foot, sup",
        "1",
        ("0.985", "0.141"),
        lambda s, c: s.over_foot(s.series[c].slope)[0],
    ),
    _Row(
        "dSCoP_y/dCoM_y, CoM over a foot, off",
        "1",
        ("1.005", "2.45"),
        lambda s, c: s.over_foot(s.series[c].slope)[1],
    ),
    _Row(
        "dSCoP_y/dl_hip_roll, centre",
        "m/rad",
        ("-0.386", "-0.196"),
        lambda s, c: s.at(s.series[c].slope[:, 0] / s.hip_rate, 0.0),
    ),
    # Recorded on a grid of 1 mm, and so rounded down to it.
    _Row(
        "both CoPs in the soles up to |CoM_y|, in steps of 1 mm",
        "m",
        ("0.038", "0.045"),
        lambda s, c: s.planted(c),
    ),
)


def compare_with_reference(sweep: LateralSweep) -> tuple[ReferenceValue, ...]:
    """The recorded values beside those of a sweep, criterion 1 first."""
    rows = []
    for row in _TABLE:
        for criterion, text in zip((WRENCH, TORQUE), row.recorded, strict=True):
            reference = float(text)
            rounding = 0.5 * 10.0 ** -len(text.partition(".")[2])
            if row.quantity.startswith("both"):
                rounding *= 2  # cut off, not rounded
            tolerance = max(_RELATIVE * abs(reference), rounding)
            measured = row.measure(sweep, criterion)
            rows.append(
                ReferenceValue(row.quantity, criterion, row.unit, reference, measured, tolerance)
            )
    return tuple(rows)
