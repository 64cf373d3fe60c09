"""Charts: contacts in place, coordinates reached, failures as rows, no row aware of others."""

import importlib.util
import pickle

import numpy as np
import pinocchio as pin
import pytest
from support.stances import postures
from support.walkers import BIPED, FULL, NO_ANKLE_ROLL, PITCH_ONLY, bent, walker

import copsense
from copsense.batch import PostureChart, coordinate_names, evaluate_batch
from copsense.posture import contact_error
from copsense.posture_system import supporting_joints

MET = 1e-10  # m, rad
POSE = ("base_x", "base_y", "base_z", "roll", "pitch", "yaw")
COM = ("com_x", "com_y", "com_z", "roll", "pitch", "yaw")
ROBOTS = ("icub", "talos on slopes", "g1", "anymal_c", "solo12 on slopes", "human")
HANDS = ("icub, hand on a wall", "icub, both hands", "icub, three surfaces")
FREE = {"icub": ("torso_yaw", "l_elbow"), "talos on slopes": ("torso_1_joint",), "g1": ()}


def near(chart, count, *, size=0.02, seed=0):
    """Values around the stance's own (count, k)."""
    rng = np.random.default_rng(seed)
    return chart.values + size * rng.uniform(-1, 1, (count, len(chart.names)))


def base_pose(stance, q):
    root = stance.robot.model.jointPlacements[1] * pin.XYZQUATToSE3(np.array(q[:7]))
    return np.concatenate([root.translation, pin.rpy.matrixToRpy(root.rotation)])


def reached(stance, q, name):
    """A coordinate of a configuration, from Pinocchio."""
    here = stance.at(q, check=False)
    if name.startswith("com_"):
        return here.com["xyz".index(name[-1])]
    if name in POSE:
        return base_pose(stance, q)[POSE.index(name)]
    return here.robot.joint_position(q, name)


def worst_contact(stance, q):
    here = stance.at(q)  # with the checks of its planes
    return np.abs(contact_error(here, stance.placements)).max()


@pytest.mark.parametrize("names", [POSE, COM], ids=["base", "com"])
@pytest.mark.parametrize("name", ROBOTS)
def test_contacts_hold_and_coordinates_are_reached(case, name, names):
    stance = case(name)
    chart = PostureChart(stance, (*names, *FREE.get(name, ())))
    assert not chart.fallback_reason
    values = near(chart, 60)
    batch = chart.solve(values)
    assert len(batch) == 60
    assert batch.converged.sum() >= 12
    for i in np.flatnonzero(batch.converged):
        q = batch.configurations[i]
        assert worst_contact(stance, q) < MET
        off = [reached(stance, q, c) - v for c, v in zip(chart.names, values[i], strict=True)]
        assert np.abs((np.array(off) + 1) % (2 * np.pi) - 1).max() < MET
        assert batch.residuals[i] < 1e-12
        assert not batch.reasons[i]


@pytest.mark.parametrize("name", ["icub", "anymal_c"])
def test_what_is_not_named_keeps_the_stances_value(case, name):
    stance = case(name)
    batch = PostureChart(stance, ["com_y"]).solve([[stance.com[1] + 0.02]])
    q, mask = batch.configurations[0], supporting_joints(stance)
    assert np.array_equal(q[3:7], stance.q[3:7])
    np.testing.assert_array_equal(q[[0, 2]], stance.q[[0, 2]])
    assert q[1] != stance.q[1]
    assert np.array_equal(q[7:][mask[6:] == 0], stance.q[7:][mask[6:] == 0])


@pytest.mark.parametrize("name", [*ROBOTS, *HANDS])
def test_the_stance_is_its_own_posture(case, name):
    stance = case(name)
    chart = PostureChart(stance, COM)
    batch = chart.solve(chart.values[None])
    np.testing.assert_allclose(batch.configurations[0], stance.q, rtol=0, atol=1e-11)


