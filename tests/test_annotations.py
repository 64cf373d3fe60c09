"""The shapes in copsense's annotations are checked here, and cost its users nothing."""

import subprocess
import sys

import numpy as np
import pytest
from jaxtyping import TypeCheckError

import copsense


def test_a_wrong_shape_is_caught(icub):
    with pytest.raises(TypeCheckError, match="wrenches"):
        icub.stack(np.zeros((2, 5)))
    # A name stands for one number wherever it appears: n torques, nv = n + 6 velocities.
    with pytest.raises(TypeCheckError):
        copsense.PosturePath((icub,), "index", "1", np.zeros(2), np.zeros((1, 29)))


def test_what_users_import_checks_nothing():
    code = "import sys, copsense; print('beartype' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
