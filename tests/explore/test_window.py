"""The window: its doors, what a slider does through viser's protocol, and in a real browser."""

import json
import os
import re
import shlex
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from dataclasses import replace

import pytest
from support.browser import chromium
from support.commands import copsense as command

from copsense.errors import OutputError
from copsense.explore import Model, Setting, State
from copsense.limits import Limits

viser = pytest.importorskip("viser", reason="the extra explore is not installed")

import msgspec  # noqa: E402
import websockets.exceptions  # noqa: E402
import zstandard  # noqa: E402
from websockets.sync.client import connect  # noqa: E402

from copsense.explore.explorer import Explorer  # noqa: E402
from copsense.explore.server import GuardedServer  # noqa: E402

CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (1.0, 0.0, 1.0),
    "fov": 1.0,
    "near": 0.01,
    "far": 100.0,
    "image_height": 300,
    "image_width": 300,
    "look_at": (0.0, 0.0, 0.0),
    "up_direction": (0.0, 0.0, 1.0),
}


@pytest.fixture(scope="module")
def explorer(icub, tmp_path_factory):
    with Explorer(Model(icub), meshes=False, light=True) as explorer:
        yield explorer


class Client:
    """A browser's part of viser's protocol."""

    def __init__(self, explorer, **options):
        url = explorer.url.replace("http", "ws")
        options = {"max_size": None, **options}
        self.line = connect(url, subprotocols=[f"viser-v{viser.__version__}"], **options)
        self.gui = {}
        self.bytes = 0
        self.send(CAMERA)

    def send(self, message):
        self.line.send(msgspec.msgpack.encode(message))

    def slide(self, label, value):
        uuid = next(u for u, m in self.gui.items() if m["props"].get("label") == label)
        self.send({"type": "GuiUpdateMessage", "uuid": uuid, "updates": {"value": value}})

    def until(self, what, seconds=20.0):
        """Take messages until the panel's words fit a pattern; the match."""
        end = time.monotonic() + seconds
        while True:
            found = re.search(what, self.words, re.DOTALL)
            if found:
                return found
            raw = self.line.recv(timeout=max(end - time.monotonic(), 0.01))
            self.bytes += len(raw)
            size = int.from_bytes(raw[8:16], "little")
            inner = zstandard.ZstdDecompressor().decompress(
                raw[16 : 16 + size], max_output_size=int.from_bytes(raw[:8], "little")
            )
            for message in msgspec.msgpack.decode(inner)["messages"]:
                if message["type"].startswith("Gui") and "props" in message:
                    self.gui[message["uuid"]] = message
                elif message["type"] == "GuiUpdateMessage" and message["uuid"] in self.gui:
                    known = self.gui[message["uuid"]]
                    known["props"].update(message["updates"])

    @property
    def words(self):
        return " ".join(str(m["props"].get("content", "")) for m in self.gui.values())

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.line.close()


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


@pytest.mark.parametrize(
    ("path", "headers", "code"),
    [
        ("", {}, 200),
        (None, {}, 403),
        ("", {"Host": "evil.example"}, 403),
        ("", {"Origin": "http://evil.example"}, 403),
        ("../../etc/passwd", {}, 404),
    ],
)
def test_only_the_whole_address_opens_the_page(explorer, path, headers, code):
    whole = explorer.url
    url = whole.rsplit("/", 2)[0] + "/" if path is None else whole + path
    request = urllib.request.Request(url, headers=headers)
    try:
        with urllib.request.urlopen(request, timeout=10) as answer:
            got = answer.status
    except urllib.error.HTTPError as error:
        got = error.code
    assert got == code


def test_another_page_cannot_connect(explorer):
    with pytest.raises(websockets.exceptions.InvalidStatus, match="403"):
        Client(explorer, origin="http://evil.example")
    with pytest.raises(websockets.exceptions.InvalidStatus, match="403"):
        connect(
            f"ws://127.0.0.1:{explorer.server.port}/wrong/",
            subprotocols=[f"viser-v{viser.__version__}"],
        )
    own = f"http://127.0.0.1:{explorer.server.port}"
    with Client(explorer, origin=own) as client:
        client.until("copsense analyse")


def test_nobody_opens_a_tunnel(explorer, monkeypatch):
    opened = []
    monkeypatch.setattr("viser._viser.ViserTunnel", lambda *a, **k: opened.append(a))
    with Client(explorer) as client:
        client.send({"type": "ShareUrlRequest"})
        client.until("copsense analyse")
        time.sleep(0.3)
    assert not opened


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


def test_a_port_that_is_taken_and_a_host_that_is_not_ours_are_said_at_once(explorer):
    with pytest.raises(OutputError, match=f":{explorer.server.port}: .*--port"):
        GuardedServer(explorer.server.port)
    with pytest.raises(OutputError, match="address of this machine"):
        GuardedServer(0, "192.0.2.7")


def test_the_command_prints_its_address_alone_and_ends_on_a_signal(tmp_path):
    arguments = ["explore", "four_bar", "--no-browser", "--json", "--no-meshes", "--com-y", "5mm"]
    with subprocess.Popen(
        [sys.executable, "-m", "copsense", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
        env=os.environ | {"_VISER_PORT_OVERRIDE": "1"},  # viser would listen there in silence
    ) as process:
        lines = [process.stdout.readline() for _ in range(4)]
        told = json.loads("".join(lines))
        with urllib.request.urlopen(told["url"], timeout=20) as answer:
            assert answer.status == 200
        process.send_signal(signal.SIGTERM)
        out, err = process.communicate(timeout=30)
    assert process.returncode == 0, err
    assert out == ""
    assert "Traceback" not in err
    with socket.socket() as probe:
        assert probe.connect_ex(("127.0.0.1", int(told["url"].split(":")[2].split("/")[0]))) != 0


@pytest.fixture(scope="module")
def browser():
    with chromium() as browser:
        yield browser


def test_in_a_browser_a_slider_changes_the_table(browser, explorer):
    page = browser.new_page(viewport={"width": 1000, "height": 700})
    errors = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(explorer.url)
    page.wait_for_selector("#copsense-command", timeout=60_000)
    explorer._reset()
    page.wait_for_function(
        "document.querySelector('#copsense-command').innerText === 'copsense analyse icub'"
    )
    before = page.locator("table").inner_text()
    label = page.locator("label", has_text="com_y [mm]")
    slider = label.locator("xpath=ancestor::div[contains(@class,'Flex-root')][1]")
    slider.locator("input[type=text]").fill("25")
    page.wait_for_function(
        "document.querySelector('#copsense-command').innerText.includes('--com-y 0.025m')"
    )
    assert page.locator("table").inner_text() != before
    found = explorer.view["minimum-torque"]
    assert f"{1e3 * found.margin[1]:.1f} to +y" in page.locator("table").inner_text()
    assert errors == []
    page.close()
