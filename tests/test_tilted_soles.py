"""A sole that is tilted against its frame is named with its angle; one that is a line stands."""

import warnings
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from support.commands import copsense as run
from support.tiny import FEET, MJCF, urdf

import copsense
from copsense import Contact
from copsense.batch import evaluate_batch
from copsense.errors import InvalidInputError, ModelLoadError
from copsense.polygon import Polygon
from copsense.sole import levelled, read_sole


def tilted(roll=0.0, pitch=0.0, shape='<box size="0.2 0.1 0.02"/>'):
    """The tiny robot with feet turned by roll and pitch [deg] against their frames."""
    r, p = np.radians([roll, pitch])
    return urdf(
        f'<collision><origin rpy="{r} {p} 0" xyz="0 0 0"/><geometry>{shape}</geometry></collision>'
    )


def sole_of(text):
    return read_sole(copsense.Robot.from_urdf(text), Contact("left"))


@pytest.mark.parametrize("degrees", [1.5, -4.0, 12.0])
@pytest.mark.parametrize("way", ["roll", "pitch"])
def test_the_tilt_of_a_box_is_the_angle_it_was_turned_by(way, degrees):
    sole = sole_of(tilted(**{way: degrees}))
    assert np.degrees(sole.tilt) == pytest.approx(abs(degrees), abs=1e-2)
    assert len(sole.polygon) == 2


def test_a_level_box_and_one_within_the_lowest_millimetre_have_no_tilt():
    assert sole_of(tilted()).tilt == 0.0
    nearly = sole_of(tilted(roll=0.3))  # 0.1 m wide: 0.5 mm
    assert nearly.tilt == 0.0
    assert len(nearly.polygon) == 4


def test_a_tilted_sole_is_named_with_its_angle_and_its_frame():
    with pytest.warns(copsense.robots.ContactGeometryWarning, match="tilted") as notes:
        copsense.load_stance(tilted(pitch=3.0), contacts=FEET, contact_at="sole")
    said = [str(note.message) for note in notes if "tilted by 3.0 deg" in str(note.message)]
    assert [frame for frame in FEET if any(f"frame '{frame}'" in s for s in said)] == FEET


def test_a_sole_tilted_both_ways_touches_in_a_corner_and_says_why():
    with pytest.raises(ModelLoadError, match=r"single point.*because .*tilted by 5\.0 deg.*Turn"):
        sole_of(tilted(roll=3.0, pitch=4.0))


def test_a_given_polygon_needs_no_word_about_the_tilt():
    contacts = [Contact(f, polygon=copsense.rectangle((-0.1, 0.1), (-0.05, 0.05))) for f in FEET]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        copsense.load_stance(tilted(pitch=3.0), contacts=contacts, contact_at="frame")


def test_a_capsule_lies_on_a_line_and_a_sloping_one_says_its_slope():
    def sole(degrees):
        capsule = f'<geom type="capsule" size=".02 .05" euler="0 {degrees} 0"/>'
        text = MJCF.replace('<geom type="box" size=".1 .05 .01"/>', capsule)
        return read_sole(copsense.load_robot(text), Contact("left"))

    assert len(sole(90).polygon) == 2
    assert sole(90).tilt == 0.0
    with pytest.raises(ModelLoadError, match=r"tilted by 6\.0 deg"):
        sole(96)


def test_any_line_is_a_polygon_whose_margin_is_to_its_nearer_end():
    rng = np.random.default_rng(5)
    for _ in range(200):
        ends = rng.uniform(-0.2, 0.2, (2, 2))
        if rng.random() < 0.3:
            ends[1, rng.integers(2)] = 0.0
            ends[0] *= ends[1] != 0  # along an axis
            ends[0] -= 0.1 * ends[1]
        share = rng.uniform(0.0, 1.0)
        point = ends[0] + share * (ends[1] - ends[0])
        expected = min(share, 1 - share) * np.linalg.norm(ends[1] - ends[0])
        sole = Contact("foot", polygon=ends).sole
        assert isinstance(sole, Polygon)
        assert sole.margin(point).distance == pytest.approx(expected, abs=1e-12)
        # Off the line there is nothing to stand on, however far the ends are.
        along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
        off = rng.uniform(-0.1, 0.1)
        aside = point + off * np.array([-along[1], along[0]])
        found = sole.margin(aside)
        assert found.distance == pytest.approx(-abs(off), abs=1e-12)
        assert found.edge in (2, 3)
        assert found.side.endswith("of its line")
        np.testing.assert_allclose(found.normal * abs(off), aside - point, atol=1e-12)
        assert sole.margins(np.array([point, aside])).tolist() == pytest.approx(
            [expected, -abs(off)], abs=1e-12
        )
        beyond = ends[1] + 0.05 * along + 0.02 * np.array([-along[1], along[0]])
        assert sole.margin(beyond).distance == pytest.approx(-0.05, abs=1e-12)


