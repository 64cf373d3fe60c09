"""The errors copsense raises: one small family, each saying what was wrong and what to do."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from typing import Any

_LISTED = 40  # names that an error lists at most
_FEW = 3  # clauses of a sentence that lists what is wrong with each of several


class CopsenseError(Exception):
    """Base of every error that copsense raises on purpose."""


class InvalidInputError(CopsenseError, ValueError):
    """A value that the caller gave cannot be used; the message names it and the remedy."""


class UnknownNameError(CopsenseError, KeyError):
    """A name that is not among the valid ones.

    Attributes:
        kind: what was looked up, e.g. ``"frame"``.
        name: the name as given.
        valid: the valid names.
        remedy: what else may be done, or nothing.
    """

    def __init__(self, kind: str, name: object, valid: Iterable[str], remedy: str = "") -> None:
        """Store the data and compose the message with the nearest valid names."""
        self.kind = kind
        self.name: str = str(name)
        self.valid: tuple[str, ...] = tuple(valid)
        self.remedy = remedy
        lowered = {choice.lower(): choice for choice in self.valid}
        near = difflib.get_close_matches(self.name.lower(), lowered, n=3, cutoff=0.5)
        hint = f" Did you mean {' or '.join(lowered[n] for n in near)}?" if near else ""
        listed = ", ".join(self.valid[:_LISTED]) if self.valid else "none"
        if len(self.valid) > _LISTED:
            # Hundreds of frames would bury the message: the likeliest stand first.
            alike = difflib.get_close_matches(self.name.lower(), lowered, n=_LISTED, cutoff=0.3)
            some = [lowered[n] for n in alike] or list(self.valid[:_LISTED])
            listed = f"{', '.join(some)} ... ({len(self.valid)} in all)"
        self.message: str = f"no {kind} named {self.name!r}.{hint} Valid: {listed}." + (
            f" {remedy}" if remedy else ""
        )
        super().__init__(self.message)

    def __str__(self) -> str:
        """The message itself: KeyError would show its repr."""
        return self.message

    def __reduce__(self) -> tuple[Any, ...]:
        """Copies and pickles are built from the data, not from the message."""
        return type(self), (self.kind, self.name, self.valid, self.remedy)


class ModelLoadError(CopsenseError):
    """A robot description could not be read (missing, malformed, or with a missing mesh)."""


class LogReadError(CopsenseError):
    """A log file could not be read (missing, cut short, damaged, or of an unknown format)."""


class MissingExtraError(CopsenseError, ImportError):
    """An optional package is needed; the message names the extra to install."""

    def __init__(self, package: str, extra: str, purpose: str) -> None:
        """Compose the message from the package, the extra that brings it, and why."""
        self.package = package
        self.extra = extra
        self.purpose = purpose
        super().__init__(
            f"{purpose} needs the package {package!r}. Install it with: "
            f'pip install "copsense[{extra}]"'
        )

    def __reduce__(self) -> tuple[Any, ...]:
        """As `UnknownNameError.__reduce__`."""
        return type(self), (self.package, self.extra, self.purpose)


class ContactGeometryError(CopsenseError):
    """A contact does not lie where it was said to; the message gives the offsets."""


class OpenLoopError(CopsenseError):
    """A loop or coupling of the robot is open at a configuration; the message gives the gap."""


class UnbalancedError(CopsenseError):
    """Joints without a motor cannot be held at a posture, whatever shares the load.

    Attributes:
        robot: the robot's name.
        lacking: joint, or direction of the base -> force or moment that is missing [N, Nm].
    """

    def __init__(self, robot: str, lacking: dict[str, float]) -> None:
        """Compose the message from what is missing where."""
        self.robot = robot
        self.lacking = lacking
        told = ", ".join(f"{joint} lacks {missing:.3g}" for joint, missing in lacking.items())
        super().__init__(
            f"nothing can hold {robot!r} at this posture: {told} (Nm, or N along a slide), for "
            "want of a motor. Give the joint a motor, a spring or a held torque, let it hang at "
            "its own equilibrium (solve_posture finds it), or add a contact."
        )

    def __reduce__(self) -> tuple[Any, ...]:
        """Copies and pickles are built from the data, not from the message."""
        return type(self), (self.robot, self.lacking)


class UnstablePostureError(CopsenseError):
    """Joints without a motor are at rest at a posture, but would not come back to it.

    Attributes:
        robot: the robot's name.
        joints: those that would fall, the one that moves most first.
        stiffness: u'A u of their motion u, of length one [Nm/rad]; negative where it falls.
    """

    def __init__(self, robot: str, joints: tuple[str, ...], stiffness: float) -> None:
        """Compose the message from what would fall."""
        self.robot = robot
        self.joints = joints
        self.stiffness = stiffness
        super().__init__(
            f"{robot!r} would fall at this posture: no motor, contact or loop holds "
            f"{', '.join(joints)}, and gravity and springs do not bring them back (stiffness "
            f"{stiffness:.3g} Nm/rad). Give the joint a motor or a stiffer spring, or let it hang "
            "below its axis."
        )

    def __reduce__(self) -> tuple[Any, ...]:
        """Copies and pickles are built from the data, not from the message."""
        return type(self), (self.robot, self.joints, self.stiffness)


class InsufficientContactsError(CopsenseError):
    """The contacts cannot carry the robot's weight, however the load is shared."""


