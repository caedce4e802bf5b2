"""The constants of the collocation solve what they are used for."""

import numpy as np
import pytest

from tactile_lab.model.tableau import DIFFERENTIATE, SCHUR_Q, SCHUR_T


@pytest.mark.parametrize("r", [0.0, 0.1, 3.0, 24.0, 1e4])
def test_the_schur_form_solves_as_well_as_elimination(r):
    one = np.eye(len(DIFFERENTIATE))
    right = np.ones(len(one))
    x = SCHUR_Q @ np.linalg.solve(SCHUR_T + r * one, SCHUR_Q.T @ right)
    expected = np.linalg.solve(DIFFERENTIATE + r * one, right)
    assert np.max(np.abs(x - expected)) < 2e-14 * np.max(np.abs(expected))


def test_the_schur_form_is_made_of_pairs():
    rows, columns = np.indices(SCHUR_T.shape)
    assert not SCHUR_T[rows // 2 > columns // 2].any()
    assert np.allclose(SCHUR_Q @ SCHUR_Q.T, np.eye(len(SCHUR_Q)), atol=1e-15)
