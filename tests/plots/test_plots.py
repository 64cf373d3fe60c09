"""Figures show what the results say: edges where the soles end, gaps where rows failed."""

import subprocess
import sys
from itertools import combinations

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

import copsense
from copsense import plots
from copsense.errors import InvalidInputError, OutputError
from copsense.paper.reproduce.clock import Clock
from copsense.paper.reproduce.sideways import sweep_sideways
from copsense.plots.reading import world_soles
from copsense.plots.style import axes_or_new, colours, given_axes
from copsense.polygon import Polygon
from copsense.posture import move_stance
from copsense.skeleton import skeleton

CRITERIA = [copsense.minimum_wrench(1.0), copsense.minimum_torque()]
WHOLE = [plots.plot_results, plots.plot_soles, plots.plot_sensitivity, plots.plot_torques]
AXES = [plots.plot_cop, plots.plot_load, plots.plot_margin, plots.plot_travel]


@pytest.fixture(scope="module")
def lateral(icub):
    swept, _ = sweep_sideways(icub, 21, Clock(None), "iCub")
    return swept.subset(["minimum-wrench", "minimum-torque"])


@pytest.fixture(scope="module")
def failing(icub):
    """A sweep that goes out of reach: its last postures have no equilibrium."""
    found = copsense.sweep(copsense.lateral_sweep(icub, 0.0, 0.9, 4), CRITERIA)
    assert found.failed_rows
    return found


@pytest.fixture(scope="module")
def quadruped(stance_of):
    return copsense.sweep(copsense.lateral_sweep(stance_of("solo12"), -0.03, 0.03, 7), CRITERIA)


@pytest.fixture(scope="module")
def linkage(stance_of):
    path = copsense.lateral_sweep(stance_of("four_bar"), -0.07, 0.07, 7)
    return copsense.sweep(path, CRITERIA)


@pytest.fixture(scope="module")
def single(icub):
    return copsense.sweep(copsense.lateral_sweep(icub, 0.0, 0.0, 1), CRITERIA)


def rendered(drawn):
    figure = getattr(drawn, "figure", None) or drawn
    assert len(plots.render_figure(figure, ".png", dpi=30)) > 1000
    return figure


def horizontals(ax):
    """Heights of the horizontal lines across the whole axes."""
    return [
        float(line.get_ydata()[0])
        for line in ax.lines
        if line.get_transform() == ax.get_yaxis_transform()
    ]


# --- what is drawn ------------------------------------------------------------------------------


def test_a_figure_laid_out_once_is_drawn_as_before(lateral):
    def draw():
        return plots.plot_results(lateral).get_figure(root=True)

    once, twice = draw(), draw()
    plots.lay_out(once)
    assert once.get_layout_engine() is None
    assert plots.render_figure(once, ".svg") == plots.render_figure(twice, ".svg")
    twice.set_layout_engine("none")  # as the SVG has laid it out
    first, second = (plots.render_figure(f, ".png", dpi=50) for f in (once, twice))
    assert first == second


def test_the_edges_are_drawn_where_the_soles_end(lateral):
    """A CoP on a line drawn has no margin left; four lines, two a sole."""
    heights = horizontals(plots.plot_cop(lateral))
    assert len(heights) == 4
    for k in range(2):
        origin = float(lateral["contact_position"].isel(contact=k).sel(com_axis="y")) * 1e3
        x = float(np.median(lateral["cop"].isel(contact=k).sel(axis="x")))
        polygon = lateral["sole_polygon"].values[k]
        polygon = polygon[np.r_[True, np.any(np.diff(polygon, axis=0), axis=1)]]
        own = [h for h in heights if abs(h - origin) < 60]
        assert len(own) == 2
        for height in own:
            margin = Polygon(polygon).margin((x, (height - origin) / 1e3))
            assert margin.distance == pytest.approx(0.0, abs=1e-7)