@pytest.mark.parametrize("name", HANDS)
def test_shared_torsos_and_longer_limbs_are_solved(case, name):
    stance = case(name)
    chart = PostureChart(stance, COM)
    assert not chart.fallback_reason
    values = near(chart, 20, size=0.005)
    batch = chart.solve(values)
    assert batch.converged.sum() >= 10
    for i in np.flatnonzero(batch.converged):
        here = stance.at(batch.configurations[i])
        assert worst_contact(stance, here.q) < MET
        assert np.abs(here.com - values[i, :3]).max() < MET


@pytest.mark.parametrize("name", ["icub", "talos on slopes", "anymal_c"])
def test_a_retracted_posture_is_the_charts(case, name):
    # Base pose and the joints off the legs decide the rest, however the posture was found.
    stance = case(name)
    free = [n for n in stance.robot.joint_names if not supporting_joints(stance)[index(stance, n)]]
    chart = PostureChart(stance, (*POSE, *free))
    for q in postures(stance, 5, size=0.1):
        values = [reached(stance, q, c) for c in chart.names]
        batch = chart.solve([values])
        excess = stance.at(q).joint_limit_excess.max()
        if excess > 1e-6:
            assert "over its limit" in batch.reasons[0]
            continue
        assert same_posture(stance, batch.configurations[0], q) < 1e-9


def test_a_solved_posture_is_the_charts(case):
    stance = case("icub")
    free = [n for n in stance.robot.joint_names if not supporting_joints(stance)[index(stance, n)]]
    x, y, _ = stance.com
    found = copsense.solve_posture(stance, com=(x + 0.01, y - 0.02, None)).stance
    chart = PostureChart(stance, (*COM, *free))
    batch = chart.solve([[reached(stance, found.q, name) for name in chart.names]])
    assert same_posture(stance, batch.configurations[0], found.q) < 1e-9


def index(stance, joint):
    return stance.robot.velocity_index(joint)


def same_posture(stance, a, b):
    """Largest difference; the two signs of a quaternion are one posture."""
    return np.abs(pin.difference(stance.robot.model, a, b)).max()


def test_a_joint_of_a_leg_lets_the_base_give_way(case):
    stance = case("icub")
    chart = PostureChart(stance, ["l_knee", "com_y"])
    batch = chart.solve([[-0.5, stance.com[1] + 0.01], [-0.3, stance.com[1]]])
    assert batch.converged.all()
    for q, knee in zip(batch.configurations, (-0.5, -0.3), strict=True):
        assert worst_contact(stance, q) < MET
        assert stance.robot.joint_position(q, "l_knee") == pytest.approx(knee, abs=MET)


@pytest.mark.parametrize("name", ["icub", "solo12 on slopes"])
def test_a_foot_is_moved_on_its_plane(case, name):
    stance = case(name)
    foot = stance.contact_names[0]
    names = [f"{foot}:x", f"{foot}:y"] + ([f"{foot}:yaw"] if name == "icub" else [])
    chart = PostureChart(stance, [*names, "base_z"])
    home = stance.placements[0]
    turned = 0.1 if name == "icub" else 0.0
    values = (
        chart.values + np.array([0.02, 0.015, turned, -0.01])[[0, 1, 2, 3] if turned else [0, 1, 3]]
    )
    batch = chart.solve(values[None])
    assert batch.converged[0]
    here = stance.at(batch.configurations[0])  # on the stated planes, or it would be rejected
    placed = here.placements[0]
    np.testing.assert_allclose(placed.translation[:2], values[:2], rtol=0, atol=MET)
    normal = (
        np.array(stance.contacts[0].plane.normal)
        if stance.contacts[0].plane
        else home.rotation[:, 2]
    )
    assert abs(normal @ (placed.translation - home.translation)) < MET
    turn = pin.log3(home.rotation.T @ placed.rotation)
    np.testing.assert_allclose(turn, [0, 0, turned], rtol=0, atol=MET)
    for before, after in zip(stance.placements[1:], here.placements[1:], strict=True):
        np.testing.assert_allclose(after.homogeneous, before.homogeneous, rtol=0, atol=MET)
    # The kernel reads where the feet are from the configuration.
    criterion = copsense.minimum_torque()
    found = evaluate_batch(stance, batch.configurations, [criterion])
    reference = copsense.cop_sensitivity(here, criterion)
    np.testing.assert_allclose(found.gradient[0, 0], reference.gradient, rtol=0, atol=1e-9)


