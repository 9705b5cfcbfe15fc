"""Measured and predicted motion, residuals and their spectra, before and after, of one run."""

from __future__ import annotations

from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure

from freeswing.report.figures import (
    AFTER,
    BEFORE,
    MEASURED,
    Draw,
    figures,
    plain_log_axes,
    roomy,
    thin,
)
from freeswing.report.words import plain
from freeswing.results.motion import RunMotion

_UNITS = {"x": ("mm", 1e3), "y": ("mm", 1e3), "z": ("mm", 1e3)}
_ANGLE = ("mrad", 1e3)
_LINES = {"before": (BEFORE, "--"), "after": (AFTER, "-")}
HEIGHT_IN = 1.75


def motion_figures(run: RunMotion) -> list[Markup]:
    """A figure a coordinate: the motion, what the prediction leaves, and the spectrum of that."""
    times = np.array(run.times_s, dtype=np.float64)
    measured = _samples(run.measured)
    rows = {"before": run.before, "after": run.after}
    predictions = {key: _samples(one) for key, one in rows.items() if one}
    found = []
    for column, name in enumerate(run.coordinates):
        unit, scale = _UNITS.get(name, _ANGLE)
        series = {key: scale * values[:, column] for key, values in predictions.items()}
        seen = scale * measured[:, column]
        label = f"{plain(name)} ({unit})"
        draws = [
            _motion(times, seen, series, label),
            _residual(times, seen, series, f"residual of {label}"),
            _spectrum(times, seen, series, f"its amplitude ({unit})"),
        ]
        told = " and ".join(
            {"before": "before (dashed, orange)", "after": "after (solid, blue)"}[key]
            for key in series
        )
        caption = f"Run {run.run}, {plain(name)}: measured (dark) and predicted {told}."
        found.append(figures(draws, HEIGHT_IN, caption))
    return found


def _motion(
    times: np.ndarray, measured: np.ndarray, series: dict[str, np.ndarray], label: str
) -> Draw:
    def draw(sheet: Figure) -> None:
        axes = roomy(sheet)
        axes.plot(thin(times), thin(measured), color=MEASURED, lw=1.6)
        for key, predicted in series.items():
            colour, dash = _LINES[key]
            axes.plot(thin(times), thin(predicted), color=colour, ls=dash, lw=0.9)
        axes.set_xlabel("time (s)")
        axes.set_ylabel(label)

    return draw


def _residual(
    times: np.ndarray, measured: np.ndarray, series: dict[str, np.ndarray], label: str
) -> Draw:
    def draw(sheet: Figure) -> None:
        axes = roomy(sheet)
        for key, predicted in series.items():
            colour, dash = _LINES[key]
            axes.plot(thin(times), thin(measured - predicted), color=colour, ls=dash, lw=0.9)
        axes.set_xlabel("time (s)")
        axes.set_ylabel(label)

    return draw


def _spectrum(
    times: np.ndarray, measured: np.ndarray, series: dict[str, np.ndarray], label: str
) -> Draw:
    def draw(sheet: Figure) -> None:
        axes = roomy(sheet)
        for key, predicted in series.items():
            colour, dash = _LINES[key]
            frequencies, amplitudes = amplitude_spectrum(times, measured - predicted)
            axes.loglog(frequencies, amplitudes, color=colour, ls=dash, lw=0.9)
        plain_log_axes(axes)
        axes.set_xlabel("frequency (Hz)")
        axes.set_ylabel(label)

    return draw


def _samples(rows: Any) -> np.ndarray:
    return np.array(
        [[np.nan if value is None else value for value in row] for row in rows], dtype=np.float64
    )


def amplitude_spectrum(times: np.ndarray, residual: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Amplitude of the residual by frequency in Hz (Hann window; missing samples count as zero)."""
    present = np.isfinite(residual)
    if len(times) < 8 or present.sum() < 8:
        return np.array([]), np.array([])
    window = np.hanning(len(times))
    level = residual[present].mean()
    filled = np.where(present, residual - level, 0.0) * window
    amplitudes = 2.0 * np.abs(np.fft.rfft(filled)) / window.sum()
    frequencies = np.fft.rfftfreq(len(times), (times[-1] - times[0]) / (len(times) - 1))
    return frequencies[1:], np.maximum(amplitudes[1:], 1e-12)
