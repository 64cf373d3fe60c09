"""``copsense sweep`` answers, and writes files that hold everything."""

import csv
import math

import numpy as np
import pytest
import xarray as xr
from support.commands import copsense

from copsense.cli.sweep_command import _print
from copsense.joint_notes import distance_text
from copsense.pushes import _degrees

LIMITS = "normal-force=10,friction=0.33333,torsion=0.01333,torque=model"


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


def test_a_sweep_within_limits_keeps_every_cop_on_its_sole(tmp_path):
    file = tmp_path / "within.nc"
    answer = copsense(
        "sweep", "icub", "--com-y", "-0.07:0.07:9", "--limits", LIMITS, "--output", file, "--json"
    )
    assert answer.code == 0
    with xr.open_dataset(file) as data:
        assert float(data["margin"].min()) > -1e-9
        ends = data["active_limits"].isel(posture=[0, -1]).values
        assert all("CoP at edge" in name for name in ends.ravel())
        assert float(data["limit_margin"].min()) > -1e-6
        assert float(data["limit_margin"].sel(limit="r_sole: cop").isel(posture=-1).max()) < 1e-9
        assert data["active_limits"].isel(posture=4).values.tolist() == ["", ""]
        assert data["change_travel"].attrs["units"] == "m"
        assert (data["change_travel"].values > 0).all()
        assert (data["change_limit"] != "").all()


def test_infeasible_limits_are_rows_with_the_limits_in_conflict():
    answer = copsense("sweep", "icub", "--com-y", "-0.02:0.02:3", "--limits", "normal-force=200")
    assert answer.code == 1
    assert "In conflict: l_sole: normal force" in answer.err


@pytest.mark.parametrize("axis", ["x", "z"])
def test_the_com_is_swept_forwards_and_upwards_too(axis, tmp_path):
    start = {"x": "-10mm:20mm:2", "z": "0.5:0.51:2"}[axis]
    file = tmp_path / "swept.nc"
    arguments = ("sweep", "icub", f"--com-{axis}", start, "--output", file, "--json")
    assert copsense(*arguments).json["coordinate"] == f"com_{axis}"
    with xr.open_dataset(file) as data:
        wanted = {"x": [-0.01, 0.02], "z": [0.5, 0.51]}[axis]
        np.testing.assert_allclose(data["com"].sel(com_axis=axis), wanted, rtol=0, atol=1e-12)
    both = copsense("sweep", "icub", "--com-x", "0:1:2", "--com-z", "0:1:2")
    assert "--com-x 0:1:2 and --com-z 0:1:2 each sweep" in both.error


@pytest.mark.parametrize(
    ("limits", "soleless", "failed", "said"),
    [
        ("Limits()", "", 0, "a limit active at every posture"),
        ("Limits()", "", 1, "a limit active at every posture that was evaluated"),
        (None, "", 0, "a contact beyond its sole at every posture"),
        (None, "l_foot", 0, "a contact that pulls at every posture"),
        (None, "", 3, "no posture was evaluated"),
    ],
)
def test_what_is_so_at_no_posture_is_said_the_other_way_round(
    limits, soleless, failed, said, capsys
):
    row = {"planted": None, "smallest_margin": None, "static_frequency": None}
    _print(
        {
            "robot": "r", "postures": 3, "coordinate": "com_y", "unit": "m", "period": None,
            "criteria": {"c": row}, "limits": limits, "without_sole": soleless,
            "failed_rows": failed,
        }
    )  # fmt: skip
    assert capsys.readouterr().out.splitlines()[1] == f"  c: {said}"


def test_a_single_posture_that_is_planted_is_no_range(capsys):
    row = {"planted": (0.01, 0.01), "smallest_margin": -0.002, "static_frequency": None}
    told = {"robot": "r", "postures": 3, "coordinate": "com_y", "unit": "m", "period": None}
    _print(told | {"criteria": {"c": row}, "limits": None, "without_sole": "", "failed_rows": 0})
    said = capsys.readouterr().out.splitlines()[1]
    assert said.startswith("  c: every contact planted at +0.01 m alone; smallest margin")


def test_small_distances_and_directions_have_one_name():
    assert distance_text(1e-6, "rad") == "6e-05 deg"
    assert distance_text(0.02, "m") == "20.0 mm"
    assert [_degrees(math.radians(d)) for d in (-180, -179.6, -0.3, 0, -90)] == [
        180,
        180,
        0,
        0,
        -90,
    ]