def test_headings_are_absolute(case):
    source = case("icub")
    turn = pin.SE3(pin.rpy.rpyToMatrix(0.0, 0.0, 0.4), np.array([0.3, -0.2, 0.1]))
    q = source.q.copy()
    q[:7] = pin.SE3ToXYZQUAT(turn * pin.XYZQUATToSE3(np.array(q[:7])))
    stance = source.at(q)
    chart = PostureChart(stance, ["l_sole:yaw", "l_sole:x", "com_y"])
    x_axis, place = stance.placements[0].rotation[:, 0], stance.placements[0].translation
    heading = np.arctan2(x_axis[1], x_axis[0])
    assert abs(heading) > 0.3
    np.testing.assert_allclose(chart.values, [heading, place[0], stance.com[1]], rtol=0, atol=1e-12)
    wanted = np.add(chart.values, (0.05, 0.004, 0.003))
    batch = chart.solve(wanted[None])
    foot = stance.at(batch.configurations[0]).placements[0]
    x_axis = foot.rotation[:, 0]
    assert np.arctan2(x_axis[1], x_axis[0]) == pytest.approx(wanted[0], abs=MET)
    assert foot.translation[0] == pytest.approx(wanted[1], abs=MET)


def test_a_chart_can_be_pickled_after_use(case):
    from copsense.batch.postures.newton import solve_postures

    chart = PostureChart(case("icub"), ["base_y"])
    expected = chart.solve([chart.values]).configurations
    again, known = pickle.loads(pickle.dumps(chart)), len(solve_postures.signatures)
    assert np.array_equal(again.solve([chart.values]).configurations, expected)
    assert len(solve_postures.signatures) == known  # nothing is compiled once more


def test_what_cannot_be_is_a_row_with_its_reason(case):
    stance = case("icub")
    chart = PostureChart(stance, ["base_z", "l_elbow"])
    z, elbow = chart.values
    limit = stance.robot.model.upperPositionLimit[
        stance.robot.model.joints[stance.robot.joint_id("l_elbow")].idx_q
    ]
    rows = [[z, elbow], [z + 0.5, elbow], [z, 9.0], [z - 0.01, elbow], [1e9, 1e9]]
    # A micrometre or microradian beyond its limit is at it.
    rows += [[z, limit + 5e-7], [z, limit + 5e-6]]
    batch = chart.solve(rows)
    assert list(batch.converged) == [True, False, False, True, False, True, False]
    assert repr(batch) == "PostureBatch(3 postures of 7 rows)"
    assert [bool(r) for r in batch.reasons] == [False, True, True, False, True, False, True]
    assert "unreachable" in batch.reasons[1]
    assert "_sole along z" in batch.reasons[1]
    assert batch.reasons[2] == f"joint l_elbow over its limit by {9.0 - limit:.3g} rad"
    assert np.isnan(batch.configurations[[1, 2, 4]]).all()
    assert np.isfinite(batch.configurations[[0, 3]]).all()
    assert batch.residuals[1] > 0.1


def test_a_leg_beyond_its_limit_is_named(case):
    stance = case("icub")
    chart = PostureChart(stance, ["base_z"])
    height = chart.values + np.linspace(0.0, -0.2, 9)[:, None]
    batch = chart.solve(height)
    assert batch.converged[0]
    assert not batch.converged[-1]
    assert "ankle_pitch over its limit by" in batch.reasons[-1]
    # The excess is the one that the posture without limits has.
    wide = copsense.Robot.from_model(stance.robot.model, name="wide")
    wide.model.lowerPositionLimit[:] = -10.0
    wide.model.upperPositionLimit[:] = 10.0
    free = PostureChart(copsense.Stance(wide, stance.q, stance.contacts), ["base_z"]).solve(height)
    excess = stance.at(free.configurations[-1]).joint_limit_excess.max()
    assert float(batch.reasons[-1].split()[-2]) == pytest.approx(excess, rel=5e-3)


