"""Reproduction: the results of reproducing [Romano2016]."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from jaxtyping import Float

from copsense.limits import Limits
from copsense.paper.claims import EvaluatedClaim, LateralSweep, ReferenceValue, Sway
from copsense.paper.closed_form import FigureData, FourBar
from copsense.paper.errata import EvaluatedErratum
from copsense.paper.reproduce.real_robot import RealRobot
from copsense.regions import ComRegion
from copsense.statics import ActiveSetChange
from copsense.sweeps import Sweep


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
    lateral: Sweep
    bindings: tuple[ActiveSetChange, ...]
    regions: Mapping[str, ComRegion]


@dataclass(frozen=True, eq=False)
class Reproduction:
    """The results of a reproduction.

    Attributes:
        four_bar: the linkage with the paper's dimensions.
        four_bar_figures: data of Figs. 3a, 3b, 4 and 5.
        lateral: the iCub's CoM swept sideways, contact frames at the model's sole frames, under
            criteria 1 and 2 and criterion 1 with L = d/2.
        lateral_at_sole: the same with the contact frames at the bottom of the collision geometry.
        unit_of_length: criterion 1's dependence on L.
        within_limits: the same path within limits, and the regions that they leave the CoM.
        sway: Section V's motion in closed loop, criteria 1 and 2; None where it was left out.
        benchmark: leans, pushes and a sway under both criteria, as `copsense.comparison` gives
            them; None where the closed loop was left out.
        real: a real robot's log; None where none was given.
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
    lateral: Sweep
    lateral_at_sole: Sweep
    unit_of_length: UnitOfLength
    within_limits: WithinLimits
    sway: Sway | None
    benchmark: pd.DataFrame | None
    real: RealRobot | None
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
