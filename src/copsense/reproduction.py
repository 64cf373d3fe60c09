"""reproduce: everything that the report on [Romano2016] shows, computed; nothing is drawn here."""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from importlib.metadata import PackageNotFoundError, version

import numpy as np
import pandas as pd
import pinocchio as pin
import xarray as xr
from jaxtyping import Float

from copsense._version import __version__
from copsense.benchmark import (
    ControllerChoice,
    Lean,
    PostureChoice,
    RobotChoice,
    make_plan,
    run_benchmark,
)
from copsense.binding import LimitChange, next_change
from copsense.closed_loop import sway_in_simulation
from copsense.criterion import Criterion, minimum_torque, minimum_wrench
from copsense.equilibrium import solve_equilibrium
from copsense.errors import InvalidInputError
from copsense.limits import Limits
from copsense.motion import Path, joint_sweep, lateral_sweep
from copsense.paper import (
    EvaluatedClaim,
    EvaluatedErratum,
    FigureData,
    FourBar,
    LateralSweep,
    ReferenceValue,
    Sway,
    compare_with_reference,
    evaluate_errata,
    evaluate_four_bar_claims,
    evaluate_icub_claims,
    evaluate_sway_claims,
    figure_3a,
    figure_3b,
    figure_4,
    figure_5,
)
from copsense.paper.lateral import HIP_ROLL, SHORT, TORQUE, WRENCH
from copsense.posture import PostureCost
from copsense.recorded import with_limit_margins
from copsense.regions import ComRegion, com_region, criterion_region
from copsense.robots import PRESETS, load_stance
from copsense.sensitivity import cop_sensitivity
from copsense.stance import Stance
from copsense.sweep import sweep

Progress = Callable[[str, int, int], object]

_ROBOT, _MODEL = "icub", "iCubGenova04"
_PAPER_LENGTH = 1.0  # m: the L that criterion 1 means and never says
# What public balancing configurations for this robot use: mu = 1/3, torsion 1/75 m, f_z over 10 N.
LIMITS = Limits(normal_force=10.0, friction=1 / 3, torsion=1 / 75, torque="model")
SWAY_FREQUENCY = 0.05  # Hz: slow enough to be nearly quasi-static; the paper prints none
_JOBS = 4  # processes at most that lean robots
_ROLLING = 3e-3  # m: least margin of the CoP in closed loop within limits
_LEAST = 5  # postures: fewer than this cannot show where anything crosses
_LENGTHS = 25  # values of L in the figure on the unit of length


@dataclass(frozen=True, eq=False)
class UnitOfLength:
    """How criterion 1 depends on the length L that makes moments comparable with forces.

    Attributes:
        lengths: L (K,) [m].
        icub: d CoP y / d CoM y of the iCub's feet at the centre of the lateral path (K,).
        closed_form: the four-bar's L² / (L² + d²/4) (K,).
        minimum_torque: the iCub's under criterion 2, which knows no L.
        distance: d, between the feet [m].
    """

    lengths: Float[np.ndarray, " K"]
    icub: Float[np.ndarray, " K"]
    closed_form: Float[np.ndarray, " K"]
    minimum_torque: float
    distance: float


@dataclass(frozen=True, eq=False)
class WithinLimits:
    """What limits on the contacts and the motors change (Remark 4).

    Attributes:
        limits: the limits; by default those of public balancing configurations for this robot.
        lateral: the lateral sweep with the wrenches solved within them, criteria 1 and 2.
        bindings: for each criterion and side, where the first limit binds and the slopes there.
        regions: name -> region of the CoM, the widest first: friction and soles alone, with the
            torques, and each criterion's own.
    """

    limits: Limits
    lateral: xr.Dataset
    bindings: tuple[LimitChange, ...]
    regions: Mapping[str, ComRegion]


