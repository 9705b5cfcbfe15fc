"""Runs that a model follows far worse than the others, weighed so that they do not decide alone.

Near a singularity a run answers to everything at once. While its cause is not in the model, such a
run bends the inertia of all the others; what it says of candidates counts again once it is.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from freeswing.cdpr.robot import Array
from freeswing.ident.diagnose.spectrum import residual_powers
from freeswing.ident.likelihood.fit_swings import LikelihoodFit
from freeswing.ident.likelihood.run_residuals import Samples

# Times the median power: of seven runs one had 61 times the noise where the others had 6 to 16.
OUTSTANDING = 4.0


def tempered(found: LikelihoodFit, noise_scales: Array) -> tuple[Samples, ...]:
    """The fit's samples, runs of more than `OUTSTANDING` times the median power held at that.

    Args:
        found: the fit whose residuals decide.
        noise_scales: of metres and radians, (2,).
    """
    held_back = np.array([samples.temper for samples in found.samples])
    powers = residual_powers(found, noise_scales) * held_back**2
    limit = OUTSTANDING * max(1.0, float(np.median(powers)))
    factors = np.sqrt(np.maximum(1.0, powers / limit))
    pairs = zip(found.samples, factors, strict=True)
    return tuple(replace(s, temper=float(f)) for s, f in pairs)
