"""Fits as models among others: what their evidence is integrated over, and what each had to be."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from freeswing.cdpr.robot import Array, Robot
from freeswing.ident.diagnose.leave_one_out import Evidence
from freeswing.ident.diagnose.model_probabilities import Rival
from freeswing.ident.diagnose.refit import Refit
from freeswing.ident.diagnose.screen import known_rows
from freeswing.ident.diagnose.variants import effect_of, variants
from freeswing.ident.likelihood.joint_problem import INERTIA_UNIT

# Inertias are anywhere within so many of their usual sizes: a centre of mass within half a metre,
# moments of a radius within 45 cm, those of platforms of a metre.
INERTIA_RANGE = 10.0


def rival_of(one: Refit, *keys: str) -> Rival:
    """A fit as a model among others; `keys` are what it has beside the one that has none of them.

    What each run has for itself was eliminated with the run's state: it counts by what the run's
    own data leave of it. Errors that all poses share are unknowns of every model.
    """
    fit = one.fit
    known = known_rows(fit.model, fit.values, fit.samples)
    return rival_among(one.evidence, known, np.flatnonzero(fit.free), keys, fit.model.robot)


def rival_among(
    evidence: Evidence, known: Array, columns: np.ndarray, keys: Sequence[str], robot: Robot
) -> Rival:
    """The model of evidence that estimates some of its unknowns.

    Args:
        evidence: linear, over all unknowns.
        known: what is known of them beforehand, as rows of unit deviation (`known_rows`).
        columns: of those that it estimates.
        keys: effects, or one cable's part of them, that it has beside others.
        robot: whose cables the parts are of.
    """
    linear = evidence.subset(columns)
    known = known[:, evidence.columns(columns)]
    size = len(INERTIA_UNIT)
    body = np.zeros((size, known.shape[1]))
    body[:, :size] = np.diag(1.0 / (INERTIA_RANGE * INERTIA_UNIT))
    prior = np.vstack([body, known[np.abs(known[:, :-1]).sum(axis=1) > 0.0]])
    tries = sum(float(np.log(len(variants(robot, effect_of(key))))) for key in keys)
    return Rival(linear.triangles, prior, len(keys), tries, linear.own, linear.plucked)
