"""What a command prints as JSON is the `to_dict` of the result that Python has."""

import json

import numpy as np
import pytest
from support.commands import copsense as command

import copsense
import copsense.design
from copsense.comparison import benchmark_summary, load_benchmark
from copsense.controllers import BalancingController, Sine
from copsense.design import Design, Family, Score, design_criterion
from copsense.limits import Limits
from copsense.maps import map_summary
from copsense.regions import ComRegion, ComRegions
from copsense.simulation import Scenario

LIMITED = Limits(friction=0.5, torque="model")


def as_json(data):
    """Plain data after a journey through JSON, which has no NaN and no infinity."""
    return json.loads(json.dumps(data, allow_nan=False))


def test_of_sweep(stance_of):
    run = ("sweep", "solo12", "--com-y", "-5mm:5mm:2", "--criterion", "minimum-wrench", "--json")
    limits = ("--limits", "friction=0.5,torque=model")
    path = copsense.lateral_sweep(stance_of("solo12"), -0.005, 0.005, 2)
    for options, within in (((), None), (limits, LIMITED)):
        found = copsense.sweep(path, [copsense.minimum_wrench(1.0)], within)
        assert command(*run, *options).json == as_json(found.to_dict() | {"output": None})
        row = found.to_dict()["criteria"]["minimum-wrench"]
        assert row["smallest_margin"] is None  # a point foot has no edge to reach
        assert row["planted"] == [-0.005, 0.005]
        assert row["largest_residual"] == float(found["residual"].max())


def test_of_balance(stance_of, tmp_path):
    file = tmp_path / "run.nc"
    told = command(
        "balance", "solo12", "--reference", "sine:0.005:2", "--duration", 0.05, "--output", file,
        "--json",
    ).json  # fmt: skip
    kept = copsense.Recording.load(file)
    assert told == as_json(kept.to_dict())
    scenario = Scenario(0.05, Sine(0.005, 2.0), name="sine:0.005:2")
    own = copsense.balance(stance_of("solo12"), None, scenario)
    assert told == as_json(own.to_dict())
    torque = own["torque"].values
    assert own.tip is None
    assert told["torque_norm_mean"] == pytest.approx(np.linalg.norm(torque, axis=1).mean())
    assert told["torque_peak"] == np.abs(torque).max()
    assert told["static_prediction"]["excursion"] is None


def test_a_recording_without_a_prediction_has_plain_data_too(stance_of):
    balancer = BalancingController(stance_of("solo12"), copsense.minimum_torque())
    found = copsense.balance(stance_of("solo12"), None, Scenario(0.02), controller=balancer)
    data = as_json(found.to_dict())
    assert data["static_prediction"] == {
        "excursion": None, "contact": "", "how": "", "reach": None, "statement": "",
    }  # fmt: skip
    assert set(data["quasi_static"].values()) == {None}


def test_of_regions(stance_of, tmp_path):
    told = command(
        "analyse", "four_bar", "--criterion", "minimum-torque", "--limits", "friction=0.5",
        "--regions", tmp_path / "regions.png", "--json",
    ).json["regions"]  # fmt: skip
    stance = stance_of("four_bar")
    found = copsense.com_regions(stance, [copsense.minimum_torque()], Limits(friction=0.5))
    assert told["of"] == as_json(found.to_dict())
    row = told["of"]["minimum-torque"]
    assert row["margin"] == found["minimum-torque"].margin(stance.com[:2])
    nothing = ComRegion(np.zeros((0, 2)), 0.0, True)
    empty = ComRegions(stance.com[:2], nothing, None, {}).to_dict()
    assert empty["friction and soles"]["polygon"] == []
    assert empty["friction and soles"]["margin"] is None


def score_of(name, travel, gain=1.0, **parameters):
    return Score(name, parameters, travel, "l_sole: CoP at the +y edge", gain, 5.0, 0.01)


def design_of(travel, gain=1.0, objective="travel"):
    """A design beside baselines that travel 10 and 20 mm, with gains 1 and 2."""
    best = score_of("designed-wrench", travel, gain, characteristic_length=0.3)
    papers = score_of("minimum-wrench", 0.01, 1.0), score_of("minimum-torque", 0.02, 2.0)
    criterion = copsense.minimum_wrench(0.3, name="designed-wrench")
    return Design(
        criterion, best, papers, (), (best,), (best,), objective, "length", (), "linkage", ("a",)
    )


def test_of_design(monkeypatch):
    found = design_of(np.inf)
    monkeypatch.setattr(copsense.design, "design_criterion", lambda *_, **__: found)
    told = command("design", "four_bar", "--family", "length", "--com-y", "0:1mm:2", "--json").json
    assert told == as_json(found.to_dict())
    assert told["best"]["travel"] is None
    assert told["best"]["parameters"] == {"characteristic_length": 0.3}
    assert [row["criterion"] for row in told["baselines"]] == ["minimum-wrench", "minimum-torque"]
    assert (told["robot"], told["notes"]) == ("linkage", ["a"])


def test_a_design_keeps_the_robot_s_name_and_notes(stance_of):
    path = copsense.lateral_sweep(stance_of("four_bar"), -0.002, 0.002, 5)
    bounds = ((0.5, 0.500001),)
    family = Family("length", ("length",), bounds, lambda v: copsense.minimum_wrench(*v))
    found = design_criterion(path, Limits(friction=0.5), family, grid=2)
    assert (found.robot, found.notes) == ("four_bar", path.stances[0].robot.notes)


def test_a_design_says_what_it_gained_in_python_too():
    assert design_of(0.025).verdict == "travel +25 % over the better of the paper's two"
    same = "no better than minimum-torque (travel +0.0 %): keep minimum-torque"
    assert design_of(0.02).verdict == same
    gain = design_of(0.02, 0.5, "gain").verdict
    assert gain == "worst gain -50 % over the better of the paper's two"
    assert "keep minimum-wrench" in design_of(0.02, 1.0, "gain").verdict


def test_of_benchmark(tmp_path):
    file = tmp_path / "table.csv"
    told = command(
        "benchmark", "solo12", "--posture", "own", "--disturbance", "rest:duration=0.05", "--jobs",
        1, "--output", file, "--json",
    ).json  # fmt: skip
    notes = told.pop("notes")
    assert told == as_json(benchmark_summary(load_benchmark(file)))
    assert told["cases"] == len({row["key"] for row in told["scores"]})
    assert all(isinstance(note, str) for note in notes)


def test_of_map(stance_of, tmp_path):
    store = tmp_path / "map.zarr"
    told = command(
        "map", "four_bar", "--over", "com_y=-10mm:10mm:3", "--output", store, "--json"
    ).json
    assert told == as_json(map_summary(store).to_dict()) | {
        "plot": None,
        "notes": list(stance_of("four_bar").robot.notes),
    }
