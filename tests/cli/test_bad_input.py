"""Bad input to a command is one line on standard error, exit code 2, and no file touched."""

import numpy as np
import pytest
from support.commands import copsense

from copsense.files import load_configurations


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ("analyse absent.urdf", "no file at"),
        ("analyse .", "no robot named '.'"),
        ("analyse iccub", "Did you mean icub"),
        ("analyse icub --com-y 0.5", "no posture of 'icub'"),
        ("analyse icub --com-y nan", "the CoM's y [m] is nan"),
        ("analyse icub --com-x inf", "the CoM's x [m] is inf"),
        ("analyse icub --width 0", "the stance width [m] is 0.0"),
        ("analyse icub --width nan", "the stance width [m] is nan"),
        ("analyse icub --width 5", "'icub' reaches 0.73 m from its base"),
        ("analyse icub --contact l_sole --width 1", "Leave width out"),
        ("analyse icub --characteristic-length 0", "the characteristic length L [m] is 0.0"),
        ("analyse icub --characteristic-length nan", "the characteristic length L [m] is nan"),
        ("analyse icub --characteristic-length 1e-200", "between 1e-6 and 1e6"),
        ("analyse icub --sole 1:0:0:1", "the sole '1:0:0:1' is empty"),
        ("analyse icub --sole=-inf:1:0:1", "empty or not finite"),
        ("analyse icub --sole a:b", "Give X0:X1:Y0:Y1"),
        ("analyse icub --sole-height nan", "--sole-height is nan"),
        ("analyse icub --posture l_knee=nan", "the position of joint 'l_knee' is nan"),
        ("analyse icub --posture l_nee=3", "Did you mean l_knee"),
        ("analyse icub --posture l_knee", "Give JOINT=POSITION"),
        ("analyse icub --posture =3", "Give JOINT=POSITION"),
        ("analyse icub --joint l_knee=inf", "the position of joint 'l_knee' is inf"),
        ("analyse icub --joint l_nee=5", "Did you mean l_knee"),
        ("analyse icub --base-yaw nan", "base_rpy (--base-yaw, --base-rpy)"),
        ("analyse icub --along l_hip_rol", "Did you mean l_hip_roll"),
        ("analyse icub --contact l_soul", "Did you mean l_sole"),
        ("analyse icub --contact l_sole:surfce", "Did you mean surface"),
        ("analyse icub --contact l_sole:point", "span 3 of 6"),
        ("analyse icub --contact l_sole --contact l_sole", "share a name"),
        ("analyse icub --contact universe", "fixed in the world"),
        ("analyse icub --criterion least-effort", "minimum-tangential"),
        ("analyse icub --criterion min-torque", "Did you mean minimum-torque"),
        ("analyse icub --criterion min-torque", "weighted-torque:hip=2,knee=1,rest=1, stiffness:"),
        ("analyse icub --plot absent/icub.png", "Create it first"),
        ("analyse icub --plot icub.bmp", "Choose .png or .svg or .pdf"),
        ("analyse four_bar --base-yaw 10", "lives in a plane"),
        ("analyse four_bar --com-x 0.1", "its CoM has no x to choose"),
        ("analyse solo12 --sole 0:1:0:1", "every contact is a point"),
        ("four-bar --xi nan", "--xi is nan degrees. Give an angle over 0"),
        ("four-bar --xi 180", "such as 85, 85deg or 1.5rad"),
        ("four-bar --xi 0", "collapsed"),
        ("four-bar --leg-mass -1", "leg_mass is -1.0. Give a positive"),
        ("four-bar --xi=-0.1rad", "--xi is -5.72958 degrees"),
        ("balance icub --reference sine:20deg:1", "Give hold, sine:AMPLITUDE"),
        ("balance icub --reference sine:20mm:1s", "Give hold, sine:AMPLITUDE"),
        ("balance icub --reference ramp:1:2:3", "Give hold, sine:AMPLITUDE"),
        ("balance icub --push 0:40mm:0", "Give FX:FY:FZ"),
        ("balance icub --unknown-payload chest=1m", "Give FRAME=KG"),
        ("balance icub --torque-limit 20N", "Give Nm, model or JOINT=NM"),
        ("analyse icub --limits cop-margin=5deg", "Write, say, cop-margin=0.005, 5mm or"),
        ("analyse icub --limits torque=5N", "Write, say, torque=30Nm, torque=model or"),
        ("benchmark icub --disturbance sway:amplitude=39deg", "Give a length, such as"),
        ("benchmark icub --disturbance velocity_noise:severe=1m", "Give a rate, such as 1 (degree"),
        ("four-bar --leg-length nan", "leg_length is nan. Give a positive"),
        ("four-bar --criterion least-effort", "minimum-tangential"),
        (
            "four-bar --criterion minimum-wrench --characteristic-length 0",
            "characteristic-length is 0",
        ),
        ("four-bar --criterion weighted-torque --hip-weight 0", "hip-weight is 0"),
        ("four-bar --characteristic-length 0", "--characteristic-length is 0"),
        ("four-bar --hip-weight -1", "--hip-weight is -1"),
        ("four-bar --ankle-weight nan", "--ankle-weight is nan"),
        ("balance icub --gain com-stiffness=-3", "the gain com-stiffness is -3"),
        ("balance icub --gain com-damping=nan", "gain com_damping is not finite"),
        ("analyse icub --package-dir absent", "no folder 'absent' to look"),
        ("design icub --com-y 0:1:1", "5 postures of the path or more, around its middle; 1 of 1"),
        ("reproduce --output absent/report", "Create it first"),
        ("reproduce --output /proc/report", "cannot be written"),
        ("sweep icub", "say what to sweep"),
        (
            "sweep icub --com-y 0:1:3 --joint l_knee=0:1:2",
            "--com-y 0:1:3 and --joint l_knee=0:1:2 each sweep",
        ),
        ("sweep icub --com-y 30mm", "nothing is swept: --com-y with a single value holds. A range"),
        ("sweep icub --com-y 1:2", "Give START:STOP:COUNT"),
        ("sweep icub --com-y a:b:c", "Give START:STOP:COUNT"),
        ("sweep icub --com-y 0:0.01:2.5", "Give START:STOP:COUNT"),
        ("sweep icub --com-y 0:0.01:0", "a sweep of 0 postures"),
        ("sweep icub --com-y 0:0.01:-3", "a sweep of -3 postures"),
        ("sweep icub --com-y nan:nan:3", "a sweep's start is nan"),
        ("sweep icub --com-y 0:1:999999999999999", "Give a count from 1 to"),
        ("sweep icub --joint l_knee", "JOINT=START:STOP:COUNT to sweep it"),
        ("sweep icub --joint =0:1:2", "JOINT=START:STOP:COUNT to sweep it"),
        ("sweep icub --joint l_nee=0:1:2", "Did you mean l_knee"),
        ("sweep icub --configurations absent.csv", "no file of configurations"),
        ("sweep icub --com-y 0:0.01:2 --output absent/icub.nc", "Create it first"),
        ("sweep icub --com-y 0:0.01:2 --output icub.txt", "Choose .nc or .csv"),
        ("plot absent.nc", "copsense sweep"),
        ("analyze icub", "no command named 'analyze'. Did you mean analyse?"),
        ("walk", "copsense --help says"),
        ("optimize icub", "Did you mean optimise?"),
    ],
)
def test_bad_input_is_one_line_that_names_it(arguments, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    answer = copsense(*arguments.split())
    assert said in answer.error
    assert answer.out == ""
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "arguments",
    [
        ["analyse", ""],
        ["analyse", "icub", "--contact", ""],
        ["analyse", "icub", "--posture", ""],
        ["analyse", "icub", "--along", ""],
        ["analyse", "icub", "--plot", ""],
        ["analyse", "icub", "--criterion", ""],
        ["sweep", "four_bar", "--com-y", ""],
        ["sweep", "four_bar", "--configurations", ""],
        ["sweep", "four_bar", "--com-y", "0:0.01:2", "--output", ""],
        ["plot", ""],
    ],
    ids=" ".join,
)
def test_an_empty_text_is_not_taken_for_an_option_left_out(arguments):
    assert copsense(*arguments).error


