"""The paper's figures: a four-bar's poles, the iCub beside it, a curve per criterion."""

import numpy as np
import pytest
from support.reproductions import small_reproduction

from copsense.paper.report import paper_plots
from copsense.plots import render_figure


def test_figure_3b_marks_where_a_foot_unloads():
    _, torque, *_ = small_reproduction().four_bar_figures
    ax = paper_plots.plot_figure_3(torque, "minimum-torque")
    poles = {
        round(float(line.get_xdata()[0]), 1)
        for line in ax.lines
        if line.get_transform() == ax.get_xaxis_transform()
    }
    assert sorted(poles) == pytest.approx([-21.9, 21.9], abs=0.1)


def test_figure_9_lays_the_four_bar_beneath_the_icub():
    lateral = small_reproduction().lateral.subset(["minimum-wrench", "minimum-torque"])
    wrench, torque, *_ = small_reproduction().four_bar_figures
    ax = paper_plots.plot_figure_9b(lateral, wrench, torque)
    assert len(render_figure(ax.figure, ".png", dpi=30)) > 1000
    for bar, robot in zip(ax.lines[:2], ax.lines[4:6], strict=True):
        assert bar.get_color() == robot.get_color()
        # one slope at the centre, within a twentieth; the CoM goes left as the hip roll falls
        slopes = [
            np.interp([-1.0, 1.0], *(line.get_data() if line is bar else ascending(line)))
            for line in (bar, robot)
        ]
        fall = [ends[1] - ends[0] for ends in slopes]
        assert fall[0] == pytest.approx(fall[1], rel=0.05)
        assert fall[0] < 0


def ascending(line):
    x, y = line.get_data()
    order = np.argsort(x)
    return np.asarray(x)[order], np.asarray(y)[order]


@pytest.mark.parametrize("number", [2, 3])
def test_figures_4_and_5_have_a_curve_per_criterion(number):
    data = small_reproduction().four_bar_figures[number]
    ax = paper_plots.plot_criteria_curves(data, "it", ceiling=30.0)
    assert ax.get_ylim() == (0.0, 30.0)
    assert len({line.get_color() for line in ax.lines}) >= 2
    assert len(render_figure(ax.figure, ".png", dpi=30)) > 1000
