"""Results on disk: whole or not there, the same when read back."""

import csv
import pickle
import stat

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import copsense
from copsense.errors import InvalidInputError
from copsense.files import load_configurations
from copsense.plots import plot_cop

CRITERIA = [copsense.minimum_wrench(1.0), copsense.minimum_torque()]


@pytest.fixture(scope="module")
def swept(icub):
    # With a row that failed, so that NaN and reasons travel too.
    return copsense.sweep(copsense.lateral_sweep(icub, 0.0, 0.9, 4), CRITERIA)


def test_netcdf_gives_everything_back(swept, tmp_path):
    path = swept.save(tmp_path / "sweep.nc")
    again = copsense.Sweep.load(path)
    xr.testing.assert_identical(again.to_xarray(), swept.to_xarray())
    assert again == swept
    assert again.failed_rows == swept.failed_rows
    assert {n: again[n].dtype.kind for n in again} == {n: swept[n].dtype.kind for n in swept}


def test_table_has_a_row_per_posture_criterion_and_contact_with_the_same_numbers(swept, tmp_path):
    path = swept.save(tmp_path / "sweep.csv")
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 4 * 2 * 2
    keys = {(row["posture"], row["criterion"], row["contact"]) for row in rows}
    assert len(keys) == len(rows)
    for row in rows:
        here = swept.sel(
            posture=int(row["posture"]), criterion=row["criterion"], contact=row["contact"]
        )
        assert float(row["com_y"]) == here["com_y"]
        assert row["reason"] == here["reason"].values
        if row["reason"]:
            assert row["cop_y"] == ""
            continue
        for axis in "xy":
            assert float(row[f"cop_{axis}"]) == here["cop"].sel(axis=axis)
            assert float(row[f"cop_gain_{axis}_y"]) == here["cop_gain"].sel(
                axis=axis, com_direction="y"
            )
        assert float(row["wrench_fz"]) == here["wrench"].sel(component="fz")
        assert float(row["torque_l_knee"]) == here["torque"].sel(joint="l_knee")
        assert row["pulling"] == str(bool(here["pulling"]))
        assert row["margin_side"] == here["margin_side"].values


@pytest.mark.parametrize("suffix", [".nc", ".csv"])
def test_a_file_is_overwritten_only_on_request(swept, tmp_path, suffix):
    path = tmp_path / f"sweep{suffix}"
    path.write_text("mine")
    with pytest.raises(copsense.CopsenseError, match="exists already"):
        swept.save(path)
    assert path.read_text() == "mine"
    swept.save(path, overwrite=True)
    assert path.read_bytes() != b"mine"


@pytest.mark.parametrize("suffix", [".nc", ".csv"])
def test_a_write_that_breaks_off_leaves_nothing(swept, tmp_path, suffix, monkeypatch):
    break_off_writing(monkeypatch)
    with pytest.raises(copsense.CopsenseError, match="No space left"):
        swept.save(tmp_path / f"sweep{suffix}")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("suffix", [".nc", ".csv"])
def test_a_write_that_breaks_off_keeps_the_old_file(swept, tmp_path, suffix, monkeypatch):
    path = swept.save(tmp_path / f"sweep{suffix}")
    before = path.read_bytes()
    break_off_writing(monkeypatch)
    with pytest.raises(copsense.CopsenseError, match="No space left"):
        swept.save(path, overwrite=True)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_an_interruption_leaves_nothing(swept, tmp_path, monkeypatch):
    break_off_writing(monkeypatch, KeyboardInterrupt())
    with pytest.raises(KeyboardInterrupt):
        swept.save(tmp_path / "sweep.nc")
    assert list(tmp_path.iterdir()) == []


def break_off_writing(monkeypatch, error=None):
    """Writers put down half a file and then fail, as a full disk would make them."""

    def half(path):
        path.write_text("half a file")
        raise error or OSError(28, "No space left on device")

    monkeypatch.setattr(xr.Dataset, "to_netcdf", lambda self, path, **kw: half(path))
    monkeypatch.setattr(pd.DataFrame, "to_csv", lambda self, path, **kw: half(path))


def test_a_result_can_be_read_by_whoever_may_read_files(swept, tmp_path):
    path = swept.save(tmp_path / "sweep.nc")
    plain = tmp_path / "plain"
    plain.touch()
    assert stat.S_IMODE(path.stat().st_mode) == stat.S_IMODE(plain.stat().st_mode)


def test_configurations_are_read_from_a_table_or_an_array(icub, tmp_path):
    path = copsense.lateral_sweep(icub, -0.02, 0.02, 3)
    rows = np.array([stance.q for stance in path.stances])
    np.save(tmp_path / "q.npy", rows)
    np.savetxt(tmp_path / "q.csv", rows, delimiter=",", fmt="%.17g")
    for name in ("q.npy", "q.csv"):
        read = load_configurations(tmp_path / name)
        np.testing.assert_array_equal(read, rows)
        assert len(copsense.path_through(icub, read)) == 3


# --- what a sweep says of itself ----------------------------------------------------------------


