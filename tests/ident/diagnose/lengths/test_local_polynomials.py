"""Derivatives of samples by local polynomials."""

from __future__ import annotations

import numpy as np
import pytest

from freeswing.ident.diagnose.lengths.local_polynomials import local_derivatives


@pytest.mark.parametrize(("over_s", "degree", "order"), [(0.01, 3, 1), (0.19, 3, 1), (0.3, 4, 2)])
@pytest.mark.parametrize("n", [31, 200])
def test_a_polynomial_is_differentiated_exactly(
    over_s: float, degree: int, order: int, n: int
) -> None:
    times = 5.0 + 0.01 * np.arange(n)
    both = [np.polynomial.Polynomial([1.0, -2.0, 3.0, -0.5, 0.2][: degree + 1]).convert()] * 2
    truth = np.column_stack([one.deriv(order)(times - 5.0) for one in both])
    values = np.column_stack([one(times - 5.0) for one in both])
    off = np.abs(local_derivatives(times, values, over_s, degree, order) - truth).max()
    assert off < 1e-9 * np.abs(truth).max(), f"off by {off:.1e}"


def test_a_window_is_as_long_as_asked() -> None:
    """A step of one sample is seen half a window away, and no farther."""
    times = 0.01 * np.arange(101)
    seen = local_derivatives(times, (times >= 0.5)[:, None].astype(float), 0.2, 3, 1)[:, 0]
    assert np.flatnonzero(np.abs(seen) > 1e-9).tolist() == list(range(40, 60))


def test_a_window_wider_than_the_rows_is_refused() -> None:
    with pytest.raises(ValueError, match="window"):
        local_derivatives(0.01 * np.arange(6), np.zeros((6, 1)), 0.07, 4, 2)
