"""What a model's errors leave of the travel, posture by posture of a map."""

import numpy as np
import pytest
from support.commands import copsense as command

import copsense
from copsense.errors import InvalidInputError, OutputError
from copsense.maps import Axis, Grid, marginal
from copsense.uncertainty import (
    Uncertainty,
    propagate_uncertainty,
    robust_com_travel,
    sources_of,
)
from copsense.uncertainty.perturbation import perturbed

UNSURE = Uncertainty(links={"*": {"mass_percent": 5.0}}, ground={"roll_deg": 0.5})
GRID = Grid((Axis("com_y", 0.0, 0.02, 2), Axis("com_x", 0.0, 0.01, 2)))


@pytest.fixture(scope="module")
def path(icub, both, tmp_path_factory):
    where = tmp_path_factory.mktemp("unsure") / "map.zarr"
    copsense.map_postures(icub, GRID, both, where, configurations=True, uncertainty=UNSURE)
    return where


def test_a_map_holds_what_is_left_of_the_travel_at_each_posture(path, icub, both):
    dataset, sources = copsense.load_map(path), sources_of(UNSURE, icub)
    for i, q in enumerate(dataset["configuration"].values):
        for j, criterion in enumerate(both):
            found = copsense.cop_sensitivity(icub.at(q), criterion)
            likely, worst = robust_com_travel(found, sources, UNSURE.sigmas)
            row = dataset.isel(posture=i, criterion=j)
            assert row["likely_com_travel"] == pytest.approx(likely.min(), rel=1e-5)
            assert row["robust_com_travel"] == pytest.approx(worst.min(), rel=1e-5)
            assert worst.min() < likely.min() < row["least_com_travel"]
    assert marginal(dataset, quantity="robust_com_travel").values.shape == (2, 2, 2)


def test_a_map_of_other_errors_is_another_map(path, icub, both):
    other = Uncertainty(links={"*": {"mass_percent": 6.0}})
    with pytest.raises(OutputError, match=r"other parameters.*uncertainty"):
        copsense.map_postures(icub, GRID, both, path, configurations=True, uncertainty=other)


def test_errors_without_meaning_are_rejected_before_anything_is_written(icub, both, tmp_path):
    wrong = Uncertainty(contacts={"l_sole": {"friction": 0.1}})
    with pytest.raises(InvalidInputError, match="the limits have no friction"):
        copsense.map_postures(icub, GRID, both, tmp_path / "m.zarr", uncertainty=wrong)
    assert not list(tmp_path.iterdir())


def test_without_errors_the_travel_is_left_and_with_small_ones_the_exact_is_near(icub):
    wrench = copsense.minimum_wrench(1.0)
    found = copsense.cop_sensitivity(icub, wrench)
    sources = sources_of(UNSURE, icub)
    for left in robust_com_travel(found, sources, 1e-12):
        assert left == pytest.approx(np.minimum(found.com_travel, found.unloading_travel))
    # Its slacks are affine in the CoM: what differs is how errors grow on the way.
    spread = propagate_uncertainty(icub, wrench, UNSURE, samples=0)
    likely, worst = robust_com_travel(found, sources, UNSURE.sigmas)
    assert worst.min() == pytest.approx(spread.travels["+y"].worst, abs=1.5e-3)
    assert likely.min() == pytest.approx(spread.travels["+y"].likely, abs=1.5e-3)


def test_the_command_maps_it_too(tmp_path):
    where = tmp_path / "m.zarr"
    said = command(
        *("map", "four_bar", "--criterion", "minimum-torque", "--over", "com_y=0:0.02:2"),
        *("--uncertainty", "default", "--output", where),
    )
    assert said.code == 0, said.err
    assert "note: no sole is known under l_sole, r_sole, so when it tips" in said.err
    assert "unloads)" in said.out
    dataset = copsense.load_map(where)
    least = dataset["least_com_travel"]
    assert (dataset["robust_com_travel"] < dataset["likely_com_travel"]).all()
    assert (dataset["likely_com_travel"] < least).all()
    assert least.equals(dataset["unloading_travel"].min("contact").rename(least.name))


def test_errors_take_of_a_points_load_what_the_whole_model_says(stance_of):
    stance, wrench = stance_of("solo12"), copsense.minimum_wrench(1.0)
    sources = sources_of(Uncertainty(ground={"roll_deg": 2.0}), stance)
    found = copsense.cop_sensitivity(stance, wrench)
    load, weight = found.equilibrium.wrenches[:, 2], stance.robot.weight
    ends = [
        copsense.solve_equilibrium(perturbed(stance, sources, np.array([e])), wrench)
        for e in (-1e-4, 1e-4)
    ]
    rate = (ends[1].wrenches[:, 2] - ends[0].wrenches[:, 2]) / 2e-4
    taken = 3.0 * sources[0].deviation * np.abs(rate)
    left = (load - taken) / weight / np.linalg.norm(found.load_gain, axis=1)
    for travel in robust_com_travel(found, sources, 3.0):  # of one source the two are the same
        assert travel == pytest.approx(left, rel=1e-6)
    assert (taken > 0.01 * load).all()
