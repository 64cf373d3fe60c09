"""A criterion that leaves something undetermined does not silence the others."""

import numpy as np
import pytest

import copsense
from copsense import Contact, minimum_torque, minimum_wrench
from copsense.errors import UndeterminedWrenchError
from copsense.regions import com_regions, criterion_region
from copsense.statics import with_tie_break


@pytest.fixture(scope="module")
def heel_and_toe(icub):
    """Each foot of the iCub as two surfaces, which can push against each other."""
    twice = [
        Contact(c.frame, name=f"{c.name} {end}", offset=(x, 0.0, 0.0))
        for c in icub.contacts
        for end, x in (("heel", -0.02), ("toe", 0.05))
    ]
    return icub.with_contacts(twice)


def test_internal_forces_are_decided_by_a_tie_break_that_is_said(heel_and_toe):
    torque = minimum_torque()
    tied = with_tie_break(heel_and_toe, torque)
    assert tied == minimum_torque(tie_break=minimum_wrench(1.0))
    found = copsense.analyse(heel_and_toe)
    assert set(found.sensitivities) == {"minimum-wrench", "minimum-torque"}
    (note,) = [note for note in found.notes if "tie-break" in note]
    assert note.startswith("minimum-torque")
    expected = copsense.solve_equilibrium(heel_and_toe, tied)
    np.testing.assert_array_equal(found.equilibria["minimum-torque"].forces, expected.forces)


def test_its_region_within_limits_is_that_of_the_tied_criterion_and_says_so(heel_and_toe):
    torque, limits = minimum_torque(), copsense.Limits(friction=0.5)
    found = com_regions(heel_and_toe, [torque, minimum_wrench(1.0)], limits)
    tied = with_tie_break(heel_and_toe, torque)
    expected = criterion_region(heel_and_toe, tied, limits)
    np.testing.assert_array_equal(found.unclipped["minimum-torque"].polygon, expected.polygon)
    assert found.criteria == {"minimum-torque": tied, "minimum-wrench": minimum_wrench(1.0)}
    (note,) = found.notes
    assert note.startswith("minimum-torque")
    assert repr(found).endswith(f"note: {note}")


def test_a_criterion_that_determines_is_left_as_it_is(icub, heel_and_toe):
    torque, wrench = minimum_torque(), minimum_wrench(1.0)
    assert with_tie_break(icub, torque) is torque
    assert with_tie_break(heel_and_toe, wrench) is wrench


def test_what_a_tie_break_cannot_decide_is_left_out_and_said(icub):
    loose = copsense.weighted_torque({"l_elbow": 1.0}, name="elbow")
    found = copsense.analyse(icub, [loose, minimum_wrench(1.0)])
    assert list(found.sensitivities) == ["minimum-wrench"]
    assert any(note.startswith("elbow is left out: ") for note in found.notes)
    with pytest.raises(UndeterminedWrenchError):
        copsense.analyse(icub, [loose])