def test_a_foots_edges_are_drawn_in_its_own_axes(lateral):
    ax = plots.plot_foot_cop(lateral, "l_sole", against="l_hip_roll")
    # the recorded outline's width at the frame's origin [mm]
    assert sorted(horizontals(ax)) == pytest.approx([-38.2, 49.3], abs=0.3)
    assert ax.get_xlabel() == "l_hip_roll [deg]"
    drawn = [line for line in ax.lines if len(line.get_xdata()) == lateral.sizes["posture"]]
    for line, name in zip(drawn, ("minimum-wrench", "minimum-torque"), strict=True):
        cop = lateral["cop"].sel(criterion=name, contact="l_sole", axis="y").values
        assert line.get_ydata() == pytest.approx(cop * 1e3)
        assert line.get_xdata() == pytest.approx(np.degrees(lateral["l_hip_roll"].values))


def test_cops_are_drawn_in_the_world_and_solid_only_on_the_sole(lateral):
    ax = plots.plot_cop(lateral)
    solid = [
        line
        for line in ax.lines
        if line.get_linestyle() == "-" and len(line.get_xdata()) == lateral.sizes["posture"]
    ]
    rows = [(j, k) for j in range(2) for k in range(2)]
    assert len(solid) == len(rows)
    for line, (j, k) in zip(solid, rows, strict=True):
        here = lateral.isel(criterion=j, contact=k)
        origin = float(here["contact_position"].sel(com_axis="y"))
        cop = np.where(here["margin"] > 0, here["cop"].sel(axis="y") + origin, np.nan)
        assert line.get_ydata() == pytest.approx(cop * 1e3, nan_ok=True, abs=1e-6)


def test_the_load_is_in_parts_of_the_weight(lateral):
    ax = plots.plot_load(lateral)
    shares = np.array([line.get_ydata() for line in ax.lines[:4]])
    assert shares[:2].sum(axis=0) == pytest.approx(1.0)
    assert shares[2:].sum(axis=0) == pytest.approx(1.0)


def test_the_travel_is_that_of_the_first_contact_to_tip(lateral):
    ax = plots.plot_travel(lateral)
    for j in range(2):
        least = lateral["com_travel"].isel(criterion=j).min("contact").values * 1e3
        assert ax.lines[j].get_ydata() == pytest.approx(least)
    assert any("tips" in text.get_text() for text in ax.texts)


def test_from_above_left_is_left(lateral):
    for ax in plots.plot_soles(lateral).axes[:2]:
        right, left = sorted(ax.get_xlim())
        assert ax.get_xlim() == (left, right)
        assert ax.get_aspect() == 1.0


def test_a_criterion_has_one_colour_and_the_papers_keep_theirs():
    names = ["minimum-torque", "mine", "minimum-wrench", "yours", "theirs"]
    found = colours(names)
    assert len({to_hex(c) for c in found.values()}) == len(names)
    assert found["minimum-torque"] == colours(["minimum-torque"])["minimum-torque"]


def test_every_axis_has_its_quantity_and_unit(lateral):
    for plot in AXES:
        ax = plot(lateral)
        assert ax.get_xlabel() == "CoM y [mm]"
        assert "[mm]" in ax.get_ylabel() or "m g" in ax.get_ylabel().replace("mg", "m g")
        assert {text.get_text() for text in ax.get_legend().get_texts()} >= {
            "minimum-wrench",
            "minimum-torque",
        }


# --- what cannot be drawn as usual --------------------------------------------------------------


@pytest.mark.parametrize("plot", [*WHOLE, *AXES])
@pytest.mark.parametrize("which", ["lateral", "failing", "quadruped", "linkage", "single"])
def test_every_plot_draws_every_kind_of_sweep(plot, which, request):
    dataset = request.getfixturevalue(which)
    before = dataset.to_xarray()
    rendered(plot(dataset))
    assert dataset.to_xarray().identical(before)


def test_failed_rows_are_marked_where_they_are(failing):
    ax = plots.plot_load(failing)
    crosses = [line for line in ax.lines if line.get_marker() == "x"]
    failed = failing["reason"].values != ""
    for j, cross in enumerate(crosses):
        there = failing["com_y"].values[failed[:, j]] * 1e3
        assert cross.get_xdata() == pytest.approx(there)
    assert f"× {failed.sum()} failed rows" in [text.get_text() for text in ax.texts]


