"""PhysicsSettings: how an engine models contacts, fit for a study of centres of pressure."""

from __future__ import annotations

from dataclasses import dataclass

from copsense.arrays import finite_number
from copsense.errors import InvalidInputError


@dataclass(frozen=True)
class PhysicsSettings:
    """Time step and contact model.

    An engine's usual settings are wrong for centres of pressure: MuJoCo's let a sole of the iCub
    sink 0.57 mm, roll 0.29 degrees and creep 0.28 mm/s. With these it sinks 0.02 mm.

    Attributes:
        time_step: of the physics [s].
        contact_time: time constant of the contact's restoring force [s], at least two time steps.
        impedance_ratio: how much stiffer friction is than the normal direction; 100 where a slow
            creep of the feet matters.
        friction: Coulomb coefficient of contacts that give none.
        sole_detail: a sole's vertices are left out while its outline moves by less than this [m].
    """

    time_step: float = 1e-3
    contact_time: float = 4e-3
    impedance_ratio: float = 10.0
    friction: float = 1.0
    sole_detail: float = 2e-4

    def __post_init__(self) -> None:
        """Refuse settings that no simulation can have."""
        for name in ("time_step", "contact_time", "impedance_ratio", "friction"):
            finite_number(getattr(self, name), f"the physics setting {name}", positive=True)
        if self.contact_time < 2 * self.time_step:
            raise InvalidInputError(
                f"contact_time {self.contact_time:g} s is less than two time steps of "
                f"{self.time_step:g} s, which no contact survives. Make the time step shorter."
            )
        if not 0 <= self.sole_detail <= 1e-2:
            raise InvalidInputError(
                f"sole_detail is {self.sole_detail} m. Give a length from 0 to 0.01."
            )
