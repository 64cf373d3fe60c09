"""What the options of a stance say is written down whole, and every command takes them."""

import click
import numpy as np
import pytest
from support.commands import copsense
from support.driven_files import urdf

import copsense as library
from copsense import Load
from copsense.cli import copsense as group
from copsense.cli.stance_options import read_stance, stance_options
from copsense.drives import Transmission
from copsense.loads import SpringLoad
from copsense.robots import StanceFile

FEET = ("--contact", "l_foot", "--contact", "r_foot", "--contact-at", "sole")
BENT = tuple(
    word
    for s in "lr"
    for joint, angle in (("hip", -20), ("knee", 40), ("ankle", -20))
    for word in ("--posture", f"{s}_{joint}={angle}")
)
PUSHED = ("--load", "trunk=0:0:-20", "--spring-load", "l_foot@0.1:0:0=9:0:9:0:0:0")
GEARS = np.array([[1, 1.5], [0.5, -0.5]])
ROD = "l_rod@0.01:0:-0.24=l_ankle_link@-0.07:0:0.01"
LOOP = ("--loop", ROD, "--passive", "l_rod_top", "--passive", "l_ankle")
# Of each kind of option several; those of one line go together.
CHOICES = [
    [(), ("--com-y", "0.02"), ("--com-x", "10mm"), ("--com-y", "-0.01", "--com-x", "0.01")],
    [(), ("--com-z", "0.62"), ("--joint", "l_knee=45"), ("--joint", "r_hip=-0.4rad")],
    [(), ("--load", "trunk=1:2:-20:0.5:0:1"), ("--load", "trunk@0:0:0.2=0:0:-9")],
    [(), ("--body-load", "r_foot=3:2:1"), ("--body-load", "trunk@0:0.1:0=1:0:0:0:0:2")],
    [(), ("--spring-load", "trunk=50:0:90:0.2:0.3:0.6:1:2:3"), PUSHED],
    [(), ("--payload", "trunk=2"), ("--payload", "l_shin@0:0:-0.1=500e-3kg")],
    [(), ("--held", "l_knee=0.5"), ("--spring", "r_knee=30:20deg", "--held", "r_knee=-2Nm")],
    [(), ("--lock", "l_yaw"), ("--couple", "r_yaw=-1*l_yaw+2deg")],
    [(), ("--transmission", "r_ankle=1*a+1*b,r_ankle_roll=0.5*a-0.5*b,a=30,b=40")],
    [("--lock", "l_crank", "--lock", "l_rod_top"), LOOP],
    [(), ("--ground", "l_foot=0:5:0.01"), ("--contact-friction", "l_foot=0.6:0.02")],
    [(), ("--width", "0.24"), ("--sole", "l_foot=0.1:0,-0.05:0.04,-0.05:-0.04")],
]


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    path = tmp_path_factory.mktemp("robot") / "robot.urdf"
    path.write_text(urdf(rods=True), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    path = tmp_path_factory.mktemp("plain") / "plain.urdf"
    path.write_text(urdf(), encoding="utf-8")
    return path


def stance_of(*words):
    """The stance that options describe, as any command reads it."""

    @click.command()
    @stance_options
    def read(robot, limits, **options):
        return read_stance(robot, **options)

    return read.main([str(word) for word in words], standalone_mode=False)


def check_same(one, other, tolerance=1e-12):
    np.testing.assert_allclose(one.q, other.q, atol=tolerance, rtol=0)
    assert one.robot.payloads == other.robot.payloads
    assert one.loads == other.loads
    assert repr(one.robot.drives) == repr(other.robot.drives)
    assert one.robot.torque_names == other.robot.torque_names
    for a, b in zip(one.robot.drives.transmissions, other.robot.drives.transmissions, strict=True):
        assert (a.motors, a.joints, a.effort_limits) == (b.motors, b.joints, b.effort_limits)
        np.testing.assert_array_equal(a.matrix, b.matrix)
    for a, b in zip(one.contacts, other.contacts, strict=True):
        for name in ("frame", "kind", "plane", "friction", "torsional_friction"):
            assert getattr(a, name) == getattr(b, name)
        for name in ("offset", "rotation", "polygon"):
            np.testing.assert_allclose(getattr(a, name), getattr(b, name), atol=tolerance)


def check_alike(one, other, tolerance):
    """The same answer as JSON, numbers within a tolerance."""
    if isinstance(one, dict):
        assert one.keys() == other.keys()
        for key in one:
            check_alike(one[key], other[key], tolerance)
    elif isinstance(one, list):
        for a, b in zip(one, other, strict=True):
            check_alike(a, b, tolerance)
    elif isinstance(one, float):
        assert other == pytest.approx(one, rel=tolerance, abs=tolerance)
    else:
        assert one == other


@pytest.mark.parametrize("seed", range(8))
def test_what_options_say_is_the_same_when_it_is_read(robot, tmp_path, seed):
    rng = np.random.default_rng(seed)
    words = [word for choice in CHOICES for word in choice[rng.integers(len(choice))]]
    file = tmp_path / "stance.toml"
    words += ["--lock", "r_crank", "--lock", "r_rod_top"]
    stance = stance_of(robot, *FEET, *BENT, *words, "--save-stance", file)
    check_same(stance, library.load_stance(file))


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ("icub", ("--com-y", "0.03", "--com-x", "5mm", "--joint", "l_elbow=30")),
        ("icub", ("--com-z", "0.49", "--load", "l_hand=0:0:-20", "--along", "l_hip_roll")),
        ("four_bar", ("--com-y", "0.02", "--contact-friction", "l_sole=0.5")),
        ("solo12", ("--com-x", "0.01", "--com-y", "-0.01", "--lock", "FL_HAA")),
        ("rods", (*FEET, *BENT, *LOOP, "--lock", "r_crank", "--com-y", "0.02")),
    ],
)
def test_a_stance_that_was_moved_has_the_same_analysis_when_it_is_read(
    robot, tmp_path, source, words
):
    file = tmp_path / "stance.toml"
    along = words[-2:] if "--along" in words else ()
    given = (robot if source == "rods" else source, *words)
    once = copsense("analyse", *given, "--save-stance", file, "--json")
    again = copsense("analyse", "--stance", file, *along, "--json")
    check_alike(once.json, again.json, 1e-9)
    moved = {"com_y": 0.03, "com_x": 0.005} if "5mm" in words else {}
    if moved:  # and the same from Python
        analysis = library.analyse(
            library.load_stance("icub"), joints={"l_elbow": np.radians(30)}, **moved
        )
        assert once.json["com"] == analysis.to_dict()["com"]