def test_a_sweep_in_which_all_failed_is_drawn(failing):
    nothing = failing.subset(postures=[-1])
    assert np.all(nothing["reason"] != "")
    for plot in (*WHOLE, *AXES):
        rendered(plot(nothing))


def test_contacts_without_a_sole_have_no_edges(quadruped):
    ax = plots.plot_cop(quadruped)
    assert horizontals(ax) == []
    assert {text.get_text() for text in ax.texts} == {"FL_FOOT, HL_FOOT", "FR_FOOT, HR_FOOT"}
    assert "none can tip" in plots.plot_margin(quadruped).texts[-1].get_text()


def test_a_cop_across_a_pole_is_not_joined(icub):
    """Beyond where a foot would have to pull its CoP comes back from the other side."""
    dataset = copsense.sweep(copsense.lateral_sweep(icub, 0.1, 0.2, 5), CRITERIA[1:])
    pulls = dataset["pulling"].isel(criterion=0).values
    assert pulls.any()
    assert not pulls.all(axis=0).any()
    ax = plots.plot_cop(dataset)
    foot = int(np.argmax(pulls.any(axis=0)))
    for line in ax.lines:
        y = np.asarray(line.get_ydata(), dtype=float)
        if len(y) == len(pulls) and np.all(line.get_xdata() == dataset["com_y"].values * 1e3):
            shown = np.isfinite(y)
            origin = float(dataset["contact_position"][foot, 1])
            whole = (dataset["cop"].values[:, 0, foot, 1] + origin) * 1e3
            if np.allclose(y[shown], whole[shown]) and shown.any():
                assert len(set(pulls[shown, foot])) == 1


@pytest.mark.parametrize("turn", [0.0, 0.4, 2.0])
def test_a_cross_section_of_a_box_ends_on_its_sides(turn):
    box = np.array([[-2.0, -1.0], [2.0, -1.0], [2.0, 1.0], [-2.0, 1.0]])
    c, s = np.cos(turn), np.sin(turn)
    low, high = Polygon(box @ np.array([[c, s], [-s, c]])).section("y", 0.0)
    # through the centre: the half-length is that of a ray to the nearer pair of sides
    half = min(1.0 / max(abs(c), 1e-12), 2.0 / max(abs(s), 1e-12))
    assert (low, high) == pytest.approx((-half, half))
    assert Polygon(box).section("y", 2.5) is None


def test_the_soles_are_turned_with_their_feet(lateral):
    dataset = lateral.to_xarray()
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    dataset["contact_rotation"].values[:] = quarter
    before, after = world_soles(lateral)[0], world_soles(copsense.Sweep(dataset))[0]
    assert np.ptp(after, axis=0) == pytest.approx(np.ptp(before, axis=0)[::-1])


# --- a stance -----------------------------------------------------------------------------------


def test_a_stance_shows_where_each_cop_would_go(icub):
    found = [copsense.cop_sensitivity(icub, criterion) for criterion in CRITERIA]
    figure = rendered(plots.plot_stance(icub, found))
    *robot, wrench, torque = figure.axes
    assert [ax.get_title(loc="left") for ax in robot] == ["from behind", "from its right"]
    assert [ax.get_title(loc="left") for ax in (wrench, torque)] == [c.name for c in CRITERIA]
    for ax, result in zip((wrench, torque), found, strict=True):
        arrows = [text for text in ax.texts if text.get_text() == ""]
        assert len(arrows) == 4
        (y, x), tip = arrows[1].xyann, arrows[1].xy  # of the left foot, the CoM to the left
        assert tip[0] - y == pytest.approx(20.0 * result.com_gain[0, 1, 1])
        assert tip[1] - x == pytest.approx(20.0 * result.com_gain[0, 0, 1], abs=1e-9)
        assert "50% of the weight" in ax.texts[-1].get_text()


