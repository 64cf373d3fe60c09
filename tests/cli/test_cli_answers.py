"""What the commands answer: JSON that is JSON, the documented names, files that hold everything."""

import csv
import math

import numpy as np
import pytest
import xarray as xr
from support.commands import copsense


def numbers(value):
    if isinstance(value, dict):
        return [n for v in value.values() for n in numbers(v)]
    if isinstance(value, list):
        return [n for v in value for n in numbers(v)]
    return [value] if isinstance(value, float) else []


@pytest.mark.parametrize(
    "criterion", ["minimum-wrench", "minimum-torque", "weighted-torque", "minimum-tangential"]
)
def test_four_bar_answers_in_json(criterion):
    answer = copsense("four-bar", "--xi", "1.5", "--criterion", criterion, "--json").json
    assert list(answer["wrenches"]) == list(answer["sensitivity"]) == ["left", "right"]
    assert list(answer["torques"]) == ["hipL", "ankleL", "hipR", "ankleR"]
    assert list(answer["cop"]) == ["left", "right"]
    assert len(answer["com"]) == 2
    fx, fy, _ = np.sum([answer["wrenches"]["left"], answer["wrenches"]["right"]], axis=0)
    assert fx == pytest.approx(0.0, abs=1e-9)
    assert fy == pytest.approx(33 * 9.81)


def test_analyse_answers_in_json():
    answer = copsense("analyse", "icub", "--along", "l_hip_roll", "--check", "--json").json
    assert list(answer["criteria"]) == ["minimum-wrench", "minimum-torque"]
    assert answer["checked"] is True
    row = answer["criteria"]["minimum-torque"]
    assert len(row["torques"]) == 23
    assert row["residual"] < 1e-9
    contact = row["contacts"]["l_sole"]
    assert len(contact["wrench"]) == 6
    assert contact["cop_slope"][1] == pytest.approx(0.506, abs=1e-3)
    assert contact["cop_per_l_hip_roll"][1] == pytest.approx(-0.196, abs=1e-3)
    assert all(map(math.isfinite, numbers(answer)))


def test_json_has_null_for_what_is_infinite():
    answer = copsense("analyse", "solo12", "--criterion", "minimum-wrench", "--json").json
    contact = answer["criteria"]["minimum-wrench"]["contacts"]["FL_FOOT"]
    assert contact["com_travel"] is None  # a point contact never tips


def test_robots_answers_in_json_with_every_joint():
    rows = {row["name"]: row for row in copsense("robots", "--json").json["robots"]}
    assert len(rows["icub"]["joints"]) == 23
    assert rows["icub"]["mass"] == pytest.approx(33.06, abs=0.01)
    assert rows["solo12"]["contacts"][0] == {"frame": "FL_FOOT", "kind": "point"}


def test_robots_lists_a_robot_that_is_not_installed_with_the_remedy(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    answer = copsense("robots")
    assert answer.code == 0
    assert 'pip install "copsense[icub]"' in answer.out
    row = next(r for r in copsense("robots", "--json").json["robots"] if r["name"] == "icub")
    assert row["joints"] == []
    assert "icub-models" in row["missing"]


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """A sweep of the iCub with one posture out of reach, as netCDF and as a table."""
    folder = tmp_path_factory.mktemp("swept here")
    answers = {}
    for suffix in ("nc", "csv"):
        path = folder / f"icub.{suffix}"
        arguments = ["sweep", "icub", "--com-y", "0:0.5:3", "--output", path, "--json"]
        answers[path] = copsense(*arguments)
    return answers


def test_sweep_answers_in_json_and_counts_its_failures(swept):
    for path, answer in swept.items():
        assert answer.code == 1
        assert answer.json["output"] == str(path)
        assert answer.json["failed_rows"] == 2
        assert answer.json["coordinate"] == "com_y"


def test_sweep_writes_the_documented_variables(swept):
    netcdf, table = swept
    with xr.open_dataset(netcdf) as dataset:
        for name in (
            "cop",
            "wrench",
            "torque",
            "com",
            "cop_sensitivity",
            "cop_gain",
            "com_travel",
            "margin",
        ):
            assert dataset[name].notnull().any(), name
            assert dataset[name].attrs["long_name"], name
        assert dataset.attrs["command"].startswith("copsense sweep icub --com-y 0:0.5:3")
        kept = dataset.isel(posture=0).sel(criterion="minimum-torque")
        rows = list(csv.DictReader(table.read_text("utf-8").splitlines()))
        assert len(rows) == 3 * 2 * 2
        first = next(
            r for r in rows if r["contact"] == "l_sole" and r["criterion"] == "minimum-torque"
        )
        assert float(first["cop_y"]) == pytest.approx(
            float(kept["cop"].sel(contact="l_sole", axis="y"))
        )
        assert float(first["torque_l_knee"]) == pytest.approx(
            float(kept["torque"].sel(joint="l_knee"))
        )
        for name in (
            "wrench_fz",
            "com_y",
            "cop_gain_y_y",
            "com_travel",
            "margin",
            "cop_sensitivity_y_l_knee",
        ):
            assert math.isfinite(float(first[name])), name
        failed = [r for r in rows if r["reason"]]
        assert {r["posture"] for r in failed} == {"2"}
        assert all(r["cop_y"] == "" and float(r["com_y"]) == 0.5 for r in failed)


def test_sweep_of_a_joint_and_of_a_table_of_configurations_agree(tmp_path):
    path = tmp_path / "joint.nc"
    assert copsense("sweep", "four_bar", "--joint", "l_hip=-5:5:3", "--output", path).code == 0
    with xr.open_dataset(path) as dataset:
        np.savetxt(tmp_path / "q.csv", dataset["configuration"].values, fmt="%.17g", delimiter=",")
        cops = dataset["cop"].values
    again = tmp_path / "list.nc"
    answer = copsense(
        "sweep", "four_bar", "--configurations", tmp_path / "q.csv", "--output", again
    )
    assert answer.code == 0, answer.err
    with xr.open_dataset(again) as dataset:
        np.testing.assert_allclose(dataset["cop"].values, cops, atol=1e-9)
