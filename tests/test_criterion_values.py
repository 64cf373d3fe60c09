"""Criteria as values: equal by content, written as plain data, and frozen."""

import json
import pickle
import tomllib

import numpy as np
import pytest

import copsense
from copsense.criterion import Criterion, TorqueTerm, WrenchTerm
from copsense.errors import InvalidInputError, UnknownNameError

SIX = np.array([1.0, 1.0, 1.0, 4.0, 4.0, 4.0])


def every_kind():
    """A criterion of each kind, made again at each call."""
    wrench, torque = copsense.minimum_wrench(0.3), copsense.minimum_torque()
    matrix = np.diag(np.arange(1.0, 24.0))
    return [
        wrench,
        torque,
        copsense.minimum_torque(tie_break=wrench),
        copsense.weighted_torque({"l_knee": 2.0, "r_knee": np.float64(3)}),
        copsense.weighted_torque(np.arange(1.0, 24.0)),
        copsense.weighted_torque(matrix),
        copsense.weighted_torque("inverse inertia"),
        copsense.criterion.reference_wrench(np.arange(12.0).reshape(2, 6), 0.5),
        Criterion("by contact", (WrenchTerm({"l_sole": SIX, "r_sole": 2 * SIX}),)),
        copsense.mixed((wrench, 0.1), (torque, 1), tie_break=wrench, name="mix"),
    ]


def test_criteria_compare_and_hash_by_content():
    ones, others = every_kind(), every_kind()
    for i, one in enumerate(ones):
        for k, other in enumerate(others):
            assert (one == other) == (i == k)
            assert (hash(one) == hash(other)) == (i == k)
    assert len({*ones, *others}) == len(ones)
    assert ones[0] != ones[0].named("another")
    assert ones[0] != "minimum-wrench"
    assert copsense.weighted_torque([1, 2]) == copsense.weighted_torque(np.array([1.0, 2.0]))
    assert copsense.weighted_torque({"a": 1, "b": 2}) == copsense.weighted_torque({"b": 2, "a": 1})


@pytest.mark.parametrize("criterion", every_kind(), ids=lambda c: c.name)
def test_criteria_come_back_from_plain_data(criterion):
    data = criterion.to_dict()
    assert Criterion.from_dict(data) == criterion
    assert Criterion.from_dict(json.loads(json.dumps(data))) == criterion
    assert pickle.loads(pickle.dumps(criterion)) == criterion


def test_criteria_can_be_written_in_toml():
    text = """
        name = "mine"
        [[terms]]
        kind = "torque"
        weights = {l_knee = 2, r_knee = 3.0}
        [[terms]]
        kind = "wrench"
        weights = [1, 1, 1, 4, 4, 4]
        scale = 0.1
        [tie_break]
        name = "minimum-torque"
        terms = [{kind = "torque"}]
    """
    terms = (TorqueTerm({"l_knee": 2.0, "r_knee": 3.0}), WrenchTerm(SIX, scale=0.1))
    mine = Criterion("mine", terms, copsense.minimum_torque())
    assert Criterion.from_dict(tomllib.loads(text)) == mine


@pytest.mark.parametrize(
    ("data", "said"),
    [
        ("minimum-torque", "a name and a list of terms"),
        ({"name": "x"}, "a name and a list of terms"),
        ({"name": "x", "terms": ["torque"]}, "is not a term"),
        ({"name": "x", "terms": [{"kind": "wrench"}]}, "has no weights"),
        ({"name": "x", "terms": []}, "no term to minimise"),
    ],
)
def test_plain_data_that_is_not_a_criterion_says_what_is_wrong(data, said):
    with pytest.raises(InvalidInputError, match=said):
        Criterion.from_dict(data)


def test_unknown_keys_of_plain_data_list_the_valid_ones():
    with pytest.raises(UnknownNameError, match="Did you mean terms"):
        Criterion.from_dict({"term": [], "terms": []})
    with pytest.raises(UnknownNameError, match="Did you mean weights"):
        Criterion.from_dict({"name": "x", "terms": [{"kind": "torque", "weight": 1}]})
    with pytest.raises(UnknownNameError, match="Valid: torque, wrench"):
        Criterion.from_dict({"name": "x", "terms": [{"kind": "force"}]})


def test_a_criterion_is_its_own(icub):
    weights, reference = np.full(23, 2.0), np.zeros((2, 6))
    by_joint = {"l_knee": 1.0}
    criterion = copsense.weighted_torque(weights)
    mapped, near = copsense.weighted_torque(by_joint), WrenchTerm(SIX, reference)
    before = hash(criterion), hash(mapped), hash(near)
    weights[0], by_joint["l_knee"], reference[:] = 100.0, 5.0, 1.0
    assert (hash(criterion), hash(mapped), hash(near)) == before
    assert mapped == copsense.weighted_torque({"l_knee": 1.0})
    with pytest.raises(ValueError, match="read-only"):
        criterion.terms[0].weights[0] = 1.0
    with pytest.raises(TypeError):
        mapped.terms[0].weights["l_knee"] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        criterion.at(icub).torque[0, 0] = 1.0


def test_criteria_read_well():
    shown = [repr(criterion) for criterion in every_kind()]
    assert shown[1] == "Criterion('minimum-torque', TorqueTerm(1))"
    assert shown[5] == "Criterion('weighted-torque', TorqueTerm(<23 x 23 numbers>))"
    assert shown[3] == "Criterion('weighted-torque', TorqueTerm({'l_knee': 2, 'r_knee': 3}))"
    assert all(len(text) < 300 for text in shown)