def test_a_quadrupeds_stance_says_when_a_foot_unloads(stance_of):
    stance = stance_of("solo12")
    figure = rendered(plots.plot_stance(stance, [copsense.cop_sensitivity(stance, CRITERIA[1])]))
    said = [text for text in figure.axes[-1].texts if "unloads after" in text.get_text()]
    assert len(said) == 4
    boxes = [text.get_window_extent() for text in said]
    assert not any(a.overlaps(b) for a, b in combinations(boxes, 2))
    assert not any("forward" in text.get_text() for text in figure.legends[0].get_texts())


def test_a_stance_needs_sensitivities_of_its_own(icub, stance_of):
    with pytest.raises(InvalidInputError, match="one per criterion"):
        plots.plot_stance(icub, [])
    other = copsense.cop_sensitivity(stance_of("solo12"), CRITERIA[1])
    with pytest.raises(InvalidInputError, match="of the stance it draws"):
        plots.plot_stance(icub, [other])


def marks_of(ax, marker):
    """Where the marks of that kind are (k, 2)."""
    return np.vstack([line.get_xydata() for line in ax.lines if line.get_marker() == marker])


@pytest.mark.parametrize(("side", "across"), [("behind", 1), ("right", 0)])
def test_a_robot_stands_on_its_soles_under_its_com(leaning, side, across):
    found = copsense.cop_sensitivity(leaning, CRITERIA[0])
    ax = plots.plot_robot(leaning, [found], side=side)
    com = leaning.com * 1e3
    assert marks_of(ax, "+").tolist() == [[pytest.approx(com[across]), pytest.approx(com[2])]]
    ring, *cops = marks_of(ax, "o")
    assert ring == pytest.approx([com[across], 0.0], abs=1e-6)
    for cop, place, own in zip(cops, leaning.placements, found.cop, strict=True):
        there = place.act(np.append(own, 0.0)) * 1e3
        assert cop == pytest.approx(there[[across, 2]], abs=1e-6)
    bones = [line.get_xydata() for line in ax.lines if len(line.get_xydata()) == 2]
    drawn = np.array([b for b in bones if b.shape == (2, 2)])
    for bone in skeleton(leaning)[:, :, [across, 2]] * 1e3:
        assert np.isclose(drawn, bone).all(axis=(1, 2)).any()
    left, right = ax.get_xlim()
    assert (left > right) == (side == "behind")  # left is left; forward is to the right


@pytest.fixture(scope="module")
def leaning(icub):
    return move_stance(icub, com_y=0.02)


# --- the caller's axes ----------------------------------------------------------------------------


def test_two_sweeps_share_axes_with_their_names_and_colors(lateral):
    one, other = (lateral.subset([name.name]) for name in CRITERIA)
    figure = Figure()
    mine, untouched = figure.subplots(1, 2)
    mine.plot([0, 0.01], [0, 0.02], label="measured")
    mine.legend()
    size, settings = tuple(figure.get_size_inches()), dict(mpl.rcParams)
    assert plots.plot_cop(one, ax=mine, label="stiff", color="black") is mine
    plots.plot_cop(other, ax=mine, label="soft", color={"minimum-torque": "#009E73"})
    legend = {t.get_text(): h for t, h in zip(
        mine.get_legend().get_texts(), mine.get_legend().legend_handles, strict=True
    )}  # fmt: skip
    assert list(legend) == ["measured", "stiff", "soft", "CoM", "off its sole"]
    assert (to_hex(legend["stiff"].get_color()), to_hex(legend["soft"].get_color())) == (
        "#000000",
        "#009e73",
    )
    named = [line for line in mine.lines if line.get_label() == "soft"]
    assert [to_hex(line.get_color()) for line in named] == ["#009e73"]
    assert figure.axes == [mine, untouched]
    assert not untouched.has_data()
    assert (tuple(figure.get_size_inches()), dict(mpl.rcParams)) == (size, settings)


