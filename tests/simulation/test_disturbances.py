"""What disturbs a robot: seeded, as it says, and seen by what should see it."""

import typing
from functools import cache

import numpy as np
import pinocchio as pin
import pytest
from support.standing import C1, C2, Statue, icub, simulator

import copsense
from copsense.controllers import BalancingController, Hold, Sine, load_controller, public_gains
from copsense.errors import ControllerError, InvalidInputError, UnknownNameError
from copsense.simulation import (
    FootOdometry,
    FrictionChange,
    ModelError,
    Motors,
    MujocoSimulator,
    Noise,
    Push,
    Scenario,
    rollout,
)


@cache
def undisturbed(duration, reference=None):
    """The recording of a run that several tests compare with."""
    return run(Scenario(duration, reference or Hold(), seed=4))


def run(scenario, criterion=C2, engine=None, gains=None):
    gains = {} if gains is None else {"gains": gains}
    controller = BalancingController(icub(), criterion, **gains)
    return rollout(engine or simulator(), controller, scenario)


EACH = {
    "push": {"pushes": (Push((5.0, 8.0, 0.0), 0.05, 0.05),)},
    "motors": {"motors": Motors(delay=0.004, bandwidth=30.0, limit=20.0)},
    "joint noise": {"noise": Noise(1e-4, 1e-3)},
    "wrench noise": {"noise": Noise(force=1.0, moment=0.05)},
    "friction": {"friction": (FrictionChange(0.05, 0.1),)},
    "model error": {"model_error": ModelError(0.05, {"root_joint": 1.0})},
    "odometry": {"odometry": "loaded", "noise": Noise(1e-4, 1e-3)},
    "all noise": {"noise": Noise(1e-4, 1e-2, 1.0, 0.1)},
    "ground and mass": {
        "friction": (FrictionChange(0.1, 0.05),),
        "model_error": ModelError(0.02),
    },
    "motors and push": {
        "motors": Motors(0.005, 40.0, 20.0),
        "pushes": (Push((0.0, 20.0, 0.0), 0.05),),
    },
}


@pytest.mark.parametrize("kind", EACH)
def test_every_disturbance_disturbs_and_is_the_same_twice(kind):
    sway = Sine(0.01, 0.5)
    plain = {"duration": 0.2, "reference": sway, "seed": 4}
    first, again = run(Scenario(**plain, **EACH[kind])), run(Scenario(**plain, **EACH[kind]))
    assert first.equals(again)
    assert not first.equals(undisturbed(0.2, sway))
    if "noise" in EACH[kind]:
        assert not first.equals(run(Scenario(**{**plain, "seed": 5}, **EACH[kind])))


def test_sensors_over_the_feet_read_the_contacts_wrenches_at_rest():
    for stance in (icub(), copsense.load_stance("solo12")):
        criterion = copsense.minimum_torque(tie_break=C1)
        by = {
            source: rollout(
                MujocoSimulator(stance, wrenches=source),
                BalancingController(stance, criterion),
                Scenario(0.6),
            )
            for source in ("contacts", "sensors")
        }
        off = np.abs(by["sensors"]["wrench"] - by["contacts"]["wrench"]).values
        assert off[-1].max() < 1e-3  # N, Nm: what still moves
        # In motion the feet's own acceleration is missing: the sensors are no copy.
        assert off[1:].max() > 1e-2


def test_sensors_reject_contacts_on_one_link():
    stance = icub()
    toe = copsense.Contact("l_sole", "point", name="toe", offset=(0.1, 0.0, -0.0105))
    shared = copsense.Stance(stance.robot, stance.q, [*stance.contacts, toe])
    with pytest.raises(InvalidInputError, match="shares its link"):
        MujocoSimulator(shared, wrenches="sensors")
    with pytest.raises(UnknownNameError, match="contacts"):
        MujocoSimulator(stance, wrenches="sensor")


def test_noise_of_the_wrenches_is_seeded_and_of_the_size_asked_for():
    noisy = Scenario(0.5, noise=Noise(force=2.0, moment=0.1), seed=3)
    first, again = run(noisy), run(noisy)
    assert first.equals(again)
    quiet = undisturbed(0.5)
    off = (first["wrench"] - quiet["wrench"]).values[20:]
    assert off[..., :3].std() == pytest.approx(2.0, rel=0.15)
    assert off[..., 3:].std() == pytest.approx(0.1, rel=0.15)
    # The balancing controller reads no wrench: the motion is the same to the last bit.
    assert first["com"].equals(quiet["com"])


