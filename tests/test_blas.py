"""One BLAS thread while postures are evaluated, and the caller's own number afterwards."""

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

import copsense
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
