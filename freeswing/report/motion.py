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
from freeswing.results.motion import Motion, RunMotion

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
            _residual(times, seen, series, f"residual, {label}"),
            _spectrum(times, seen, series, f"its amplitude ({unit})"),
        ]
        told = " and ".join(
            {"before": "before (dashed, orange)", "after": "after (solid, blue)"}[key]
            for key in series
        )
        caption = f"Run {run.run}, {plain(name)}: measured (dark) and predicted {told}."
        found.append(figures(draws, HEIGHT_IN, caption))
    return found


def residual_figures(run: RunMotion) -> Markup:
    """What a fitted run leaves, each coordinate small, with its spectrum beside it."""
    draws = []
    times, measured = np.array(run.times_s, dtype=np.float64), _samples(run.measured)
    found = _samples(run.before or ())
    for column, name in enumerate(run.coordinates):
        unit, scale = _UNITS.get(name, _ANGLE)
        series = {"after": scale * found[:, column]}
        seen = scale * measured[:, column]
        draws.append(_residual(times, seen, series, f"residual, {plain(name)} ({unit})"))
        draws.append(_spectrum(times, seen, series, f"its amplitude ({unit})"))
    caption = f"Run {run.run}: measured less fitted, and its spectrum, coordinate by coordinate."
    return figures(draws, HEIGHT_IN, caption)


def residual_rms(run: RunMotion) -> tuple[float | None, float | None]:
    """Root mean square of what a run's motion leaves: of positions in m, of angles in rad."""
    left = _samples(run.measured) - _samples(run.before or run.measured)
    lengths = [k for k, name in enumerate(run.coordinates) if name in _UNITS]
    angles = [k for k in range(len(run.coordinates)) if k not in lengths]
    metres, radians = (
        float(np.sqrt(np.nanmean(left[:, columns] ** 2))) if columns else None
        for columns in (lengths, angles)
    )
    return metres, radians


def residual_sheet(motion: Motion, spectra: bool) -> Figure:
    """Residuals of all runs, or their spectra, a row a run, for notebooks."""
    runs = [*motion.fitted, *motion.runs]
    across = max(len(run.coordinates) for run in runs)
    sheet = Figure(figsize=(2.6 * across, 1.6 * len(runs)), layout="constrained")
    cells = sheet.subplots(len(runs), across, squeeze=False)
    for row, run in zip(cells, runs, strict=True):
        times, measured = np.array(run.times_s, dtype=np.float64), _samples(run.measured)
        rows = {"before": run.before, "after": run.after}
        series = {key: _samples(one) for key, one in rows.items() if one}
        for column, (axes, name) in enumerate(zip(row, run.coordinates, strict=False)):
            unit, scale = _UNITS.get(name, _ANGLE)
            for key, predicted in series.items():
                left = scale * (measured[:, column] - predicted[:, column])
                colour, dash = _LINES[key]
                if spectra:
                    axes.loglog(*amplitude_spectrum(times, left), color=colour, ls=dash, lw=0.8)
                else:
                    axes.plot(times, left, color=colour, ls=dash, lw=0.8)
            axes.set_title(f"{run.run}: {plain(name)} ({unit})", fontsize=8, loc="left")
            axes.set_xlabel("frequency (Hz)" if spectra else "time (s)", fontsize=8)
    return sheet


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
        axes.set_ylabel(label, fontsize=8)

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
        axes.set_ylabel(label, fontsize=8)

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
        axes.set_ylabel(label, fontsize=8)

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
