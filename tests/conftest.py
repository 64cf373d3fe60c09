"""Set up before copsense is imported: one BLAS thread, and shapes of arrays checked."""

import os

# Small matrices on few cores; set before NumPy loads its BLAS.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pytest
from support import shape_checks

# The shapes that copsense annotates are checked while the suite runs, and only then.
shape_checks.install()

import copsense  # noqa: E402


def pytest_runtest_setup(item):
    shape_checks.begin_test()


@pytest.fixture(scope="session")
def stance_of():
    """Stance of a preset by name, loaded once."""
    stances = {}

    def load(name):
        if name not in stances:
            stances[name] = copsense.load_stance(name)
        return stances[name]

    return load


@pytest.fixture(scope="session")
def icub(stance_of):
    """The iCub of [Romano2016] on two feet."""
    return stance_of("icub")


@pytest.fixture(scope="session")
def lateral_path(icub):
    """The iCub's CoM swept from over one foot to over the other."""
    return copsense.lateral_sweep(icub, -0.07, 0.07, 15)
