"""View: everything that is shown of one state, as plain numbers and words."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from copsense.analysis.verdicts import ranked
from copsense.content import ShortRepr, freeze
from copsense.explore.state import State
from copsense.limits import Limits
from copsense.listing import listed
from copsense.margins import limit_margins
from copsense.sensitivity import CopSensitivity
from copsense.skeleton import skeleton
from copsense.stance import Stance
from copsense.statics import ConstrainedEquilibrium


@dataclass(frozen=True, eq=False, repr=False)
class CriterionView(ShortRepr):
    """What one criterion says at a posture; contacts in the stance's order.

    Attributes:
        name: of the criterion.
        wrenches: on the robot, contact axes [N, N m].
        cop: centres of pressure, contact axes [m].
        cop_world: the same in the world [m].
        forces: of the contacts, world axes [N].
        load_share: f_z / (m g).
        margin: of each CoP to its sole's nearest edge [m]; infinite without a sole.
        margin_side: which edge that is, in words; empty without a sole.
        com_travel: how far the CoM may go, to first order, until the contact tips [m].
        unloading_travel: until it carries nothing [m].
        gain: d CoP_y / d CoM_y, contact axes.
        torques: joint torques [N m, or N].
        effort: the torques' sizes as shares of the model's effort limits; NaN where it gives none.
        active: limits that hold with equality; empty without limits.
        nearest: the limit with the smallest margin of its unit, as words; empty without limits.
        moving_cop: centres of pressure with the inertia of the posture's motion, contact axes [m];
            None where no motion is played.
        moving_cop_world: the same in the world [m].
    """

    name: str
    wrenches: Float[np.ndarray, "nc 6"]
    cop: Float[np.ndarray, "nc 2"]
    cop_world: Float[np.ndarray, "nc 3"]
    forces: Float[np.ndarray, "nc 3"]
    load_share: Float[np.ndarray, " nc"]
    margin: Float[np.ndarray, " nc"]
    margin_side: tuple[str, ...]
    com_travel: Float[np.ndarray, " nc"]
    unloading_travel: Float[np.ndarray, " nc"]
    gain: Float[np.ndarray, " nc"]
    torques: Float[np.ndarray, " n"]
    effort: Float[np.ndarray, " n"]
    active: tuple[str, ...] = ()
    nearest: tuple[str, ...] = ()
    moving_cop: Float[np.ndarray, "nc 2"] | None = None
    moving_cop_world: Float[np.ndarray, "nc 3"] | None = None

    def __post_init__(self) -> None:
        """Own the arrays."""
        arrays = (f for f in self.__dataclass_fields__ if f not in _WORDS)
        freeze(self, *(f for f in arrays if getattr(self, f) is not None))


_WORDS = ("name", "margin_side", "active", "nearest")


@dataclass(frozen=True, eq=False, repr=False)
class RegionView(ShortRepr):
    """A region of the CoM.

    Attributes:
        name: what leaves it.
        corners: world x and y [m].
    """

    name: str
    corners: Float[np.ndarray, "k 2"]

    def __post_init__(self) -> None:
        """Own the corners."""
        freeze(self, "corners")


@dataclass(frozen=True, eq=False, repr=False)
class View(ShortRepr):
    """What is shown of one state: plain data, without a window to show it in.

    Attributes:
        state: what was asked for.
        revision: number of the request; a later one has a greater.
        q: configuration (nq,).
        com: centre of mass in the world [m].
        joints: names of the model's joints, the universe first.
        poses: of each joint in the world: x, y, z [m], then the quaternion w, x, y, z.
        bones: segments of the stick figure, world [m].
        contacts: names.
        placements: of each contact in the world, as `poses`.
        soles: outline of each sole in the world [m]; no corner without a sole.
        load_points: where known loads act, in the world [m].
        load_forces: and with which force, world axes [N].
        torque_names: of the torques.
        torque_units: ``"Nm"`` or ``"N"`` for each.
        criteria: what each criterion says.
        notes: joints beyond their limits, criteria that are left out, and why.
        reason: why the state has no posture; the rest is then the last view that had one.
        curve_y: world y of the CoM along the lateral path [m]; empty until it is known.
        curve_criteria: whose curves follow.
        curve_margin: least margin of any contact there, criterion by criterion [m]; NaN without a
            sole.
        curve_share: least share of the weight that any contact carries there, likewise.
        regions: of the CoM; None until they are known.
        binding: what is met first on the way to either side within limits, a line each; None until
            it is known.
        row: of a run that is played; None where the posture is asked for.
        measured: centres of pressure in the world (nc, 3) [m], NaN where a contact carries nothing;
            None where nothing was measured.
    """

    state: State
    revision: int
    q: Float[np.ndarray, " nq"]
    com: Float[np.ndarray, " 3"]
    joints: tuple[str, ...]
    poses: Float[np.ndarray, "j 7"]
    bones: Float[np.ndarray, "s 2 3"]
    contacts: tuple[str, ...]
    placements: Float[np.ndarray, "nc 7"]
    soles: tuple[np.ndarray, ...]
    load_points: Float[np.ndarray, "l 3"]
    load_forces: Float[np.ndarray, "l 3"]
    torque_names: tuple[str, ...]
    torque_units: tuple[str, ...]
    criteria: tuple[CriterionView, ...]
    notes: tuple[str, ...] = ()
    reason: str = ""
    curve_y: Float[np.ndarray, " m"] = field(default_factory=lambda: np.zeros(0))
    curve_criteria: tuple[str, ...] = ()
    curve_margin: Float[np.ndarray, "k m"] = field(default_factory=lambda: np.zeros((0, 0)))
    curve_share: Float[np.ndarray, "k m"] = field(default_factory=lambda: np.zeros((0, 0)))
    regions: tuple[RegionView, ...] | None = None
    binding: tuple[str, ...] | None = None
    row: int | None = None
    measured: Float[np.ndarray, "nc 3"] | None = None

    def __post_init__(self) -> None:
        """Own the arrays."""
        arrays = ("q", "com", "poses", "bones", "placements", "soles", "load_points", "load_forces")
        given = ("measured",) if self.measured is not None else ()
        freeze(self, *arrays, "curve_y", "curve_margin", "curve_share", *given)

    def __getitem__(self, name: str) -> CriterionView:
        """What the criterion of that name says."""
        for each in self.criteria:
            if each.name == name:
                return each
        raise KeyError(name)

    @property
    def ground(self) -> float:
        """Height of the lowest contact in the world [m]."""
        return float(self.placements[:, 2].min())

    @property
    def rows(self) -> list[tuple[str, ...]]:
        """The table: criterion, contact, load, CoP x and y, margin, what the CoM may travel."""
        return [
            (
                c.name,
                contact,
                f"{c.load_share[k] * 100:.1f} %",
                ", ".join(f"{round(1e3 * float(v), 1) + 0.0:+.1f}" for v in c.cop[k]),
                _margin_text(float(c.margin[k]), c.margin_side[k]),
                _first_event(float(c.com_travel[k]), float(c.unloading_travel[k]), self._span),
            )
            for c in self.criteria
            for k, contact in enumerate(self.contacts)
        ]

    @property
    def motion_lines(self) -> tuple[str, ...]:
        """Where centres of pressure are in motion and as measured, a line each; world axes."""
        found = [
            (f"{c.name}, in motion", c.moving_cop_world)
            for c in self.criteria
            if c.moving_cop_world is not None
        ]
        if self.measured is not None:
            found.append(("measured", self.measured))
        return tuple(
            f"{what}: CoP x, y in the world "
            + "; ".join(
                f"{name} {1e3 * x:+.1f}, {1e3 * y:+.1f} mm" if np.isfinite(x) else f"{name} none"
                for name, (x, y, _) in zip(self.contacts, places, strict=True)
            )
            for what, places in found
        )

    @property
    def _span(self) -> float:
        """No CoM goes farther than this with its contacts in place [m]."""
        return 2.0 * float(np.ptp(self.bones.reshape(-1, 3), axis=0).max(initial=1.0))

    @property
    def verdict(self) -> str:
        """What yields first under the criterion that lasts longest, and under the others."""
        reach = {}
        for c in self.criteria:
            travel = np.minimum(c.com_travel, c.unloading_travel)
            k = int(np.argmin(travel))
            word = "tips" if c.com_travel[k] <= c.unloading_travel[k] else "unloads"
            far = float(travel[k])
            reach[c.name] = (far if far <= self._span else math.inf, f"{self.contacts[k]} {word}")
        said = []
        for names in ranked(reach):
            travel, event = reach[names[0]]
            what = (
                "no contact tips or unloads"
                if math.isinf(travel)
                else f"{event} {'already' if travel < 0 else 'first'}"
            )
            after = f", after {1e3 * travel:.1f} mm" if 0 <= travel < math.inf else ""
            said.append(f"{listed(names)}{' equally' * (len(names) > 1)}: {what}{after}")
        return "; ".join(said)


def _margin_text(margin: float, side: str) -> str:
    return "-" if not math.isfinite(margin) else f"{round(1e3 * margin, 1) + 0.0:.1f} to {side}"


def _first_event(tips: float, unloads: float, span: float) -> str:
    first, word = min((tips, "tips"), (unloads, "unloads"))
    if not first <= span:
        return "never"
    return f"{word} already" if first < 0 else f"{word} after {1e3 * first:.1f}"


def poses_of(places: list[pin.SE3]) -> Float[np.ndarray, "j 7"]:
    """Places as x, y, z and the quaternion w, x, y, z."""
    found = np.array([pin.SE3ToXYZQUAT(place) for place in places]).reshape(-1, 7)
    return found[:, [0, 1, 2, 6, 3, 4, 5]]


def placed(pose: Float[np.ndarray, " 7"], points: Float[np.ndarray, "k 3"]) -> np.ndarray:
    """Points of a frame in the world (k, 3) [m]; the frame's pose is as `poses_of` has it."""
    place = pin.XYZQUATToSE3(pose[[0, 1, 2, 4, 5, 6, 3]])
    return np.asarray(place.translation + points @ place.rotation.T)