@pytest.fixture(scope="module")
def many(case):
    """A chart, two thousand rows of which some fail, and their postures."""
    chart = PostureChart(case("icub"), COM)
    values = near(chart, 2003, size=0.03)
    return chart, values, chart.solve(values)


def test_threads_and_neighbours_change_no_bit(many):
    chart, values, whole = many
    assert 200 < whole.converged.sum() < 1800
    order = np.random.default_rng(1).permutation(len(values))
    others = (
        (slice(None), chart.solve(values, threads=3)),
        (slice(5, None), chart.solve(values[5:])),
        (order, chart.solve(values[order])),
    )
    for rows, other in others:
        for name in ("configurations", "residuals", "iterations", "converged"):
            a, b = getattr(whole, name)[rows], getattr(other, name)
            assert np.array_equal(a, b, equal_nan=name in ("configurations", "residuals"))
        assert list(whole.reasons[rows]) == list(other.reasons)


def test_results_are_written_into_out(many):
    chart, values, whole = many
    out = chart.empty(40)
    found = chart.solve(values[:40], out=out)
    assert found is out
    chart.solve(values[40:80], out=out)
    assert np.array_equal(out.configurations, whole.configurations[40:80], equal_nan=True)
    assert list(out.reasons) == list(whole.reasons[40:80])
    with pytest.raises(copsense.CopsenseError, match="shape"):
        chart.solve(values[:3], out=out)
    assert len(chart.solve(np.zeros((0, 6)))) == 0


@pytest.mark.parametrize("name", ["icub", "anymal_c", "icub, both hands"])
def test_without_numba_the_clear_path_answers_the_same(case, name, monkeypatch):
    stance, names = case(name), (*COM, *FREE.get(name, ()))
    fast = PostureChart(stance, names)
    values = near(fast, 12, size=0.02)
    values[3, 2] += 1.0
    expected = fast.solve(values)
    find = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == "numba" else find(name)
    )
    reference = PostureChart(stance, names)
    assert "copsense[fast]" in reference.fallback_reason
    found = reference.solve(values)
    assert np.array_equal(found.converged, expected.converged)
    assert expected.converged.any()
    assert not expected.converged[3]
    np.testing.assert_allclose(found.configurations, expected.configurations, rtol=0, atol=1e-9)
    assert [r[:20] for r in found.reasons] == [r[:20] for r in expected.reasons]


def test_planar_robots_take_the_reference(stance_of):
    stance = stance_of("four_bar")
    chart = PostureChart(stance, ["com_y"])
    assert chart.fallback_reason
    batch = chart.solve([[stance.com[1] + 0.02], [stance.com[1] + 5.0]])
    assert list(batch.converged) == [True, False]
    here = stance.at(batch.configurations[0])
    assert np.abs(contact_error(here, stance.placements)).max() < MET
    assert here.com[1] == pytest.approx(stance.com[1] + 0.02, abs=MET)


def test_one_foot_takes_the_reference(case):
    stance = case("icub").with_contacts(case("icub").contacts[:1])
    chart = PostureChart(stance, ["com_y", "r_knee"])
    batch = chart.solve([[stance.com[1] + 0.02, -0.7]])
    assert chart.fallback_reason
    assert worst_contact(stance, batch.configurations[0]) < MET
    assert stance.robot.joint_position(batch.configurations[0], "r_knee") == pytest.approx(-0.7)


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (["com_q"], "com_x"),
        (["com_x", "com_x"], "distinct"),
        ([], "one coordinate at least"),
        ("com_x", "single name"),
        (["com_y", "base_y"], "decides the other"),
        (["l_sole:z"], "l_sole:x"),
    ],
)
def test_bad_coordinates_are_rejected(case, names, message):
    with pytest.raises(copsense.CopsenseError, match=message):
        PostureChart(case("icub"), names)


