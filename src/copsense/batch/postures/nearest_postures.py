"""Nearest postures: whole postures in, the nearest ones with the contacts in place out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from copsense.batch.postures.chart import PostureChart
from copsense.batch.postures.coordinates import (
    BASE,
    Coordinates,
    Limb,
    chart_coordinates,
)
from copsense.errors import InvalidInputError
from copsense.stance import Stance


class NearestPostures(PostureChart):
    """The postures nearest to some that need not keep the contacts in place.

    Its values are all the numbers of a posture: x, y, z and roll, pitch, yaw of the base, then the
    joints. Newton's method takes the smallest steps in these that put the contacts where the
    stance has them, so that a posture with its contacts in place is its own.
    """

    nearest = True

    def __init__(self, stance: Stance, *, compiled: bool = True) -> None:
        """Set the search up.

        Args:
            stance: where the contacts are.
            compiled: as of `PostureChart`.

        Raises:
            InvalidInputError: a joint has several degrees of freedom.
        """
        super().__init__(stance, stance.robot.joint_names, compiled=compiled)

    @staticmethod
    def _meaning_on(stance: Stance, names: Sequence[str]) -> Coordinates:
        robot = stance.robot
        nb, nv = robot.base_nv, int(robot.model.nv)
        if nv - nb != len(robot.joint_names):
            raise InvalidInputError(
                f"robot {robot.name!r} has a joint of several degrees of freedom, which whole "
                "postures are not taken of. Name coordinates instead."
            )
        plan = chart_coordinates(stance, names)
        base = BASE if nb == 6 else ("base_y", "base_z", "roll")
        turns = ("roll", "pitch", "yaw")
        return replace(
            plan,
            names=(*base, *plan.names),
            units=(*("rad" if name in turns else "m" for name in base), *plan.units),
            place=np.arange(nv, dtype=np.int64),
            turned=nb == 6,
            limbs=(Limb(tuple(range(len(stance.contacts))), tuple(range(nv))),),
        )
