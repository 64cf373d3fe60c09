"""A recording says what happened before a contact tipped, and keeps it."""

import numpy as np
import pytest
from support.commands import copsense
from support.standing import C2, icub, simulator

from copsense.controllers import BalancingController
from copsense.errors import InvalidInputError
from copsense.plots import render_figure
from copsense.simulation import Push, Recording, Scenario, rollout


@pytest.fixture(scope="module")
def fallen():
    """A run that goes on after a contact tipped, with a row at every control period."""
    push = Push((0.0, 400.0, 0.0), start=0.15, duration=0.1)
    controller = BalancingController(icub(), C2)
    return rollout(
        simulator(), controller, Scenario(1.0, pushes=(push,)), until="fall", record_period=1e-3
    )


@pytest.fixture(scope="module")
def stood():
    return rollout(simulator(), BalancingController(icub(), C2), Scenario(0.2))


def test_a_run_that_tipped_is_judged_by_what_came_before(fallen):
    tip, time = fallen.tip, fallen["time"].values
    assert tip is not None
    assert tip.contact in fallen.labels("contact")
    before = fallen.before_first_tip
    assert np.array_equal(before["time"].values, time[time < tip.time])
    # There is a row at the very time of the tip, whose wrenches are those after it.
    assert np.any(time == tip.time)
    error = (before["com"] - before["com_target"]).sel(com_axis="y").values
    assert fallen.tracking_error == before.tracking_error == np.sqrt(np.mean(error**2))
    assert fallen.tracking_peak == np.abs(error).max()
    assert fallen.smallest_margin == before.smallest_margin
    assert fallen.tip_travel == pytest.approx(
        float(fallen["tip_com"][1]) - float(fallen["com"][0, 1])
    )
    assert np.abs(error).max() < np.abs((fallen["com"] - fallen["com_target"])[:, 1]).max()


def test_a_run_that_stood_is_all_before_a_tip(stood):
    assert stood.completed
    assert stood.tip is None
    assert stood.before_first_tip == stood
    assert np.isnan(stood.tip_travel)
    assert stood.settled["time"].values[0] == pytest.approx(0.1, abs=5e-3)
    assert stood.between(0.0, 0.051).settled.sizes["time"] == 10


def test_a_recording_keeps_what_made_it(stood, tmp_path):
    file = stood.save(tmp_path / "run.nc")
    again = Recording.load(file)
    assert again == stood
    assert "is a recording, and plot draws a sweep" in copsense("plot", file).error
    assert '"minimum-torque"' in stood.attrs["criteria"]
    assert stood.attrs["limits"] == "null"
    stood.to_xarray().drop_vars("com").to_netcdf(tmp_path / "other.nc")
    with pytest.raises(InvalidInputError, match=r"not a recording of copsense.*balance"):
        Recording.load(tmp_path / "other.nc")


def test_a_recording_is_a_table_and_a_picture(stood, fallen, tmp_path):
    table = stood.to_pandas()
    assert len(table) == stood.sizes["time"] * 2
    row = table[table["contact"] == "r_sole"].iloc[-1]
    assert row["cop_y"] == float(stood["cop"][-1, 1, 1])
    assert stood.save(tmp_path / "run.csv").stat().st_size > 1000
    for run in (stood, fallen):
        assert len(render_figure(run.plot(), ".png", dpi=30)) > 1000
        assert len(repr(run).splitlines()) < 15
        assert "CoM y error" in run._repr_html_()
    assert f"first {fallen.tip.kind} at" in repr(fallen)


@pytest.mark.parametrize("bounds", [(5.0, 6.0), (0.1, 0.05), (np.nan, 1.0), (-2.0, -1.0)])
def test_a_part_without_a_row_is_rejected_with_the_times_there_are(stood, bounds):
    with pytest.raises(InvalidInputError, match=r"no row from .* it goes from 0"):
        stood.between(*bounds)
