"""Log audit: what does not fit between a log, a robot and the ground, and what may help."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from copsense.contact import Contact
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.logs.finding import Finding, dated
from copsense.logs.log import Log
from copsense.logs.log_motion import LogMotion
from copsense.logs.sway_fit import SlopeEstimate
from copsense.robot import Robot

_TOTAL = 0.02  # of the weight by which the normal forces may miss it
_AIR = 0.01  # of the weight under which a foot is in the air
_SLIP = 5e-3  # m that a foot moves against the first
_TILT = np.radians(1.0)  # of a foot against the first
_BEYOND = 1.5  # rad beyond its limits, or a whole turn, that say a joint is in other units
_SHARE = 0.02  # of the load, with the CoM in the middle
_COM = 5e-3  # m between the total CoP and the CoM, on average
_FAR = 0.3  # m from which that is not an offset any more
_SLOW = 1.0  # s from row to row, which no robot records at


def check_joints(log: Log, robot: Robot) -> list[Finding]:
    """Joints that the robot lacks, or in degrees, are errors; those that never move are reported.

    Raises:
        UnknownNameError: the robot has no such joint.
        InvalidInputError: positions that can only be degrees, or a joint of several numbers.
    """
    for name in log.joint_names:
        if name not in robot.joint_names:
            raise UnknownNameError(
                f"joint of the log in robot {robot.name!r}",
                name,
                robot.joint_names,
                'Give rename = { "its name in the log" = "the robot\'s" } or ignore = [...] under '
                "[joints] of the mapping.",
            )
        robot.velocity_index(name)
    lower, upper = robot.position_limits
    at = [robot.velocity_index(name) - robot.base_nv for name in log.joint_names]
    turning = np.array([robot.dof_units[i] == "rad" for i in at])
    with np.errstate(invalid="ignore"):
        span = np.nanmax(np.abs(log.positions), axis=0, initial=0.0)
        beyond = np.nanmax(
            np.maximum(lower[at] - log.positions, log.positions - upper[at]), axis=0, initial=0.0
        )
    wild = turning & ((span > 2 * np.pi) | (beyond > _BEYOND))
    degrees = np.radians(log.positions)
    fits = np.all(
        np.isnan(degrees) | ((degrees >= lower[at] - 0.1) & (degrees <= upper[at] + 0.1)), axis=0
    )
    worst = int(np.argmax(np.where(turning, np.maximum(span / (2 * np.pi), beyond), 0.0)))
    if wild.any() and fits[wild].all():
        raise InvalidInputError(
            f"the positions of {log.source} look like degrees: {log.joint_names[worst]} goes to "
            f'{span[worst]:.4g} rad. Give unit = "deg" under [joints] of the mapping.'
        )
    return [
        Finding(
            "joint",
            log.joint_names[k],
            f"{log.joint_names[k]} goes {beyond[k]:.3g} rad or m beyond the model's limits: check "
            "its unit, sign and offset.",
        )
        for k in np.flatnonzero(beyond > 0.05)
    ]


def check_clock(log: Log) -> list[Finding]:
    """Whether the times may be in another unit than seconds."""
    if log.step < _SLOW:
        return []
    return [
        Finding(
            "clock",
            "the log",
            f"its rows are {log.step:.4g} s apart: the times may be in ms, us or ns. Give unit "
            "under [time] of the mapping; what is said of the motion's inertia is wrong otherwise.",
        )
    ]


def check_encoders(log: Log, robot: Robot, contacts: Sequence[Contact]) -> list[Finding]:
    """Joints of the legs whose encoders say the same all along."""
    found = []
    legs = {
        model_joint for contact in contacts for model_joint in robot.limb(contact.on(robot).joint)
    }
    for name, column in zip(log.joint_names, log.positions.T, strict=True):
        known = column[np.isfinite(column)]
        if robot.joint_id(name) in legs and known.size and np.ptp(known) == 0:
            found.append(
                Finding(
                    "dead sensor",
                    name,
                    f"the position of {name}, in a leg, is the same number all along: its encoder "
                    "may be dead.",
                )
            )
    return found


def audit_forces(
    log: Log,
    robot: Robot,
    contacts: Sequence[Contact],
    normal: Float[np.ndarray, "N nc"],
) -> list[Finding]:
    """The normal forces against each other and the weight.

    Args:
        log: the log.
        robot: the robot.
        contacts: the contacts.
        normal: of each contact (N, nc) [N].

    Raises:
        InvalidInputError: no normal force was measured, or all of them point into the ground.
    """
    names, weight = [c.name for c in contacts], robot.weight
    found: list[Finding] = []
    for k, name in enumerate(names):
        own = normal[:, k]
        if not np.isfinite(own).any():
            raise InvalidInputError(
                f"no normal force of {name!r} was measured: "
                + (_why(log, name) or "no sensor of the mapping serves it.")
                + " Map one under [[wrenches]], or leave the contact out."
            )
    mean = np.nanmean(normal, axis=0)
    if np.all(mean < 0):
        raise InvalidInputError(
            f"the normal forces are negative ({', '.join(f'{m:.4g} N' for m in mean)}): the log "
            "holds what the robot does to the ground. Give sign = -1 under [[wrenches]]."
        )
    for k, name in enumerate(names):
        if mean[k] < -_AIR * weight:
            found.append(
                Finding(
                    "sign",
                    name,
                    f"the normal force of {name} is {mean[k]:.4g} N on average, and that of others "
                    "is positive: its sign seems to be the opposite. Try sign = -1 for it.",
                )
            )
        air = dated(
            "unloaded",
            name,
            f"{name} was in the air, or carried less than {_AIR:.0%} of the weight, at {{rows}} "
            "rows: {where}. They are left out.",
            np.nan_to_num(normal[:, k], nan=weight) < _AIR * weight,
            log.times,
        )
        if air is not None:
            found.append(air)
    total = normal.sum(axis=1)
    known = total[np.isfinite(total)]
    if known.size:
        middle, spread = float(known.mean()), float(known.std())
        if abs(middle - weight) > _TOTAL * weight:
            each = (middle - weight) / len(names)
            found.append(
                Finding(
                    "total",
                    "the normal forces",
                    f"they sum to {middle:.1f} ± {spread:.1f} N, and the model weighs {weight:.1f} "
                    f"N ({(middle / weight - 1):+.1%}). {_guess(middle / weight)}An offset of "
                    f"{each:.1f} N taken off each sensor would close it.",
                )
            )
    return found


def audit_feet(
    log: Log, robot: Robot, contacts: Sequence[Contact], motion: LogMotion
) -> list[Finding]:
    """How the feet moved against the first, as the joints have it."""
    model, data = robot.model, robot.model.createData()
    places = [c.on(robot) for c in contacts]
    if len(places) < 2:
        return []
    rows = np.flatnonzero(motion.known)
    rows = rows[:: max(1, len(rows) // 500)]
    poses = []
    for row in rows:
        pin.forwardKinematics(model, data, motion.configurations[row])
        feet = [data.oMi[joint] * place for joint, place in places]
        poses.append([feet[0].actInv(foot) for foot in feet[1:]])
    found = []
    for k, contact in enumerate(contacts[1:]):
        points = np.array([pose[k].translation for pose in poses])
        middle = np.median(points, axis=0)
        away = np.linalg.norm(points - middle, axis=1)
        if away.max(initial=0.0) > _SLIP:
            worst = int(np.argmax(away))
            found.append(
                Finding(
                    "slip",
                    contact.name,
                    f"{contact.name} moved {away[worst] * 1e3:.1f} mm against {contacts[0].name} "
                    "as the joints have it: it slipped, was lifted, or an encoder jumped.",
                    float(log.times[rows[worst]]),
                    float(log.times[rows[worst]]),
                )
            )
        if contact.kind != "point":
            tilt = np.arccos(np.clip([pose[k].rotation[2, 2] for pose in poses], -1, 1))
            if float(np.median(tilt)) > _TILT:
                found.append(
                    Finding(
                        "base",
                        contact.name,
                        f"{contact.name} is {np.degrees(np.median(tilt)):.1f} deg off the plane of "
                        f"{contacts[0].name}, and {middle[2] * 1e3:+.1f} mm over it: encoders with "
                        "offsets, or ground that is not one plane.",
                    )
                )
    return found


def audit_middle(
    names: Sequence[str], measured: float, predicted: dict[str, float]
) -> list[Finding]:
    """The load share with the CoM in the middle, measured against every criterion's."""
    values = np.array(list(predicted.values()))
    if not values.size or np.abs(values - measured).min() <= _SHARE:
        return []
    return [
        Finding(
            "offset",
            names[0],
            f"with the CoM in the middle {names[0]} carries {measured:.3f} of the load, and every "
            f"criterion says {values.min():.3f} to {values.max():.3f}: offsets of the sensors, or "
            "preload between the feet. Slopes do not depend on it.",
        )
    ]


