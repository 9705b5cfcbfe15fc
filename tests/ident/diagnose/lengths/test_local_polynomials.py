"""Local polynomials beside SciPy's, whose import they spare."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import savgol_filter

from freeswing.ident.diagnose.lengths.local_polynomials import local_derivatives


@pytest.mark.parametrize(("width", "degree", "order"), [(5, 3, 1), (19, 3, 1), (7, 4, 2)])
@pytest.mark.parametrize("n", [19, 200])
def test_as_scipy_does(width: int, degree: int, order: int, n: int) -> None:
    values = np.random.default_rng(3).standard_normal((2, n)).cumsum(axis=1)
    ours = local_derivatives(values, width, degree, order, 0.01)
    theirs = np.asarray(savgol_filter(values, width, degree, deriv=order, delta=0.01, axis=1))
    off = np.abs(ours - theirs).max() / np.abs(theirs).max()
    assert off < 1e-12, f"off by {off:.1e} of the largest"


def test_a_window_wider_than_the_rows_is_refused() -> None:
    with pytest.raises(ValueError, match="window"):
        local_derivatives(np.zeros((1, 6)), 7, 4, 2, 0.01)
