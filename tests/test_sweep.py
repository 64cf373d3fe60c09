"""A sweep is one dataset: labelled, with units, equal to what each posture gives on its own."""

from itertools import product

import numpy as np
import pytest
from support.grounds import with_hand

import copsense

WRENCH, TORQUE = copsense.minimum_wrench(1.0), copsense.minimum_torque()

# variable -> its dimensions; the units are those of SI
DIMENSIONS = {
    "cop": ("posture", "criterion", "contact", "axis"),
    "wrench": ("posture", "criterion", "contact", "component"),
    "torque": ("posture", "criterion", "joint"),
    "cop_sensitivity": ("posture", "criterion", "contact", "axis", "velocity"),
    "cop_slope": ("posture", "criterion", "contact", "axis"),
    "cop_gain": ("posture", "criterion", "contact", "axis", "com_direction"),
    "worst_case_gain": ("posture", "criterion", "contact"),
    "com_travel": ("posture", "criterion", "contact"),
    "unloading_travel": ("posture", "criterion", "contact"),
    "margin": ("posture", "criterion", "contact"),
    "margin_side": ("posture", "criterion", "contact"),
    "pulling": ("posture", "criterion", "contact"),
    "residual": ("posture", "criterion"),
    "reason": ("posture", "criterion"),
    "com": ("posture", "com_axis"),
    "configuration": ("posture", "configuration_index"),
    "tangent": ("posture", "velocity"),
    "joint_limit_excess": ("posture", "joint"),
    "contact_position": ("contact", "com_axis"),
    "contact_rotation": ("contact", "com_axis", "contact_axis"),
    "sole_polygon": ("contact", "vertex", "axis"),
    "friction": ("contact",),
    "torsional_friction": ("contact",),
    "torque_limit": ("joint",),
}
UNITS = {
    "cop": "m",
    "wrench": "N, N m",
    "torque": "N m",
    "cop_gain": "1",
    "worst_case_gain": "1",
    "com_travel": "m",
    "unloading_travel": "m",
    "margin": "m",
    "residual": "N, N m",
    "com": "m",
    "contact_position": "m",
    "sole_polygon": "m",
    "com_y": "m",
}


@pytest.fixture(scope="module")
def path(icub):
    return copsense.lateral_sweep(icub, -0.06, 0.06, 5)


@pytest.fixture(scope="module")
def swept(path):
    return copsense.sweep(path, [WRENCH, TORQUE])


def test_dimensions_and_units_are_as_documented(swept):
    assert {n: v.dims for n, v in swept.to_xarray().data_vars.items()} == DIMENSIONS
    assert {name: swept[name].attrs["units"] for name in UNITS} == UNITS
    for name, variable in swept.to_xarray().data_vars.items():
        assert variable.attrs["long_name"], name


def test_labels_are_the_robots(swept, icub):
    assert list(swept["criterion"].values) == ["minimum-wrench", "minimum-torque"]
    assert list(swept["contact"].values) == ["l_sole", "r_sole"]
    assert list(swept["component"].values) == ["fx", "fy", "fz", "mx", "my", "mz"]
    assert tuple(swept["joint"].values) == icub.robot.torque_names
    assert tuple(swept["velocity"].values) == icub.robot.velocity_names
    assert swept["com_y"].dims == ("posture",)
    assert swept.attrs["robot"] == "icub"
    assert swept.attrs["coordinate"] == "com_y"
    assert swept.attrs["source"] == f"copsense {copsense.__version__}"
    assert swept.attrs["mass"] == icub.robot.mass
    assert swept.attrs["weight"] == icub.robot.weight
    assert swept.attrs["contact_frames"] == "l_sole, r_sole"


