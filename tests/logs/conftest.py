import pytest
from support import log_files

import copsense
from copsense.controllers.target import Sine
from copsense.simulation import Scenario


@pytest.fixture(scope="session")
def sway(icub):
    """A closed-loop recording of the iCub swaying under minimum torque."""
    scenario = Scenario(2.4, reference=Sine(0.008, 1.0), control_period=2e-3)
    return copsense.balance(icub, copsense.minimum_torque(), scenario)


@pytest.fixture(scope="session")
def data(sway):
    """Its arrays."""
    return log_files.of_recording(sway)


@pytest.fixture(scope="session")
def sway_file(sway, tmp_path_factory):
    """The recording in a file."""
    path = tmp_path_factory.mktemp("sway") / "sway.nc"
    sway.save(path)
    return path