class UndeterminedWrenchError(CopsenseError):
    """The criterion leaves a family of minimisers; a tie-break is needed.

    Attributes:
        directions: wrench directions (per contact and component) left free.
    """

    def __init__(self, message: str, directions: tuple[str, ...] = ()) -> None:
        """Store the free directions beside the message."""
        self.directions = directions
        super().__init__(message)


class UnloadedContactError(CopsenseError):
    """A contact carries no normal force, so it has no centre of pressure.

    Attributes:
        contacts: names of the unloaded contacts.
    """

    def __init__(self, contacts: tuple[str, ...]) -> None:
        """Compose the message from the contacts' names."""
        self.contacts = contacts
        super().__init__(
            f"no normal force on {', '.join(contacts)}: the centre of pressure is undefined "
            "there. Move the posture off this point, or remove the contact from the stance."
        )

    def __reduce__(self) -> tuple[Any, ...]:
        """As `UnknownNameError.__reduce__`."""
        return type(self), (self.contacts,)


class UnreachablePostureError(CopsenseError):
    """No posture with the contacts in place meets the request."""


class SensitivityMismatchError(CopsenseError):
    """An analytic sensitivity disagrees with finite differences."""


class OutputError(CopsenseError):
    """A file cannot be written where it was asked for, or would overwrite another."""


class EngineMismatchError(CopsenseError):
    """A physics engine's model of a robot is not the robot that the analysis sees."""


class ControllerError(CopsenseError):
    """A controller raised, or returned something that is not a vector of torques."""


class SchedulerError(CopsenseError):
    """A cluster's scheduler or its workers cannot be used."""


class InfeasibleError(CopsenseError):
    """No contact wrench respects the limits.

    Attributes:
        violation: the least amount by which every limit would have to be relaxed [N, Nm].
        demands: the limits that demand it.
    """

    def __init__(self, violation: float, demands: tuple[str, ...]) -> None:
        """Compose the message from the violation and who demands it."""
        self.violation = violation
        self.demands = demands
        super().__init__(
            f"no wrench balances the robot within the limits: each would have to be relaxed by "
            f"{violation:.3g} N, or as many Nm where it limits a moment. In conflict: "
            f"{'; '.join(demands) or 'unknown'}. Relax one of these limits, or move the posture."
        )

    def __reduce__(self) -> tuple[Any, ...]:
        """As `UnknownNameError.__reduce__`."""
        return type(self), (self.violation, self.demands)


class ImpossibleInertiaError(InvalidInputError):
    """A robot whose links have inertias that no body has, where motion is asked for.

    Attributes:
        robot: its name.
        links: what is wrong, a clause for each link.
    """

    def __init__(self, robot: str, links: Sequence[str]) -> None:
        """Compose the message."""
        self.robot: str = robot
        self.links: tuple[str, ...] = tuple(links)
        more = f"; and {len(links) - _FEW} more" if len(links) > _FEW else ""
        super().__init__(
            f"robot {robot!r} cannot be simulated: {'; '.join(links[:_FEW])}{more}, which no body "
            "has (they are positive, and none is greater than the other two together). Correct the "
            "file, or let them be replaced (copsense balance --repair-inertia, "
            "copsense.inertias.repair_inertias(robot)). Statics do not feel them: analyse, sweep, "
            "design, map and push work."
        )

    def __reduce__(self) -> tuple[Any, ...]:
        """As `UnknownNameError.__reduce__`."""
        return type(self), (self.robot, self.links)


class UnsolvedError(CopsenseError):
    """A quadratic program that has solutions was not solved well enough to be believed.

    Attributes:
        error: the smallest violation of an optimality condition that was reached, relative.
    """

    def __init__(self, error: float) -> None:
        """Compose the message from the violation."""
        self.error = error
        super().__init__(
            f"the wrenches within the limits were not found: {error:.1e} of an optimality "
            "condition remains. Weights of very different size, or limits that all but exclude "
            "each other, can cause this; bring the weights nearer or relax a limit."
        )

    def __reduce__(self) -> tuple[Any, ...]:
        """As `UnknownNameError.__reduce__`."""
        return type(self), (self.error,)
