"""The real robot: what a real iCub's own log says of Section V, and what a public one said.

The log is data of others, read where its user has put it and never part of copsense.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from copsense.criterion import minimum_torque, minimum_wrench
from copsense.identification import Estimate, Identification, identify_log
from copsense.identification.log_identification import ROWS
from copsense.logs import LogComparison, compare_log, read_log
from copsense.logs.aligned_log import POSTURES, log_robot
from copsense.logs.log_comparison import MEASURED
from copsense.paper.reproduce.clock import Clock
from copsense.stiffness import stiffness

PUBLIC_LOG = "com-sinusoid.mat"
PUBLIC_URDF = "model.urdf"
PUBLIC_PLACE = "https://github.com/ami-iit/paper_ramadoss_2021_icra_proprioceptive-base-estimator"
_SERVOS = "equal stiffnesses"  # of all joints: the scale does not matter
_WEIGHT, _LENGTH = "hip weight", "length L"
_FAMILIES = ("joints", "length")


@dataclass(frozen=True)
class RealFinding:
    """One number of a real robot's log, and where what it is held against lies.

    Attributes:
        name: of the criterion or parameter.
        value: the number, slopes [1], weights [1], lengths [m].
        low: lower end of its 95 % interval.
        high: upper end.
        place: ``"inside"``, ``"on the edge"`` or ``"outside"`` of an interval; empty where
            nothing is held against it.
    """

    name: str
    value: float
    low: float
    high: float
    place: str = ""

    @property
    def unit(self) -> str:
        """Of the number."""
        return "m" if self.name.startswith(_LENGTH) else "1"

    @property
    def what(self) -> str:
        """What the number is."""
        return _what(self.name)[0]

    @property
    def against(self) -> str:
        """What the place is of: that interval, or what lies there of the number's own."""
        return _what(self.name)[1]


@dataclass(frozen=True, eq=False)
class RealRobot:
    """A real robot's log beside the criteria.

    Attributes:
        comparison: slopes and rows, at rest and in motion.
        in_motion: joint weights and length that explain it, with the recorded motion's inertia.
        at_rest: the same without.
    """

    comparison: LogComparison
    in_motion: Identification
    at_rest: Identification

    @property
    def findings(self) -> tuple[RealFinding, ...]:
        """The numbers, in the order of `RECORDED`."""
        load = self.comparison.slopes["load"]
        measured = load[MEASURED]
        found = [
            RealFinding(
                source,
                slope.value,
                slope.low,
                slope.high,
                "" if source == MEASURED else measured.place_of(slope),
            )
            for source, slope in load.items()
        ]
        for fits, how in ((self.in_motion.fits, "in motion"), (self.at_rest.fits, "at rest")):
            found.append(_parameter(f"{_WEIGHT}, {how}", fits["joints"].estimates["hip_weight"]))
        length = self.in_motion.fits["length"].estimates["characteristic_length"]
        return (*found, _parameter(f"{_LENGTH}, in motion", length))


# What `copsense reproduce --log com-sinusoid.mat --log-robot model.urdf` finds.
RECORDED = (
    RealFinding("measured", 0.615, 0.573, 0.656),
    RealFinding("minimum-wrench, at rest", 0.011, 0.011, 0.011, "outside"),
    RealFinding("minimum-wrench, in motion", 0.012, 0.012, 0.012, "outside"),
    RealFinding("minimum-torque, at rest", 0.573, 0.561, 0.584, "on the edge"),
    RealFinding("minimum-torque, in motion", 0.641, 0.618, 0.665, "inside"),
    RealFinding("equal stiffnesses, at rest", 0.573, 0.561, 0.584, "on the edge"),
    RealFinding("equal stiffnesses, in motion", 0.641, 0.618, 0.665, "inside"),
    RealFinding("hip weight, in motion", 1.078, 0.955, 1.216, "inside"),
    RealFinding("hip weight, at rest", 0.843, 0.726, 0.978, "outside"),
    RealFinding("length L, in motion", 0.0940, 0.0881, 0.1003, "outside"),
)


def _what(name: str) -> tuple[str, str]:
    """What a number is, and what is held against which interval."""
    if name.startswith(_WEIGHT):
        what = "torque weight of the hips over that of the ankles that explains the load best"
        return what, "equal weights"
    if name.startswith(_LENGTH):
        return "length of a minimum wrench that explains the load best", "1 m"
    if name == MEASURED:
        return "load that goes from foot to foot, of the centre of mass's moment", ""
    return "the same, as the criterion has it at the recorded postures", "the measured interval"


def _parameter(name: str, estimate: Estimate) -> RealFinding:
    place = "inside" if estimate.low <= 1.0 <= estimate.high else "outside"
    return RealFinding(name, estimate.value, estimate.low, estimate.high, place)


def compare_real_robot(
    log: str | Path,
    robot: str,
    clock: Clock,
    *,
    postures: int = POSTURES,
    fitted: int = ROWS,
) -> RealRobot:
    """A real robot's log beside the paper's criteria, and what would explain it.

    Args:
        log: any file that `copsense.logs.read_log` takes.
        robot: its URDF, MJCF or SDF, or a preset.
        clock: of the reproduction.
        postures: how many rows are compared at most.
        fitted: how many rows are fitted at most.

    Raises:
        CopsenseError: as `read_log`, `compare_log` and `identify_log`.
    """
    servos = stiffness(1.0).named(_SERVOS)
    with clock.stage("real robot", 3) as advance:
        model, known = log_robot(robot)
        contacts = known or None
        found = read_log(log, robot=model, contacts=[c.name for c in known])
        criteria = (minimum_wrench(1.0), minimum_torque(), servos)
        comparison = compare_log(found, model, criteria, contacts=contacts, postures=postures)
        advance(1)
        fits = []
        for inertia in (True, False):
            fits.append(
                identify_log(
                    found,
                    model,
                    _FAMILIES,
                    contacts=contacts,
                    inertia=inertia,
                    postures=fitted,
                )
            )
            advance(1)
    return RealRobot(comparison, fits[0], fits[1])
