"""One BLAS thread while postures are evaluated, and the caller's own number afterwards."""

import os
import subprocess
import sys

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

import copsense
from copsense.blas import one_blas_thread
from copsense.sweeps import Sweep


def threads():
    return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}


@pytest.fixture(autouse=True)
def two_threads():
    with threadpool_limits(2, user_api="blas"):
        assert threads() == {2}
        yield


def test_a_sweep_runs_on_one_thread_and_leaves_what_it_found(icub):
    seen = []
    path = copsense.lateral_sweep(icub, -0.01, 0.01, 3)
    found = copsense.sweep(
        path, [copsense.minimum_torque()], progress=lambda _: seen.append(threads())
    )
    assert isinstance(found, Sweep)
    assert seen
    assert set().union(*seen) == {1}
    assert threads() == {2}


def test_an_error_lifts_it_too(icub):
    with pytest.raises(copsense.CopsenseError, match="minimum-torque"):
        copsense.com_regions(icub, [copsense.minimum_torque()] * 2, copsense.Limits(friction=0.5))
    assert threads() == {2}


def test_the_outer_of_two_restores():
    with one_blas_thread():
        with one_blas_thread():
            assert threads() == {1}
        assert threads() == {1}
    assert threads() == {2}


# In a process of its own, whose number of threads nobody holds.
OVERLAP = """
import threading
import numpy, scipy.linalg
from threadpoolctl import threadpool_info
from copsense.blas import one_blas_thread

first_in, second_in, first_out = (threading.Event() for _ in range(3))

def threads():
    return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}

def first():
    with one_blas_thread():
        first_in.set()
        second_in.wait(10.0)

def second():
    first_in.wait(10.0)
    with one_blas_thread():
        print(threads())
        second_in.set()
        first_out.wait(10.0)

workers = [threading.Thread(target=each) for each in (first, second)]
for worker in workers:
    worker.start()
workers[0].join()
first_out.set()
workers[1].join()
print(threads())
"""


def test_threads_that_overlap_leave_what_they_found():
    done = subprocess.run(
        [sys.executable, "-c", OVERLAP],
        env=os.environ | {"OPENBLAS_NUM_THREADS": "2"},
        capture_output=True,
        text=True,
        timeout=60.0,
    )
    assert done.stdout.split("\n")[:2] == ["{1}", "{2}"], done.stderr
