"""What remains when no candidate explains it: where, how large, at which frequency, like what."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.special import digamma

from freeswing.cdpr.robot import Array
from freeswing.ident.diagnose.spectrum import common_frequencies, mean_log_spectrum, too_small
from freeswing.ident.likelihood.fit_swings import LikelihoodFit
from freeswing.ident.likelihood.run_residuals import predicted, residuals
from freeswing.ident.signals.usable_runs import PreparedRun

# What white noise does not leave: more power than its own, and that at low frequencies. A hint has
# three terms of generic forces at most, each of which explains three per cent of the missing one.
LEAST_EXCESS = 0.15
LEAST_COLOUR = 1.6
HINT_TERMS = 3
LEAST_HINT_GAIN = 0.03


@dataclass(frozen=True, slots=True)
class Unexplained:
    """The verdict on the rest.

    Attributes:
        present: whether a structured residual remains.
        signature: what it looks like, a sentence or two.
        evidence: the numbers behind it.
        over_noise: root mean square of what the fit leaves, in units of the samples' own noise.
    """

    present: bool
    signature: str
    evidence: dict[str, object] = field(default_factory=dict)
    over_noise: float = 1.0


def unexplained(
    fit: LikelihoodFit, runs: list[PreparedRun], full: bool, noise_scales: Array
) -> Unexplained:
    """Look at what a fit leaves, in units of the samples' own noise.

    Args:
        fit: the final one.
        runs: the runs fitted, with their smoothed motions, for the hint.
        full: whether poses were measured.
        noise_scales: of metres and radians, (2,).
    """
    white = [
        residuals(motion, run, noise_scales)
        for motion, run in zip(fit.motions, fit.samples, strict=True)
    ]
    power = float(np.mean([np.mean(one**2) for one in white]))
    over_noise = float(np.sqrt(power))
    frequencies, spectrum = mean_log_spectrum(fit, noise_scales)
    low = float(np.mean(spectrum[frequencies < 5.0])) / _floor(fit, spectrum)
    evidence: dict[str, object] = {"residual_over_noise": over_noise, "colour": low}
    if power < 1.0 + LEAST_EXCESS or low < LEAST_COLOUR or too_small(fit):
        return Unexplained(False, "", evidence, over_noise)
    names = fit.samples[0].coordinates
    by_coordinate = np.sqrt(np.mean([np.mean(one**2, axis=0) for one in white], axis=0))
    worst = int(np.argmax(by_coordinate))
    size = float(
        np.sqrt(
            np.mean(
                [
                    np.mean(
                        (predicted(m, s.times_s)[:, s.columns[worst]] - s.values[:, worst]) ** 2
                    )
                    for m, s in zip(fit.motions, fit.samples, strict=True)
                ]
            )
        )
    )
    strongest = float(frequencies[int(np.argmax(spectrum))])
    follows = _follows(fit, white, worst)
    hint = _hint(fit, runs, full, common_frequencies(fit, noise_scales, 1)[0])
    evidence |= {
        "coordinate": names[worst],
        "rms": size,
        "frequency_hz": strongest,
        "correlations": follows,
        "hint": hint,
    }
    unit, factor = ("mm", 1e3) if names[worst] in "xyz" else ("mrad", 1e3)
    best = max(follows, key=lambda key: abs(follows[key]))
    signature = (
        f"{factor * size:.2g} {unit} rms in {names[worst]} ({by_coordinate[worst]:.1f} times the "
        f"noise), strongest at {strongest:.2f} Hz, follows {best} most (r = {follows[best]:.2f})"
    )
    if hint:
        signature += f"; hint, not a finding: the missing force looks like {' + '.join(hint)}"
    return Unexplained(True, signature, evidence, over_noise)


def _floor(fit: LikelihoodFit, spectrum: Array) -> float:
    """White noise of a residual over what the samples' noise was taken for, at most one.

    Vibration of a single run passes for noise of all samples: on stretching cables the residual was
    called white, at 1.6 times a noise that had been taken for 1.5 times as large as it is.
    """
    free = len(fit.samples[0].columns)
    white = float(np.exp(digamma(free)) / free)  # mean log power of that many coordinates
    return min(1.0, float(np.median(spectrum)) / white)


def _follows(fit: LikelihoodFit, white: list[Array], coordinate: int) -> dict[str, float]:
    """Correlation of one coordinate's residual with the states and time, pooled over runs."""
    pooled: dict[str, list[tuple[float, float, float]]] = {}
    for motion, run, one in zip(fit.motions, fit.samples, white, strict=True):
        zetas, rates, _ = motion.at(run.times_s)
        error = one[:, coordinate] - one[:, coordinate].mean()
        states = {"time": run.times_s[:, None], "position": zetas, "velocity": rates}
        speed = np.linalg.norm(rates[:, :3], axis=1, keepdims=True)
        states["speed times velocity"] = speed * rates
        for name, columns in states.items():
            centred = columns - columns.mean(axis=0)
            fitted = centred @ np.linalg.lstsq(centred, error, rcond=None)[0]
            pooled.setdefault(name, []).append((fitted @ fitted, error @ error, 0.0))
    return {
        name: float(np.sqrt(sum(p[0] for p in parts) / max(sum(p[1] for p in parts), 1e-300)))
        for name, parts in pooled.items()
    }