@pytest.mark.parametrize("plot", [plots.plot_sensitivity, plots.plot_torques])
def test_panels_are_drawn_into_the_axes_given(lateral, plot):
    figure = Figure()
    axes = figure.subplots(2, 1)
    assert plot(lateral, axes=axes, label="icub") is figure
    assert all(ax.has_data() for ax in axes)
    words = [text.get_text() for text in axes[0].get_legend().get_texts()]
    assert words[:2] == ["icub, minimum-wrench", "icub, minimum-torque"]
    assert len(figure.axes) == 2


def test_a_stance_is_drawn_into_the_axes_given(icub):
    found = [copsense.cop_sensitivity(icub, criterion) for criterion in CRITERIA]
    figure = Figure()
    axes = figure.subplots(1, 2)
    assert plots.plot_stance(icub, found, axes=axes) is figure
    assert figure.axes == list(axes)
    assert not figure.legends
    with pytest.raises(
        InvalidInputError, match="2 Matplotlib Axes, one for each of minimum-wrench"
    ):
        plots.plot_stance(icub, found, axes=axes[:1])


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"color": "red"}, "would make them look alike"),
        ({"color": {"minimum-wrench": "reddish"}}, "'reddish' is not a color"),
        ({"color": {"least": "red"}}, "'least', which is not drawn. Choose from minimum-wrench"),
    ],
)
def test_colors_that_cannot_be_are_said(lateral, options, said):
    with pytest.raises(InvalidInputError, match=said):
        plots.plot_load(lateral, **options)


@pytest.mark.parametrize(
    ("axes", "said"),
    [
        (Figure().subplots(1, 3), "the slope, the gain; given: 3"),
        (Figure().subplots(1, 1, squeeze=False), "given: 1"),
    ],
)
def test_axes_of_the_wrong_number_are_refused(lateral, axes, said):
    with pytest.raises(InvalidInputError, match=said):
        plots.plot_sensitivity(lateral, axes=axes)


def test_what_is_no_axes_is_refused():
    with pytest.raises(InvalidInputError, match="given: a str"):
        given_axes(["a", "b"], ["the slope", "the gain"])
    with pytest.raises(InvalidInputError, match=r"one Matplotlib Axes, not a ndarray.*axes\[0\]"):
        axes_or_new(Figure().subplots(1, 2))


def test_notebooks_show_a_figure(lateral):
    drawn = plots.plot_load(lateral).figure
    shown = drawn._repr_png_()
    assert shown.startswith(b"\x89PNG")
    assert int.from_bytes(shown[16:20]) == pytest.approx(90 * drawn.get_figwidth(), abs=1)


# --- files and state ----------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_the_same_figure_is_the_same_file(lateral, tmp_path, suffix):
    paths = [
        plots.save_figure(plots.plot_load(lateral).figure, tmp_path / f"{name}{suffix}")
        for name in "ab"
    ]
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_a_figure_is_not_overwritten_unasked(lateral, tmp_path):
    figure, path = plots.plot_load(lateral).figure, tmp_path / "a.png"
    plots.save_figure(figure, path)
    with pytest.raises(OutputError, match="exists already"):
        plots.save_figure(figure, path)
    plots.save_figure(figure, path, overwrite=True)
    with pytest.raises(InvalidInputError, match="suffix"):
        plots.save_figure(figure, tmp_path / "a.bmp")
    with pytest.raises(OutputError, match="no folder"):
        plots.save_figure(figure, tmp_path / "none" / "a.png")
    assert [p.name for p in tmp_path.iterdir()] == ["a.png"]


def test_plotting_changes_no_settings(lateral):
    before = dict(mpl.rcParams)
    rendered(plots.plot_results(lateral))
    assert dict(mpl.rcParams) == before


def test_no_figure_is_kept_and_no_window_library_imported():
    code = (
        "import sys, copsense; from copsense import plots;"
        "s = copsense.load_stance('solo12');"
        "plots.plot_stance(s, [copsense.cop_sensitivity(s, copsense.minimum_torque())]);"
        "sys.exit('matplotlib.pyplot' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_importing_copsense_does_not_import_matplotlib():
    code = "import sys, copsense; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