def test_a_stance_file_keeps_the_criteria_that_were_named_and_no_default(tmp_path):
    def kept(*words):
        file = tmp_path / f"{len(list(tmp_path.iterdir()))}.toml"
        assert copsense("analyse", *words, "--save-stance", file).code == 0
        return file, [c.name for c in StanceFile.read(file).criteria]

    plain_file, names = kept("solo12")
    assert names == []  # so that a command that takes one criterion has its own default
    assert copsense("hardware", "--stance", plain_file, "--rows", "1").code == 0
    named, names = kept("solo12", "--criterion", "minimum-wrench")
    assert names == ["minimum-wrench"]
    assert kept("--stance", named)[1] == names
    two = ("--criterion", "minimum-wrench", "--criterion", "minimum-torque")
    both, names = kept("solo12", *two)
    assert names == ["minimum-wrench", "minimum-torque"]
    error = copsense("hardware", "--stance", both).error
    assert "2 criteria (minimum-wrench, minimum-torque), and this command takes one" in error


def test_loads_springs_and_friction_are_what_they_say(plain):
    stance = stance_of(
        plain, *FEET, *BENT,
        "--load", "trunk@0:0:0.2=1:2:-20:0.5:0:1", "--body-load", "l_shin=3:2:1",
        "--spring-load", "trunk=500N/m:0:90:20cm:0.3:0.6:1:2:3", "--payload", "r_shin@0:0:-0.1=0.5",
        "--contact-friction", "l_foot=0.6:20mm", "--contact-friction", "r_foot=0.4",
        "--sole", "l_foot=0.1:0,-0.05:0.04,-0.05:-0.04", "--sole", "-0.02:0.1:-0.04:0.04",
    )  # fmt: skip
    assert stance.loads == (
        Load("trunk", (1, 2, -20), (0.5, 0, 1), (0, 0, 0.2)),
        Load("l_shin", (3, 2, 1), fixed_to="body"),
        SpringLoad("trunk", (0.2, 0.3, 0.6), (500, 0, 90), (1, 2, 3)),
    )
    (payload,) = stance.robot.payloads
    assert (payload.frame, payload.mass, payload.com) == ("r_shin", 0.5, (0, 0, -0.1))
    left, right = stance.contacts
    assert (left.friction, left.torsional_friction) == (0.6, 0.02)
    assert (right.friction, right.torsional_friction) == (0.4, None)
    assert len(left.polygon) == 3
    np.testing.assert_allclose(np.ptp(right.polygon, axis=0), (0.12, 0.08))


