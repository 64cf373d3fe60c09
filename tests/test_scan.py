"""A criterion along a path: solved once, exact between its postures, and no farther than asked."""

from dataclasses import replace

import numpy as np
import pytest

import copsense
import copsense.scan
from copsense.errors import InvalidInputError, UnreachablePostureError
from copsense.limits import NO_LIMITS, Limits
from copsense.margins import limit_margins, margin_table
from copsense.path import LateralPath
from copsense.scan import PathScan

TORQUE, WRENCH = copsense.minimum_torque(), copsense.minimum_wrench(1.0)
LIMITS = Limits(normal_force=10.0, friction=1 / 3, torsion=1 / 75, torque="model")
COP_ONLY = replace(NO_LIMITS, cop_margin=0.0)


@pytest.fixture
def counted(monkeypatch):
    """How often an equilibrium was solved."""
    calls = []
    solve = copsense.scan.solve_equilibrium

    def counting(*arguments):
        calls.append(arguments)
        return solve(*arguments)

    monkeypatch.setattr(copsense.scan, "solve_equilibrium", counting)
    return calls


def test_forces_torques_and_rates_are_those_of_the_postures(icub):
    path = copsense.lateral_sweep(icub, -0.03, 0.03, 5)
    scan = PathScan(path, TORQUE)
    for i, (stance, tangent) in enumerate(zip(path.stances, path.tangents, strict=True)):
        found = copsense.solve_equilibrium(stance, TORQUE)
        df, dtau = found.derivative(tangent[:, None])
        np.testing.assert_array_equal(scan.forces[i], found.forces)
        np.testing.assert_array_equal(scan.torques[i], found.torques)
        np.testing.assert_allclose(scan.force_rates[i], df[:, 0], atol=1e-9)
        np.testing.assert_allclose(scan.torque_rates[i], dtau[:, 0], atol=1e-9)
        margins = [m.value for m in limit_margins(found, LIMITS)]
        np.testing.assert_allclose(scan.margins(LIMITS)[i], margins, atol=1e-12)
        gain = copsense.cop_sensitivity(stance, TORQUE).com_gain
        np.testing.assert_allclose(scan.points[i].com_gain, gain, atol=1e-10)
    values, rates = scan.slacks(LIMITS)
    table = margin_table(icub, LIMITS)
    np.testing.assert_array_equal(values, table.slack(scan.forces, scan.torques))
    numeric = np.gradient(values, path.values, axis=0)[1:-1]
    assert np.abs(rates[1:-1] - numeric).max() < 2e-2 * np.abs(rates).max()


def test_every_posture_is_solved_once(icub, counted):
    path = copsense.lateral_sweep(icub, -0.03, 0.03, 5)
    scan = PathScan(path, WRENCH)
    for _ in range(2):
        scan.slacks(LIMITS)
        scan.margins(LIMITS)
    assert len(counted) == 5


def test_postures_are_shared_between_criteria_sides_and_questions(icub, monkeypatch):
    solved = []
    solve = copsense.path.solve_posture

    def counting(*arguments, **options):
        solved.append(options["com"][1])
        return solve(*arguments, **options)

    monkeypatch.setattr(copsense.path, "solve_posture", counting)
    path = LateralPath(icub)
    alone = copsense.scan.limit_travel(icub, TORQUE, COP_ONLY)
    own = len(solved)
    for criterion in (WRENCH, TORQUE):
        PathScan(path, criterion).travel(COP_ONLY)
    together = len(solved) - own
    shared = PathScan(path, TORQUE).travel(COP_ONLY)
    assert shared.first.exact == pytest.approx(alone.first.exact, abs=1e-9)
    assert together < 1.6 * own
    before = len(solved)
    change = PathScan(path, TORQUE, LIMITS).next_active_set_change()
    assert len(solved) - before < 8  # its grid was there already
    assert change.travel == pytest.approx(alone.first.exact, abs=1e-9)


def test_a_search_stops_at_the_first_crossing(icub, counted):
    path = copsense.lateral_sweep(icub, -0.06, 0.06, 25)
    scan = PathScan(path, WRENCH)
    table = margin_table(icub, COP_ONLY)

    def slack(point):
        return (
            table.slack(point.forces, point.torques),
            table.slack_rates(point.force_rates, point.torque_rates),
        )

    found = scan.first(slack, exact=False)
    assert len(counted) == 9  # 0 to 40 mm, every 5 mm
    exact = scan.first(slack)
    assert len(counted) <= 12
    assert exact.value == scan.start + exact.travel
    assert table.where[exact.row] == "r_sole"
    assert table.names[exact.row].endswith("+y (left)")
    assert exact.travel == pytest.approx(
        copsense.scan.limit_travel(path.stances[12], WRENCH, COP_ONLY).first.exact, abs=1e-5
    )
    assert found.travel == pytest.approx(exact.travel, abs=1e-8)
    assert scan.first(slack, reach=0.03) is None
    assert scan.first(slack, -1).value < 0


def test_a_joints_path_gives_the_postures_in_between(icub):
    path = copsense.joint_sweep(icub, "l_hip_roll", -0.1, 0.1, 5)
    here, tangent = path.at(0.0333)
    assert icub.robot.joint_position(here.q, "l_hip_roll") == pytest.approx(0.0333, abs=1e-12)
    np.testing.assert_allclose(icub.jacobian.shape[0], here.jacobian.shape[0])
    assert np.abs(here.jacobian @ tangent).max() < 1e-9
    travel = PathScan(path, WRENCH, start=0.0).travel(COP_ONLY)
    assert all(t.exact is None or 0 < t.exact <= 0.1 for t in travel.limits)
    shifted = path.shifted(1.0)
    same, _ = shifted.at(1.0333)
    np.testing.assert_allclose(same.q, here.q, atol=1e-9)


def test_a_list_of_configurations_has_nothing_in_between(icub):
    lateral = copsense.lateral_sweep(icub, -0.05, 0.05, 11)
    path = copsense.path_through(icub, [s.q for s in lateral.stances])
    assert not path.continuous
    assert path.at(3.0)[0] is path.stances[3]
    with pytest.raises(InvalidInputError, match="list of configurations"):
        path.at(3.5)
    # What it has is enough for the cubics: indices are centimetres.
    table = margin_table(icub, COP_ONLY)
    found = PathScan(path, WRENCH).first(
        lambda p: (
            table.slack(p.forces, p.torques),
            table.slack_rates(p.force_rates, p.torque_rates),
        )
    )
    assert found.travel == pytest.approx(3.84, abs=2e-2)


def test_an_unreachable_posture_is_said_again(icub):
    path = copsense.lateral_sweep(icub, 0.0, 0.9, 4)
    assert path.failures
    with pytest.raises(UnreachablePostureError):
        path.at(0.9)
    lateral = LateralPath(icub)
    for _ in range(2):
        with pytest.raises(UnreachablePostureError):
            lateral.at(0.9)


def test_a_policy_and_another_side_are_rejected(icub):
    path = copsense.lateral_sweep(icub, -0.01, 0.01, 3)
    with pytest.raises((InvalidInputError, TypeError)):
        PathScan(path, lambda q: np.zeros((2, 6)))
    with pytest.raises(InvalidInputError, match=r"\+1 or -1"):
        PathScan(path, WRENCH).travel(COP_ONLY, 0)
    with pytest.raises(InvalidInputError, match="no limit"):
        PathScan(path, WRENCH).next_active_set_change()
    found = copsense.cop_sensitivity(icub, WRENCH)
    with pytest.raises(InvalidInputError, match="side"):
        found.one_sided(path.tangents[1], side=0)
