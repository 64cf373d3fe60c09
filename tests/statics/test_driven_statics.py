"""Loads, springs, couplings, loops and joints without motors, beside statics written apart."""

import subprocess
import sys

import numpy as np
import pinocchio as pin
import pytest
from support.differences import relative
from support.driven_robots import everything, rod_biped_model, rod_drives, standing
from support.mujoco_balance import missing_forces
from support.statics_apart import frame_at, loop_gaps, motor_map, solve_apart

from copsense import (
    Criterion,
    Drives,
    Limits,
    Load,
    PathScan,
    Robot,
    Stance,
    TorqueTerm,
    WrenchTerm,
    analyse,
    check_sensitivity,
    com_regions,
    cop_sensitivity,
    lateral_sweep,
    load_stance,
    minimum_torque,
    minimum_wrench,
    solve_equilibrium,
    solve_posture,
    sweep,
    weighted_torque,
)
from copsense.cop import total_center_of_pressure
from copsense.drives import Coupling, Loop, Spring
from copsense.errors import (
    InvalidInputError,
    OpenLoopError,
    UnbalancedError,
    UndeterminedWrenchError,
    UnknownNameError,
)
from copsense.loads import SpringLoad
from copsense.margins import limit_margins
from copsense.polygon import Polygon
from copsense.posture import retract
from copsense.regions import com_region
from copsense.sensitivity import finite_difference_sensitivity

APART = 1e-8
ENGINE = 1e-9  # of the weight, in N and Nm

LOADS = (
    Load("hand", (10.0, -5.0, -20.0), (1.0, 2.0, -1.5), (0.01, 0.02, 0.03)),
    Load("l_heel", (3.0, 4.0, 5.0), (0.3, 0.0, 0.2), fixed_to="body", name="strap"),
    SpringLoad("hand", (0.1, 0.2, 0.3), (100.0, 50.0, 20.0), (1.0, 2.0, 3.0), name="rope"),
)


def rods(kind):
    return standing(Robot.from_model(rod_biped_model(), drives=rod_drives(kind)), 0.01)


def coupled():
    drives = Drives(
        couplings=(Coupling("r_hip_yaw", "l_hip_yaw", -1.0), Coupling("forearm", "arm", 0.5, -1.0))
    )
    return standing(Robot.from_model(rod_biped_model(rods=False), drives=drives), 0.005)


def all_at_once():
    stance = standing(everything(), 0.01)
    # The forearm hangs: under these loads it hangs elsewhere.
    return solve_posture(stance.with_loads(LOADS), com=(stance.com[0], 0.01, None)).stance


CASES = {
    "pinned rods": lambda: rods("pin"),
    "rods on balls": lambda: rods("ball"),
    "loads": lambda: standing(Robot.from_model(rod_biped_model(rods=False))).with_loads(LOADS),
    "couplings": coupled,
    "all at once": all_at_once,
}


@pytest.fixture(scope="module", params=CASES)
def case(request):
    return CASES[request.param]()


def mixed_weights(stance):
    """A torque weight for each motor, and wrench weights."""
    motors = motor_map(stance.robot)[1]
    torque = {name: 0.5 + 0.1 * i for i, name in enumerate(motors)}
    return torque, [1e-3, 1e-3, 2e-4, 0.1, 0.05, 0.2]


def both(stance):
    torque, wrench = mixed_weights(stance)
    return Criterion("both", (TorqueTerm(torque), WrenchTerm(wrench)))


def test_wrenches_and_torques_are_those_of_a_system_written_apart(case):
    torque, wrench = mixed_weights(case)
    for criterion, Wt, Wf in (
        (minimum_torque(), 1.0, np.zeros(6)),
        (minimum_wrench(0.5), 0.0, [1, 1, 1, 4, 4, 4]),
        (both(case), list(torque.values()), wrench),
    ):
        found = solve_equilibrium(case, criterion)
        forces, torques = solve_apart(case, Wt, Wf)
        assert relative(found.wrenches.ravel(), forces) < APART
        known = dict(zip(case.robot.torque_names, found.torques, strict=True))
        assert known.keys() == torques.keys()
        largest = max(abs(t) for t in torques.values())
        assert all(abs(known[j] - t) < APART * largest for j, t in torques.items())
        assert found.residual() < ENGINE * case.robot.weight


