"""What the statics predict of a motion, and whether it is slow enough for them."""

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
import pytest

import copsense
from copsense.controllers import Hold, PathReference, Ramp, Sine, lateral_reference
from copsense.cop import center_of_pressure
from copsense.limits import NO_LIMITS, Limits
from copsense.scan import limit_travel
from copsense.simulation import Scenario
from copsense.simulation import prediction as module
from copsense.simulation.prediction import predict, predict_lean
from copsense.simulation.quasi_static import peak_acceleration, quasi_static

C1, C2 = copsense.minimum_wrench(1.0), copsense.minimum_torque()
COP_ONLY = replace(NO_LIMITS, cop_margin=0.0)


@pytest.mark.parametrize("criterion", [C1, C2], ids=["C1", "C2"])
@pytest.mark.parametrize("side", [1, -1])
def test_the_excursion_is_the_exact_travel(icub, criterion, side):
    found = predict_lean(icub, criterion, side * 0.05)
    first = limit_travel(icub, criterion, COP_ONLY, side).first
    assert found.excursion == pytest.approx(first.exact, abs=2e-9)
    assert found.first_order == pytest.approx(first.first_order, rel=1e-9)
    assert (found.contact, found.how) == (first.margin.where, "tips")
    assert found.reach == pytest.approx(0.05)
    assert found.statement == f"{found.contact} tips at {first.exact * 1e3:.1f} mm"


def test_each_posture_is_solved_once(icub, monkeypatch):
    solved = []
    scan = module.PathScan

    class Counting(scan):
        def at(self, value):
            if value not in self._points:
                solved.append(value)
            return super().at(value)

    monkeypatch.setattr(module, "PathScan", Counting)
    reference = lateral_reference(icub, Ramp(0.05))
    predict(reference, C2)
    assert len(solved) == len(set(solved)) <= len(reference.path) + 5


def test_where_the_reference_ends_first_it_says_how_far_it_looked(icub):
    found = predict(lateral_reference(icub, Sine(0.03, 0.5)), C2)
    assert found.excursion == np.inf
    assert (found.contact, found.how) == ("", "")
    assert found.statement == "no contact tips up to 30.0 mm"


def test_what_limits_hold_on_the_edge_tips_there(icub):
    # Within limits the CoP stays on the edge that it reaches: the excursion is where it arrives.
    limits = Limits(normal_force=0.0, friction=None, cop_margin=0.0, torsion=None)
    found = predict(lateral_reference(icub, Ramp(0.05)), C1, limits)
    bare = predict_lean(icub, C1, 0.05)
    assert found.excursion == pytest.approx(bare.excursion, abs=1e-7)
    assert found.contact == bare.contact
    where = f"at {found.excursion * 1e3:.1f} mm"
    assert found.statement == (
        f"CoP of {found.contact} reaches an edge {where}, and the limits hold it there"
    )
    assert bare.statement == f"{bare.contact} tips {where}"


def test_margins_and_torques_are_those_of_the_postures(icub):
    reference = lateral_reference(icub, Ramp(0.02))
    found = predict(reference, C2)
    for i in (0, 5, 11):
        here = copsense.cop_sensitivity(reference.path.stances[i], C2)
        margins = [c.sole.margin(p).distance for c, p in zip(icub.contacts, here.cop, strict=True)]
        assert found.margins[i] == pytest.approx(min(margins), abs=1e-12)
        np.testing.assert_allclose(found.torques[i], here.equilibrium.torques, atol=1e-9)
        np.testing.assert_allclose(found.cops[i], here.cop, atol=1e-12)
    path, first = found.smallest_margin(0.0, 0.02)
    assert path == pytest.approx(found.margins[found.values >= 0].min(), abs=1e-5)
    # Of criterion 1 forces are affine in the CoM: first order is the path, by load and moment.
    path, first = predict(reference, C1).smallest_margin(0.0, 0.02)
    assert first == pytest.approx(path, abs=1e-9)


@pytest.mark.parametrize(("frequency", "share"), [(0.2, 0.104), (0.5, 0.650)])
def test_the_share_is_that_of_the_zero_moment_point(icub, frequency, share):
    reference = lateral_reference(icub, Sine(0.03, frequency))
    found = predict(reference, C2).quasi_static
    # The lever is h - L_x / m, not h (0.546 m): 0.646 m, so that a sine is right to 5 % below
    # 0.139 Hz.
    assert found.lever == pytest.approx(0.646, abs=1e-3)
    assert found.frequency == pytest.approx(0.139, abs=1e-3)
    assert found.share == pytest.approx(share, abs=1e-3)
    assert found.excess == pytest.approx(found.share * 0.03, rel=1e-12)
    assert not found.holds
    # Against the zero-moment point of the reference itself, at the turning point.
    dt, quarter, model = 1e-3, 0.25 / frequency, icub.robot.model
    before, there, after = (reference.at(quarter + k * dt) for k in (-1, 0, 1))
    rate = (after.velocity - before.velocity) / (2 * dt)
    data = model.createData()
    change = pin.computeCentroidalMomentumTimeVariation(
        model, data, there.posture, there.velocity, rate
    )
    force = change.linear - icub.robot.mass * model.gravity.linear
    moment = change.angular + np.cross(there.com, force)
    ground = copsense.Plane(point=(0.0, 0.0, float(icub.placements[0].translation[2])))
    excess = center_of_pressure(force, moment, ground)[1] - there.com[1]
    assert found.excess == pytest.approx(excess, rel=0.02)


