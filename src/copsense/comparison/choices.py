"""Choices: the robots, postures, controllers and conditions that a benchmark compares."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from copsense.arrays import finite_number
from copsense.contact import Contact, rectangle
from copsense.content import freeze, plain
from copsense.controllers import STIFF, Gains, public_gains
from copsense.criterion import Criterion
from copsense.criterion_text import criterion_from_data
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.limits import Limits
from copsense.robot import Robot
from copsense.robots import PRESETS, StanceFile, load_robot, load_stance
from copsense.robots.stance_tables import is_stance_file
from copsense.simulation import Scenario
from copsense.stance import Stance

# robot -> (hip pitch, knee, ankle pitch) of both legs, each with its share of the knees' bend
_LEGS: dict[str, tuple[tuple[str, float], ...]] = {
    "icub": tuple(
        (f"{side}_{joint}", share)
        for side in "lr"
        for joint, share in (("hip_pitch", 0.5), ("knee", -1.0), ("ankle_pitch", -0.5))
    ),
    "talos": tuple(
        (f"leg_{side}_{number}_joint", share)
        for side in ("left", "right")
        for number, share in ((3, -0.5), (4, 1.0), (5, -0.5))
    ),
    "romeo": tuple(
        (f"{side}{joint}", share)
        for side in "LR"
        for joint, share in (("HipPitch", -0.5), ("KneePitch", 1.0), ("AnklePitch", -0.5))
    ),
    "g1": tuple(
        (f"{side}_{joint}_joint", share)
        for side in ("left", "right")
        for joint, share in (("hip_pitch", -0.5), ("knee", 1.0), ("ankle_pitch", -0.5))
    ),
}
_GAINS = ("stiff", "public")


@dataclass(frozen=True)
class RobotChoice:
    """A robot and its soles.

    Attributes:
        source: a preset's name, or the path of a URDF, MJCF or SDF; or of a stance file (.toml),
            which says all the rest, and how the robot stands.
        name: in results; default the source.
        contacts: frames of the contacts; default the preset's.
        soles: frame -> rectangle (x0, x1, y0, y1) in the contact frame [m], instead of the sole
            from the collision geometry.
        sole_height: height of the contact plane above the model's frames, along its normal [m];
            for the contacts of `soles`.
        tables: a whole stance as `copsense.robots.stance_data` writes it, paths said from the
            working folder; instead of contacts, soles and sole height.
    """

    source: str
    name: str = ""
    contacts: tuple[str, ...] = ()
    soles: Mapping[str, tuple[float, float, float, float]] | None = None
    sole_height: float = 0.0
    tables: Mapping[str, Any] | None = None

    def __post_init__(self) -> None:
        """Set the default name and validate the soles."""
        object.__setattr__(self, "name", self.name or Path(self.source).stem)
        object.__setattr__(self, "contacts", tuple(self.contacts))
        freeze(self, "soles", "tables")
        if self.is_stance and (self.contacts or self.soles or self.sole_height):
            raise InvalidInputError(
                f"the stance of {self.source} says which contacts robot {self.name!r} has, and "
                "so does another field. Leave contacts, soles and sole_height (--contact) out."
            )
        finite_number(self.sole_height, f"the sole height of robot {self.name!r} [m]")
        for frame, sole in (self.soles or {}).items():
            numbers = [finite_number(x, f"the sole of {frame} [m]") for x in sole]
            if len(numbers) != 4 or not (numbers[0] < numbers[1] and numbers[2] < numbers[3]):
                raise InvalidInputError(
                    f"the sole of {frame} is {sole!r}. Give four numbers [m], x0 < x1 and y0 < y1."
                )

    @property
    def is_stance(self) -> bool:
        """Whether a stance file says, or its tables, how the robot stands."""
        return is_stance_file(self.source) or self.tables is not None

    @property
    def files(self) -> tuple[Path, ...]:
        """The files that say what the robot is."""
        if self.source in PRESETS or not Path(self.source).is_file():
            return ()
        own = Path(self.source)
        model = StanceFile.read(own).source if is_stance_file(own) else ""
        return (own, model) if isinstance(model, Path) and model.is_file() else (own,)

    def check_own(self, posture: PostureChoice) -> None:
        """Reject a posture beside the stance file's own.

        Raises:
            InvalidInputError: it bends knees, moves joints or sets a width.
        """
        if self.is_stance and posture.changes:
            raise InvalidInputError(
                f"the stance of {self.source} says how the robot stands, and so does posture "
                f"{posture.name!r}. Use the posture own (--posture own)."
            )

    def stance(self, posture: PostureChoice) -> Stance:
        """The robot standing in a posture.

        Raises:
            CopsenseError: the robot cannot be loaded, or cannot stand in this posture.
        """
        if self.is_stance:
            self.check_own(posture)
            if self.tables is not None:
                return StanceFile(Path("stance.toml"), plain(self.tables)).stance()
            return load_stance(self.source)
        robot: str | Robot = self.source
        if self.source not in PRESETS:
            robot = load_robot(self.source, frames=(*self.contacts, *(self.soles or ())))
        contacts: list[str | Contact] | None = list(self.contacts) or None
        if self.soles:
            known = PRESETS[self.source].contacts if self.source in PRESETS else ()
            contacts = []
            for frame, (x0, x1, y0, y1) in self.soles.items():
                own = next((c for c in known if c.frame == frame), Contact(frame))
                sole = rectangle((float(x0), float(x1)), (float(y0), float(y1)))
                contacts.append(replace(own, polygon=sole).at_height(self.sole_height))
        return load_stance(
            robot, contacts=contacts, posture=posture.angles(self.source), width=posture.width
        )


@dataclass(frozen=True)
class PostureChoice:
    """How a robot stands.

    Attributes:
        name: in results.
        knees: bend of both knees [rad]; hips and ankles keep the soles level. None leaves the legs
            as in the preset.
        width: between the feet [m]; None as in the preset.
        joints: joint -> position that the posture stays close to [rad, m].
    """

    name: str = "own"
    knees: float | None = None
    width: float | None = None
    joints: Mapping[str, float] | None = None

    def __post_init__(self) -> None:
        """Own the joints; validate knees and width."""
        freeze(self, "joints")
        if self.knees is not None:
            finite_number(self.knees, f"the knees' bend of posture {self.name!r} [rad]")
        if self.width is not None:
            finite_number(self.width, f"the width of posture {self.name!r} [m]", positive=True)

    @property
    def changes(self) -> bool:
        """Whether it says anything that the robot's own posture does not."""
        return (self.knees, self.width) != (None, None) or bool(self.joints)

    def angles(self, robot: str) -> dict[str, float]:
        """Joint -> position [rad, m] for a robot.

        Raises:
            UnknownNameError: knees are given for a robot whose legs are not in the table here.
        """
        angles: dict[str, float] = {}
        if self.knees is not None:
            if robot not in _LEGS:
                raise UnknownNameError(
                    "robot whose knees are known", robot, _LEGS, "Or give joints in a plan file."
                )
            angles = {joint: share * self.knees for joint, share in _LEGS[robot]}
        return angles | dict(self.joints or {})