def test_sensitivity_is_the_difference_of_systems_written_apart(case):
    torque, wrench = mixed_weights(case)
    found, h = cop_sensitivity(case, both(case)), 2e-3
    rng = np.random.default_rng(3)
    z = rng.normal(size=found.basis.shape[1])
    v = found.basis @ (z / np.linalg.norm(z))
    at = {
        s: solve_apart(retract(case, s * h * v), list(torque.values()), wrench)
        for s in (-2, -1, 1, 2)
    }

    def rate(values):
        return (8 * (values(1) - values(-1)) - (values(2) - values(-2))) / (12 * h)

    along = found.basis.T @ v
    forces = rate(lambda s: at[s][0]).reshape(-1, 6)
    assert relative(found.wrench_derivative @ along, forces) < APART
    torques = rate(lambda s: np.array([at[s][1][j] for j in case.robot.torque_names]))
    assert relative(found.torque_derivative @ along, torques) < APART


@pytest.mark.parametrize(
    "criterion", [minimum_torque(), weighted_torque("inverse inertia")], ids=lambda c: c.name
)
def test_sensitivity_is_the_difference_of_its_own_equilibria(case, criterion):
    exact = cop_sensitivity(case, criterion)
    numeric = finite_difference_sensitivity(case, criterion)
    assert relative(exact.matrix, numeric.matrix) < APART
    assert relative(exact.torque_derivative, numeric.torque_derivative) < APART


def test_the_derivative_within_limits_is_that_of_the_pressing_ones():
    stance = rods("pin")
    free = solve_equilibrium(stance, minimum_torque())
    joint = int(np.abs(free.torques).argmax())
    name, most = stance.robot.torque_names[joint], 0.95 * float(np.abs(free.torques[joint]))
    limits = Limits(normal_force=0.0, friction=0.6, cop_margin=0.0, torque={name: most})
    found = solve_equilibrium(stance, minimum_torque(), limits)
    assert [limit.name for limit in found.active] == [f"torque of {name}"]
    assert found.optimality() < 1e-8
    exact = cop_sensitivity(stance, minimum_torque(), limits)
    numeric = finite_difference_sensitivity(stance, minimum_torque(), limits)
    assert relative(exact.matrix, numeric.matrix) < APART


def test_mujoco_needs_no_other_force(case):
    """Its bias and Jacobians are balanced by contacts, loops, loads and motors alone."""
    missing = missing_forces(case, solve_equilibrium(case, minimum_torque()))
    assert np.abs(missing).max() < ENGINE * case.robot.weight


def test_a_posture_closes_every_loop_and_its_tangent_keeps_it_closed():
    stance = rods("pin")
    moved = solve_posture(stance, com=(stance.com[0], 0.03, None), joints={"l_knee": 0.75})
    assert np.abs(loop_gaps(moved.stance.robot, moved.stance.q)).max() < 1e-11
    h = 1e-5
    ahead = pin.integrate(stance.robot.model, moved.stance.q, h * moved.tangents[:, 1])
    assert np.abs(loop_gaps(stance.robot, ahead)).max() < 100 * h**2


def test_a_coupled_joint_follows_and_takes_one_motion_away():
    stance = coupled()
    free = stance.robot.with_drives(Drives())
    loose = type(stance)(free, stance.q, stance.contacts)
    assert stance.admissible_motions.shape[1] == loose.admissible_motions.shape[1] - 2
    held = solve_posture(stance, joints={"l_hip_yaw": 0.1}).stance
    assert held.robot.joint_position(held.q, "r_hip_yaw") == pytest.approx(-0.1, abs=1e-12)
    assert "r_hip_yaw" not in stance.robot.torque_names


def test_a_motor_that_may_not_push_is_no_motor():
    """A limit of nothing on a joint's torque is a joint without a motor."""
    model = rod_biped_model()
    idle = Robot.from_model(model, drives=rod_drives("pin"))
    driven = Drives(motors=(*idle.torque_names, "l_ankle_pitch"), loops=idle.drives.loops)
    stance = standing(idle, 0.01)
    more = type(stance)(Robot.from_model(model, drives=driven), stance.q, stance.contacts)
    held = solve_equilibrium(more, minimum_torque(), Limits(torque={"l_ankle_pitch": 0.0}))
    without = solve_equilibrium(stance, minimum_torque())
    assert relative(held.wrenches, without.wrenches) < 1e-9


def test_a_payload_is_its_weight_hung_there():
    stance = standing(Robot.from_model(rod_biped_model(rods=False)))
    heavier = type(stance)(
        stance.robot.with_payload("hand", 3.0, com=(0.02, 0.0, -0.05)), stance.q, stance.contacts
    )
    hung = stance.with_loads(
        [Load("hand", (0.0, 0.0, -3.0 * 9.81), point=(0.02, 0.0, -0.05), name="payload")]
    )
    assert heavier.robot.mass == pytest.approx(stance.robot.mass + 3.0)
    for criterion in (minimum_torque(), minimum_wrench(1.0)):
        a, b = cop_sensitivity(heavier, criterion), cop_sensitivity(hung, criterion)
        assert relative(a.cop, b.cop) < 1e-10
        assert relative(a.matrix, b.matrix) < 1e-10


