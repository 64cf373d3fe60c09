"""One of every result that copsense hands out, and everything that hangs on it."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass
from functools import cached_property
from itertools import islice

import numpy as np

import copsense
from copsense.batch import BatchKernel, PostureChart
from copsense.changes import StanceChange
from copsense.comparison import ControllerChoice, PostureChoice, Rest, RobotChoice, make_plan
from copsense.comparison.score import Score
from copsense.controllers import BalancingController
from copsense.controllers.target import Hold, Sine, lateral_reference
from copsense.design import LENGTHS, families
from copsense.errors import CopsenseError
from copsense.explore import Model, Setting, State
from copsense.explore.export import played_views
from copsense.explore.played_model import PlayedModel
from copsense.explore.shape import JointMesh
from copsense.hardware import hardware_effects, hardware_sweep
from copsense.hardware.stance_rates import HardwareRates
from copsense.identification import Measurements, identify
from copsense.labelled import LabelledResult
from copsense.limits import limit_rows
from copsense.load_problem import LoadProblem
from copsense.loads import SpringLoad
from copsense.logs import JointsMap, Log, LogMap, WrenchMap, WrenchSeries, compare_log
from copsense.logs.aligned_log import align_log
from copsense.maps import MapPlan
from copsense.maps.map_statistics import CriterionSummary as Summary
from copsense.maps.map_statistics import FailedPosture, MapSummary, WorstPosture
from copsense.maps.marginals import Marginal
from copsense.maps.sampling import Axis, Grid
from copsense.margins import margin_table
from copsense.optimisation import pareto_front
from copsense.path import LateralPath
from copsense.posture_run import PostureRun
from copsense.pushes import push_limits
from copsense.robots import PRESETS, inspect_robot
from copsense.scan import limit_travel, next_active_set_change
from copsense.simulation import ModelError, Scenario
from copsense.simulation.prediction import predict
from copsense.sole import read_sole
from copsense.sway_levers import sway_levers
from copsense.terms import PreloadTerm
from copsense.timed_path import Sway, TimedPath
from copsense.uncertainty import Uncertainty, propagate_uncertainty
from support.driven_robots import everything, standing

TORQUE, LENGTH = copsense.minimum_torque(), copsense.minimum_wrench(1.0)
LIMITS = copsense.Limits(friction=0.33, torque="model")
_LOOKED_AT = 2  # of many alike
_DEEPEST = 6  # attributes of attributes


def own_policy(q: np.ndarray) -> np.ndarray:
    """Half of the four-bar's weight on each foot."""
    robot = copsense.load_stance("four_bar").robot
    wrenches = np.zeros((2, 6))
    wrenches[:, 2] = robot.weight / 2
    return wrenches


def small_log(icub) -> Log:
    """Forty rows of a sway that no one made, with forces that are the weight's."""
    times = np.arange(40) * 0.05
    sway = 0.02 * np.sin(2 * np.pi * times)
    names = icub.robot.joint_names
    positions = np.tile([icub.robot.joint_position(icub.q, name) for name in names], (40, 1))
    for joint in ("l_hip_roll", "r_ankle_roll"):
        positions[:, names.index(joint)] += sway
    for joint in ("r_hip_roll", "l_ankle_roll"):
        positions[:, names.index(joint)] -= sway
    forces = np.zeros((2, 40, 6))
    forces[:, :, 2] = icub.robot.weight * (0.5 + np.outer((-1, 1), sway))
    sensors = tuple(
        WrenchSeries(name, name, "", "sole", f)
        for name, f in zip(icub.contact_names, forces, strict=True)
    )
    return Log("made up", times, names, positions, sensors, torques=0 * positions)


def with_encoders(icub) -> Measurements:
    """The same, with one encoder's error that changes nothing."""
    measured, rows = swaying(icub), np.arange(20)
    found = [copsense.solve_equilibrium(stance, TORQUE).wrenches for stance in measured.stances]
    return measured.with_encoders(rows, [(measured.stances, np.array(found), None)])


def swaying(icub) -> Measurements:
    """Load shares of a sway at rest."""
    stances = copsense.lateral_sweep(icub, -0.02, 0.02, 20).stances
    found = [copsense.solve_equilibrium(stance, TORQUE).wrenches for stance in stances]
    return Measurements.of(stances, np.array(found))