@pytest.mark.parametrize(
    "arguments",
    [
        "robots --fast",
        "analyse",
        "analyse icub --com-y left",
        "analyse icub --contact-at toe",
        "four-bar --xi upright",
        "four-bar --leg-length 30deg",
        "balance icub --delay 2mm",
        "balance icub --velocity-noise 2deg",
        "reproduce --postures 3",
    ],
)
def test_bad_usage_shows_where_help_is(arguments):
    answer = copsense(*arguments.split())
    assert answer.code == 2
    assert "--help" in answer.err
    assert answer.err.count("Error: ") == 1
    assert answer.out == ""


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "is not XML"),
        (bytes(range(256)), "is not XML"),
        (b"<robot name='r'><link", "is not XML"),
        (b"<html/>", "starts with <html>"),
        (b"<robot name='r'/>", "it has no link"),
        (b"<mujoco/>", "no <body>"),
        (
            b"<robot name='r'><link name='a'><inertial>"
            b"<mass value='-1'/></inertial></link></robot>",
            "the mass of link 'a' is negative",
        ),
        (
            b"<mujoco><worldbody><body name='a'><joint name='j' type='hinge' axis='0 0 1'/>"
            b"<inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body></worldbody></mujoco>",
            "has no floating base",
        ),
    ],
)
def test_a_broken_description_is_one_line(content, said, tmp_path):
    path = tmp_path / "my röbot.urdf"
    path.write_bytes(content)
    error = copsense("analyse", path, "--contact", "sole").error
    assert said in error
    assert str(path) in error or "robot '" in error


