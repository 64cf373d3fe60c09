"""What of a robot may be changed: names, pairs, sizes, and what has no meaning for it."""

import numpy as np
import pytest

import copsense
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.hardware import (
    changed,
    changed_travel,
    hardware_effects,
    hardware_parameters,
    hardware_sweep,
    parameter_named,
)
from copsense.hardware.effects import nominal_ends
from copsense.hardware.pairs import all_alike, mirrored
from copsense.path import LateralPath
from copsense.scan import PathScan

TORQUE = copsense.minimum_torque()


@pytest.fixture(scope="module")
def icub_effects(icub):
    return hardware_effects(icub, TORQUE)


def test_left_and_right_are_found_by_their_names():
    names = ["chest", "l_leg", "r_leg", "LFoot", "RFoot", "leg_left_1", "leg_right_1", "l_tail"]
    assert mirrored(names) == {
        "chest": ("chest",),
        "leg": ("l_leg", "r_leg"),
        "Foot": ("LFoot", "RFoot"),
        "leg_1": ("leg_left_1", "leg_right_1"),
        "l_tail": ("l_tail",),
    }
    legs = ["FL_HIP", "FR_HIP", "RL_HIP", "RR_HIP"]
    assert mirrored(legs) == {"F_HIP": tuple(legs[:2]), "R_HIP": tuple(legs[2:])}
    assert all_alike(legs) == {"HIP": tuple(legs)}
    assert all_alike(["LF_HIP", "RF_HIP", "LH_HIP", "RH_HIP"])["HIP"][2:] == ("LH_HIP", "RH_HIP")
    # A name that is taken already is not given again.
    assert list(mirrored(["leg", "l_leg", "r_leg"])) == ["leg", "l_leg+r_leg"]


def test_what_the_icub_and_a_quadruped_have(icub, stance_of):
    named = {p.name: p for p in hardware_parameters(icub)}
    assert named["sole_length"].nominal == pytest.approx(0.195, abs=1e-3)
    assert named["ankle_height"].nominal == pytest.approx(0.0645, abs=1e-4)
    assert named["mass@upper_leg"].where == ("l_upper_leg", "r_upper_leg")
    soles = [c.sole.vertices for c in icub.contacts]
    assert named["sole_outer"].nominal == pytest.approx(
        np.mean([soles[0][:, 1].max(), -soles[1][:, 1].min()])
    )
    solo = {p.name for p in hardware_parameters(stance_of("solo12"))}
    assert {"hip_width", "hip_length", "length@LOWER_LEG", "mass@base_link"} <= solo
    assert not any(name.startswith(("sole", "ankle")) for name in solo)


def test_a_changed_robot_stands_on_the_same_places(icub):
    values = {
        parameter_named("hip_width", icub): 0.08,
        parameter_named("ankle_height", icub): 0.08,
        parameter_named("mass@chest", icub): 12.0,
        parameter_named("length@l_lower_leg", icub): 0.205,
        parameter_named("sole_inner", icub): 0.06,
    }
    there, criterion = changed(icub, TORQUE, values)
    assert criterion is TORQUE
    for before, after in zip(icub.placements, there.placements, strict=True):
        np.testing.assert_allclose(after.homogeneous, before.homogeneous, rtol=0, atol=1e-11)
    np.testing.assert_allclose(there.com[:2], icub.com[:2], rtol=0, atol=1e-11)
    assert there.robot.mass - icub.robot.mass == pytest.approx(12.0 - values_of(icub, "mass@chest"))
    again = {p.name: p.nominal for p in hardware_parameters(there)}
    assert again["hip_width"] == pytest.approx(0.08, abs=1e-4)  # the trunk leans a little
    assert again["ankle_height"] == pytest.approx(0.08)
    assert again["sole_inner"] == pytest.approx(0.06)
    legs = {p.name: p.nominal for p in hardware_parameters(there, single=True)}
    assert legs["length@l_lower_leg"] == pytest.approx(0.205)
    assert legs["length@r_lower_leg"] == pytest.approx(values_of(icub, "length@r_lower_leg"))


def values_of(stance, name):
    return parameter_named(name, stance).nominal


def test_effects_are_ranked_and_their_checks_agree(icub, icub_effects):
    found = icub_effects
    order = found.ranking["lengths"]
    assert [found.parameters[i].name for i in order[:2]] == ["sole_inner", "sole_width"]
    assert found.smallest == pytest.approx(0.0458, abs=5e-5)
    p = found.parameters[order[0]]
    more = changed_travel(icub, TORQUE, found.limits, {p: p.nominal + 1e-3})
    gained = more.smallest - found.smallest
    assert gained == pytest.approx(found.gains(found.units)[order[0], 2], rel=0.02)
    assert found.better[order[0]] == "more"
    assert "best of lengths: sole_inner" in str(found)
    row = found.to_dict()["parameters"]["sole_inner"]
    assert row["rank"] == 1
    assert row["per_unit_more"]["smallest"] == pytest.approx(0.715, abs=2e-3)


def test_a_sweep_says_with_which_values_the_robot_cannot_stand(stance_of, tmp_path):
    bar = stance_of("four_bar")
    now = hardware_effects(bar, TORQUE)
    found = hardware_sweep(bar, TORQUE, "hip_width", [0.12, 1.4], nominal=now)
    assert list(found.failures) == [1.4]
    assert "contact l_sole along y remains" in found.failures[1.4]
    assert found.best.value == 0.12
    assert "1400.0 mm  cannot stand: no posture" in str(found)
    table = found.to_pandas()
    assert table["reason"][1].startswith("no posture")
    assert found.to_xarray()["travel"].sel(value=0.12, side="smallest") == found.best.smallest
    written = found.save(tmp_path / "hips.csv").read_text()
    assert written.startswith("parameter,value,unit,travel_+y_m")
    with pytest.raises(InvalidInputError, match="cannot stand with any of these values"):
        _ = hardware_sweep(bar, TORQUE, "hip_width", [1.4], nominal=now).best