def all_results(icub) -> dict[str, object]:
    """Name -> what a function of copsense gave; small, but of every kind."""
    robot_with_all = everything()
    loads = (
        copsense.Load("l_heel", (1.0, 2.0, 3.0)),
        SpringLoad("l_heel", (0.1, 0.2, 0.3), (10.0, 5.0, 2.0)),
    )
    driven = standing(robot_with_all, 0.01).with_loads(loads)
    # On the four-bar every solution is quick; the iCub has soles from meshes and many joints.
    bar = copsense.load_stance("four_bar")
    path = copsense.lateral_sweep(bar, -0.02, 0.02, 5)
    within = copsense.solve_equilibrium(icub, TORQUE, LIMITS)
    scan = copsense.PathScan(path, TORQUE)
    y = float(bar.com[1])
    grid = Grid((Axis("com_y", y - 0.01, y + 0.01, 2),))
    somewhere = {"com_y": 0.01}
    chart = PostureChart(bar, ["com_y"])
    kernel = BatchKernel(bar, [TORQUE])
    explored = Model(icub)
    buys = hardware_effects(bar, TORQUE, checked=1)
    shapes = HardwareRates(bar, buys.parameters)
    shown = explored.view(State(limits=copsense.Limits(), overlays=frozenset({"regions"})))
    log = small_log(icub)
    swaying_views = played_views(PlayedModel(align_log(log, icub).run(log)), explored.start, [0, 5])
    return {
        "stance": icub,
        "driven stance": driven,
        "stance in motion": icub.moving(np.zeros(icub.robot.model.nv), icub.com_motions[:, 1]),
        "contact": icub.contacts[0],
        "limits": LIMITS,
        "rows of limits": limit_rows(icub, LIMITS),
        "load": LoadProblem.of(icub),
        "driven load": LoadProblem.of(driven),
        "sole": read_sole(icub.robot, icub.contacts[0]),
        "equilibrium": copsense.solve_equilibrium(icub, TORQUE),
        "driven equilibrium": copsense.solve_equilibrium(driven, TORQUE),
        "constrained equilibrium": within,
        "rates": within.rates(icub.com_motions[:, 1]),
        "sensitivity": copsense.cop_sensitivity(icub, LENGTH),
        "sensitivity within limits": copsense.cop_sensitivity(icub, TORQUE, LIMITS),
        "sensitivity of a tie-break": copsense.cop_sensitivity(
            icub, copsense.minimum_tangential(LENGTH)
        ),
        "change to first order": copsense.cop_sensitivity(
            icub, TORQUE, LIMITS
        ).next_active_set_change(icub.com_motions[:, 1]),
        "nearest change": copsense.cop_sensitivity(
            icub, TORQUE, LIMITS
        ).nearest_active_set_change(),
        "change": next_active_set_change(bar, TORQUE, copsense.Limits()),
        "posture": copsense.solve_posture(icub, com=(None, 0.01, None)),
        "path": path,
        "path with a failure": copsense.lateral_sweep(bar, 0.0, 3.0, 2),
        "sway": Sway(path, 1.0),
        "instant": Sway(path, 1.0).at(float(path.values[1])),
        "timed path": TimedPath(path, Hold()),
        "sway levers": sway_levers(
            copsense.solve_equilibrium(path.stances[2], TORQUE), path.tangents[2]
        ),
        "list": copsense.path_through(bar, [bar.q]),
        "lateral path": LateralPath(bar),
        "scan": scan,
        "scan point": scan.begin,
        "travel": limit_travel(bar, TORQUE, copsense.Limits()),
        "limit margins": margin_table(icub, LIMITS),
        "margin": icub.contacts[0].sole.margin((0.0, 0.0)),
        "analysis": copsense.analyse(bar, None, copsense.Limits()),
        "uncertainty": Uncertainty.default(icub),
        "change of a stance": StanceChange(
            icub.admissible_motions, np.zeros(icub.admissible_motions.shape)
        ),
        "spread": propagate_uncertainty(icub, TORQUE, samples=1),
        "analysis with an uncertainty": copsense.analyse(bar, [TORQUE], uncertainty="default"),
        "regions": copsense.com_regions(icub, [LENGTH], LIMITS, tolerance=1e-2),
        "inspection": inspect_robot(copsense.load_robot("solo12")),
        "pushes": push_limits(icub, "chest", [LENGTH], LIMITS),
        "design": copsense.design_criterion(path, copsense.Limits(), LENGTHS, grid=2),
        **{f"family {name}": family for name, family in families(icub).items()},
        "optimum": copsense.optimise(bar, over={"com_y": 0.02}, starts=1),
        "front": pareto_front(bar, ("travel", "torque"), over={"com_y": 0.02}, points=2, starts=1),
        "hardware": buys,
        "sweep of hardware": hardware_sweep(bar, TORQUE, "hip_width", [0.15], nominal=buys),
        "rates of hardware": shapes,
        "change of hardware": shapes.change_at(bar),
        "sweep": copsense.sweep(path, [TORQUE]),
        "prediction": predict(lateral_reference(icub, Hold()), TORQUE),
        "prediction of a sway": predict(lateral_reference(icub, Sine(2e-3, 0.5)), TORQUE),
        "scenario": Scenario(1.0, model_error=ModelError(payload={"chest": 2.0})),
        "controller": BalancingController(icub, TORQUE),
        "recording": copsense.balance(icub, TORQUE, Scenario(0.02)),
        "log": small_log(icub),
        "measurements with encoders": with_encoders(icub),
        "aligned log": align_log(small_log(icub), icub),
        "preload": PreloadTerm(np.zeros((2, 6))),
        "measurements": swaying(icub),
        "identification": identify(swaying(icub), ["length"]),
        "comparison of a log": compare_log(small_log(icub), icub, [TORQUE], skip=0.0),
        "mapping of a log": LogMap(
            JointsMap({"l_knee": "k"}, rename={"k": "l_knee"}),
            (WrenchMap("l_sole", {"force_z": "fz"}),),
        ),
        "preset": PRESETS["icub"],
        "batch": kernel.evaluate(bar.q[None]),
        "batch within limits": BatchKernel(bar, [TORQUE], LIMITS).evaluate(bar.q[None]),
        "kernel": kernel,
        "chart": chart,
        "chart postures": chart.solve(np.array([[y]])),
        "plan of a map": MapPlan(bar, (TORQUE,), grid),
        "map": MapSummary(
            "map.zarr",
            "four_bar",
            ("com_y",),
            ("m",),
            1,
            1,
            1,
            {
                "minimum-torque": Summary(
                    {"evaluated": 1},
                    (WorstPosture(0, dict(somewhere), 0.1),),
                    (),
                    {50.0: 0.1},
                    {50.0: 1.0},
                    {"unreachable": FailedPosture(1, dict(somewhere), "too far")},
                    counts_within={"within": 1},
                )
            },
        ),
        "marginal": Marginal(
            ("a", "b"),
            ("m", "m"),
            "least_com_travel",
            "worst",
            (np.zeros(3), np.zeros(41)),
            ("minimum-torque",),
            np.zeros((1, 2, 40)),
        ),
        "state": State(("icub",), {"com_y": Setting(0.01, "m")}, limits=LIMITS),
        "run": PostureRun.of_stances(path.stances, path.values, "com_y", "m"),
        "view of a run": swaying_views[1],
        "mesh": JointMesh(1, np.zeros((3, 3)), np.arange(3)[None]),
        "view": explored.add_regions(shown),
        "case": make_plan(
            [RobotChoice("icub", soles={"l_sole": (-0.1, 0.1, -0.03, 0.03)})],
            [PostureChoice("bent", joints={"l_knee": 0.1})],
            [ControllerChoice()],
            [Rest()],
        )[0],
        "score": Score("tip_excursion", "measured", 0.05),
    }


