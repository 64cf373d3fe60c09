"""tendons: what a tendon of a compiled MJCF runs along."""

from __future__ import annotations

from typing import Any

import mujoco

_JOINT, _SITE = int(mujoco.mjtWrap.mjWRAP_JOINT), int(mujoco.mjtWrap.mjWRAP_SITE)


def tendon_bodies(mj: Any, tendon: int) -> set[int]:
    """Bodies that a tendon is fixed to, or whose joints it pulls."""
    bodies = set()
    for w in _wraps(mj, tendon):
        kind, number = mj.wrap_type[w], int(mj.wrap_objid[w])
        if kind == _JOINT:
            bodies.add(int(mj.jnt_bodyid[number]))
        elif kind == _SITE:
            bodies.add(int(mj.site_bodyid[number]))
    return bodies


def tendon_joints(mj: Any, tendon: int) -> dict[int, float] | None:
    """Joint -> coefficient of a fixed tendon; None for a spatial one."""
    found: dict[int, float] = {}
    for w in _wraps(mj, tendon):
        if mj.wrap_type[w] != _JOINT:
            return None
        joint = int(mj.wrap_objid[w])
        found[joint] = found.get(joint, 0.0) + float(mj.wrap_prm[w])
    return found


def _wraps(mj: Any, tendon: int) -> range:
    first = int(mj.tendon_adr[tendon])
    return range(first, first + int(mj.tendon_num[tendon]))
