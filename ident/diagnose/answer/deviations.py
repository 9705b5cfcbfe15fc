"""Standard deviations that are printed, and what data see of a displaced point."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.special import gammaincc

from freeswing.cdpr.effects import effect_named
from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.robot import Array
from freeswing.ident.diagnose.refit import Refit
from freeswing.ident.diagnose.sets.ways import Exchange
from freeswing.ident.likelihood.blocks import INERTIA
from freeswing.ident.likelihood.fit_swings import LikelihoodFit

AXES = ("x", "y", "z")


def honest_covariance(found: LikelihoodFit, scored: Refit) -> Array:
    """Covariance of the shared unknowns, (p, p): the larger of the posterior and the jackknife.

    Each unknown's deviation is raised to the one that leaving out one run at a time gives; the
    correlations stay those of the posterior.

    Args:
        found: the final fit.
        scored: the fit of the search that it goes on from, with its left-out runs.

    Source:
        Efron 1982, The Jackknife, the Bootstrap and Other Resampling Plans, ch. 3.
    """
    stds = found.stds
    free = np.flatnonzero(scored.fit.free)
    jackknife = np.zeros(len(stds))
    jackknife[free] = scored.score.jackknife_std[: len(free)]
    safe = np.where(stds > 0.0, stds, 1.0)
    factors = np.where(np.isfinite(stds), np.maximum(1.0, jackknife / safe), 1.0)
    return found.covariance * np.outer(factors, factors)


def with_ways(covariance: Array, final: LikelihoodFit, told: Exchange) -> Array:
    """A covariance of the shared unknowns with what other ways than the one told make of them.

    Inertia counts, and values of effects that both ways have.

    Args:
        covariance: of the final fit's, (p, p).
        final: that fit.
        told: the way that stands in it, and those that may be instead.

    Source:
        Bishop 2006, Pattern Recognition and Machine Learning, sec. 2.3.9: moments of a mixture,
        here about the values that are told.
    """
    wider, stands = covariance.copy(), told.fits[-1].fit
    for probability, other in ((way.probability, way.fit.fit) for way in told.ways):
        fits = (final, stands, other)
        common = [n for n in stands.model.effects if all(n in one.model.effects for one in fits)]
        where = [one.unknowns.columns(INERTIA, *common) for one in fits]
        both = np.all([one.free[k] for one, k in zip(fits, where, strict=True)], axis=0)
        mine, here, there = (k[both] for k in where)
        away = _values(other, common)[both] - _values(stands, common)[both]
        known = other.covariance[np.ix_(there, there)], stands.covariance[np.ix_(here, here)]
        more = np.outer(away, away)
        # Where runs leave anything open no number has a finite variance: there is no difference.
        if np.isfinite(known).all():
            sizes, axes = np.linalg.eigh(known[0] - known[1])
            more += (axes * np.maximum(sizes, 0.0)) @ axes.T
        wider[np.ix_(mine, mine)] += probability * more
    return wider


def _values(found: LikelihoodFit, effects: Sequence[str]) -> Array:
    return np.concatenate([found.value(name) for name in (INERTIA, *effects)])


def chance_of_nothing(found: LikelihoodFit, covariance: Array, name: str) -> float:
    """How often an effect that is not there would be found with values as far from nothing.

    Where amounts are nothing shapes (a centre, a frequency) mean nothing: they are held, and count
    as values that were free to be fitted. A drag about a centre that moves with it in a bent valley
    is nowhere nothing, however wide either is told. Zero for one whose size each run has for
    itself.

    Args:
        found: the final fit.
        covariance: of its shared unknowns as it is told, (p, p).
        name: of the effect.

    Source:
        Wald 1943, Tests of statistical hypotheses concerning several parameters: a chi-square of
        all values together.
    """
    block, columns = found.unknowns.block(name), found.unknowns.columns(name)
    parameters = effect_named(name).parameters(found.model.robot)
    amounts = np.array([p.amplitude for p in parameters]) & block.mask
    if not amounts.any():
        return 0.0
    away = (block.value - [p.start for p in parameters])[amounts]
    free, shapes = columns[amounts], columns[~amounts & block.mask]
    across = covariance[np.ix_(free, shapes)]
    told = covariance[np.ix_(free, free)]
    held = told - across @ np.linalg.pinv(covariance[np.ix_(shapes, shapes)]) @ across.T
    square = float(away @ np.linalg.pinv(held) @ away)
    return float(gammaincc(0.5 * (len(free) + len(shapes)), 0.5 * square))


def directions(model: Model, places: np.ndarray, covariance: Array) -> list[dict[str, Any]]:
    """Along which directions of a point's displacement its value is known, and how well.

    Args:
        model: with the effect.
        places: of the effect's estimated values among the model's, (k,).
        covariance: of these, (k, k).

    Returns:
        For each cable's (or the platform's) three coordinates: the unit vector that the data see
        best first, with its standard deviation; empty for values that are no points.
    """
    told = []
    names = [model.parameters[k].name for k in places]
    for first in range(len(names) - 2):
        stem, axis, unit = _axis_of(names[first])
        wanted = [f"{stem}_{one}_{unit}" for one in AXES]
        if axis != "x" or names[first : first + 3] != wanted:
            continue
        block = covariance[first : first + 3, first : first + 3]
        if not np.isfinite(block).all():
            continue
        sizes, axes = np.linalg.eigh(block)
        told += [
            {
                "point": stem,
                "direction": vector.tolist(),
                f"std_{unit}": float(np.sqrt(max(size, 0.0))),
            }
            for size, vector in zip(sizes, axes.T, strict=True)
        ]
    return told


def _axis_of(name: str) -> tuple[str, str, str]:
    """Stem, axis and unit of `offset_2_x_m`; the axis is "" where there is none."""
    parts = name.split("_")
    if len(parts) < 3 or parts[-2] not in AXES:
        return name, "", ""
    return "_".join(parts[:-2]), parts[-2], parts[-1]
