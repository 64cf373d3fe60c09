"""The verdicts on the iCub's claims, and that their verdicts follow from the numbers."""

import numpy as np
import pytest
from support.reproductions import POSTURES, small_reproduction

import copsense
from copsense.errors import InvalidInputError
from copsense.paper.claims import LateralSweep, Verdict, evaluate_icub_claims
from copsense.paper.claims.icub_sweep import SHORT, TORQUE, WRENCH
from copsense.paper.closed_form import FourBar
from copsense.paper.reproduce import reproduce_paper

HOLDS, IF, NOT = Verdict.HOLDS, Verdict.HOLDS_IF, Verdict.DOES_NOT_HOLD

# identifier -> verdict, number, tolerance
EXPECTED = {
    "icub-equal-legs": (HOLDS, 1.001, 1e-3),
    "icub-body-mass": (NOT, 3.45, 0.01),
    "icub-hip-height": (HOLDS, 0.497, 1e-3),
    # closed form a u / d with a = d² / (d² + 4) at u = d/2, d = 0.14 m
    "icub-half-weight": (IF, 0.5 * 0.14**2 / (0.14**2 + 4), 1e-9),
    "icub-mirrored": (HOLDS, 0.0, 1e-12),
    "icub-forces-vary": (HOLDS, 0.490, 1e-3),
    "icub-over-the-foot": (IF, 0.0458, 5e-4),
    "icub-full-period": (IF, 0.0458, 5e-4),
    "icub-parallel": (IF, 1.0049 - 0.98549, 1e-4),
    "icub-less-on-support": (HOLDS, 0.0200 / 0.0816, 2e-3),
    "icub-hip-roll": (HOLDS, 0.0152, 1e-3),
    "icub-similar": (IF, 0.268, 2e-3),
    "icub-chart": (HOLDS, 0.334 / 0.386, 2e-3),
    "icub-lower-sensitivity": (IF, 0.0338, 5e-4),
    "icub-tends-to-zero": (IF, 0.255, 1e-3),
}


@pytest.fixture(scope="module")
def reproduction():
    return small_reproduction()


def judged(dataset, four_bar=None):
    return {c.claim.identifier: c for c in evaluate_icub_claims(dataset, four_bar or FourBar())}


@pytest.mark.parametrize("identifier", EXPECTED)
def test_each_claim_on_the_icub_has_its_verdict_and_number(reproduction, identifier):
    (found,) = [c for c in reproduction.icub_claims if c.claim.identifier == identifier]
    verdict, number, tolerance = EXPECTED[identifier]
    assert found.verdict is verdict
    assert found.number == pytest.approx(number, abs=tolerance)


def test_every_claim_is_expected_here(reproduction):
    assert {c.claim.identifier for c in reproduction.icub_claims} == set(EXPECTED)
    identifiers = [c.claim.identifier for c in reproduction.claims]
    assert len(identifiers) == len(set(identifiers))


def test_a_condition_is_named_where_a_claim_holds_only_under_one(reproduction):
    for claim in reproduction.icub_claims:
        if claim.verdict is IF:
            assert claim.condition


def test_the_verdicts_follow_from_the_sweep(reproduction):
    """With the criteria's names exchanged, what the paper says of one is false of the other."""
    swapped = reproduction.lateral.to_xarray().assign_coords(criterion=[TORQUE, WRENCH, SHORT])
    found = judged(copsense.Sweep(swapped))
    assert found["icub-half-weight"].verdict is NOT
    assert found["icub-forces-vary"].verdict is NOT
    assert found["icub-parallel"].verdict is NOT
    assert found["icub-less-on-support"].verdict is NOT
    assert found["icub-lower-sensitivity"].verdict is NOT
    assert found["icub-tends-to-zero"].verdict is NOT
    assert found["icub-full-period"].verdict is NOT


def test_with_a_short_length_criterion_1_is_criterion_2(reproduction):
    """L = d/2 in the place of L = 1 m: the paper's comparison is one of units."""
    short = reproduction.lateral.sel(criterion=[SHORT, TORQUE, SHORT])
    found = judged(copsense.Sweep(short.assign_coords(criterion=[WRENCH, TORQUE, SHORT])))
    assert found["icub-half-weight"].verdict is NOT
    assert found["icub-lower-sensitivity"].verdict is NOT


@pytest.mark.parametrize(
    ("name", "value", "claim", "verdict"),
    [
        ("left_leg_mass", 9.0, "icub-equal-legs", NOT),
        ("body_mass", 12.13, "icub-body-mass", HOLDS),
        ("hip_height", 0.6, "icub-hip-height", NOT),
        ("joint_path_slope", -0.3858, "icub-chart", NOT),
    ],
)
def test_facts_about_the_robot_decide_their_claims(reproduction, name, value, claim, verdict):
    assert judged(reproduction.lateral.with_attributes(**{name: value}))[claim].verdict is verdict


def test_a_sole_that_is_wide_enough_is_never_left(reproduction):
    wide = reproduction.lateral.to_xarray().assign(margin=reproduction.lateral["margin"] + 0.1)
    found = judged(copsense.Sweep(wide))
    assert found["icub-over-the-foot"].verdict is HOLDS
    assert found["icub-full-period"].verdict is NOT  # criterion 1 tracks it too


