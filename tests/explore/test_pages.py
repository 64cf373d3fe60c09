"""Exported pages: they draw the robot in a real browser, light and dark, and request nothing."""

import numpy as np
import pytest
from support.browser import chromium, colour_at, offline, scene_of
from support.results import small_log

from copsense.errors import InvalidInputError
from copsense.explore import Model, Setting, State
from copsense.explore.drawing import NAMED, ON_DARK, ON_LIGHT, look_at
from copsense.explore.played_model import PlayedModel
from copsense.explore.shape import load_shape
from copsense.explore.view import placed, poses_of
from copsense.logs.aligned_log import align_log
from copsense.posture_run import PostureRun

pytest.importorskip("viser", reason="the extra explore is not installed")

from copsense.explore.export import export_page, frames_of, page_of
from copsense.explore.film import film_html

LEANING = State(("icub",), {"com_y": Setting(0.03, "m")})


@pytest.fixture(scope="module")
def browser():
    with chromium() as browser:
        yield browser


@pytest.fixture(scope="module")
def model(icub):
    return Model(icub)


@pytest.fixture(scope="module")
def exported(model, tmp_path_factory):
    return export_page(model, LEANING, tmp_path_factory.mktemp("pages") / "page.html")


@pytest.mark.parametrize(("scheme", "inks"), [("light", ON_LIGHT), ("dark", ON_DARK)])
def test_an_exported_page_draws_the_robot_and_requests_nothing(
    browser, model, exported, scheme, inks
):
    view = model.view(LEANING)
    with offline(browser, exported, scheme=scheme) as page:
        scene = scene_of(page)
        shown = {"minimum-wrench": view["minimum-wrench"].cop_world[0]}
        shown["minimum-torque"] = view["minimum-torque"].cop_world[1]
        for name, place in shown.items():
            seen, right = colour_at(scene, place, NAMED[name])
            assert right, (name, seen)
        seen, right = colour_at(scene, view.com, inks.line)
        assert right, seen
        assert page.locator("table").inner_text().count("r_sole") == 2
        scale = page.locator(".marks", has_text="Joints by torque under minimum-torque")
        assert "linear-gradient" in scale.locator("span").get_attribute("style")
        assert "copsense analyse icub --com-y 0.03m" in page.locator("code").inner_text()
        assert page.locator("#flat").is_hidden()  # what a browser without WebGL says
        outside = ("file:", "data:", "blob:", "about:")
        assert [u for u in page.requested if not u.startswith(outside)] == []
        assert [u for u in page.requested if u.startswith("file:")] == [exported.as_uri()]
        assert page.failed == []


def test_an_exported_page_says_who_wrote_what_it_gives_on(exported):
    text = exported.read_text(encoding="utf-8").partition("<summary>Licences of the 3-D view")[2]
    for name in ("three 0.", "react 19.", "@mantine/core 9."):
        assert f"\n{name}" in text
    assert "Copyright" in text
    assert "The above copyright notice and this permission notice shall be included" in text


def test_an_exported_page_is_small_and_the_stick_figure_nobodys(exported):
    text = exported.read_text(encoding="utf-8")
    assert len(text) < 0.9e6
    assert "CC-BY-SA" not in text


def test_a_film_plays_in_the_browser(browser, icub, tmp_path):
    log = small_log(icub)
    model, done = PlayedModel(align_log(log, icub).run(log), ["icub"]), []
    path = tmp_path / "film.html"
    export_page(model, State(("icub",)), path, rate=10.0, advance=done.append)
    assert sum(done) == frames_of(model, 10.0)
    with offline(browser, path) as page:
        scene = scene_of(page)
        where = "() => window.__viserMutable.nodeRefFromName['/com'].position.y"
        first = scene.evaluate(where)
        scene.wait_for_function(f"Math.abs(({where})() - {first}) > 2e-3", timeout=60_000)
        said = page.locator("body").inner_text()
        assert "minimum-torque, in motion" in said
        assert "squares those that the recorded motion's inertia asks for" in said
        assert page.failed == []


def test_a_page_of_no_posture_is_rejected(model, tmp_path):
    with pytest.raises(InvalidInputError, match="no posture of 'icub'"):
        export_page(model, State(("icub",), {"com_y": Setting(9.0, "m")}), tmp_path / "a.html")
    assert not list(tmp_path.iterdir())


def test_names_are_escaped(icub):
    name = "<img onerror=alert(1)>{}"
    run = PostureRun.of_stances([icub], source=name)
    text = page_of(PlayedModel(run), State(("icub",)))
    assert "<img onerror" not in text
    assert "&lt;img onerror=alert(1)&gt;{}" in text


def test_a_place_of_a_view_is_that_of_its_frame(icub):
    points = np.array([[0.1, -0.2, 0.3], [0.0, 0.0, 0.0]])
    for pose, place in zip(poses_of(list(icub.placements)), icub.placements, strict=True):
        found = placed(pose, points)
        np.testing.assert_allclose(found, [place.act(p) for p in points], atol=1e-12)


def test_meshes_are_in_the_picture_and_once_in_the_page(model, icub):
    shape = load_shape(icub.robot)
    view = model.view(LEANING)
    (low, size), (high, larger) = look_at(view), look_at(view, shape)
    assert larger > size  # the head is no joint
    assert high[2] > low[2]
    again = "dark.addEventListener"
    assert again in film_html([view])
    assert again not in film_html([view], shape=shape)
