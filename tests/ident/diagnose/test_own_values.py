"""Values that each run has for itself: charged by what their run narrows, tied by their size."""

import numpy as np
import pytest

from freeswing.ident.diagnose.model_probabilities import Rival, log_evidence, model_probabilities
from freeswing.ident.diagnose.own_values import OwnValues, sizes

RUNS, SAMPLES, VALUES = 7, 300, 2
COUNTS, INDEPENDENT = np.full(RUNS, float(SAMPLES)), np.full(RUNS, 200.0)
EVERY = np.ones((1, RUNS))


def fans(seed: int, size: float) -> list[Rival]:
    """Nothing there, and a cosine and a sine part of new phase in each run, of this size.

    In deviations of the noise of one run they are known to a thirtieth of their plausible size.
    """
    rng = np.random.default_rng(seed)
    shapes = rng.normal(size=(RUNS, SAMPLES, VALUES)) / np.sqrt(SAMPLES) * 30.0
    phase = rng.uniform(0.0, 2.0 * np.pi, RUNS)
    parts = size * np.column_stack([np.cos(phase), np.sin(phase)])
    seen = rng.normal(size=(RUNS, SAMPLES)) - np.einsum("rna,ra->rn", shapes, parts)
    curves = np.swapaxes(shapes, 1, 2) @ shapes
    pulls = -np.einsum("rna,rn->ra", shapes, seen)
    likeliest = np.linalg.solve(curves + np.eye(VALUES), pulls[..., None])[..., 0]
    left = np.sum((seen + np.einsum("rna,ra->rn", shapes, likeliest)) ** 2, axis=1)
    left += np.sum(likeliest**2, axis=1)
    nothing, prior = np.sum(seen**2, axis=1), np.zeros((0, 1))
    squares = [np.sqrt(one)[:, None, None] for one in (nothing, left)]
    fan = Rival(squares[1], prior, 1, own=OwnValues(curves, pulls, np.ones(RUNS)))
    return [Rival(squares[0], prior, 0), fan]


def test_evidence_is_the_integral_over_the_values_of_the_likeliest_size() -> None:
    """One run, of what is left of it below its noise, where the density is exactly Gaussian."""
    none, fan = fans(1, 0.2)
    assert fan.own is not None
    one = OwnValues(fan.own.curves[:1], fan.own.pulls[:1], np.ones(1))
    grid = np.linspace(-1.0, 1.0, 401)
    places = np.stack(np.meshgrid(grid, grid), axis=-1).reshape(-1, 2)
    curve, pull = one.curves[0], one.pulls[0]
    gain = places @ pull - 0.5 * np.einsum("na,ab,nb->n", places, curve, places)
    wholes = []
    for size in np.geomspace(0.02, 1.0, 40):
        known = np.exp(-0.5 * np.sum(places**2, axis=1) / size**2) / (2.0 * np.pi * size**2)
        wholes.append(np.log(np.sum(np.exp(gain) * known) * (grid[1] - grid[0]) ** 2))
    beside = 0.5 * (none.triangles[0, 0, 0] ** 2 - fan.triangles[0, 0, 0] ** 2)
    found = one.log_evidence(np.ones((1, 1)))[0] + beside
    assert found == pytest.approx(max(wholes), abs=0.05)


def test_a_fan_of_one_strength_and_new_phases_is_believed() -> None:
    """Its amplitude is five of a run's deviations; the charge by number would ask for more."""
    chances = [model_probabilities(fans(seed, 0.17), COUNTS, INDEPENDENT)[1] for seed in range(5)]
    assert min(chances) > 0.99, chances


def test_no_fan_is_not_denied_absurdly_nor_believed() -> None:
    chances = [model_probabilities(fans(seed, 0.0), COUNTS, INDEPENDENT)[1] for seed in range(20)]
    assert max(chances) < 0.5, chances
    assert 1e-3 < np.median(chances) < 0.05, chances


def test_the_size_of_values_that_are_not_there_shrinks_to_nothing() -> None:
    none, fan = fans(3, 0.0)
    lead = log_evidence(fan, COUNTS, INDEPENDENT, EVERY) - log_evidence(
        none, COUNTS, INDEPENDENT, EVERY
    )
    assert -0.6 < lead[0] < 3.0, lead


def test_sizes_are_close_enough_to_find_the_likeliest() -> None:
    """Between two neighbours a sixth of a unit of evidence is lost, by fourteen values."""
    lost, told = [], sizes(1e6)
    for size in np.sqrt(told[:-1] * told[1:]):
        known = 30.0 / size  # values known to a thirtieth of their size
        pulls = np.full((RUNS, VALUES), known**2 * size)
        found = OwnValues(np.tile(known**2 * np.eye(VALUES), (RUNS, 1, 1)), pulls, np.ones(RUNS))
        wide = known**2 * np.geomspace(0.5, 2.0, 401)[:, None, None] ** 2 * size**2
        gains = pulls**2 / known**2 * (wide / (1.0 + wide) - known**2 / (1.0 + known**2))
        best = (0.5 * np.sum(gains - np.log1p(wide), axis=(1, 2))).max()
        lost.append(best - found.log_evidence(EVERY)[0])
    assert min(lost) >= 0.0, lost
    assert max(lost) == pytest.approx(0.173, rel=0.1), lost


@pytest.mark.parametrize("known", [0.5, 1.0, 1e3, 1e13])
def test_the_smallest_size_changes_nothing_and_is_not_smaller_than_that(known) -> None:
    """A hundredth of the variance by the best known value, the plausible size the largest."""
    told = sizes(known)
    assert told[-1] == 1.0
    assert 0.007 < told[0] ** 2 * max(known, 1.0) < 0.013