def audit_slope(
    names: Sequence[str], measured: SlopeEstimate, predicted: Sequence[SlopeEstimate]
) -> list[Finding]:
    """A load that moves against the centre of mass, where every criterion has it move along."""
    if measured.high >= 0 or not predicted or min(p.value for p in predicted) < 0:
        return []
    return [
        Finding(
            "sign",
            names[0],
            f"the load of {names[0]} falls as the CoM comes nearer ({measured.value:.3f}): the "
            f"sensors of {names[0]} and {names[-1]} may be exchanged, or a hip's or ankle's sign "
            "be wrong.",
        )
    ]


def audit_com(com: Float[np.ndarray, "M 2"], cop: Float[np.ndarray, "M 2"]) -> list[Finding]:
    """The centre of mass over the ground against the measured total centre of pressure [m]."""
    apart = (cop - com)[np.isfinite(cop).all(axis=1)]
    if not len(apart):
        return []
    middle = apart.mean(axis=0)
    if np.abs(middle).max() <= _COM:
        return []
    return [
        Finding(
            "com",
            "the centre of mass",
            f"the total centre of pressure is ({middle[0] * 1e3:+.1f}, {middle[1] * 1e3:+.1f}) mm "
            "from the projected centre of mass on average (x, y): "
            + (
                "moments in other units (N mm), or about another point?"
                if np.abs(middle).max() > _FAR
                else "masses of the model, offsets of encoders or of moments."
            ),
        )
    ]


def _why(log: Log, name: str) -> str:
    return " ".join(
        f.message
        for f in log.findings
        if f.kind in ("dead sensor", "missing")
        and any(
            f.about in (w.name, f"the sensor {w.name!r}")
            for w in log.wrenches
            if name in (w.contact, w.name)
        )
    )


def _guess(ratio: float) -> str:
    """What a total that is far off may be."""
    if abs(ratio * 9.80665 - 1) < 0.15:
        return "The sensors may be in kilograms. "
    if abs(ratio - 0.5) < 0.1:
        return "A sensor may be missing. "
    if abs(ratio - 1) > 0.15:
        return "Another robot, a payload, or other units? "
    return ""
