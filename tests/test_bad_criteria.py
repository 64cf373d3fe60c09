"""Criteria, weights and policies that determine nothing, or nonsense, say so."""

import numpy as np
import pytest

import copsense
from copsense import Contact, Criterion, TorqueTerm, WrenchTerm
from copsense.errors import InvalidInputError, UndeterminedWrenchError, UnknownNameError


def weighted(weights):
    return copsense.weighted_torque(weights)


def on_wrenches(weights):
    return Criterion("mine", (WrenchTerm(weights),))


@pytest.mark.parametrize("length", [0.0, -1.0, np.nan, np.inf, 1e-200, 1e200])
def test_the_characteristic_length_is_a_positive_number_that_means_something(length):
    for build in (
        copsense.minimum_wrench,
        lambda value: copsense.criterion.reference_wrench(np.zeros((2, 6)), value),
        lambda value: copsense.criterion.criterion_named("minimum-wrench", value),
    ):
        with pytest.raises(InvalidInputError, match="characteristic length L"):
            build(length)


def test_an_unknown_criterion_lists_the_known_ones():
    with pytest.raises(UnknownNameError, match=r"Did you mean minimum-torque.*minimum-tangential"):
        copsense.criterion.criterion_named("minimum-torqe")


@pytest.mark.parametrize("scale", [0.0, -1.0, np.nan, np.inf])
def test_scales_and_factors_are_positive(scale):
    with pytest.raises(InvalidInputError, match="the scale of a term of criterion 'mine'"):
        Criterion("mine", (TorqueTerm(1.0, scale=scale),))
    with pytest.raises(InvalidInputError, match="the factor of a mixed criterion"):
        copsense.mixed((copsense.minimum_torque(), scale))


def test_a_criterion_without_terms_is_rejected():
    with pytest.raises(InvalidInputError, match="no term to minimise"):
        copsense.mixed()


@pytest.mark.parametrize(
    ("weights", "said"),
    [
        (-1.0, "positive semidefinite"),
        (np.nan, "not finite"),
        (np.inf, "not finite"),
        (np.ones(3), "shape (3,). Give shape (23,) or (23, 23)"),
        (np.eye(3), "shape (3, 3)"),
        (np.eye(23) + np.triu(np.ones((23, 23)), 1), "not symmetric"),
        (np.diag([-1.0, *np.ones(22)]), "positive definite"),
        (np.diag([0.0, *np.ones(22)]), "positive definite"),
        ({"l_knee": np.nan}, "not finite"),
        ({"l_knee": -1.0}, "positive semidefinite"),
    ],
)
def test_torque_weights_that_cannot_be_minimised_are_rejected(icub, weights, said):
    with pytest.raises(InvalidInputError, match="'weighted-torque': torque weights") as caught:
        copsense.solve_equilibrium(icub, weighted(weights))
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("weights", "said"),
    [
        (-np.ones(6), "positive semidefinite"),
        (np.full(6, np.nan), "not finite"),
        (np.ones(5), "six numbers"),
        (np.eye(5), "(12,) or (12, 12)"),
        (np.triu(np.ones((12, 12))), "not symmetric"),
        (-np.eye(12), "positive semidefinite"),
        ({"l_sole": np.ones(3)}, "six numbers"),
    ],
)
def test_wrench_weights_that_cannot_be_minimised_are_rejected(icub, weights, said):
    with pytest.raises(InvalidInputError, match="'mine'") as caught:
        copsense.solve_equilibrium(icub, on_wrenches(weights))
    assert said in str(caught.value)


def test_a_wrong_name_in_the_weights_lists_the_right_ones(icub):
    with pytest.raises(UnknownNameError, match=r"joint in the weights .*Did you mean l_knee"):
        copsense.solve_equilibrium(icub, weighted({"l_nee": 1.0}))
    with pytest.raises(UnknownNameError, match=r"contact in the weights .*Valid: l_sole, r_sole"):
        copsense.solve_equilibrium(icub, on_wrenches({"l_soul": np.ones(6)}))


@pytest.mark.parametrize("limit", [0.0, -1.0, np.nan])
def test_limits_that_are_not_positive_cannot_weigh(icub, limit):
    model = icub.robot.model.copy()
    efforts = model.upperEffortLimit.copy()
    efforts[6 + icub.robot.joint_names.index("l_knee")] = limit
    model.upperEffortLimit = efforts
    stance = copsense.Stance(copsense.Robot.from_model(model), icub.q, icub.contacts)
    with pytest.raises(InvalidInputError, match=r"1/limit\^2.*of l_knee, torso_.*Give weights"):
        copsense.solve_equilibrium(stance, weighted("1/limit^2"))


def test_placeholders_of_the_model_cannot_weigh_as_if_they_were_limits(icub):
    with pytest.raises(
        InvalidInputError, match=r"placeholder.* of torso_pitch, .*Give weights"
    ) as e:
        copsense.solve_equilibrium(icub, weighted("1/limit^2"))
    assert "l_knee" not in str(e.value)
    effort = dict(zip(icub.robot.torque_names, icub.robot.effort_limits, strict=True))
    remedy = weighted({joint: 1 / limit**2 for joint, limit in effort.items() if limit < np.inf})
    assert copsense.solve_equilibrium(icub, remedy).residual() < 1e-9


@pytest.mark.parametrize(
    "criterion",
    [weighted(0.0), weighted({}), weighted({"l_knee": 1.0}), on_wrenches(np.zeros(6))],
    ids=["zero", "no joint", "one joint", "zero wrench"],
)
def test_weights_that_leave_the_wrenches_open_name_the_directions(icub, criterion):
    with pytest.raises(UndeterminedWrenchError, match=r"undetermined .* l_sole fz.*tie_break") as e:
        copsense.solve_equilibrium(icub, criterion)
    assert "l_sole fz" in e.value.directions


