"""Whether runs follow the law of a freely swinging platform at all: how much of them it explains.

A fit always gives numbers. Where the fitted free motion explains less than a quarter of a run's
motion, they are numbers about nothing: the platform was held or driven, a cable was slack, the
samples are not of this robot. Missing losses alone do not come near that limit: a swing whose
amplitude falls by e within a quarter of the run is explained to a half.
"""

from __future__ import annotations

import numpy as np

from freeswing.cdpr.model.batch import evaluate, only
from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.model.free_motion import coordinate_indices
from freeswing.cdpr.model.regressor import SwingMotion
from freeswing.cdpr.robot import Array
from freeswing.ident.estimate import Estimate
from freeswing.ident.likelihood.fit_swings import LikelihoodFit
from freeswing.ident.likelihood.run_residuals import predicted

# Of the variance of a run's motion. Half is left to a swing whose losses were not declared, and
# half of that is room; a curve that obeys no law is explained by chance alone.
LEAST_EXPLAINED = 0.25
# The same where the fit needs an inertia that no body has: then nothing speaks for it but its fit.
LEAST_EXPLAINED_BY_NO_BODY = 0.75
# Accelerations, unexplained root mean square of the best run, that FIDIM's equations may leave
# where no fit of the motions stands beside it: a quarter of their variance.
WORST_ACCELERATION = 0.5
# And where no body has its inertia: a tenth of it.
WORST_OF_NO_BODY = 0.3


class LawlessError(ValueError):
    """No run follows the law of a freely swinging platform."""


def unexplained_motion(found: LikelihoodFit) -> Array:
    """Share of each run's motion about its mean that its fit leaves, root mean square, (runs,).

    Source:
        Draper, Smith 1998, Applied Regression Analysis, ch. 1: what R^2 leaves.
    """
    shares = []
    for motion, samples in zip(found.motions, found.samples, strict=True):
        off = samples.values - predicted(motion, samples.times_s)[:, samples.columns]
        spread = samples.values - samples.values.mean(axis=0)
        shares.append(float(np.sqrt(np.sum(off**2) / np.sum(spread**2))))
    return np.array(shares)


def is_lawless(shares: Array, refuted: bool = False) -> Array:
    """Which runs the fit explains too little of, by their unexplained shares.

    Args:
        shares: see `unexplained_motion`, (runs,).
        refuted: whether no body can have the inertia that the fit needs: more is then asked of it.

    Source:
        Draper, Smith 1998, Applied Regression Analysis, ch. 1: R^2.
    """
    least = LEAST_EXPLAINED_BY_NO_BODY if refuted else LEAST_EXPLAINED
    return shares**2 > 1.0 - least


def lawless_sentence(share: float) -> str:
    """Why a run cannot serve, by its unexplained share."""
    return (
        f"the best free swing explains {100.0 * max(0.0, 1.0 - share**2):.0f} % of the variance of "
        f"its motion (at least {100.0 * LEAST_EXPLAINED:.0f} % are needed, "
        f"{100.0 * LEAST_EXPLAINED_BY_NO_BODY:.0f} % where no body has the inertia that it takes): "
        "the platform was held or driven, a cable was slack, or geometry, cable_lengths_m or "
        "window_s are wrong"
    )


def fidim_complaint(
    model: Model, motions: list[SwingMotion], found: Estimate, supported: bool, lawless: bool
) -> str:
    """Why FIDIM's result says nothing of a platform; empty where it may.

    Args:
        model: the robot.
        motions: that it was found from.
        found: the result.
        supported: whether maximum likelihood, started from it, came to a result.
        lawless: whether that found no run to swing freely.
    """
    least = min(unexplained_acceleration(model, motion, found.values) for motion in motions)
    lost = f"its equations miss the accelerations of every run by {least:.2g} times their size"
    if found.consistency.is_refuted and (lawless or least > WORST_OF_NO_BODY):
        return (
            f"no body can have its inertia ({found.consistency.size()}), and {lost} or more: these "
            "are no free swings of this robot"
        )
    if lawless:
        return f"no motion that it predicts follows a run, and {lost} or more"
    if not supported and least > WORST_ACCELERATION:
        return (
            f"{lost} or more: these are no free swings of this robot, or too small or too few; "
            "check geometry, cable_lengths_m and window_s"
        )
    return ""


def unexplained_acceleration(model: Model, motion: SwingMotion, inertia: Array) -> float:
    """Share of the free coordinates' acceleration that an inertia's equations leave, rms."""
    columns = coordinate_indices(motion.free)
    function = only(model.acceleration, 0)
    arguments = (0.0 * motion.times_s, motion.zetas, motion.rates, inertia, model.start_values)
    measured = motion.accelerations[:, columns]
    off = evaluate(function, *arguments)[0][:, columns] - measured
    return float(np.sqrt(np.mean(off**2) / np.mean(measured**2)))
