"""Whether stated cable lengths are as far off as their deviations have it."""

from __future__ import annotations

import numpy as np
from scipy.special import chdtrc

from freeswing.ident.likelihood.fit_swings import LikelihoodFit
from freeswing.ident.likelihood.run_residuals import lengths_residual

# What is farther off than one session in a thousand by chance wants explaining, although lengths
# are a few numbers among the thousands of the samples.
LENGTHS_BY_CHANCE = 0.001


def lengths_off(fit: LikelihoodFit) -> bool:
    """Whether the fit misses the stated cable lengths by more than their deviations and chance.

    Source:
        Pearson 1900, On the criterion that a given system of deviations is such that it can be
        reasonably supposed to have arisen from random sampling.
    """
    pairs = zip(fit.motions, fit.samples, strict=True)
    off = np.concatenate([np.zeros(0), *(lengths_residual(m, run) for m, run in pairs)])
    return bool(len(off) and chdtrc(len(off), off @ off) < LENGTHS_BY_CHANCE)
