"""balance: the command's run in one call."""

import numpy as np
import pytest
from support.commands import copsense as command

import copsense
from copsense.comparison import (
    Conditions,
    ControllerChoice,
    PostureChoice,
    Rest,
    RobotChoice,
    make_plan,
)
from copsense.comparison.case_runner import CaseRunner
from copsense.controllers import Hold, Ramp, Sine, lateral_reference
from copsense.errors import InvalidInputError
from copsense.simulation import FrictionChange, Push, Scenario
from copsense.simulation.balance_run import natural_duration
from copsense.simulation.prediction import predict


def test_one_call_runs_what_the_command_runs(stance_of):
    told = command(
        "balance", "solo12", "--duration", 0.1, "--criterion", "minimum-wrench", "--json"
    )
    scenario = Scenario(0.1, Hold(), name="hold")
    found = copsense.balance(stance_of("solo12"), copsense.minimum_wrench(1.0), scenario)
    assert told.json["controller"] == found.attrs["controller"] == "minimum-wrench"
    assert told.json["com_error_rms"] == pytest.approx(found.tracking_error, rel=1e-12)
    assert "static_excursion" in found.attrs


@pytest.mark.parametrize(
    ("reference", "seconds"),
    [(Hold(), 2.0), (Sine(0.01, 0.5), 2.0), (Ramp(0.02, 0.01), Ramp(0.02, 0.01).duration + 1.0)],
)
def test_a_reference_lasts_as_long_as_it_naturally_does(reference, seconds):
    assert natural_duration(reference) == pytest.approx(seconds)


def test_a_controller_of_one_s_own_is_predicted_by_the_criterion_it_is_given(stance_of):
    stance = stance_of("solo12")

    def limp(observation):
        return np.zeros(12)

    free = copsense.balance(stance, reference=Scenario(0.05), controller=limp)
    assert "static_excursion" not in free.attrs
    named = copsense.balance(stance, copsense.minimum_wrench(1.0), Scenario(0.05), controller=limp)
    assert "static_excursion" in named.attrs
    with pytest.raises(InvalidInputError, match="by which your controller is to be predicted"):
        copsense.balance(stance, controller=limp, limits=copsense.Limits())


def test_a_scenario_that_does_not_fit_the_robot_is_rejected_before_it_runs(stance_of):
    scenario = Scenario(0.1, pushes=(Push((0.0, 1.0, 0.0), start=0.0, frame="wing"),))
    with pytest.raises(copsense.CopsenseError, match="wing"):
        copsense.balance(stance_of("solo12"), copsense.minimum_wrench(1.0), scenario)


def test_a_slip_is_predicted_on_the_ground_of_the_scenario(stance_of):
    stance, criterion = stance_of("go2"), copsense.minimum_torque()
    assert all(contact.friction is not None for contact in stance.contacts)
    reference = lateral_reference(stance, Ramp(0.1))
    first = stance.contact_names[0]
    found = {}
    for name, changes in {
        "own": (),
        "later": (FrictionChange(0.1, 0.01),),
        "slippery": (FrictionChange(0.1),),
        "under one": (FrictionChange(0.1, contact=first),),
    }.items():
        scenario = Scenario(0.02, reference, friction=changes)
        found[name] = copsense.balance(stance, criterion, scenario).attrs["static_excursion"]
        conditions = Conditions(name, {"friction": changes})
        (case,) = make_plan(
            [RobotChoice("go2")], [PostureChoice()], [ControllerChoice()], [Rest()], [conditions]
        )
        beside, _ = CaseRunner(case).statics(reference)
        assert beside.excursion == found[name]
    assert found["own"] == found["later"] > found["under one"] >= found["slippery"]
    coefficients = dict.fromkeys(stance.contact_names, 0.1)
    assert found["slippery"] == predict(reference, criterion, None, coefficients).excursion
