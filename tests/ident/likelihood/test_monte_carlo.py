"""A small benchmarks/identify/identify_monte_carlo.py: estimates and the Cramer-Rao bound."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from benchmarks.identify.identify_monte_carlo import (
    NOISE_M,
    covariance_bound_of,
    likelihood,
    runs_of,
)
from freeswing.cdpr.model.regressor import regressor
from freeswing.ident.fidim.fidim import fidim
from freeswing.ident.signals.derivatives import SignalSettings
from freeswing.ident.signals.usable_runs import prepare_runs
from tests.ident.swings import REGULAR, TRUE_INERTIA, paper_model, tilted_swing

DRAWS = 4


@pytest.mark.slow
@pytest.mark.parametrize("length_error_m", [0.0, 5e-4])
def test_maximum_likelihood_reaches_the_bound_and_fidim_stays_far_off(length_error_m: float):
    """Errors weighed by the bound's covariance, four times nine: chi-square with 36 degrees.

    An estimate that is worse than the bound comes out above, one that has seen the truth below.
    """
    model = paper_model()
    motions = [tilted_swing(k) for k in REGULAR[:6]]
    covariance = covariance_bound_of(motions, length_error_m)
    bound = np.sqrt(np.diag(covariance))
    low, high = chi2.ppf([1e-4, 1.0 - 1e-4], DRAWS * len(bound))
    by_ml, by_fidim, covered = [], [], []
    total = 0.0
    for draw in range(DRAWS):
        runs = runs_of(motions, np.random.default_rng([7, draw]), NOISE_M, length_error_m)
        prepared = prepare_runs(runs, model, SignalSettings())
        usable = [run.free for run in prepared.runs if run.free is not None]
        published = fidim([regressor(model, motion) for motion in usable]).values
        found = likelihood(runs, published)
        off = found.inertia - TRUE_INERTIA
        total += float(off @ np.linalg.solve(covariance, off))
        by_ml.append(off / bound)
        by_fidim.append((published - TRUE_INERTIA) / bound)
        covered.append(np.abs(found.inertia - TRUE_INERTIA) < 1.96 * found.stds)
    ml, tls = (float(np.sqrt(np.mean(np.square(errors)))) for errors in (by_ml, by_fidim))
    assert low < total < high, f"chi-square {total:.1f}, {low:.1f} to {high:.1f}; rmse {ml:.2f}"
    assert tls > 5.0, f"rmse over bound: maximum likelihood {ml:.2f}, FIDIM {tls:.1f}"
    assert np.mean(covered) > 0.8, f"95 % intervals hold the truth {100 * np.mean(covered):.0f} %"
