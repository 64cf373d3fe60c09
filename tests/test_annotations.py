"""The shapes in copsense's annotations are checked here, and cost its users nothing."""

import subprocess
import sys

import numpy as np
import pytest
from jaxtyping import Float, TypeCheckError
from support import shape_checks

import copsense


def test_a_wrong_shape_is_caught(icub):
    with pytest.raises(TypeCheckError, match="wrenches"):
        icub.stack(np.zeros((2, 5)))
    # A name stands for one number wherever it appears: n torques, nv = n + 6 velocities.
    with pytest.raises(TypeCheckError):
        copsense.PosturePath((icub,), "index", "1", np.zeros(2), np.zeros((1, 29)))


def test_a_wrong_shape_is_caught_in_the_answer_too():
    @shape_checks.checked
    def shorter(x: Float[np.ndarray, "n"], by: "int") -> "Float[np.ndarray, 'n']":
        return x[by:]

    assert len(shorter(np.zeros(3), 0)) == 3
    with pytest.raises(TypeCheckError, match="return"):
        shorter(np.zeros(3), 1)


def test_the_first_calls_of_a_test_are_checked_and_some_of_the_later(icub):
    right, wrong = np.zeros((2, 6)), np.zeros((2, 5))
    for _ in range(shape_checks.FIRST):
        icub.stack(right)

    def caught():
        try:
            icub.stack(wrong)
        except TypeCheckError:
            return True
        except ValueError:  # NumPy's, of a call that was not checked
            return False

    assert sum(caught() for _ in range(2 * shape_checks.EVERY)) == 2
    shape_checks.begin_test()
    with pytest.raises(TypeCheckError, match="wrenches"):
        icub.stack(wrong)


def test_a_function_made_within_another_is_checked_too():
    @shape_checks.checked
    def outer(value):
        @shape_checks.checked
        def inner(x: float) -> float:
            return x

        return inner(value)

    assert outer(1) == 1
    with pytest.raises(TypeCheckError):
        outer("1")


def test_what_users_import_checks_nothing():
    code = "import sys, copsense; print('beartype' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
