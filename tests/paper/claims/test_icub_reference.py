"""The iCub's published-path numbers: two criteria, the CoM from over one foot to over the other.

Path: lateral_sweep of the preset, feet 0.14 m apart, contacts at l_sole and r_sole. The reference
values were found before this library was, and are printed to two or three figures.
"""

import pytest

import copsense

CRITERIA = (copsense.minimum_wrench(1.0), copsense.minimum_torque())
WRENCH, TORQUE = 0, 1
OVER_A_FOOT = 0.07  # m


def printed(text):
    """A printed value within one per cent, or half its last digit where that is coarser."""
    digits = len(text.split(".")[1])
    return pytest.approx(float(text), rel=0.01, abs=0.5 * 10**-digits)


@pytest.fixture(scope="module")
def path(icub):
    return copsense.lateral_sweep(icub, -OVER_A_FOOT, OVER_A_FOOT, 15)


@pytest.fixture(params=["left", "right"])
def at_foot(request, path):
    """Sensitivity, slope along the path, index of the supporting and of the other contact.

    Both ways must give the same number, with y counted outwards from the centre.
    """
    row, supporting, out = (-1, 0, 1.0) if request.param == "left" else (0, 1, -1.0)
    stance, tangent = path.stances[row], path.tangents[row]
    found = [copsense.cop_sensitivity(stance, criterion) for criterion in CRITERIA]
    return found, [f.along(tangent)[:, 1] for f in found], supporting, 1 - supporting, out


def test_posture_is_the_papers(icub):
    weight = icub.robot.weight
    assert len(icub.robot.joint_names) == 23
    assert weight / 9.81 == printed("33.06")
    left, right = (place.translation for place in icub.placements)
    assert left[1] - right[1] == pytest.approx(0.14, abs=1e-12)
    assert icub.com[:2] == pytest.approx((left + right)[:2] / 2, abs=1e-9)


@pytest.mark.parametrize(
    ("criterion", "support", "other"), [(WRENCH, "0.502", "0.498"), (TORQUE, "0.745", "0.255")]
)
def test_share_of_the_weight_with_the_com_over_a_foot(at_foot, criterion, support, other):
    found, _, s, o, _ = at_foot
    loads = found[criterion].equilibrium.wrenches[:, 2]
    weight = found[criterion].equilibrium.stance.robot.weight
    assert loads[s] / weight == printed(support)
    assert loads[o] / weight == printed(other)


@pytest.mark.parametrize(
    ("criterion", "support", "other"), [(WRENCH, "0.069", "0.070"), (TORQUE, "0.020", "0.082")]
)
def test_centres_of_pressure_with_the_com_over_a_foot(at_foot, criterion, support, other):
    found, _, s, o, out = at_foot
    assert out * found[criterion].cop[s, 1] == printed(support)
    assert out * found[criterion].cop[o, 1] == printed(other)


@pytest.mark.parametrize(
    ("criterion", "support", "other"), [(WRENCH, "0.985", "1.005"), (TORQUE, "0.141", "2.45")]
)
def test_slopes_with_the_com_over_a_foot(at_foot, criterion, support, other):
    _, slopes, s, o, _ = at_foot
    assert slopes[criterion][s] == printed(support)
    assert slopes[criterion][o] == printed(other)


@pytest.mark.parametrize(
    ("criterion", "per_com", "per_roll"), [(WRENCH, "0.995", "0.386"), (TORQUE, "0.506", "0.196")]
)
def test_slopes_at_the_centre(path, criterion, per_com, per_roll):
    found = copsense.cop_sensitivity(path.stances[7], CRITERIA[criterion])
    tangent = path.tangents[7]
    assert path.values[7] == pytest.approx(0, abs=1e-15)
    for contact in (0, 1):
        assert found.along(tangent)[contact, 1] == printed(per_com)
        assert -found.along_joint(tangent, "l_hip_roll")[contact, 1] == printed(per_roll)


@pytest.mark.parametrize(("criterion", "reach"), [(WRENCH, 0.038), (TORQUE, 0.045)])
@pytest.mark.parametrize("side", [1, -1], ids=["left", "right"])
def test_both_cops_are_in_the_soles_up_to_the_printed_millimetre_and_not_beyond(
    icub, criterion, reach, side
):
    def margin(y):
        (stance,) = copsense.lateral_sweep(icub, side * y, side * y, 1).stances
        cops = copsense.cop.contact_cops(copsense.solve_equilibrium(stance, CRITERIA[criterion]))
        return min(
            copsense.polygon.Polygon(contact.polygon).margin(cop).distance
            for contact, cop in zip(stance.contacts, cops, strict=True)
        )

    assert margin(reach) > 0 > margin(reach + 0.001)


@pytest.mark.parametrize(("criterion", "off_foot"), [(WRENCH, "0.0700"), (TORQUE, "0.0835")])
def test_contacts_at_the_soles_bottom_change_the_second_criterion_alone(criterion, off_foot):
    lowered = copsense.load_stance("icub", contact_at="sole")
    (stance,) = copsense.lateral_sweep(lowered, OVER_A_FOOT, OVER_A_FOOT, 1).stances
    found = copsense.solve_equilibrium(stance, CRITERIA[criterion])
    assert copsense.cop.contact_cops(found)[1, 1] == printed(off_foot)


def test_centre_of_mass_held_lower_gives_another_paths_numbers(icub):
    # CoM height held 12 mm under the centre's: 0.726, 0.591, 2.28 in the second column's places.
    low = icub.com[2] - 0.012
    over, centre = (
        copsense.solve_posture(icub, com=(icub.com[0], y, low)) for y in (OVER_A_FOOT, 0.0)
    )
    found = copsense.cop_sensitivity(over.stance, CRITERIA[TORQUE])
    share = found.equilibrium.wrenches[0, 2] / icub.robot.weight
    slope = found.along(over.tangents[:, 1])[1, 1]
    middle = copsense.cop_sensitivity(centre.stance, CRITERIA[TORQUE])
    assert share == printed("0.726")
    assert middle.along(centre.tangents[:, 1])[0, 1] == printed("0.591")
    assert slope == printed("2.28")
