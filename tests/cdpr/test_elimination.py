"""The compiled elimination against LAPACK's."""

from __future__ import annotations

import numpy as np
import pytest

from freeswing.cdpr.elimination import eliminate, inverse_factor, inverse_factors


@pytest.mark.parametrize(("n", "m"), [(1, 1), (3, 3), (6, 1), (8, 24)])
def test_it_solves_what_lapack_solves(n: int, m: int) -> None:
    generator = np.random.default_rng(n)
    matrix, right = generator.standard_normal((n, n)), generator.standard_normal((n, m))
    matrix[0, 0] = 0.0 if n > 1 else 1.0  # a pivot that has to be exchanged
    known = np.linalg.solve(matrix, right)
    found = eliminate(matrix.copy(), right.copy())
    allowed = 1e-14 * np.linalg.cond(matrix) * np.abs(known).max()
    assert np.abs(found - known).max() < allowed, (found - known, allowed)


def test_rows_of_any_size_are_exchanged() -> None:
    """Without pivots the small one would lose all digits of the answer (Golub, Van Loan, 3.4)."""
    found = eliminate(np.array([[1e-20, 1.0], [1.0, 1.0]]), np.array([[1.0], [2.0]]))
    assert found[:, 0] == pytest.approx([1.0, 1.0], abs=1e-15)


def test_a_singular_one_is_refused() -> None:
    with pytest.raises(np.linalg.LinAlgError, match="singular"):
        eliminate(np.array([[1.0, 2.0], [2.0, 4.0]]), np.ones((2, 1)))


@pytest.mark.parametrize("n", [1, 3, 8, 48])
def test_a_factor_whitens_as_lapacks_inverse_does(n: int) -> None:
    """Only the lower triangle is read; what stands above is of no account."""
    slopes = np.random.default_rng(n).standard_normal((n, 2 * n))
    matrix = slopes @ slopes.T
    factor = inverse_factor(np.tril(matrix) + 7.0 * np.triu(np.ones((n, n)), 1))
    assert not np.triu(factor, 1).any()
    known = np.linalg.inv(matrix)
    allowed = 1e-14 * np.linalg.cond(matrix) * np.abs(known).max()
    assert np.abs(factor.T @ factor - known).max() < allowed
    both = inverse_factors(np.array([matrix, 4.0 * matrix]))
    np.testing.assert_allclose(both, np.array([factor, 0.5 * factor]), rtol=1e-12)


@pytest.mark.parametrize("last", [4.0, 3.9, np.nan])
def test_what_is_not_positive_definite_has_no_factor(last: float) -> None:
    with pytest.raises(np.linalg.LinAlgError, match="positive definite"):
        inverse_factor(np.array([[1.0, 2.0], [2.0, last]]))
