"""Scores of the benchmark: rows, and what they say together."""

import numpy as np
import pandas as pd
import pytest
from standing import C1, icub

import copsense
from copsense.benchmark import agreement, score_impulse, score_lean, score_table


def narrow():
    """The iCub on soles so narrow that it soon tips."""
    contacts = [
        copsense.Contact(f"{side}_sole", polygon=copsense.rectangle((-0.05, 0.1), (-0.01, 0.01)))
        for side in "lr"
    ]
    return copsense.load_stance("icub", contacts=contacts)


def test_a_lean_is_a_row_beside_its_prediction():
    score = score_lean(narrow(), C1, 0.015, posture="narrow", speed=0.01)
    assert score.excursion == pytest.approx(score.predicted, abs=1.5e-3)
    assert score.contact == score.predicted_contact == "r_sole"
    assert "tipped" in score.reason
    row = score_table([score]).iloc[0]
    assert row["posture"] == "narrow"


def test_a_lean_that_fails_is_a_row_with_its_reason():
    bare = icub().with_contacts([copsense.Contact("l_sole"), copsense.Contact("r_sole")])
    score = score_lean(bare, C1, 0.01)
    assert np.isnan(score.excursion)
    assert "no sole" in score.reason


def test_the_first_tip_impulse_has_its_resolution():
    score = score_impulse(narrow(), C1, largest=8.0, resolution=1.0)
    assert score.resolution <= 1.0
    assert 0 < score.impulse < 8.0
    assert score.impulse - score.resolution < 1.5 * score.predicted
    assert score.contact
    none = score_impulse(narrow(), C1, largest=0.01)
    assert np.isnan(none.impulse)


def test_agreement_is_that_of_numbers_made_up():
    predicted = np.array([0.03, 0.04, 0.05, 0.06, np.inf])
    table = pd.DataFrame({"predicted": predicted, "excursion": predicted + 1e-3})
    found = agreement(table)
    assert found["cases"] == 4
    assert found["mean_error"] == pytest.approx(1e-3)
    assert found["correlation"] == pytest.approx(1.0)
    assert found["low"] <= found["correlation"] <= found["high"]
    assert np.isnan(agreement(table.iloc[:2])["correlation"])
