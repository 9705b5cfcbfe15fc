"""Deviations by leaving out runs, and when they replace those of the residuals."""

import numpy as np
import pytest
from scipy.stats import chi2

from freeswing.ident.likelihood.between_runs import jackknife_std, widened

FREE = np.array([True, True, False])
UNIT = np.array([0.1, 3.0, 1.0])
NOTHING = np.zeros((0, 4))


def made(seed, apart=0.0, count=10, samples=40):
    """Runs that see three unknowns, the second of them displaced by chance in each."""
    rng = np.random.default_rng(seed)
    parts = []
    for _ in range(count):
        seen = rng.normal(size=(samples, 3)) / UNIT
        left = rng.normal(size=samples) + seen[:, 1] * apart * rng.normal()
        parts.append(np.column_stack([seen, left]))
    return parts


def by_hand(parts):
    """The same with whole least-squares fits."""
    kept = [np.delete(one, 2, axis=1) for one in parts]
    found = []
    for k in range(len(kept)):
        rows = np.vstack(kept[:k] + kept[k + 1 :])
        found.append(np.linalg.lstsq(rows[:, :-1], -rows[:, -1], rcond=None)[0])
    away = np.array(found) - np.mean(found, axis=0)
    return np.sqrt((len(kept) - 1) / len(kept) * np.sum(away**2, axis=0))


def covariance(parts):
    rows = np.vstack(parts)[:, :2]
    return np.linalg.inv(rows.T @ rows)


def test_leaving_out_runs_is_what_whole_fits_give_and_nothing_where_nothing_is_estimated():
    parts = made(1, apart=1.0)
    found = jackknife_std(parts, NOTHING, FREE, UNIT)
    assert found[:2] == pytest.approx(by_hand(parts), rel=1e-9)
    assert found[2] == 0.0
    assert not jackknife_std(parts[:2], NOTHING, FREE, UNIT).any()


def test_white_noise_widens_one_in_twenty_and_what_runs_say_apart_widens_always():
    white = displaced = 0
    for seed in range(200):
        for apart in (0.0, 3.0):
            parts = made(seed, apart)
            own = covariance(parts)
            std = jackknife_std(parts, NOTHING, FREE, UNIT)[:2]
            wider = np.sqrt(widened(own, std, len(parts))[1, 1] / own[1, 1])
            white += wider > 1.0 and not apart
            displaced += wider > 1.5 and apart > 0.0
    # by the jackknife's own bias a little more often than the law of chance has it
    assert 4 <= white <= 26, white
    assert displaced == 200, displaced


def test_correlations_stay_and_few_runs_say_nothing():
    own = np.array([[4.0, 1.0], [1.0, 1.0]])
    wide = widened(own, np.array([20.0, 0.1]), 8)
    assert wide == pytest.approx(np.array([[400.0, 10.0], [10.0, 1.0]]))
    assert widened(own, np.array([20.0, 0.1]), 2) is own


@pytest.mark.parametrize(("runs", "share", "wider"), [(8, 0.06, 1.0), (8, 0.045, 1.4)])
def test_what_chance_exceeds_once_in_twenty_is_none(runs, share, wider) -> None:
    ratio = np.sqrt(chi2.isf(share, runs - 1) / (runs - 1))
    found = np.sqrt(widened(np.eye(1), np.array([ratio]), runs)[0, 0])
    assert found == pytest.approx(wider, abs=0.05)
