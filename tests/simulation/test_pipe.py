"""A controller in another process is as good as one in this one, and its end is told."""

import sys
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from support.standing import C2, icub, simulator

import copsense
from copsense.controllers import Observation, Ramp, lateral_reference
from copsense.errors import ControllerError
from copsense.simulation import Scenario, rollout

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
sys.path.insert(0, str(BENCHMARKS))

import peers  # noqa: E402
from peers_hold import hold  # noqa: E402
from peers_pipe import PipeController, PipeError  # noqa: E402

CHILD = [sys.executable, str(BENCHMARKS / "peers_hold.py")]
REFERENCE = Ramp(0.01, 0.05)


def setup(**options):
    stance = icub()
    return {
        "joints": list(stance.robot.joint_names),
        "mass": stance.robot.mass,
        "com": stance.com.tolist(),
        "contacts": list(stance.contact_names),
        "torques": copsense.solve_equilibrium(stance, C2).torques.tolist(),
    } | options


@pytest.fixture
def piped():
    """Starts children, and ends them."""
    started = []

    def start(**options):
        started.append(PipeController(CHILD, setup(**options), name="hold", patience=10.0))
        return started[-1]

    yield start
    for controller in started:
        controller.close()
        assert controller.process.poll() is not None


def beside(observation):
    """The child's controller in this process."""
    torques = np.array(setup()["torques"])
    return hold(observation.q, observation.v, observation.target.posture, torques)


def test_a_piped_controller_moves_the_robot_as_the_same_law_in_process(piped):
    scenario = Scenario(0.2, REFERENCE)
    here = rollout(simulator(), beside, scenario)
    assert here.attrs["end_kind"] == "completed"
    for order in (False, True):
        controller = piped(reversed=order)
        there = rollout(simulator(), controller, scenario)
        assert there.attrs["controller"] == "hold"
        assert len(controller.seconds) == 200
        for what in ("configuration", "torque", "com", "cop", "wrench"):
            assert np.array_equal(here[what], there[what], equal_nan=True), what
        assert np.all(np.isnan(there["wrench_command"]))


def test_many_states_are_answered_and_timed_in_one_go(piped):
    stance = icub()
    reference = lateral_reference(stance, REFERENCE)
    v, no = np.zeros(stance.robot.model.nv), np.zeros((2, 6))
    seen = [Observation(t, stance.q, v, reference.at(t), no) for t in (0.0, 0.1, 0.2)]
    assert np.array_equal(piped().times(seen), np.tile([3e-6, 2e-6, 1e-6], (3, 1)))


@pytest.mark.parametrize(
    ("options", "says"),
    [({"dies": 0.05}, "it ended (exit status 7)"), ({"raises": 0.05}, "out of ideas")],
)
def test_a_child_that_ends_leaves_the_record(piped, options, says):
    recording = rollout(simulator(), piped(**options), Scenario(0.2, REFERENCE))
    assert recording.attrs["end_kind"] == "controller"
    assert recording.attrs["end_time"] == pytest.approx(0.05)
    assert "'hold' at 0.050 s" in recording.attrs["end_reason"]
    assert says in recording.attrs["end_reason"]
    assert recording.sizes["time"] == 10
    assert np.all(np.isfinite(recording["torque"]))


def test_a_child_that_ends_at_once_is_an_error(piped):
    with pytest.raises(ControllerError, match="exit status 7"):
        rollout(simulator(), piped(dies=0.0), Scenario(0.2, REFERENCE))


def test_a_silent_child_is_not_waited_for_without_end():
    sleeper = [sys.executable, "-c", "import time; time.sleep(60)"]
    with pytest.raises(PipeError, match=r"silent for 0\.2 s"):
        PipeController(sleeper, setup(), name="sleeper", patience=0.2)


@pytest.mark.parametrize(
    ("options", "says"),
    [({"more": ["tail"]}, "tail"), ({"heavier": 1.001}, "mass"), ({"torques": []}, "failed")],
)
def test_a_child_with_another_robot_is_rejected(piped, options, says):
    with pytest.raises(PipeError, match=says):
        piped(**options)


def test_a_peer_is_given_the_same_robot_with_frames_at_its_contacts():
    stance = peers.icub(0.6)
    given = peers.describe(stance)
    model = pin.buildModelFromXML(given["urdf"], pin.JointModelFreeFlyer())
    data = model.createData()
    assert sorted(list(model.names)[2:]) == sorted(given["joints"])
    assert pin.computeTotalMass(model) == pytest.approx(stance.robot.mass, rel=1e-12)
    angles = dict(zip(given["joints"], given["start"][7:], strict=True))
    q = np.array(given["start"][:7] + [angles[name] for name in list(model.names)[2:]])
    assert np.allclose(pin.centerOfMass(model, data, q), stance.com, atol=1e-12)
    pin.framesForwardKinematics(model, data, q)
    for contact, place in zip(given["contacts"], stance.placements, strict=True):
        found = data.oMf[model.getFrameId(contact["name"])]
        assert np.allclose(found.homogeneous, place.homogeneous, atol=1e-9)
