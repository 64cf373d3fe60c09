"""``copsense balance`` prints, writes and rejects."""

import signal
import subprocess
import sys
import time

import imageio_ffmpeg
import numpy as np
import pytest
import xarray as xr
from support.commands import copsense
from support.driven_files import sprung_rods
from support.walkers import BIPED, NO_ANKLE_ROLL, bent, walker

from copsense import (
    Drives,
    load_stance,
    minimum_torque,
    minimum_wrench,
    solve_equilibrium,
)
from copsense.drives import Coupling
from copsense.freedom import repetition_notes
from copsense.robots import save_stance
from copsense.simulation import Recording


def test_a_run_is_summarised_recorded_and_drawn(tmp_path):
    data, picture = tmp_path / "run.nc", tmp_path / "run.png"
    answer = copsense(
        "balance", "solo12", "--duration", 0.2, "--criterion", "minimum-wrench",
        "--output", data, "--plot", picture,
    )  # fmt: skip
    assert answer.code == 0, answer.err
    assert "completed" in answer.out
    assert "no contact tipped" in answer.out
    recording = Recording.load(data)
    assert recording.attrs["end_kind"] == "completed"
    assert recording.attrs["command"].startswith("copsense balance solo12")
    assert picture.stat().st_size > 10_000


def test_a_tip_is_told_beside_the_prediction():
    answer = copsense(
        "balance", "icub", "--sole=-0.05:0.1:-0.01:0.01", "--criterion", "minimum-wrench",
        "--reference", "ramp:0.02:0.01", "--until", "tip", "--json",
    )  # fmt: skip
    assert answer.code == 1
    summary = answer.json
    assert summary["end"]["kind"] == "tip"
    predicted = summary["static_prediction"]["excursion"]
    assert summary["first_tip"]["com_y_from_start"] == pytest.approx(predicted, abs=1.5e-3)


def test_a_motion_too_fast_for_statics_is_said_to_be_and_how_far_they_looked():
    run = ("balance", "solo12", "--reference", "sine:0.005:2", "--duration", 0.05)
    said = copsense(*run).out
    assert "static prediction: no contact tips up to 5.0 mm" in said
    assert "too fast for statics" in said
    summary = copsense(*run, "--json").json
    assert summary["static_prediction"]["excursion"] is None
    assert summary["static_prediction"]["statement"] == "no contact tips up to 5.0 mm"
    assert summary["static_prediction"]["reach"] == pytest.approx(0.005)
    fast = summary["quasi_static"]
    # w^2 lever / g of the sine.
    assert fast["share"] == pytest.approx((4 * np.pi) ** 2 * fast["lever"] / 9.81, rel=1e-6)
    assert fast["excess"] == pytest.approx(0.005 * fast["share"])
    slow = copsense("balance", "solo12", "--duration", 0.05).out
    assert "too fast" not in slow


OWN = """
import numpy as np

def limp(observation):
    return np.zeros(12)

def short(observation):
    return np.zeros(3)

def wild(observation):
    return np.full(12, np.nan)
"""


def test_a_users_controller_from_the_command(tmp_path, monkeypatch):
    (tmp_path / "own_module_of_the_command.py").write_text(OWN)
    monkeypatch.chdir(tmp_path)
    run = ("balance", "solo12", "--duration", 0.8, "--controller")
    limp = copsense(*run, "own_module_of_the_command:limp", "--json")
    assert limp.code == 1
    assert limp.json["end"]["kind"] == "fall"
    assert limp.json["static_prediction"]["excursion"] is None
    for name, says in (("short", "(12,)"), ("wild", "finite")):
        answer = copsense(*run, f"own_module_of_the_command:{name}")
        assert says in answer.error
        assert "at 0.000 s" in answer.error


def test_disturbances_from_the_command():
    answer = copsense(
        "balance", "icub", "--duration", 0.3, "--unknown-payload", "l_hand=0.5", "--mass-error", 2,
        "--friction", "0.5:0.1:l_sole", "--force-noise", 0.5, "--moment-noise", 0.01,
        "--wrenches", "sensors", "--odometry", "loaded", "--gains", "public", "--json",
    )  # fmt: skip
    assert answer.code == 0, answer.err
    assert answer.json["end"]["kind"] == "completed"


REST = """
from copsense.controllers import BalancingController
from copsense.criterion import minimum_torque

class Rest(BalancingController):
    def __init__(self, stance):
        super().__init__(stance, minimum_torque())

"""