@pytest.mark.parametrize(
    ("error", "mass"),
    [(ModelError(mass=0.05), 1.05 * 33.061673), (ModelError(payload={"l_hand": 1.5}), 34.561673)],
)
def test_a_robot_heavier_than_believed_carries_its_true_weight(error, mass):
    recording = run(Scenario(0.6, model_error=error))
    assert recording.attrs["end_kind"] == "completed"
    assert recording.attrs["mass"] == pytest.approx(mass, rel=1e-6)
    total = float(recording["wrench"].isel(time=-1).sel(component="fz").sum())
    assert total == pytest.approx(mass * 9.81, rel=5e-3)
    # The controller, which does not know, lets the CoM sink.
    assert float(recording["com"].isel(time=-1)[2] - recording["com"].isel(time=0)[2]) < -3e-4


def test_slippery_ground_lets_a_foot_slip_and_only_from_then_on():
    push = (Push((60.0, 0.0, 0.0), 0.2, 0.3),)
    rough = run(Scenario(0.8, pushes=push))
    smooth = run(Scenario(0.8, pushes=push, friction=(FrictionChange(0.01, 0.15),)))
    assert smooth.attrs["tip_kind"] == "slip"
    assert smooth.attrs["tip_time"] > 0.2
    assert rough.attrs["tip_kind"] != "slip"
    before = {"time": slice(0, 0.14)}
    assert smooth["com"].sel(before).equals(rough["com"].sel(before))
    # A rollout leaves the engine's ground as it was.
    assert run(Scenario(0.8, pushes=push)).equals(rough)


def test_friction_may_change_under_one_contact():
    push = (Push((60.0, 0.0, 0.0), 0.2, 0.3),)
    found = run(Scenario(0.8, pushes=push, friction=(FrictionChange(0.0, 0.1, "r_sole"),)))
    assert found.attrs["tip_contact"] == "r_sole"


def test_odometry_finds_the_base_of_a_robot_whose_foot_stands():
    stance, random = icub(), np.random.default_rng(0)
    for foot in ("l_sole", "r_sole", "loaded"):
        odometry = FootOdometry(stance, foot)
        for _ in range(5):
            motion = stance.admissible_motions @ random.uniform(-0.3, 0.3, 17)
            moved = copsense.posture.retract(stance, 0.2 * motion)
            speed = moved.admissible_motions @ random.uniform(-1, 1, 17)
            hidden = moved.q.copy()
            hidden[:7] = [9.0, 9.0, 9.0, 0.0, 0.0, 0.0, 1.0]
            wrenches = random.uniform(0, 100, (2, 6))
            q, v = odometry.estimate(hidden, speed, wrenches)
            turn = abs(q[3:7] @ moved.q[3:7])
            np.testing.assert_allclose(q[:3], moved.q[:3], atol=1e-9)
            assert turn == pytest.approx(1.0, abs=1e-12)
            np.testing.assert_allclose(v, speed, atol=1e-9)


@pytest.mark.parametrize("foot", ["l_sole", "loaded"])
def test_a_robot_stands_on_odometry_with_soft_gains(foot):
    recording = run(Scenario(0.5, odometry=foot), gains=public_gains(icub().robot))
    assert recording.attrs["end_kind"] == "completed", recording.attrs["end_reason"]
    assert np.abs(recording["com"] - recording["com"][0]).max() < 1e-3


@pytest.mark.parametrize("foot", ["l_sole", "r_sole", "loaded"])
def test_stiff_gains_stand_odometry_that_begins_when_the_robot_stands(foot):
    # The sine and the robot start at full speed, while the feet are hardly loaded.
    push = (Push((0.0, 8.0, 0.0), 0.2, 0.05),)
    for side in (1, -1):
        sway = Sine(side * 0.01, 0.5)
        recording = run(Scenario(0.4, sway, push, noise=Noise(0.0, 1e-3), odometry=foot))
        assert recording.attrs["end_kind"] == "completed", recording.attrs["end_reason"]


def test_a_push_acts_where_it_says():
    class Pushed(Statue):
        felt: typing.ClassVar = []

        def step(self, torques, external=None):
            if external is not None:
                self.felt.append(external)
            return super().step(torques, external)

    stance = icub()
    model, data = stance.robot.model, stance.robot.model.createData()
    push = Push((3.0, 8.0, -2.0), 0.0, 0.01, "l_hand")
    rollout(Pushed(stance), lambda o: np.zeros(model.nv - 6), Scenario(0.02, pushes=(push,)))
    J = pin.computeFrameJacobian(
        model, data, stance.q, model.getFrameId("l_hand"), pin.LOCAL_WORLD_ALIGNED
    )
    assert Pushed.felt[0] == pytest.approx(J[:3].T @ push.force)