def test_held_locked_and_geared_joints_are_what_they_say(plain):
    gears = "l_ankle=1*in+1.5*out,l_ankle_roll=.5*in-5e-1*out,out=40"
    stance = stance_of(
        plain, *FEET, *BENT, "--transmission", gears, "--held", "l_knee=0.5", "--lock", "l_yaw"
    )
    drives = stance.robot.drives
    (found,) = drives.transmissions
    wanted = Transmission(("in", "out"), ("l_ankle", "l_ankle_roll"), GEARS)
    assert (found.motors, found.joints) == (wanted.motors, wanted.joints)
    np.testing.assert_array_equal(found.matrix, wanted.matrix)
    assert found.effort_limits == (np.inf, 40.0)
    assert dict(drives.held) == {"l_knee": 0.5}
    assert "l_yaw" not in stance.robot.joint_names
    assert {"in", "out"} < set(stance.robot.torque_names)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--load", "trunk=1:2"), "Give FRAME=FX:FY:FZ"),
        (("--load", "trunk@1:2=1:2:3"), "Give X:Y:Z in metres"),
        (("--body-load", "trunk=1:2:x"), "'x' is not understood"),
        (("--spring-load", "trunk=1:2:3"), "Give FRAME=KX:KY:KZ"),
        (("--spring-load", "trunk=-1:2:3:0:0:0"), "not negative"),
        (("--payload", "trunk=1Nm"), "'1Nm' is not understood"),
        (("--held", "l_knee"), "JOINT=TORQUE"),
        (("--held", "l_knee=1", "--held", "l_knee=2"), "twice for l_knee"),
        (("--held", "l_kne=1"), "Did you mean l_knee"),
        (("--lock", "l_kne"), "Did you mean l_knee"),
        (("--transmission", "l_knee=2"), "JOINT=RATIO*MOTOR"),
        (("--transmission", "l_knee=2*a*b"), "JOINT=RATIO*MOTOR"),
        (("--transmission", "l_knee=2*a,c=3"), "named 'c'"),
        (("--transmission", "l_knee=2*a,a=x"), "'x' is not understood"),
        (("--loop", "l_foot=r_foot:ball:0:0:1"), "gives an axis"),
        (("--contact-friction", "foot=1"), "named 'foot'"),
        (("--sole", "foot=0:1:0:1"), "named 'foot'"),
        (("--sole", "l_foot=0:0,1:0,x:1"), "'x' is not understood"),
        (("--joint", "l_knee=1", "--joint", "l_knee=2"), "given twice"),
        (("--com-y", "4"), "no posture"),
    ],
)
def test_what_is_not_understood_is_rejected(plain, words, said):
    assert said in copsense("analyse", plain, *FEET, *BENT, *words).error


def test_every_command_of_a_stance_has_the_same_options():
    context = click.Context(group)

    def names(command):
        return {
            option: param.name
            for param in group.get_command(context, command).params
            for option in param.opts
            if option.startswith("--")
        }

    usual = names("push")
    usual = {o: n for o, n in usual.items() if o not in ("--at", "--point", "--plot")}
    assert {"--com-x", "--joint", "--lock", "--spring-load", "--loop", "--limits"} < set(usual)
    for command in ("analyse", "sweep", "map", "balance", "benchmark", "design"):
        own = names(command)
        single = {"--criterion", "--characteristic-length"} if command == "design" else set()
        assert set(usual) - single <= set(own), command
    inspected = names("inspect")
    assert {"--passive", "--loop", "--transmission", "--sole", "--plane"} < set(inspected)


