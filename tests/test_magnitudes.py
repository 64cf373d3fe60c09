"""Millimetres, degrees, grams and upside-down frames are not taken in silence for what is meant.

One robot serves all: each call has a number that only another unit, or another sign, explains.
"""

import re
import warnings
from dataclasses import replace

import numpy as np
import pytest
from support.commands import copsense as run
from support.walkers import BIPED, FULL, bent, walker

import copsense
from copsense import Contact, Drives, Limits, Load, Plane, minimum_wrench, rectangle
from copsense.drives import Spring
from copsense.errors import CopsenseError
from copsense.loads import SpringLoad
from copsense.magnitudes import MagnitudeWarning
from copsense.maps import Axis, Grid, map_postures
from copsense.optimisation import optimise, pareto_front
from copsense.optimisation.question import required_of
from copsense.path import LateralPath, com_sweep
from copsense.reach import robot_reach
from copsense.regions import com_region
from copsense.robots import ImplausibleStanceWarning, plausibility_notes
from copsense.robots.plausibility import ceiling_notes
from copsense.simulation import ModelError
from copsense.sole import read_sole

MILLIMETRES = r"Lengths are in metres: {0:g} mm are {1:g} m"
DEGREES = r"Angles are in radians \(in degrees on the command line\): {0:g} degrees are {1:g}"


@pytest.fixture(scope="module")
def stance():
    return standing()


def standing(text=None, **options):
    options = {"contacts": BIPED, "contact_at": "sole", "posture": bent(), **options}
    return copsense.load_stance(text or walker(), **options)


def stands_on(contact):
    return standing(contacts=[contact, "r_foot"], contact_at="frame")


def grid(name, start, stop):
    return Grid((Axis(name, start, stop, 3),))


# Call, the millimetres that it may mean, and what those are [m].
LENGTHS = [
    (lambda s: copsense.lateral_sweep(s, -70, 70, 5), 70, 0.07),
    (lambda s: com_sweep(s, "com_x", -0.1, 0.1, 3, held={"com_z": 500}), 500, 0.5),
    (lambda s: copsense.lateral_sweep(s, -0.1, 0.1, 3, com_x=40), 40, 0.04),
    (lambda s: LateralPath(s, 150), 150, 0.15),
    (lambda s: copsense.solve_posture(s, com=(30, None, None)), 30, 0.03),
    (lambda s: standing(width=140), 140, 0.14),
    (lambda s: stands_on(Contact("l_foot", plane=Plane((0, 0, 400)))), 200, 0.2),
    (lambda s: Contact("l_foot", offset=(0, 0, -35)), 35, 0.035),
    (lambda s: Contact("l_foot").at_height(-35), 35, 0.035),
    (lambda s: rectangle((-70, 120), (-0.045, 0.05)), 190, 0.19),
    (lambda s: rectangle((-0.07, 0.12), (-45, 50)), 95, 0.095),
    (
        lambda s: Contact("l_foot", polygon=np.array([[-70.0, 0.0], [120.0, 0.0], [0.0, 1.0]])),
        190,
        0.19,
    ),
    (lambda s: Contact("l_foot", torsional_friction=20), 20, 0.02),
    (lambda s: s.robot.with_payload("trunk", 2.0, com=(0, 0, 100)), 100, 0.1),
    (
        lambda s: map_postures(s, grid("com_y", -70, 70), [minimum_wrench(1.0)], "x.zarr"),
        70,
        0.07,
    ),
    (lambda s: com_region(s, Limits(), tolerance=1), 1, 0.001),
    (lambda s: optimise(s, objective="gain", require={"travel": 40}), 40, 0.04),
    (lambda s: pareto_front(s, ("gain", "torque"), require={"sideways": 40}), 40, 0.04),
    (lambda s: read_sole(s.robot, Contact("l_foot"), thickness=1), 1, 0.001),
]
# Call, the degrees that it may mean, and what those are [rad].
ANGLES = [
    (lambda s: standing(base_rpy=(0, 0, 90)), 90, 1.571),
    (lambda s: standing(posture={"l_knee": 40}), 40, 0.6981),
    (lambda s: copsense.joint_sweep(s, "l_knee", 0, 40, 3), 40, 0.6981),
    (lambda s: copsense.solve_posture(s, joints={"l_knee": 40}), 40, 0.6981),
    (lambda s: s.robot.configuration(base_yaw=90), 90, 1.571),
    (lambda s: Contact("l_foot").turned(0, 90, 0), 90, 1.571),
    (lambda s: Plane.sloping(5.0), 5, 0.08727),
    (
        lambda s: map_postures(s, grid("l_knee", 0, 40), [minimum_wrench(1.0)], "x.zarr"),
        40,
        0.6981,
    ),
]


