"""Families that can be identified: those of the design, and joint stiffnesses."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from jaxtyping import Float

from copsense.criterion import Criterion
from copsense.design import Family, families, joint_groups
from copsense.errors import UnknownNameError
from copsense.quadratic import Quadratic
from copsense.stance import Stance
from copsense.stiffness import stiffness

_STEP = 1e-4  # of a logarithm: weights are powers of their parameters, the error is 1e-9 of them


def identifiable(stance: Stance) -> dict[str, Family]:
    """Families by name: ``length``, ``mix``, ``joints`` and ``stiffness``.

    Those of `copsense.design`, with the joint groups' stiffnesses beside their weights. The last
    group counts 1: a common scale is never visible.
    """
    found = families(stance)
    groups = joint_groups(stance)
    free = tuple(groups)[:-1]
    if free:
        bounds = ((1e-2, 1e2),) * len(free)
        build = partial(_of_stiffness, tuple(groups[name] for name in free))
        found["stiffness"] = Family(
            "stiffness", tuple(f"{g}_stiffness" for g in free), bounds, build
        )
    return found


def identifiable_named(stance: Stance, name: str) -> Family:
    """One of `identifiable` by its name.

    Raises:
        UnknownNameError: no such family.
    """
    known = identifiable(stance)
    if name not in known:
        raise UnknownNameError("family", name, known)
    return known[name]


def built(family: Family, logarithms: Sequence[float] | Float[np.ndarray, " p"]) -> Criterion:
    """The criterion of a family at logarithms of its parameters."""
    return family.build(np.exp(np.asarray(logarithms)).tolist())


def weight_changes(
    family: Family, logarithms: Sequence[float], stance: Stance
) -> tuple[Quadratic, ...]:
    """Derivatives of a family's weights by the logarithm of each parameter."""
    found = []
    for i in range(len(logarithms)):
        moved = _STEP * np.eye(len(logarithms))[i]
        moved = _STEP * np.eye(len(logarithms))[i]
        high, low = (built(family, np.array(logarithms) + s * moved).at(stance) for s in (1, -1))
        parts = (
            (getattr(high, name) - getattr(low, name)) / (2 * _STEP)
            for name in ("torque", "inertia", "wrench", "pull")
        )
        found.append(Quadratic(*parts))
    return tuple(found)


def _of_stiffness(groups: tuple[tuple[str, ...], ...], parameters: Sequence[float]) -> Criterion:
    joints = {"*": 1.0}
    for names, value in zip(groups, parameters, strict=True):
        joints |= dict.fromkeys(names, float(value))
    return stiffness(joints)