def test_the_total_centre_of_pressure_is_that_of_weight_and_loads():
    stance = standing(Robot.from_model(rod_biped_model(rods=False))).with_loads(LOADS)
    found = total_center_of_pressure(solve_equilibrium(stance, minimum_torque()))
    wrenches, points = stance.applied.wrenches, stance.applied.points
    force = wrenches[:, :3].sum(axis=0) + np.array([0, 0, -stance.robot.weight])
    moment = wrenches[:, 3:].sum(axis=0) + np.cross(points, wrenches[:, :3]).sum(axis=0)
    moment = moment + np.cross(stance.com, [0, 0, -stance.robot.weight])
    expected = np.array([-moment[1], moment[0]]) / force[2]
    assert np.abs(found[:2] - expected).max() < 1e-12


def test_a_joint_that_nothing_holds_is_an_error_that_says_what_it_lacks():
    drives = Drives(
        motors=tuple(j for j in rod_drives().motors if j != "forearm" and "crank" not in j)
    )
    motors = (*drives.motors, "l_ankle_pitch", "r_ankle_pitch")
    robot = Robot.from_model(rod_biped_model(rods=False), drives=Drives(motors=motors))
    full = standing(robot.with_drives(Drives()))
    bent = type(full)(robot, full.q, full.contacts)
    with pytest.raises(UnbalancedError, match="forearm lacks") as caught:
        solve_equilibrium(bent, minimum_torque())
    needed = solve_equilibrium(full, minimum_torque()).torques
    lacking = needed[full.robot.torque_names.index("forearm")]
    assert caught.value.lacking["forearm"] == pytest.approx(lacking, rel=1e-9)
    hanging = solve_posture(bent, com=(full.com[0], 0.0, None)).stance
    assert abs(hanging.balance[robot.velocity_index("forearm")]) < 1e-9
    solve_equilibrium(hanging, minimum_torque())


def test_scans_regions_and_analyses_take_loops_and_loads_along(tmp_path):
    stance = rods("pin").with_loads([Load("hand", (0.0, 5.0, -15.0))])
    limits = Limits(friction=0.6, torque=25.0)
    y = float(stance.com[1])
    path = lateral_sweep(stance, y - 0.06, y + 0.06, 7, com_x=float(stance.com[0]))
    for criterion in (minimum_torque(), minimum_wrench(1.0)):
        first = PathScan(path, criterion).travel(limits).first
        there = solve_posture(stance, com=(stance.com[0], y + first.exact, None)).stance
        at_limit = {
            m.name: m.value for m in limit_margins(solve_equilibrium(there, criterion), limits)
        }
        assert min(abs(value) for value in at_limit.values()) < 1e-6
        # The region of the held posture has its edge where the wrenches there meet a limit.
        region = com_regions(stance, [criterion], limits).unclipped[criterion.name]
        assert region.contains(stance.com[:2])
    table = sweep(path, [minimum_torque()], limits)
    assert list(table.to_xarray()["joint"].values) == list(stance.robot.torque_names)
    table.save(tmp_path / "sweep.nc")
    told = analyse(stance, [minimum_torque(), minimum_wrench(1.0)], limits)
    assert "minimum-torque" in str(told)


def test_the_region_under_a_load_is_an_affine_image_of_the_region_without():
    """c = (F_n p + F_z e_xy - e_z F_xy) / (m g), p over the soles."""
    stance = standing(Robot.from_model(rod_biped_model(rods=False)))
    force, weight = np.array([6.0, 8.0, -20.0]), stance.robot.weight
    limits = Limits(friction=None, torsion=None)
    loaded = com_region(stance.with_loads([Load("hand", tuple(force))]), limits)
    bare = com_region(stance, limits).polygon
    x, y, z = frame_at(stance.robot, stance.q, "hand").translation
    above = z - stance.placements[0].translation[2]
    image = (weight - force[2]) * bare + force[2] * np.array([x, y]) - above * force[:2]
    assert Polygon(image / weight).area == pytest.approx(loaded.area, rel=1e-9)
    for corner in image / weight:
        assert abs(loaded.margin(corner)) < 1e-7


def test_an_open_loop_is_an_error():
    stance = rods("ball")
    q = stance.q.copy()
    q[stance.robot.model.joints[stance.robot.joint_id("l_crank")].idx_q] += 0.05
    with pytest.raises(OpenLoopError, match=r"l rod .* is open by"):
        stance.at(q)


