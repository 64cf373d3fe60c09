"""Whatever is given in place of a stance, limits, criteria or a path: one error in words."""

import subprocess
import sys

NO_LIST = "is not a list of criteria. Give one, such as [minimum_wrench(1.0)"
NO_CRITERION = "is not a criterion. Give one, such as criterion_named('minimum-torque')"
NO_LIMITS = "is not a value of Limits. Give Limits(friction=0.33"
NO_STANCE = "'icub' is not a stance. Make one with copsense.load_stance('icub')"
NO_PATH = "is not a path of postures. Make one with copsense.lateral_sweep"
NO_PAIR = "is not a criterion with its factor. Give pairs, one by one: mixed((minimum_torque()"
NO_POSITIONS = 'Give joint -> position, such as {"l_knee": -0.35}'

# Call -> what the error says. In the calls: s a stance, p a path, mt and one criteria, pol a
# policy, L limits, scan a PathScan, swept a Sweep, grid a sampling.
CALLS = {
    "analyse(s, pol)": "criteria is a single policy. Give a list",
    "analyse(s, mt)": "criteria is a single criterion. Give a list",
    "analyse(s, 42)": NO_LIST,
    "analyse(s, 'minimum-torque')": NO_LIST,
    "analyse(s, ['x'])": "neither a Criterion nor a callable",
    "analyse(s, [])": "an analysis needs criteria of distinct names, got none",
    "sweep(p, pol)": "criteria is a single policy",
    "sweep(p, mt)": "criteria is a single criterion",
    "sweep(p, None)": NO_LIST,
    "sweep(p, [mt, mt])": "a sweep needs criteria of distinct names, got minimum-torque, minimum",
    "com_regions(s, mt, L)": "criteria is a single criterion",
    "com_regions(s, [pol], L)": NO_CRITERION,
    "com_regions(s, ['x'], L)": NO_CRITERION,
    "com_regions(s, [mt, mt], L)": "distinct names",
    "push_limits(s, 'base_link', mt)": "criteria is a single criterion",
    "push_limits(s, 'base_link', [pol])": NO_CRITERION,
    "map_postures(s, grid, mt, 'absent/x.zarr')": "criteria is a single criterion",
    "map_postures(s, grid, 3, 'absent/x.zarr')": NO_LIST,
    "map_postures(s, [[0.0, 0.1]], [mt], 'absent/x.zarr')": "[[0.0, 0.1]] is not a grid or",
    "evaluate_batch(s, [s.q], mt)": "criteria is a single criterion",
    "evaluate_batch(s, [s.q], 'minimum-torque')": NO_LIST,
    "evaluate_batch(s, [s.q], (c for c in [mt, mt]))": "distinct names, got minimum-torque",
    "balance(s, 'x')": NO_CRITERION,
    "balance(s, 'minimum-wrench')": "Give one, such as criterion_named('minimum-wrench')",
    "balance(s, pol)": NO_CRITERION,
    "balance(s, [mt])": NO_CRITERION,
    "BalancingController(s, 'x')": NO_CRITERION,
    "check_sensitivity(s, 'x')": NO_CRITERION,
    "PathScan(p, 'x')": NO_CRITERION,
    "analyse(s, None, 'friction')": NO_LIMITS,
    "balance(s, mt, limits={'friction': 1})": NO_LIMITS,
    "BalancingController(s, mt, limits='friction')": NO_LIMITS,
    "check_sensitivity(s, mt, {'friction': 1})": NO_LIMITS,
    "cop_sensitivity(s, mt, 'friction')": NO_LIMITS,
    "solve_equilibrium(s, mt, {'friction': 1})": NO_LIMITS,
    "sweep(p, [mt], 'friction')": NO_LIMITS,
    "PathScan(p, mt, 'friction')": NO_LIMITS,
    "com_regions(s, [mt], 'friction')": NO_LIMITS,
    "com_regions(s, [mt], None)": NO_LIMITS,
    "com_region(s, 'friction')": NO_LIMITS,
    "criterion_region(s, mt, {'friction': 1})": NO_LIMITS,
    "push_limits(s, 'base_link', [mt], 'friction')": NO_LIMITS,
    "map_postures(s, grid, [mt], 'absent/x.zarr', 'friction')": NO_LIMITS,
    "scan.travel('friction')": NO_LIMITS,
    "scan.travel(None)": NO_LIMITS,
    "scan.margins({'friction': 1})": NO_LIMITS,
    "scan.slacks('friction')": NO_LIMITS,
    "swept.with_limit_margins('friction')": NO_LIMITS,
    "limit_travel(s, mt, 'friction')": NO_LIMITS,
    "next_active_set_change(s, mt, 'friction')": NO_LIMITS,
    "design_criterion(p, 'friction', 'length')": NO_LIMITS,
    "analyse('icub')": NO_STANCE,
    "evaluate_batch('icub', [s.q], [mt])": NO_STANCE,
    "PostureChart('icub', ['com_y'])": NO_STANCE,
    "balance('icub')": NO_STANCE,
    "BalancingController('icub', mt)": NO_STANCE,
    "check_sensitivity('icub', mt)": NO_STANCE,
    "com_regions('icub', [mt], L)": NO_STANCE,
    "com_region('icub', L)": NO_STANCE,
    "criterion_region('icub', mt, L)": NO_STANCE,
    "cop_sensitivity('icub', mt)": NO_STANCE,
    "cop_sensitivity('icub', pol)": NO_STANCE,
    "joint_sweep('icub', 'l_knee', 0, 1, 3)": NO_STANCE,
    "lateral_sweep('icub', 0, 0.1, 3)": NO_STANCE,
    "limit_travel('icub', mt, L)": NO_STANCE,
    "map_postures('icub', grid, [mt], 'absent/x.zarr')": NO_STANCE,
    "path_through('icub', [s.q])": NO_STANCE,
    "push_limits('icub', 'base_link')": NO_STANCE,
    "propagate_uncertainty('icub', mt)": NO_STANCE,
    "propagate_uncertainty(s, 'x')": NO_CRITERION,
    "propagate_uncertainty(s, mt, 'usual')": "'usual' is not an uncertainty. Give Uncertainty(",
    "propagate_uncertainty(s, mt, {'links': {}})": "is not an uncertainty. Give Uncertainty(",
    "propagate_uncertainty(s, mt, limits='friction')": NO_LIMITS,
    "analyse(s, [mt], uncertainty=0.05)": "0.05 is not an uncertainty. Give Uncertainty(",
    "Uncertainty(links=3)": "links is 3. Write a table",
    "Uncertainty(payloads='l_hand')": "payloads is 'l_hand'. Write a list",
    "Uncertainty.from_dict([])": "an uncertainty is []. Write a table",
    "solve_equilibrium('icub', mt)": NO_STANCE,
    "solve_posture('icub', com=(0, 0, None))": NO_STANCE,
    "lateral_sweep(s.robot, 0, 0.1, 3)": "Make one with copsense.load_stance(...)",
    "sweep(s, [mt])": NO_PATH,
    "sweep('icub', [mt])": NO_PATH,
    "sweep(p, [copsense.minimum_torque])": "makes a criterion, and none itself. Call it",
    "PathScan(s, mt)": NO_PATH,
    "PathScan(None, mt)": NO_PATH,
    "design_criterion(s, L, 'length')": NO_PATH,
    "design_criterion(p, L, 'lengths')": "no family named 'lengths'. Did you mean length?",
    "mixed([(mt, 1)])": NO_PAIR,
    "mixed([])": NO_PAIR,
    "mixed(mt)": NO_PAIR,
    "mixed((3, 1.0))": NO_PAIR,
    "Stance.from_model(3, s.q, ['x'])": "3 is not a pin.Model. Give what pin.buildModelFromUrdf(",
    "Stance(3, s.q, ['x'])": "3 is not a robot. Give one, such as copsense.load_robot",
    "Stance(s.robot, s.q, 3)": "3 is not a contact. Give Contact(",
    "s.with_contacts(3)": "3 is not a contact. Give Contact(",
    "analyse(s, joints=[1])": NO_POSITIONS,
    "solve_posture(s, joints='l_knee')": NO_POSITIONS,
    "load_stance('four_bar', posture=[1])": NO_POSITIONS,
    "solve_posture(s, com=3)": "Give x, y and z [m]",
    "solve_posture(s, targets=[3, 3, 3, 3])": "3 is not a target of contact 'FL_FOOT'. Give a pin",
    "lateral_sweep(s, 0, 0.1, 'x')": "a sweep of x postures cannot be made. Give a count",
    "path_through(s, 3)": "3 is not a list of configurations",
    "Criterion('x', ['a'])": "the terms of criterion 'x' are ['a']. Give a tuple of TorqueTerm",
    "Criterion('x', 3)": "the terms of criterion 'x' are 3",
    "Criterion('', mt.terms)": "the name of a criterion is ''",
    "mt.named('')": "the name of a criterion is ''",
    "mt.named(3)": "the name of a criterion is 3",
    "Limits(normal_force=[1])": "limit normal_force is [1]. Give",
    "Limits(torque=True)": "a torque limit is True. Give a number",
    "Limits(torque={'l_knee': True})": "a torque limit is True. Give a number",
    "Limits(friction=True)": "limit friction is True. Give",
    "Contact('l_sole', friction='a')": "contact 'l_sole': friction is 'a'. Give",
    "Contact('l_sole', friction=True)": "contact 'l_sole': friction is True. Give",
    "Contact('l_sole', torsional_friction=[1])": "torsional_friction is [1]. Give",
    "Contact('l_sole', friction=-1)": "Give a non-negative number, or None",
    "Contact(3)": "3 is not the name of a contact",
    "Contact('l_sole', name=3)": "3 is not the name of a contact",
    "Contact(3, name='foot')": "3 is not the name of a frame",
    "Contact('l_sole', kind=[1])": "Valid kinds: surface, point, planar",
    "Contact('l_sole', plane=3)": "3 is not the plane of a contact. Give Plane(",
    "rectangle(3)": "x of the rectangle has shape (). Give",
    "rectangle((0, 1), ('a', 1))": "y of the rectangle is not an array of numbers. Give",
    "load_map(3)": "3 is not a path of a map. Give",
    "Sweep(3)": "3 is not the dataset of a sweep. Give what copsense.sweep returns",
    "Recording(3)": "3 is not the dataset of a recording. Give what",
    "Sweep.load(3)": "3 is not a path of a sweep. Give",
    "swept.save(3)": "3 is not a path of an output. Give",
    "swept.subset(['x'])": "no criterion in the sweep named 'x'. Valid: minimum-torque",
    "swept.subset('minimum-torque')": "'minimum-torque' is not a list of criteria's names. Give",
    "swept.subset(postures=[99])": "postures is [99]. Give a list of positions from 0 to 2",
    "swept.subset(postures=['a'])": "postures is ['a']. Give a list of positions from 0 to 2",
    "balance(s, gains=3)": "3 is not a set of gains. Give STIFF",
    "Drives(3)": "3 is not a list of names. Give a list of names, such as ['l_knee']",
    "Drives(motors=[3])": "3 is not a name",
    "Drives(motors='l_knee')": "'l_knee' is not a list of names",
    "Drives(springs=3)": "3 is not a mapping of springs. Give joint -> Spring(",
    "Drives(springs={3: Spring(1.0)})": "the joint of a spring or held torque is 3. Give a text",
    "Drives(held=3)": "3 is not a mapping of held torques. Give joint -> torque",
    "Drives(couplings=3)": "3 is not a list of couplings. Give Coupling(",
    "Drives(couplings=[3])": "3 is not a coupling. Give Coupling(",
    "Drives(loops=['a'])": "'a' is not a loop. Give Loop(",
    "Drives(transmissions=3)": "3 is not a list of transmissions. Give Transmission(",
    "Coupling('a', 4)": "what joint 'a' is coupled to is 4. Give a text",
    "Loop('a', 'a')": "a loop joins 'a' with itself. Give frames of two links",
    "s.with_loads('l_hand')": "'l_hand' is not a load. Give copsense.Load(",
    "Loop('a', 4)": "frame_b of a loop is 4. Give a text",
    "Transmission(1, 2, 3)": "1 is not a list of names",
    "Transmission('m', 'j', [[1]])": "'m' is not a list of names",
    "Transmission(('m',), ('j',), [[1]], ('a',))": "the effort limits of m are ('a',). Give one",
    "Drives().keeping(3)": "3 is not a list of names",
    "s.robot.keeping(3)": "3 is not a list of names. Give joints",
    "Robot(3, 4)": "4 is not a pin.Model. Give what pin.buildModelFromUrdf(",
    "Payload(3, 4)": "the frame of a payload is 3. Give a text",
    "s.with_loads(3)": "3 is not a load. Give copsense.Load(frame, force)",
    "load_stance('solo12', contacts=3)": "3 is not a list of contacts. Give frames or contacts",
    "load_stance('solo12', passive=3)": "3 is not a list of names",
    "PosturePath(1, 2, 3, 4, 5)": "1 is not a list of stances. Give one or more stances",
    "PosturePath((), 'y', 'm', [], [])": "a path holds no stance",
    "PosturePath((3,), 'y', 'm', [0], 3)": "3 is not a stance",
    "PosturePath((s,), 3, 'm', [0], 3)": "the coordinate of a path is 3. Give a text",
    "PosturePath((s,), 'y', 'm', 'a', 3)": "values of a path is not an array of numbers",
    "PosturePath((s,), 'y', 'm', [0], 3)": "tangents of a path has shape (). Give finite",
    "PosturePath((s,), 'y', 'm', [0, 1], 3)": "values of a path has shape (2,). Give finite",
    "Scenario(pushes=[3])": "3 is not a push. Give Push(",
    "Scenario(friction=3)": "3 is not a list of friction changes. Give FrictionChange(",
    "Scenario(motors=3)": "3 is not a scenario's motors. Give copsense.simulation.Motors(",
    "Motors(limit=[1])": "the torque limit [Nm] is [1]. Give a positive finite number",
    "ModelError(payload=3)": "3 is not a mapping of payloads. Give frame -> mass",
    "Push((1, 2, 3), frame=3)": "the frame of a push is 3. Give a text",
    "public_gains(3)": "3 is not a robot. Give stance.robot",
    "PathReference(3, Hold())": NO_PATH,
    "PathReference(p, 3)": "3 is not a signal. Give Hold(), Sine(",
    "lateral_reference('icub', Hold())": NO_STANCE,
    "lateral_reference(s, 3)": "3 is not a signal",
    "MujocoSimulator('icub')": NO_STANCE,
    "MujocoSimulator(s, 3)": "3 is not a value of PhysicsSettings. Give",
    "rollout(3, BalancingController(s, one), Scenario())": "3 is not a simulator. Give Mujoco",
    "rollout(MujocoSimulator(s), BalancingController(s, one), 3)": "3 is not a scenario. Give",
    "load_controller(3, s)": "the source of a controller is 3. Give a text",
    "BalancingController(s, mt, share=3)": "3 does not share a load. Give a function",
    "BalancingController(s, mt, name=3)": "the name of a controller is 3. Give a text",
    "Grid(3)": "3 is not a list of coordinates. Give Axis(",
    "Axis(3, 0, 1, 2)": "the name of a coordinate is 3. Give a text",
}
# What stays as it was: a family by its name, a criterion out of many, none at all.
ACCEPTED = (
    "family_named(s, 'length')",
    "swept.subset(['minimum-torque'], [-1, 0])",
    "com_regions(s, [], L)",
    "Stance(s.robot, s.q, s.contacts[0], check=False)",
    "Drives(loops=Loop('a', 'b'))",
    "Contact('l_sole', friction=np.float32(0.5))",
    "solve_equilibrium(s, pol_of_mt)",
    "BatchKernel(s, (c for c in [mt, one]))",
)

