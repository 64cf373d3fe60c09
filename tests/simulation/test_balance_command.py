"""``copsense balance`` answers, writes and refuses."""

import sys
from pathlib import Path

import pytest

from copsense.storage import load_recording

sys.path.insert(0, str(Path(__file__).parents[1] / "cli"))
from commands import copsense


def test_a_run_is_summarised_recorded_and_drawn(tmp_path):
    data, picture = tmp_path / "run.nc", tmp_path / "run.png"
    answer = copsense(
        "balance", "solo12", "--duration", 0.2, "--criterion", "minimum-wrench",
        "--output", data, "--plot", picture,
    )  # fmt: skip
    assert answer.code == 0, answer.err
    assert "completed" in answer.out
    assert "no contact tipped" in answer.out
    recording = load_recording(data)
    assert recording.attrs["end_kind"] == "completed"
    assert recording.attrs["command"].startswith("copsense balance solo12")
    assert picture.stat().st_size > 10_000


def test_a_tip_is_told_beside_the_prediction():
    answer = copsense(
        "balance", "icub", "--sole=-0.05:0.1:-0.01:0.01", "--criterion", "minimum-wrench",
        "--reference", "ramp:0.02:0.01", "--until", "tip", "--json",
    )  # fmt: skip
    assert answer.code == 1
    summary = answer.json
    assert summary["end"]["kind"] == "tip"
    predicted = summary["static_prediction"]["excursion"]
    assert summary["first_tip"]["com_y_from_start"] == pytest.approx(predicted, abs=1.5e-3)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--reference", "circle"], "reference"),
        (["--reference", "sine:1"], "sine:AMPLITUDE:FREQUENCY"),
        (["--reference", "sine:0.01:0"], "frequency"),
        (["--push", "1:2"], "FX:FY:FZ"),
        (["--push", "0:1:0:0:0.1:wing"], "wing"),
        (["--torque-limit", "tail=3"], "tail"),
        (["--torque-limit", "weak"], "torque limit"),
        (["--duration", "-1"], "duration"),
        (["--criterion", "minimum-wrench", "--criterion", "minimum-torque"], "one criterion"),
        (["--output", "run.txt"], "suffix"),
    ],
)
def test_bad_options_are_one_clear_line(options, says):
    assert says in copsense("balance", "solo12", *options).error
