"""Gains: stiffness and damping of a balancing controller, and two documented sets."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from copsense.arrays import check_type, finite_array, finite_number
from copsense.content import freeze
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.robot import Robot


@dataclass(frozen=True)
class Gains:
    """Gains of the momentum task and of the posture task.

    Attributes:
        com_stiffness: Kp of the centre of mass, world x, y, z [1/s^2].
        com_damping: Kd of the centre of mass, world x, y, z [1/s].
        momentum_damping: Kp_w on the angular momentum beyond the reference's own [1/s].
        momentum_stiffness: Ki_w on the angular momentum's integral, A_G(q) (q - q_d) [1/s^2].
        posture_stiffness: Kp of every joint, or of each by name. With `scaled_by_inertia`
            [1/s^2], times the joint's effective inertia; otherwise [Nm/rad].
        posture_damping: Kd likewise, [1/s] or [Nm s/rad].
        scaled_by_inertia: whether the posture's gains are multiplied by 1/diag(M_s^-1), M_s the
            joints' inertia with the base free, at the starting posture.
    """

    com_stiffness: tuple[float, float, float] = (50.0, 50.0, 50.0)
    com_damping: tuple[float, float, float] = (14.1, 14.1, 14.1)
    momentum_damping: float = 10.0
    momentum_stiffness: float = 25.0
    posture_stiffness: float | Mapping[str, float] = 200.0
    posture_damping: float | Mapping[str, float] = 28.3
    scaled_by_inertia: bool = True

    def __post_init__(self) -> None:
        """Own them; validate that all are finite. Unstable ones are allowed."""
        freeze(self, "posture_stiffness", "posture_damping")
        for name in ("com_stiffness", "com_damping"):
            finite_array(getattr(self, name), f"the gain {name}", (3,), "world x, y, z")
        for name in ("momentum_damping", "momentum_stiffness"):
            finite_number(getattr(self, name), f"the gain {name}")
        for name in ("posture_stiffness", "posture_damping"):
            value = getattr(self, name)
            for joint, gain in value.items() if isinstance(value, Mapping) else [("", value)]:
                finite_number(gain, f"the gain {name}" + (f" of joint {joint!r}" if joint else ""))

    def per_joint(self, robot: Robot) -> tuple[np.ndarray, np.ndarray]:
        """Posture stiffness and damping (n,) in the robot's order, before any scaling."""
        found = []
        for name in ("posture_stiffness", "posture_damping"):
            value = getattr(self, name)
            if isinstance(value, Mapping):
                for joint in value:
                    if joint not in robot.torque_names:
                        raise UnknownNameError(
                            f"joint in the gain {name}", joint, robot.torque_names
                        )
                missing = [joint for joint in robot.torque_names if joint not in value]
                if missing:
                    raise InvalidInputError(
                        f"the gain {name} lacks {', '.join(missing)}. Give every joint a gain, "
                        "or one number for all."
                    )
                found.append(np.array([float(value[joint]) for joint in robot.torque_names]))
            else:
                found.append(np.full(len(robot.torque_names), float(value)))
        return found[0], found[1]


STIFF = Gains()
"""Well damped at 1 kHz: tracks a slow sway to micrometres. The default."""

# 2 sqrt(Kp) / 20, as the public configurations have it.
_PUBLIC_DAMPING = tuple(2.0 * kp**0.5 / 20.0 for kp in (50.0, 50.0, 10.0))


def public_gains(robot: Robot) -> Gains:
    """Gains similar to those that the authors published with their iCub controllers.

    Soft, for a robot with friction in its joints: CoM 50, 50, 10 1/s^2 with a twentieth of the
    critical damping per axis, angular momentum 1 1/s and 0.25 1/s^2, posture 10 to 100 Nm/rad.

    Args:
        robot: gives the joints; those of the legs are stiffer than torso and arms.
    """
    check_type(robot, Robot, "a robot", "Give stance.robot, or copsense.load_robot(...).")
    stiffness = {}
    for joint in robot.torque_names:
        leg = any(word in joint for word in ("hip", "knee", "ankle", "leg"))
        torso = "torso" in joint or "waist" in joint
        stiffness[joint] = 100.0 if leg and "ankle" not in joint else 30.0 if leg or torso else 10.0
    damping = {joint: 2.0 * kp**0.5 / 20.0 for joint, kp in stiffness.items()}
    x, y, z = _PUBLIC_DAMPING
    return Gains((50.0, 50.0, 10.0), (x, y, z), 1.0, 0.25, stiffness, damping, False)
