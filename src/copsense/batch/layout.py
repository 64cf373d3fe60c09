"""RobotLayout: a robot and its contacts as the flat arrays that a kernel reads.

No posture enters here, so a layout is made once. Bodies are numbered as their joints: 0 is the
base, i the link that joint i moves; velocity i of the joints is column 5 + i.
"""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from copsense.content import ShortRepr
from copsense.listing import counted
from copsense.robot import Robot
from copsense.stance import Stance

REVOLUTE, PRISMATIC, CONTINUOUS = 0, 1, 2
MOST_CONTACTS = 4
_COVERED = ("surface", "point")


class Tree(NamedTuple):
    """A robot with one-degree-of-freedom joints. Each link's frame has its joint's axis as z.

    Attributes:
        parent: body that a body hangs on (n + 1,).
        kind: revolute, prismatic or continuous (n + 1,).
        column: where a joint stands in q (n + 1,).
        placement: rotation (three columns) and translation on the parent at zero (n + 1, 12).
        mass: of each body (n + 1,) [kg].
        moment: mass times centre of mass, body axes (n + 1, 3) [kg m].
        inertia: xx, yy, zz, xy, xz, yz about the body's origin, body axes (n + 1, 6) [kg m^2].
        carried: mass of each body and all that hangs on it (n + 1,) [kg].
        gravity: world axes (3,) [m/s^2].
        level: two unit vectors across gravity (2, 3).
    """

    parent: np.ndarray
    kind: np.ndarray
    column: np.ndarray
    placement: np.ndarray
    mass: np.ndarray
    moment: np.ndarray
    inertia: np.ndarray
    carried: np.ndarray
    gravity: np.ndarray
    level: np.ndarray


class Feet(NamedTuple):
    """Where a robot touches its environment, and the joints between.

    The **supports** are the joints that carry a contact; each belongs to a **group**, a set of
    contacts that its subtree holds. The contacts `order[:held]` are *held*: they take what the
    others leave. One surface contact can; without one, three points do.

    Attributes:
        body: which body each contact is on (nc,).
        point: 1 for a point contact (nc,).
        placement: rotation (three columns) and translation on the body (nc, 12).
        axes: a point contact's axes in the world (nc, 9).
        plane: unit normal and a point of the stated plane (nc, 6); normal zero where none is.
        order: contacts, the held ones first (nc,).
        held: how many are held: 1 or 3.
        first: first column of each contact's unknowns in the loop matrix (nc,); -1 if held.
        unknowns: columns of the loop matrix, r.
        support: bodies of the support joints, parents first (ns,).
        group: group of each support joint (ns,).
        member: whether a group holds a contact (ng, nc).
        anchor: support joint nearest above each body, as an index into `support`; -1: the base.
        rest: bodies of the joints that carry no contact (n - ns,).
        edges: half-planes (a_x, a_y, b) of every sole, inside where a p <= b (e, 3).
        edge_first: first of each contact's half-planes, and the end (nc + 1,).
        weight: m |g| [N].
    """

    body: np.ndarray
    point: np.ndarray
    placement: np.ndarray
    axes: np.ndarray
    plane: np.ndarray
    order: np.ndarray
    held: int
    first: np.ndarray
    unknowns: int
    support: np.ndarray
    group: np.ndarray
    member: np.ndarray
    anchor: np.ndarray
    rest: np.ndarray
    edges: np.ndarray
    edge_first: np.ndarray
    weight: float


@dataclass(frozen=True, eq=False, repr=False)
class RobotLayout(ShortRepr):
    """What a kernel needs to know of a robot and its contacts."""

    tree: Tree
    feet: Feet

    @property
    def parts(self) -> tuple[Tree, Feet]:
        """Both, in the order that kernels take them."""
        return self.tree, self.feet


def why_not_covered(stance: Stance) -> str:
    """Why the kernel does not serve a robot on its contacts; empty where it does."""
    robot, contacts, model = stance.robot, tuple(stance.contacts), stance.robot.model
    if stance.motion is not None:
        return "the stance moves"
    if stance.loads:
        return "there are loads beside the weight"
    if robot.drives:
        return "some joints have no motor of their own, or springs, couplings or loops"
    if model.joints[1].shortname() != "JointModelFreeFlyer":
        return "the base moves in a plane"
    for joint, name in zip(list(model.joints)[2:], robot.joint_names, strict=True):
        if joint.nv != 1 or _kind(joint) is None:
            return f"joint {name!r} is a {joint.shortname()}"
    for contact in contacts:
        if contact.kind not in _COVERED:
            return f"contact {contact.name!r} is {contact.kind}"
    if not 2 <= len(contacts) <= MOST_CONTACTS:
        are = "is" if len(contacts) == 1 else "are"
        return f"there {are} {counted(len(contacts), 'contact')}"
    if len(contacts) == 2 and all(contact.kind == "point" for contact in contacts):
        return "two points cannot hold a robot"
    if importlib.util.find_spec("numba") is None:
        return 'Numba is not installed (pip install "copsense[fast]")'
    return ""


def robot_layout(stance: Stance, edges: list[np.ndarray]) -> RobotLayout:
    """The layout of a robot on its contacts; `edges` holds each sole's half-planes (e, 3)."""
    turns = _axis_frames(stance.robot.model)
    return RobotLayout(_tree(stance.robot, turns), _feet(stance, turns, edges))


