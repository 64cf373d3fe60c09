"""StaticPrediction: where the centres of pressure should be, and how far the robot may lean.

The static analysis along the very path that a closed loop follows. It uses the criterion that the
controller applies, so a comparison holds the theory against physics, not against another policy.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from copsense.content import ShortRepr, freeze
from copsense.controllers import STIFF, Gains
from copsense.controllers.target import PathReference, Ramp, Signal, lateral_reference
from copsense.criterion import Criterion
from copsense.json_data import json_data
from copsense.limits import Limits
from copsense.margins import MarginTable, margin_table
from copsense.scan import PathScan
from copsense.scan_point import ScanPoint
from copsense.simulation.at_rest import at_rest_note
from copsense.simulation.physics_settings import PhysicsSettings
from copsense.simulation.quasi_static import QuasiStatic, quasi_static
from copsense.simulation.recording import Recording
from copsense.simulation.scenario import Scenario
from copsense.simulation.timed_prediction import (
    TimedPrediction,
    cops_or_nan,
    predict_in_motion,
)
from copsense.stance import Stance
from copsense.sway_levers import SwayLever, sway_levers

# What keeps a contact in its place, but for friction, which is taken as a cone below.
_GROUND = Limits(normal_force=0.0, friction=None, cop_margin=0.0, torsion=None)
_TOUCHING = 1e-9  # share of the weight, or metres of it: what has so little left has nothing
_CLOSING = 1e-12  # share of the weight per metre that is not an approach
_AFTER = 1.0  # s: the controller has answered a push by then
_HOW = {"cop": "tips", "normal force": "lifts", "friction": "slips"}


@dataclass(frozen=True, eq=False, repr=False)
class StaticPrediction(ShortRepr):
    """The statics along a path, and to first order from its start.

    Attributes:
        values: the path's coordinate, relative to the start (N,) [m].
        cops: centre of pressure of each contact (N, nc, 2), contact axes [m]; NaN where unloaded.
        loads: normal force of each contact (N, nc) [N].
        margins: smallest distance of a centre of pressure to its sole's edge (N,) [m]; infinite
            without soles, NaN where a contact carries no load.
        torques: of the motors (N, n) [Nm].
        joints: position of each joint (N, j) [rad, m].
        excursion: how far from the start the path's coordinate may go until a contact's CoP reaches
            an edge, its load is gone, or its force leaves the friction cone [m]; infinite where
            none does on this path.
        contact: the contact that does so first, or nothing.
        how: ``"tips"``, ``"lifts"`` or ``"slips"``, or nothing.
        first_order: the same from wrenches and their derivatives at the start alone [m].
        reach: how far the path goes to that side [m]: nothing is known beyond.
        start: the equilibrium at the start, and its derivatives along the path.
        quasi_static: how far the motion is from one that is slow enough for statics.
        levers: at the start, what a sway does to each output of the statics.
        in_motion: the same with inertia, of a sine; None for another signal.
        at_rest: what cannot be held at the start already, and the remedy; "" where all can.
        held: whether the limits hold the contact where it would tip or lift: its CoP goes on along
            the edge, or its force stays at nothing.
    """

    values: Float[np.ndarray, " N"]
    cops: Float[np.ndarray, "N nc 2"]
    loads: Float[np.ndarray, "N nc"]
    margins: Float[np.ndarray, " N"]
    torques: Float[np.ndarray, "N n"]
    joints: Float[np.ndarray, "N j"]
    excursion: float
    contact: str
    how: str
    first_order: float
    reach: float
    start: ScanPoint
    quasi_static: QuasiStatic
    levers: tuple[SwayLever, ...] = ()
    in_motion: TimedPrediction | None = None
    at_rest: str = ""
    held: bool = False

    def __post_init__(self) -> None:
        """Own the arrays."""
        freeze(self, "values", "cops", "loads", "margins", "torques", "joints")

    @property
    def statement(self) -> str:
        """What is predicted, in words; also where the path ends before anything happens."""
        if not np.isfinite(self.excursion):
            return f"no contact tips up to {self.reach * 1e3:.1f} mm"
        where = f"at {self.excursion * 1e3:.1f} mm"
        if self.held:
            what = f"CoP of {self.contact} reaches an edge"
            if self.how == "lifts":
                what = f"{self.contact} is unloaded"
            return f"{what} {where}, and the limits hold it there"
        return f"{self.contact} {self.how} {where}"

    def smallest_margin(self, low: float, high: float) -> tuple[float, float]:
        """Smallest margin for the coordinate between two values [m].

        Returns:
            Both on the path and to first order, by forces that are linear in the coordinate.
        """
        known = ~np.isnan(self.margins)
        y = np.linspace(low, high, 401)
        path = float(np.interp(y, self.values[known], self.margins[known]).min())
        # A ratio of linear functions is monotonic: its least is at an end.
        ends = np.array([[low], [high]])
        forces = self.start.forces + ends * self.start.force_rates
        torques = self.start.torques + ends * self.start.torque_rates
        margins = self._table.values(forces, torques)[:, self._edges]
        return path, float(margins.min(initial=np.inf))

    def torque_norm(self, y: Float[np.ndarray, " k"]) -> tuple[float, float]:
        """Mean norm of the torques over values of the coordinate [Nm]: on the path, first order."""
        norms = np.linalg.norm(self.torques, axis=1)
        first = np.linalg.norm(self._first_torques(y), axis=1)
        return float(np.interp(y, self.values, norms).mean()), float(first.mean())

    def torque_peak(
        self, y: Float[np.ndarray, " k"], joints: list[int] | None = None
    ) -> tuple[float, float]:
        """Largest torque over values of the coordinate [Nm]: on the path, and to first order.

        Args:
            y: values of the coordinate [m].
            joints: which joints to look at; default all.
        """
        at = list(range(self.torques.shape[1])) if joints is None else joints
        peaks = np.abs(self.torques[:, at]).max(axis=1)
        first = np.abs(self._first_torques(y)[:, at]).max()
        return float(np.interp(y, self.values, peaks).max()), float(first)

    def attach(self, recording: Recording) -> Recording:
        """A recording with this prediction beside it, over a dimension of its own."""
        what = {"units": "m", "long_name": "static centre of pressure along the path, contact axes"}
        dataset = recording.to_xarray().assign(
            static_cop=(("static", "contact", "axis"), self.cops, what),
            static_load=(
                ("static", "contact"),
                self.loads,
                {"units": "N", "long_name": "static normal force along the path"},
            ),
            static_joint=(
                ("static", "joint"),
                self.joints,
                {"units": "rad, m", "long_name": "joint position along the path"},
            ),
            static_travel=(
                "static",
                self.values,
                {"units": "m", "long_name": "where on the path, from its start"},
            ),
        )
        if self.in_motion is not None:
            moving = "with the inertia of the sway, along the path"
            dataset = dataset.assign(
                timed_cop=(
                    ("static", "contact", "axis"),
                    self.in_motion.cops,
                    {"units": "m", "long_name": f"centre of pressure {moving}, contact axes"},
                ),
                timed_load=(
                    ("static", "contact"),
                    self.in_motion.loads,
                    {"units": "N", "long_name": f"normal force {moving}"},
                ),
            )
            dataset = dataset.assign_attrs(
                sway_amplitude=self.in_motion.amplitude, sway_frequency=self.in_motion.frequency
            )
        frequencies = {x.output: x.frequency for x in self.levers}
        return Recording(dataset).with_attributes(
            static_frequencies=json.dumps(json_data(frequencies)),
            static_excursion=self.excursion,
            static_contact=self.contact,
            static_how=self.how,
            static_first_order=self.first_order,
            static_reach=self.reach,
            static_statement=self.statement,
            quasi_static_lever=self.quasi_static.lever,
            quasi_static_excess=self.quasi_static.excess,
            quasi_static_share=self.quasi_static.share,
            quasi_static_frequency=self.quasi_static.frequency,
        )

    def _first_torques(self, y: np.ndarray) -> np.ndarray:
        return self.start.torques + np.outer(y, self.start.torque_rates)

    @cached_property
    def _table(self) -> MarginTable:
        return margin_table(self.start.stance, _GROUND)

    @property
    def _edges(self) -> np.ndarray:
        return np.flatnonzero([kind == "cop" for kind in self._table.kinds])


def predict(
    reference: PathReference,
    criterion: Criterion,
    limits: Limits | None = None,
    friction: float | Mapping[str, float] = PhysicsSettings.friction,
) -> StaticPrediction:
    """The static prediction along a reference's path, from its start at zero outwards.

    Args:
        reference: the path, and to which side it goes first.
        criterion: how the load is shared.
        limits: within which, if any.
        friction: coefficient of contacts without one of their own; or of every contact, by name,
            see `Scenario.friction_at_start`.

    Raises:
        CopsenseError: no equilibrium somewhere on the path, such as beyond the limits.
    """
    path, side = reference.path, farther_side(reference.signal)
    scan = PathScan(path, criterion, limits, start=0.0)
    start = scan.begin
    gaps = _Gaps(start.stance, friction)
    # Limits may hold a centre of pressure on the very edge, within rounding.
    touching = 0.0 if limits is None else _TOUCHING
    found = scan.first(lambda point: gaps.rates(point, touching), side)
    left, rates = gaps.rates(start)
    closing = -side * rates
    first = np.where(closing > _CLOSING * gaps.weight, left, np.inf)
    first = np.where(left > 0, first / np.where(np.isfinite(first), closing, 1.0), 0.0)

    values = np.asarray(path.values, dtype=float)
    shape = len(values), len(start.stance.contacts)
    cops, margins = np.full((*shape, 2), np.nan), np.full(len(values), np.nan)
    loads = np.full(shape, np.nan)
    torques = np.full((len(values), len(start.torques)), np.nan)
    for i, value in enumerate(values):
        if i not in path.failures:
            point = scan.at(float(value))
            loads[i] = point.equilibrium.wrenches[:, 2]
            cops[i], torques[i] = cops_or_nan(point.equilibrium), point.torques
            margins[i] = gaps.margin(point)
    joints = np.array([start.stance.robot.joint_positions(s.q) for s in path.stances])
    how = "" if found is None else _HOW[gaps.kinds[found.row]]
    return StaticPrediction(
        values,
        cops,
        loads,
        margins,
        torques,
        joints,
        np.inf if found is None else found.travel,
        "" if found is None else gaps.contacts[found.row],
        how,
        float(first.min(initial=np.inf)),
        float(max(side * values.max() if side > 0 else -values.min(), 0.0)),
        start,
        quasi_static(start.stance, start.tangent, reference.signal),
        sway_levers(start.equilibrium, start.tangent),
        predict_in_motion(reference, criterion, limits),
        at_rest_note(start.equilibrium, criterion, gaps.friction),
        _holds(limits, how),
    )


def _holds(limits: Limits | None, how: str) -> bool:
    """Whether limits keep a contact from what it would do: the ground's own friction is not one."""
    if limits is None:
        return False
    held = {"tips": limits.cop_margin, "lifts": limits.normal_force}
    return held.get(how) is not None


