"""Limits as values: given by name, equal by content, not to be changed, written as plain data."""

import json
import pickle
from dataclasses import FrozenInstanceError, fields, replace

import numpy as np
import pytest

import copsense
from copsense import solve_equilibrium
from copsense.errors import CopsenseError, InvalidInputError, UnknownNameError
from copsense.limits import LIMIT_NAMES, NO_LIMITS, Limits, limit_rows

GIVEN = [
    Limits(),
    NO_LIMITS,
    Limits(normal_force=10, friction=1 / 3, friction_sides=4, torsion="cone", torque="model"),
    Limits(torque={"l_knee": 5, "r_knee": 6.5}, cop_margin=np.float64(0.01)),
]


def test_limits_are_given_by_name():
    with pytest.raises(TypeError):
        Limits(10.0, 0.5)


@pytest.mark.parametrize("limits", GIVEN)
def test_limits_are_equal_by_content(limits):
    for same in (
        replace(limits),
        pickle.loads(pickle.dumps(limits)),
        Limits.from_dict(json.loads(json.dumps(limits.to_dict()))),
    ):
        assert same == limits
        assert hash(same) == hash(limits)
    assert replace(limits, cop_margin=0.123) != limits
    assert len({*GIVEN, limits}) == len(GIVEN)


def test_limits_cannot_be_changed_afterwards():
    torque = {"l_knee": 5.0}
    limits = Limits(torque=torque)
    torque["l_knee"] = 1e9
    assert limits == Limits(torque={"l_knee": 5.0})
    with pytest.raises(TypeError):
        limits.torque["l_knee"] = 1e9
    with pytest.raises(FrozenInstanceError):
        limits.torque = None


def test_a_repr_names_every_limit():
    assert repr(Limits(normal_force=10, torsion=None)) == (
        "Limits(normal_force=10.0, friction='contact', friction_sides=8, cop_margin=0.0, "
        "torsion=None, torque=None)"
    )
    many = repr(Limits(torque={f"joint{i}": 1.0 for i in range(40)}))
    assert "torque={'joint0': 1, 'joint1': 1, 'joint2': 1, ... 40 in all}" in many


def test_a_table_of_limits_says_what_it_does_not_know():
    with pytest.raises(UnknownNameError, match="Did you mean cop_margin"):
        Limits.from_dict({"cop_margn": 0.01})
    for wrong in (None, [1.0], "model"):
        with pytest.raises(InvalidInputError, match=r"Limits.to_dict"):
            Limits.from_dict(wrong)


def test_rows_are_made_once_for_a_path(icub):
    moved = icub.at(icub.q)
    rows = limit_rows(icub, Limits(torque="model"))
    assert limit_rows(moved, Limits(torque="model")) is rows
    assert limit_rows(moved, Limits()) is not rows
    for array in (rows.matrix, rows.bound, rows.torque):
        assert not array.flags.writeable


def test_limits_of_one_contact_are_not_those_of_another(icub):
    """A hand may pull and have a friction of its own; contacts left out are not limited so."""
    hand = icub.with_contacts([*icub.contacts, copsense.Contact("l_hand", kind="point")])
    names = hand.contact_names
    limits = Limits(
        normal_force={names[0]: 10.0, "l_hand": -5.0},
        friction={names[1]: 0.4},
        cop_margin={names[0]: 0.01},
        torsion=None,
    )
    rows = limit_rows(hand, limits)
    owners = {
        kind: {names[k] for k, x in zip(rows.contacts, rows.kinds, strict=True) if x == kind}
        for kind in set(rows.kinds)
    }
    assert owners == {
        "normal force": {names[0], "l_hand"},
        "friction": {names[1]},
        "cop": {names[0]},
    }
    found = solve_equilibrium(hand, copsense.minimum_wrench(1.0), limits)
    assert found.wrenches[2, 2] >= -5.0 - 1e-9
    assert found.wrenches[0, 2] >= 10.0 - 1e-9
    assert Limits.from_dict(limits.to_dict()) == limits


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"normal_force": {"l_hand": np.nan}}, "l_hand"),
        ({"friction": {"l_sole": -0.1}}, "non-negative"),
        ({"cop_margin": {"l_sole": -0.1}}, "l_sole"),
    ],
)
def test_bad_limits_of_a_contact_name_it(given, said):
    with pytest.raises(InvalidInputError, match=said):
        Limits(**given)


def test_a_limit_of_an_unknown_contact_is_an_error(icub):
    with pytest.raises(UnknownNameError, match="l_sole"):
        limit_rows(icub, Limits(normal_force={"l_foot": 0.0}))


def test_no_field_is_forgotten(icub):
    """Whatever limits something counts as a limit, has a name in --limits and rejects nonsense."""
    nothing = {each.name: None for each in fields(Limits) if each.name != "friction_sides"}
    assert not Limits(**nothing).any
    assert set(LIMIT_NAMES.values()) == {each.name for each in fields(Limits)}
    for name in nothing:
        limits = Limits(**nothing | {name: 1e-3})
        assert limits.any, name
        assert limit_rows(icub, limits).all_names, name
        for wrong in (-1.0, float("nan"), True):
            with pytest.raises(CopsenseError):
                Limits(**nothing | {name: wrong})
