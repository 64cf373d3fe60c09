"""What an explorer shows is what the copied command and the copied Python print."""

import math
import shlex
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from support.commands import copsense as command

import copsense
from copsense.errors import CopsenseError, InvalidInputError, UnknownNameError
from copsense.explore import Model, Setting, State
from copsense.explore.state import limits_text, weights_text
from copsense.path import LateralPath
from copsense.scan import PathScan

ROBOTS = ("icub", "talos", "g1", "solo12", "cassie", "four_bar")
LIMITS = copsense.Limits(friction=0.6, torque="model")
STATES = dict.fromkeys(ROBOTS, 40) | {"cassie": 8}  # some have no posture, which is said too


@pytest.fixture(scope="module")
def model(icub):
    return Model(icub)


def random_states(model, count):
    """States of a robot: nearest and held postures, criteria, lengths and limits."""
    rng = np.random.default_rng(7)
    com = [c for c in model.coordinates.values() if c.kind == "com"]
    others = [c for c in model.coordinates.values() if c.kind != "com"]
    for number in range(count):
        held = number % 2 == 1
        pool = others if held else [c for c in others if c.kind == "joint"]
        chosen = [*rng.choice(len(com), min(2, len(com)), replace=False)]
        moved = [com[i] for i in chosen]
        moved += [pool[i] for i in rng.choice(len(pool), min(2, len(pool)), replace=False)]
        asked = {}
        free = model.stance.admissible_motions.shape[1]  # a four-bar linkage has one motion
        for c in moved[: min(1 + number % 4, free)]:
            end = c.low if rng.random() < 0.5 else c.high
            asked[c.name] = Setting(c.home + 0.1 * rng.random() * (end - c.home), c.unit)
        loads = ()
        if number % 4 == 1:  # a push and what it turns, at a point of the base
            force = (0.0, *rng.uniform(-10, 10, 2).tolist())
            moment = (float(rng.uniform(-1, 1)), 0.0, 0.0) if number % 8 == 1 else (0.0, 0.0, 0.0)
            loads = (copsense.Load(model.stance.robot.base_frame, force, moment, (0.0, 0.0, 0.1)),)
        limits = replace(LIMITS, normal_force=2.5, cop_margin=0.003) if number == 3 else LIMITS
        weights = {name: float(rng.uniform(0.3, 3)) for name in ("hip", "knee")}
        named = all(any(w in t.lower() for t in model.stance.robot.torque_names) for w in weights)
        criteria = [(), ("minimum-wrench", weights_text(weights) if named else "minimum-torque")]
        yield State(
            model.words,
            asked,
            held,
            criteria[number % 3 == 2],
            float(rng.uniform(0.1, 2.0)) if number % 3 == 2 else 1.0,
            limits if number % 5 == 3 else "own",
            loads=loads,
        )


@pytest.mark.parametrize("robot", ROBOTS)
def test_a_view_has_the_numbers_of_its_command(robot, stance_of, monkeypatch):
    stance = stance_of(robot)
    monkeypatch.setattr("copsense.robots.load_stance", lambda *_, **__: stance)
    # The last part of an analysis within limits takes seconds and is no number of a view.
    monkeypatch.setattr("copsense.analysis.stance_analysis.analyse_limits", _no_travel)
    model, shown = Model(stance, [robot]), 0
    for state in random_states(model, STATES[robot]):
        view = model.view(state)
        answer = command(*shlex.split(state.to_command())[1:], "--json")
        if view.reason:
            assert answer.code == 2
            assert view.reason in answer.err
            continue
        shown += 1
        said = answer.json
        np.testing.assert_allclose(view.com, said["com"], rtol=0, atol=1e-9)
        assert len(view.load_points) == len(state.loads)
        assert [found.name for found in view.criteria] == list(said["criteria"])
        for found in view.criteria:
            row = said["criteria"][found.name]
            torques = list(row["torques"].values())
            np.testing.assert_allclose(found.torques, torques, rtol=1e-9, atol=1e-9)
            for k, contact in enumerate(view.contacts):
                numbers = row["contacts"][contact]
                for key, own in (
                    ("wrench", found.wrenches[k]),
                    ("load_share", found.load_share[k]),
                    ("cop", found.cop[k]),
                    ("margin", found.margin[k]),
                    ("com_travel", found.com_travel[k]),
                    ("unloading_travel", found.unloading_travel[k]),
                ):
                    told = numbers.get(key)
                    if told is None:
                        assert not np.isfinite(own)
                    else:
                        np.testing.assert_allclose(own, told, rtol=1e-9, atol=1e-9, err_msg=key)
    assert shown >= STATES[robot] // 4


