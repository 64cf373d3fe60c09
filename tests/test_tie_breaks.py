"""Every analysis decides by one tie-break what contacts exert against each other, and says so."""

import json

import numpy as np
import pytest
from support.commands import copsense as command
from support.walkers import BIPED, NO_ANKLE_ROLL, bent, walker

import copsense
from copsense import Contact, Limits, minimum_torque, minimum_wrench
from copsense.design import Family, design_criterion
from copsense.errors import InvalidInputError
from copsense.pushes import push_limits
from copsense.statics import tie_break_note, with_tie_breaks

TIED = minimum_torque(tie_break=minimum_wrench(1.0))
NOTE = tie_break_note("minimum-torque")
CRITERIA = [minimum_wrench(1.0), minimum_torque()]


def weighed(stance, weight):
    weights = dict.fromkeys(stance.robot.torque_names, 1.0) | {"l_knee": weight}
    return copsense.weighted_torque(weights, name="one")


@pytest.fixture(scope="module")
def heel_and_toe(icub):
    """Each foot of the iCub as two surfaces, which can push against each other."""
    twice = [
        Contact(c.frame, name=f"{c.name} {end}", offset=(x, 0.0, 0.0), polygon=c.polygon)
        for c in icub.contacts
        for end, x in (("heel", -0.02), ("toe", 0.05))
    ]
    return icub.with_contacts(twice)


def test_only_what_needs_a_tie_break_gets_one(icub, heel_and_toe):
    named = {c.name: c for c in CRITERIA}
    assert with_tie_breaks([icub], named) == (named, ())
    found, notes = with_tie_breaks([icub, heel_and_toe], named)
    assert found == {"minimum-wrench": minimum_wrench(1.0), "minimum-torque": TIED}
    assert notes == (NOTE,)


def test_a_sweep_is_that_of_the_tied_criterion_and_says_so(heel_and_toe):
    path = copsense.lateral_sweep(heel_and_toe, -0.02, 0.02, 3)
    found = copsense.sweep(path, CRITERIA)
    expected = copsense.sweep(path, [minimum_wrench(1.0), TIED])
    assert found.notes[-1] == NOTE
    assert not found.failed_rows
    assert found.attrs["criteria"] == expected.attrs["criteria"]
    np.testing.assert_array_equal(found["wrench"], expected["wrench"])
    np.testing.assert_array_equal(found["cop_sensitivity"], expected["cop_sensitivity"])
    assert NOTE not in expected.notes


def test_pushes_are_those_of_the_tied_criterion(heel_and_toe):
    found = push_limits(heel_and_toe, None, CRITERIA)
    expected = push_limits(heel_and_toe, "root_link", [minimum_wrench(1.0), TIED])
    assert found.frame == "root_link"
    assert found.notes[-1] == NOTE
    for one, other in zip(found.regions, expected.regions, strict=True):
        np.testing.assert_allclose(one.polygon, other.polygon, atol=1e-9)


def test_a_design_ties_its_baseline_and_its_family(heel_and_toe):
    path = copsense.lateral_sweep(heel_and_toe, -0.02, 0.02, 5)
    family = Family("one", ("weight",), ((0.5, 2.0),), lambda w: weighed(heel_and_toe, w[0]))
    found = design_criterion(path, Limits(), family, grid=2)
    assert found.notes[-1] == NOTE
    assert found.criterion.tie_break == minimum_wrench(1.0)
    assert np.isfinite([score.torque_norm for score in found.baselines]).all()


def test_legs_without_ankle_roll_go_through_the_commands(tmp_path):
    robot = tmp_path / "robot.urdf"
    robot.write_text(walker(NO_ANKLE_ROLL))
    line = [str(robot), "--contact-at", "sole"]
    line += [word for frame in BIPED for word in ("--contact", frame)]
    line += [
        word
        for joint, angle in bent().items()
        for word in ("--posture", f"{joint}={np.degrees(angle)}")
    ]
    stance = copsense.load_stance(str(robot), contacts=BIPED, contact_at="sole", posture=bent())
    swept = command("sweep", *line, "--com-x=-5mm:5mm:3", "--json")
    assert swept.code == 0, swept.err
    assert NOTE in json.loads(swept.out)["notes"]
    assert f"note: {NOTE}" in swept.err
    pushed = command("push", *line, "--json")
    answer = json.loads(pushed.out)
    assert answer["frame"] == stance.robot.base_frame == "trunk"
    assert NOTE in answer["notes"]
    store = tmp_path / "map.zarr"
    mapped = command("map", *line, "--over", "com_x=-5mm:5mm:3", "--output", str(store), "--json")
    assert mapped.code == 0, mapped.err
    assert NOTE in json.loads(mapped.out)["notes"]


def test_a_com_that_the_contacts_hold_is_no_coordinate_of_a_sweep():
    stance = copsense.load_stance(
        walker(NO_ANKLE_ROLL), contacts=BIPED, contact_at="sole", posture=bent()
    )
    with pytest.raises(InvalidInputError, match="hold the CoM's y fast") as caught:
        copsense.lateral_sweep(stance, -0.01, 0.01, 3)
    assert "none about x (roll)" in str(caught.value)
    assert "Move CoM x or CoM z or a joint" in str(caught.value)
