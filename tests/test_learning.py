"""CoPs as a function of the posture: values, gradients, and what is said of the rest."""

import pickle

import numpy as np
import pytest

import copsense
from copsense.batch import BatchKernel, PostureChart
from copsense.batch.postures.chart_gradient import ChartGradient
from copsense.batch.postures.nearest_postures import NearestPostures
from copsense.errors import InvalidInputError, UnknownNameError, UnreachablePostureError
from copsense.learning import CopMap
from copsense.learning.travel_slope import travel_slope

TORQUE, WRENCH = copsense.minimum_torque(), copsense.minimum_wrench(1.0)
COM = ("com_x", "com_y", "com_z", "roll", "yaw", "torso_pitch", "l_elbow")
BASE = ("base_x", "base_y", "base_z", "roll", "pitch", "yaw")
LOWER = 0.02  # m: where straight legs can follow


def near(cops, count, *, size=0.01, seed=0):
    """Inputs around the stance's own, a little lower."""
    draw = np.random.default_rng(seed).uniform(-1, 1, (count, len(cops.inputs)))
    x = cops.start + size * draw
    x[:, cops.inputs.index(next(n for n in cops.inputs if n.endswith("_z")))] -= LOWER
    return x


def differences(of, x, step=1e-4):
    """d of / d x by differences of fourth order (N, ..., k); of: (N, k) -> (N, ...)."""
    columns = []
    for j in range(x.shape[1]):
        way = np.zeros(x.shape[1])
        way[j] = step
        a, b, c, d = (of(x + n * way) for n in (-2, -1, 1, 2))
        columns.append((a - 8 * b + 8 * c - d) / (12 * step))
    return np.stack(columns, axis=-1)


@pytest.mark.parametrize("names", [COM, BASE], ids=["com", "base"])
@pytest.mark.parametrize("criterion", [TORQUE, WRENCH], ids=["torque", "wrench"])
def test_gradients_are_those_of_the_values(icub, names, criterion):
    cops = CopMap(icub, criterion, names)
    x = near(cops, 4)
    found = cops.evaluate(x, everything=True)
    assert found.valid.all()
    slopes = differences(lambda at: cops.evaluate(at).cop, x)
    assert np.abs(slopes).max() > 0.3
    np.testing.assert_allclose(found.gradient, slopes, rtol=0, atol=1e-7 * np.abs(slopes).max())
    slopes = differences(lambda at: cops.evaluate(at).margin, x)
    margins = np.einsum("nki,nkij->nkj", found.inward, found.gradient)
    np.testing.assert_allclose(margins, slopes, rtol=0, atol=1e-7 * np.abs(slopes).max())


def test_values_are_those_of_one_posture(icub):
    cops = CopMap(icub, TORQUE, COM[:3])
    x = near(cops, 3)
    found = cops.evaluate(x, everything=True)
    for row, q in enumerate(PostureChart(icub, COM[:3]).solve(x).configurations):
        here = icub.at(q)
        alone = copsense.cop_sensitivity(here, TORQUE)
        np.testing.assert_allclose(found.cop[row], alone.cop, rtol=0, atol=1e-12)
        np.testing.assert_allclose(found.travel[row], alone.com_travel, rtol=0, atol=1e-11)
        margins = [c.sole.margins(p) for c, p in zip(here.contacts, alone.cop, strict=True)]
        np.testing.assert_allclose(found.margin[row], margins, rtol=0, atol=1e-12)


@pytest.mark.parametrize("robot", ["icub", "talos", "solo12"])
def test_the_kernel_and_the_reference_pull_alike(stance_of, robot):
    stance = stance_of(robot)
    rng = np.random.default_rng(1)
    for chart in (PostureChart(stance, BASE), NearestPostures(stance)):
        gradient = ChartGradient(chart)
        assert not chart.fallback_reason
        values = chart.values + 0.01 * rng.uniform(-1, 1, (9, len(chart.names)))
        values[:, 2] -= LOWER
        q = chart.solve(values).configurations
        assert np.isfinite(q).all()
        g = rng.standard_normal((9, 3, stance.robot.model.nv))
        slow = ChartGradient(type(chart)(stance, compiled=False, **_named(chart))).pull(q, g)
        np.testing.assert_allclose(gradient.pull(q, g), slow, rtol=0, atol=1e-9)
        again = pickle.loads(pickle.dumps(gradient))
        assert np.array_equal(again.pull(q, g), gradient.pull(q, g))


def _named(chart):
    return {} if isinstance(chart, NearestPostures) else {"coordinates": chart.names}


def test_the_gradient_of_a_configuration_is_exact_on_its_contacts(icub):
    cops = CopMap(icub, TORQUE, within=0.1)
    chart = PostureChart(icub, COM)
    q = chart.solve(near(CopMap(icub, TORQUE, COM), 1)).configurations

    def error(at):
        slopes = differences(lambda x: cops.evaluate(x).cop, at, 1e-5)
        return np.abs(cops.evaluate(at).gradient - slopes).max() / np.abs(slopes).max()

    assert error(q) < 1e-8
    off = q + 1e-3 * np.random.default_rng(2).uniform(-1, 1, q.shape)
    off[:, 3:7] /= np.linalg.norm(off[:, 3:7])
    assert 1e-5 < error(off) < 2e-2  # off by about as much as the feet are
    # Any length of quaternion means the same turn, which has no gradient along it.
    assert np.abs(cops.evaluate(q).gradient[..., 3:7] @ q[0, 3:7]).max() < 1e-12