@dataclass(frozen=True, eq=False)
class Reproduction:
    """What the paper comes to.

    Attributes:
        four_bar: the linkage with the paper's dimensions.
        four_bar_figures: data of Figs. 3a, 3b, 4 and 5.
        lateral: the iCub's CoM swept sideways, contact frames at the model's sole frames, under
            criteria 1 and 2 and criterion 1 with L = d/2.
        lateral_at_sole: the same with the contact frames at the bottom of the collision geometry.
        unit_of_length: criterion 1's dependence on L.
        within_limits: the same path within limits, and the regions that they leave the CoM.
        sway: Section V's motion in closed loop, criteria 1 and 2; None where it was left out.
        leans: slow leans to the first tip in several postures, both criteria, as
            `copsense.benchmark` tells them; None where the closed loop was left out.
        four_bar_claims: Sections I to IV and VI, judged on the four-bar.
        icub_claims: Sections V and VI, judged on the iCub.
        sway_claims: Section V, judged in closed loop.
        changed_at_sole: identifiers of the iCub's claims whose verdict is another one with the
            contact frames at the soles' bottom.
        errata: the printed text against what holds.
        references: recorded values on the iCub beside those found.
        references_at_sole: the same beside those with the contact frames at the soles' bottom,
            to show what the frame's height changes.
        parameters: what was computed on, in words.
        versions: of this package, Python and what it rests on.
        timings: stage -> seconds.
        postures: of each lateral sweep.
    """

    four_bar: FourBar
    four_bar_figures: tuple[FigureData, ...]
    lateral: xr.Dataset
    lateral_at_sole: xr.Dataset
    unit_of_length: UnitOfLength
    within_limits: WithinLimits
    sway: Sway | None
    leans: pd.DataFrame | None
    four_bar_claims: tuple[EvaluatedClaim, ...]
    icub_claims: tuple[EvaluatedClaim, ...]
    sway_claims: tuple[EvaluatedClaim, ...]
    changed_at_sole: tuple[str, ...]
    errata: tuple[EvaluatedErratum, ...]
    references: tuple[ReferenceValue, ...]
    references_at_sole: tuple[ReferenceValue, ...]
    parameters: Mapping[str, str]
    versions: Mapping[str, str]
    timings: Mapping[str, float]
    postures: int

    @property
    def claims(self) -> tuple[EvaluatedClaim, ...]:
        """Every claim, the four-bar's first."""
        return self.four_bar_claims + self.icub_claims + self.sway_claims

    @property
    def sweep_facts(self) -> LateralSweep:
        """The lateral sweep as its claims read it."""
        return LateralSweep.from_dataset(self.lateral, self.four_bar)


def reproduce(
    *,
    postures: int = 141,
    limits: Limits = LIMITS,
    sway_frequency: float | None = None,
    progress: Progress | None = None,
) -> Reproduction:
    """Reproduce [Romano2016] on the four-bar and on the iCub.

    Args:
        postures: of each lateral sweep of the iCub's CoM, from over one foot to over the other.
        limits: of the section on limits; the rest of the paper knows none.
        sway_frequency: of the CoM's sine in closed loop [Hz]; None leaves the closed loop out.
        progress: called as ``progress(stage, done, total)``.

    Raises:
        InvalidInputError: fewer than 5 postures, or no limit switched on.
        InfeasibleError: no wrench respects the limits where the CoM is in the middle.
        MissingExtraError: the iCub models are not installed, or MuJoCo is not for a closed loop.
    """
    if postures < _LEAST:
        raise InvalidInputError(f"a reproduction needs {_LEAST} postures or more, got {postures}.")
    if not limits.any:
        raise InvalidInputError("the section on limits needs one. Switch one on.")
    clock, stance = _Clock(progress), load_stance(_ROBOT)
    for criterion in _paper_criteria():
        solve_equilibrium(stance, criterion, limits)  # limits that forbid it are told at once
    with clock.stage("four-bar"):
        four_bar = FourBar()
        figures = tuple(f(four_bar) for f in (figure_3a, figure_3b, figure_4, figure_5))
        claims = evaluate_four_bar_claims(four_bar)
        errata = evaluate_errata(four_bar)
    lowered = load_stance(_ROBOT, contact_at="sole")
    lateral, path = _lateral(stance, postures, clock, "iCub")
    at_sole, _ = _lateral(lowered, postures, clock, "iCub, sole's bottom")
    within = _within_limits(stance, path, limits, clock)
    with clock.stage("unit of length"):
        unit = _unit_of_length(stance)
    sway = leans = None
    if sway_frequency is not None:
        sway = _sway(stance, limits, sway_frequency, clock)
        leans = _leans(clock)
    with clock.stage("claims"):
        icub_claims = evaluate_icub_claims(lateral, four_bar)
        there = {c.claim.identifier: c.verdict for c in evaluate_icub_claims(at_sole, four_bar)}
        references, references_at_sole = (
            compare_with_reference(LateralSweep.from_dataset(dataset, four_bar))
            for dataset in (lateral, at_sole)
        )
    return Reproduction(
        four_bar=four_bar,
        four_bar_figures=figures,
        lateral=lateral,
        lateral_at_sole=at_sole,
        unit_of_length=unit,
        within_limits=within,
        sway=sway,
        leans=leans,
        four_bar_claims=claims,
        icub_claims=icub_claims,
        sway_claims=() if sway is None else evaluate_sway_claims(sway),
        changed_at_sole=tuple(
            c.claim.identifier for c in icub_claims if there[c.claim.identifier] is not c.verdict
        ),
        errata=errata,
        references=references,
        references_at_sole=references_at_sole,
        parameters=_parameters(stance, lowered, four_bar, lateral),
        versions=_versions(),
        timings=dict(clock.seconds),
        postures=postures,
    )