@pytest.fixture(scope="module")
def one_foot_twice(icub):
    """Two contacts on one link: no torque can feel how they share the load."""
    return icub.with_contacts(
        [Contact("l_sole"), Contact("l_sole", name="heel", offset=(-0.05, 0, 0))]
    )


def test_redundant_contacts_ask_for_a_tie_break_and_name_what_is_free(one_foot_twice):
    with pytest.raises(UndeterminedWrenchError, match=r"rank 6 of 12.*tie_break") as caught:
        copsense.solve_equilibrium(one_foot_twice, copsense.minimum_torque())
    assert {"l_sole fz", "heel fz"} <= set(caught.value.directions)


def test_a_tie_break_that_leaves_the_same_freedom_is_not_enough(one_foot_twice):
    for tie_break in (copsense.minimum_torque(), weighted(0.0)):
        criterion = copsense.minimum_torque(tie_break=tie_break)
        with pytest.raises(UndeterminedWrenchError, match=r"leaves .* undetermined too. Use"):
            copsense.solve_equilibrium(one_foot_twice, criterion)


def test_a_tie_break_that_follows_the_inertia_is_rejected(one_foot_twice):
    criterion = copsense.minimum_torque(tie_break=weighted("inverse inertia"))
    with pytest.raises(InvalidInputError, match="cannot be a tie-break"):
        copsense.solve_equilibrium(one_foot_twice, criterion)


def test_a_sufficient_tie_break_balances(one_foot_twice):
    criterion = copsense.minimum_torque(tie_break=copsense.minimum_wrench(1.0))
    assert copsense.solve_equilibrium(one_foot_twice, criterion).residual() < 1e-10


@pytest.mark.parametrize("scale", [1e-300, 1e300])
def test_extreme_weights_balance_or_say_so(icub, scale):
    try:
        equilibrium = copsense.solve_equilibrium(icub, weighted(scale))
    except InvalidInputError as error:
        assert "too large, too small" in str(error)  # noqa: PT017 - either is right
    else:
        assert equilibrium.residual() < 1e-6 * icub.robot.weight


@pytest.mark.parametrize("shape", [(1, 6), (2, 3), (12,), (3, 6)])
def test_a_reference_of_the_wrong_shape_says_which_is_right(icub, shape):
    with pytest.raises(InvalidInputError, match=r"the reference of criterion .*\b6\)"):
        copsense.solve_equilibrium(icub, copsense.criterion.reference_wrench(np.zeros(shape), 1.0))


def test_a_reference_that_is_not_finite_says_where():
    reference = np.zeros((2, 6))
    reference[1, 2] = np.nan
    with pytest.raises(InvalidInputError, match="not finite at index 1, 2"):
        copsense.criterion.reference_wrench(reference, 1.0)


def zero(q):
    return np.zeros((2, 6))


def not_numbers(q):
    return "much"


def wrong_shape(q):
    return np.zeros(3)


def nan(q):
    return np.full((2, 6), np.nan)


def ragged(q):
    return [[1.0], [1.0, 2.0]]


def nothing(q):
    return None


def failing(q):
    return q[0] / {}["gain"]


@pytest.mark.parametrize(
    ("policy", "said"),
    [
        (zero, "do not balance gravity: 324 N"),
        (not_numbers, "not an array of numbers"),
        (wrong_shape, "shape (3,)"),
        (nan, "not finite at index 0, 0"),
        (ragged, "not an array of numbers"),
        (nothing, "policy 'nothing'"),
        (failing, "raised KeyError: 'gain'. Fix it"),
    ],
)
def test_a_policy_that_answers_wrongly_is_named_with_what_was_wrong(icub, policy, said):
    with pytest.raises(InvalidInputError, match=policy.__name__) as caught:
        copsense.solve_equilibrium(icub, policy)
    assert said in str(caught.value)


def test_a_policy_s_own_error_stays_in_sight(icub):
    with pytest.raises(InvalidInputError) as caught:
        copsense.cop_sensitivity(icub, failing)
    assert isinstance(caught.value.__cause__, KeyError)


def test_a_policy_that_fails_is_a_row_beside_a_criterion_that_does_not(lateral_path):
    dataset = copsense.sweep(lateral_path, [failing, copsense.minimum_torque()])
    failed = dataset.failed_rows
    assert {name for _, name, _ in failed} == {"failing"}
    assert len(failed) == len(lateral_path)
    assert not np.any(np.isnan(dataset["cop"].sel(criterion="minimum-torque")))


@pytest.mark.parametrize("count", [1, 3, 24])
def test_torques_of_the_wrong_number_say_how_many_joints_there_are(icub, count):
    policy = copsense.statics.wrench_policy(lambda q: np.zeros(count), icub)
    with pytest.raises(InvalidInputError, match=r"the torques returned .*\(23,\)"):
        copsense.solve_equilibrium(icub, policy)


def test_torques_do_not_determine_redundant_contacts(one_foot_twice):
    policy = copsense.statics.wrench_policy(lambda q: np.zeros(23), one_foot_twice)
    with pytest.raises(UndeterminedWrenchError, match="no torque can feel"):
        copsense.solve_equilibrium(one_foot_twice, policy)


def test_criteria_of_a_sweep_have_distinct_names(lateral_path):
    for criteria in ([], [copsense.minimum_torque()] * 2):
        with pytest.raises(InvalidInputError, match=r"distinct names.*Criterion\.named"):
            copsense.sweep(lateral_path, criteria)