def cops_in_world(stance: Stance, cops: Float[np.ndarray, "nc 2"]) -> Float[np.ndarray, "nc 3"]:
    """Centres of pressure in contact axes [m] as points of the world."""
    flat = np.column_stack([cops, np.zeros(len(cops))])
    places = zip(stance.placements, flat, strict=True)
    return np.array([p.translation + p.rotation @ cop for p, cop in places]).reshape(-1, 3)


def posture_parts(stance: Stance) -> dict[str, Any]:
    """The fields of a view that are the posture's alone."""
    model = stance.robot.model
    data = model.createData()
    pin.forwardKinematics(model, data, np.array(stance.q))
    soles, applied, names = [], stance.applied, stance.robot.torque_names
    for contact, place in zip(stance.contacts, stance.placements, strict=True):
        flat = np.zeros((0, 2)) if contact.sole is None else contact.sole.vertices
        corners = np.column_stack([flat, np.zeros(len(flat))])
        soles.append(place.translation + corners @ place.rotation.T)
    return {
        "q": stance.q,
        "com": stance.com,
        "joints": tuple(model.names),
        "poses": poses_of(list(data.oMi)),
        "bones": skeleton(stance),
        "contacts": stance.contact_names,
        "placements": poses_of(list(stance.placements)),
        "soles": tuple(soles),
        "load_points": np.zeros((0, 3)) if applied is None else applied.points,
        "load_forces": np.zeros((0, 3)) if applied is None else applied.wrenches[:, :3],
        "torque_names": names,
        "torque_units": tuple(_torque_unit(stance, name) for name in names),
    }