def _no_travel(path, criterion, limits, found, tangent):
    from copsense.analysis import LimitAnalysis

    return LimitAnalysis((), 0.0, (), {"+y": (None, None), "-y": (None, None)}, {})


def test_python_and_the_command_say_one_thing(model, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    state = State(
        ("icub",),
        {"com_y": Setting(0.0123456789, "m"), "l_elbow": Setting(0.7, "rad")},
        criteria=("minimum-torque", "weighted-torque:hip=2.5"),
        limits=copsense.Limits(friction=0.4, normal_force=None),
        loads=(copsense.Load("l_hand", (0.0, 5.0, -20.0), fixed_to="body"),),
    )
    lines = state.to_python().replace("print(analysis)", "")
    here = {}
    exec(lines, here)
    view = model.view(state)
    for name, found in here["analysis"].sensitivities.items():
        np.testing.assert_allclose(found.cop, view[name].cop, rtol=0, atol=1e-12)
        assert found.equilibrium.limits == state.limits
        assert found.equilibrium.stance.loads == state.loads
    held = State(("icub",), {"yaw": Setting(3.1, "rad"), "com_z": Setting(0.5, "m")}, held=True)
    exec(held.to_python().replace("print(analysis)", ""), here)
    np.testing.assert_allclose(here["analysis"].stance.q, model.view(held).q, atol=1e-9)


def test_a_stance_of_many_words_goes_through_a_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    state = State(("icub", "--contact", "l_sole"), {"com_z": Setting(0.52, "m")})
    lines = state.to_python()
    save = next(line for line in lines.splitlines() if line.startswith("# written by: "))
    words = shlex.split(save.removeprefix("# written by: "))
    assert command(*words[1:]).code == 0
    here = {}
    exec(lines.replace("print(analysis)", ""), here)
    assert here["analysis"].stance.contact_names == ("l_sole",)
    assert here["analysis"].stance.com[2] == pytest.approx(0.52, abs=1e-12)
    for words in (("stance.toml",), ("--stance", "stance.toml")):  # with its criteria and limits
        lines = State(words, {}).to_python()
        assert "file = StanceFile.read('stance.toml')" in lines
        assert "written by" not in lines


names = some.sampled_from(["com_x", "l_knee", "a joint's name", "l_sole:yaw"])
numbers = some.floats(-1e3, 1e3)
limits = some.sampled_from(["own", None, copsense.Limits(), copsense.Limits(friction=None)])
loads = some.sampled_from([
    copsense.Load("a", (0.1, -2.0, 1e3)),
    copsense.Load("b c", (0.0, 1.5, 0.0), (0.0, 0.0, 7.0), (0.1, 0.0, 0.2), "body"),
])  # fmt: skip


@settings(max_examples=25, deadline=None)
@given(
    some.dictionaries(names, some.builds(Setting, numbers, some.sampled_from(["m", "rad"]))),
    some.booleans(),
    some.lists(some.sampled_from(["minimum-torque", "stiffness:hip=2"]), unique=True),
    some.floats(1e-3, 1e3),
    limits,
    some.lists(loads, max_size=2),
)
def test_a_state_survives_json(coordinates, held, criteria, length, within, forces):
    words, loads = ("icub", "--sole", "a b"), tuple(forces)
    state = State(words, coordinates, held, tuple(criteria), length, within, loads=loads)
    again = State.from_json(state.to_json())
    assert again == state
    assert hash(again) == hash(state)
    assert again.to_command() == state.to_command()


@pytest.mark.parametrize(
    ("text", "error", "words"),
    [
        ("[1]", InvalidInputError, "a table"),
        ("{", InvalidInputError, "JSON"),
        ('{"robot": 1}', UnknownNameError, "robot"),
        ('{"coordinates": {"com_y": 3}}', InvalidInputError, "to_dict"),
        ('{"coordinates": {"com_y": [3, "deg"]}}', UnknownNameError, "deg"),
        ('{"criteria": "minimum-torque"}', InvalidInputError, "not a list"),
        ('{"length": -1}', InvalidInputError, "positive"),
        ('{"loads": [{"frames": "a"}]}', InvalidInputError, "to_dict"),
    ],
)
def test_what_is_no_state_is_rejected(text, error, words):
    with pytest.raises(error, match=words):
        State.from_json(text)


def test_limits_by_contact_have_no_command():
    with pytest.raises(InvalidInputError, match="stance file"):
        limits_text(copsense.Limits(normal_force={"l_sole": 3.0}))


def test_forces_carry_the_weight_and_margins_tell_inside_from_outside(model):
    for y in (0.0, 0.03, 0.06):
        view = model.view(State(("icub",), {"com_y": Setting(y, "m")}))
        for found in view.criteria:
            weight = model.stance.robot.weight
            np.testing.assert_allclose(found.forces.sum(axis=0), [0, 0, weight], atol=1e-8)
            for k, sole in enumerate(view.soles):
                inside = _inside(sole[:, :2], found.cop_world[k, :2])
                assert inside == (found.margin[k] > 0)
    assert any(found.margin.min() < 0 for found in view.criteria)


def _inside(corners, point):
    edges = np.roll(corners, -1, axis=0) - corners
    away = point - corners
    return bool(np.all(edges[:, 0] * away[:, 1] - edges[:, 1] * away[:, 0] > 0))


def test_out_of_reach_keeps_the_last_view_and_says_why(model):
    last = model.view(State(("icub",), {"com_y": Setting(0.02, "m")}))
    far = State(("icub",), {"com_y": Setting(0.6, "m")})
    view = model.view(far, 5, last)
    assert "no posture" in view.reason
    assert "CoM y = 0.6" in view.reason
    np.testing.assert_array_equal(view.q, last.q)
    assert view.revision == 5
    assert view.state == far
    assert "names no joints" in model.view(State(criteria=("weighted-torque:=3",))).reason
    with pytest.raises(CopsenseError):
        model.posture(far)


def test_the_curve_goes_through_the_margins_of_now(model):
    state = State(("icub",), {"com_y": Setting(0.03, "m")}, overlays=frozenset({"curve"}))
    view = model.add_curve(model.view(state))
    i = int(np.argmin(np.abs(view.curve_y - 0.03)))
    assert view.curve_y[i] == pytest.approx(0.03, abs=1e-12)
    now = [found.margin.min() for found in view.criteria]
    np.testing.assert_allclose(view.curve_margin[:, i], now, atol=1e-9)
    assert model.add_curve(model.view(state), lambda: True).curve_y is not None
    fresh = Model(model.stance)
    assert not len(fresh.add_curve(fresh.view(state), lambda: True).curve_y)  # it is stale


def test_regions_and_what_binds_first_come_in_stages(model):
    limits = copsense.Limits(friction=0.33)
    only = ("minimum-torque",)
    state = State(("icub",), criteria=only, limits=limits, overlays=frozenset({"regions"}))
    view = model.view(state)
    assert view.regions is None
    view = model.add_regions(view)
    assert {region.name for region in view.regions} == {"friction and soles", "minimum-torque"}
    view = model.add_binding(view)
    path = PathScan(LateralPath(model.stance), copsense.minimum_torque())
    met = path.travel(limits, 1).limits[0]
    assert any(
        f"minimum-torque, CoM to +y: {met.name} after {met.exact * 1e3:.1f}" in line
        for line in view.binding
    )


def test_sliders_end_where_the_robot_does(model):
    low, high = model.reach(model.start, "com_y")
    assert -0.2 < low < -0.03 < 0.03 < high < 0.2
    assert not model.view(model.start.named("com_y", high, "m")).notes
    beyond = model.view(model.start.named("com_y", high + 0.03, "m"))
    assert any("beyond its limit" in note for note in beyond.notes)


def test_views_own_what_they_hold(model):
    view = model.view(model.start)
    found = view["minimum-torque"]
    for array in (view.q, view.poses, view.soles[0], found.cop, found.torques):
        assert not array.flags.writeable
    assert len(view.rows) == 4
    assert math.isclose(sum(found.load_share), 1.0)
    assert "first, after" in view.verdict


def test_criteria_that_go_equally_far_are_said_to(model):
    view = model.view(model.start)
    wrench = view["minimum-wrench"]
    near, far = (replace(wrench, name=n, com_travel=wrench.com_travel * f) for n, f in (
        ("again", 1 + 1e-9), ("farther", 1.5)
    ))  # fmt: skip
    said = replace(view, criteria=(wrench, near, far)).verdict
    least = 1e3 * wrench.com_travel.min()
    assert said.split("; ")[1].startswith("minimum-wrench and again equally: ")
    assert said.endswith(f"first, after {least:.1f} mm")
    assert said.startswith("farther: ")
