"""Margins of a recorded sweep are those of the stances it came from, without them."""

from dataclasses import replace

import numpy as np
import pytest

import copsense
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.margins import limit_margins
from copsense.plots import plot_limit_margins, render_figure
from copsense.plots.limit_plots import first_limits

CRITERIA = [copsense.minimum_wrench(1.0), copsense.minimum_torque()]
LIMITS = copsense.Limits(normal_force=10.0, friction=1 / 3, torsion=1 / 75, torque="model")


def recorded(stance, tmp_path, ends=(-0.05, 0.05), limits=None):
    path = copsense.lateral_sweep(stance, *ends, 5)
    dataset = copsense.sweep(path, CRITERIA, limits)
    file = dataset.save(tmp_path / "sweep.nc")
    return path, copsense.Sweep.load(file)


@pytest.mark.parametrize("robot", ["icub", "talos", "solo12", "four_bar"])
def test_margins_from_the_file_are_those_of_the_equilibria(stance_of, robot, tmp_path):
    path, dataset = recorded(stance_of(robot), tmp_path)
    limits = copsense.Limits(friction=0.4, torque="model")
    found = dataset.with_limit_margins(limits)
    for i, here in enumerate(path.stances):
        for j, criterion in enumerate(CRITERIA):
            margins = limit_margins(copsense.solve_equilibrium(here, criterion), limits)
            assert [f"{m.where}: {m.kind}" for m in margins] == found["limit"].values.tolist()
            assert [m.unit for m in margins] == found["limit_unit"].values.tolist()
            np.testing.assert_allclose(
                found["limit_margin"].values[i, j], [m.value for m in margins], atol=1e-9
            )


def test_contacts_keep_their_own_coefficients_and_soles(icub, tmp_path):
    left, right = icub.contacts
    stance = icub.with_contacts(
        [replace(left, friction=0.3, torsional_friction=0.02), replace(right, polygon=None)]
    )
    _, dataset = recorded(stance, tmp_path, (-0.01, 0.01))
    found = dataset.with_limit_margins(copsense.Limits(normal_force=0.0))
    assert found["limit"].values.tolist() == [
        "l_sole: normal force",
        "l_sole: friction",
        "l_sole: cop",
        "l_sole: torsion",
        "r_sole: normal force",
    ]


def test_a_failed_row_has_no_margin_and_a_pulling_contact_no_distance_to_an_edge(icub, tmp_path):
    _, dataset = recorded(icub, tmp_path, (0.0, 0.9))
    assert dataset.failed_rows
    found = dataset.with_limit_margins(LIMITS)
    failed = dataset["reason"].values != ""
    np.testing.assert_array_equal(np.isnan(found["limit_margin"].values).all(-1), failed)
    pulling = dataset["pulling"].values & ~failed[..., None]
    assert pulling.any()
    for k, name in enumerate(dataset["contact"].values):
        edge = found["limit_margin"].sel(limit=f"{name}: cop").values
        np.testing.assert_array_equal(np.isnan(edge), failed | pulling[..., k])


def test_other_limits_replace_those_before(icub, tmp_path):
    _, dataset = recorded(icub, tmp_path, limits=LIMITS)
    twice = dataset.with_limit_margins(LIMITS).with_limit_margins(copsense.Limits())
    assert set(twice["limit_kind"].values) == {"normal force", "cop"}


def test_the_first_limit_is_marked_where_the_path_meets_it(icub):
    path = copsense.lateral_sweep(icub, -0.06, 0.06, 61)
    exact = {c.name: copsense.scan.limit_travel(icub, c, LIMITS).first.exact for c in CRITERIA}
    for limits in (None, LIMITS):  # unclipped it is interpolated, clipped extrapolated
        found = copsense.sweep(path, CRITERIA, limits).with_limit_margins(LIMITS)
        for j, criterion in enumerate(CRITERIA):
            low, high = (np.interp(at, np.arange(61), path.values) for at in first_limits(found, j))
            assert high == pytest.approx(exact[criterion.name], abs=1e-4)
            assert low == pytest.approx(-exact[criterion.name], abs=1e-4)
    assert len(render_figure(plot_limit_margins(found), ".png", dpi=30)) > 1000


def test_what_the_file_does_not_tell_is_said(icub, tmp_path):
    _, dataset = recorded(icub, tmp_path)
    with pytest.raises(InvalidInputError, match="an earlier version"):
        copsense.Sweep(dataset.to_xarray().drop_vars("torque_limit")).with_limit_margins(LIMITS)
    with pytest.raises(UnknownNameError, match="l_knee"):
        dataset.with_limit_margins(copsense.Limits(torque={"l_kne": 3.0}))
    by_joint = dataset.with_limit_margins(copsense.Limits(torque={"l_knee": 3.0}))
    assert by_joint["limit"].values[-1] == "l_knee: torque"