class _Clock:
    """Stages: how long each took, and how far it is."""

    def __init__(self, progress: Progress | None) -> None:
        self.progress, self.seconds = progress, dict[str, float]()

    @contextmanager
    def stage(self, name: str, total: int = 1) -> Iterator[Callable[[int], None]]:
        started, done = time.perf_counter(), 0

        def advance(count: int) -> None:
            nonlocal done
            done += count
            if self.progress:
                self.progress(name, done, total)

        advance(0)
        yield advance
        advance(total - done)
        self.seconds[name] = time.perf_counter() - started


def _lateral(stance: Stance, postures: int, clock: _Clock, name: str) -> tuple[xr.Dataset, Path]:
    """The CoM from over the right foot to over the left, every criterion at every posture."""
    half = _distance(stance) / 2
    with clock.stage(f"{name}: postures", postures) as advance:
        path = lateral_sweep(stance, -half, half, postures, progress=advance)
    criteria = [*_paper_criteria(), minimum_wrench(half, name=SHORT)]
    with clock.stage(f"{name}: sensitivities", postures) as advance:
        dataset = sweep(path, criteria, progress=advance)
    robot = stance.robot
    rolls = [robot.joint_position(s.q, HIP_ROLL) for s in path.stances]
    hip = {"units": "rad", "long_name": "position of the left hip roll joint"}
    rate = {"units": "rad/m", "long_name": "d left hip roll / d com_y along the path"}
    told = (
        dataset.assign_coords({HIP_ROLL: ("posture", rolls, hip)})
        .assign({f"{HIP_ROLL}_rate": ("posture", path.joint_rates(HIP_ROLL), rate)})
        .assign_attrs(_facts(stance, criteria[0]))
    )
    return told, path


def _paper_criteria() -> list[Criterion]:
    return [minimum_wrench(_PAPER_LENGTH, name=WRENCH), minimum_torque(name=TORQUE)]


def _within_limits(stance: Stance, path: Path, limits: Limits, clock: _Clock) -> WithinLimits:
    criteria = _paper_criteria()
    with clock.stage("limits: sensitivities", len(path)) as advance:
        dataset = with_limit_margins(sweep(path, criteria, limits, progress=advance), limits)
    with clock.stage("limits: bindings and regions", len(criteria) * 2 + 2) as advance:
        bindings = []
        for criterion in criteria:
            for side in (-1, 1):
                found = next_change(stance, criterion, limits, side)
                if found:
                    bindings.append(found)
                advance(1)
        regions = {"friction and soles": com_region(stance, replace(limits, torque=None))}
        if limits.torque is not None:
            regions["and torque limits"] = com_region(stance, limits)
        advance(2)
        for criterion in criteria:
            regions[criterion.name] = criterion_region(stance, criterion, limits)
    return WithinLimits(limits, dataset, tuple(bindings), regions)


def _sway(stance: Stance, limits: Limits, frequency: float, clock: _Clock) -> Sway:
    # A sole in the engine rolls a little before its CoP is at the very edge.
    within = replace(limits, cop_margin=max(limits.cop_margin or 0.0, _ROLLING))
    started, progress = time.perf_counter(), clock.progress
    wrench, torque = _paper_criteria()
    found = sway_in_simulation(
        stance, wrench, torque, within, frequency=frequency, progress=progress
    )
    clock.seconds["closed loop"] = time.perf_counter() - started
    return found


def _leans(clock: _Clock) -> pd.DataFrame:
    """The iCub leant slowly until a foot tips, in three postures under both criteria."""
    plan = make_plan(
        [RobotChoice("icub")],
        [
            PostureChoice("straight legs"),
            PostureChoice("knees 0.6 rad", knees=0.6),
            PostureChoice("feet 0.20 m apart", width=0.2),
        ],
        [ControllerChoice(name) for name in ("minimum-wrench", "minimum-torque")],
        [Lean()],
    )
    parts, done = 100, 0.0
    with clock.stage("closed loop: leans", parts) as advance:

        def tick(share: float) -> None:
            nonlocal done
            before, done = done, done + share
            advance(int(done * parts) - int(before * parts))

        return run_benchmark(plan, jobs=min(_JOBS, os.cpu_count() or 1), progress=tick)


