"""Geometry without dynamics: along a run with locked winches every cable keeps its length.

Poses, moved and displaced as a candidate would have them, give cable lengths; what varies beyond
the poses' noise is geometry, whatever forces act. Effects that make lengths vary (stretch, creep)
compete, but are left to the dynamics. A point that is settled here is known to the rest of the
search with the standard deviation that leaving out runs gives it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from freeswing.cdpr.effects import Parameter, catalogue
from freeswing.cdpr.model.batch import evaluate, with_jacobian
from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.robot import Array
from freeswing.cdpr.rotation import angle_rate_matrix
from freeswing.cdpr.simulation.free_swing import Motion
from freeswing.ident.diagnose.decision import (
    CONFOUNDED_DIFFERENCE,
    LARGEST_DELTA_BIC,
    MOST_WORSE,
    SIGNIFICANCE,
    runs_worse,
)
from freeswing.ident.diagnose.leave_one_out import Evidence, Score, score
from freeswing.ident.diagnose.variants import effect_of, extended, inside
from freeswing.ident.likelihood.likelihood import LikelihoodFit, low_band_factor
from freeswing.ident.likelihood.likelihood_run import Samples

LEAST_EXCESS = 0.1
LEAST_SHARE = 0.5
LEAST_LEAD = 0.02
MOST_FOUND = 3


@dataclass(frozen=True, slots=True)
class Displacement:
    """A geometry effect that lengths along runs demand.

    Attributes:
        key: an effect, or one cable's part of it.
        parameters: those that it estimates.
        values: of these, (k,).
        stds: from leaving out one run at a time, (k,).
        delta_bic: of the lengths, their colour allowed for.
        share: of the lengths' variance beyond the noise that it removes on left-out runs.
        before_m: what lengths vary along the runs without it, root mean square.
        after_m: and with it.
    """

    key: str
    parameters: tuple[Parameter, ...]
    values: Array
    stds: Array
    delta_bic: float
    share: float
    before_m: float
    after_m: float

    def __str__(self) -> str:
        """What was seen, for a reader."""
        return (
            f"with it the poses' cable lengths vary by {1e3 * self.after_m:.2g} instead of "
            f"{1e3 * self.before_m:.2g} mm along the runs, whatever forces act: "
            f"{100 * self.share:.0f} % of what exceeds the noise on runs left out"
        )


@dataclass(frozen=True, slots=True)
class _Lengths:
    """Whitened lengths of all runs as linear functions of what the candidates displace."""

    model: Model
    evidence: Evidence
    columns: dict[str, np.ndarray]
    rows: tuple[tuple[Array, Array], ...]
    sigma_m: float
    rivals: frozenset[str]


def displacements(
    fit: LikelihoodFit, keys: Sequence[str], noise_scales: Array
) -> list[Displacement]:
    """What the constancy of cable lengths says of the geometry, one at a time, the surest first.

    Args:
        fit: the declared model's, to full poses.
        keys: candidates.
        noise_scales: of metres and radians, (2,).
    """
    if not all(run.is_pose for run in fit.samples):
        return []
    lengths = _lengths(fit, keys, noise_scales)
    found: list[Displacement] = []
    known = np.zeros(0, dtype=np.int64)
    while len(found) < MOST_FOUND:
        best = _best(lengths, known)
        if best is None:
            break
        found.append(best)
        known = np.concatenate([known, lengths.columns[best.key]])
    return found


def _best(lengths: _Lengths, known: np.ndarray) -> Displacement | None:
    """The next displacement, if one is sure, plausible and ahead of all rivals."""
    evidence = lengths.evidence
    before = score(evidence.subset(known))
    count = float(evidence.counts.sum())
    excess = float(before.held_out.sum()) - count
    if excess < LEAST_EXCESS * count:
        return None
    taken = set(known.tolist())
    scores = {
        key: score(evidence.subset(np.concatenate([known, columns])))
        for key, columns in lengths.columns.items()
        if not taken & set(columns.tolist())
    }
    possible = {k: s for k, s in scores.items() if _is_plausible(lengths, k, s)}
    if not possible:
        return None
    leader = min(possible, key=lambda k: float(possible[k].held_out.sum()))
    colour = _colour(lengths, known, before)
    after_colour = _colour(
        lengths, np.concatenate([known, lengths.columns[leader]]), possible[leader]
    )
    lead = max(CONFOUNDED_DIFFERENCE * after_colour, LEAST_LEAD * excess)
    near = [
        k
        for k, s in possible.items()
        if float(s.held_out.sum() - possible[leader].held_out.sum()) < lead
    ]
    if any(effect_of(k) != effect_of(leader) for k in near):
        return None
    key = min(near, key=lambda k: len(lengths.columns[k]))
    if effect_of(key) in lengths.rivals:
        return None
    return _sure(lengths, known, key, before, possible[key], colour, len(scores))


def _sure(
    lengths: _Lengths,
    known: np.ndarray,
    key: str,
    before: Score,
    after: Score,
    colour: float,
    n_tried: int,
) -> Displacement | None:
    count = float(lengths.evidence.counts.sum())
    columns = lengths.columns[key]
    drop = (before.cost - after.cost) / colour
    bic = -drop + len(columns) * float(np.log(count))
    chance = float(chi2.sf(max(drop, 0.0), len(columns))) * n_tried
    gains = before.held_out - after.held_out
    share = float(gains.sum()) / (float(before.held_out.sum()) - count)
    if (
        chance > SIGNIFICANCE
        or bic > LARGEST_DELTA_BIC
        or share < LEAST_SHARE
        or runs_worse(gains, before) > MOST_WORSE * len(gains)
    ):
        return None
    mine = slice(len(known), None)
    stds = np.maximum(after.jackknife_std, np.sqrt(colour) * after.std)[mine]
    return Displacement(
        key=key,
        parameters=_parameters(lengths, key),
        values=after.change[mine],
        stds=stds,
        delta_bic=bic,
        share=share,
        before_m=lengths.sigma_m * float(np.sqrt(before.cost / count)),
        after_m=lengths.sigma_m * float(np.sqrt(after.cost / count)),
    )


def _parameters(lengths: _Lengths, key: str) -> tuple[Parameter, ...]:
    model = lengths.model
    all_of_it = model.parameters[model.place_of(effect_of(key))]
    chosen = inside(model.robot, key)
    return tuple(p for p, wanted in zip(all_of_it, chosen, strict=True) if wanted)


def _is_plausible(lengths: _Lengths, key: str, one: Score) -> bool:
    if effect_of(key) in lengths.rivals:
        return True
    count = len(lengths.columns[key])
    return all(
        p.low <= value <= p.high
        for p, value in zip(_parameters(lengths, key), one.change[-count:], strict=True)
    )


def _colour(lengths: _Lengths, columns: np.ndarray, one: Score) -> float:
    """Power in the band of the motion of what is left, over that of the noise, at least 1."""
    series = []
    for rows, times_s in lengths.rows:
        left = rows[..., -1] + rows[..., columns] @ one.change
        series.append((left - left.mean(axis=0), times_s))
    power = float(np.mean([np.mean(left**2) for left, _ in series]))
    return max(1.0, power * low_band_factor(series))


def _lengths(fit: LikelihoodFit, keys: Sequence[str], noise_scales: Array) -> _Lengths:
    n = fit.model.robot.n_cables
    patterns = [
        _patterns(motion, run) for motion, run in zip(fit.motions, fit.samples, strict=True)
    ]
    rivals = frozenset(patterns[0])
    keys = [key for key in keys if effect_of(key) not in rivals]
    model = extended(fit.model, list(dict.fromkeys(map(effect_of, keys))))
    triangles, all_rows, sigmas = [], [], []
    for motion, samples, pattern in zip(fit.motions, fit.samples, patterns, strict=True):
        rows, sigma = _rows(model, motion, samples, noise_scales, pattern)
        own = rows[..., :n].reshape(-1, n)
        rest = rows[..., n:].reshape(len(own), -1)
        rest = rest - own @ np.linalg.lstsq(own, rest, rcond=None)[0]
        triangles.append(np.linalg.qr(rest, mode="r"))
        all_rows.append((rest.reshape(len(rows), n, -1), samples.times_s))
        sigmas.append(sigma)
    columns, used = {}, len(model.parameters)
    for name, pattern in patterns[0].items():
        columns[name] = used + np.arange(pattern.shape[-1])
        used += pattern.shape[-1]
    for key in keys:
        where = model.place_of(effect_of(key))
        columns[key] = where.start + np.flatnonzero(inside(model.robot, key))
    triangles = np.array(triangles)
    seen = np.abs(triangles[:, :, :-1]).max(axis=(0, 1)) > 0.0
    visible = {key: where for key, where in columns.items() if seen[where].all()}
    counts = [float(len(run.times_s) - 1) * n for run in fit.samples]
    evidence = Evidence(
        tuple(run.name for run in fit.samples),
        triangles,
        np.array(counts),
        _priors(model, triangles.shape[-1]),
    )
    return _Lengths(model, evidence, visible, tuple(all_rows), float(np.mean(sigmas)), rivals)


def _patterns(motion: Motion, samples: Samples) -> dict[str, Array]:
    """How each effect that makes lengths vary would do it along a run, (n_t, n, k) by name."""
    times, values = samples.times_s, motion.values
    lengths = evaluate(motion.model.lengths, samples.values, values)[0]
    tensions = motion.tensions(times)
    found = {n: e.length_pattern(times, lengths, tensions) for n, e in catalogue().items()}
    return {name: pattern for name, pattern in found.items() if pattern is not None}


def _priors(model: Model, size: int) -> Array:
    rows = np.zeros((len(model.parameters), size))
    for k, parameter in enumerate(model.parameters):
        rows[k, k] = 1.0 / parameter.prior_std
    return rows


def _rows(
    model: Model,
    motion: Motion,
    samples: Samples,
    noise_scales: Array,
    patterns: dict[str, Array],
) -> tuple[Array, float]:
    """Whitened [lengths kept; values; rivals; lengths] (n, cables, .), and the noise in metres."""
    zetas, times = samples.values, samples.times_s
    values = model.start_values
    n = model.robot.n_cables
    lengths, slopes = evaluate(with_jacobian(model.lengths, (0, 1)), zetas, values)
    by_pose, by_values = slopes[:, :, :6], slopes[:, :, 6:]
    rates = motion.at(times)[1]
    seen = with_jacobian(model.measured, (4,))
    shown = evaluate(seen, times, zetas, rates, motion.inertia, values)[1]
    turn = np.linalg.inv(angle_rate_matrix(zetas[:, 3:]))
    by_turn = np.concatenate([by_pose[:, :, :3], by_pose[:, :, 3:] @ turn], axis=2)
    scales = noise_scales[samples.groups]
    noise = by_turn @ np.linalg.inv(samples.whitener) * scales
    covariance = noise @ np.swapaxes(noise, 1, 2)
    whitener = np.linalg.inv(np.linalg.cholesky(covariance))
    kept = np.broadcast_to(np.eye(n), (len(times), n, n))
    everything = np.concatenate(
        [
            kept,
            by_values - by_pose @ shown,
            *patterns.values(),
            (lengths - lengths.mean(axis=0))[..., None],
        ],
        axis=2,
    )
    sigma = float(np.sqrt(np.mean(np.diagonal(covariance, axis1=1, axis2=2))))
    return whitener @ everything, sigma