def test_a_four_bar_of_other_size_is_not_similar(reproduction):
    assert judged(reproduction.lateral, FourBar(leg_length=1.0))["icub-similar"].verdict is NOT


def test_the_order_of_the_contacts_does_not_matter(reproduction):
    turned = copsense.Sweep(reproduction.lateral.isel(contact=[1, 0]))
    assert judged(turned) == judged(reproduction.lateral)


def test_reference_values_agree(reproduction):
    # On this grid, coarser than the recorded one, an edge is met within 0.25 mm.
    for row in reproduction.references:
        assert abs(row.measured - row.reference) <= row.tolerance + 2.5e-4 * (row.unit == "m"), row
    assert len(reproduction.references) == 18


def test_the_unit_of_length_follows_its_closed_form(reproduction):
    unit = reproduction.unit_of_length
    assert unit.icub == pytest.approx(unit.closed_form, abs=1e-9)
    at_half = np.interp(unit.distance / 2, unit.lengths, unit.icub)
    assert at_half == pytest.approx(unit.minimum_torque, rel=0.02)


def test_the_contact_frames_height_changes_criterion_2_alone(reproduction):
    cops = [
        d["cop"].sel(criterion=WRENCH, axis="y")
        for d in (reproduction.lateral, reproduction.lateral_at_sole)
    ]
    assert cops[0].values == pytest.approx(cops[1].values, abs=1e-9)
    off = reproduction.lateral_at_sole["cop"].sel(criterion=TORQUE, axis="y").values
    assert np.abs(off).max() == pytest.approx(0.0835, abs=5e-5)
    assert reproduction.changed_at_sole == ()


def test_the_sweep_carries_the_hip_roll_and_its_rate(reproduction):
    lateral = reproduction.lateral
    rates = np.gradient(lateral["l_hip_roll"].values, lateral["com_y"].values)
    inner = slice(1, -1)
    assert lateral["l_hip_roll_rate"].values[inner] == pytest.approx(rates[inner], rel=1e-3)


def test_progress_counts_every_stage_to_its_end():
    seen = {}

    def progress(stage, done, total):
        assert 0 <= done <= total
        assert done >= seen.get(stage, (0, 0))[0]
        seen[stage] = done, total

    found = reproduce_paper(postures=5, progress=progress)
    assert all(done == total for done, total in seen.values())
    assert seen["iCub: postures"] == (5, 5)
    assert list(seen) == list(found.timings)


def test_a_reproduction_says_what_it_was_made_with(reproduction):
    assert reproduction.postures == POSTURES
    assert {"copsense", "Python", "pin", "numpy", "matplotlib", "icub-models"} <= set(
        reproduction.versions
    )
    text = " ".join(reproduction.parameters.values())
    assert "iCubGenova04" in text
    assert "10.5 mm" in text
    assert "l_hip_pitch 12" in text
    assert all(seconds > 0 for seconds in reproduction.timings.values())


def test_too_few_postures_are_rejected():
    with pytest.raises(InvalidInputError, match="5 postures or more"):
        reproduce_paper(postures=4)


def test_a_sweep_that_lacks_something_is_rejected(reproduction):
    lateral, four_bar = reproduction.lateral, FourBar()
    with pytest.raises(InvalidInputError, match="minimum-torque"):
        LateralSweep.from_dataset(lateral.subset([WRENCH]), four_bar)
    lacking = copsense.Sweep(lateral.to_xarray().drop_vars("l_hip_roll_rate"))
    with pytest.raises(InvalidInputError, match="l_hip_roll_rate"):
        LateralSweep.from_dataset(lacking, four_bar)
    with pytest.raises(InvalidInputError, match="over both feet"):
        LateralSweep.from_dataset(
            lateral.subset(postures=range(3, lateral.sizes["posture"])), four_bar
        )
    failed = lateral.to_xarray()
    failed["reason"] = failed["reason"].astype(object)
    failed["reason"].values[0, 0] = "out of reach"
    with pytest.raises(InvalidInputError, match="out of reach"):
        LateralSweep.from_dataset(copsense.Sweep(failed), four_bar)


def test_limits_bind_where_the_reference_soles_end_and_the_other_foot_pays():
    within = small_reproduction().within_limits
    found = {(b.criterion, b.value > 0): b for b in within.bindings}
    assert abs(found["minimum-wrench", True].value - 0.0384) < 1e-4
    assert abs(found["minimum-torque", True].value - 0.0459) < 1e-4
    for binding in found.values():
        held = 1 if binding.value > 0 else 0  # the unloading foot is held at its edge
        assert abs(binding.after[held, 1]) < 0.01 < 1.0 < binding.before[held, 1] + 0.05
        assert binding.after[1 - held, 1] > 1.9 * binding.before[1 - held, 1]


def test_regions_are_nested():
    regions = small_reproduction().within_limits.regions
    areas = [region.area for region in regions.values()]
    assert areas[0] >= areas[1] > max(areas[2:])
    for vertex in regions["minimum-torque"].polygon:
        assert regions["and torque limits"].margin(vertex) > -1e-6
