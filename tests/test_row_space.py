"""A row space: what a matrix sees and leaves free, by QR and by SVD alike."""

import numpy as np
import pytest

from copsense.row_space import RowSpace

MATRICES = {
    "far apart": ([[1.0, 0.2, 0.0, 0.5], [0.0, 1.0, 0.3, 0.4]], 2, True),
    "square": ([[0.5, -1.0], [2.0, 3.0]], 2, True),
    "nearly parallel": ([[1.0, 0.0, 0.0], [1.0, 1e-5, 0.0]], 2, False),
    "dependent": ([[1.0, 2.0, 0.0, 1.0], [0.0, 1.0, 1.0, 0.0], [1.0, 3.0, 1.0, 1.0]], 2, False),
    "more rows than columns": ([[1.0, 0.0], [0.0, 2.0], [1.0, 1.0]], 2, False),
    "nothing": ([[0.0, 0.0, 0.0]], 0, False),
}


@pytest.mark.parametrize("name", MATRICES)
def test_it_leaves_free_what_the_matrix_does_not_see(name):
    rows, rank, apart = MATRICES[name]
    A = np.array(rows)
    found = RowSpace(A, 1e-12)
    assert (found.rank, found.apart) == (rank, apart)
    assert found.null.shape == (A.shape[1], A.shape[1] - rank)
    assert np.abs(A @ found.null).max(initial=0.0) < 1e-14
    assert np.allclose(found.null.T @ found.null, np.eye(A.shape[1] - rank), atol=1e-14)
    assert found.redundant.shape == (len(A), len(A) - rank)
    assert np.abs(found.redundant.T @ A).max(initial=0.0) < 1e-14
    assert not found.null.flags.writeable


@pytest.mark.parametrize("name", MATRICES)
def test_its_solution_is_the_smallest(name):
    A = np.array(MATRICES[name][0])
    right = np.arange(1.0, len(A) + 1)
    smallest = np.linalg.lstsq(A, right, rcond=1e-12)[0]
    assert np.allclose(RowSpace(A, 1e-12).least_solution(right), smallest, rtol=1e-9, atol=1e-12)


def test_a_matrix_of_small_numbers_can_count_as_nothing():
    A = np.array([[1e-10, 0.0], [0.0, 0.0]])
    assert RowSpace(A, 1e-9).rank == 1
    assert RowSpace(A, 1e-9, least=1.0).rank == 0