@pytest.mark.parametrize(
    ("calls", "hint"), [(LENGTHS, MILLIMETRES), (ANGLES, DEGREES)], ids=["lengths", "angles"]
)
def test_a_number_that_only_another_unit_explains_is_rejected_with_it(
    calls, hint, stance, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    for call, *numbers in calls:
        with pytest.raises(CopsenseError, match=hint.format(*numbers)):
            call(stance)


def test_what_may_be_meant_and_hardly_is_is_done_and_doubted(stance):
    hardly = [
        (lambda: stance.robot.with_payload("trunk", 2000.0), "2000 g are 2 kg"),
        (lambda: ModelError(payload={"trunk": 500.0}).applied(stance), "500 g are 0.5 kg"),
        (lambda: stance.with_loads([Load("trunk", force=(0, 0, -9e4))]), "force is 9e.04 N"),
        (lambda: stance.with_loads([Load("trunk", moment=(0, 9e4, 0))]), "moment is 9e.04 Nm"),
        (lambda: stance.with_loads([Load("trunk", point=(0, 0, 100))]), "100 mm are 0.1 m"),
        (lambda: stance.with_loads([SpringLoad("trunk", (300, 0, 0), (50, 0, 0))]), "its anchor"),
        (lambda: minimum_wrench(70), "70 mm are 0.07 m"),
        (lambda: Contact("l_foot", friction=60), "'l_foot': friction is 60.* 60 % are 0.6"),
        (lambda: Limits(friction=60), "limit friction is 60.* 60 % are 0.6"),
        (lambda: Limits(friction={"l_foot": 80}), "'l_foot' is 80.* 80 % are 0.8"),
        (lambda: required_of(stance, {"torque": 15000}), "15000 Nmm are 15 Nm"),
    ]
    for call, said in hardly:
        with pytest.warns(MagnitudeWarning, match=said):
            assert call() is not None


def test_what_no_posture_can_have_is_not_searched_for(stance):
    for require, said in (
        ({"margin": 30}, "a share of a limit, 1 at most: 30 % are 0.3"),
        ({"push": 4000.0}, f"up to the robot's weight, {stance.robot.weight:.4g} N"),
    ):
        with pytest.raises(CopsenseError, match=said):
            optimise(stance, objective="gain", require=require)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        bounds = {"margin": 1.0, "push": 40.0, "travel": 1.0, "torque": 60.0, "gain": 9.0}
        assert required_of(stance, bounds) == bounds


def test_drives_of_another_unit_and_soles_in_each_other_are_doubted(stance):
    hardly = [
        (lambda: standing(drives=Drives(held={"l_knee": 8000.0})), "8000 Nmm are 8 Nm"),
        (lambda: standing(drives=Drives(springs={"l_knee": Spring(9, 40)})), "40 degrees are 0.69"),
        (lambda: standing(width=0.04), "'l_foot' and 'r_foot' lie in each other by 50 %"),
    ]
    for call, said in hardly:
        with pytest.warns(ImplausibleStanceWarning, match=said):
            call()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        standing(drives=Drives(held={"l_knee": 8.0}, springs={"r_knee": Spring(9, 7.0)}))
        standing(width=0.08)  # they touch


def test_a_whole_configuration_in_degrees_is_rejected(stance):
    q = np.array(stance.q)
    q[7:] = np.degrees(q[7:])
    with pytest.raises(CopsenseError, match="Angles are in radians"):
        stance.at(q)


def test_a_joint_without_limits_may_turn_on_and_is_doubted():
    text = walker().replace('name="l_knee" type="revolute"', 'name="l_knee" type="continuous"')
    robot = copsense.Robot.from_urdf(text)
    with pytest.warns(MagnitudeWarning, match="'l_knee', which has no limits"):
        robot.configuration({"l_knee": 40.0})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        robot.configuration({"l_knee": 6.0})


@pytest.mark.parametrize("scale", [0.05, 6.0])
def test_robots_of_centimetres_and_of_six_metres_do_the_same_undoubted(scale):
    """Everything of the walker's size, larger and smaller: nothing is said of any of it."""
    text = walker(scale=1.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        stance = standing(_scaled(text, scale), width=0.25 * scale)
        copsense.lateral_sweep(stance, -0.02 * scale, 0.02 * scale, 2)
        far = copsense.lateral_sweep(stance, -3.0 * scale, 0.0, 2)
        com_region(stance, Limits(), tolerance=0.01 * scale)
        stance.with_loads([Load("trunk", force=(0.0, 0.0, -stance.robot.weight))])
        stance.robot.with_payload("trunk", stance.robot.mass)
    assert list(far.failures) == [0]  # out of reach is a row that says so
    assert robot_reach(stance.robot) == pytest.approx(scale * (0.1 + 0.6 + 0.05))


def _scaled(text, scale):
    """The same file with its lengths multiplied; masses and inertias stay."""

    def longer(match):
        numbers = " ".join(repr(float(n) * scale) for n in match[2].split())
        return f'{match[1]}"{numbers}"'

    return re.sub(r'((?:xyz|size)=)"([^"]*)"', longer, _axes_apart(text)).replace("AXIS", "xyz")


def _axes_apart(text):
    return text.replace("<axis xyz", "<axis AXIS")


def test_a_base_turned_upside_down_is_said_to_be_turned_back(stance):
    with pytest.warns(ImplausibleStanceWarning, match="180:0:0 degrees has contact 'l_foot' 180 d"):
        found = standing(base_rpy=(np.pi, 0, 0))
    assert found.com[2] == pytest.approx(stance.com[2], abs=0.02)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        standing(base_rpy=(0.1, -0.1, 2.0))  # a base that leans


def test_a_floor_that_faces_down_is_doubted_in_the_shell_too(stance, tmp_path):
    path = tmp_path / "walker.urdf"
    path.write_text(walker(), encoding="utf-8")
    feet = [word for foot in BIPED for word in ("--contact", foot)]
    for down, code in ((("l_foot",), {0, 2}), (BIPED, {0})):
        planes = [word for foot in down for word in ("--plane", f"{foot}=0:0:-1")]
        said = run("analyse", path, *feet, "--contact-at", "sole", *planes)
        assert said.code in code
        for foot in down:
            assert f"The plane of contact '{foot}' faces down, as a ceiling does" in said.err
    ceiling = Contact("l_foot", plane=Plane((0.0, 0.0, 0.5), (0.0, 0.0, -1.0)))
    low = stance.placements[1]
    high = [type(low)(low.rotation, low.translation + np.array([0, 0, 0.5])), low]
    assert ceiling_notes((ceiling, Contact("r_foot")), high, np.array([0.0, 0.0, 0.6])) == []


def test_soles_and_offsets_of_another_size_than_the_robot_are_doubted(stance):
    left, right = stance.contacts

    def notes(contact):
        found = copsense.Stance(stance.robot, stance.q, (contact, right), check=False)
        return plausibility_notes(found)

    assert notes(left) == ()
    thin = replace(left, polygon=rectangle((-0.02, 0.026), (-0.001, 0.001)))
    assert "The sole of 'l_foot' is 46 x 2 mm, thin under a robot of 0.75 m" in notes(thin)[0]
    line = replace(left, polygon=np.array([[-0.1, 0.0], [0.1, 0.0]]))
    assert notes(line) == ()  # a line is meant to be one
    wide = replace(left, polygon=rectangle((-1.9, 1.9), (-0.1, 0.1)))
    assert "3.8 m long" in notes(wide)[0]
    away = replace(left, offset=(0.0, 0.0, -3.5))
    assert "3.5 m from its frame" in notes(away)[0]


def test_the_command_names_the_unit(tmp_path):
    path = tmp_path / "walker.urdf"
    path.write_text(walker(FULL), encoding="utf-8")
    feet = [word for foot in BIPED for word in ("--contact", foot)]
    said = run("analyse", path, *feet, "--contact-at", "sole", "--width", "140")
    assert said.code == 2
    assert "the stance width (width, --width) is 140 m" in said.err
    assert "140 mm are 0.14 m (140mm on the command line)" in said.err