def test_a_map_does_not_vary_what_is_placed(tmp_path):
    out = ("--output", tmp_path / "m.zarr")
    for over, words, said in (
        ("com_y=0:0.01:2", ("--com-y", "0.02"), "com_y is varied, so --com-y"),
        ("base_x=0:0.01:2", ("--com-x", "0.02"), "base_x is varied, so --com-x"),
        ("l_elbow=0:10:2", ("--joint", "l_elbow=20"), "l_elbow is varied, so --joint"),
    ):
        assert said in copsense("map", "icub", "--over", over, *words, *out).error
    assert not (tmp_path / "m.zarr").exists()


def test_a_sweep_holds_what_has_one_value():
    words = ("--com-x", "10mm", "--joint", "l_elbow=30", "--com-y", "0:0.01:2")
    told = copsense("sweep", "icub", *words, "--criterion", "minimum-torque", "--json").json
    assert told["coordinate"] == "com_y"
    home = library.load_stance("icub")
    stance = library.posture.move_stance(home, com_x=0.01, joints={"l_elbow": np.radians(30)})
    path = library.path.com_sweep(
        stance, "com_y", 0, 0.01, 2, held={"com_x": 0.01, "l_elbow": np.radians(30)}
    )
    swept = library.sweep(path, [library.minimum_torque()])
    assert told["criteria"] == swept.to_dict()["criteria"]
    for here, tangent in path:
        assert here.com[0] == pytest.approx(0.01, abs=1e-11)
        assert here.robot.joint_position(here.q, "l_elbow") == pytest.approx(np.radians(30))
        assert here.com_jacobian @ tangent == pytest.approx([0, 1, tangent @ here.com_jacobian[2]])
    assert "--com-y with a single value holds" in copsense("sweep", "icub", "--com-y", "0.01").error
    two = ("--com-y", "0:1:2", "--com-x", "0:1:2")
    assert "a sweep is along one" in copsense("sweep", "icub", *two).error
    rows = ("--configurations", "rows.csv", "--com-y", "0.1")
    assert "and so does --com-y" in copsense("sweep", "icub", *rows).error
    assert (
        "a design sweeps the CoM along one axis" in copsense("design", "icub", "--com-y", "0").error
    )


def test_the_line_of_an_inspection_keeps_contacts_and_drives(robot, plain):
    words = (*LOOP, "--lock", "r_crank", "--held", "l_hip=1")
    told = copsense("inspect", robot, *words, "--json").json
    line = told["analyse"].split()
    assert line[:3] == ["copsense", "analyse", str(robot)]
    for option, value in zip(words[::2], words[1::2], strict=True):
        assert f"{option}={value}" in line
    assert "l_ankle" not in told["motors"]
    assert "r_crank" not in [joint["name"] for joint in told["joints"]]
    assert copsense(*line[1:], "--json").json["mass"] == told["mass"]
    step = ("--contact", "l_foot", "--contact", "r_foot", "--sole", "-0.05:0.1:-0.04:0.04",
            "--sole-height", "-0.05", "--plane", "r_foot=0:0:1:0:0:0.01")  # fmt: skip
    line = copsense("inspect", plain, *step, "--json").json["analyse"].split()
    assert "--sole=-0.05:0.1:-0.04:0.04" in line
    assert line.count("--contact=r_foot") == line.count("--plane=r_foot=0:0:1:0:0:0.01") == 1
    high = copsense(*line[1:], "--json").json["contacts"]
    assert high[1]["position"][2] - high[0]["position"][2] == pytest.approx(0.01)
    assert "which they are is not said" in copsense("inspect", plain, "--sole", "0:1:0:1").error
    preset = copsense("inspect", "icub", "--lock", "torso_yaw", "--json").json
    assert preset["analyse"] == "copsense analyse icub --lock=torso_yaw"


