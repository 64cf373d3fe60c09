"""A small space of postures of the iCub, and how two stores are compared."""

import numpy as np
import pytest
import zarr

import copsense
from copsense.maps import Axis, Grid, Sample


@pytest.fixture(scope="session")
def both():
    """The paper's two criteria."""
    return [copsense.minimum_wrench(1.0), copsense.minimum_torque()]


@pytest.fixture(scope="session")
def box(icub):
    """Ranges that reach beyond where the legs do."""
    z = float(icub.com[2])
    return (Axis("com_y", -0.05, 0.05), Axis("com_z", z - 0.06, z + 0.02), Axis("roll", -0.1, 0.1))


@pytest.fixture(scope="session")
def sample(box):
    """300 postures, some out of reach."""
    return Sample(box, 300, seed=3)


@pytest.fixture(scope="session")
def grid(box):
    """7 x 5 x 3 postures."""
    counts = zip(box, (7, 5, 3), strict=True)
    return Grid(tuple(Axis(a.name, a.start, a.stop, n) for a, n in counts))


@pytest.fixture(scope="session")
def whole(icub, both, sample, tmp_path_factory):
    """A map made in one go, and its summary."""
    path = tmp_path_factory.mktemp("whole") / "map.zarr"
    return path, copsense.map_postures(icub, sample, both, path, chunk=32)


@pytest.fixture(scope="session")
def same():
    """Whether two stores hold the same bits in every array."""

    def check(one, other):
        first, second = _arrays(one), _arrays(other)
        assert first.keys() == second.keys()
        assert len(first) > 15
        for name, array in first.items():
            if array.dtype.kind == "T":
                assert (array == second[name]).all(), name
            else:
                assert array.tobytes() == second[name].tobytes(), name
        return True

    return check


def _arrays(path):
    group = zarr.open_group(path, mode="r")
    found = {name: np.asarray(array[:]) for name, array in group.arrays()}
    return found | {f"parts/{name}": np.asarray(a[:]) for name, a in group["parts"].arrays()}
