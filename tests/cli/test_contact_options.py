"""``--contact FRAME[:KIND]`` and ``--sole``: names with colons, and soles that are a line."""

import pytest
from support.commands import copsense
from support.tiny import urdf

SOLE = ("--sole", "-0.1:0.1:-0.05:0.05", "--sole-height", "-0.01")
LAW = ("--criterion", "minimum-wrench")


@pytest.fixture
def scoped(tmp_path):
    """The tiny robot with links called after their robot, and one that looks like a kind."""
    path = tmp_path / "scoped.urdf"
    text = urdf().replace('"left"', '"tiny::left"').replace('"right"', '"tiny:right:point"')
    path.write_text(text, encoding="utf-8")
    return path


def contacts_of(path, *names):
    options = [word for name in names for word in ("--contact", name)]
    answer = copsense("analyse", path, *options, *SOLE, *LAW, "--json").json
    return {c["frame"]: c["kind"] for c in answer["contacts"]}


def test_the_longest_known_frame_is_meant(scoped):
    assert contacts_of(scoped, "tiny::left", "tiny:right:point") == {
        "tiny::left": "surface",
        "tiny:right:point": "surface",
    }


def test_a_kind_stands_after_the_last_colon(scoped):
    assert contacts_of(scoped, "tiny::left:surface", "tiny:right:point:planar") == {
        "tiny::left": "surface",
        "tiny:right:point": "planar",
    }


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("tiny::left:points", "no kind of contact named 'points'. Did you mean point"),
        ("tiny::lift", "no frame in robot 'tiny' named 'tiny::lift'. Did you mean tiny::left"),
    ],
)
def test_a_wrong_name_is_told_apart_from_a_wrong_kind(scoped, name, said):
    assert said in copsense("analyse", scoped, "--contact", name).error


def test_a_sole_may_be_a_line_but_not_a_point(scoped):
    where = ("analyse", scoped, "--contact", "tiny::left", "--sole-height", "-0.01")
    answer = copsense(*where, "--sole", "-0.1:0.1:0:0", "--json").json
    row = answer["criteria"]["minimum-wrench"]["contacts"]["tiny::left"]
    assert row["margin"] <= 0.1 + 1e-9
    assert "empty" in copsense(*where, "--sole", "0:0:0:0").error