def test_a_heavier_robot_turns_as_slowly_as_it_moves():
    stance = icub()
    heavy = ModelError(mass=0.05).applied(stance)
    ours, theirs = (
        pin.crba(s.robot.model, s.robot.model.createData(), stance.q) for s in (stance, heavy)
    )
    assert theirs == pytest.approx(1.05 * ours, abs=1e-12)


def test_a_payload_is_where_it_says():
    stance = icub()
    heavy = ModelError(payload={"l_hand": 1.5}).applied(stance)
    model, data = stance.robot.model, stance.robot.model.createData()
    pin.framesForwardKinematics(model, data, stance.q)
    hand = data.oMf[model.getFrameId("l_hand")].translation
    mass = stance.robot.mass
    assert heavy.com == pytest.approx((mass * stance.com + 1.5 * hand) / (mass + 1.5), abs=1e-9)


@pytest.mark.parametrize("duration", [1e-4, 1e-3, 1.5e-3, 0.0123, 0.05])
def test_a_push_gives_its_impulse_whatever_the_steps(duration):
    class Pushed(Statue):
        given = 0.0

        def step(self, torques, external=None):
            self.given += 0.0 if external is None else np.linalg.norm(external[:3]) * self.time_step
            return super().step(torques, external)

    pushed = Pushed(icub())
    push = Push((0.0, 2.0 / duration, 0.0), 0.1 + duration / 3, duration)
    rollout(
        pushed,
        lambda observation: np.zeros(len(icub().robot.torque_names)),
        Scenario(0.2, pushes=(push,)),
    )
    assert pushed.given == pytest.approx(2.0, rel=1e-6)


def test_odometry_hands_over_once_and_without_a_jump():
    stance = icub()
    odometry = FootOdometry(stance, "loaded")
    bent, v, wrenches = stance.q.copy(), np.zeros(stance.robot.model.nv), np.zeros((2, 6))
    bent[stance.robot.model.joints[stance.robot.model.getJointId("r_hip_roll")].idx_q] += 0.02
    found = []
    for left in (0.6, 0.46, 0.44, 0.54, 0.56):
        wrenches[:, 2] = np.array([left, 1 - left]) * stance.robot.weight
        found.append(odometry.estimate(bent, v, wrenches)[0])
    assert np.abs(np.array(found) - found[0]).max() < 1e-12
    # As the left foot has it throughout: where they hand over, nothing moves.
    alone = FootOdometry(stance, "l_sole").estimate(bent, v, wrenches)[0]
    assert np.abs(found[-1] - alone).max() < 1e-12


def test_odometry_keeps_its_foot_while_another_carries_hardly_more():
    stance = icub()
    v, wrenches = np.zeros(stance.robot.model.nv), np.zeros((2, 6))
    bent = stance.q.copy()
    bent[stance.robot.model.joints[stance.robot.model.getJointId("r_hip_roll")].idx_q] += 0.02
    for left, kept in ((0.46, True), (0.44, False)):
        odometry = FootOdometry(stance, "loaded")
        wrenches[:, 2] = np.array([left, 1 - left]) * stance.robot.weight
        odometry.estimate(bent, v, wrenches)  # the right foot moves; is it the one believed in?
        found = odometry.estimate(stance.q, v, wrenches)[0]
        assert (np.abs(found[:3] - stance.q[:3]).max() < 1e-9) == kept


def test_odometry_is_off_by_what_the_foot_slips():
    import pinocchio as pin

    stance, seen, balancing = icub(), [], BalancingController(icub(), C2)

    def controller(observation):
        seen.append(observation.q)
        return balancing(observation)

    scenario = Scenario(
        0.6,
        pushes=(Push((10.0, 0.0, 0.0), 0.1, 0.5),),
        friction=(FrictionChange(5e-3),),
        odometry="l_sole",
    )
    recording = rollout(simulator(), controller, scenario)
    assert recording.attrs["end_kind"] == "slip"
    truth = recording["configuration"].values[-1]
    foot, home = (s.placements[0] for s in (stance.at(truth, check=False), stance))
    assert foot.translation[0] - home.translation[0] > 0.01
    base, thought = (pin.XYZQUATToSE3(q[:7]) for q in (truth, seen[-1]))
    there = home * foot.inverse() * base
    assert np.abs(there.homogeneous - thought.homogeneous).max() < 1e-9


