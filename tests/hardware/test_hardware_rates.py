"""Every derivative by a robot's hardware is that of the whole pipeline: finite differences."""

import numpy as np
import pytest

import copsense
from copsense.criterion import criterion_named
from copsense.hardware import changed, hardware_effects, hardware_parameters
from copsense.hardware.stance_rates import HardwareRates
from copsense.margins import margin_table
from copsense.path import LateralPath
from copsense.stiffness import stiffness

TORQUE = copsense.minimum_torque()
SERVOS = stiffness({"*hip*": 4000.0, "*": 2000.0})
STENCIL = ((-2, 1 / 12), (-1, -8 / 12), (1, 8 / 12), (2, -1 / 12))
CASES = {
    "icub": (SERVOS, copsense.Limits()),
    "human": (criterion_named("inertia-weighted-torque"), copsense.Limits(friction=0.4)),
    "solo12": (TORQUE, copsense.Limits(friction=0.7)),
}


def step_of(parameter):
    return 4e-4 if parameter.unit == "m" else parameter.size / 50


@pytest.fixture(scope="module", params=CASES)
def effects(request, stance_of):
    criterion, limits = CASES[request.param]
    return hardware_effects(stance_of(request.param), criterion, limits)


def one_of_each(effects):
    """Of every kind the parameter that moves most; of the soles of the iCub one."""
    best = {}
    for i, p in enumerate(effects.parameters):
        kind = "sole" if effects.stance.robot.name == "icub" and "sole" in p.kind else p.kind
        moved = np.abs(effects.rates[0].rates[0, i]) * p.size
        if kind not in best or moved > best[kind][0]:
            best[kind] = moved, i
    return {kind: i for kind, (_, i) in best.items()}


def test_the_travel_to_a_limit_follows_every_kind_of_parameter(effects):
    """Along (s, p) = (s* + t ds*/dp, p + t) the slack of the limit stays zero."""
    end, rates = effects.ends[0], effects.rates[0]
    names = margin_table(effects.stance, effects.limits).names
    row = names.index(rates.limits[0])

    def slack(travel, value=None, parameter=None):
        stance, criterion = effects.stance, effects.criterion
        if parameter is not None:
            stance, criterion = changed(stance, criterion, {parameter: value})
        there = LateralPath(stance).at(float(stance.com[1]) + travel)[0]
        found = copsense.solve_equilibrium(there, criterion)
        table = margin_table(there, effects.limits)
        assert table.names == names
        return table.slack(found.contact_forces, found.torques)[row]

    assert abs(slack(end.travel)) < 1e-9 * effects.stance.robot.weight
    steepness = abs(slack(end.travel + 1e-5) - slack(end.travel - 1e-5)) / 2e-5
    tried = one_of_each(effects)
    for kind, i in tried.items():
        p, rate = effects.parameters[i], rates.rates[0, i]
        h = step_of(p)
        both = sum(w * slack(end.travel + k * h * rate, p.nominal + k * h, p) for k, w in STENCIL)
        assert abs(both) < 1e-6 * steepness * abs(rate * h), kind
    assert tried.keys() >= {"hip_width", "length", "mass"}


def test_the_posture_follows_as_the_solver_has_it(stance_of):
    stance = stance_of("icub")
    chosen = [
        p
        for p in hardware_parameters(stance, single=True)
        if p.name in ("hip_width", "length@l_upper_leg", "mass@l_lower_leg")
    ]
    rates = HardwareRates(stance, tuple(chosen))
    moved = rates.change_at(LateralPath(stance).at(float(stance.com[1]) + 0.03)[0]).directions
    for i, p in enumerate(chosen):
        h, numeric = step_of(p), 0.0
        for k, w in STENCIL:
            other, _ = changed(stance, TORQUE, {p: p.nominal + k * h})
            there = LateralPath(other).at(float(stance.com[1]) + 0.03)[0]
            numeric = numeric + w * there.q[7:] / h
        assert np.abs(numeric - moved[6:, i]).max() < 1e-6 * np.abs(numeric).max(), p.name


def test_a_limit_that_ties_makes_both_ways_cost(stance_of):
    """A quadruped whose front legs alone grow slips at the hind feet, or at the front ones."""
    stance = stance_of("solo12")
    alone = [p for p in hardware_parameters(stance, single=True) if p.name == "length@FL_UPPER_LEG"]
    found = hardware_effects(stance, TORQUE, copsense.Limits(friction=0.7), alone)
    assert found.better == ("neither",)
    assert found.bought[0] < 0
    assert "cost travel to one" in found.notes[0]