def _torque_unit(stance: Stance, name: str) -> str:
    """Of a torque's joint; motors that turn several joints are rotary."""
    units = dict(zip(stance.robot.dof_names, stance.robot.dof_units, strict=True))
    return "N" if units.get(name) == "m" else "Nm"


def criterion_view(name: str, found: CopSensitivity, limits: Limits | None) -> CriterionView:
    """What one criterion says, from its sensitivity."""
    equilibrium = found.equilibrium
    stance = equilibrium.stance
    edges = [
        None if c.sole is None else c.sole.margin(cop)
        for c, cop in zip(stance.contacts, found.cop, strict=True)
    ]
    limit = stance.robot.effort_limits
    active: tuple[str, ...] = ()
    nearest: tuple[str, ...] = ()
    if limits is not None:
        if isinstance(equilibrium, ConstrainedEquilibrium):
            active = tuple(each.name for each in equilibrium.active)
        nearest = _nearest(equilibrium, limits)
    return CriterionView(
        name,
        equilibrium.wrenches,
        found.cop,
        cops_in_world(stance, found.cop),
        equilibrium.world_wrenches[:, :3],
        equilibrium.wrenches[:, 2] / stance.robot.weight,
        np.array([math.inf if e is None else e.distance for e in edges]),
        tuple("" if e is None else e.side for e in edges),
        found.com_travel,
        found.unloading_travel,
        found.com_gain[:, 1, 1],
        equilibrium.torques,
        np.where(np.isfinite(limit), np.abs(equilibrium.torques) / limit, np.nan),
        active,
        nearest,
    )


def _nearest(equilibrium: Any, limits: Limits) -> tuple[str, ...]:
    """The smallest margin of each kind of limit, in words."""
    least: dict[str, Any] = {}
    for each in limit_margins(equilibrium, limits):
        if each.kind not in least or each.value < least[each.kind].value:
            least[each.kind] = each
    return tuple(
        f"{m.name}: {m.value * 1e3:.1f} mm"
        if m.unit == "m"
        else f"{m.name}: {m.value:.2f} {m.unit}"
        for m in least.values()
    )
