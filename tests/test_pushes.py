"""Pushes: beside bisection on loads, the theory's figures, and any equilibrium's linear program."""

import json

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.optimize import linprog

import copsense
from copsense import Limits, Load, minimum_torque, minimum_wrench, solve_equilibrium
from copsense.cli import copsense as command
from copsense.errors import InfeasibleError, InvalidInputError, UnknownNameError
from copsense.limits import limit_rows
from copsense.load_problem import LoadProblem
from copsense.pushes import push_limits

LIMITS = Limits(friction=0.6, torque=40.0)
TORQUE, WRENCH = minimum_torque(), minimum_wrench(1.0)


@pytest.fixture(scope="module")
def at_com(icub):
    """Pushes on the iCub at the height of its CoM, and where in its root frame that is."""
    data = icub.robot.model.createData()
    import pinocchio as pin

    pin.framesForwardKinematics(icub.robot.model, data, icub.q)
    root = data.oMf[icub.robot.model.getFrameId("root_link")]
    point = tuple(float(x) for x in root.actInv(icub.com))
    return push_limits(icub, "root_link", [WRENCH, TORQUE], LIMITS, point=point), point


def test_the_figures_of_the_theory(at_com):
    found, _ = at_com
    sideways = [region.largest((0, 1)) for region in found.regions]
    assert sideways == pytest.approx([70.8, 22.8, 28.9], abs=0.05)
    forwards = [region.largest((1, 0)) for region in found.regions]
    assert min(forwards) > 75.5
    assert max(forwards) < 77.5


def test_a_push_at_the_height_of_the_com_is_a_travel_of_the_com(at_com, icub):
    """Under the minimum wrench F h = m g dy, exactly: 22.79 N and 38.38 mm."""
    found, _ = at_com
    path = copsense.lateral_sweep(icub, -0.06, 0.06, 13)
    travel = copsense.PathScan(path, WRENCH).travel(Limits(friction=0.6))
    force = found.criteria[0].largest((0, 1))
    assert force * icub.com[2] == pytest.approx(icub.robot.weight * travel.first.exact, rel=1e-6)


@pytest.mark.parametrize("angle", [0.3, 1.7, 3.4, 5.0])
def test_the_largest_push_is_where_a_load_first_breaks_a_limit(at_com, icub, angle):
    found, point = at_com
    u = np.array([np.cos(angle), np.sin(angle)])
    rows = limit_rows(icub, LIMITS)

    def slack(force, criterion):
        push = Load("root_link", (*(force * u), 0.0), point=point)
        pushed = icub.with_loads([push])
        forces = solve_equilibrium(pushed, criterion).forces
        A, b = rows.over_forces(LoadProblem.of(pushed))
        return float((b - A @ forces).min())

    for region, criterion in zip(found.criteria, (WRENCH, TORQUE), strict=True):
        low, high = 0.0, 200.0
        for _ in range(45):
            middle = (low + high) / 2
            low, high = (middle, high) if slack(middle, criterion) >= 0 else (low, middle)
        assert region.largest(u) == pytest.approx(low, abs=1e-6)
        name = region.limited_by(u)
        pushed = icub.with_loads([Load("root_link", (*(low * u), 0.0), point=point)])
        A, b = rows.over_forces(LoadProblem.of(pushed))
        tight = b - A @ solve_equilibrium(pushed, criterion).forces
        assert name == rows.all_names[int(tight.argmin())]


def test_the_weakest_direction_is_the_least_of_all(at_com):
    for region in at_com[0].regions:
        force, angle, _ = region.weakest
        around = np.linspace(0, 2 * np.pi, 721)
        sizes = [region.largest((np.cos(a), np.sin(a))) for a in around]
        assert force <= min(sizes) + 1e-9
        assert region.largest((np.cos(angle), np.sin(angle))) == pytest.approx(force, rel=1e-9)


