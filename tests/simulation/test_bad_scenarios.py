"""What cannot be run says so; what goes wrong on the way is kept, with its reason and time."""

import pickle
import sys
from dataclasses import replace
from unittest.mock import patch

import numpy as np
import pinocchio as pin
import pytest
from support.standing import C1, C2, Statue, icub, simulator

import copsense
from copsense.controllers import (
    BalancingController,
    Command,
    Gains,
    Hold,
    Ramp,
    Sine,
    lateral_reference,
    public_gains,
)
from copsense.errors import (
    ControllerError,
    EngineMismatchError,
    InvalidInputError,
    MissingExtraError,
    UndeterminedWrenchError,
    UnknownNameError,
    UnreachablePostureError,
    UnsolvedError,
)
from copsense.simulation import (
    FrictionChange,
    Motors,
    MujocoSimulator,
    Noise,
    PhysicsSettings,
    Push,
    Scenario,
    Simulator,
    SimulatorStoppedError,
    rollout,
)
from copsense.simulation.actuation import Actuation

N = 23


def zero(observation):
    return np.zeros(N)


def test_a_faked_simulator_is_one():
    assert isinstance(Statue(icub()), Simulator)
    recording = rollout(Statue(icub()), zero, Scenario(0.05))
    assert recording.attrs["end_kind"] == "completed"
    assert recording.attrs["controller"] == "zero"
    assert np.all(np.isnan(recording["wrench_command"]))


def test_no_torques_is_a_fall():
    recording = rollout(simulator(), zero, Scenario(2.0), until="fall")
    assert recording.attrs["end_kind"] in ("fall", "diverged")
    assert 0.1 < recording.attrs["end_time"] < 2.0
    assert recording["time"].values[-1] == pytest.approx(recording.attrs["end_time"], abs=0.01)


def test_unstable_gains_stop_with_when_and_what():
    gains = Gains(posture_damping=-400.0)
    controller = BalancingController(icub(), C2, gains)
    recording = rollout(simulator(), controller, Scenario(3.0), until="fall")
    assert recording.attrs["end_kind"] in ("diverged", "engine", "fall")
    assert recording.attrs["end_time"] < 3.0
    assert recording.attrs["end_reason"]
    assert np.all(np.isfinite(recording["configuration"]))


