"""The server's doors: who may connect, and that nobody who does keeps the others waiting."""

import fcntl
import json
import os
import pty
import re
import signal
import socket
import subprocess
import sys
import termios
import time
import urllib.error
import urllib.request
from pathlib import Path

import numpy as np
import pytest
from support.commands import copsense as command

from copsense.errors import OutputError
from copsense.explore import Model

viser = pytest.importorskip("viser", reason="the extra explore is not installed")

import websockets.exceptions  # noqa: E402
from support.viser_client import Client  # noqa: E402
from websockets.sync.client import connect  # noqa: E402

from copsense.explore.explorer import Explorer  # noqa: E402
from copsense.explore.server import GuardedServer  # noqa: E402

COMMAND = (sys.executable, "-m", "copsense", "explore", "four_bar", "--no-browser", "--json")


@pytest.fixture(scope="module")
def explorer(icub):
    with Explorer(Model(icub), meshes=False, light=True) as explorer:
        yield explorer


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


def test_a_port_that_is_taken_and_a_host_that_is_not_ours_are_said_at_once(explorer):
    with pytest.raises(OutputError, match=f":{explorer.server.port}: .*--port"):
        GuardedServer(explorer.server.port)
    with pytest.raises(OutputError, match="address of this machine"):
        GuardedServer(0, "192.0.2.7")


def test_the_command_prints_its_address_alone_and_ends_on_a_signal(tmp_path):
    with subprocess.Popen(
        (*COMMAND, "--no-meshes", "--com-y", "5mm"),
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


def memory():
    """Of this process [MB]."""
    status = Path("/proc/self/status").read_text()
    return int(re.search(r"VmRSS:\s+(\d+)", status)[1]) / 1e3


def stalled(address, port):
    """A tab that connects and takes no more than fits into a small pipe."""
    pipe = socket.socket()
    pipe.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    pipe.connect(("127.0.0.1", port))
    return Client(address, sock=pipe, max_queue=1)


def test_a_tab_that_stalls_keeps_nobody_waiting_and_costs_no_memory(icub):
    explorer = Explorer(Model(icub), meshes=False, light=True)
    server, rng = explorer.server, np.random.default_rng(0)
    late = stalled(explorer, server.port)
    waits = []
    with Client(explorer) as one:
        one.until("copsense analyse icub<")
        before = memory()
        for i in range(60):
            half_a_megabyte = rng.random((40_000, 3), np.float32)
            server.viser.scene.add_point_cloud("/more", half_a_megabyte, (0, 0, 0))
            server.viser.flush()
            start = time.monotonic()
            one.slide("com_y [mm]", float(i + 1))
            one.until(rf"--com-y {(i + 1) / 1e3!r}m<")  # this cloud went out, not only the last
            waits.append(time.monotonic() - start)
        cursors = server.viser._websock_server._broadcast_buffer.generator_cursors
        assert min(cursors.values()) < max(cursors.values()) - 100  # it does stall
    assert sorted(waits)[len(waits) // 2] < 1.0
    assert memory() - before < 20.0  # of 30 MB that it did not take
    start = time.monotonic()
    explorer.close()
    assert time.monotonic() - start < 4.0
    late.line.socket.close()


def test_broken_knocks_leave_the_window_open(explorer):
    for words in (b"", b"GET /", b"\x16\x03\x01\x02\x00\x01", b"GET / HTTP/1.1\r\n" + b"a" * 9000):
        with socket.create_connection(("127.0.0.1", explorer.server.port)) as knock:
            knock.sendall(words)
            knock.shutdown(socket.SHUT_WR)
    with Client(explorer) as client:
        client.line.send(b"\xc1 no message")
    with Client(explorer) as client:
        client.until("copsense analyse icub")


def test_two_tabs_that_drag_at_once_end_in_one_state(explorer):
    explorer._reset()
    with Client(explorer) as one, Client(explorer) as other:
        for client in (one, other):
            client.until("copsense analyse icub<")
        for i in range(1, 11):
            one.slide("com_y [mm]", float(i))
            other.slide("com_z [mm]", -float(i))
        for client in (one, other):
            client.until(r"--com-y 0\.01m --com-z|--com-z \S+ --com-y 0\.01m<")
            client.until(f"--com-z {explorer.model.coordinates['com_z'].home - 0.01:.3f}")
    assert explorer._worker.error == ""
    explorer._reset()


def test_ctrl_c_at_the_keyboard_ends_it_quietly(tmp_path):
    """The terminal sends SIGINT to the whole group in its foreground; a tab stalls meanwhile."""
    main, terminal = pty.openpty()
    with subprocess.Popen(
        COMMAND,
        stdin=terminal,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
        start_new_session=True,
        preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),
    ) as process:
        told = json.loads("".join(process.stdout.readline() for _ in range(4)))
        port = int(told["url"].split(":")[2].split("/")[0])
        late = stalled(told["url"], port)
        os.write(main, b"\x03")
        start = time.monotonic()
        out, err = process.communicate(timeout=30)
        took = time.monotonic() - start
        late.line.socket.close()
    os.close(main)
    os.close(terminal)
    assert process.returncode == 0, err
    assert took < 10.0
    assert out == ""
    assert "Traceback" not in err
    assert "Ctrl-C" not in out


def test_a_port_that_is_taken_is_one_line_of_the_command(explorer):
    before = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
    port = str(explorer.server.port)
    answer = command("explore", "four_bar", "--no-browser", "--port", port)
    assert answer.code == 2
    assert answer.out == ""
    assert len(answer.err.strip().splitlines()) == 1
    assert f":{port}: " in answer.err
    assert (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)) == before
