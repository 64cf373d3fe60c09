"""The analysis of one posture in one call: what the command prints, as a result."""

import inspect
import json
import math

import numpy as np
import pytest
from support.commands import copsense as command

import copsense
from copsense.analysis.verdicts import verdict
from copsense.errors import InvalidInputError
from copsense.json_data import json_data

LIMITS = copsense.Limits(friction=0.33, torque="model")


@pytest.fixture(scope="module")
def analysis(icub):
    return copsense.analyse(icub, along="l_hip_roll")


@pytest.fixture(scope="module")
def limited(icub):
    return copsense.analyse(icub, [copsense.minimum_torque()], LIMITS)


def test_the_command_prints_what_the_function_returns(analysis):
    answer = command("analyse", "icub", "--along", "l_hip_roll", "--json").json
    assert answer == json.loads(json.dumps(analysis.to_dict(), allow_nan=False))


def test_the_command_moves_holds_and_limits_as_the_function_does(icub):
    told = command(
        "analyse", "icub", "--com-y", "20mm", "--joint", "l_elbow=30", "--limits",
        "friction=0.33,torque=model", "--criterion", "minimum-wrench", "--check", "--json",
    ).json  # fmt: skip
    same = copsense.analyse(
        icub,
        [copsense.minimum_wrench(1.0)],
        LIMITS,
        com_y=0.02,
        joints={"l_elbow": math.radians(30)},
        check=True,
    )
    assert told == json.loads(json.dumps(same.to_dict(), allow_nan=False))
    assert told["checked"]
    assert same.stance.robot.joint_position(same.stance.q, "l_elbow") == pytest.approx(
        math.radians(30)
    )


def test_it_holds_equilibria_sensitivities_and_a_verdict(analysis, icub):
    assert list(analysis.sensitivities) == ["minimum-wrench", "minimum-torque"]
    equilibrium = analysis.equilibria["minimum-torque"]
    assert equilibrium.wrenches[:, 2].sum() == pytest.approx(icub.robot.weight)
    assert analysis.verdict.startswith("minimum-torque keeps the feet planted longest")
    assert analysis.limits is None
    assert analysis.limit_analyses == {}


def test_every_number_is_the_sensitivity_s_own(analysis):
    found = analysis.sensitivities["minimum-torque"]
    row = analysis.to_dict()["criteria"]["minimum-torque"]["contacts"]["r_sole"]
    assert row["com_travel"] == found.com_travel[1]
    assert row["tipping_edge"] == found.tipping_edge[1]
    assert row["cop_slope"] == found.along(analysis.tangent)[1].tolist()
    assert (
        row["cop_per_l_hip_roll"] == found.along_joint(analysis.tangent, "l_hip_roll")[1].tolist()
    )


def test_the_tipping_edge_is_an_edge_of_the_sole_and_the_margin_s_own_is_named(analysis):
    contacts = analysis.to_dict()["criteria"]["minimum-wrench"]["contacts"]
    for contact in analysis.stance.contacts:
        row = contacts[contact.name]
        assert 0 <= row["tipping_edge"] < len(contact.polygon)
        assert 0 <= row["margin_edge"] < len(contact.polygon)
    # In the middle each foot tips over the edge that is nearest.
    assert contacts["l_sole"]["tipping_edge"] == contacts["l_sole"]["margin_edge"]
    assert "(right)" in contacts["l_sole"]["margin_side"]


def test_limits_bring_active_limits_margins_and_travels(limited):
    analysis = limited.limit_analyses["minimum-torque"]
    assert analysis.active == ()
    assert not analysis.pressed
    assert {m.kind for m in analysis.margins} >= {"cop", "friction", "torque"}
    assert analysis.travels["+y"].first.exact == pytest.approx(0.0459, abs=1e-4)
    row = limited.to_dict()["criteria"]["minimum-torque"]
    assert set(row["limit_travel"]) == set(row["next_change"]) == {"+y", "-y"}
    assert "is the last to meet a limit" in limited.verdict
    change = limited.sensitivities["minimum-torque"].nearest_active_set_change()
    assert analysis.nearest_change.travel == change.travel
    assert row["nearest_change"] == {
        "name": change.name,
        "kind": "cop",
        "binds": True,
        "travel": change.travel,
    }
    assert analysis.nearest_change.travel < analysis.travels["+y"].first.first_order
    line = f"CoM any way: {change.travel * 1e3:.1f} mm until {change.name} binds (first order)"
    assert line in str(limited)