def test_a_configuration_off_its_contacts_is_not_valid(icub):
    cops = CopMap(icub, TORQUE, invalid="mask")
    q = np.tile(icub.q, (4, 1))
    q[1, 10] += 0.1  # a joint of a leg
    q[2, 3:7] *= 1.1
    q[3, 0] = np.nan
    found = cops.evaluate(q, everything=True)
    assert found.valid.tolist() == [True, False, False, False]
    assert "from the nearest posture with the contacts in place" in found.reasons[1]
    assert "quaternion is not of unit length" in found.reasons[2]
    assert "not a finite number" in found.reasons[3]


def test_the_travel_slopes_as_its_values_do(icub):
    cops = CopMap(icub, TORQUE, COM[:4])
    x = near(cops, 3)
    share = np.array([[1.0, 0.0], [0.0, 2.0], [0.0, 0.0]])
    slopes = differences(lambda at: cops.evaluate(at, everything=True).travel, x, 3e-5)
    wanted = np.einsum("nk,nkj->nj", share, slopes)
    found = cops.travel_gradient(x, share)
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-6 * np.abs(wanted).max())
    assert not found[2].any()


def test_a_slope_beside_another_edge_is_of_its_own_side():
    near_edges = np.array([[[9.0], [9.0], [2.0], [4.0]]])  # the other edge before
    edges = np.array([[[1], [1], [0], [0]]])
    there = np.ones((1, 4), dtype=bool)
    edge, here = np.array([[0]]), np.zeros((1, 1))
    assert travel_slope(here, edge, near_edges, edges, there, 1.0) == 2.0
    both = travel_slope(here, edge, np.array([[[-4.0], [-2.0], [2.0], [4.0]]]), 0 * edges, there, 1)
    assert both == 2.0
    assert np.isnan(travel_slope(here, edge, near_edges, edges, ~there, 1.0))
    assert travel_slope(here + np.inf, edge, near_edges, edges, there, 1.0) == 0.0


def test_threads_and_neighbours_change_nothing(icub):
    one, two = (CopMap(icub, TORQUE, COM[:3], invalid="mask", threads=n) for n in (1, 2))
    x = near(one, 700)
    x[5, 2] = 9.0  # out of reach
    a, b = one.evaluate(x, everything=True), two.evaluate(x, everything=True)
    alone = one.evaluate(x[40:41], everything=True)
    for name in ("cop", "margin", "travel", "valid", "gradient", "inward"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
        np.testing.assert_array_equal(getattr(a, name)[40], getattr(alone, name)[0])
    assert list(a.reasons) == [5]
    assert "unreachable" in a.reasons[5]
    assert np.isnan(a.cop[5]).all()
    assert np.isnan(a.margin[5]).all()
    assert np.isnan(a.travel[5]).all()
    assert not a.gradient[5].any()
    assert not a.inward[5].any()
    assert np.isfinite(np.delete(a.cop, 5, axis=0)).all()


def test_within_limits_the_gradient_is_that_of_what_they_leave(icub):
    limits = copsense.Limits(friction=0.33, torque="model", normal_force=10.0)
    cops = CopMap(icub, WRENCH, COM[:3], limits)
    x = cops.start + np.array([[0.0, 0.045, -LOWER]])
    kernel = BatchKernel(icub, [WRENCH], limits)
    result = kernel.evaluate(PostureChart(icub, COM[:3]).solve(x).configurations)
    assert (result.limits.state == 1).all()
    slopes = differences(lambda at: cops.evaluate(at).cop, x, 1e-5)
    found = cops.evaluate(x).gradient
    np.testing.assert_allclose(found, slopes, rtol=0, atol=1e-6 * np.abs(slopes).max())
    free = CopMap(icub, WRENCH, COM[:3]).evaluate(x).gradient
    assert np.abs(free - found).max() > 1e-2


def test_an_error_says_which_posture_and_why(icub):
    cops = CopMap(icub, TORQUE, COM[:3])
    x = near(cops, 3)
    x[1, 2] = 9.0
    with pytest.raises(UnreachablePostureError, match=r"1 of 3 .* row 1: .*unreachable.*mask"):
        cops.evaluate(x)


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ({"coordinates": ["l_knee", "com_x"]}, InvalidInputError, "leave 4 of the robot's motions"),
        ({"coordinates": ["l_sole:x", "com_x"]}, InvalidInputError, "moves a contact"),
        ({"coordinates": ["com_w"]}, UnknownNameError, "com_w"),
        ({"coordinates": []}, InvalidInputError, "needs one coordinate at least"),
        ({"invalid": "ignore"}, UnknownNameError, "raise, mask"),
        ({"within": 0.0}, InvalidInputError, "within"),
        ({"threads": 0}, InvalidInputError, "threads"),
    ],
)
def test_what_cannot_be_a_function_is_an_error(icub, arguments, error, words):
    with pytest.raises(error, match=words):
        CopMap(icub, TORQUE, **arguments)


def test_a_robot_with_loops_is_an_error_that_says_so(stance_of):
    with pytest.raises(InvalidInputError, match="has loops, couplings or hanging joints"):
        CopMap(stance_of("cassie"), TORQUE, ["com_y"])


def test_without_a_kernel_the_reference_serves(stance_of):
    stance = stance_of("four_bar")
    cops = CopMap(stance, WRENCH, ["com_y"])
    x = cops.start + np.array([[0.01], [-0.005]])
    found = cops.evaluate(x)
    slopes = differences(lambda at: cops.evaluate(at).cop, x)
    assert np.abs(slopes).max() > 0.1
    np.testing.assert_allclose(found.gradient, slopes, rtol=0, atol=1e-7)