def _hint(
    fit: LikelihoodFit, runs: list[PreparedRun], full: bool, frequency_hz: float
) -> list[str]:
    """The few generic force terms that explain most of the missing force (greedy regression)."""
    from freeswing.ident.diagnose.heldout import internal_residual

    right, columns = [], []
    names: list[str] = []
    for run in runs:
        motion = run.full if full else run.free
        if motion is None:
            continue
        right.append(internal_residual(fit.model, motion, fit.inertia, fit.values).reshape(-1))
        names, terms = _terms(motion.times_s, motion.zetas, motion.rates, frequency_hz)
        basis = _free_map(fit, motion)
        projected = np.einsum("ncf,nct->nft", basis, terms)
        columns.append(projected.reshape(-1, len(names)))
    if not right:
        return []
    return _greedy(np.concatenate(right), np.vstack(columns), names)


def _free_map(fit: LikelihoodFit, motion) -> Array:
    from freeswing.cdpr.model.free_motion import free_basis

    return free_basis(fit.model, motion.free, motion.zetas, motion.rates, fit.values).xi_perp


def _terms(
    times: Array, zetas: Array, rates: Array, frequency_hz: float
) -> tuple[list[str], Array]:
    """Names and wrenches (n, 6, terms) of generic forces and torques per mass."""
    speed = np.linalg.norm(rates[:, :3], axis=1)
    shapes = {
        "constant": np.ones(len(times)),
        "time": times,
        f"cos({frequency_hz:.2f} Hz)": np.cos(2 * np.pi * frequency_hz * times),
        f"sin({frequency_hz:.2f} Hz)": np.sin(2 * np.pi * frequency_hz * times),
    }
    states = {"": zetas, "rate of ": rates}
    labels = ("x", "y", "z", "phi", "theta", "chi")
    for prefix, state in states.items():
        for k, label in enumerate(labels):
            shapes[prefix + label] = state[:, k]
    for k, label in enumerate(labels[:3]):
        shapes[f"speed times rate of {label}"] = speed * rates[:, k]
        shapes[f"sign of rate of {label}"] = np.tanh(rates[:, k] / 0.02)
        shapes[f"{label} cubed"] = (zetas[:, k] - zetas[:, k].mean()) ** 3
    axes = ("force x", "force y", "force z", "torque x", "torque y", "torque z")
    names = [f"{axis} ~ {shape}" for axis in axes for shape in shapes]
    values = np.stack(list(shapes.values()), axis=-1)
    wrenches = np.zeros((len(times), 6, 6 * len(shapes)))
    for axis in range(6):
        wrenches[:, axis, axis * len(shapes) : (axis + 1) * len(shapes)] = values
    return names, wrenches


def _greedy(right: Array, columns: Array, names: list[str]) -> list[str]:
    chosen: list[int] = []
    left = right
    total = float(right @ right)
    norms = np.linalg.norm(columns, axis=0)
    usable = norms > 1e-9 * norms.max()
    for _ in range(HINT_TERMS):
        scores = np.where(usable, np.abs(columns.T @ left) / np.where(usable, norms, 1.0), 0.0)
        scores[chosen] = 0.0
        trial = [*chosen, int(np.argmax(scores))]
        fitted = columns[:, trial] @ np.linalg.lstsq(columns[:, trial], right, rcond=None)[0]
        if float(left @ left - (right - fitted) @ (right - fitted)) < LEAST_HINT_GAIN * total:
            break
        chosen, left = trial, right - fitted
    return [names[k] for k in chosen]