def _facts(stance: Stance, criterion: Criterion) -> dict[str, float]:
    """What the claims need to know of the robot beyond the sweep."""
    model, data = stance.robot.model, stance.robot.model.createData()
    pin.forwardKinematics(model, data, stance.q)
    legs = [
        sum(model.inertias[j].mass for j in model.subtrees[model.getJointId(f"{s}_hip_pitch")])
        for s in "lr"
    ]
    height = np.mean([data.oMi[model.getJointId(f"{s}_hip_roll")].translation[2] for s in "lr"])
    feet = np.mean([place.translation[2] for place in stance.placements])
    return {
        "left_leg_mass": float(legs[0]),
        "right_leg_mass": float(legs[1]),
        "body_mass": float(stance.robot.mass - sum(legs)),
        "hip_height": float(height - feet),
        "joint_path_slope": _joint_path_slope(stance, criterion),
    }


def _joint_path_slope(stance: Stance, criterion: Criterion) -> float:
    """D left CoP y / d hip roll [m/rad] where the joint itself is swept and the CoM left free."""
    now = stance.robot.joint_position(stance.q, HIP_ROLL)
    path: Path = joint_sweep(stance, HIP_ROLL, now, now, 1)
    return float(cop_sensitivity(path.stances[0], criterion).along(path.tangents[0])[0, 1])


def _unit_of_length(stance: Stance) -> UnitOfLength:
    d = _distance(stance)
    path = lateral_sweep(stance, 0.0, 0.0, 1)
    centre, tangent = path.stances[0], path.tangents[0]

    def slope(criterion: Criterion) -> float:
        return float(cop_sensitivity(centre, criterion).along(tangent)[:, 1].mean())

    lengths = np.geomspace(d / 14, 2.0, _LENGTHS)
    return UnitOfLength(
        lengths=lengths,
        icub=np.array([slope(minimum_wrench(length)) for length in lengths]),
        closed_form=lengths**2 / (lengths**2 + d**2 / 4),
        minimum_torque=slope(minimum_torque()),
        distance=d,
    )


def _distance(stance: Stance) -> float:
    """Lateral distance of the feet [m], to the micrometre that the ends of the sweep need."""
    return round(float(np.ptp([place.translation[1] for place in stance.placements])), 6)


def _parameters(
    stance: Stance, lowered: Stance, four_bar: FourBar, lateral: xr.Dataset
) -> dict[str, str]:
    cost, half, postures = PostureCost(), _distance(stance) / 2, lateral.sizes["posture"]
    drop = float(np.mean([c.offset[2] for c in lowered.contacts])) * 1e3
    deg = ", ".join(f"{j} {a:g}" for j, a in PRESETS[_ROBOT].posture.items() if j[0] == "l")
    return {
        "four-bar": f"l = {four_bar.leg_length:g} m, d = {four_bar.rod_length:g} m, "
        f"m_l = {four_bar.leg_mass:g} kg, m_b = {four_bar.body_mass:g} kg "
        f"(kappa = {four_bar.kappa:g}), g = {four_bar.gravity:g} m/s²",
        "robot": f"{_MODEL} of icub-models, {stance.robot.mass:.3f} kg, "
        f"{len(stance.robot.torque_names)} joints, gravity "
        f"{float(np.linalg.norm(stance.robot.model.gravity.linear)):g} m/s²",
        "posture": f"left leg and arm, the right mirrored [deg]: {deg}; others 0",
        "contacts": ", ".join(f"{c.name} ({c.kind})" for c in stance.contacts)
        + f", at the model's frames; feet {2 * half:g} m apart; edges of the soles read from the "
        f"collision geometry, whose bottom lies {-drop:.1f} mm under those frames",
        "path": f"{postures} postures, CoM y from {-half:g} m to {half:g} m, CoM x held over the "
        "line of the feet's frames, CoM height free; each posture is the one with the feet in "
        f"place that minimises 1/2 [{cost.base_rotation:g} |base rotation|² + sum of w (joint "
        f"deviation)²], w = {cost.supporting:g} for the legs, {cost.free:g} for torso and arms",
        "criterion 1": "minimum-wrench: least sum over the feet of |force|² + |moment|²/L², "
        f"L = {_PAPER_LENGTH:g} m (the paper's; it never says so)",
        "criterion 2": "minimum-torque: least sum of squared joint torques",
        "limits": "none enforced: each CoP goes where the criterion puts it, and its margin to "
        "the sole's edge is reported beside it",
        "accuracy": "largest imbalance left, recomputed by inverse dynamics: "
        f"{float(lateral['residual'].max()):.1e} N or N m; derivatives are analytic",
    }


def _versions() -> dict[str, str]:
    found = {
        "copsense": __version__,
        "Python": platform.python_version(),
        "platform": f"{platform.system()} {platform.machine()}",
    }
    for package in ("pin", "numpy", "scipy", "xarray", "matplotlib", "mujoco", "icub-models"):
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not a distribution"
    return found