def test_every_row_is_the_postures_own_result(swept, path):
    for i, (stance, tangent) in enumerate(zip(path.stances, path.tangents, strict=True)):
        for criterion in (WRENCH, TORQUE):
            row = swept.sel(posture=i, criterion=criterion.name)
            found = copsense.cop_sensitivity(stance, criterion)
            expected = {
                "cop": found.cop,
                "wrench": found.equilibrium.wrenches,
                "torque": found.equilibrium.torques,
                "cop_sensitivity": found.gradient,
                "cop_slope": found.along(tangent),
                "cop_gain": found.com_gain,
                "worst_case_gain": found.worst_case_gain,
                "com_travel": found.com_travel,
                "unloading_travel": found.unloading_travel,
                "residual": found.equilibrium.residual(),
            }
            for name, value in expected.items():
                np.testing.assert_array_equal(row[name].values, value, err_msg=name)
            for k, contact in enumerate(stance.contacts):
                margin = copsense.polygon.Polygon(contact.polygon).margin(found.cop[k])
                assert row["margin"].values[k] == margin.distance
                assert row["margin_side"].values[k] == margin.side
    np.testing.assert_array_equal(swept["com_y"].values, path.values)
    np.testing.assert_array_equal(swept["com"].values, [s.com for s in path.stances])
    np.testing.assert_array_equal(swept["configuration"].values, [s.q for s in path.stances])


def test_slope_along_the_path_is_the_difference_of_its_rows(icub):
    # The dataset's own columns: d cop / d com_y.
    fine = copsense.sweep(copsense.lateral_sweep(icub, 0.028, 0.032, 5), [WRENCH, TORQUE])
    cop, y = fine["cop"].values, fine["com_y"].values
    numeric = (8 * (cop[3] - cop[1]) - (cop[4] - cop[0])) / (12 * (y[1] - y[0]))
    np.testing.assert_allclose(fine["cop_slope"].values[2], numeric, rtol=0, atol=1e-7)


def test_a_posture_that_failed_is_a_row_with_its_reason(icub):
    path = copsense.lateral_sweep(icub, 0.0, 0.6, 3)
    swept = copsense.sweep(path, [WRENCH, TORQUE])
    failed = swept.failed_rows
    assert [(i, name) for i, name, _ in failed] == [(2, "minimum-wrench"), (2, "minimum-torque")]
    assert all("CoM y = 0.6 m" in reason for _, _, reason in failed)
    assert np.isnan(swept["cop"].values[2]).all()
    assert np.isnan(swept["com"].values[2]).all()
    assert not swept["pulling"].values[2].any()
    assert np.isfinite(swept["cop"].values[:2]).all()
    assert (swept["reason"].values[:2] == "").all()


def test_a_criterion_that_failed_leaves_the_others_rows(path, icub):
    open_ended = copsense.Criterion("vertical", (copsense.WrenchTerm([0, 0, 1, 0, 0, 0]),))
    swept = copsense.sweep(path, [WRENCH, open_ended])
    reasons = dict.fromkeys(name for _, name, _ in swept.failed_rows)
    assert list(reasons) == ["vertical"]
    assert len(swept.failed_rows) == 5
    assert "tie_break" in str(swept["reason"].sel(criterion="vertical").values[0])
    assert np.isfinite(swept["cop"].sel(criterion="minimum-wrench").values).all()


def test_a_contact_that_would_have_to_pull_is_named(icub):
    # The reference pulls at the right foot; a criterion without limits gives it what it asks for.
    wanted = np.zeros((2, 6))
    wanted[:, 2] = np.array([1.2, -0.2]) * icub.robot.weight
    pulled = copsense.criterion.reference_wrench(wanted, 1e-3)
    path = copsense.lateral_sweep(icub, 0, 0.12, 2)
    swept = copsense.sweep(path, [TORQUE, pulled])
    for i, stance in enumerate(path.stances):
        for criterion in (TORQUE, pulled):
            found = copsense.solve_equilibrium(stance, criterion)
            row = swept["pulling"].sel(posture=i, criterion=criterion.name)
            named = [str(c) for c in row["contact"].values[row.values]]
            below = [
                n for n, w in zip(("l_sole", "r_sole"), found.wrenches, strict=True) if w[2] < 0
            ]
            assert named == below == list(found.pulling)
    assert swept["pulling"].values.any()
    assert not swept["pulling"].sel(posture=0, criterion="minimum-torque").any()


