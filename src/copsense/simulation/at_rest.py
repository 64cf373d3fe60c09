"""at_rest_note: what yields where a robot stands already, before any motion, and what would not.

A criterion without limits may want a centre of pressure outside its sole, or a contact that pulls.
No ground does that: it acts otherwise, and the robot may tip at once, whatever its controller does.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from copsense.contact import Contact
from copsense.cop import wrench_cops
from copsense.criterion import Criterion, minimum_wrench
from copsense.errors import CopsenseError, InfeasibleError
from copsense.freedom import repetition_notes
from copsense.limits import Limits
from copsense.statics import StaticEquilibrium, solve_equilibrium

_BEYOND = 1e-6  # m, or share of the weight: what is less beyond its bound is on it


def at_rest_note(
    start: StaticEquilibrium, criterion: Criterion, friction: Mapping[str, float]
) -> str:
    """What cannot be held at rest, which contact says so, and the remedy; "" where all can.

    Args:
        start: the equilibrium in question.
        criterion: what chose it.
        friction: of the ground under each contact, by name.
    """
    broken = _broken(start, friction)
    if not broken:
        return ""
    within = Limits(friction=dict(friction))
    other = minimum_wrench(1.0)
    remedies = []
    try:
        solve_equilibrium(start.stance, criterion, within)
        remedies.append("give limits (--limits cop-margin=0, limits=Limits()), within which it can")
    except InfeasibleError:
        return (
            f"This posture cannot be held at rest: {'; '.join(broken)} under {criterion.name}, and "
            "no wrenches within what soles and friction allow balance it. Move the CoM over the "
            "feet."
        )
    except CopsenseError:  # what cannot be solved is not proposed
        pass
    try:
        if criterion.name != other.name and not _broken(
            solve_equilibrium(start.stance, other), friction
        ):
            if repetition_notes(start.stance):
                remedies.clear()  # within limits too it shares by next to nothing
            remedies.append(f"another criterion: {other.name} holds it as it is")
    except CopsenseError:
        pass
    remedy = ", or ".join(remedies) or "move the CoM, or widen the stance"
    return (
        f"{criterion.name} cannot hold this posture at rest without limits: {'; '.join(broken)}. "
        "The ground acts otherwise then, and the robot may tip or slip at once. "
        f"{remedy[0].upper()}{remedy[1:]}."
    )


def _broken(at: StaticEquilibrium, friction: Mapping[str, float]) -> list[str]:
    """A clause for every contact that does not stay in its place."""
    stance = at.stance
    clauses = [
        _clause(contact, wrench, friction[contact.name], stance.robot.weight)
        for contact, wrench in zip(stance.contacts, at.wrenches, strict=True)
    ]
    return [clause for clause in clauses if clause]


def _clause(contact: Contact, wrench: np.ndarray, friction: float, weight: float) -> str:
    normal, tangential = float(wrench[2]), float(np.hypot(*wrench[:2]))
    if normal < -_BEYOND * weight:
        return f"{contact.name} would have to pull with {-normal:.1f} N"
    if contact.sole is not None and normal > _BEYOND * weight:
        outside = -contact.sole.margin(wrench_cops(wrench[None])[0]).distance
        if outside > _BEYOND:
            return (
                f"the centre of pressure of {contact.name} would lie {outside * 1e3:.1f} mm "
                "outside its sole"
            )
    if tangential - friction * normal > _BEYOND * weight:
        return (
            f"{contact.name} would need a friction of {tangential / max(normal, 1e-9):.2f}, where "
            f"the ground has {friction:g}"
        )
    return ""
