"""What made the numbers, as plain data that can be compared and read by people."""

import json

import numpy as np
import pytest

import copsense
from copsense.errors import InvalidInputError
from copsense.provenance import differences, digest, model_digest, plain, worded
from copsense.simulation import Motors


def test_values_become_what_json_holds_and_keep_what_tells_them_apart(icub):
    values = [copsense.minimum_torque(), copsense.Limits(), *icub.contacts, Motors(0.01), 1, True]
    written = plain([*values, np.eye(2), np.inf, None])
    assert json.loads(json.dumps(written)) == written
    assert plain(1) == plain(1.0)
    assert plain(copsense.Limits())["is"] == "Limits"
    for value in (print, object()):
        with pytest.raises(InvalidInputError, match="cannot be written down"):
            plain({"inside": [value]})


def test_differences_say_where_and_rounding_is_none():
    one = {"a": [1.0, {"b": 2.0}], "c": "x", "d": None}
    assert differences(one, {"a": [1.0 + 1e-12, {"b": 2.0}], "c": "x"}) == []
    found = differences(one, {"a": [1.0, {"b": 3.0}], "c": "y", "d": None})
    assert [d.where for d in found] == ["a[1].b", "c"]
    assert worded(found) == 'a[1].b is 2 there, 3 here; c is "x" there, "y" here'
    assert worded(found * 4).endswith(", and 3 more")
    assert digest(one) != digest(found[0].asked)


def test_a_models_digest_is_that_of_its_numbers(icub, stance_of):
    assert model_digest(icub) == model_digest(copsense.load_stance("icub"))
    assert model_digest(icub) != model_digest(stance_of("talos"))