def _kind(joint: pin.JointModel) -> int | None:
    name = joint.shortname().removeprefix("JointModel")
    if name in ("RX", "RY", "RZ", "RevoluteUnaligned"):
        return REVOLUTE
    if name in ("PX", "PY", "PZ", "PrismaticUnaligned"):
        return PRISMATIC
    if name in ("RUBX", "RUBY", "RUBZ", "RevoluteUnboundedUnaligned"):
        return CONTINUOUS
    return None


def _axis_frames(model: pin.Model) -> list[np.ndarray]:
    """For each body, the rotation in its Pinocchio frame of one whose z is the joint's axis."""
    data, frames = model.createData(), [np.eye(3)]
    pin.computeJointJacobians(model, data, pin.neutral(model))
    for i in range(2, model.njoints):
        column = pin.getJointJacobian(model, data, i, pin.ReferenceFrame.LOCAL)[
            :, model.joints[i].idx_v
        ]
        axis = column[:3] if _kind(model.joints[i]) == PRISMATIC else column[3:]
        frames.append(pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), axis).matrix())
    return frames


def _tree(robot: Robot, turns: list[np.ndarray]) -> Tree:
    model = robot.model
    n = model.njoints - 2
    parent = np.array([max(model.parents[i] - 1, 0) for i in range(1, n + 2)], dtype=np.int64)
    kind, column = np.zeros(n + 1, dtype=np.int64), np.zeros(n + 1, dtype=np.int64)
    placement, mass = np.zeros((n + 1, 12)), np.zeros(n + 1)
    moment, inertia = np.zeros((n + 1, 3)), np.zeros((n + 1, 6))
    for i in range(n + 1):
        joint, place, body = (
            model.joints[i + 1],
            model.jointPlacements[i + 1],
            model.inertias[i + 1],
        )
        above = turns[parent[i]] if i else np.eye(3)
        kind[i] = _kind(joint) if i else REVOLUTE
        column[i] = joint.idx_q
        placement[i, :9] = (above.T @ place.rotation @ turns[i]).T.ravel()
        placement[i, 9:] = above.T @ place.translation
        mass[i] = body.mass
        lever = turns[i].T @ body.lever
        moment[i] = body.mass * lever
        about = turns[i].T @ body.inertia @ turns[i]
        about += body.mass * ((lever @ lever) * np.eye(3) - np.outer(lever, lever))
        inertia[i] = about[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    carried = mass.copy()
    for i in range(n, 0, -1):
        carried[parent[i]] += carried[i]
    g = np.array(model.gravity.linear)
    # Rows of V' beyond the first are orthonormal and across g.
    level = np.linalg.svd(g[None])[2][1:]
    return Tree(parent, kind, column, placement, mass, moment, inertia, carried, g, level.copy())


def _feet(stance: Stance, turns: list[np.ndarray], edges: list[np.ndarray]) -> Feet:
    robot, contacts = stance.robot, stance.contacts
    nc = len(contacts)
    body, placement = np.zeros(nc, dtype=np.int64), np.zeros((nc, 12))
    axes, plane = np.zeros((nc, 9)), np.zeros((nc, 6))
    point = np.array([c.kind == "point" for c in contacts], dtype=np.int64)
    for k, contact in enumerate(contacts):
        at = contact.on(robot)
        body[k], place = at.joint - 1, at.placement
        placement[k, :9] = (turns[body[k]].T @ place.rotation).T.ravel()
        placement[k, 9:] = turns[body[k]].T @ place.translation
        if point[k]:
            axes[k] = stance.placements[k].rotation.T.ravel()
        if contact.plane is not None:
            plane[k] = [*contact.plane.normal, *contact.plane.point]
    order = np.argsort(point, kind="stable")
    held = 3 if point.all() else 1
    first, unknowns = np.full(nc, -1, dtype=np.int64), 3 if held == 3 else 0
    for k in order[held:]:
        first[k], unknowns = unknowns, unknowns + (3 if point[k] else 6)
    support, group, member, anchor = _supports(stance)
    ends = np.cumsum([0] + [len(e) for e in edges])
    return Feet(
        body,
        point,
        placement,
        axes,
        plane,
        order,
        held,
        first,
        unknowns,
        support,
        group,
        member,
        anchor,
        np.setdiff1d(np.arange(1, robot.model.njoints - 1), support),
        np.vstack([np.zeros((0, 3)), *edges]),
        ends.astype(np.int64),
        robot.weight,
    )


def _supports(stance: Stance) -> tuple[np.ndarray, ...]:
    """Support joints, their groups, the groups' contacts, and every body's anchor."""
    model = stance.robot.model
    n = model.njoints - 2
    holds: list[list[int]] = [[] for _ in range(n + 1)]
    for k, contact in enumerate(stance.contacts):
        for joint in stance.limb(contact):
            holds[joint - 1].append(k)
    support = [i for i in range(1, n + 1) if holds[i]]
    sets = sorted({tuple(holds[i]) for i in support})
    member = np.zeros((len(sets), len(stance.contacts)), dtype=np.int64)
    for g, contacts in enumerate(sets):
        member[g, list(contacts)] = 1
    anchor = np.full(n + 1, -1, dtype=np.int64)
    for i in range(1, n + 1):
        above = model.parents[i + 1] - 1
        while above > 0 and not holds[above]:
            above = model.parents[above + 1] - 1
        anchor[i] = support.index(above) if above > 0 else -1
    group = [sets.index(tuple(holds[i])) for i in support]
    return np.array(support, dtype=np.int64), np.array(group, dtype=np.int64), member, anchor
