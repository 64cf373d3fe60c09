"""``copsense robots`` answers."""

import pytest
from support.commands import copsense

from copsense.robots.presets import shared_presets


def test_robots_answers_in_json_with_every_joint():
    rows = {row["name"]: row for row in copsense("robots", "--json").json["robots"]}
    assert len(rows["icub"]["joints"]) == 23
    assert rows["icub"]["mass"] == pytest.approx(33.06, abs=0.01)
    assert rows["solo12"]["contacts"][0] == {"frame": "FL_FOOT", "kind": "point"}


def test_robots_lists_a_robot_that_is_not_installed_with_the_remedy(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with shared_presets():  # of none that was read before
        answer, data = copsense("robots"), copsense("robots", "--json")
    assert answer.code == 0
    assert answer.out.count('pip install "copsense[icub]"') == 1
    assert "not installed: icub, iCubDarmstadt01" in answer.out
    row = next(r for r in data.json["robots"] if r["name"] == "icub")
    assert row["joints"] == []
    assert "icub-models" in row["missing"]
