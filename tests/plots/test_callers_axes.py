"""Every plot draws into the caller's axes, says the caller's label, and has the caller's color."""

import importlib
import inspect
import pkgutil

import numpy as np
import pandas as pd
import pytest
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.text import Text
from support.results import small_log

import copsense
from copsense import plots
from copsense.controllers.target import Sine
from copsense.design import families
from copsense.errors import InvalidInputError
from copsense.hardware import hardware_effects, hardware_sweep
from copsense.logs import compare_log
from copsense.maps import Marginal
from copsense.optimisation import optimise, pareto_front
from copsense.plots import limit_plots, log_plots
from copsense.pushes import push_limits
from copsense.simulation import Scenario

MINE, LABEL = "#12ab34", "the other robot"
WRENCH, TORQUE = copsense.minimum_wrench(1.0), copsense.minimum_torque()
LIMITS = copsense.Limits(friction=0.4)


def every_plot():
    """Name -> function, of all modules of the plots."""
    found = {}
    for module in pkgutil.iter_modules(plots.__path__, "copsense.plots."):
        inside = importlib.import_module(module.name)
        found |= {
            name: function
            for name, function in vars(inside).items()
            if name.startswith("plot_") and function.__module__ == module.name
        }
    return found


PLOTS = every_plot()


@pytest.fixture(scope="module")
def swept(icub):
    path = copsense.lateral_sweep(icub, -0.05, 0.05, 5)
    return copsense.sweep(path, [WRENCH, TORQUE], LIMITS)


@pytest.fixture(scope="module")
def found(icub):
    return [copsense.cop_sensitivity(icub, criterion) for criterion in (WRENCH, TORQUE)]


@pytest.fixture(scope="module")
def compared(icub):
    return compare_log(small_log(icub), icub, [WRENCH, TORQUE], skip=0.0)


@pytest.fixture(scope="module")
def run(icub):
    return copsense.balance(icub, TORQUE, Scenario(0.05, reference=Sine(0.01, 1.0)))


def marginals():
    edges = (np.arange(4.0), np.arange(5.0))
    values = np.arange(24.0).reshape(2, 3, 4)
    names = (WRENCH.name, TORQUE.name)
    return [Marginal(("a", "b"), ("m", "m"), "least_com_travel", "worst", edges, names, values)]


def benchmark():
    columns = {
        "key": "k", "robot": "r", "posture": "p", "conditions": "ideal", "trial": "lean",
        "score": "tip_excursion", "unit": "m", "status": "measured", "value": 0.03, "low": 0.029,
        "high": 0.031, "predicted": 0.03, "first_order": 0.03, "parameters": "",
    }  # fmt: skip
    return pd.DataFrame([columns | {"controller": c.name} for c in (WRENCH, TORQUE)])


@pytest.fixture
def drawn(request, icub, swept, found, compared, run):
    """Name -> its arguments, how many axes it draws in, and what its colors are of."""
    bar = copsense.load_stance("four_bar")
    name = request.param
    if name == "plot_design":
        path = copsense.lateral_sweep(bar, -0.03, 0.03, 5)
        design = copsense.design_criterion(path, LIMITS, families(bar)["length"], grid=2)
        return (design,), 2, "designed"
    if name in ("plot_optimum", "plot_front"):
        quick = {"over": {"com_z": 0.02}, "starts": 1, "iterations": 3}
        if name == "plot_front":
            return (pareto_front(icub, ("gain", "torque"), points=2, **quick),), 1, "before"
        return (optimise(icub, objective="torque", **quick),), 4, TORQUE.name
    if name.startswith("plot_hardware"):
        effects = hardware_effects(bar, TORQUE)
        hips = hardware_sweep(bar, TORQUE, "hip_width", [0.1, 0.12, 1.4], nominal=effects)
        return ((hips,), 1, "smallest") if "sweep" in name else ((effects, [hips]), 2, TORQUE.name)
    if name == "plot_pushes":
        return (push_limits(icub, criteria=[TORQUE]),), 1, TORQUE.name
    if name == "plot_regions":
        return (copsense.com_regions(icub, [TORQUE], LIMITS), swept), 1, TORQUE.name
    if name == "plot_rollout":
        return (run,), 6, "l_sole"
    if name == "plot_map":
        return (marginals(),), 3, None
    if name == "plot_benchmark":
        return (benchmark(),), 2, WRENCH.name
    if name in ("plot_robot", "plot_stance"):
        return (icub, found), 2 if name == "plot_stance" else 1, WRENCH.name
    if name.startswith("plot_log"):
        return (compared,), 4 if name == "plot_log" else 1, WRENCH.name
    if name == "plot_limited":
        return (swept, {WRENCH.name: [0.02]}), 2, WRENCH.name
    if name == "plot_foot_cop":
        return (swept, "l_sole"), 1, WRENCH.name
    kinds = len(limit_plots.limit_kinds(swept))
    many = {"plot_results": 4 + kinds, "plot_limit_margins": kinds}
    two = ("plot_sensitivity", "plot_torques", "plot_soles")
    return (swept,), many.get(name, 2 if name in two else 1), WRENCH.name


def caller_axes(count, polar):
    figure = Figure()
    options = {"subplot_kw": {"projection": "polar"}} if polar else {}
    grid = figure.subplots(1, count + 1, squeeze=False, **options)[0]
    return figure, list(grid[:count]), grid[count]