@pytest.mark.parametrize("angle", [0.0, 1.1, 2.9])
def test_any_equilibrium_is_a_linear_program_over_forces_and_size(at_com, icub, angle):
    found, point = at_com
    u = np.array([np.cos(angle), np.sin(angle), 0.0])
    none, one = (
        LoadProblem.of(icub),
        LoadProblem.of(icub.with_loads([Load("root_link", tuple(u), point=point)])),
    )
    A, b = limit_rows(icub, LIMITS).over_forces(none)
    b1 = limit_rows(icub, LIMITS).over_forces(one)[1]
    m = A.shape[1]
    best = linprog(
        np.append(np.zeros(m), -1.0),
        A_ub=np.column_stack([A, b - b1]),
        b_ub=b,
        A_eq=np.column_stack([none.base_map, none.base_wrench - one.base_wrench]),
        b_eq=none.base_wrench,
        bounds=[(None, None)] * m + [(0, None)],
    )
    assert found.any.largest(u[:2]) == pytest.approx(best.x[-1], abs=2e-4 * icub.robot.weight)
    assert all(r.largest(u[:2]) <= best.x[-1] * (1 + 1e-6) for r in found.criteria)


def test_a_robot_that_breaks_its_limits_unpushed_does_not_stand(icub):
    far = copsense.solve_posture(icub, com=(float(icub.com[0]), 0.05, None)).stance
    found = push_limits(far, "root_link", [WRENCH])
    assert not found.criteria[0].stands
    assert found.criteria[0].largest((1, 0)) == 0.0
    assert "does not stand" in str(found)
    with pytest.raises(InfeasibleError):
        push_limits(icub, "root_link", [WRENCH], Limits(torque=0.5))


def test_bad_questions_are_rejected(icub, stance_of):
    with pytest.raises(UnknownNameError, match="root_link"):
        push_limits(icub, "root_lnk", [WRENCH])
    with pytest.raises(InvalidInputError, match="plane"):
        push_limits(stance_of("four_bar"), "l_foot", [WRENCH])
    found = push_limits(icub, "root_link", [WRENCH])
    with pytest.raises(InvalidInputError, match="zero"):
        found.any.largest((0, 0))


def test_the_command_prints_what_python_gives(icub, tmp_path):
    picture = tmp_path / "push.svg"
    words = ["push", "icub", "--at", "root_link", "--plot", str(picture), "--json"]
    run = CliRunner().invoke(command, words)
    assert run.exit_code == 0, run.output
    found = push_limits(icub, "root_link", [WRENCH, TORQUE]).to_dict()
    told = json.loads(run.stdout)
    assert told.pop("plot") == str(picture)
    assert told["regions"]["any equilibrium"]["weakest"]["force"] == pytest.approx(
        found["regions"]["any equilibrium"]["weakest"]["force"], rel=1e-6
    )
    assert json.dumps(told["limits"]) == json.dumps(found["limits"])
    assert "<svg" in picture.read_text()


@pytest.mark.parametrize(
    "words",
    [
        ["--load", "l_hand=1:2"],
        ["--load", "l_hand"],
        ["--load", "elbow=0:0:1"],
        ["--load", "l_hand=0:0:nan"],
        ["--payload", "l_hand=-2"],
        ["--payload", "l_hand=heavy"],
        ["--payload", "=2"],
    ],
)
def test_bad_loads_are_one_clear_error(words):
    run = CliRunner().invoke(command, ["analyse", "icub", *words])
    assert isinstance(run.exception, copsense.CopsenseError), run.output


def test_a_payload_shifts_the_robot_and_a_load_its_feet(icub):
    plain, loaded = (
        json.loads(CliRunner().invoke(command, ["analyse", "icub", "--json", *more]).stdout)
        for more in ([], ["--payload", "l_hand=2", "--load", "r_hand=0:0:-20"])
    )
    assert loaded["com"][:2] == pytest.approx(plain["com"][:2], abs=1e-9)
    here = copsense.load_stance("icub")
    from copsense.posture import carry_payload

    there = carry_payload(here, "l_hand", 2.0).with_loads([Load("r_hand", (0, 0, -20.0))])
    expected = copsense.analyse(there).to_dict()
    assert loaded["criteria"].keys() == expected["criteria"].keys()
