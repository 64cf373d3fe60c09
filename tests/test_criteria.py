"""Criteria weigh what they say: ways of giving one weight agree, and only proportions matter."""

import numpy as np
import pytest
from support.commands import copsense as command
from support.grounds import off_centre
from support.loads import CRITERIA, criteria

import copsense
from copsense.criterion import CRITERIA as NAMED

WRENCH, TORQUE = copsense.minimum_wrench(1.0), copsense.minimum_torque()


@pytest.fixture(scope="module")
def posture(lateral_path):
    return off_centre(lateral_path.stances[10])


def wrenches(stance, criterion):
    return copsense.solve_equilibrium(stance, criterion).wrenches


def same_wrenches(stance, given, expected):
    difference = wrenches(stance, given) - wrenches(stance, expected)
    return np.abs(difference).max() < 1e-9 * stance.robot.weight


@pytest.mark.parametrize("name", CRITERIA)
def test_every_criterion_of_the_suite_is_listed(posture, name):
    assert tuple(criteria(posture)) == CRITERIA
    assert criteria(posture)[name].name == name


@pytest.mark.parametrize("name", CRITERIA)
def test_scale_of_a_criterion_does_not_matter(posture, name):
    criterion = criteria(posture)[name]
    scaled = copsense.mixed((criterion, 250.0), tie_break=criterion.tie_break)
    assert same_wrenches(posture, scaled, criterion)


def test_weights_by_name_by_vector_and_by_matrix_are_the_same(posture):
    joints = posture.robot.torque_names
    vector = np.random.default_rng(3).uniform(0.2, 3.0, len(joints))
    by_vector = copsense.weighted_torque(vector)
    by_name = copsense.weighted_torque(dict(zip(reversed(joints), vector[::-1], strict=True)))
    assert same_wrenches(posture, by_name, by_vector)
    assert same_wrenches(posture, copsense.weighted_torque(np.diag(vector)), by_vector)
    assert not same_wrenches(posture, TORQUE, by_vector)
    assert same_wrenches(posture, copsense.weighted_torque(7.0), TORQUE)


def test_joints_that_carry_no_contact_need_no_weight(posture):
    # What hangs from the torso decides its joints' torques: only the legs' can be chosen.
    legs = [j for j in posture.robot.torque_names if j[2:6] in ("hip_", "knee", "ankl")]
    assert len(legs) == 12
    assert same_wrenches(posture, copsense.weighted_torque(dict.fromkeys(legs, 1.0)), TORQUE)


def test_a_joint_without_a_weight_is_the_limit_of_a_small_one(posture):
    names = posture.robot.torque_names
    weights = {name: 0.0 if "knee" in name else 1.0 for name in names}
    small = {name: weight or 1e-9 for name, weight in weights.items()}
    free = wrenches(posture, copsense.weighted_torque(weights))
    cheap = wrenches(posture, copsense.weighted_torque(small))
    np.testing.assert_allclose(free, cheap, rtol=0, atol=1e-5)
    assert np.abs(free - wrenches(posture, TORQUE)).max() > 1.0


@pytest.fixture(scope="module")
def limited(posture):
    """The same robot with an effort limit of every joint: its upper body's are placeholders."""
    model = posture.robot.model.copy()
    efforts = model.upperEffortLimit.copy()
    efforts[efforts > 1e4] = 24.0
    model.upperEffortLimit = efforts
    return copsense.Stance(copsense.Robot.from_model(model), posture.q, posture.contacts)


def test_limit_weights_are_the_models_effort_limits(limited):
    efforts = limited.robot.model.upperEffortLimit[6:]
    limits = dict(zip(limited.robot.torque_names, efforts, strict=True))
    assert limits["l_hip_pitch"] == 55.5
    assert limits["r_knee"] == 37.0
    explicit = copsense.weighted_torque({name: limit**-2 for name, limit in limits.items()})
    assert same_wrenches(limited, copsense.weighted_torque("1/limit^2"), explicit)


def test_inverse_inertia_is_the_inverse_of_the_joints_block(posture):
    explicit = copsense.weighted_torque(np.linalg.inv(posture.mass_matrix[6:, 6:]))
    assert same_wrenches(posture, copsense.weighted_torque("inverse inertia"), explicit)


def test_wrench_weights_by_contact_by_six_and_by_matrix_are_the_same(posture):
    six = np.array([1, 2, 3, 20, 30, 40.0])

    def weighted(weights):
        return copsense.Criterion("weighted", (copsense.WrenchTerm(weights),))

    by_contact = weighted({"r_sole": six, "l_sole": six})
    assert same_wrenches(posture, weighted(six), by_contact)
    assert same_wrenches(posture, weighted(np.diag(np.tile(six, 2))), by_contact)


def test_characteristic_length_weighs_moments_as_forces_at_that_arm(posture):
    for L in (0.1, 1.0, 3.0):
        matrix = np.diag(np.tile([1, 1, 1, L**-2, L**-2, L**-2], 2))
        explicit = copsense.Criterion("explicit", (copsense.WrenchTerm(matrix),))
        assert same_wrenches(posture, copsense.minimum_wrench(L), explicit)
    assert not same_wrenches(posture, copsense.minimum_wrench(0.1), WRENCH)


def test_a_reference_that_already_balances_is_what_comes_out(posture):
    wanted = wrenches(posture, TORQUE)
    for L in (0.1, 1.0):
        found = wrenches(posture, copsense.criterion.reference_wrench(wanted, L))
        np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-9)


def test_mixed_goes_from_one_criterion_to_the_other(posture):
    ends = [wrenches(posture, WRENCH), wrenches(posture, TORQUE)]
    gap = np.abs(ends[0] - ends[1]).max()
    mostly = [
        wrenches(posture, copsense.mixed((WRENCH, a), (TORQUE, b)))
        for a, b in ((1.0, 1e-8), (1e-8, 1.0))
    ]
    for given, end in zip(mostly, ends, strict=True):
        assert np.abs(given - end).max() < 1e-4 * gap


def test_criteria_by_name_are_the_functions(limited):
    same = {
        "minimum-wrench": copsense.minimum_wrench(0.4),
        "minimum-torque": TORQUE,
        "limit-weighted-torque": copsense.weighted_torque("1/limit^2"),
        "inertia-weighted-torque": copsense.weighted_torque("inverse inertia"),
        "minimum-tangential": copsense.minimum_tangential(copsense.minimum_wrench(0.4)),
    }
    assert set(same) == set(copsense.criterion.CRITERIA)
    for name, criterion in same.items():
        named = copsense.criterion.criterion_named(name, 0.4)
        assert named.name == name
        assert same_wrenches(limited, named, criterion)


def test_the_command_offers_every_criterion_that_has_a_name():
    told = " ".join(command("analyse", "--help").out.split())
    for name in NAMED:
        assert name in told.replace("- ", "-"), name