@pytest.mark.parametrize(
    ("drives", "error", "said"),
    [
        (lambda: Drives(motors=("knee",)), UnknownNameError, "l_knee"),
        (lambda: Drives(springs={"elbow": Spring(1.0)}), UnknownNameError, "spring"),
        (lambda: Drives(held={"l_knee": np.nan}), InvalidInputError, "l_knee"),
        (lambda: Drives(couplings=(Coupling("l_knee", "l_knee"),)), InvalidInputError, "itself"),
        (
            lambda: Drives(
                couplings=(Coupling("a", "b"), Coupling("b", "c", 2.0), Coupling("c", "b", 0.5))
            ),
            InvalidInputError,
            r"in a circle \(a follows b follows c follows b\): none leads",
        ),
        (
            lambda: Drives(couplings=(Coupling("l_knee", "arm"), Coupling("l_knee", "l_hip"))),
            InvalidInputError,
            "two joints",
        ),
        (
            lambda: Drives(motors=("l_knee",), couplings=(Coupling("l_knee", "arm"),)),
            InvalidInputError,
            "among the motors",
        ),
        (lambda: Drives(loops=(Loop("hand", "foot"),)), UnknownNameError, "l_foot"),
    ],
)
def test_bad_drives_are_rejected(drives, error, said):
    with pytest.raises(error, match=said):
        Robot.from_model(rod_biped_model(rods=False), drives=drives())


@pytest.mark.parametrize(
    ("load", "error", "said"),
    [
        (lambda: Load("elbow", (0, 0, 1)), UnknownNameError, "hand"),
        (lambda: Load("hand", (0, 0, np.inf)), InvalidInputError, "force"),
        (lambda: SpringLoad("hand", (0, 0, 1), (-1, 0, 0)), InvalidInputError, "stiffness"),
    ],
)
def test_bad_loads_are_rejected(load, error, said):
    stance = standing(Robot.from_model(rod_biped_model(rods=False)))
    with pytest.raises(error, match=said):
        solve_equilibrium(stance.with_loads([load()]), minimum_torque())


WRONG_TYPES = {
    'Drives(springs={"l_knee": 3.0})': "Spring",
    'Drives(motors="l_knee")': "list",
    'Loop("hand", "l_foot", "rope")': "ball",
    'Load("hand", (0, 1))': "force",
    'Load("hand", (0, 0, "a"))': "force",
    'Load("hand", (0, 0, 1), fixed_to="ground")': "world",
    "stance.with_loads([(0, 0, -9.81)])": "Load",
    'stance.with_loads({"hand": (0, 0, 1)})': "Load",
    'stance.robot.with_drives({"motors": ()})': "Drives",
    'stance.robot.with_payload("l_hand", "heavy")': "number",
}


def test_values_of_a_wrong_type_are_rejected_in_words():
    """In a process of its own: here the suite's type checks would answer first."""
    calls = "".join(
        f"""
try:
    {call}
    print("accepted")
except copsense.CopsenseError as error:
    print(str(error).replace(chr(10), " "))
"""
        for call in WRONG_TYPES
    )
    code = f"""
import copsense
from copsense import Drives, Load
from copsense.drives import Loop
stance = copsense.load_stance("icub")
{calls}"""
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    said = run.stdout.splitlines()
    assert len(said) == len(WRONG_TYPES)
    for line, (call, word) in zip(said, WRONG_TYPES.items(), strict=True):
        assert word in line, f"{call}: {line}"


def test_a_loop_between_limbs_with_motors_changes_no_wrench_that_weighs_wrenches_alone():
    """The forces in it are between the motors; on the base its rows are rounding, and no lever."""
    closed = load_stance("icub", drives=Drives(loops=(Loop("l_hand", "r_hand"),)))
    opened = Stance(closed.robot.with_drives(Drives()), closed.q, closed.contacts)
    criterion = minimum_wrench(1.0)
    one, other = (solve_equilibrium(stance, criterion) for stance in (opened, closed))
    weight = closed.robot.weight
    assert other.residual() < 1e-9 * weight
    np.testing.assert_allclose(other.wrenches, one.wrenches, rtol=0, atol=1e-9 * weight)
    np.testing.assert_allclose(other.torques, one.torques, rtol=0, atol=1e-9 * weight)
    check_sensitivity(closed, criterion)
    with pytest.raises(UndeterminedWrenchError, match="forces in the loops undetermined"):
        solve_equilibrium(closed, criterion, Limits(friction=0.5))
    said = analyse(closed, limits=Limits(friction=0.5)).notes
    assert any("minimum-wrench is left out" in note for note in said)