@pytest.fixture(scope="module")
def linkage(stance_of):
    path = copsense.lateral_sweep(stance_of("four_bar"), -0.05, 0.05, 5)
    return copsense.sweep(path, CRITERIA)


def test_a_sweep_records_what_made_its_numbers(stance_of, tmp_path):
    """Two lengths give one name, other slopes, and criteria that tell them apart."""
    path = copsense.lateral_sweep(stance_of("four_bar"), -0.02, 0.02, 3)
    long, short = (copsense.sweep(path, [copsense.minimum_wrench(L)]) for L in (1.0, 0.07))
    assert long.labels("criterion") == short.labels("criterion")
    assert np.abs(long["cop_slope"] - short["cop_slope"]).max() > 0.3
    assert long.attrs["criteria"] != short.attrs["criteria"]
    again = copsense.Sweep.load(short.save(tmp_path / "short.nc"))
    assert again.criteria == (copsense.minimum_wrench(0.07),) != long.criteria
    np.testing.assert_array_equal(
        copsense.sweep(path, again.criteria)["cop_slope"], short["cop_slope"]
    )
    assert long.attrs["model_digest"] == short.attrs["model_digest"]


def test_a_sweep_within_limits_brings_its_margins_and_its_limits(stance_of, tmp_path):
    path = copsense.lateral_sweep(stance_of("four_bar"), -0.05, 0.05, 3)
    joints = path.stances[0].robot.torque_names
    limits = copsense.Limits(friction=0.5, friction_sides=6, torque=dict.fromkeys(joints, 40.0))
    within = copsense.sweep(path, CRITERIA, limits)
    again = copsense.Sweep.load(within.save(tmp_path / "within.nc"))
    assert again == within
    assert again.limits == limits
    assert {"friction", "torque"} <= set(within["limit_kind"].values)
    assert within == within.with_limit_margins(limits)
    assert copsense.sweep(path, CRITERIA).limits is None


def test_a_policy_within_limits_is_rejected_before_the_work(stance_of):
    path = copsense.lateral_sweep(stance_of("four_bar"), -0.02, 0.02, 3)
    called = []

    def mine(q):
        called.append(q)
        return np.zeros((2, 6))

    with pytest.raises(InvalidInputError, match=r"mine is a policy.*with_limit_margins"):
        copsense.sweep(path, [mine], copsense.Limits())
    assert not called


@pytest.mark.parametrize(("margin", "on"), [(0.0, True), (-1e-10, True), (-1e-8, False)])
def test_on_the_very_edge_picture_and_summary_agree(linkage, margin, on):
    """A limit holds a CoP on its edge, and rounding puts it on either side."""
    dataset = linkage.to_xarray()
    dataset["margin"].values[0, 0, 0] = margin
    edge = copsense.Sweep(dataset)
    assert bool(edge.planted[0, 0, 0]) is on
    first = float(edge.coordinate[0 if on else 1])
    assert edge.planted_range["minimum-wrench"] == (first, float(edge.coordinate[-1]))
    solid = [line for line in plot_cop(edge).lines if line.get_linestyle() == "-"]
    drawn = next(line for line in solid if len(line.get_xdata()) == 5)
    assert np.isfinite(drawn.get_ydata()[0]) == on


def test_the_planted_part_is_the_longest_run(linkage):
    dataset = linkage.to_xarray()
    dataset["margin"].values[:, 0, 1] = [1.0, -1.0, 1.0, 1.0, -1.0]
    dataset["margin"].values[:, 1, 0] = -1.0
    found = copsense.Sweep(dataset).planted_range
    y = linkage.coordinate.values
    assert found == {"minimum-wrench": (y[2], y[3]), "minimum-torque": None}


def test_a_sweep_is_frozen(linkage):
    with pytest.raises(ValueError, match="read-only"):
        linkage["cop"].values[0] = 0.0
    with pytest.raises(AttributeError, match="frozen"):
        linkage.other = 1
    before = linkage["cop"].attrs["units"]
    linkage["cop"].attrs["units"] = "mm"
    linkage.to_xarray()["cop"].values[:] = 0.0
    assert linkage["cop"].attrs["units"] == before
    assert np.any(linkage["cop"].values)
    assert pickle.loads(pickle.dumps(linkage)) == linkage


def test_a_sweep_shows_what_matters(swept, linkage):
    for sweep in (swept, linkage):
        text = repr(sweep)
        assert len(text.splitlines()) < 15
        assert sweep.attrs["robot"] in text
        assert all(name in text for name in sweep.labels("criterion"))
        assert "<details>" in sweep._repr_html_()
    assert f"{len(swept.failed_rows)} rows failed" in repr(swept)
    assert "rows failed" not in repr(linkage)
    assert "planted from -0.05 to 0.05 m" in repr(linkage)


def test_a_part_of_a_sweep_keeps_what_made_it(linkage):
    part = linkage.subset(["minimum-torque"], [0, 2])
    assert part.criteria == (CRITERIA[1],)
    np.testing.assert_array_equal(part["cop"].values, linkage["cop"].values[[0, 2]][:, [1]])
