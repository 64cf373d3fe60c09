"""Set up before copsense is imported: one BLAS thread, and shapes of arrays checked."""

import gc
import os
from pathlib import Path

# Small matrices on few cores; set before NumPy loads its BLAS.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pytest
from support import shape_checks

# The shapes that copsense annotates are checked while the suite runs, and only then.
shape_checks.install()

import copsense  # noqa: E402
from copsense.robots.presets import shared_presets  # noqa: E402

# Where several processes share the tests, each takes the next module: the longest come first, so
# that none is left alone at the end, and before them the kernel that others need is compiled.
LONG = (
    "batch/postures/test_charts.py",
    "simulation/test_sway.py",
    "statics/test_constrained_optimum.py",
    "test_documents.py",
    "plots/test_plots.py",
    "simulation/test_balance_command.py",
    "test_design.py",
    "maps/test_cluster.py",
    "paper/report/test_report.py",
    "cli/test_bad_input.py",
    "cli/test_map_command.py",
    "comparison/test_benchmark_command.py",
    "robots/test_other_robots.py",
    "cli/test_analyse_command.py",
    "regions/test_regions.py",
    "simulation/test_driven_robots.py",
    "comparison/test_benchmark_run.py",
    "cli/test_design_command.py",
    "comparison/test_trials.py",
    "paper/report/test_browser.py",
    "simulation/test_motion.py",
    "simulation/test_disturbances.py",
)


def pytest_collection_modifyitems(items):
    rank = {Path(__file__).parent / name: number for number, name in enumerate(LONG)}
    items.sort(key=lambda item: rank.get(item.path, len(LONG)))


def pytest_collection_finish():
    # Four hundred thousand objects stay to the end: to look through them takes a third of a
    # second each time that garbage is collected.
    gc.freeze()


def pytest_runtest_setup(item):
    shape_checks.begin_test()


@pytest.fixture(scope="session", autouse=True)
def presets_read_once():
    """Models are never changed after construction, and to read one is half of many a command."""
    with shared_presets():
        yield


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
