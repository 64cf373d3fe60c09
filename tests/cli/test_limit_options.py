"""``--limits`` that cannot be read or met."""

import pytest
from support.commands import copsense


@pytest.mark.parametrize(
    ("limits", "said"),
    [
        ("frction=1", "Did you mean friction"),
        ("friction=lots", "Write, say, friction=0.33 or friction=off."),
        ("torque=lots", "torque=model or torque=off"),
        ("cop-margin=-1", "non-negative"),
        ("cop-margin=1", "sole"),
        ("sides=2", "3 or more"),
        ("off", "Leave --limits out"),
        ("sides=off", "Write a whole number from 3, such as sides=8."),
        ("sides=2.5", "Write a whole number from 3, such as sides=8."),
        ("friction=0.3,friction=0.4", "given twice"),
        ("torsion=cone,friction=off", "wrench cone"),
    ],
)
def test_bad_limits_are_one_error(limits, said):
    assert said in copsense("analyse", "icub", "--limits", limits).error
