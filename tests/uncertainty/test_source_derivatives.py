"""Every derivative by an error of the model is that of the whole pipeline: finite differences."""

import numpy as np
import pytest

import copsense
from copsense.margins import margin_table
from copsense.path import LateralPath
from copsense.uncertainty import (
    Uncertainty,
    perturbed,
    perturbed_limits,
    propagate_uncertainty,
    sources_of,
)
from copsense.uncertainty.source_changes import change_of, row_change

TORQUE, WRENCH = copsense.minimum_torque(), copsense.minimum_wrench(0.7)
ALL = {
    "links": {"*": {"mass_percent": 5.0, "com_m": 0.005}},
    "joints": {"*": {"offset_deg": 0.25, "torque_Nm": 0.5}},
    "ground": {"roll_deg": 0.5},
    "contacts": {
        "*": {
            "x_m": 0.002,
            "y_m": 0.002,
            "height_m": 0.001,
            "roll_deg": 0.25,
            "pitch_deg": 0.25,
            "yaw_deg": 0.5,
            "sole_x_m": 0.002,
            "sole_y_m": 0.002,
            "sole_yaw_deg": 0.5,
            "friction": 0.05,
        }
    },
}
STEPS = {"kg": 5e-3, "m": 2e-4, "rad": 2e-4, "N m": 1e-3, "1": 1e-3}
STENCIL = ((-2, 1 / 12), (-1, -8 / 12), (1, 8 / 12), (2, -1 / 12))
CASES = {
    "icub": TORQUE,
    "talos": WRENCH,
    "human": copsense.mixed((WRENCH, 0.3), (TORQUE, 1.0)),
    "solo12": TORQUE,
    "four_bar": TORQUE,
}


def everything(stance, **more):
    ground = ALL["ground"] if stance.robot.base_nv != 6 else {"roll_deg": 0.5, "pitch_deg": 0.5}
    return Uncertainty.from_dict({**ALL, "ground": ground, **more})


def one_of_each(stance, limits, **more):
    """Of every kind and part of the sources the second: links and joints with something on them."""
    found = {}
    for source in sources_of(everything(stance, **more), stance, limits):
        found.setdefault((source.kind, source.part), []).append(source)
    return [each[min(1, len(each) - 1)] for each in found.values()]


def outcome(stance, criterion, limits=None):
    found = copsense.solve_equilibrium(stance, criterion, limits)
    return np.concatenate([found.contact_forces, found.torques])


def differences(value, sources, steps=STEPS):
    """d value(errors) by each source, as the last axis."""
    columns = []
    for i, source in enumerate(sources):
        step, errors, total = steps[source.unit], np.zeros(len(sources)), 0.0
        for k, weight in STENCIL:
            errors[i] = k * step
            total = total + weight * value(errors) / step
        columns.append(total)
    return np.stack(columns, axis=-1)


def columns_differ(exact, numeric):
    sizes = np.maximum(np.abs(exact).max(axis=0), 1e-3 * np.abs(exact).max())
    return (np.abs(exact - numeric).max(axis=0) / sizes).max()


@pytest.mark.parametrize("robot", CASES)
def test_wrenches_and_torques_follow_every_error(stance_of, robot):
    stance, criterion = stance_of(robot), CASES[robot]
    limits = copsense.Limits(friction=0.4)
    sources = one_of_each(stance, limits)
    kinds = {source.kind for source in sources}
    assert kinds >= {"mass", "com", "offset", "torque", "slope", "place", "height", "friction"}
    found = copsense.solve_equilibrium(stance, criterion)
    exact = np.vstack(found.response(change_of(stance, sources)))
    numeric = differences(
        lambda errors: outcome(perturbed(stance, sources, errors), criterion), sources
    )
    assert columns_differ(exact, numeric) < 1e-6


@pytest.mark.parametrize(
    "criterion",
    [copsense.minimum_tangential(WRENCH), copsense.weighted_torque("inverse inertia")],
    ids=["tie-break", "inertia"],
)
def test_so_they_do_where_a_tie_break_decides_or_weights_follow_the_inertia(icub, criterion):
    # Feet that tilt towards each other leave other forces free: the tie-break has no derivative.
    keep = [s for s in one_of_each(icub, None, payloads=PAYLOAD) if s.part not in ("roll", "pitch")]
    found = copsense.solve_equilibrium(icub, criterion)
    exact = np.vstack(found.response(change_of(icub, keep)))
    numeric = differences(lambda errors: outcome(perturbed(icub, keep, errors), criterion), keep)
    assert columns_differ(exact, numeric) < 1e-6


PAYLOAD = [{"frame": "l_hand", "mass_kg": 0.1, "com_m": [0.02, 0.01, 0.03]}]


