"""Charts of robots with rods, couplings and hanging joints: the postures of one at a time."""

import numpy as np
import pytest
from support.driven_robots import BENT, everything, standing

import copsense
from copsense import Load
from copsense.batch import BatchKernel, PostureChart, coordinate_names
from copsense.design import joint_groups
from copsense.errors import UnknownNameError


@pytest.fixture(scope="module")
def rods():
    """Rods, couplings, springs, a differential and joints without motors, under a load."""
    bent = {f"{side}_{joint}": angle for side in "lr" for joint, angle in BENT.items()}
    stance = standing(everything(), joints=bent)
    return stance.with_loads([Load("hand", (5.0, 0.0, -10.0))])


def test_a_row_is_the_posture_that_the_solver_finds(rods):
    _, y, z = rods.com
    chart = PostureChart(rods, ["com_y", "com_z"])
    assert "load" in chart.fallback_reason
    rows = np.array([[y - 0.01, z], [y + 0.02, z - 0.01]])
    found = chart.solve(rows)
    assert found.reasons.tolist() == ["", ""]
    for row, q in zip(rows, found.configurations, strict=True):
        alone = copsense.solve_posture(rods, com=(None, row[0], row[1]))
        np.testing.assert_allclose(q, alone.stance.q, rtol=0, atol=1e-12)
        here = rods.at(q)  # loops closed, contacts in place, and what hangs hangs
        np.testing.assert_allclose(here.com[1:], row, rtol=0, atol=1e-11)
    np.testing.assert_allclose(chart.values, [y, z], rtol=0, atol=1e-15)


def test_contacts_move_on_their_planes_and_what_cannot_be_says_why(rods):
    name = rods.contact_names[0]
    chart = PostureChart(rods, [f"{name}:x"])
    (start,) = chart.values
    found = chart.solve([[start + 0.02], [start + 2.0]])
    moved = rods.at(found.configurations[0], check=False)
    wanted = rods.placements[0].translation + np.array([0.02, 0.0, 0.0])
    np.testing.assert_allclose(moved.placements[0].translation, wanted, rtol=0, atol=1e-11)
    np.testing.assert_allclose(
        moved.placements[1].homogeneous, rods.placements[1].homogeneous, rtol=0, atol=1e-11
    )
    assert "no posture of" in found.reasons[1]
    assert np.isnan(found.configurations[1]).all()


def test_a_base_that_cannot_be_held_alone_is_no_coordinate(rods):
    assert "roll" not in coordinate_names(rods)
    with pytest.raises(UnknownNameError, match="com_z"):
        PostureChart(rods, ["base_z"])


def test_a_batch_of_them_is_one_at_a_time(rods):
    y = rods.com[1]
    criteria = [copsense.minimum_wrench(0.5), copsense.minimum_torque()]
    q = PostureChart(rods, ["com_y"]).solve([[y], [y + 0.01]]).configurations
    kernel = BatchKernel(rods, criteria)
    assert kernel.fallback_reason
    found = kernel.evaluate(q)
    assert not found.reasons
    for row, configuration in enumerate(q):
        for column, criterion in enumerate(criteria):
            alone = copsense.cop_sensitivity(rods.at(configuration), criterion)
            np.testing.assert_array_equal(found.cops[row, column], alone.cop)
            np.testing.assert_array_equal(found.com_travel[row, column], alone.com_travel)
            np.testing.assert_array_equal(found.torques[row, column], alone.equilibrium.torques)


def test_only_joints_with_motors_are_weighed_in_a_design(rods):
    names = [name for group in joint_groups(rods).values() for name in group]
    assert names
    assert set(names) <= set(rods.robot.torque_names)
