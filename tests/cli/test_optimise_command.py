"""``copsense optimise`` answers, and what it writes is what it found."""

import numpy as np
import pytest
from support.commands import copsense

from copsense import load_stance
from copsense.cli.optimise_command import read_over

QUICK = ("--over", "com_x=+-60mm", "--over", "com_z=+-30mm", "--starts", 1)
KNEES = ("--reserve", "knee=2deg", "--within", "l_knee=-90:-2", "--within", "r_knee=-90deg:-2deg")


def test_the_stance_it_writes_has_the_numbers_that_it_said(tmp_path):
    file, picture = tmp_path / "best.toml", tmp_path / "best.svg"
    written = ("--save-stance", file, "--plot", picture)
    asked = ("--objective", "torque", "--require", "travel=50mm")
    answer = copsense("optimise", "icub", *QUICK, *KNEES, *asked, *written, "--json")
    found = answer.json
    assert found["converged"]
    assert found["kkt_residual"] < 1e-3
    assert found["after"]["quantities"]["travel"] == pytest.approx(0.05, abs=1e-7)
    assert picture.stat().st_size > 10_000
    analysed = copsense("analyse", "--stance", file, "--json").json
    (row,) = analysed["criteria"].values()
    travels = [contact["com_travel"] for contact in row["contacts"].values()]
    told = found["after"]["quantities"]
    assert min(travels) == pytest.approx(told["travel"], rel=1e-9)
    assert row["torque_norm"] == pytest.approx(told["torque"], rel=1e-9)
    assert analysed["com"][0] == pytest.approx(found["after"]["coordinates"]["com_x"], abs=1e-9)
    limited = copsense("analyse", "--stance", file, "--limits", "cop-margin=0", "--json").json
    exact = [
        min(each["exact"] for each in limits if each["exact"] is not None)
        for limits in limited["criteria"]["minimum-torque"]["limit_travel"].values()
    ]
    sides = [found["after"]["exact_travel"][way]["distance"] for way in ("+y", "-y")]
    assert sorted(exact) == pytest.approx(sorted(sides), rel=1e-8)
    again = copsense("optimise", "--stance", file, *QUICK, *KNEES, "--save-stance", file)
    assert "--force-stance" in again.error or "overwrite" in again.error


def test_a_text_says_what_was_gained_and_what_holds_it_back():
    asked = ("--over", "com_z=500mm:530mm", "--starts", 1, "--objective", "torque")
    text = copsense("optimise", "icub", *asked).out
    assert "best: torque 6.339 N m -> " in text
    assert "binds: com_z at 530.0 mm, the upper end of its range" in text
    assert "N m per mm" in text
    assert "KKT residual" in text


def test_a_front_is_a_table_and_a_picture(tmp_path):
    picture = tmp_path / "front.png"
    asked = ("--pareto", "torque", "--points", 3, "--plot", picture)
    answer = copsense("optimise", "icub", "--over", "com_x=+-40mm", "--starts", 1, *asked)
    assert answer.code == 0, answer.err
    assert "travel against torque" in answer.out
    assert picture.stat().st_size > 10_000
    both = copsense("optimise", "icub", *QUICK, "--pareto", "torque", "--save-stance", "x.toml")
    assert "writes one" in both.error


def test_a_film_has_the_margins_before_and_after(tmp_path):
    pytest.importorskip("viser", reason="the extra explore is not installed")
    page = tmp_path / "both.html"
    asked = ("--over", "com_z=+-30mm", "--over", "l_sole:y=+-10mm", "--starts", 1, "--export", page)
    quick = ("--objective", "torque", "--iterations", 3)
    answer = copsense("optimise", "icub", *asked, *quick)
    assert answer.code == 0, answer.err
    assert f"written: {page}" in answer.out
    said = page.read_text(encoding="utf-8")
    assert "2 postures, before (0), after (1) from 0 to 1" in said
    table = said.rpartition("</iframe>")[2]
    assert "minimum-torque" in table
    assert "minimum-wrench" not in table  # the criterion that it was optimised under
    assert copsense("optimise", "icub", *asked, *quick, "--force", "--json").json["export"] == str(
        page
    )
    again = copsense("optimise", "icub", *asked, *quick)
    assert "exists already" in again.error
    assert (
        "--require" in copsense("optimise", "icub", *asked[:-1], "f.html", "--pareto", "gain").error
    )


def test_ranges_are_read_in_their_units():
    stance = load_stance("icub")
    found = read_over(["com_z=450mm:0.5", "pitch=+-10", "l_sole:y", "feet=+-3cm"], stance)
    assert found["com_z"] == (0.45, 0.5)
    assert found["pitch"] == pytest.approx(np.radians(10.0))
    assert found["l_sole:y"] is None
    assert found["feet"] == pytest.approx(0.03)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--over", "com_z=0.5"), "NAME=LOW:HIGH"),
        (("--over", "pitch=1m:2m"), "angle"),
        (("--over", "com_z=0.55:0.4"), "LOW < HIGH"),
        (("--over", "com_x=+-60"), "60 mm are 0.06 m (60mm on the command line)"),
        (("--over", "feet=+-30"), "30 mm are 0.03 m (30mm on the command line)"),
        (("--over", "com_z=450:500"), "450 mm are 0.45 m (450mm on the command line)"),
        (("--over", "pitch=+-20rad"), "20 degrees are 0.3491"),
        (("--over", "com_z", "--within", "com_x=-40:40"), "40 mm are 0.04 m"),
        (("--distance", "100:200"), "100 mm are 0.1 m"),
        (("--over", "com_z", "--over", "com_z"), "twice"),
        (("--within", "com_z"), "NAME=LOW:HIGH"),
        (("--reserve", "knee=2mm"), "--reserve"),
        (("--require", "travel"), "QUANTITY=VALUE"),
        (("--require", "gain=much"), "QUANTITY=VALUE"),
        (("--distance", "200mm"), "LOW:HIGH"),
        (("--objective", "speed"), "travel"),
        (("--family", "joints", "--criterion", "minimum-torque"), "--family"),
        (("--frame", "hat", "--objective", "push"), "hat"),
    ],
)
def test_a_bad_option_is_one_error(arguments, said):
    assert said in copsense("optimise", "icub", *arguments).error