@pytest.mark.parametrize(
    ("limits", "pressed"),
    [
        (copsense.Limits(friction=0.05, cop_margin=0.04), {"cop", "friction"}),
        (copsense.Limits(friction=0.4, torque={"l_hip_roll": 2.5, "r_hip_roll": 2.5}), {"torque"}),
    ],
    ids=["soles", "torques"],
)
def test_within_pressing_limits_too(icub, limits, pressed):
    stance = copsense.posture.move_stance(icub, com_y=0.05 if "cop" in pressed else 0.04)
    sources = one_of_each(stance, limits)
    found = copsense.solve_equilibrium(stance, TORQUE, limits)
    assert pressed <= {limit.kind for limit in found.active}
    exact = np.vstack(
        found.response(change_of(stance, sources), row_change(stance, limits, sources))
    )

    def whole(errors):
        own = perturbed_limits(stance, limits, sources, errors)
        return outcome(perturbed(stance, sources, errors), TORQUE, own)

    assert columns_differ(exact, differences(whole, sources)) < 1e-6


def test_centres_of_pressure_and_margins_follow(stance_of):
    stance, limits = stance_of("talos"), copsense.Limits(friction=0.4)
    spread = propagate_uncertainty(stance, TORQUE, everything(stance), limits, samples=0)
    kept = [0, 40, 60, 100, -1, -3, -8]
    sources = [spread.sources[i] for i in kept]
    table = margin_table(stance, limits)
    names = [table.names.index(margin.name) for margin in spread.margins]

    def whole(errors):
        own = perturbed_limits(stance, limits, sources, errors)
        there = perturbed(stance, sources, errors)
        found = copsense.solve_equilibrium(there, TORQUE, limits=None)
        values = margin_table(there, own).values(found.contact_forces, found.torques)
        return np.concatenate([copsense.cop.contact_cops(found).ravel(), values[names]])

    exact = np.vstack([spread.cop_rates.reshape(-1, len(spread.sources)), spread.margin_rates])[
        :, kept
    ]
    assert columns_differ(exact, differences(whole, sources)) < 1e-6


@pytest.mark.parametrize("robot", ["icub", "solo12"])
def test_the_exact_travel_follows_too(stance_of, robot):
    """The limit stays met where travel and model change together, as the rate has it."""
    stance = stance_of(robot)
    spread = propagate_uncertainty(stance, TORQUE, samples=0)
    travel, sources = spread.travels["+y"], spread.sources
    weighed = np.abs(travel.rates) * spread.deviations
    path, y = LateralPath(stance), float(stance.com[1])
    planted = copsense.Limits(friction=None, torsion=None)
    row = margin_table(stance, planted).names.index(travel.limit)

    def slack(further, errors):
        there = perturbed(path.at(y + travel.travel + further)[0], sources, errors)
        found = copsense.solve_equilibrium(there, TORQUE)
        return margin_table(there, planted).slack(found.contact_forces, found.torques)[row]

    def by(step):
        return sum(w * slack(*step(k)) for k, w in STENCIL)

    still = np.zeros(len(sources))
    assert abs(slack(0.0, still)) < 1e-6 * stance.robot.weight
    for kind in ("mass", "com", "slope", "place", "offset"):
        i = max((i for i, s in enumerate(sources) if s.kind == kind), key=lambda i: weighed[i])
        step = STEPS[sources[i].unit]
        unit = step * np.eye(len(sources))[i]
        alone = by(lambda k, unit=unit: (0.0, k * unit))
        both = by(lambda k, unit=unit, i=i, step=step: (k * step * travel.rates[i], k * unit))
        assert abs(both) < 1e-6 * abs(alone), kind


def test_figures_worked_out_apart_from_copsense(icub):
    """A slope of one degree; the travel by a mass on the base; what masses and CoMs leave of it."""
    there = copsense.posture.move_stance(icub, com_y=0.02)
    sloping = Uncertainty(ground={"roll_deg": 1.0})
    slope = propagate_uncertainty(there, TORQUE, sloping, samples=0)
    moved = slope.cop_rates[:, 1, 0] * np.radians(1.0)
    assert moved == pytest.approx([-3.0e-3, -6.4e-3], abs=5e-5)  # to the low side
    links = {"*": {"mass_percent": 5.0, "com_m": 0.005}}
    found = propagate_uncertainty(icub, TORQUE, Uncertainty(links=links, sigmas=1.0), samples=0)
    travel = found.travels["+y"]
    assert travel.travel == pytest.approx(45.9e-3, abs=5e-5)
    assert travel.worst - travel.travel == pytest.approx(-6.8e-3, abs=5e-5)
    assert travel.likely - travel.travel == pytest.approx(-1.5e-3, abs=5e-5)
    # A mass at the origin of the base's link.
    rates = dict(zip([s.name for s in found.sources], travel.rates, strict=True))
    base = icub.robot.model.inertias[1]
    by_com = sum(rates[f"CoM {x} of root_link"] * c for x, c in zip("xyz", base.lever, strict=True))
    assert rates["mass of root_link"] - by_com / base.mass == pytest.approx(-0.315e-3, abs=1e-6)