def test_ctrl_c_keeps_what_was_recorded(tmp_path):
    path, began, module = tmp_path / "run.nc", tmp_path / "began", tmp_path / "at_rest.py"
    module.write_text(
        "from pathlib import Path\n"
        + REST
        + "    def __call__(self, observation):\n"
        + f"        Path({str(began)!r}).touch()\n"
        + "        return super().__call__(observation)\n"
    )
    code = "from copsense.cli import main; main()"
    command = [sys.executable, "-c", code, "balance", "icub", "--controller", f"{module}:Rest"]
    running = subprocess.Popen(
        [*command, "--duration", "500", "--output", path],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    for _ in range(1200):
        if began.exists():
            break
        time.sleep(0.1)
    time.sleep(0.3)
    running.send_signal(signal.SIGINT)
    out, err = running.communicate(timeout=60)
    assert running.returncode == 130, err
    assert "stopped" in out
    recording = xr.load_dataset(path)
    assert recording.attrs["end_kind"] == "stopped"
    assert 0 < float(recording["time"][-1]) <= recording.attrs["end_time"] < 400


def test_a_point_that_slips_is_said_to(tmp_path):
    answer = copsense("balance", "solo12", "--reference", "ramp:0.15:0.1", "--until", "tip")
    assert "FOOT slipped by" in answer.out
    assert "FOOT slips at 116.7 mm" in answer.out


def test_a_controller_from_a_file_elsewhere(tmp_path):
    (tmp_path / "at_rest.py").write_text(REST)
    source = f"{tmp_path / 'at_rest.py'}:Rest"
    answer = copsense("balance", "icub", "--duration", 0.1, "--controller", source)
    assert answer.code == 0, answer.err


def test_a_run_is_filmed(tmp_path):
    film = tmp_path / "run.mp4"
    # A process of its own: how MuJoCo draws is settled when it is first imported.
    code = "from copsense.cli import main; main()"
    command = [sys.executable, "-c", code, "balance", "icub", "--duration", "0.3", "--video", film]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if "cannot draw off-screen" in done.stderr:
        pytest.skip(done.stderr)
    assert done.returncode == 0, done.stderr
    count, _ = imageio_ffmpeg.count_frames_and_secs(film)
    assert count >= 8
    raw = ["-frames:v", "1", "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    shown = subprocess.run(
        [imageio_ffmpeg.get_ffmpeg_exe(), "-loglevel", "error", "-i", film, *raw],
        capture_output=True,
        check=True,
    )
    frame = np.frombuffer(shown.stdout, dtype=np.uint8).reshape(640, 640, 3)
    # Something stands in the middle of the picture, on a ground of another colour.
    assert frame[:, 213:426].std() > 5
    assert "exists already" in copsense("balance", "icub", "--video", film).error


def test_without_an_off_screen_the_remedy_is_named(tmp_path, monkeypatch):
    def nothing(*_):
        raise RuntimeError("no display")

    monkeypatch.setattr("mujoco.Renderer", nothing)
    answer = copsense("balance", "icub", "--video", tmp_path / "run.mp4")
    assert "MUJOCO_GL" in answer.error
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--reference", "circle"], "reference"),
        (["--reference", "sine:1"], "sine:AMPLITUDE:FREQUENCY"),
        (["--reference", "sine:0.01:0"], "frequency"),
        (["--push", "1:2"], "FX:FY:FZ"),
        (["--push", "0:1:0:0:0.1:wing"], "wing"),
        (["--torque-limit", "tail=3"], "tail"),
        (["--torque-limit", "weak"], "torque limit"),
        (["--duration", "-1"], "duration"),
        (["--criterion", "minimum-wrench", "--criterion", "minimum-torque"], "one criterion"),
        (["--output", "run.txt"], "suffix"),
        (["--friction", "ice"], "MU[:START[:CONTACT]]"),
        (["--friction", "0.1:0:wing"], "wing"),
        (["--unknown-payload", "wing=1"], "wing"),
        (["--mass-error", "-100"], "no mass would be left"),
        (["--odometry", "loaded"], "point contact"),
        (["--controller", "nowhere"], "MODULE:ATTRIBUTE"),
        (["--video", "run.gif"], "suffix"),
    ],
)
def test_bad_options_are_one_clear_line(options, says):
    assert says in copsense("balance", "solo12", *options).error


def test_gains_from_the_command_can_be_too_much():
    answer = copsense("balance", "icub", "--duration", 1, "--gain", "com-stiffness=1e6", "--json")
    assert answer.code == 1
    end = answer.json["end"]
    assert "diverged" in end["reason"]
    assert 0.0 < end["time"] < 1.0


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--gain", "com-damp=1"], "no gain named 'com-damp'. Did you mean com-damping"),
        (["--gain", "com-damping"], "Give NAME=VALUE, such as com-damping=14"),
        (["--gain", "com-damping=nan"], "gain com_damping is not finite"),
        (["--gain", "com-damping=1", "--controller", "a:b"], "belong to the built-in controller"),
        (["--gains", "stiff", "--controller", "a:b"], "belong to the built-in controller"),
        (["--control-period", 0.0015], "not a multiple of the physics' time step"),
        (["--control-period", 0], "control period"),
        (["--unknown-payload", "chest"], "FRAME=KG"),
        (["--torque-limit", "l_knee"], "JOINT=NM"),
    ],
)
def test_gains_and_periods_that_are_none_are_rejected(options, says):
    answer = copsense("balance", "icub", "--duration", 0.1, *options)
    assert answer.code == 2
    assert says in " ".join(answer.err.split())
    assert answer.out == ""


