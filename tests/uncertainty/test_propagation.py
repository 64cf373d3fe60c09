"""What follows from errors of a model: ellipses, worst cases, shares, and how far they hold."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from support.differences import relative

import copsense
from copsense.errors import InvalidInputError
from copsense.uncertainty import Uncertainty, perturbed, propagate_uncertainty, sample_models

TORQUE, WRENCH = copsense.minimum_torque(), copsense.minimum_wrench(1.0)


@pytest.fixture(scope="module")
def usual(icub):
    return propagate_uncertainty(icub, TORQUE)


def test_sampled_models_spread_as_the_ellipse_says(icub, usual):
    errors = np.random.default_rng(3).standard_normal((200, len(usual.sources))) * usual.deviations
    exact = sample_models(icub, TORQUE, usual.sources, errors) - usual.cop
    first = np.einsum("kip,np->nki", usual.cop_rates, errors)
    # The same errors both ways: what is left is what is not linear.
    assert exact.std(axis=0) == pytest.approx(first.std(axis=0), rel=0.02)
    # And the ellipse itself, within what two hundred samples tell.
    own = np.sqrt(np.linalg.eigvalsh(usual.covariance))
    sampled = [np.linalg.eigvalsh(np.cov(exact[:, k].T)) ** 0.5 for k in range(2)]
    assert np.array(sampled) == pytest.approx(own, rel=0.15)
    assert usual.nonlinearity.max() < 0.05
    assert not [note for note in usual.notes if "ellipses" in note]


def test_errors_too_large_for_the_first_order_are_said(icub):
    wide = Uncertainty(contacts={"*": {"height_m": 0.02}}, joints={"*": {"offset_deg": 5.0}})
    spread = propagate_uncertainty(icub, TORQUE, wide)
    assert spread.nonlinearity.max() > 0.05
    assert any("hold to first order only" in note for note in spread.notes)


def test_contacts_that_may_carry_no_load_are_named(stance_of, usual):
    stance = stance_of("four_bar")
    wide = propagate_uncertainty(stance, TORQUE, Uncertainty(ground={"roll_deg": 6.0}), samples=0)
    assert wide.may_unload == stance.contact_names
    assert any("may carry no load" in note for note in wide.notes)
    assert not usual.may_unload


def test_models_without_an_answer_are_counted(stance_of):
    spread = propagate_uncertainty(
        stance_of("four_bar"),
        TORQUE,
        Uncertainty(contacts={"l_sole": {"height_m": 0.3}}),
        samples=20,
    )
    assert 0 < spread.lost_samples < 20
    assert any(f"{spread.lost_samples} of the sampled" in note for note in spread.notes)


def test_the_worst_case_is_at_a_corner_of_its_outline(usual):
    size = usual.sigmas * usual.deviations
    for k in range(2):
        reach = usual.worst_outlines[k] - usual.cop[k]
        for heading in np.linspace(0, 2 * np.pi, 17):
            along = np.array([np.cos(heading), np.sin(heading)])
            assert (reach @ along).max() == pytest.approx(np.abs(along @ usual.cop_rates[k]) @ size)
            ellipse = (usual.outlines[k] - usual.cop[k]) @ along
            radius = usual.sigmas * np.sqrt(along @ usual.covariance[k] @ along)
            assert ellipse.max() == pytest.approx(radius, rel=5e-3)


def test_half_axes_and_heading_are_those_of_the_outline(usual):
    outline = usual.outlines[0] - usual.cop[0]
    distance = np.linalg.norm(outline, axis=1)
    assert distance.max() == pytest.approx(usual.axes[0, 0], rel=5e-3)
    farthest = outline[distance.argmax()]
    along = np.array([np.cos(usual.headings[0]), np.sin(usual.headings[0])])
    assert abs(farthest @ along) == pytest.approx(usual.axes[0, 0], rel=5e-3)


def test_shares_are_of_the_variance(icub, usual):
    assert sum(usual.shares["l_sole"].values()) == pytest.approx(1.0)
    assert list(usual.shares["l_sole"].values()) == sorted(
        usual.shares["l_sole"].values(), reverse=True
    )
    alone = propagate_uncertainty(
        icub, TORQUE, Uncertainty(ground={"roll_deg": 0.5, "pitch_deg": 0.5}), samples=0
    )
    share = np.trace(alone.covariance[0]) / np.trace(usual.covariance[0])
    assert usual.shares["l_sole"]["slope of the ground"] == pytest.approx(share)
    assert next(iter(usual.strongest("l_sole"))) == "pitch of ground"
    assert sum(usual.travel_shares("+y").values()) == pytest.approx(1.0)


def test_a_payloads_error_is_that_of_the_mass_itself(icub):
    payload = {"frame": "l_hand", "mass_kg": 0.1, "com_m": [0.02, 0.0, 0.05]}
    spread = propagate_uncertainty(icub, TORQUE, Uncertainty(payloads=(payload,)), samples=0)

    def cops(mass):
        robot = icub.robot.with_payload("l_hand", mass, com=(0.02, 0.0, 0.05))
        there = copsense.Stance(robot, icub.q, icub.contacts)
        return copsense.cop_sensitivity(there, TORQUE).cop

    numeric = (cops(1e-3) - cops(0.0)) / 1e-3
    assert relative(spread.cop_rates[..., 0], numeric) < 1e-3


def test_a_slope_is_that_of_a_robot_on_a_sloping_floor(icub):
    """Whole robot and floor turned in the world, with gravity as it was."""
    spread = propagate_uncertainty(icub, WRENCH, Uncertainty(ground={"roll_deg": 1.0}), samples=0)
    angle = 1e-4
    turn = pin.rpy.rpyToMatrix(angle, 0.0, 0.0)
    place = pin.XYZQUATToSE3(icub.q[:7])
    q = icub.q.copy()
    q[:7] = pin.SE3ToXYZQUAT(pin.SE3(turn, np.zeros(3)) * place)
    contacts = [replace(contact, plane=None) for contact in icub.contacts]
    there = copsense.Stance(icub.robot, q, contacts)
    sloping = copsense.Plane.sloping(roll=angle)
    assert there.placements[0].rotation[:, 2] == pytest.approx(sloping.normal, abs=1e-9)
    moved = copsense.cop_sensitivity(there, WRENCH).cop - spread.cop
    assert relative(spread.cop_rates[..., 0] * angle, moved) < 1e-3
    assert spread.cop_rates[0, 1, 0] < 0, "a floor that falls to the right takes the CoP there"


def test_the_model_itself_is_what_no_error_leaves(icub, usual):
    same = perturbed(icub, usual.sources, np.zeros(len(usual.sources)))
    assert same.q == pytest.approx(icub.q)
    assert same.robot is icub.robot


def test_robust_travel_is_less_and_holds_for_the_worst_model(usual):
    for travel in usual.travels.values():
        assert 0 < travel.worst < travel.likely < travel.travel
        assert travel.exact == pytest.approx(travel.worst, abs=5e-3)


def test_travels_shrink_as_the_errors_do(icub):
    def lost(percent):
        links = {"*": {"mass_percent": percent}}
        travel = propagate_uncertainty(icub, TORQUE, Uncertainty(links=links), samples=0).travels
        return travel["-y"].travel - travel["-y"].worst

    assert lost(4.0) == pytest.approx(4 * lost(1.0))


def test_what_is_passed_already_has_no_travel_left(icub):
    there = copsense.posture.move_stance(icub, com_y=0.06)
    spread = propagate_uncertainty(there, TORQUE, samples=0)
    assert spread.travels["+y"].travel == spread.travels["+y"].worst == 0.0
    assert not spread.travels["+y"].rates.any()


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (lambda s: propagate_uncertainty(s, lambda q: q), "does not say what it does on another"),
        (lambda s: propagate_uncertainty(s, TORQUE, samples=-1), "Give a whole number from 0"),
        (
            lambda s: propagate_uncertainty(s.moving(s.q[1:] * 0, s.q[1:] * 0), TORQUE),
            "Give stance.at_rest()",
        ),
    ],
)
def test_what_makes_no_sense_is_rejected(icub, asked, said):
    with pytest.raises(InvalidInputError, match=said.replace("(", r"\(").replace(")", r"\)")):
        asked(icub)


def test_a_robot_with_a_hanging_arm_is_rejected(icub):
    stance = copsense.Stance(icub.robot.without_motors(["l_elbow"]), icub.q, icub.contacts)
    with pytest.raises(InvalidInputError, match="hang at an equilibrium"):
        propagate_uncertainty(stance, TORQUE)
