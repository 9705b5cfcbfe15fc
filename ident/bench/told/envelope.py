"""How yaw dies away on a bench: its amplitude in parts of every run, and which loss it follows."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from freeswing.cdpr.robot import Array
from freeswing.ident.bench.fit_rounds import Solved
from freeswing.ident.bench.modal import CHI, SQUARE
from freeswing.ident.bench.noise import column_residuals
from freeswing.ident.bench.swing import BenchSwing, Column
from freeswing.ident.bench.told.classic_formula import sine_period
from freeswing.ident.diagnose.answer.decay import PARTS

Law = Callable[[float, float, Array], Array]
# Amplitude a at first and rate k: linear drag loses a share of what is there, quadratic drag one
# that grows with it, dry friction the same from every period.
LAWS: Mapping[str, Law] = {
    "linear": lambda a, k, times: a * np.exp(-k * times),
    "quadratic": lambda a, k, times: a / np.maximum(1.0 + k * times, 1e-9),
    "dry": lambda a, k, times: a * (1.0 - k * times),
}


@dataclass(frozen=True, slots=True)
class Envelope:
    """One run's amplitude of yaw.

    Attributes:
        run: its name.
        times_s: middles of its parts, from its first sample, (p,).
        measured_rad: amplitudes, (p,).
        std_rad: their deviations by what a sine leaves of the samples, (p,).
        laws: amplitudes by each law fitted to them, (p,).
    """

    run: str
    times_s: Array
    measured_rad: Array
    std_rad: Array
    laws: Mapping[str, Array]

    def document(self) -> dict[str, Any]:
        """The entry of `yaw_decay` in results/identification.json."""
        return {
            "run": self.run,
            "times_s": self.times_s.tolist(),
            "measured_rad": self.measured_rad.tolist(),
            "std_rad": self.std_rad.tolist(),
            **{f"{name}_rad": amplitudes.tolist() for name, amplitudes in self.laws.items()},
        }


def envelopes(solved: Solved) -> tuple[Envelope, ...]:
    """Of every run in which some column follows yaw for long enough."""
    found = []
    for index, swing in enumerate(solved.swings):
        values = solved.solution.unknowns.of_run(index)
        yaw = _yaw(swing, solved.solution.residuals[index], values)
        one = None if yaw is None else envelope(swing.name, *yaw)
        if one is not None:
            found.append(one)
    return tuple(found)


def envelope(run: str, times_s: Array, yaw_rad: Array) -> Envelope | None:
    """Amplitudes of one yaw, (n,), by a sine in each part; None: too few periods.

    Source:
        Kay 1993, Fundamentals of Statistical Signal Processing, ex. 7.16: amplitude of a sine.
    """
    period = sine_period(times_s, yaw_rad)
    if period is None:
        return None
    since = times_s - times_s[0]
    parts = min(PARTS, int(since[-1] / period))  # a whole period each
    if parts <= 2:  # a law has two numbers of its own
        return None
    edges = np.linspace(0.0, since[-1], parts + 1)
    which = np.clip(np.searchsorted(edges, since, side="right") - 1, 0, parts - 1)
    each = [_amplitude(since[which == k], yaw_rad[which == k], period) for k in range(parts)]
    measured, std = np.array(each).T
    middles = 0.5 * (edges[1:] + edges[:-1])
    laws = {name: _fitted(law, middles, measured, std) for name, law in LAWS.items()}
    return Envelope(run, middles, measured, std, laws)


def law_chances(found: Sequence[Envelope]) -> dict[str, float]:
    """Probability of each law, all runs together, one rate a run; empty without an envelope.

    All laws have as many numbers, so that their likelihoods alone differ; deviations are enlarged
    until the best law explains them.

    Source:
        MacKay 2003, Information Theory, Inference, and Learning Algorithms, ch. 28.
    """
    if not found:
        return {}
    squares = {
        name: sum(
            float(np.sum(((one.measured_rad - one.laws[name]) / one.std_rad) ** 2)) for one in found
        )
        for name in LAWS
    }
    least, free = min(squares.values()), sum(len(one.times_s) - 2 for one in found)
    weights = {
        name: np.exp(-0.5 * (square - least) / max(1.0, least / free))
        for name, square in squares.items()
    }
    return {name: float(one / sum(weights.values())) for name, one in weights.items()}


def _yaw(
    swing: BenchSwing, white: Array, values: Mapping[str, Array]
) -> tuple[Array, Array] | None:
    """Times and yaw as a column has it: the model's, and what the column says beside it."""
    poses = swing.simulated(values).at(swing.times_s)[0]
    for column, part in zip(swing.columns, column_residuals(swing, white), strict=False):
        slope = _slope(swing, column, poses, values)
        if slope is None:
            continue
        # Residuals are predicted less measured.
        off = part * (column.factor * column.std)[column.known]
        yaw = (poses[:, CHI] - swing.rest[CHI])[column.known] - off / slope[column.known]
        size = np.sqrt(float(values[SQUARE][0])) if SQUARE in values else 1.0
        return swing.times_s[column.known], size * yaw
    return None


def _slope(
    swing: BenchSwing, column: Column, poses: Array, values: Mapping[str, Array]
) -> Array | None:
    """By how much a column answers to yaw along a run, (n,); None where it does not, or folds."""
    if column.channel is None:
        return np.ones(len(poses)) if column.coordinate == CHI else None
    slope = column.channel.slopes(poses - swing.rest, values[f"channel.{column.channel.name}"])
    yaw = slope[:, CHI]
    return yaw if np.all(yaw > 0.0) or np.all(yaw < 0.0) else None


def _amplitude(times: Array, yaw: Array, period: float) -> tuple[float, float]:
    """Amplitude in the middle of some samples, of a sine that changes smoothly; its deviation."""
    middle = (times - times.mean()) / period
    phase = 2.0 * np.pi * middle
    wave = np.column_stack([np.cos(phase), np.sin(phase)])
    powers = [wave * middle[:, None] ** power for power in range(3)]
    design = np.hstack([*powers, np.ones((len(times), 1))])
    found = np.linalg.lstsq(design, yaw, rcond=None)[0]
    left = yaw - design @ found
    noise = float(np.sum(left**2)) / max(1, len(yaw) - design.shape[1])
    size = float(np.hypot(*found[:2]))
    along = np.append(found[:2] / size, np.zeros(design.shape[1] - 2))
    return size, float(np.sqrt(noise * (along @ np.linalg.pinv(design.T @ design) @ along)))


def _fitted(law: Law, times: Array, measured: Array, std: Array) -> Array:
    """Amplitudes of a law fitted to those measured."""
    lost = (1.0 - measured[-1] / measured[0]) / (times[-1] - times[0])
    found = least_squares(
        lambda two: (law(two[0], two[1], times) - measured) / std,
        np.array([measured[0], lost]),
        x_scale=[measured[0], 1.0 / times[-1]],
    )
    return law(found.x[0], found.x[1], times)
