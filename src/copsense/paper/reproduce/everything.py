"""Everything that the report on [Romano2016] shows, computed; nothing is drawn here."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from copsense.errors import InvalidInputError
from copsense.limits import Limits
from copsense.paper.claims import (
    LateralSweep,
    Sway,
    compare_with_reference,
    evaluate_four_bar_claims,
    evaluate_icub_claims,
    evaluate_sway_claims,
)
from copsense.paper.closed_form import FourBar, figure_3a, figure_3b, figure_4, figure_5
from copsense.paper.errata import evaluate_errata
from copsense.paper.reproduce.benchmark_trials import benchmark_in_simulation
from copsense.paper.reproduce.clock import Clock, Progress
from copsense.paper.reproduce.closed_loop import sway_in_simulation
from copsense.paper.reproduce.real_robot import compare_real_robot
from copsense.paper.reproduce.reproduction import Reproduction
from copsense.paper.reproduce.setting import ROBOT, describe_parameters, find_versions
from copsense.paper.reproduce.sideways import (
    paper_criteria,
    sweep_sideways,
    vary_unit_of_length,
)
from copsense.paper.reproduce.within_limits import solve_within_limits
from copsense.robots import load_stance
from copsense.robots.presets import shared_presets
from copsense.stance import Stance
from copsense.statics import solve_equilibrium

# What public balancing configurations for this robot use: mu = 1/3, torsion 1/75 m, f_z over 10 N.
LIMITS = Limits(normal_force=10.0, friction=1 / 3, torsion=1 / 75, torque="model")
SWAY_FREQUENCY = 0.05  # Hz: slow enough to be nearly quasi-static; the paper prints none
# m, least margin of the CoP in closed loop within limits: soft contacts let a sole with round edges
# roll before its CoP is at the very edge.
_ROLLING = 3e-3
_LEAST = 5  # postures: fewer than this cannot show where anything crosses


def reproduce_paper(
    *,
    postures: int = 141,
    limits: Limits = LIMITS,
    sway_frequency: float | None = None,
    real_log: tuple[str | Path, str] | None = None,
    progress: Progress | None = None,
) -> Reproduction:
    """Reproduce [Romano2016] on the four-bar and on the iCub.

    Args:
        postures: of each lateral sweep of the iCub's CoM, from over one foot to over the other.
        limits: of the section on limits; the rest of the paper knows none.
        sway_frequency: of the CoM's sine in closed loop [Hz]; None leaves the closed loop out.
        real_log: a real robot's log and the robot (URDF, MJCF, SDF or preset); None leaves the
            comparison with it out.
        progress: called as ``progress(stage, done, total)``.

    Raises:
        InvalidInputError: fewer than 5 postures, or no limit switched on.
        InfeasibleError: no wrench respects the limits where the CoM is in the middle.
        CopsenseError: the log cannot be read or compared.
        MissingExtraError: the iCub models are not installed, or MuJoCo is not for a closed loop.
    """
    if postures < _LEAST:
        raise InvalidInputError(f"a reproduction needs {_LEAST} postures or more, got {postures}.")
    if not limits.any:
        raise InvalidInputError("the section on limits needs one. Switch one on.")
    if any(isinstance(limit, Mapping) for limit in limits.to_dict().values()):
        raise InvalidInputError(
            "the report states limits that are the same at every contact and joint. Give numbers."
        )
    clock = Clock(progress)
    # First: a log that does not fit is rejected before minutes of work.
    real = None if real_log is None else compare_real_robot(*real_log, clock)
    with shared_presets():
        stance, lowered = load_stance(ROBOT), load_stance(ROBOT, contact_at="sole")
    for criterion in paper_criteria():
        solve_equilibrium(stance, criterion, limits)  # rejects limits that forbid it, at once
    with clock.stage("four-bar"):
        four_bar = FourBar()
        figures = tuple(f(four_bar) for f in (figure_3a, figure_3b, figure_4, figure_5))
        claims = evaluate_four_bar_claims(four_bar)
        errata = evaluate_errata(four_bar)
    lateral, path = sweep_sideways(stance, postures, clock, "iCub")
    at_sole, _ = sweep_sideways(lowered, postures, clock, "iCub, sole's bottom")
    within = solve_within_limits(stance, path, limits, clock)
    with clock.stage("unit of length"):
        unit = vary_unit_of_length(stance)
    sway = benchmark = None
    if sway_frequency is not None:
        sway = _sway(stance, limits, sway_frequency, clock)
        benchmark = benchmark_in_simulation(clock)
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
        benchmark=benchmark,
        real=real,
        four_bar_claims=claims,
        icub_claims=icub_claims,
        sway_claims=() if sway is None else evaluate_sway_claims(sway),
        changed_at_sole=tuple(
            c.claim.identifier for c in icub_claims if there[c.claim.identifier] is not c.verdict
        ),
        errata=errata,
        references=references,
        references_at_sole=references_at_sole,
        parameters=describe_parameters(stance, lowered, four_bar, lateral),
        versions=find_versions(),
        timings=dict(clock.seconds),
        postures=postures,
    )


def _sway(stance: Stance, limits: Limits, frequency: float, clock: Clock) -> Sway:
    asked = limits.cop_margin if isinstance(limits.cop_margin, float) else 0.0
    within = replace(limits, cop_margin=max(asked, _ROLLING))
    started, progress = time.perf_counter(), clock.progress
    wrench, torque = paper_criteria()
    found = sway_in_simulation(
        stance, wrench, torque, within, frequency=frequency, progress=progress
    )
    clock.seconds["closed loop"] = time.perf_counter() - started
    return found