def test_a_policy_is_named_by_its_function_and_progress_is_told(stance_of):
    path = copsense.lateral_sweep(stance_of("four_bar"), -0.05, 0.05, 3)

    def my_controller(q):
        here = path.stances[0].at(q)
        return np.linalg.pinv(here.jacobian[:, :3].T) @ here.gravity[:3]

    steps = []
    swept = copsense.sweep(path, [WRENCH, my_controller], progress=steps.append)
    assert steps == [1] * 3
    assert list(swept["criterion"].values) == ["minimum-wrench", "my_controller"]
    a, b = (swept["cop_slope"].sel(criterion=c).values for c in swept["criterion"].values)
    np.testing.assert_allclose(a, b, rtol=0, atol=1e-9)
    assert np.abs(a).max() > 0.9


def test_contacts_without_a_sole_have_no_edge(icub):
    stance = with_hand(icub, "l_hand", (0, 0, 1))
    swept = copsense.sweep(copsense.path_through(stance, [stance.q]), [TORQUE])
    assert swept["margin"].sel(contact="hand").values == np.inf
    assert swept["margin_side"].sel(contact="hand").values == ""
    assert swept["sole_polygon"].sel(contact="hand").isnull().all()
    assert swept["sole_polygon"].sel(contact="l_sole").notnull().all()
    assert swept.attrs["contact_kinds"] == "surface, surface, point"


def test_a_policy_and_limits_are_rejected_before_anything_is_solved(icub):
    path = copsense.lateral_sweep(icub, -0.01, 0.01, 3)

    def policy(q):
        return copsense.solve_equilibrium(icub.at(q), TORQUE).wrenches

    seen = []
    with pytest.raises(copsense.CopsenseError, match="is a policy"):
        copsense.sweep(path, [policy], copsense.Limits(), progress=seen.append)
    assert not seen
    with pytest.raises(copsense.CopsenseError, match="limits apply to a Criterion"):
        copsense.cop_sensitivity(icub, policy, copsense.Limits())


def test_a_sweep_gives_back_limits_that_are_infinite(stance_of):
    path = copsense.lateral_sweep(stance_of("four_bar"), 0.0, 0.01, 2)
    for torque in (np.inf, {"l_hip": np.inf, "r_hip": 3.0}):
        limits = copsense.Limits(friction=None, torque=torque)
        found = copsense.sweep(path, [TORQUE], limits)
        assert found.limits == limits
        assert repr(found)


def test_a_sweep_within_limits_has_the_nearest_change_of_each_row(icub):
    path = copsense.lateral_sweep(icub, -0.05, 0.05, 4)
    limits = copsense.Limits(friction=0.33, cop_margin=0.004)
    level = copsense.minimum_tangential(copsense.minimum_wrench(1.0))
    criteria = [TORQUE, level]
    found = copsense.sweep(path, criteria, limits)
    told, names = found["change_travel"].values, found["change_limit"].values
    for (i, here), (j, criterion) in product(enumerate(path.stances), enumerate(criteria)):
        there = copsense.cop_sensitivity(here, criterion, limits)
        if there.equilibrium._problem.tied.any():
            assert np.isnan(told[i, j])
            assert names[i, j] == ""
            continue
        change = there.nearest_active_set_change()
        assert told[i, j] == pytest.approx(change.travel, rel=1e-9)
        assert names[i, j] == change.name
    assert np.isnan(told).sum() in (1, 2)
    table = found.to_pandas()
    assert {"active_limits", "change_travel", "change_limit"} <= set(table.columns)
    assert "change_travel" not in copsense.sweep(path, [TORQUE])