def test_a_slow_ramp_is_quasi_static_and_a_hold_is(icub):
    slow = predict(lateral_reference(icub, Ramp(0.05)), C1).quasi_static
    assert slow.holds
    assert slow.excess == pytest.approx(slow.lever * 0.01 / 9.81, rel=1e-3)
    still = predict(lateral_reference(icub, Hold()), C1)
    assert still.quasi_static.share == still.quasi_static.excess == 0.0
    assert still.quasi_static.holds


@dataclass
class Own:
    """A signal of one's own, which says nothing of its acceleration."""

    def at(self, time):
        s, c = np.sin(2.0 * time), np.cos(2.0 * time)
        return 0.01 * s, 0.02 * c, -0.04 * s

    @property
    def extent(self):
        return -0.01, 0.01


def test_a_signal_of_ones_own_is_sampled(icub):
    assert peak_acceleration(Own()) == pytest.approx(0.04, rel=1e-4)
    known = lateral_reference(icub, Sine(0.01, 1 / np.pi))
    own = quasi_static(icub, known.path.at(0.0)[1], Own())
    assert own.share == pytest.approx(predict(known, C1).quasi_static.share, rel=1e-4)


def test_a_list_of_configurations_is_predicted_by_its_cubics(icub):
    lateral = copsense.lateral_sweep(icub, -0.004, 0.05, 28)
    bare = copsense.path_through(icub, [s.q for s in lateral.stances])
    path = replace(bare, values=lateral.values - float(icub.com[1]), tangents=lateral.tangents)
    found = predict(PathReference(path, Ramp(0.05)), C2)
    assert found.excursion == pytest.approx(predict_lean(icub, C2, 0.05).excursion, abs=1e-7)


def leaning(stance, y):
    """The stance with its centre of mass to the left [m]."""
    return copsense.posture.solve_posture(stance, com=(0.0, y, None)).stance


def test_a_posture_that_a_criterion_cannot_hold_at_rest_is_said_with_a_way_out(icub):
    stance = leaning(icub, 0.055)
    found = copsense.cop_sensitivity(stance, C2)
    outside = {
        c.name: -c.sole.margin(p).distance for c, p in zip(stance.contacts, found.cop, strict=True)
    }
    (name,) = [name for name, distance in outside.items() if distance > 0]
    note = predict(lateral_reference(stance, Hold()), C2).at_rest
    said = f"the centre of pressure of {name} would lie {outside[name] * 1e3:.1f} mm outside"
    assert note.startswith(
        f"minimum-torque cannot hold this posture at rest without limits: {said}"
    )
    assert "Give limits (--limits cop-margin=0, limits=Limits()), within which it can." in note
    assert copsense.balance(stance, C2, Scenario(0.003)).notes[-1] == note
    assert predict(lateral_reference(stance, Hold()), C2, Limits()).at_rest == ""


def test_another_criterion_is_proposed_where_it_holds_the_posture(icub):
    # Left and right legs of which one costs nothing carry the load on the other's edge.
    legs = {n: 1e-3 if n.startswith("l_") else 1.0 for n in icub.robot.torque_names}
    lame = copsense.weighted_torque(legs).named("lame")
    assert predict(lateral_reference(icub, Hold()), C2).at_rest == ""
    note = predict(lateral_reference(icub, Hold()), lame).at_rest
    assert note.endswith(", or another criterion: minimum-wrench holds it as it is.")


def test_feet_that_slip_at_rest_and_postures_that_nothing_holds(icub):
    reference = lateral_reference(leaning(icub, 0.02), Hold())
    wrenches = copsense.solve_equilibrium(reference.path.stances[0], C2).wrenches
    needed = np.hypot(*wrenches[:, :2].T) / wrenches[:, 2]
    note = predict(reference, C2, friction=0.5 * float(needed.max())).at_rest
    assert f"would need a friction of {needed.max():.2f}" in note
    note = predict(lateral_reference(leaning(icub, 0.13), Hold()), C2).at_rest
    assert note.startswith("This posture cannot be held at rest:")
    assert note.endswith("Move the CoM over the feet.")
