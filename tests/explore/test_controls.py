"""The panel's controls: what each asks for is a state that the command line can say."""

import shlex
import threading
import time
from dataclasses import replace

import numpy as np
import pytest
from support.commands import copsense as command

import copsense
from copsense.criterion_text import criterion_from_text
from copsense.design import score
from copsense.errors import InvalidInputError
from copsense.explore import Model, State
from copsense.explore.best_weights import best_weights
from copsense.explore.drawing import CONTACTS, JOINTS, LARGEST
from copsense.explore.judging import weight_keys
from copsense.explore.state import weights_text
from copsense.limits import Limits

pytest.importorskip("viser", reason="the extra explore is not installed")

from copsense.explore.explorer import Explorer


@pytest.fixture(scope="module")
def model(icub):
    return Model(icub)


@pytest.fixture(scope="module")
def explorer(model):
    with Explorer(model, meshes=False, light=True) as explorer:
        yield explorer


@pytest.fixture
def panel(explorer):
    panel = explorer._panel
    panel.reset()
    return panel


def test_what_is_changed_by_hand_while_the_panel_assigns_is_not_lost(panel):
    inside, over = threading.Event(), threading.Event()

    def assign():
        with panel._assigning.silently():
            inside.set()
            over.wait(10.0)

    other = threading.Thread(target=assign)
    other.start()
    assert inside.wait(10.0)
    panel._sliders["com_y"].value = 12.0
    over.set()
    other.join()
    assert panel.read().coordinates["com_y"].value == pytest.approx(0.012, abs=1e-9)


def test_a_weight_that_is_moved_shows_its_criterion_beside_the_others(model, panel):
    panel._judging._weights["knee"].value = 0.5
    state = panel.read()
    assert state.criteria == ("minimum-wrench", "minimum-torque", "weighted-torque:knee=3.162")
    panel._judging._other.value = "stiffness:2000"
    state = panel.read()
    assert state.criteria[3:] == ("stiffness:2000",)
    view = model.view(state)
    assert [each.name for each in view.criteria] == list(state.criteria)
    assert panel.shown(view).criterion == "stiffness:2000"
    line = shlex.split(state.to_command())
    said = command(*line[1:], "--json").json["criteria"]
    for found in view.criteria:
        told = [c["margin"] for c in said[found.name]["contacts"].values()]
        np.testing.assert_allclose(found.margin, told, rtol=0, atol=1e-9)
    panel.reset()
    assert panel.read().criteria == ()


def test_limits_that_are_typed_are_those_of_the_command(panel):
    judging = panel._judging
    judging._limited.value = True
    assert panel.read().limits == Limits(friction=0.5)
    judging._numbers["normal_force"][0].value = 12.5
    judging._numbers["cop_margin"][0].value = 4.5
    judging._choices["torsion"][0].value = "wrench cone"
    state = panel.read()
    assert state.limits == Limits(
        friction=0.5, normal_force=12.5, cop_margin=0.0045, torsion="cone"
    )
    text = "normal-force=12.5,friction=0.5,cop-margin=0.0045,torsion=cone"
    assert shlex.split(state.to_command())[-1] == text


def test_a_number_that_limits_nothing_is_a_sentence_in_the_panel(explorer, panel):
    panel._judging._limited.value = True
    panel._judging._numbers["friction"][0].value = float("nan")
    end = time.monotonic() + 10.0
    while "friction" not in panel._status.content and time.monotonic() < end:
        time.sleep(0.02)
    assert "friction" in panel._status.content
    assert explorer._worker.error == ""


def test_a_load_of_the_panel_is_one_of_the_command(model, panel):
    pushing = panel._pushing
    pushing._frame.value = "l_hand"
    pushing._force.value = (0.0, 5.0, -20.0)
    pushing._point.value = (0.0, 0.0, 100.0)
    state = panel.read()
    assert state.loads == (copsense.Load("l_hand", (0.0, 5.0, -20.0), point=(0.0, 0.0, 0.1)),)
    view = model.view(state)
    np.testing.assert_allclose(view.load_forces, [(0.0, 5.0, -20.0)])
    said = command(*shlex.split(state.to_command())[1:], "--json").json
    told = said["criteria"]["minimum-torque"]["contacts"]["l_sole"]["wrench"]
    np.testing.assert_allclose(view["minimum-torque"].wrenches[0], told, atol=1e-9)
    pushing._force.value = (0.0, 0.0, 0.0)
    assert panel.read().loads == ()


def test_the_best_weights_go_farther_than_none(model, monkeypatch):
    monkeypatch.setattr("copsense.explore.best_weights._GRID", 2)
    keys = weight_keys(model)
    assert list(keys) == ["hip", "knee", "ankle"]
    state = replace(model.start, limits=Limits(friction=0.6))
    weights, said = best_weights(model, state, keys, "travel")
    assert said.startswith("weights for the farthest travel along y: travel +")
    assert weights["ankle"] == 1.0
    path = copsense.lateral_sweep(model.stance, -0.12, 0.12, 25)
    own = score(path, state.limits, criterion_from_text(weights_text(weights)), {})
    usual = score(path, state.limits, copsense.minimum_torque(), {})
    assert own.travel > 1.05 * usual.travel


def test_groups_without_a_common_part_are_named_joint_by_joint(stance_of):
    keys = weight_keys(Model(stance_of("talos")))
    assert keys["joint3"] == ("leg_left_3_joint", "leg_right_3_joint")
    with pytest.raises(InvalidInputError, match="single weight"):
        best_weights(Model(stance_of("talos")), State(("talos",)), {"a": ("b",)}, "travel")


def test_labels_have_the_torques_of_the_criterion(model, explorer, panel):
    from copsense.explore.drawing import _labels

    view = model.view(State(("icub",)))
    shown = panel.shown(view)
    assert _labels(view, shown) == {}
    everything = _labels(view, replace(shown, labels=JOINTS))
    assert len(everything) == len(view.torque_names)
    found = view["minimum-torque"]
    i = view.torque_names.index("l_knee")
    text, place = everything["joint l_knee"]
    assert text.startswith(f"l_knee: {found.torques[i]:.1f} Nm")
    np.testing.assert_array_equal(place, view.poses[view.joints.index("l_knee"), :3])
    largest = _labels(view, replace(shown, labels=LARGEST))
    assert len(largest) == 6
    most = view.torque_names[int(np.abs(found.torques).argmax())]
    assert f"joint {most}" in largest
    panel.pin("r_knee")
    assert list(_labels(view, panel.shown(view))) == ["joint r_knee"]
    panel.pin("r_knee")
    contacts = _labels(view, replace(shown, labels=CONTACTS))
    assert contacts["contact l_sole"][0] == f"l_sole: {100 * found.load_share[0]:.1f} %"


def test_points_have_a_curve_of_their_loads(stance_of):
    model = Model(stance_of("solo12"))
    state = replace(model.start, overlays=frozenset({"curve"}))
    view = model.add_curve(model.view(state))
    assert np.isnan(view.curve_margin).all()
    i = int(np.argmin(np.abs(view.curve_y - view.com[1])))
    now = [found.load_share.min() for found in view.criteria]
    np.testing.assert_allclose(view.curve_share[:, i], now, atol=1e-6)
    assert 0.2 < np.nanmax(view.curve_share) <= 0.25 + 1e-9
    with Explorer(model, state, meshes=False, light=True) as explorer:
        explorer._panel._curve.show(view, {"minimum-wrench": (0, 0, 0)})  # the other left out
        assert "load of a contact [%]" in explorer._panel._curve._plots[1].title
