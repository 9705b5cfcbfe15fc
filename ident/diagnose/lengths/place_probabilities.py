"""How probable it is that blocks of the geometry are grossly off, and which replace each other.

Evidence of a set of gross blocks is closed form. Since the noise of lengths is never quite as it is
modelled, one set of runs would make it too sure: the probabilities are averages over posteriors
under random weights of the runs (Huggins, Miller 2023, "Reproducible model selection using bagged
posteriors", with the weights of the Bayesian bootstrap). What two runs alone say is so not sure.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np

from freeswing.cdpr.robot import Array
from freeswing.ident.diagnose.lengths.joint_lengths import (
    Blocks,
    Normal,
    Solved,
    honest_covariance,
    solved,
    total,
)

MOST_WRONG = 3
# One block in thirty is off in a robot that somebody has measured: a dozen blocks, a third of all
# robots with something wrong.
CHANCE_OF_WRONG = 1.0 / 30.0
DRAWS = 100
SEED = 20202
# The threshold for accepting: that a block, or one of a group, is wrong.
ACCEPTED = 0.95
# What is less probable replaces nothing.
RIVAL = 0.05
MOST_RIVALS = 3  # of more than three places to look at, none is told
# Sets less probable than this move no mean.
COUNTS = 2e-3

Chances = Mapping[tuple[str, ...], float]


def set_probabilities(normal: Normal, blocks: Blocks) -> dict[tuple[str, ...], float]:
    """Posterior probability of each set of blocks that is wrong, of up to `MOST_WRONG`."""
    seen = np.diag(total(normal)[0]) > 0.0
    keys = [key for key, where in blocks.columns.items() if seen[where].all()]
    sets = [one for n in range(MOST_WRONG + 1) for one in combinations(keys, n)]
    places = _places(sets, blocks)
    odds = np.log(CHANCE_OF_WRONG / (1.0 - CHANCE_OF_WRONG))
    before = odds * np.array([len(one) for one in sets])
    count = len(normal.rights)
    shares = np.zeros(len(sets))
    for weights in np.random.default_rng(SEED).dirichlet(np.ones(count), DRAWS):
        matrix = np.tensordot(count * weights, normal.matrices, 1)
        logs = before + _log_evidence(matrix, count * weights @ normal.rights, blocks, places)
        each = np.exp(logs - logs.max())
        shares += each / each.sum()
    return dict(zip(sets, (shares / DRAWS).tolist(), strict=True))


def probability(chances: Chances, keys: Sequence[str]) -> float:
    """That at least one of some blocks is wrong."""
    return sum(p for wrong, p in chances.items() if not set(keys).isdisjoint(wrong))


def groups(chances: Chances, keys: Sequence[str]) -> list[tuple[str, ...]]:
    """Blocks of which at least one is wrong for sure, the likeliest first in each.

    A block that is sure by itself is a group of its own; of what is left, those that replace each
    other are one group where together they are sure.
    """
    ranked = sorted(keys, key=lambda key: -probability(chances, [key]))
    sure = [(key,) for key in ranked if probability(chances, [key]) > ACCEPTED]
    left = [key for key in ranked if (key,) not in sure]
    left = [key for key in left if probability(chances, [key]) > RIVAL][:MOST_RIVALS]
    together = [tuple(left[:n]) for n in range(2, len(left) + 1)]
    return sure + [one for one in together if probability(chances, one) > ACCEPTED][:1]


def mixed(normal: Normal, blocks: Blocks, chances: Chances, given: Sequence[str]) -> Solved:
    """The unknowns over all sets in which one of some blocks is wrong.

    Its covariance holds how far the sets' own values lie apart, and what runs say apart.

    Args:
        normal: of the runs.
        blocks: of unknowns.
        chances: of the sets.
        given: blocks; none for all sets.
    """
    summed = total(normal)
    sets = [s for s, p in chances.items() if p > COUNTS and (not given or set(given) & set(s))]
    if not sets:
        sets = [tuple(given)]
    weights = np.array([chances.get(one, 1.0) for one in sets])
    weights /= weights.sum()
    found = [solved(summed, blocks.spread(one)) for one in sets]
    means = np.array([one.values for one in found])
    mean = weights @ means
    within = [
        honest_covariance(normal, blocks.spread(wrong), one)
        for wrong, one in zip(sets, found, strict=True)
    ]
    apart = means - mean
    covariance = np.tensordot(weights, within, 1) + (weights * apart.T) @ apart
    return Solved(mean, covariance, float("nan"))


def alone(chances: Chances, key: str, group: Sequence[str]) -> dict[tuple[str, ...], float]:
    """The sets in which of a group this block is wrong and no other."""
    others = set(group) - {key}
    return {s: p for s, p in chances.items() if key in s and others.isdisjoint(s)}


def _places(sets: Sequence[tuple[str, ...]], blocks: Blocks) -> np.ndarray:
    """Columns of each set's unknowns, (s, w); one past the last where a set has fewer."""
    size = len(blocks.tolerance)
    columns = [np.concatenate([np.zeros(0, int), *(blocks.columns[k] for k in s)]) for s in sets]
    width = max(len(one) for one in columns)
    return np.array([np.pad(one, (0, width - len(one)), constant_values=size) for one in columns])


def _log_evidence(matrix: Array, right: Array, blocks: Blocks, places: np.ndarray) -> Array:
    """Log evidence of each set against that of none, (s,).

    With all within tolerance the posterior is N(m, V); the wider prior of a set's unknowns x
    multiplies it by N(x; 0, gross) / N(x; 0, tolerance), whose mean is closed form.
    """
    tolerance, ratio = blocks.tolerance, blocks.gross / blocks.tolerance
    scaled = matrix * np.outer(tolerance, tolerance) + np.eye(len(tolerance))
    spread = np.pad(np.linalg.inv(scaled), (0, 1))
    mean = np.append(-spread[:-1, :-1] @ (tolerance * right), 0.0)
    gain = np.append(1.0 - 1.0 / ratio**2, 0.0)[places]
    wider = np.append(np.log(ratio), 0.0)[places].sum(axis=1)
    inside = spread[places[:, :, None], places[:, None, :]] * gain[:, None, :]
    rest = np.eye(places.shape[1]) - inside
    at = mean[places]
    moved = np.linalg.solve(rest, at[..., None])[..., 0]
    return -wider - 0.5 * np.linalg.slogdet(rest)[1] + 0.5 * np.sum(gain * at * moved, axis=1)
