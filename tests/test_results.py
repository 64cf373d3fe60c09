"""Results on disk: whole or not there, the same when read back."""

import csv
import stat

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import copsense
from copsense.files import load_configurations

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
