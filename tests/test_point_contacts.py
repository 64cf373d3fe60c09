"""A point contact has no sole, whatever polygon it was given: no margin and no edge anywhere."""

from dataclasses import replace

import numpy as np
import pytest

import copsense
from copsense.batch import evaluate_batch
from copsense.limits import Limits, limit_rows
from copsense.margins import limit_margins

SOLE = copsense.rectangle((-0.03, 0.04), (-0.02, 0.02))
TORQUE = copsense.minimum_torque(tie_break=copsense.minimum_wrench(1.0))


@pytest.fixture(scope="module")
def shod(stance_of):
    """A quadruped on points that carry a polygon all the same."""
    stance = stance_of("solo12")
    assert {c.kind for c in stance.contacts} == {"point"}
    return stance.with_contacts([replace(c, polygon=SOLE) for c in stance.contacts])


def test_a_contact_has_a_sole_unless_it_is_a_point(shod):
    for contact in shod.contacts:
        assert contact.sole is None
        assert len(replace(contact, kind="surface").sole) == 4
        assert replace(contact, kind="surface", polygon=None).sole is None


def test_no_sensitivity_goes_to_an_edge_of_a_point(shod):
    found = copsense.cop_sensitivity(shod, TORQUE)
    assert np.all(np.isinf(found.com_travel))
    assert np.all(found.tipping_edge == -1)


def test_no_limit_and_no_margin_is_of_a_points_edge(shod):
    assert "cop" not in limit_rows(shod, Limits()).kinds
    equilibrium = copsense.solve_equilibrium(shod, TORQUE)
    assert "cop" not in {m.kind for m in limit_margins(equilibrium, Limits())}


def test_no_sweep_or_batch_has_a_margin_of_a_point(shod):
    path = copsense.path_through(shod, np.array([shod.q, shod.q]))
    swept = copsense.sweep(path, [TORQUE])
    assert np.all(np.isinf(swept["margin"]))
    assert np.all(swept["margin_side"] == "")
    assert "sole_polygon" not in swept
    found = evaluate_batch(shod, shod.q[None], [copsense.minimum_wrench(1.0)], gains=False)
    assert np.all(np.isinf(found.margin))


def test_no_analysis_has_a_margin_of_a_point(shod):
    found = copsense.analyse(shod, [TORQUE])
    assert all("margin" not in row for row in contact_rows(found.to_dict()))


def contact_rows(data):
    """The rows of every contact in an analysis as plain data."""
    return [row for c in data["criteria"].values() for row in c["contacts"].values()]
