"""How large errors of several causes are, as residuals ask for them.

Each cause is a few numbers that are independent, of one size: a tilt has two, a drag one. What is
there has the size that makes the residuals likeliest, the others none (automatic relevance
determination); each joins where chance would hardly do that.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from scipy.special import chdtri

from freeswing.cdpr.robot import Array

# Errors of no size are likeliest in every second session without any, and by chance others are a
# little likelier: in one of a thousand by so much.
CHANCE = 1e-3
# A size is looked for from a ten-thousandth of its unit, which moves nothing, to a thousand.
SIZES = np.append(0.0, np.geomspace(1e-4, 1e3, 337))
# What else is in the residuals: from a hundredth of their power, the noise of a fit that leaves ten
# times as much, to all of it, coloured as it is.
LEAST_REST, RESTS = 1e-2, 40
# Less than that is no step.
SETTLED = 1e-3


class Sizes(NamedTuple):
    """What residuals ask for.

    Attributes:
        sizes: of the causes that they ask for.
        rest: power of what is left, in units of the residuals' white noise.
    """

    sizes: dict[str, float]
    rest: float


def likely_sizes(
    answers: Array,
    seen: Array,
    causes: Mapping[str, np.ndarray],
    colour: float,
    most: Mapping[str, float] | None = None,
) -> Sizes:
    """The sizes of errors that make what is seen of them likeliest; without those that chance does.

    Args:
        answers: what errors of size one make of each number, (k, q).
        seen: the numbers, in units of the residuals, (k,).
        causes: columns of each cause's errors.
        colour: power of the residuals where platforms swing over that of white noise, at least 1.
        most: sizes that causes have at most, where something else tells.

    Source:
        MacKay 1994, Bayesian non-linear modelling for the prediction competition (automatic
        relevance determination); Bishop 2006, Pattern Recognition and Machine Learning, sec. 7.2.2:
        one cause after another; Self, Liang 1987, Asymptotic properties of maximum likelihood
        estimators under nonstandard conditions: half a chi-square where a size cannot be below
        zero.
    """
    limit = float(chdtri(1, 2.0 * CHANCE / len(causes)))
    counts = {one: len(SIZES) for one in causes}
    counts |= {one: int(np.sum(size >= SIZES)) for one, size in (most or {}).items()}
    found = [
        _greedy(answers, seen, causes, rest, limit, counts)
        for rest in np.geomspace(LEAST_REST, colour, RESTS)
    ]
    _, sizes, rest = min(found, key=lambda one: one[0])
    return Sizes(sizes, rest)


def _greedy(
    answers: Array,
    seen: Array,
    causes: Mapping[str, np.ndarray],
    rest: float,
    limit: float,
    counts: Mapping[str, int],
) -> tuple[float, dict[str, float], float]:
    """Surprise with a limit for each cause, the sizes, and the rest that these stand beside.

    Of `SIZES` each cause has one of so many.
    """
    sizes: dict[str, float] = {}
    for _ in range(4 * len(causes)):
        whole = _whitener(answers, causes, sizes, rest)
        best, name, size = SETTLED, "", 0.0
        for one, columns in causes.items():
            others = {other: value for other, value in sizes.items() if other != one}
            white = _whitener(answers, causes, others, rest) if one in sizes else whole
            gains = _gains(white @ answers[:, columns], white @ seen)[: counts[one]]
            place = int(gains.argmax())
            more = gains[place] - limit
            if one in sizes:
                more = gains[place] - gains[int(np.argmin(np.abs(SIZES - sizes[one])))]
            if more > best:
                best, name, size = float(more), one, float(SIZES[place])
        if not name:
            break
        sizes = {other: value for other, value in (sizes | {name: size}).items() if value > 0.0}
    white = _whitener(answers, causes, sizes, rest)
    surprise = float(np.sum((white @ seen) ** 2)) - 2.0 * float(np.log(np.diag(white)).sum())
    return surprise + limit * len(sizes), sizes, rest


def _whitener(
    answers: Array, causes: Mapping[str, np.ndarray], sizes: Mapping[str, float], rest: float
) -> Array:
    """Lower triangle that makes what is seen white beside errors of some sizes, (k, k)."""
    covariance = rest * np.eye(len(answers))
    for name, size in sizes.items():
        mine = size * answers[:, causes[name]]
        covariance += mine @ mine.T
    return np.linalg.inv(np.linalg.cholesky(covariance))


def _gains(answers: Array, seen: Array) -> Array:
    """What each size of one more cause takes off twice the negative log likelihood, (s,)."""
    along, strengths, _ = np.linalg.svd(answers, full_matrices=False)
    variances = (SIZES[:, None] * strengths) ** 2
    parts = (along.T @ seen) ** 2 * variances / (1.0 + variances) - np.log1p(variances)
    return parts.sum(axis=1)