def test_where_the_tie_break_alone_presses_the_changes_are_explained(icub):
    level = copsense.minimum_tangential(copsense.minimum_wrench(1.0), name="level")
    limits = copsense.Limits(cop_margin=0.025)
    found = copsense.analyse(icub, [level], limits, com_y=0.03)
    analysis = found.limit_analyses["level"]
    assert analysis.nearest_change is None
    assert not analysis.next_changes
    assert found.to_dict()["criteria"]["level"]["nearest_change"] is None
    (note,) = [note for note in found.notes if note.startswith("level: the next change of its")]
    assert "the tie-break alone presses on l_sole" in note
    assert "Give the criterion a small share" in note
    assert "any way" not in str(found)


def test_a_change_out_of_reach_is_not_printed(stance_of):
    criteria = [copsense.minimum_wrench(1.0), copsense.minimum_torque()]
    found = copsense.analyse(stance_of("four_bar"), criteria, copsense.Limits(friction=0.4))
    far = found.limit_analyses["minimum-wrench"].nearest_change
    assert 10 < far.travel < np.inf
    assert str(found).count("any way") == 1
    assert "CoM any way: 140.0 mm until l_sole: slips to +y binds" in str(found)


def test_printed_it_is_the_command_s_table(analysis, limited):
    lines = command("analyse", "icub", "--along", "l_hip_roll").out
    assert lines.rstrip("\n") == str(analysis)
    assert repr(analysis).startswith(str(analysis))
    assert "note: contacts 'l_sole' and 'r_sole' lie 10.5 mm over" in repr(analysis)
    assert "CoM to +y:   45.9 mm to r_sole" in str(limited)
    assert len(repr(analysis)) < 3000


def test_a_notebook_shows_a_table_with_the_names_escaped(analysis, icub):
    page = analysis._repr_html_()
    assert page.count("<table>") == 2
    assert analysis.verdict in page
    odd = copsense.analyse(icub, [copsense.minimum_torque(name="a<b>")])
    assert "a&lt;b&gt;" in odd._repr_html_()


def test_the_table_has_a_row_per_criterion_and_contact(analysis):
    frame = analysis.to_pandas()
    assert list(frame["criterion"]) == ["minimum-wrench"] * 2 + ["minimum-torque"] * 2
    assert frame["load_share"].sum() == pytest.approx(2.0)
    found = analysis.sensitivities["minimum-torque"]
    np.testing.assert_array_equal(frame[["cop_x", "cop_y"]].values[2:], found.cop)
    np.testing.assert_array_equal(frame["cop_gain_y_y"].values[2:], found.com_gain[:, 1, 1])


def test_the_dataset_is_the_table_over_criterion_and_contact(analysis, tmp_path):
    found, frame = analysis.to_xarray(), analysis.to_pandas()
    assert dict(found.sizes) == {"criterion": 2, "contact": 2}
    for _, row in frame.iterrows():
        here = found.sel(criterion=row["criterion"], contact=row["contact"])
        assert here["com_travel"].item() == row["com_travel"]
        assert here["margin_side"].item() == row["margin_side"]
    found.to_netcdf(tmp_path / "analysis.nc")


def test_it_draws_the_stance(analysis):
    titles = [axes.get_title(loc="left").split(":")[0] for axes in analysis.plot().axes]
    assert titles == ["from behind", "from its right", *analysis.sensitivities]


def test_a_point_contact_has_no_margin_and_no_tipping_edge(stance_of):
    row = copsense.analyse(stance_of("solo12"), [copsense.minimum_wrench(1.0)]).to_dict()
    contact = row["criteria"]["minimum-wrench"]["contacts"]["FL_FOOT"]
    assert "margin" not in contact
    assert contact["tipping_edge"] is None


def test_a_policy_is_analysed_under_its_function_s_name(icub):
    def half_and_half(q):
        here = icub.at(q)
        base = here.jacobian[:, :6]
        return here.unstack(np.linalg.lstsq(base.T, here.gravity[:6])[0])

    found = copsense.analyse(icub, [half_and_half])
    assert "half_and_half: torque norm" in str(found)


