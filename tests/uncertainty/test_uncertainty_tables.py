"""What an uncertainty may say: units in the keys, names or patterns, and one error for the rest."""

import math

import pytest

import copsense
from copsense.errors import CopsenseError, InvalidInputError, ModelLoadError, UnknownNameError
from copsense.uncertainty import Source, Uncertainty, sources_of


def read(tmp_path, text):
    path = tmp_path / "unsure.toml"
    path.write_text(text, encoding="utf-8")
    return Uncertainty.read(path)


def names(uncertainty, stance, limits=None):
    return {s.name: s.deviation for s in sources_of(uncertainty, stance, limits)}


def test_units_are_in_the_keys(tmp_path, icub):
    found = read(
        tmp_path,
        """
        sigmas = 3
        [links.chest]
        mass_percent = 10.0
        com_m = [0.001, 0.002, 0.0]
        [links.l_ankle_2]
        mass_kg = 0.05
        [joints.l_knee]
        offset_deg = 1.0
        torque_Nm = 0.5
        [ground]
        pitch_deg = 2.0
        [contacts.l_sole]
        height_m = 0.003
        yaw_deg = 1.0
        sole_yaw_deg = 0.5
        friction = 0.1
        [[payloads]]
        frame = "r_hand"
        mass_kg = 0.1
        """,
    )
    assert found.sigmas == 3.0
    bodies = dict(zip(icub.robot.model.names, icub.robot.model.inertias, strict=True))
    limits = copsense.Limits(friction=0.5)
    assert names(found, icub, limits) == pytest.approx(
        {
            "mass of chest": 0.1 * bodies["torso_yaw"].mass,
            "mass of l_ankle_2": 0.05,
            "CoM x of chest": 0.001,
            "CoM y of chest": 0.002,
            "payload at r_hand": 0.1,
            "offset of l_knee": math.radians(1.0),
            "torque of l_knee": 0.5,
            "pitch of ground": math.radians(2.0),
            "height of l_sole": 0.003,
            "yaw of l_sole": math.radians(1.0),
            "sole yaw of l_sole": math.radians(0.5),
            "friction of l_sole": 0.1,
        }
    )


def test_names_come_before_patterns_and_patterns_before_the_star(icub):
    found = Uncertainty(
        joints={
            "*": {"offset_deg": 1.0},
            "*knee*": {"offset_deg": 2.0},
            "l_knee": {"offset_deg": 3.0, "torque_Nm": 1.0},
        }
    )
    said = names(found, icub)
    assert said["offset of l_knee"] == pytest.approx(math.radians(3.0))
    assert said["offset of r_knee"] == pytest.approx(math.radians(2.0))
    assert said["offset of l_elbow"] == pytest.approx(math.radians(1.0))
    assert "torque of r_knee" not in said


def test_what_it_says_can_be_written_and_read_again(icub):
    usual = Uncertainty.default(icub)
    assert Uncertainty.from_dict(usual.to_dict()) == usual
    assert hash(Uncertainty.from_dict(usual.to_dict())) == hash(usual)
    assert len(repr(usual)) < 200


@pytest.mark.parametrize("robot", ["icub", "talos", "solo12", "four_bar", "cassie"])
def test_the_default_has_a_meaning_on_every_robot(stance_of, robot):
    stance = stance_of(robot)
    kinds = {source.kind for source in sources_of(Uncertainty.default(stance), stance)}
    assert {"mass", "offset", "slope"} <= kinds


def test_patterns_pass_over_what_they_have_no_meaning_for(stance_of):
    stance = stance_of("solo12")
    found = names(
        Uncertainty(contacts={"*": {"x_m": 0.01, "yaw_deg": 1.0, "friction": 0.1}}), stance
    )
    assert set(found) == {f"x of {name}" for name in stance.contact_names}
    # Heel and toe of one foot keep their distance.
    cassie = stance_of("cassie")
    both = Uncertainty(contacts={"*": {"x_m": 0.01}}, ground={"roll_deg": 1.0})
    assert set(names(both, cassie)) == {"roll of ground"}


BAD = {
    "sigmas = 0": "sigmas of an uncertainty is 0. Give a positive",
    "": "says nothing that is uncertain",
    "[links.chest]\nmass_percent = -5": 'mass_percent in [links."chest"] is -5. Give a standard',
    "[links.chest]\nmass_percent = 120": "Give less than 100 per cent",
    "[links.chest]\nmass_percent = 5\nmass_kg = 1": "has mass_percent and mass_kg",
    '[links.chest]\nmass_percent = "5"': "Give a finite number",
    "[links.chest]\nmass_percent = nan": "Give a finite number",
    "[links.chest]\ncom_m = [1, 2]": "Give finite numbers of shape (3,)",
    "[links.chest]\ncom_m = 5.0": "Lengths are in metres",
    "[links.chest]\nmas_percent = 5": "Did you mean mass_percent",
    "[link.chest]\nmass_percent = 5": "Did you mean links",
    "links = 3": "links is 3. Write a table",
    "[links]\nchest = 5": 'links."chest" is 5. Write a table',
    "[joints.l_knee]\noffset_deg = 90": "Give less than 45",
    "[ground]\nyaw_deg = 1": "no key of [ground] named 'yaw_deg'",
    "[contacts.l_sole]\nx_mm = 2": "Did you mean x_m",
    "payloads = 3": "payloads is 3. Write a list",
    '[[payloads]]\nframe = "l_hand"': "mass_kg of a payload is None",
    '[[payloads]]\nframe = "l_hand"\nmass_kg = -1': "mass_kg of the payload at 'l_hand' is -1",
    "[links.chest": "is not valid TOML",
}