def test_a_stance_file_says_what_the_shell_says(robot, tmp_path):
    feet = "".join(f'[[contacts]]\nframe = "{s}_foot"\n' for s in "lr")
    angles = "\n".join(
        f"{s}_{joint} = {angle}"
        for s in "lr"
        for joint, angle in (("hip", -20), ("knee", 40), ("ankle", -20))
    )
    (tmp_path / "stance.toml").write_text(
        f'robot = "{robot}"\ncontact_at = "sole"\nlocked = ["l_crank", "l_rod_top"]\n'
        f"com_x_m = 0.01\ncom_y_m = 0.02\n[posture_deg]\n{angles}\n"
        f"[joints_deg]\nl_knee = 45\n{feet}"
    )
    words = ("--lock", "l_crank", "--lock", "l_rod_top", "--com-x", "0.01", "--com-y", "0.02")
    stance = stance_of(robot, *FEET, *BENT, *words, "--joint", "l_knee=45")
    check_same(stance, library.load_stance(tmp_path / "stance.toml"))
    (tmp_path / "more.toml").write_text('robot = "icub"\nlocked = ["torso_yaw"]\n')
    locked = library.load_stance(tmp_path / "more.toml")  # the preset's feet and posture come along
    assert locked.contact_names == ("l_sole", "r_sole")
    assert "torso_yaw" not in locked.robot.joint_names


def test_loads_of_a_file_stay_beside_those_of_the_shell(plain, tmp_path):
    file = tmp_path / "stance.toml"
    stance_of(plain, *FEET, *BENT, "--load", "trunk=0:0:-9", "--save-stance", file)
    both = stance_of("--stance", file, "--load", "l_shin=1:0:0")
    assert [load.frame for load in both.loads] == ["trunk", "l_shin"]


def test_a_stance_file_goes_where_a_robots_name_goes(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    file = "t.toml"
    words = ("--com-y", "0.01", "--limits", "friction=0.5", "--criterion", "minimum-wrench")
    once = copsense("analyse", "four_bar", *words, "--save-stance", file, "--json")
    again = copsense("analyse", file, "--json")
    check_alike(once.json, again.json, 1e-9)
    assert f"note: limits from {file}: friction=0.5." in again.err  # never in silence
    assert "limits from" not in copsense("analyse", file, "--limits", "friction=0.3").err
    assert list(copsense("analyse", file, "--json").json["criteria"]) == ["minimum-wrench"]
    assert "no limit active" in copsense("sweep", file, "--com-y", "0:1mm:2").out
    inspected = copsense("inspect", file)
    assert inspected.out.endswith(f"to analyse it:\n  copsense analyse {file}\n")
    assert "says what its robot is" in copsense("inspect", file, "--contact", "l_sole").error
    for command in ("log", "identify"):
        assert "no log at 'x.csv'" in copsense(command, "x.csv", "--stance", file).error
    assert library.load_robot(file).joint_names == library.load_robot("four_bar").joint_names


def test_what_stands_beside_a_stance_file_is_named(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    library.robots.save_stance(library.load_stance("four_bar"), "t.toml")
    for words, said in (
        (("analyse", "icub", "--stance", "t.toml", "--width", "1"), "ROBOT (icub) and --width."),
        (("analyse", "t.toml", "--soles", "visual"), "so does --soles."),
        (("push", "--stance", "t.toml", "--passive", "x", "--lock", "y"), "--lock and --passive."),
        (("analyse", "t.toml", "--stance", "t.toml"), "both say which robot"),
        (("benchmark", "t.toml", "--stance", "t.toml"), "both say which robot"),
    ):
        assert said in copsense(*words).error


def test_a_stance_file_that_was_moved_says_where_it_looked(tmp_path, plain):
    file, moved = plain.parent / "t.toml", tmp_path / "t.toml"
    assert copsense("analyse", plain, *FEET, *BENT, "--save-stance", file).code == 0
    moved.write_text(file.read_text("utf-8"), "utf-8")
    error = copsense("analyse", moved).error
    assert f"no robot at 'plain.urdf', seen from the folder {tmp_path}." in error
    moved.write_text('robot = "other.toml"', "utf-8")
    assert "names another one, other.toml" in copsense("analyse", moved).error