def test_effects_are_written_for_other_tools(icub_effects, tmp_path):
    import xarray as xr

    file = icub_effects.save(tmp_path / "icub.nc")
    with xr.open_dataset(file) as read:
        assert float(read["per_unit_more"].sel(parameter="sole_inner", side="+y")) > 0.7
        assert str(read["unit"].sel(parameter="mass@chest").values) == "kg"
    rows = icub_effects.save(tmp_path / "icub.csv").read_text().splitlines()
    assert rows[0].startswith("parameter,group,rank,changes,nominal,unit")
    assert rows[1].startswith("sole_inner,lengths,1,")


@pytest.mark.parametrize(
    ("robot", "name", "message"),
    [
        ("solo12", "sole_width", "has no sole_width: it stands on contacts without such a sole"),
        ("solo12", "ankle_height", "it stands on points, which have no ankle"),
        ("icub", "stiffness@l_knee", "its criterion has no stiffnesses of joints"),
        ("icub", "spring", "none of its joints has a spring"),
        ("icub", "mass", "mass of what"),
        ("icub", "mass@tail", "Valid: mass@root_link"),
        ("icub", "sole_widht", "Did you mean sole_width"),
    ],
)
def test_a_parameter_without_meaning_is_one_error(stance_of, robot, name, message):
    with pytest.raises((InvalidInputError, UnknownNameError), match=message):
        parameter_named(name, stance_of(robot))


def test_values_that_nothing_has_are_rejected(icub):
    for name, value in (
        ("mass@chest", 0.0),
        ("hip_width", -0.1),
        ("sole_inner", -0.06),
        ("length@upper_leg", 0.0),
        ("ankle_height", 50.0),
        ("mass@chest", np.nan),
    ):
        with pytest.raises(InvalidInputError, match=name):
            parameter_named(name, icub).checked(value)


def test_what_moves_nothing_and_what_has_no_travel_are_errors(icub, stance_of):
    bar = stance_of("four_bar")
    mass = [p for p in hardware_parameters(bar) if p.kind == "mass"]
    with pytest.raises(InvalidInputError, match="no dimension, mass or stiffness of 'four_bar'"):
        hardware_effects(bar, TORQUE, parameters=mass)
    with pytest.raises(InvalidInputError, match="mass@hip moves nothing of 'four_bar'"):
        hardware_sweep(bar, TORQUE, "mass@hip", [7.0])
    aside = copsense.posture.move_stance(icub, com_y=0.06)
    with pytest.raises(InvalidInputError, match="as it stands the robot is beyond r_sole"):
        hardware_effects(aside, TORQUE)
    with pytest.raises(InvalidInputError, match="hardware is of a robot at rest"):
        hardware_effects(icub.moving(np.zeros(29), np.zeros(29)), TORQUE)
    cone = copsense.Limits(friction=0.4, torsion="cone")
    sole = [parameter_named("sole_inner", icub)]
    with pytest.raises(InvalidInputError, match="leaves out what changes a sole: sole_inner"):
        hardware_effects(icub, TORQUE, cone, sole)
    with pytest.raises(InvalidInputError, match="a step of 150%"):
        hardware_effects(icub, TORQUE, step=1.5)


def test_no_limit_before_the_limbs_end_is_said_as_such(icub):
    unlimited = copsense.Limits(normal_force=None, friction=None, cop_margin=None)
    far = PathScan(LateralPath(icub, reach=0.5), TORQUE)
    with pytest.raises(InvalidInputError, match=r"before the limbs of 'icub' end: .* goes \d+ mm"):
        nominal_ends(far, unlimited)


def test_what_is_of_another_robot_is_one_error(icub, icub_effects, stance_of):
    bar = stance_of("four_bar")
    hips = parameter_named("hip_width", icub)
    for question in (
        lambda: hardware_effects(bar, TORQUE, parameters=[hips]),
        lambda: hardware_sweep(bar, TORQUE, hips, [0.05]),
        lambda: changed(bar, TORQUE, {hips: 0.05}),
    ):
        with pytest.raises(InvalidInputError, match="hip_width is of 'l_hip_pitch', which robot"):
            question()
    with pytest.raises(InvalidInputError, match="of another stance or criterion"):
        hardware_sweep(bar, TORQUE, "hip_width", [0.2], nominal=icub_effects)
    with pytest.raises(InvalidInputError, match="an amount of each parameter"):
        icub_effects.gains(np.zeros(2))


def test_forces_between_heel_and_toe_are_chosen_as_elsewhere(stance_of):
    cassie = stance_of("cassie")
    hips = [parameter_named("hip_width", cassie)]
    found = hardware_effects(cassie, TORQUE, parameters=hips, step=1e-3, checked=1)
    assert "leaves forces undetermined" in found.notes[0]
    less, more = (point.smallest for point in found.checks["hip_width"])
    by = 2e-3 * hips[0].size
    assert (more - less) / by == pytest.approx(found.slopes[0, 2, 0], rel=1e-3)
    swept = hardware_sweep(cassie, TORQUE, hips[0], [0.28], nominal=found)
    assert swept.best.smallest < found.smallest