@dataclass(frozen=True)
class Part:
    """Something that hangs on a result.

    Attributes:
        where: the way to it.
        value: itself.
        again: what the same way leads to when it is asked a second time.
    """

    where: str
    value: object
    again: object


def parts(where: str, value: object) -> Iterator[Part]:
    """A result and all that its public attributes hold, whatever is of copsense taken apart."""
    seen: set[int] = set()
    keep = []  # or a new object might get the address of one that is gone
    todo = [Part(where, value, value)]
    while todo:
        part = todo.pop()
        if id(part.value) in seen:
            continue
        seen.add(id(part.value))
        keep.append(part)
        yield part
        if part.where.count(".") < _DEEPEST:
            todo += _inside(part)


def _inside(part: Part) -> list[Part]:
    value, again = part.value, part.again
    if isinstance(value, Mapping) and not is_dataclass(value):
        found = list(islice(value.items(), _LOOKED_AT))
        return [Part(f"{part.where}[{k!r}]", each, again[k]) for k, each in found]
    if isinstance(value, tuple | list):
        found = list(islice(enumerate(value), _LOOKED_AT))
        return [Part(f"{part.where}[{k}]", each, again[k]) for k, each in found]
    if not type(value).__module__.startswith("copsense.") or isinstance(value, LabelledResult):
        return []  # a recording has recordings, of its parts, without end
    names = [f.name for f in fields(value)] if is_dataclass(value) else list(_own(value))
    names += [
        name
        for kind in type(value).__mro__
        for name, held in vars(kind).items()
        if isinstance(held, property | cached_property)
    ]
    found = []
    for name in dict.fromkeys(names):
        if name.startswith("_"):
            continue
        try:
            found.append(Part(f"{part.where}.{name}", getattr(value, name), getattr(again, name)))
        except CopsenseError:
            continue
    return found


def _own(value: object) -> Iterator[str]:
    return iter(vars(value) if hasattr(value, "__dict__") else ())
