"""A sway in simulation carries what the prediction in motion says, and not what statics say."""

import json

import numpy as np
import pytest
from support.commands import copsense as command

import copsense
from copsense.controllers import BalancingController, Hold, Ramp, Sine, lateral_reference
from copsense.simulation import MujocoSimulator, Scenario, rollout
from copsense.simulation.prediction import predict
from copsense.simulation.sway_comparison import compare_sway, sway_slopes
from copsense.simulation.timed_prediction import timed_note

TORQUE = copsense.minimum_torque()


@pytest.fixture(scope="module")
def swayed(icub):
    """One period of 12 mm at 0.5 Hz, by a controller that knows the posture's acceleration."""
    reference = lateral_reference(icub, Sine(0.012, 0.5))
    controller = BalancingController(icub, TORQUE, feedforward=True)
    recording = rollout(MujocoSimulator(icub), controller, Scenario(2.0, reference), until="fall")
    return predict(reference, TORQUE).attach(recording)


def test_load_transfer_in_motion_is_measured_where_statics_are_far_off(swayed):
    for contact in swayed.labels("contact"):
        load, cop = (sway_slopes(swayed)[contact][key] for key in ("load", "cop_y"))
        assert load["measured"] == pytest.approx(load["in motion"], rel=2e-3)
        assert cop["measured"] == pytest.approx(cop["in motion"], rel=2e-3)
        # 1 + w^2 h_X / g with the levers of load and CoP, 0.741 and 0.553 m.
        assert load["measured"] / load["at rest"] == pytest.approx(1.746, abs=0.01)
        assert cop["measured"] / cop["at rest"] == pytest.approx(1.556, abs=0.03)


def test_a_recording_says_both_predictions(swayed):
    data = swayed.to_dict()
    assert data["sway"]["slope"]["l_sole"] == sway_slopes(swayed)["l_sole"]
    ranges = compare_sway(swayed)["l_sole"]["load"]
    assert ranges["in motion"][1] - ranges["in motion"][0] > 1.5 * (
        ranges["at rest"][1] - ranges["at rest"][0]
    )
    assert data["static_frequencies"]["load of l_sole"] == pytest.approx(0.129, abs=6e-4)
    json.dumps(data)


def test_only_a_sine_has_a_prediction_in_motion(icub):
    still_reference = lateral_reference(icub, Hold())
    still = predict(still_reference, TORQUE)
    assert still.in_motion is None
    assert timed_note(still_reference) == ""
    assert "Ramp" in timed_note(lateral_reference(icub, Ramp(0.004)))


def test_the_prediction_in_motion_is_at_rest_what_statics_say_when_slow(icub):
    found = predict(lateral_reference(icub, Sine(0.01, 1e-3)), TORQUE)
    inside = np.abs(found.values) <= 0.01
    assert inside.sum() > 5
    np.testing.assert_allclose(found.in_motion.cops[inside], found.cops[inside], atol=1e-7)
    np.testing.assert_allclose(found.in_motion.loads[inside], found.loads[inside], atol=1e-3)


def test_a_ramp_is_predicted_at_rest_and_says_so():
    run = ("balance", "solo12", "--reference", "ramp:0.001", "--duration", 0.02, "--json")
    answer = command(*run)
    assert not answer.json["sway"].get("slope")
    assert "note: a Ramp has no prediction in motion" in answer.err


def test_feedforward_is_the_built_in_controllers():
    run = ("balance", "solo12", "--controller", "mine:Own", "--feedforward")
    assert "--feedforward belongs to the built-in controller" in command(*run).error


def test_the_command_says_the_slopes_of_a_sway():
    run = ("balance", "solo12", "--reference", "sine:0.0005:3", "--duration", 0.36)
    said = command(*run).out
    assert "load of FL_FOOT per CoM y [N/m]: measured" in said
    assert "CoP y of" not in said  # a point's stays