def test_a_slower_controller_is_called_less_often(tmp_path):
    for period in (0.001, 0.01):
        data = tmp_path / f"{period}.nc"
        answer = copsense(
            "balance", "solo12", "--duration", 0.2, "--control-period", period, "--output", data
        )
        assert answer.code == 0, answer.err
        assert Recording.load(data).attrs["control_period"] == period


@pytest.fixture
def rod_ankles(tmp_path):
    """A file of a biped whose ankles are driven by cranks and rods; what stands it."""
    path = tmp_path / "rods.xml"
    path.write_text(sprung_rods())
    return (path, "--contact", "l_foot", "--contact", "r_foot", "--contact-at", "sole")


def test_drives_and_loads_are_those_of_the_analysis(rod_ankles, tmp_path):
    changed = (
        "--load", "trunk=0:2:-10", "--payload", "trunk=0.5", "--motor", "elbow",
        "--passive", "shoulder", "--spring", "shoulder=6:10deg", "--couple", "r_yaw=-1*l_yaw",
    )  # fmt: skip
    data, file = tmp_path / "run.nc", tmp_path / "stance.toml"
    run = ("--duration", 0.03, "--criterion", "minimum-torque", "--json")
    answer = copsense(
        "balance", *rod_ankles, *changed, *run, "--output", data, "--save-stance", file
    )
    assert answer.code == 0, answer.err
    stance = load_stance(file)
    assert [load.frame for load in stance.loads] == ["trunk"]
    assert stance.robot.payloads[0].mass == 0.5
    motors = stance.robot.torque_names
    assert "elbow" in motors
    assert not {"shoulder", "r_yaw", "l_ankle_pitch"} & set(motors)
    recording = Recording.load(data)
    assert tuple(recording.labels("motor")) == motors
    # The first command is given at rest, on the reference posture.
    static = solve_equilibrium(stance, minimum_torque())
    first = recording.isel(time=0)
    weight = stance.robot.weight
    assert np.abs(first["torque_command"].values - static.torques).max() < 1e-9 * weight
    assert np.abs(first["wrench_command"].values - static.wrenches).max() < 1e-9 * weight
    middle = int(np.argmin(np.abs(recording["static_travel"].values)))
    assert np.abs(recording["static_cop"].values[middle] - first["cop_command"].values).max() < 1e-6
    again = copsense("balance", "--stance", file, *run)
    assert again.json["torque_norm_mean"] == pytest.approx(
        answer.json["torque_norm_mean"], rel=1e-9
    )


def test_a_knee_without_a_motor_that_balances_but_would_fall_is_named_before_the_run(rod_ankles):
    robot, *_ = rod_ankles
    one = ("--contact", "l_foot", "--contact-at", "sole", "--posture", "l_knee=40deg")
    said = copsense("balance", robot, *one, "--passive", "l_knee").error
    assert "would fall at this posture: no motor, contact or loop holds l_knee" in said


def test_a_coupling_that_all_but_repeats_the_contacts_is_said_to():
    run = ("balance", "icub", "--duration", 0.005)
    said = copsense(*run, "--couple", "r_hip_yaw=-1*l_hip_yaw").err
    assert "note: Loops and couplings all but repeat what the contacts hold" in said
    drives = Drives(couplings=(Coupling("r_hip_yaw", "l_hip_yaw", 1.0),))
    assert repetition_notes(load_stance("icub", drives=drives)) == ()


def test_a_stance_files_criterion_shares_the_load(tmp_path):
    stance = load_stance("solo12")
    path = tmp_path / "stance.toml"
    save_stance(stance, path, criteria=[minimum_wrench(0.4)])
    run = ("balance", "--stance", path, "--duration", 0.02)
    assert "solo12 under minimum-wrench" in copsense(*run).out
    assert "solo12 under minimum-torque" in copsense(*run, "--criterion", "minimum-torque").out
    save_stance(stance, path, criteria=[minimum_wrench(0.4), minimum_torque()], overwrite=True)
    assert "the stance file has 2 criteria" in copsense(*run).error


def test_loads_that_lift_the_robot_are_an_error():
    answer = copsense("balance", "icub", "--load", "l_hand=0:0:400", "--duration", 0.02)
    assert "lift it by 75.7 N more than its weight" in answer.error


def test_legs_that_hold_the_com_sideways_hold_still(tmp_path):
    path = tmp_path / "robot.urdf"
    path.write_text(walker(NO_ANKLE_ROLL))
    words = [w for frame in BIPED for w in ("--contact", frame)]
    words += [w for j, a in bent().items() for w in ("--posture", f"{j}={np.degrees(a)}")]
    run = ("balance", path, *words, "--contact-at", "sole", "--duration", 0.05)
    answer = copsense(*run, "--criterion", "minimum-wrench")
    assert answer.code == 0, answer.err
    assert "no contact tipped" in answer.out
    leans = copsense(*run, "--reference", "ramp:5mm").error
    assert "hold the CoM's y fast" in leans
