"""On a cluster, with a worker killed, and resumed after a kill: the same bits as in one process."""

import logging
import os
import signal
import socket
import subprocess
import sys
import time

import psutil
import pytest

import copsense
from copsense.errors import CopsenseError, SchedulerError
from copsense.maps import Axis, Sample, cluster


def _workers():
    """Processes of the local cluster's workers."""
    children = psutil.Process().children(recursive=True)
    return [p for p in children if "spawn_main" in " ".join(p.cmdline())]


def test_a_worker_killed_among_two_leaves_the_store_as_one_process_does(
    icub, both, box, tmp_path, same
):
    sample = Sample(box, 32 * 64, seed=3)
    copsense.map_postures(icub, sample, both, tmp_path / "one.zarr", chunk=64)
    killed = []

    def kill(_):
        if not killed:  # its nanny starts another
            workers = _workers()
            assert len(workers) == 2
            workers[0].send_signal(signal.SIGKILL)
            killed.append(workers[0].pid)

    found = copsense.map_postures(
        icub, sample, both, tmp_path / "two.zarr", chunk=64, workers=2, progress=kill
    )
    assert killed
    assert found.complete
    assert same(tmp_path / "one.zarr", tmp_path / "two.zarr")


def test_a_command_killed_and_resumed_leaves_the_store_as_one_process_does(
    icub, both, tmp_path, same
):
    arguments = ["map", "icub", "--over", "com_y=-0.05:0.05", "--over", "com_z=0.46:0.52"]
    arguments += ["--samples", "4000", "--seed", "3", "--chunk", "100", "--output"]
    command = [sys.executable, "-c", "from copsense.cli import main; main()", *arguments]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    killed, whole = tmp_path / "killed.zarr", tmp_path / "whole.zarr"

    process = subprocess.Popen([*command, str(killed)], env=environment)
    until = time.monotonic() + 60
    while len(list(killed.glob("done/c/*"))) < 5 and time.monotonic() < until:
        time.sleep(0.01)
    process.kill()
    process.wait()
    assert 5 <= copsense.maps.map_summary(killed).chunks_done < 40
    done = subprocess.run([*command, str(killed)], env=environment, capture_output=True, text=True)
    assert done.returncode == 1, done.stderr  # some postures are out of reach
    assert "Traceback" not in done.stderr
    axes = (Axis("com_y", -0.05, 0.05), Axis("com_z", 0.46, 0.52))
    copsense.map_postures(icub, Sample(axes, 4000, seed=3), both, whole, chunk=100)
    assert copsense.maps.map_summary(killed).complete
    assert same(killed, whole)


@pytest.fixture
def mute():
    """Address of a server that takes connections and never speaks."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        yield f"tcp://127.0.0.1:{server.getsockname()[1]}"


def test_a_server_that_never_speaks_is_given_up_on(mute, icub, both, sample, tmp_path):
    start = time.monotonic()
    with pytest.raises(SchedulerError, match="no answer within 5 s"):
        copsense.map_postures(icub, sample, both, tmp_path / "m.zarr", scheduler=mute)
    assert time.monotonic() - start < 15
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nonsense"])
def test_a_scheduler_that_does_not_answer_is_one_error_and_nothing_written(
    address, icub, both, sample, tmp_path
):
    start = time.monotonic()
    with pytest.raises(SchedulerError, match="no Dask scheduler answers at"):
        copsense.map_postures(icub, sample, both, tmp_path / "m.zarr", scheduler=address)
    assert time.monotonic() - start < 10
    assert not list(tmp_path.iterdir())


def test_a_tls_address_is_not_a_scheduler_either(icub, both, sample, tmp_path):
    with pytest.raises(SchedulerError, match=r"no Dask scheduler answers at tls://127\.0\.0\.1:9"):
        copsense.map_postures(
            icub, sample, both, tmp_path / "m.zarr", scheduler="tls://127.0.0.1:9"
        )


SCHEDULER = """
from distributed import LocalCluster
if __name__ == "__main__":
    with LocalCluster(n_workers={}, threads_per_worker=1, host="127.0.0.1",
                      dashboard_address=None, processes=False, protocol="tcp") as cluster:
        print(cluster.scheduler_address, flush=True)
        input()
"""


@pytest.fixture
def scheduler(request):
    """A scheduler and its workers in a process: the process and the address."""
    command = [sys.executable, "-c", SCHEDULER.format(request.param)]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, env=environment, text=True) as process:
        yield process, process.stdout.readline().strip()
        process.kill()


@pytest.mark.parametrize("scheduler", [0], indirect=True)
def test_a_scheduler_without_workers_is_given_up_on(
    scheduler, icub, both, sample, tmp_path, monkeypatch
):
    monkeypatch.setattr(cluster, "_PATIENCE", 0.5)
    with pytest.raises(SchedulerError, match=r"no worker has joined tcp://.*dask worker tcp://"):
        copsense.map_postures(icub, sample, both, tmp_path / "m.zarr", scheduler=scheduler[1])
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("scheduler", [1], indirect=True)
def test_a_scheduler_that_dies_is_one_quiet_error_and_the_map_goes_on_after_it(
    scheduler, icub, both, sample, whole, tmp_path, same
):
    path = tmp_path / "m.zarr"
    with pytest.raises(SchedulerError, match=r"is gone\. The chunks that are done are kept"):
        copsense.map_postures(
            icub,
            sample,
            both,
            path,
            chunk=32,
            scheduler=scheduler[1],
            progress=lambda _: scheduler[0].kill(),
        )
    assert not logging.getLogger("distributed.client").isEnabledFor(logging.ERROR)
    copsense.map_postures(icub, sample, both, path, chunk=32)
    assert same(path, whole[0])


def test_a_worker_that_does_not_see_the_store_says_so(tmp_path):
    with pytest.raises(SchedulerError, match=r"does not see the store .*all workers share"):
        cluster.evaluate_chunk(b"", str(tmp_path / "m.zarr"), 0)


def test_ctrl_c_in_a_terminal_is_quiet_though_it_goes_to_the_workers_too(tmp_path):
    store = tmp_path / "m.zarr"
    arguments = ["map", "icub", "--over", "com_y=-0.05:0.05", "--over", "com_z=0.46:0.52"]
    arguments += ["--samples", "60000", "--chunk", "100", "--local", "1", "--output", str(store)]
    command = [sys.executable, "-c", "from copsense.cli import main; main()", *arguments]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    process = subprocess.Popen(
        command, env=environment, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    until = time.monotonic() + 60
    while len(list(store.glob("done/c/*"))) < 5 and time.monotonic() < until:
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in said
    assert "Run the same command again" in said


def test_a_cluster_is_one_or_the_other(icub, both, sample, tmp_path):
    path = tmp_path / "m.zarr"
    with pytest.raises(CopsenseError, match="one of the two"):
        copsense.map_postures(icub, sample, both, path, scheduler="tcp://a:1", workers=2)
    with pytest.raises(CopsenseError, match="from 1"):
        copsense.map_postures(icub, sample, both, path, workers=0)