@pytest.mark.parametrize("text", BAD)
def test_a_file_that_is_wrong_says_what(tmp_path, text):
    with pytest.raises(CopsenseError) as caught:
        read(tmp_path, text)
    assert BAD[text] in str(caught.value)
    assert str(caught.value).endswith(".")


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(
        ModelLoadError, match=r"no uncertainty at .*absent.toml'. Give a .toml file"
    ):
        Uncertainty.read(tmp_path / "absent.toml")


WITHOUT_MEANING = [
    ({"links": {"ches": {"mass_kg": 1.0}}}, UnknownNameError, "Did you mean chest"),
    ({"links": {"l_sole": {"mass_kg": 1.0}}}, UnknownNameError, "'l_sole' is fixed to 'l_ankle_2'"),
    ({"links": {"chest": {"mass_kg": 5.0}}}, InvalidInputError, "it could be negative"),
    ({"joints": {"l_nee": {"offset_deg": 1.0}}}, UnknownNameError, "Did you mean l_knee"),
    ({"joints": {"l_knee": {"offset_m": 0.1}}}, InvalidInputError, "l_knee turns. Give offset_deg"),
    ({"joints": {"*knee": {"torque_N": 1.0}}}, InvalidInputError, "turns. Give torque_Nm"),
    ({"contacts": {"l_foot": {"x_m": 0.1}}}, UnknownNameError, "Valid: l_sole, r_sole"),
    ({"contacts": {"l_sole": {"friction": 0.1}}}, InvalidInputError, "the limits have no friction"),
    ({"contacts": {"*": {"friction": 0.1}}}, InvalidInputError, "nothing of the uncertainty has"),
    ({"payloads": [{"frame": "l_had", "mass_kg": 1.0}]}, UnknownNameError, "Did you mean l_hand"),
    ({"payloads": [{"frame": "l_hand", "mass_kg": 9.0}]}, InvalidInputError, "could be negative"),
    ({"joints": {"l_knee": {"offset_deg": 0.0}}}, InvalidInputError, "nothing of the uncertainty"),
    (
        {"joints": {"*knee": {"offset_deg": 1.0}, "l_*": {"offset_deg": 2.0}}},
        InvalidInputError,
        "both fit l_knee",
    ),
]


@pytest.mark.parametrize(("data", "error", "said"), WITHOUT_MEANING)
def test_an_uncertainty_without_meaning_for_the_robot_is_an_error(icub, data, error, said):
    with pytest.raises(error) as caught:
        sources_of(Uncertainty.from_dict(data), icub)
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("robot", "data", "limits", "said"),
    [
        ("solo12", {"contacts": {"FL_FOOT": {"yaw_deg": 1.0}}}, None, "which has no yaw there"),
        ("solo12", {"contacts": {"FL_FOOT": {"sole_x_m": 0.1}}}, None, "has no sole. Give x_m"),
        ("icub", {"contacts": {"l_sole": {"friction": 0.1}}}, copsense.Limits(), "no limit of"),
        (
            "icub",
            {"contacts": {"l_sole": {"friction": 0.1}}},
            copsense.Limits(friction=0.5, torsion="cone"),
            "the exact wrench cone is not linear",
        ),
        ("four_bar", {"ground": {"pitch_deg": 1.0}}, None, "lives in a plane"),
        ("cassie", {"contacts": {"left-toe": {"x_m": 0.01}}}, None, "are on one link"),
    ],
)
def test_nor_may_a_contact_have_what_it_has_not(stance_of, robot, data, limits, said):
    with pytest.raises(InvalidInputError) as caught:
        sources_of(Uncertainty.from_dict(data), stance_of(robot), limits)
    assert said in str(caught.value)


def test_a_joint_without_a_motor_has_no_torque_to_be_off(icub):
    robot = icub.robot.without_motors(["l_elbow"])
    stance = copsense.Stance(robot, icub.q, icub.contacts)
    with pytest.raises(InvalidInputError, match="no motor drives l_elbow"):
        sources_of(Uncertainty(joints={"l_elbow": {"torque_Nm": 1.0}}), stance)


def test_a_source_is_of_a_kind_and_a_unit_that_there_is():
    with pytest.raises(UnknownNameError, match="kind of source"):
        Source("weight", "chest", "", 1.0, "kg")
    with pytest.raises(UnknownNameError, match="unit of a mass"):
        Source("mass", "chest", "", 1.0, "g")
    with pytest.raises(InvalidInputError, match="Give zero or more"):
        Source("mass", "chest", "", -1.0, "kg")
