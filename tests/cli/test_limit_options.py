"""``--limits`` that cannot be read or met."""

import pytest
from support.commands import copsense


@pytest.mark.parametrize(
    ("limits", "said"),
    [
        ("frction=1", "Did you mean friction"),
        ("friction=lots", "is not a number"),
        ("cop-margin=-1", "non-negative"),
        ("cop-margin=1", "sole"),
        ("sides=2", "3 or more"),
        ("off", "Leave --limits out"),
        ("sides=off", "not a number"),
        ("friction=0.3,friction=0.4", "given twice"),
        ("torsion=cone,friction=off", "wrench cone"),
    ],
)
def test_bad_limits_are_one_error(limits, said):
    assert said in copsense("analyse", "icub", "--limits", limits).error
