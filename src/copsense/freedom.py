"""Freedom: what the contacts of a stance hold fast, and the joints that a limb lacks."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from copsense.contact import Contact
from copsense.errors import InvalidInputError
from copsense.listing import listed
from copsense.reach import chain_lengths
from copsense.stance import RANK_TOLERANCE, Stance
from copsense.unheld import moved_joints

_AXES = (
    "along x",
    "along y",
    "along z",
    "about x (roll)",
    "about y (pitch)",
    "about z (yaw)",
)
_STILL = 1e-4  # m, per unit of motion: what moves the CoM less leaves it where it is
_ALIKE = 0.02  # singular values under which constraints all but say the same; usual are 0.05 up
_ELSEWHERE = 0.6  # rad, m: joints moved by so much bend a straight limb
_STRAIGHT = 0.02  # singular value of a straight limb, in shares of its usual one
_SHARE = 0.01  # share of a lost direction from which a rotation is said to be missing


def held_com_axes(stance: Stance) -> tuple[int, ...]:
    """Axes 0..2 of the world along which no motion moves the centre of mass."""
    speeds = stance.com_jacobian @ stance.admissible_motions
    still = np.linalg.norm(speeds, axis=1) < _STILL
    return tuple(int(axis) for axis in np.flatnonzero(still))


def check_com_moves(stance: Stance, axis: int) -> None:
    """Reject a path along an axis of the world on which the contacts hold the centre of mass.

    Raises:
        InvalidInputError: no motion with the contacts in place moves it there.
    """
    reason = com_held(stance, axis)
    if reason:
        raise InvalidInputError(reason)


def com_held(stance: Stance, axis: int) -> str:
    """Why no motion moves the centre of mass along an axis of the world, in words; else ""."""
    held = held_com_axes(stance)
    if axis not in held:
        return ""
    free = [f"CoM {'xyz'[i]}" for i in range(3) if i not in held]
    lacking = "; ".join(missing_joints(stance))
    return (
        f"the contacts of {stance.robot.name!r} hold the CoM's {'xyz'[axis]} fast: no posture with "
        "them in place moves it."
        + (f" {lacking[0].upper()}{lacking[1:]}." if lacking else "")
        + f" Move {' or '.join([*free, 'a joint'])} instead, or give fewer contacts, or points."
    )


def com_span(stance: Stance) -> float:
    """A length that the CoM's travel cannot exceed while the contacts stay in place [m].

    With a contact in place every link stays within its chain's length of it, so the CoM within
    R = length to the base + mass-weighted length from the base, and two such places are within 2 R
    of each other. Infinite where a prismatic joint has no end.
    """
    robot = stance.robot
    model = robot.model
    far = chain_lengths(robot)
    spread = sum(
        inertia.mass * (far[k] + float(np.linalg.norm(inertia.lever)))
        for k, inertia in enumerate(model.inertias)
    )
    feet = []
    for contact in stance.contacts:
        where = contact.on(robot)
        feet.append(far[where.joint] + float(np.linalg.norm(where.placement.translation)))
    return 2.0 * (min(feet) + spread / robot.mass)


def missing_joints(stance: Stance) -> tuple[str, ...]:
    """What limbs with too few joints cannot do, a clause for each kind; empty where none lacks any.

    A joint about the named axis of the contact frame would free it.
    """
    tied = _tied_joints(stance)
    limbs: dict[tuple[str, str], list[str]] = {}
    for contact in stance.contacts:
        if tied.intersection(stance.limb(contact)):
            continue  # joints of a loop or coupling do not move alone
        lacks, count = _lacking(stance, contact), len(stance.limb(contact))
        free = len(contact.components)
        if lacks and count < free:
            joints = f"{count or 'no'} joint{'s' * (count != 1)}"
            why = f"where {free} place it freely, none {' or '.join(lacks)}"
            limbs.setdefault((joints, why), []).append(contact.name)
    return tuple(
        f"the limb{'s' * (len(names) > 1)} of {listed(names)} "
        + (f"have {joints} each {why}" if len(names) > 1 else f"has {joints} {why}")
        for (joints, why), names in limbs.items()
    )


def freedom_notes(stance: Stance) -> tuple[str, ...]:
    """What the contacts hold twice, or hold that one would expect to move; empty where nothing."""
    rows, repeated = len(stance.constraints), (*repetition_notes(stance), *hanging_notes(stance))
    if stance.rank == rows:
        return repeated
    held = [f"CoM's {'xyz'[axis]}" for axis in held_com_axes(stance) if axis < 2]
    still = f"; they hold the {' and '.join(held)} fast" if held else ""
    why = "; ".join(missing_joints(stance))
    return (
        f"The contacts hold {stance.rank} of {rows} directions: {rows - stance.rank} of them "
        f"{'is' if rows - stance.rank == 1 else 'are'} held twice, by forces that the motors do "
        f"not feel{still}." + (f" {why[0].upper()}{why[1:]}." if why else ""),
        *repeated,
    )


def repetition_notes(stance: Stance) -> tuple[str, ...]:
    """Whether contacts, loops and couplings all but repeat each other; empty where they do not.

    What repeats it exactly counts as held twice; what nearly does carries forces that rigid statics
    demand, and that nothing real, or simulated, shares so.
    """
    sizes = np.linalg.svd(stance.constraints, compute_uv=False)
    least = float(sizes[sizes > RANK_TOLERANCE].min(initial=np.inf))
    if least > _ALIKE:
        return ()
    contacts = np.linalg.svd(stance.jacobian, compute_uv=False)
    alone = float(contacts[contacts > RANK_TOLERANCE].min(initial=np.inf)) <= _ALIKE
    if alone:
        what = "The contacts all but repeat what they hold themselves"
    else:
        what = "Loops and couplings all but repeat what the contacts hold"
    lacks = "".join(f" {clause[0].upper()}{clause[1:]}." for clause in missing_joints(stance))
    return (
        f"{what} (smallest singular value "
        f"{least:.1e}): links and ground that yield by a little share the forces between them "
        f"otherwise than these rigid ones, and feet may creep.{lacks}",
    )


def straight_note(stance: Stance) -> str:
    """Which limbs are all but straight, and the joints to bend; "" where none is.

    The joints of a straight limb do not bring its contact nearer, and its motors do not feel the
    load along it. It is found as a direction that the limb's joints move far better elsewhere.
    """
    tied = _tied_joints(stance)
    random = np.random.default_rng(0)
    robot = stance.robot
    away = np.zeros(robot.model.nv)
    away[robot.base_nv :] = random.uniform(-_ELSEWHERE, _ELSEWHERE, len(robot.dof_names))
    elsewhere = stance.at(pin.integrate(robot.model, stance.q, away), check=False)
    limbs, bends = [], []
    for contact, rows in zip(stance.contacts, stance.rows, strict=True):
        if tied.intersection(stance.limb(contact)):
            continue
        columns = _limb_columns(stance, contact)
        usual = np.linalg.svd(elsewhere.jacobian[rows][:, columns], compute_uv=False)
        rank = int(np.sum(usual > RANK_TOLERANCE))
        _, sizes, turns = np.linalg.svd(stance.jacobian[rows][:, columns])
        if rank and sizes[rank - 1] < _STRAIGHT * usual[rank - 1]:
            limbs.append(contact.name)
            most = int(np.argmax(np.abs(turns[rank - 1])))
            bends.append(robot.dof_names[columns[most] - robot.base_nv])
    if not limbs:
        return ""
    plural = len(limbs) > 1
    return (
        f"the limb{'s' * plural} of {listed(limbs)} {'are' if plural else 'is'} all but straight: "
        f"motors do not feel the load along {'them' if plural else 'it'}, and the least change of "
        f"height asks for torques without end. Bend {listed(list(dict.fromkeys(bends)))} "
        "(--posture, posture=)."
    )


def hanging_notes(stance: Stance) -> tuple[str, ...]:
    """What no motor, contact, loop or coupling holds, and whether it would stay; empty for none."""
    motions = stance.hanging_motions
    if not motions.shape[1]:
        return ()
    names = moved_joints(stance.robot, motions)
    it = "it" if len(names) == 1 else "they"
    stiffness = stance.hanging_derivative @ motions
    least = float(np.linalg.eigvalsh((stiffness + stiffness.T) / 2)[0])
    fall = f" But {it} would fall at the least touch (stiffness {least:.3g} Nm/rad)."
    return (
        f"No motor holds {', '.join(names)}: {it} hang{'s' * (it == 'it')} where gravity and "
        f"springs leave a rest, and every posture follows.{fall if least <= 0.0 else ''}",
    )


def _tied_joints(stance: Stance) -> set[int]:
    """Indices of the joints that loops and couplings move together."""
    if stance.closures is None:
        return set()
    moved = np.abs(stance.closures.jacobian).max(axis=0) > RANK_TOLERANCE
    joints = list(stance.robot.model.joints)
    return {
        i
        for i in range(2, len(joints))
        if moved[joints[i].idx_v : joints[i].idx_v + joints[i].nv].any()
    }


def _limb_columns(stance: Stance, contact: Contact) -> list[int]:
    """Where the joints from the base to a contact stand in a velocity."""
    joints = stance.robot.model.joints
    return [joints[i].idx_v + k for i in stance.limb(contact) for k in range(joints[i].nv)]


def _lacking(stance: Stance, contact: Contact) -> list[str]:
    """Axes of a contact frame along or about which its limb cannot move it, rotations first."""
    rows = stance.rows[stance.contact_names.index(contact.name)]
    u, s, _ = np.linalg.svd(stance.jacobian[rows][:, _limb_columns(stance, contact)])
    lost = u[:, int(np.sum(s > RANK_TOLERANCE)) :]
    named: list[int] = []
    while lost.shape[1]:
        shares = np.sum(lost**2, axis=1)
        turns = [i for i, c in enumerate(contact.components) if c > 2]
        best = max(turns, key=lambda i: shares[i]) if turns else 0
        if not turns or shares[best] < _SHARE:
            best = int(np.argmax(shares))
        named.append(contact.components[best])
        # A joint there would leave what has no part in it.
        lost = lost @ np.linalg.svd(lost[best : best + 1])[2][1:].T
    return [_AXES[axis] for axis in sorted(named, reverse=True)]
