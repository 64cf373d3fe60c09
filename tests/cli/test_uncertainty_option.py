"""``copsense analyse --uncertainty``: what is said, drawn and rejected."""

import re

import pytest
from support.commands import copsense

FILE = """
sigmas = 1.0
[links."*"]
mass_percent = 5.0
com_m = 0.005
"""


@pytest.fixture
def unsure(tmp_path):
    path = tmp_path / "unsure.toml"
    path.write_text(FILE, encoding="utf-8")
    return path


def test_it_says_what_is_left_of_the_travel_and_by_what(unsure):
    said = copsense("analyse", "icub", "--criterion", "minimum-torque", "--uncertainty", unsure)
    assert said.code == 0
    assert "96 errors of the model, 1 standard deviation" in said.out
    assert re.search(r"CoM to \+y: +45\.9 mm to r_sole: .*; 44\.4 likely left, 39\.1 at", said.out)
    assert re.search(r"l_sole: \d+% centres of mass, \d+% link masses; most by", said.out)


def test_it_answers_in_json(unsure):
    answer = copsense("analyse", "icub", "--uncertainty", unsure, "--json").json
    row = answer["criteria"]["minimum-torque"]["uncertainty"]
    assert row["travels"]["+y"]["worst"] == pytest.approx(0.0391, abs=1e-4)
    contact = row["contacts"]["l_sole"]
    assert sum(contact["shares"].values()) == pytest.approx(1.0)
    assert contact["half_axes"][0] >= contact["half_axes"][1] > 0
    assert {m["name"] for m in row["margins"]} >= {"l_sole: normal force"}


def test_the_default_is_drawn_on_the_soles(tmp_path):
    picture = tmp_path / "soles.svg"
    said = copsense("analyse", "four_bar", "--uncertainty", "default", "--plot", picture)
    assert said.code == 0
    assert "2 standard deviations of the CoP" in picture.read_text("utf-8")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[links.ches]\nmass_kg = 1.0", "no link in robot 'icub' named 'ches'. Did you mean chest"),
        ("[links.chest]\nmass_kg = -1.0", "Give a standard deviation, zero or more"),
        ("[contacts.l_sole]\nfriction = 0.1", "the limits have no friction"),
        ("[links.chest", "is not valid TOML"),
    ],
)
def test_what_is_wrong_is_one_line(tmp_path, text, said):
    path = tmp_path / "unsure.toml"
    path.write_text(text, encoding="utf-8")
    assert said in copsense("analyse", "icub", "--uncertainty", path).error


def test_a_file_that_is_not_there_is_named():
    said = copsense("analyse", "icub", "--uncertainty", "absent.toml").error
    assert "no uncertainty at 'absent.toml'" in said