SETTING = """
import numpy as np
import copsense
from copsense import *
from copsense.batch import *
from copsense.controllers import *
from copsense.drives import *
from copsense.design import family_named
from copsense.maps import Axis, Grid
from copsense.pushes import push_limits
from copsense.path import PosturePath
from copsense.regions import com_region, criterion_region
from copsense.robot import Payload, Robot
from copsense.scan import limit_travel, next_active_set_change
from copsense.simulation import *
from copsense.simulation.disturbance import *
from copsense.uncertainty import *

s = copsense.load_stance("solo12")
p = copsense.lateral_sweep(s, -0.005, 0.005, 3)
mt, L = copsense.minimum_torque(), copsense.Limits(friction=0.5)
one = copsense.minimum_wrench(1.0)
def pol(q): return np.zeros((4, 6))
def pol_of_mt(q): return copsense.solve_equilibrium(s, mt).wrenches
scan = copsense.PathScan(p, mt)
swept = copsense.sweep(p, [mt])
grid = Grid((Axis("com_y", -0.01, 0.01, 2),))
"""


def answers(calls):
    """What each call answers, without the type checks of the suite: a process of its own."""
    tried = "".join(
        f"""
try:
    {call}
    print("accepted")
except copsense.CopsenseError as error:
    print(str(error).replace(chr(10), " "))
except Exception as error:
    print("escaped:", type(error).__name__, str(error).replace(chr(10), " "))
"""
        for call in calls
    )
    run = subprocess.run(
        [sys.executable, "-c", SETTING + tried], capture_output=True, text=True, check=True
    )
    said = run.stdout.splitlines()
    assert len(said) == len(calls)
    return dict(zip(calls, said, strict=True))


def test_what_is_not_asked_for_is_one_error_that_says_what_to_give():
    said = answers((*CALLS, *ACCEPTED))
    wrong = {call: said[call] for call, word in CALLS.items() if word not in said[call]}
    assert not wrong
    assert all(said[call].endswith(".") for call in CALLS)
    assert {call: said[call] for call in ACCEPTED} == dict.fromkeys(ACCEPTED, "accepted")
