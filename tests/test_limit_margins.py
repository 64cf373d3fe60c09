"""Margins: their units, their signs, and what they say in plain words of the wrenches."""

from dataclasses import replace

import numpy as np
import pytest
from support.random_cases import random_stance

import copsense
from copsense.cop import contact_cops
from copsense.limits import Limits, torque_limits
from copsense.margins import limit_margins, margin_table


@pytest.fixture(scope="module", params=["icub", "talos", "g1"])
def case(request, stance_of):
    """A free equilibrium at a random posture, and limits of every kind on it."""
    rng = np.random.default_rng(21)
    stance = random_stance(stance_of(request.param), rng)
    limits = Limits(normal_force=20.0, cop_margin=0.005, friction_sides=6, torque=15.0)
    return copsense.solve_equilibrium(stance, copsense.minimum_torque()), limits


def by_key(margins):
    found = {(m.where, m.kind): m for m in margins}
    assert len(found) == len(margins)
    return found


def test_every_margin_in_its_own_unit(case):
    equilibrium, limits = case
    stance = equilibrium.stance
    margins = by_key(limit_margins(equilibrium, limits))
    cops = contact_cops(equilibrium)
    for contact, w, cop in zip(stance.contacts, equilibrium.wrenches, cops, strict=True):
        fx, fy, fz, _, _, mz = w
        cop_margin = margins[contact.name, "cop"]
        edge = copsense.polygon.Polygon(contact.polygon).margin(cop)
        assert cop_margin.unit == "m"
        assert cop_margin.value == pytest.approx(edge.distance - 0.005, abs=1e-12)
        assert edge.side in cop_margin.name

        normal = margins[contact.name, "normal force"]
        assert normal.unit == "N"
        assert normal.value == pytest.approx(fz - 20.0, rel=1e-12)

        # To the nearest side of a hexagon of circumradius mu fz with a vertex on x.
        friction = margins[contact.name, "friction"]
        sides = np.arange(6) * np.pi / 3 + np.pi / 6
        towards = np.column_stack([np.cos(sides), np.sin(sides)]) @ [fx, fy]
        expected = contact.friction * fz * np.cos(np.pi / 6) - towards.max()
        assert friction.unit == "N"
        assert friction.value == pytest.approx(expected, abs=1e-10)

        torsion = margins[contact.name, "torsion"]
        assert torsion.unit == "N m"
        assert torsion.value == pytest.approx(contact.torsional_friction * fz - abs(mz), abs=1e-10)
    for name, torque in zip(stance.robot.torque_names, equilibrium.torques, strict=True):
        margin = margins[name, "torque"]
        assert margin.unit == "N m"
        assert margin.value == pytest.approx(15.0 - abs(torque), abs=1e-12)
        assert margin.name == f"torque of {name}"


def test_fine_pyramids_margin_is_the_cones(case):
    equilibrium, _ = case
    margins = by_key(limit_margins(equilibrium, Limits(friction_sides=720)))
    for contact, (fx, fy, fz, *_) in zip(
        equilibrium.stance.contacts, equilibrium.wrenches, strict=True
    ):
        cone = contact.friction * fz - np.hypot(fx, fy)
        assert margins[contact.name, "friction"].value == pytest.approx(cone, abs=1e-4 * fz)


def test_margin_is_negative_beyond_the_limit_and_zero_on_it(case):
    equilibrium, _ = case
    w = equilibrium.wrenches
    slack = float(w[:, 2].min())
    for shift, sign in ((-1.0, 1), (1.0, -1)):
        margins = limit_margins(equilibrium, Limits(normal_force=slack + shift))
        lowest = min(m.value for m in margins if m.kind == "normal force")
        assert lowest == pytest.approx(sign * 1.0, abs=1e-10)
    margins = limit_margins(equilibrium, Limits(normal_force=slack))
    assert min(m.value for m in margins if m.kind == "normal force") == pytest.approx(0, abs=1e-12)


def test_models_own_torque_limits_and_no_margin_for_placeholders(icub):
    equilibrium = copsense.solve_equilibrium(icub, copsense.minimum_torque())
    margins = [m for m in limit_margins(equilibrium, Limits(torque="model")) if m.kind == "torque"]
    bound = torque_limits(icub, "model")
    assert len(margins) == np.sum(np.isfinite(bound)) == 12
    for margin in margins:
        i = icub.robot.torque_names.index(margin.where)
        assert margin.value == pytest.approx(bound[i] - abs(equilibrium.torques[i]))


def test_margins_within_limits_are_never_negative(stance_of):
    rng = np.random.default_rng(4)
    for _ in range(10):
        stance = random_stance(stance_of("icub"), rng, shift=0.02)
        free = copsense.solve_equilibrium(stance, copsense.minimum_torque())
        limits = Limits(torque=float(1.0 * np.abs(free.torques).max()))
        try:
            within = copsense.solve_equilibrium(stance, copsense.minimum_torque(), limits)
        except copsense.CopsenseError:
            continue
        assert all(m.value > -1e-9 for m in limit_margins(within, limits))
        touched = {m.name for m in limit_margins(within, limits) if m.value < 1e-9}
        # A group shows one row, the nearest: what is active is among the nearest ones.
        kinds = {(a.name.split(":")[0], a.kind) for a in within.active if a.kind != "torque"}
        assert len(kinds) <= len(touched)


def test_rates_are_the_derivatives_of_the_slacks(stance_of):
    rng = np.random.default_rng(9)
    stance = random_stance(stance_of("icub"), rng)
    limits = replace(Limits(), torque=20.0, friction_sides=4)
    table = margin_table(stance, limits)

    def values(at):
        found = copsense.solve_equilibrium(at, copsense.minimum_torque())
        return found, table.slack(found.forces, found.torques)

    equilibrium, _ = values(stance)
    direction = stance.admissible_motions @ rng.standard_normal(17) / 5
    df, dtau = (d[:, 0] for d in equilibrium.derivative(direction[:, None]))
    rates = table.slack_rates(df, dtau)
    at = {
        k: values(copsense.posture.retract(stance, 1e-3 * k * direction))[1] for k in (-2, -1, 1, 2)
    }
    numeric = (8 * (at[1] - at[-1]) - (at[2] - at[-2])) / 12e-3
    np.testing.assert_allclose(rates, numeric, atol=1e-7 * np.abs(rates).max())
    assert np.all(np.abs(rates).max() > 0)