@pytest.mark.parametrize("values", [[[1.0]], [1.0, 2.0], [[np.nan, 0.0]], "posture"])
def test_bad_values_are_rejected(case, values):
    with pytest.raises(copsense.CopsenseError, match="values"):
        PostureChart(case("icub"), ["com_y", "yaw"]).solve(values)


def test_names_are_those_that_make_sense(case):
    icub, quadruped = coordinate_names(case("icub")), coordinate_names(case("anymal_c"))
    assert {"com_x", "yaw", "torso_yaw", "l_sole:yaw"} <= set(icub)
    assert "LF_FOOT:x" in quadruped
    assert "LF_FOOT:yaw" not in quadruped  # a point has no heading
    wall = coordinate_names(case("icub, hand on a wall"))
    assert not [n for n in wall if n.startswith("hand:")]


def test_an_absurd_row_is_a_row_and_takes_no_other_with_it(case):
    chart = PostureChart(case("icub"), ["com_y", "com_z"])
    values = np.array([[1e160, 0.5], [0.0, 0.5], [1e300, -1e300]])
    batch = chart.solve(values)  # warnings are errors
    assert list(batch.converged) == [False, True, False]
    assert np.isnan(batch.configurations[[0, 2]]).all()
    assert all(reason.startswith("unreachable") for reason in batch.reasons[[0, 2]])


def sliding(leg):
    """A walker with a mass that slides sideways over its trunk."""
    mass = (
        '<link name="slide"><inertial><mass value="6"/><inertia ixx="0.02" iyy="0.02" izz="0.02" '
        'ixy="0" ixz="0" iyz="0"/></inertial></link><joint name="slider" type="prismatic">'
        '<parent link="trunk"/><child link="slide"/><axis xyz="0 1 0"/><origin xyz="0 0 0.3"/>'
        '<limit lower="-0.3" upper="0.3" effort="80" velocity="5"/></joint></robot>'
    )
    return copsense.load_stance(
        walker(leg).replace("</robot>", mass),
        contacts=BIPED,
        contact_at="sole",
        posture=bent(),
    )


@pytest.mark.parametrize("leg", [NO_ANKLE_ROLL, PITCH_ONLY], ids=["five", "three"])
def test_where_the_legs_cannot_move_the_com_the_other_joints_do(leg):
    stance = sliding(leg)
    chart = PostureChart(stance, ["com_y"])
    values = np.linspace(-0.02, 0.02, 5)[:, None]
    found = chart.solve(values)
    assert found.converged.all(), found.reasons
    slid = [stance.robot.joint_position(q, "slider") for q in found.configurations]
    # The legs hold the trunk: the CoM goes where the sliding mass goes.
    assert slid == pytest.approx(values[:, 0] * stance.robot.mass / 6.0, abs=1e-9)
    # There the legs still hold what they held: no posture is all but singular.
    assert [stance.at(q).rank for q in found.configurations] == [stance.rank] * 5


def test_legs_that_can_move_the_com_leave_the_other_joints_alone():
    stance = sliding(FULL)
    chart = PostureChart(stance, ["com_y"])
    found = chart.solve([[0.02]])
    assert stance.robot.joint_position(found.configurations[0], "slider") == pytest.approx(
        0, abs=1e-12
    )


def test_a_stance_beyond_a_joint_limit_is_a_posture_of_its_chart(icub):
    home = icub.robot.joint_position(icub.q, "l_elbow")
    urdf = icub.robot.model.copy()
    urdf.upperPositionLimit[urdf.joints[urdf.getJointId("l_elbow")].idx_q] = home - 1e-5
    robot = copsense.Robot.from_model(urdf)
    stance = copsense.Stance(robot, icub.q, icub.contacts)
    chart = PostureChart(stance, ["com_y", "l_elbow"])
    at = float(chart.values[0])
    found = chart.solve([[at + 0.01, home], [at + 0.01, home + 1e-3]])
    assert found.converged.tolist() == [True, False]
    assert "l_elbow over its limit by 0.001 rad" in found.reasons[1]