def draw(name, arguments, axes, **options):
    plot = PLOTS[name]
    if "ax" in inspect.signature(plot).parameters:
        return plot(*arguments, ax=axes[0], **options)
    return plot(*arguments, axes=axes, **options)


def colours_in(figure):
    shades = set()
    for artist in figure.findobj(Artist):
        for part in ("color", "edgecolor", "facecolor"):
            got = getattr(artist, f"get_{part}", lambda: None)()
            try:
                shades |= {to_hex(each) for each in np.atleast_2d(got)}
            except (ValueError, TypeError):
                shades |= {to_hex(got)} if isinstance(got, str) and got != "none" else set()
    return shades


@pytest.mark.parametrize("name", PLOTS)
def test_every_plot_takes_axes_label_and_color(name):
    parameters = inspect.signature(PLOTS[name]).parameters
    assert len({"ax", "axes"} & set(parameters)) == 1
    for each in parameters.values():
        if each.name in ("ax", "axes", "label", "color", "legend"):
            assert each.kind is inspect.Parameter.KEYWORD_ONLY
            assert f"{each.name}: " in PLOTS[name].__doc__ or each.name == "legend"
    assert {"label", "color"} <= set(parameters)


@pytest.mark.parametrize(("drawn", "name"), [(n, n) for n in PLOTS], indirect=["drawn"])
def test_every_plot_draws_into_the_callers_axes_alone(drawn, name):
    arguments, count, colored = drawn
    figure, axes, other = caller_axes(count, name == "plot_pushes")
    size = tuple(figure.get_size_inches())
    color = "magma" if name == "plot_map" else {colored: MINE}
    result = draw(name, arguments, axes, label=LABEL, color=color)
    assert result is (axes[0] if isinstance(result, Axes) else figure)
    assert all(ax.has_data() or ax.texts for ax in axes)
    assert not other.has_data()
    assert not figure.legends
    assert tuple(figure.get_size_inches()) == size
    if name != "plot_map":  # its bars are axes of their own
        assert figure.axes == [*axes, other]
    figure.draw_without_rendering()
    said = [t.get_text() for t in figure.findobj(Text)]
    labels = [a.get_label() for a in figure.findobj(Artist)]
    assert any(LABEL in str(words) for words in (*said, *labels))
    if name == "plot_map":
        assert axes[0].collections[0].get_cmap().name == "magma"
    else:
        assert MINE in colours_in(figure)


@pytest.mark.parametrize(
    ("drawn", "name"), [(n, n) for n in PLOTS if n != "plot_map"], indirect=["drawn"]
)
def test_a_color_of_nothing_there_is_said(drawn, name):
    arguments, count, _ = drawn
    _, axes, _ = caller_axes(count, name == "plot_pushes")
    with pytest.raises(InvalidInputError, match="'nobody', which is not drawn"):
        draw(name, arguments, axes, color={"nobody": MINE})


def test_two_robots_share_a_picture(icub):
    (ax,) = [plots.plot_robot(icub, label="here", color="black")]
    wide = ax.get_xlim()
    there = copsense.solve_posture(icub, com=(None, 0.05, None)).stance
    plots.plot_robot(there, ax=ax, label="there", color=MINE)
    assert ax.get_xlim()[0] >= wide[0] > wide[1] >= ax.get_xlim()[1]
    said = {t.get_text() for t in ax.get_legend().get_texts()}
    assert {"here", "there", "CoM"} <= said
    assert {"#000000", MINE} <= {to_hex(line.get_color()) for line in ax.lines}


def test_pushes_ask_for_polar_axes(icub):
    with pytest.raises(InvalidInputError, match="polar"):
        plots.plot_pushes(push_limits(icub, criteria=[TORQUE]), ax=Figure().subplots())


def test_notebooks_show_axes_and_figures(swept, compared):
    for result in (plots.plot_load(swept), plots.plot_results(swept), log_plots.plot_log(compared)):
        assert result._repr_png_().startswith(b"\x89PNG")


def test_a_map_of_no_color_is_said():
    with pytest.raises(InvalidInputError, match="not a color map of Matplotlib"):
        plots.plot_map(marginals(), color="rainbowish")


@pytest.mark.parametrize(("name", "side"), [("icub", "behind"), ("solo12", "right")])
def test_a_robots_legend_is_in_its_figure(stance_of, name, side):
    stance = stance_of(name)
    found = [copsense.cop_sensitivity(stance, criterion) for criterion in (WRENCH, TORQUE)]
    figure = plots.plot_robot(stance, found, side=side).figure
    figure.draw_without_rendering()
    inside, whole = figure.axes[0].get_tightbbox(), figure.bbox
    assert min(inside.x0, inside.y0) >= 0
    assert inside.x1 <= whole.x1
    assert inside.y1 <= whole.y1


def test_a_legend_leaves_a_title_to_be_read(swept):
    figure = plots.plot_limit_margins(swept)
    figure.draw_without_rendering()
    ax = figure.axes[0]
    title = next(t for t in ax.findobj(Text) if t.get_text() == ax.get_title("left"))
    legend = ax.get_legend().get_window_extent()
    assert legend.y0 >= title.get_window_extent().y1
    assert legend.y1 <= figure.bbox.y1
