"""A stance written down is the same stance when it is read, in Python and in the shell."""

import json

import numpy as np
import pytest
from click.testing import CliRunner
from support.commands import copsense as run_command
from support.driven_robots import everything, standing

import copsense
from copsense import Contact, Limits, Load
from copsense.batch import chart_posture
from copsense.cli import copsense as command
from copsense.criterion_text import criterion_from_text
from copsense.errors import (
    CopsenseError,
    InvalidInputError,
    ModelLoadError,
    OutputError,
    UnknownNameError,
)
from copsense.loads import SpringLoad
from copsense.posture import carry_payload
from copsense.robots import StanceFile, save_stance


def same(one, other):
    np.testing.assert_allclose(one.q, other.q, atol=1e-14, rtol=0)
    assert one.loads == other.loads
    assert one.robot.payloads == other.robot.payloads
    for a, b in zip(one.contacts, other.contacts, strict=True):
        assert (a.frame, a.kind, a.name, a.offset, a.plane, a.friction) == (
            b.frame,
            b.kind,
            b.name,
            b.offset,
            b.plane,
            b.friction,
        )
        np.testing.assert_allclose(a.rotation, b.rotation, atol=1e-15)
        assert (a.polygon is None) == (b.polygon is None)
        if a.polygon is not None:
            np.testing.assert_array_equal(a.polygon, b.polygon)
    found, again = (copsense.cop_sensitivity(s, copsense.minimum_torque()) for s in (one, other))
    np.testing.assert_allclose(found.matrix, again.matrix, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("name", ["icub", "solo12", "four_bar", "talos"])
def test_a_preset_comes_back_as_it_was(stance_of, tmp_path, name):
    stance = stance_of(name)
    save_stance(stance, tmp_path / "stance.toml")
    same(stance, copsense.load_stance(tmp_path / "stance.toml"))


def test_loads_payloads_limits_and_criteria_come_back(icub, tmp_path):
    limits = Limits(friction=0.5, torque="model", torsion=None, normal_force={"l_sole": 5.0})
    criteria = [copsense.minimum_torque(tie_break=copsense.minimum_wrench(0.5))]
    stance = carry_payload(icub, "l_hand", 2.0, com=(0.0, 0.0, 0.05)).with_loads(
        [
            Load("r_hand", (0, 0, -10), (1, 0, 0), fixed_to="body", name="bag"),
            SpringLoad("l_hand", (0, 0.2, 0.6), (100, 0, 0)),
        ]
    )
    file = tmp_path / "stance.toml"
    save_stance(stance, file, limits=limits, criteria=criteria)
    same(stance, copsense.load_stance(file))
    read = StanceFile.read(file)
    assert read.limits == limits
    assert list(read.criteria) == criteria
    with pytest.raises(OutputError, match=r"stance\.toml exists already\. .*--force-stance "):
        save_stance(stance, file)


NAMED = [
    "minimum-wrench",
    "limit-weighted-torque",
    "weighted-torque:hip=2,knee=1,rest=0.5",
    "stiffness:hip=4000,ankle=1000,rest=2000,mx=2800,my=700",
]


def test_a_file_takes_the_texts_of_the_option_and_writes_them_back(icub, tmp_path):
    file = tmp_path / "stance.toml"
    expected = [criterion_from_text(text) for text in NAMED]
    file.write_text(f'robot = "icub"\ncriteria = {json.dumps([*NAMED, NAMED[0]])}\n')
    assert list(StanceFile.read(file).criteria) == expected
    own = copsense.minimum_wrench(0.2)  # no text says its length
    save_stance(icub, file, criteria=[*expected, own], overwrite=True)
    written = StanceFile.read(file)
    assert written.data["criteria"] == [*NAMED, own.to_dict()]
    assert list(written.criteria) == [*expected, own]


def test_the_command_keeps_criteria_as_they_were_named(tmp_path):
    file = tmp_path / "stance.toml"
    words = [word for text in NAMED[2:] for word in ("--criterion", text)]
    assert run_command("analyse", "icub", *words, "--save-stance", file).code == 0
    assert StanceFile.read(file).data["criteria"] == NAMED[2:]
    assert list(run_command("analyse", "--stance", file, "--json").json["criteria"]) == NAMED[2:]


@pytest.mark.parametrize(
    "text", ["minimum-torqe", "weighted-torque:hip=0", "stiffness:hip=stiff", "stiffness", "a:b=1"]
)
def test_a_file_rejects_a_criterion_as_the_option_does(tmp_path, text):
    file = tmp_path / "stance.toml"
    file.write_text(f'robot = "icub"\ncriteria = ["{text}"]\n')
    expected = run_command("analyse", "icub", "--criterion", text).error
    assert run_command("analyse", file).error == f"{expected} The stance file is {file}."


@pytest.mark.parametrize(
    ("value", "said"), [('"minimum-torque"', "Write a list"), ("[3]", "neither a text nor a table")]
)
def test_criteria_of_a_file_that_are_no_list_or_no_criterion_are_one_clear_error(
    tmp_path, value, said
):
    file = tmp_path / "stance.toml"
    file.write_text(f'robot = "icub"\ncriteria = {value}\n')
    assert said in run_command("analyse", file).error


def test_a_length_beside_the_criteria_of_a_file_is_rejected(tmp_path):
    file = tmp_path / "stance.toml"
    file.write_text('robot = "icub"\ncriteria = ["minimum-wrench"]\n')
    length = ("--characteristic-length", "0.1")
    assert "--criterion minimum-wrench." in run_command("analyse", file, *length).error
    assert run_command("analyse", file, *length, "--criterion", "minimum-wrench").code == 0


def test_drives_and_locked_joints_come_back(tmp_path):
    robot = copsense.load_robot("icub")
    kept = [j for j in robot.joint_names if "shoulder" not in j]
    drives = copsense.Drives(
        motors=tuple(j for j in kept if j != "l_elbow"),
        springs={"l_elbow": copsense.drives.Spring(20.0, 0.5)},
        couplings=(),
    )
    from copsense.posture import solve_posture

    base = copsense.load_stance("icub")
    less = copsense.Stance(
        robot.keeping(kept), robot.keeping(kept).configuration(), base.contacts, False
    )
    stance = solve_posture(
        copsense.Stance(
            less.robot.with_drives(drives),
            less.q,
            [Contact(c.frame, polygon=c.polygon) for c in base.contacts],
            False,
        )
    ).stance
    save_stance(stance, tmp_path / "stance.toml", robot="icub")
    again = copsense.load_stance(tmp_path / "stance.toml")
    assert again.robot.torque_names == stance.robot.torque_names
    same(stance, again)


def test_a_robot_without_a_file_needs_one_and_another_robot_is_rejected(icub, tmp_path):
    model = everything()
    with pytest.raises(InvalidInputError, match="not read from a file"):
        save_stance(standing(model), tmp_path / "a.toml")
    with pytest.raises(InvalidInputError, match="not the robot"):
        save_stance(icub, tmp_path / "a.toml", robot="talos")
    assert not (tmp_path / "a.toml").exists()


URDF = """<robot name="table">
  <link name="base"><inertial><mass value="8"/><origin xyz="0.01 0 0"/>
    <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  {legs}
</robot>"""
LEG = """<link name="{n}"><inertial><mass value="0.5"/><origin xyz="0 0 -0.1"/>
  <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="j_{n}" type="revolute"><parent link="base"/><child link="{n}"/>
  <origin xyz="{x} {y} 0"/><axis xyz="0 1 0"/>
  <limit lower="-1" upper="1" effort="20" velocity="5"/></joint>
  <link name="{n}_tip"/><joint name="f_{n}" type="fixed"><parent link="{n}"/>
  <child link="{n}_tip"/><origin xyz="0 0 -0.2"/></joint>"""


@pytest.fixture
def table(tmp_path):
    """A four-legged table beside a stance file written by hand."""
    legs = "".join(
        LEG.format(n=f"leg{i}", x=x, y=y)
        for i, (x, y) in enumerate([(0.2, 0.1), (0.2, -0.1), (-0.2, 0.1), (-0.2, -0.1)])
    )
    (tmp_path / "table.urdf").write_text(URDF.format(legs=legs))
    contacts = "".join(
        f'[[contacts]]\nframe = "leg{i}_tip"\nkind = "point"\nfriction = 0.7\n' for i in range(4)
    )
    file = tmp_path / "stance.toml"
    file.write_text(
        'robot = "table.urdf"\ncriteria = ["minimum-wrench"]\n'
        "[posture_deg]\nj_leg0 = 5.0\nj_leg1 = 5.0\n[limits]\nfriction = 0.4\n" + contacts
    )
    return file


def test_a_file_written_by_hand_stands_up(table):
    stance = copsense.load_stance(table)
    assert stance.robot.name == "table"
    assert [c.friction for c in stance.contacts] == [0.7] * 4
    np.testing.assert_allclose([p.translation[2] for p in stance.placements], 0.0, atol=1e-9)


def test_commands_take_a_stance_file_with_its_limits_and_criteria(table):
    def answer(*words):
        run = CliRunner().invoke(command, [*words, "--json"], catch_exceptions=False)
        assert run.exit_code == 0, run.output
        return json.loads(run.stdout)

    told = answer("analyse", "--stance", str(table))
    assert list(told["criteria"]) == ["minimum-wrench"]
    expected = copsense.analyse(
        copsense.load_stance(table), [copsense.minimum_wrench(1.0)], Limits(friction=0.4)
    )
    for name, row in expected.to_dict()["criteria"]["minimum-wrench"]["contacts"].items():
        mine = told["criteria"]["minimum-wrench"]["contacts"][name]
        np.testing.assert_allclose(mine["wrench"], row["wrench"], atol=1e-6)
    given = answer("analyse", "--stance", str(table), "--limits", "friction=0.9")
    margins = [each["criteria"]["minimum-wrench"]["limit_margins"] for each in (given, told)]
    assert margins[0] != margins[1]


def test_what_a_command_writes_another_reads(tmp_path):
    file = tmp_path / "there.toml"
    words = ["analyse", "icub", "--com-y", "0.02", "--load", "l_hand=0:0:-10", "--json"]
    first = CliRunner().invoke(command, [*words, "--save-stance", str(file)])
    assert first.exit_code == 0, first.output
    again = CliRunner().invoke(command, ["analyse", "--stance", str(file), "--json"])
    one, other = json.loads(first.stdout), json.loads(again.stdout)
    assert one["com"] == pytest.approx(other["com"], abs=1e-9)
    for name, row in one["criteria"].items():
        assert row["torque_norm"] == pytest.approx(other["criteria"][name]["torque_norm"], rel=1e-6)


BAD = {
    "robot = 3": (InvalidInputError, "robot"),
    'robt = "icub"': (UnknownNameError, "robot"),
    'robot = "icub': (ModelLoadError, "TOML"),
    'robot = "nobot"': (CopsenseError, "nobot"),
    'robot = "icub"\n[posture]\nl_knee = 3': (UnknownNameError, "posture_deg"),
    'robot = "icub"\n[posture_deg]\nl_kne = 3': (UnknownNameError, "l_knee"),
    'robot = "icub"\n[posture_deg]\nl_knee = "bent"': (InvalidInputError, "l_knee"),
    'robot = "icub"\n[[contacts]]\nframe = "l_sole"\noffset_m = [1, 2]': (
        InvalidInputError,
        "offset_m",
    ),
    'robot = "icub"\n[[contacts]]\nkind = "point"': (InvalidInputError, "frame"),
    'robot = "icub"\n[configuration]\nbase = [0, 0, 0]': (InvalidInputError, "l_knee"),
    'robot = "icub"\n[[loads]]\nframe = "l_hand"\nforce = [0, 0, 1]': (UnknownNameError, "force_N"),
    'robot = "icub"\n[[spring_loads]]\nframe = "l_hand"': (InvalidInputError, "anchor_m"),
    'robot = "icub"\n[[payloads]]\nframe = "l_hand"': (InvalidInputError, "mass_kg"),
    'robot = "icub"\nlocked = ["elbow"]': (UnknownNameError, "l_elbow"),
    'robot = "icub"\n[drives]\nmotor = []': (UnknownNameError, "motors"),
    'robot = "icub"\n[[drives.loops]]\nframe_a = "l_hand"': (InvalidInputError, "frame_b"),
    'robot = "icub"\n[posture_m]\nl_knee = 0.3': (InvalidInputError, "posture_deg or posture_rad"),
    'robot = "icub"\n[joints_m]\nl_knee = -0.3': (InvalidInputError, "joints_deg or joints_rad"),
    'robot = "icub"\n[at_deg]\ncom_y = 2': (InvalidInputError, r"com_y, which is in metres.*at_m"),
    'robot = "icub"\n[at_m]\npitch = 0.1': (InvalidInputError, "at_deg or at_rad"),
    'robot = "icub"\n[at_m]\ncom_w = 0.1': (UnknownNameError, "com_x"),
    'robot = "icub"\n[at_m]\ncom_z = 9': (CopsenseError, "com_z"),
    'robot = "icub"\ncom_y_m = 0.01\n[at_m]\ncom_x = 0': (InvalidInputError, "Leave one out"),
    'robot = "icub"\nloads = 3': (InvalidInputError, "loads"),
}


@pytest.mark.parametrize("text", BAD)
def test_a_bad_file_is_one_clear_error(tmp_path, text):
    file = tmp_path / "bad.toml"
    file.write_text(text)
    error, said = BAD[text]
    with pytest.raises(error, match=said):
        copsense.load_stance(file)


def test_a_file_and_a_robot_or_an_argument_contradict_each_other(table):
    run = CliRunner().invoke(command, ["analyse", "icub", "--stance", str(table)])
    assert isinstance(run.exception, InvalidInputError)
    run = CliRunner().invoke(command, ["analyse"])
    assert run.exit_code == 2
    assert "--stance FILE" in run.output
    with pytest.raises(InvalidInputError, match="Change the file"):
        copsense.load_stance(table, width=0.2)
    with pytest.raises(ModelLoadError, match=r"missing\.toml"):
        copsense.load_stance(table.parent / "missing.toml")


def test_coordinates_of_a_chart_are_those_of_the_command(tmp_path):
    """The one posture, said in a file, in the shell and in Python."""
    path = tmp_path / "lean.toml"
    path.write_text(
        'robot = "icub"\n[at_m]\ncom_y = 0.02\n"l_sole:x" = 0.03\n[at_deg]\npitch = 4.0\n',
        encoding="utf-8",
    )
    read = copsense.load_stance(path)
    at = {"com_y": 0.02, "l_sole:x": 0.03, "pitch": np.radians(4.0)}
    np.testing.assert_allclose(
        read.q, chart_posture(copsense.load_stance("icub"), at).q, atol=1e-12
    )
    assert read.com[1] == pytest.approx(0.02, abs=1e-9)
    saved = tmp_path / "saved.toml"
    words = ["--at", "com_y=20mm", "--at", "l_sole:x=0.03", "--at", "pitch=4"]
    run = CliRunner().invoke(command, ["analyse", "icub", *words, "--save-stance", str(saved)])
    assert run.exit_code == 0, run.output
    np.testing.assert_allclose(copsense.load_stance(saved).q, read.q, atol=1e-12)


def test_drives_that_were_taken_off_a_file_stay_off(tmp_path):
    """Or the robot's own file would put them back without a word."""
    legs = "".join(
        LEG.format(n=f"leg{i}", x=x, y=y)
        for i, (x, y) in enumerate([(0.2, 0.1), (0.2, -0.1), (-0.2, 0.1), (-0.2, -0.1)])
    )
    limit = '<limit lower="-1" upper="1" effort="20" velocity="5"/></joint>'
    mimic = legs.replace(limit, f'<mimic joint="j_leg1"/>{limit}', 1)
    (tmp_path / "table.urdf").write_text(URDF.format(legs=mimic))
    robot = copsense.load_robot(tmp_path / "table.urdf")
    assert robot.drives.couplings
    contacts = [Contact(f"leg{i}_tip", kind="point") for i in range(4)]
    stance = copsense.load_stance(robot.with_drives(copsense.Drives()), contacts=contacts)
    save_stance(stance, tmp_path / "stance.toml")
    again = copsense.load_stance(tmp_path / "stance.toml")
    assert not again.robot.drives
    assert again.robot.torque_names == stance.robot.torque_names


def test_a_configuration_and_how_to_stand_up_contradict_each_other(icub, tmp_path):
    path = tmp_path / "stance.toml"
    save_stance(icub, path)
    path.write_text("width_m = 0.2\n" + path.read_text("utf-8"), encoding="utf-8")
    with pytest.raises(InvalidInputError, match=r"width_m says how to stand up.*Leave one out"):
        copsense.load_stance(path)


def test_the_command_says_in_which_stance_file_something_is_wrong(tmp_path):
    path = tmp_path / "wrong.toml"
    path.write_text('robot = "icub"\n[posture_m]\nl_knee = 0.3\n', encoding="utf-8")
    error = run_command("analyse", "--stance", path).error
    assert "posture_deg or posture_rad" in error
    assert error.endswith(f"The stance file is {path}.")