@dataclass(frozen=True)
class ControllerChoice:
    """A balancing controller.

    Attributes:
        criterion: the criterion that shares the load: a text, as
            `copsense.criterion_text.criterion_from_text` reads it, or a table, as
            `Criterion.to_dict` writes it.
        characteristic_length: L of minimum-wrench [m].
        gains: ``"stiff"`` or ``"public"``.
        limits: what the contact wrenches and torques must respect, or None.
        name: in results; default the criterion, and "within limits" if there are any.
        source: ``MODULE:ATTRIBUTE`` of a callable stance -> controller, instead of the balancing
            controller; the prediction then assumes `criterion` and `limits`.
    """

    criterion: str | Mapping[str, Any] = "minimum-torque"
    characteristic_length: float = 1.0
    gains: str = "stiff"
    limits: Limits | None = None
    name: str = ""
    source: str = ""

    def __post_init__(self) -> None:
        """Set the default name and validate the others."""
        if not isinstance(self.criterion, str):
            freeze(self, "criterion")
        own = self.build_criterion().name
        if self.gains not in _GAINS:
            raise UnknownNameError("set of gains", self.gains, _GAINS)
        if self.source and not all(self.source.rpartition(":")):
            raise InvalidInputError(
                f"the controller {self.source!r} is not understood. Give MODULE:ATTRIBUTE, a "
                "callable stance -> controller."
            )
        usual = (self.source or own) + (" within limits" if self.limited else "")
        object.__setattr__(self, "name", self.name or usual)

    @property
    def limited(self) -> bool:
        """Whether anything is limited."""
        return self.limits is not None and self.limits.any

    def build_criterion(self) -> Criterion:
        """The criterion of that text, or of that table."""
        return criterion_from_data(self.criterion, self.characteristic_length)

    def gains_of(self, robot: Robot) -> Gains:
        """The gains for a robot."""
        return STIFF if self.gains == "stiff" else public_gains(robot)


@dataclass(frozen=True)
class Conditions:
    """Disturbances of every run of a case.

    Attributes:
        name: in results.
        values: fields of `copsense.simulation.Scenario` and their values, such as
            ``{"motors": Motors(delay=0.005)}``.
    """

    name: str = "ideal"
    values: Mapping[str, Any] | None = None

    def __post_init__(self) -> None:
        """Own the values; reject names that no scenario has, or that the trial sets."""
        freeze(self, "values")
        known = [f.name for f in fields(Scenario) if f.name not in ("duration", "reference")]
        for name in self.values or {}:
            if name not in known:
                raise UnknownNameError("field of a scenario", name, known)