def predict_lean(
    stance: Stance, criterion: Criterion, reach: float, limits: Limits | None = None
) -> StaticPrediction:
    """The static prediction of a lateral lean up to `reach` [m]; its sign says to which side."""
    return predict(lateral_reference(stance, Ramp(reach)), criterion, limits)


def predict_impulse(
    stance: Stance, excursion: float, duration: float, gains: Gains = STIFF
) -> float:
    """The least lateral push that tips a contact, by the static excursion and no fitted number.

    The CoM is a mass m under the controller's policy, a = -kp y - kd v + F/m, and acts on the soles
    as if it stood at rest at y + (h/g)(kp y + kd v): there is where the static analysis is asked.

    Args:
        stance: gives mass and height of the CoM.
        excursion: the static excursion d to the first tip [m].
        duration: of the push [s].
        gains: their lateral kp and kd.

    Returns:
        The impulse F * duration [N s].
    """
    kp, kd = gains.com_stiffness[1], gains.com_damping[1]
    ground = float(np.mean([place.translation[2] for place in stance.placements]))
    g = stance.robot.weight / stance.robot.mass
    lever = (float(stance.com[2]) - ground) / g
    dt = 1e-4
    y = v = most = 0.0
    for i in range(round((duration + _AFTER) / dt)):
        # Of a unit impulse.
        push = 1.0 / (stance.robot.mass * duration) if i * dt < duration else 0.0
        v += dt * (push - kp * y - kd * v)
        y += dt * v
        most = max(most, y + lever * (kp * y + kd * v))
    return excursion / most