def test_a_mesh_that_is_missing_names_the_option_that_finds_it(tmp_path):
    mesh = '<collision><geometry><mesh filename="package://a/b.stl"/></geometry></collision>'
    mass = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    path = tmp_path / "brick.urdf"
    path.write_text(
        f'<robot name="brick"><link name="brick">{mass}</inertial>{mesh}</link></robot>'
    )
    error = copsense("analyse", path, "--contact", "brick", "--contact-at", "sole").error
    assert "--package-dir" in error
    assert "--contact FRAME" in copsense("analyse", path).error
    assert copsense("analyse", path, "--contact", "brick").code == 0


@pytest.mark.parametrize("suffix", ["nc", "csv"])
def test_an_output_that_exists_is_kept_without_force(suffix, tmp_path):
    path = tmp_path / f"swept.{suffix}"
    path.write_text("old")
    arguments = ["sweep", "four_bar", "--com-y", "0:0.01:2", "--output", path]
    assert "--force" in copsense(*arguments).error
    assert path.read_text() == "old"
    assert copsense(*arguments, "--force").code == 0
    assert path.stat().st_size > 100
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_an_output_under_a_file_or_in_no_folder_is_rejected_before_the_sweep(tmp_path, monkeypatch):
    def never(*args, **kwargs):
        raise AssertionError("the sweep began")

    monkeypatch.setattr("copsense.path.lateral_sweep", never)
    (tmp_path / "file").write_text("mine")
    for path in (
        tmp_path / "file" / "a.nc",
        tmp_path / ("x" * 300 + ".nc"),
        tmp_path / "gone/a.nc",
    ):
        assert copsense("sweep", "four_bar", "--com-y", "0:0.01:2", "--output", path).error
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


def test_a_posture_out_of_reach_is_a_row_and_exit_code_1(tmp_path):
    path = tmp_path / "swept.nc"
    answer = copsense("sweep", "icub", "--com-y", "0:0.5:2", "--output", path)
    assert answer.code == 1
    assert "failed: posture 1, minimum-torque: no posture of 'icub'" in answer.err
    assert path.is_file()
    # A sweep with a failed row is drawn like any other.
    assert copsense("plot", path).code == 0


def test_a_picture_of_a_stance_never_replaces_a_file_unasked(tmp_path):
    picture = tmp_path / "stance.png"
    picture.write_text("old")
    assert "--force" in copsense("analyse", "four_bar", "--plot", picture).error
    assert picture.read_text() == "old"


def test_configurations_of_another_robot_say_what_fits(tmp_path):
    np.savetxt(tmp_path / "q.csv", np.zeros((2, 7)), delimiter=",")
    assert load_configurations(tmp_path / "q.csv").shape == (2, 7)
    error = copsense("sweep", "icub", "--configurations", tmp_path / "q.csv").error
    assert "(30,): base position, quaternion (x, y, z, w), then 23 joints" in error


def test_the_sole_of_a_planar_foot_can_be_given():
    answer = copsense("analyse", "four_bar", "--sole", "-0.01:0.01:-0.05:0.05", "--json")
    for row in answer.json["criteria"].values():
        for contact in row["contacts"].values():
            assert contact["margin"] == pytest.approx(0.01)


def test_the_height_of_a_sole_is_along_the_contact_s_normal():
    # The human's feet have y up.
    low, high = (
        copsense("analyse", "human", "--sole-height", h, "--json").json["com"][2]
        for h in ("-0.08", "-0.07")
    )
    assert low - high == pytest.approx(0.01, abs=1e-9)


def test_the_reason_of_a_bad_table_ends_in_one_full_stop(tmp_path):
    path = tmp_path / "bad.csv"
    path.write_text("1,2\n3,x\n")
    assert ".." not in copsense("sweep", "icub", "--configurations", path).error