@pytest.mark.parametrize("criteria", [[], [copsense.minimum_torque()] * 2])
def test_criteria_without_distinct_names_are_rejected(icub, criteria):
    with pytest.raises(InvalidInputError, match="distinct names"):
        copsense.analyse(icub, criteria)


def test_what_is_not_a_stance_or_a_list_of_criteria_is_rejected(icub):
    unchecked = inspect.unwrap(copsense.analyse)  # the suite's own check of types comes first
    with pytest.raises(InvalidInputError, match="load_stance"):
        unchecked("icub")
    with pytest.raises(InvalidInputError, match="Give a list"):
        unchecked(icub, copsense.minimum_torque())


OFF = {"normal_force": None, "friction": None, "cop_margin": None, "torsion": None}


@pytest.mark.parametrize(
    "limits",
    [
        copsense.Limits(**OFF, torque={}),
        copsense.Limits(**OFF, torque="model"),  # placeholders, all of them
        copsense.Limits(**OFF | {"torsion": "contact"}),  # its contacts have no coefficient
    ],
    ids=["no joint", "placeholders", "no coefficient"],
)
def test_limits_that_limit_nothing_are_met_nowhere_and_a_note_says_so(stance_of, limits):
    criteria = [copsense.minimum_wrench(1.0)]
    found = copsense.analyse(stance_of("four_bar"), criteria, limits)
    assert limits.any
    assert found.verdict == "minimum-wrench meets no limit within reach."
    assert found.verdict in repr(found)
    assert found.verdict in found._repr_html_()
    assert json.loads(json.dumps(found.to_dict(), allow_nan=False))["verdict"] == found.verdict
    assert any("limit nothing here" in note for note in found.notes)
    free = copsense.analyse(stance_of("four_bar"), criteria)
    assert not any("limit nothing" in note for note in free.notes)
    (ours,), (own,) = found.equilibria.values(), free.equilibria.values()
    np.testing.assert_allclose(ours.forces, own.forces, atol=1e-9)


def test_the_command_and_its_regions_take_limits_that_limit_nothing(tmp_path):
    off = "friction=off,cop-margin=off,normal-force=off"
    answer = command(
        "analyse", "four_bar", "--limits", off, "--regions", tmp_path / "r.png",
        "--criterion", "minimum-wrench",
    )  # fmt: skip
    assert answer.code == 0, answer.err
    assert "minimum-wrench meets no limit within reach." in answer.out
    assert "without end" in answer.out
    assert "limit nothing here" in answer.err


def test_json_data_is_plain_and_finite():
    assert json_data({"a": np.array([1.0, np.inf]), "b": (np.float64(2.0), "x", True)}) == {
        "a": [1.0, None],
        "b": [2.0, "x", True],
    }


def test_criteria_that_go_equally_far_are_said_to(icub):
    wrench = copsense.minimum_wrench(1.0)
    alike = [wrench, wrench.named("again")]
    assert copsense.analyse(icub, alike).verdict.startswith(
        "minimum-wrench and again keep the feet planted equally long: to first order the CoM may"
    )


def test_a_travel_that_is_none_is_words():
    rows = {
        name: {"contacts": {"foot": {"com_travel": tips, "unloading_travel": 0.3, "margin": 0.0}}}
        for name, tips in {"a": 0.02, "b": -0.003, "c": 0.01}.items()
    }
    contacts = [{"name": "foot", "kind": "surface"}]
    assert verdict({"criteria": rows, "contacts": contacts, "com_span": 1.0}) == (
        "a keeps the feet planted longest: to first order the CoM may move 20.0 mm before foot "
        "tips (b: foot tips already, c 10.0 mm)."
    )


@pytest.mark.parametrize(
    ("travels", "said"),
    [
        ((0.02, 0.02 * (1 + 1e-9), 0.01), "a and b meet their first limit equally late: the CoM "),
        ((0.02, 0.0201, 0.01), "b is the last to meet a limit: the CoM may move 20.1 mm until x "),
        ((None, None, 0.01), "a and b meet no limit within reach."),
    ],
)
def test_the_same_holds_within_limits(travels, said):
    rows = {
        name: {"limit_travel": {"+y": [{"exact": travel, "name": "x"}]}}
        for name, travel in zip("abc", travels, strict=True)
    }
    assert verdict({"criteria": rows}).startswith(said)