def farther_side(signal: Signal) -> int:
    """To which side a signal goes farther, 1 or -1; as a sine goes as far to both, first."""
    low, high = signal.extent
    if high == -low:
        return -1 if signal.at(0.0)[1] < 0 else 1
    return 1 if high > -low else -1


class _Gaps:
    """What the contacts of a stance have left before one tips, lifts or slips.

    Attributes:
        contacts: name of the contact of each gap (r,).
        kinds: ``"cop"``, ``"normal force"`` or ``"friction"`` (r,).
        friction: of the ground under each contact, by name.
        weight: of the robot [N].
    """

    def __init__(self, stance: Stance, friction: float | Mapping[str, float]) -> None:
        """Lay the gaps of these contacts out."""
        self.table, self.weight = margin_table(stance, _GROUND), stance.robot.weight
        if not isinstance(friction, Mapping):
            friction = Scenario().friction_at_start(stance, friction)
        self.friction = {name: friction[name] for name in stance.contact_names}
        self.contacts = (*self.table.where, *stance.contact_names)
        self.kinds = (*self.table.kinds, *("friction" for _ in stance.contacts))

    def rates(self, point: ScanPoint, touching: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """The gaps [N, Nm], less a share of the weight, and their derivatives along the path.

        Tips and lifts by the slack of their rows, slips by mu f_z - |f_t|.
        """
        wrenches = point.stance.unstack(point.forces)
        changes = point.stance.unstack(point.force_rates)
        gaps, rates = [], []
        for mu, force, change in zip(self.friction.values(), wrenches, changes, strict=True):
            size = float(np.hypot(*force[:2]))
            # At rest in the plane a force begins to slip whichever way it goes.
            sideways = force[:2] @ change[:2] / size if size else float(np.hypot(*change[:2]))
            gaps.append(mu * force[2] - size)
            rates.append(mu * change[2] - sideways)
        left = np.concatenate([self.table.slack(point.forces, point.torques), gaps])
        closing = self.table.slack_rates(point.force_rates, point.torque_rates)
        return left - touching * self.weight, np.concatenate([closing, rates])

    def margin(self, point: ScanPoint) -> float:
        """Smallest distance of a centre of pressure to its sole's edge [m]."""
        edges = np.flatnonzero([self.table.kinds[rows[0]] == "cop" for rows in self.table.groups])
        margins = self.table.group_margins(point.forces, point.torques)[edges]
        return float(margins.min(initial=np.inf))