def test_an_engine_that_would_start_over_stops(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def violent(observation):
        return np.full(N, 1e12 if observation.time > 0.02 else 0.0)

    recording = rollout(simulator(), violent, Scenario(0.2), until="fall")
    assert recording.attrs["end_kind"] in ("engine", "diverged")
    assert 0.02 < recording.attrs["end_time"] < 0.05
    assert recording.sizes["time"] >= 4
    assert not list(tmp_path.iterdir()), "the engine's log file"


def test_an_engine_does_not_start_over_in_silence():
    engine = simulator()
    engine.reset()
    torques = np.full(N, 1e12)
    with pytest.raises(SimulatorStoppedError, match="MuJoCo stopped"):
        list(map(engine.step, [torques] * 50))


def test_a_stopped_simulator_leaves_the_record():
    recording = rollout(Statue(icub(), stops_at=0.03), zero, Scenario(0.1))
    assert recording.attrs["end_kind"] == "engine"
    assert recording.attrs["end_time"] == pytest.approx(0.03)
    assert "told to stop" in recording.attrs["end_reason"]
    assert recording.sizes["time"] == 6


@pytest.mark.parametrize(
    ("answer", "says"),
    [
        (np.zeros(3), "shape"),
        (np.full(N, np.nan), "not finite"),
        (None, "shape"),
        ("torques", "array of numbers"),
    ],
)
def test_a_controller_that_answers_nonsense(answer, says):
    with pytest.raises(ControllerError, match=says):
        rollout(Statue(icub()), lambda observation: answer, Scenario(0.1))

    def later(observation):
        return np.zeros(N) if observation.time < 0.02 else answer

    recording = rollout(Statue(icub()), later, Scenario(0.1))
    assert recording.attrs["end_kind"] == "controller"
    assert "at 0.020 s" in recording.attrs["end_reason"]


@pytest.mark.parametrize("kind", [RuntimeError, SystemExit])
def test_a_controller_that_raises(kind):
    def broken(observation):
        raise kind("out of ideas")

    with pytest.raises(ControllerError, match=r"'broken' at 0.000 s raised.*out of ideas"):
        rollout(Statue(icub()), broken, Scenario(0.1))


def test_an_error_of_copsenses_own_says_itself_what_to_do():
    error = UnsolvedError(0.1)

    def puzzled(observation):
        raise error

    with pytest.raises(ControllerError) as raised:
        rollout(Statue(icub()), puzzled, Scenario(0.1))
    assert str(raised.value).endswith(f"found no torques (UnsolvedError): {error}")


@pytest.mark.parametrize("wrenches", [np.zeros((3, 6)), np.full((2, 6), np.nan)])
def test_a_command_with_wrenches_that_are_none(wrenches):
    with pytest.raises(ControllerError, match=r"at 0.000 s: the wrenches of the command"):
        rollout(Statue(icub()), lambda o: Command(np.zeros(N), wrenches), Scenario(0.1))


def test_a_controller_may_fill_the_same_array_again():
    filled = np.zeros(N)

    def thrifty(observation):
        filled[:] = observation.time
        return filled

    pretended = Statue(icub())
    recording = rollout(pretended, thrifty, Scenario(0.1, motors=Motors(delay=0.01)))
    command = recording["torque_command"].values[:, 0]
    assert command == pytest.approx(recording["time"].values)
    assert np.array(pretended.torques)[50, 0] == pytest.approx(0.04)


def test_a_simulator_that_gives_no_numbers_ends_the_run():
    class Lost(Statue):
        def step(self, torques, external=None):
            now = super().step(torques, external)
            return replace(now, q=now.q * np.nan) if self.number > 10 else now

    recording = rollout(Lost(icub()), zero, Scenario(0.1))
    assert recording.attrs["end_kind"] == "engine"
    assert "no longer finite" in recording.attrs["end_reason"]
    assert np.all(np.isfinite(recording["configuration"]))


def test_a_simulator_may_keep_its_state_in_what_it_shows():
    class Kept(Statue):
        def reset(self):
            self.kept = super().reset()
            return self.kept

        def step(self, torques, external=None):
            super().step(torques, external)
            self.kept.q[0] += 0.0  # its own
            return replace(self.kept, time=self.number * self.time_step)

    assert rollout(Kept(icub()), zero, Scenario(0.05)).attrs["end_kind"] == "completed"


@pytest.mark.parametrize("part", ["q", "v", "wrenches", "com", "posture"])
def test_a_controller_cannot_change_what_it_sees(part):
    def meddling(observation):
        getattr(observation if hasattr(observation, part) else observation.target, part)[:] = 0.0
        return np.zeros(N)

    with pytest.raises(ControllerError, match="read-only"):
        rollout(Statue(icub()), meddling, Scenario(0.1))


def test_a_controller_and_a_reference_of_another_robot():
    talos = copsense.load_stance("talos")
    with pytest.raises(InvalidInputError, match=r"made for 'talos' with 28 joints.*'icub' with 23"):
        rollout(Statue(icub()), BalancingController(talos, C2), Scenario(0.1))
    wider = icub(width=0.2)
    with pytest.raises(InvalidInputError, match="contacts elsewhere"):
        rollout(Statue(icub()), BalancingController(wider, C2), Scenario(0.1))
    reference = lateral_reference(talos, Sine(0.01, 1.0))
    with pytest.raises(InvalidInputError, match="the reference is made for 'talos'"):
        rollout(Statue(icub()), zero, Scenario(0.1, reference))


@pytest.mark.parametrize("period", [0.0, -1.0, np.nan])
def test_a_record_period_that_is_none(period):
    with pytest.raises(InvalidInputError, match="between two rows"):
        rollout(Statue(icub()), zero, Scenario(0.1), record_period=period)


def test_a_run_that_is_told_to_stop_keeps_what_it_has():
    asked = iter([False] * 20 + [True])
    recording = rollout(Statue(icub()), zero, Scenario(1.0), stop=lambda: next(asked))
    assert recording.attrs["end_kind"] == "stopped"
    # Asked from the second period on: before there is nothing to keep.
    assert recording.attrs["end_time"] == pytest.approx(0.021)
    assert len(recording["time"]) == 5


def test_a_controller_as_a_class():
    class Mine:
        name = "mine"

        def __call__(self, observation):
            return np.zeros(N)

    assert rollout(Statue(icub()), Mine(), Scenario(0.01)).attrs["controller"] == "mine"


def test_a_control_period_that_does_not_fit():
    with pytest.raises(InvalidInputError, match=r"not a multiple.*time step"):
        rollout(Statue(icub()), zero, Scenario(0.1, control_period=1.5e-3))


@pytest.mark.parametrize(
    ("scenario", "error"),
    [
        (Scenario(motors=Motors(limit={"tail": 3.0})), UnknownNameError),
        (Scenario(pushes=(Push((1.0, 0.0, 0.0), frame="wing"),)), UnknownNameError),
        (Scenario(motors=Motors(limit="none")), UnknownNameError),
        (Scenario(motors=Motors(delay=0.3e-3)), InvalidInputError),
        (Scenario(reference=Ramp(0.9)), UnreachablePostureError),
    ],
)
def test_a_scenario_that_does_not_fit_the_robot(scenario, error):
    with pytest.raises(error):
        rollout(Statue(icub()), zero, scenario)


@pytest.mark.parametrize(
    "build",
    [
        lambda: Scenario(0.0),
        lambda: Scenario(np.nan),
        lambda: Scenario(1e9),
        lambda: Scenario(seed=-3),
        lambda: Scenario(0.5, pushes=(Push((1.0, 0.0, 0.0), start=0.5),)),
        lambda: Scenario(0.5, friction=(FrictionChange(0.3, 0.7),)),
        lambda: Scenario(1.0, control_period=0.0),
        lambda: Sine(0.01, 0.0),
        lambda: Sine(np.inf, 1.0),
        lambda: Ramp(0.01, -1.0),
        lambda: Hold(np.nan),
        lambda: Push((1.0, 0.0, np.nan)),
        lambda: Push((1.0, 0.0, 0.0), duration=0.0),
        lambda: Push((1.0, 0.0, 0.0), start=-1.0),
        lambda: Motors(delay=-1.0),
        lambda: Motors(bandwidth=0.0),
        lambda: Noise(velocity=-1.0),
        lambda: Gains(momentum_damping=np.nan),
        lambda: PhysicsSettings(contact_time=1e-3),
        lambda: PhysicsSettings(time_step=0.0),
        lambda: Gains(posture_stiffness={"knee": 1.0}).per_joint(icub().robot),
    ],
)
def test_values_that_mean_nothing(build):
    with pytest.raises(copsense.CopsenseError):
        build()


def test_a_criterion_that_leaves_forces_free():
    free = copsense.Criterion("free", (copsense.WrenchTerm(np.array([1.0, 1, 0, 0, 0, 0])),))
    with pytest.raises(UndeterminedWrenchError, match="tie_break"):
        BalancingController(icub(), free)


def test_robots_that_cannot_be_simulated():
    planar = copsense.load_stance("four_bar")
    with pytest.raises(InvalidInputError, match="plane"):
        MujocoSimulator(planar)
    with pytest.raises(InvalidInputError, match="plane"):
        BalancingController(planar, C1)
    bare = [replace(contact, polygon=None) for contact in icub().contacts]
    with pytest.raises(InvalidInputError, match="no sole"):
        MujocoSimulator(icub().with_contacts(bare))
    with pytest.raises(InvalidInputError, match=r"link 'RShoulderYawLink' .* principal inertias"):
        MujocoSimulator(copsense.load_stance("romeo"))


def test_an_engine_that_sees_another_robot():
    with (
        patch.object(pin, "crba", lambda model, data, q: np.eye(model.nv)),
        pytest.raises(EngineMismatchError, match="mass matrix"),
    ):
        MujocoSimulator(icub())


def test_without_mujoco_the_extra_is_named():
    with (
        patch.dict(sys.modules, {"mujoco": None}),
        pytest.raises(MissingExtraError, match=r"copsense\[sim\]"),
    ):
        MujocoSimulator(icub())


def test_motors_delay_filter_and_limit():
    robot, one = icub().robot, np.ones(N)
    late = Actuation(Motors(delay=2e-3), robot, 1e-3)
    got = [late.apply(k * one)[0] for k in range(1, 6)]
    assert got == [1, 1, 1, 2, 3]  # the first command is taken to have been there before
    slow = Actuation(Motors(bandwidth=10.0), robot, 1e-3)
    slow.apply(0 * one)
    rise = [slow.apply(one)[0] for _ in range(16)]
    assert rise[-1] == pytest.approx(1 - np.exp(-2 * np.pi * 10 * 0.016))
    weak = Actuation(Motors(limit={"l_knee": 0.5}), robot, 1e-3)
    torques = weak.apply(one)
    assert torques[robot.torque_names.index("l_knee")] == 0.5
    assert np.sum(torques == 1.0) == N - 1


def test_a_stop_survives_a_copy():
    stop = SimulatorStoppedError("told to", 0.3)
    again = pickle.loads(pickle.dumps(stop))
    assert (str(again), vars(again)) == (str(stop), vars(stop))


def test_public_gains_are_softer():
    stiffness, damping = public_gains(icub().robot).per_joint(icub().robot)
    assert stiffness.min() >= 10
    assert stiffness.max() <= 100
    assert np.all(damping < stiffness)