@pytest.mark.parametrize(("roll", "pitch"), [(3.0, 0.0), (0.0, -7.0), (3.0, 4.0), (-12.0, 5.0)])
def test_a_levelled_contact_lies_on_the_whole_of_its_sole(roll, pitch):
    robot = copsense.Robot.from_urdf(tilted(roll, pitch))
    contact = levelled(robot, Contact("left", offset=(0.01, 0.0, 0.0)))
    box = pin.rpy.rpyToMatrix(*np.radians([roll, pitch, 0.0]))
    # Corners are told apart to 1e-9 m, over edges of 0.1 m.
    np.testing.assert_allclose(contact.normal, box[:, 2], rtol=0, atol=2e-8)
    assert contact.offset == (0.01, 0.0, 0.0)
    turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), box[:, 2]).matrix()
    np.testing.assert_allclose(contact.rotation, turn, rtol=0, atol=2e-8)  # and no yaw
    sole = read_sole(robot, contact)
    assert sole.tilt == 0.0
    assert Polygon(sole.polygon).area == pytest.approx(0.2 * 0.1, rel=1e-6)
    assert sole.height == pytest.approx(-0.01, abs=1e-9)


def test_a_level_sole_a_point_and_a_polygon_are_not_turned():
    robot = copsense.Robot.from_urdf(tilted())
    for contact in (Contact("left"), Contact("left", kind="point")):
        assert levelled(robot, contact) is contact
    with pytest.raises(InvalidInputError, match="Leave the polygon out"):
        levelled(robot, Contact("left", polygon=copsense.rectangle((-0.1, 0.1), (-0.05, 0.05))))


def test_a_sloping_capsule_is_levelled_to_its_line():
    text = MJCF.replace(
        '<geom type="box" size=".1 .05 .01"/>',
        '<geom type="capsule" size=".02 .05" euler="0 96 0"/>',
    )
    robot = copsense.load_robot(text)
    sole = read_sole(robot, levelled(robot, Contact("left")))
    assert len(sole.polygon) == 2
    assert sole.size[0] == pytest.approx(0.1, abs=1e-9)


def test_soles_are_levelled_in_python_in_a_stance_file_and_in_the_shell(tmp_path):
    path = tmp_path / "tilted.urdf"
    path.write_text(tilted(pitch=3.0), encoding="utf-8")
    (tmp_path / "stance.toml").write_text(
        'robot = "tilted.urdf"\ncontact_at = "sole"\nlevel_soles = true\n'
        + "".join(f'[[contacts]]\nframe = "{foot}"\n' for foot in FEET),
        encoding="utf-8",
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", copsense.robots.StandingWarning)  # legs of one joint
        stance = copsense.load_stance(path, contacts=FEET, contact_at="sole", level_soles=True)
        again = copsense.load_stance(tmp_path / "stance.toml")
    np.testing.assert_allclose(again.q, stance.q, rtol=0, atol=1e-12)
    # The feet stand on their soles, the links 3 degrees off.
    assert stance.placements[0].rotation[2, 2] == pytest.approx(1.0, abs=1e-9)
    feet = [word for foot in FEET for word in ("--contact", foot)]
    said = run("analyse", path, *feet, "--contact-at", "sole", "--level-soles", "--json",
               "--save-stance", tmp_path / "saved.toml")  # fmt: skip
    assert "turned by 3.0 deg to lie flat" in said.err
    saved = copsense.load_stance(tmp_path / "saved.toml")
    np.testing.assert_allclose(saved.q, stance.q, rtol=0, atol=1e-12)
    np.testing.assert_allclose(
        saved.contacts[0].rotation, stance.contacts[0].rotation, rtol=0, atol=1e-12
    )


def test_a_foot_on_a_line_tips_as_soon_as_its_cop_leaves_it(icub):
    line = copsense.rectangle((-0.05, 0.1))
    contacts = [replace(c, polygon=line) for c in icub.contacts]
    stance = copsense.Stance(icub.robot, icub.q, contacts)
    found = copsense.cop_sensitivity(stance, copsense.minimum_torque())
    off = np.abs(found.cop[:, 1])
    assert off.min() > 1e-6
    table = copsense.analyse(stance, [copsense.minimum_torque()]).to_dict()
    rows = table["criteria"]["minimum-torque"]["contacts"]
    for k, name in enumerate(stance.contact_names):
        assert rows[name]["margin"] == pytest.approx(-off[k], abs=1e-12)
        assert rows[name]["tipping_edge"] in (2, 3)
        # Back on the line by the steepest way, to first order of f_z p_y.
        share, slope = found.equilibrium.wrenches[k, 2] / stance.robot.weight, found.load_gain[k]
        rate = share * found.com_gain[k, 1] + found.cop[k, 1] * slope
        back = -share * off[k] / np.linalg.norm(rate)
        assert found.com_travel[k] == pytest.approx(back, rel=1e-9)
    # The other criterion keeps the CoP on the line here, and leaves it with the first step.
    on = copsense.cop_sensitivity(stance, copsense.minimum_wrench(1.0))
    assert np.abs(on.cop[:, 1]).max() < 1e-9
    assert on.com_travel.tolist() == [0.0, 0.0]
    batch = evaluate_batch(stance, icub.q[None], [copsense.minimum_torque()])
    np.testing.assert_allclose(batch.com_travel[0, 0], found.com_travel, rtol=1e-9)
    np.testing.assert_allclose(batch.margin[0, 0], -off, rtol=0, atol=1e-12)