def test_a_foot_that_turns_on_the_spot_slips_too():
    import pinocchio as pin

    from copsense.simulation import Snapshot, Thresholds
    from copsense.simulation.events import EventDetector

    stance, places = icub(), icub().placements
    watch = EventDetector(stance, Thresholds(slip=5e-3))
    corner = np.linalg.norm(stance.contacts[1].polygon, axis=1).max()
    for degrees, kind in ((2.0, None), (4.0, "slip")):
        turn = pin.utils.rpyToMatrix(0.0, 0.0, np.radians(degrees))
        now = Snapshot(
            0.0,
            stance.q,
            np.zeros(stance.robot.model.nv),
            np.zeros((2, 6)),
            np.array([p.translation for p in places]),
            np.array([places[0].rotation, turn @ places[1].rotation]),
        )
        event = watch.contact_event(now)
        assert (event.kind if event else None) == kind
        if event:  # the farthest corner moves by a chord
            chord = 2 * corner * np.sin(np.radians(degrees) / 2)
            assert f"{chord * 1e3:.1f} mm" in event.message


def test_what_does_not_fit_is_rejected():
    with pytest.raises(UnknownNameError, match="l_sole"):
        run(Scenario(0.1, friction=(FrictionChange(0.1, 0.0, "left"),)))
    with pytest.raises(UnknownNameError, match="loaded"):
        run(Scenario(0.1, odometry="left"))
    with pytest.raises(InvalidInputError, match="does not follow from a point contact"):
        FootOdometry(copsense.load_stance("solo12"), "loaded")
    with pytest.raises(UnknownNameError, match="payload"):
        run(Scenario(0.1, model_error=ModelError(payload={"hand": 1.0})))
    for build in (
        lambda: ModelError(mass=-1.0),
        lambda: ModelError(payload={"l_hand": 0.0}),
        lambda: FrictionChange(-0.1),
        lambda: FrictionChange(0.1, -1.0),
        lambda: Noise(force=-1.0),
    ):
        with pytest.raises(InvalidInputError):
            build()
    statue = Statue(icub())
    controller = BalancingController(icub(), C2)
    for scenario in (
        Scenario(0.1, model_error=ModelError(0.1)),
        Scenario(0.1, friction=(FrictionChange(0.1),)),
    ):
        with pytest.raises(InvalidInputError, match="Statue cannot simulate"):
            rollout(statue, controller, scenario)


OWN = """
import numpy as np

class Limp:
    def __init__(self, stance):
        self.n = len(stance.robot.torque_names)

    def __call__(self, observation):
        return np.zeros(self.n)

def limp(observation):
    return np.zeros(23)

def made(stance):
    return Limp(stance)

def broken(stance):
    raise RuntimeError("no batteries")

number = 3.0
"""


@pytest.fixture
def own_module(tmp_path, monkeypatch):
    (tmp_path / "own_module_of_a_test.py").write_text(OWN)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    return "own_module_of_a_test"


def test_a_users_controller_is_one_class_or_one_function(own_module):
    ends = []
    for name in ("Limp", "limp", "made"):
        controller = load_controller(f"{own_module}:{name}", icub())
        recording = rollout(simulator(), controller, Scenario(1.0), until="fall")
        ends.append((recording.attrs["end_kind"], recording.attrs["end_time"]))
    assert len(set(ends)) == 1
    assert ends[0][0] == "fall"


@pytest.mark.parametrize(
    ("name", "error", "says"),
    [
        ("Limpp", UnknownNameError, "Did you mean limp"),
        ("number", InvalidInputError, "not a controller"),
        ("broken", ControllerError, "no batteries"),
    ],
)
def test_a_users_controller_that_is_none_is_one_error(own_module, name, error, says):
    with pytest.raises(error, match=says):
        load_controller(f"{own_module}:{name}", icub())
    with pytest.raises(InvalidInputError, match="MODULE:ATTRIBUTE"):
        load_controller(own_module, icub())
    with pytest.raises(InvalidInputError, match="cannot be imported"):
        load_controller("no_such_module_anywhere:f", icub())
    with pytest.raises(InvalidInputError, match=r"no file nowhere/mine\.py to read"):
        load_controller("nowhere/mine.py:f", icub())
