"""The window: its doors, what a slider does through viser's protocol, and in a real browser."""

import shlex
import time
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest
from support.browser import chromium, colour_at
from support.commands import copsense as command

import copsense
from copsense.explore import Model, Setting, State
from copsense.explore.played_model import PlayedModel
from copsense.limits import Limits
from copsense.posture_run import PostureRun

viser = pytest.importorskip("viser", reason="the extra explore is not installed")

from support.viser_client import Client  # noqa: E402

from copsense.explore.drawing import NAMED, support  # noqa: E402
from copsense.explore.explorer import Explorer  # noqa: E402

READY = (
    "window.__viserMutable && window.__viserMutable.scene"
    " && window.__viserMutable.messageQueue.length === 0"
)
COMMAND = "document.querySelector('#copsense-command').innerText"


@pytest.fixture(scope="module")
def explorer(icub, tmp_path_factory):
    with Explorer(Model(icub), meshes=False, light=True) as explorer:
        yield explorer


def test_a_slider_moves_the_robot_and_the_command_says_what_the_table_does(explorer):
    with Client(explorer) as one, Client(explorer) as other:
        one.until("copsense analyse icub<")
        assert one.bytes < 1e6
        before = explorer.view.revision
        one.slide("com_y [mm]", 30.0)
        for client in (one, other):
            client.until(r"copsense analyse icub --com-y 0\.03m<")
        assert explorer.view.revision > before
        assert explorer.view.com[1] == pytest.approx(0.03, abs=1e-11)
        line = explorer.view.state.to_command()
        answer = command(*shlex.split(line)[1:], "--json").json
        margin = answer["criteria"]["minimum-torque"]["contacts"]["r_sole"]["margin"]
        assert f"{1e3 * margin:.1f} to +y" in one.words
        other.line.socket.close()  # torn: whoever is left is served
        one.slide("com_y [mm]", 900.0)
        one.until("no posture of &#x27;icub&#x27;.*The last posture is shown")
        one.slide("com_y [mm]", 10.0)
        one.until(r"com-y 0\.01m<")
        assert explorer._worker.error == ""


def test_before_its_first_work_the_window_has_the_view_that_it_shows(icub, monkeypatch):
    monkeypatch.setattr("copsense.explore.worker.Worker.start", lambda _: None)
    with Explorer(Model(icub), meshes=False, light=True) as explorer:
        with Client(explorer) as client:
            client.until("copsense analyse icub<")
        explorer._from_above()
        explorer._from_front()
        assert explorer.view.revision == 0
        np.testing.assert_allclose(explorer.view.q, icub.q)


def test_what_the_command_asked_for_stays_to_the_last_digit(stance_of):
    state = State(
        ("four_bar",),
        {"com_y": Setting(0.0123456789, "m")},
        criteria=("minimum-wrench", "stiffness:1000", "minimum-torque"),
        length=0.3,
        limits=Limits(normal_force=3.0, friction=0.777, cop_margin=None),
        overlays=frozenset({"curve"}),
    )
    with Explorer(Model(stance_of("four_bar")), state, meshes=False, light=True) as explorer:
        panel = explorer._panel
        assert panel.read() == state
        torque, *_ = panel._judging._choices["torque"]
        torque.value = "the model's"  # nothing else of the limits changes
        assert panel.read().limits == replace(state.limits, torque="model")
        panel._judging._length.value = -1.0
        assert panel.read() == replace(
            state, length=0.1, limits=replace(state.limits, torque="model")
        )


def the_only_tab(explorer, seconds=10.0):
    """The tab that is open: of those of earlier tests the server hears a little later."""
    end = time.monotonic() + seconds
    while len(tabs := list(explorer.server.viser.get_clients().values())) != 1:
        assert time.monotonic() < end, f"{len(tabs)} tabs are open"
        time.sleep(0.02)
    return tabs[0]


def test_from_above_the_soles_are_near_and_nothing_hides_them(explorer):
    explorer._reset()
    with Client(explorer) as client:
        client.until("copsense analyse icub<")
        scene, tab = explorer._scene, the_only_tab(explorer)
        explorer._from_above()
        middle, size = support(explorer.view)
        client.until('id="copsense-revision"')
        assert tab.camera.position[2] == pytest.approx(explorer.view.ground + size)
        np.testing.assert_allclose(tab.camera.look_at, middle)
        end = time.monotonic() + 10.0
        while scene._com.visible and time.monotonic() < end:
            time.sleep(0.02)
        assert not scene._com.visible
        assert not scene._bones.visible
        assert not any(arrows.visible for arrows in scene._arrows.values())
        assert all(ball.visible for balls in scene._balls.values() for ball in balls)
    explorer._from_front()
    explorer._reset()


@pytest.fixture(scope="module")
def browser():
    with chromium() as browser:
        yield browser


@contextmanager
def page_of(browser, explorer):
    """The window in a browser, ready, its errors kept on it."""
    page = browser.new_page(viewport={"width": 1000, "height": 700})
    page.failed = []
    page.on("pageerror", lambda error: page.failed.append(str(error)))
    page.goto(f"{explorer.url}?fixedDpr=1")
    page.wait_for_selector("#copsense-command", timeout=60_000)
    page.wait_for_function(READY, timeout=60_000)
    # It covers a corner, and says that there is no GPU.
    close = page.locator(".mantine-Notification-closeButton")
    for _ in range(close.count()):
        close.first.click()
    yield page
    page.close()


def test_in_a_browser_a_slider_changes_the_table_and_the_picture(browser, explorer):
    explorer._reset()
    with page_of(browser, explorer) as page:
        page.wait_for_function(f"{COMMAND} === 'copsense analyse icub'")
        before = page.locator("table").inner_text()
        label = page.locator("label", has_text="com_y [mm]")
        slider = label.locator("xpath=ancestor::div[contains(@class,'Flex-root')][1]")
        slider.locator("input[type=text]").fill("25")
        page.wait_for_function(f"{COMMAND}.includes('--com-y 0.025m')")
        said = page.locator("table").inner_text()
        assert said != before
        view = explorer.view
        assert f"{1e3 * view['minimum-torque'].margin[1]:.1f} to +y" in said
        # A foot's two dots are where its centres of pressure are.
        for name in ("minimum-wrench", "minimum-torque"):
            assert view[name].margin[1] > 0
            seen, right = colour_at(page, view[name].cop_world[1], NAMED[name])
            assert right, (name, seen)
        line = page.locator("#copsense-command").inner_text()
        answer = command(*shlex.split(line)[1:], "--json").json
        told = answer["criteria"]["minimum-torque"]["contacts"]["r_sole"]["margin"]
        assert f"{1e3 * told:.1f} to +y" in said
        assert page.failed == []


def test_in_a_browser_a_run_is_played(browser, icub):
    path = copsense.lateral_sweep(icub, -0.03, 0.03, 13)
    model = PlayedModel(PostureRun.of_stances(path.stances, source="a sweep"), ["icub"])
    with (
        Explorer(model, meshes=False, light=True) as explorer,
        page_of(browser, explorer) as page,
    ):
        where = "window.__viserMutable.nodeRefFromName['/com'].position.y"
        first, said = page.evaluate(where), page.locator("table").inner_text()
        assert page.get_by_role("button", name="copy Python").count() == 1
        assert page.get_by_role("button", name="copy command").count() == 0  # there is none
        page.get_by_label("play").check()
        page.wait_for_function(f"Math.abs({where} - {first}) > 0.01", timeout=30_000)
        page.get_by_label("play").uncheck()
        assert page.locator("table").inner_text() != said
        assert page.failed == []
