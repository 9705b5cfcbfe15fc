"""Panel: measured and predicted motion, residuals and their spectra, before and after."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from freeswing.report.figures import AFTER, BEFORE, MEASURED, figure, plain_log_axes, thin
from freeswing.report.material import Document, Material
from freeswing.report.words import plain

MAX_RUNS = 4
_UNITS = {"x": ("mm", 1e3), "y": ("mm", 1e3), "z": ("mm", 1e3)}
_ANGLE = ("mrad", 1e3)


class Motion:
    """What was measured beside what the model predicts from the initial state alone."""

    name = "motion"
    title = "Measured and predicted motion"

    def values(self, material: Material) -> dict[str, Any] | None:
        """Figures for the first held-out runs; the others are counted."""
        runs = list(material.motion.get("runs") or [])
        if not runs:
            return None
        return {
            "figures": [run_figure(run) for run in runs[:MAX_RUNS]],
            "shown": min(len(runs), MAX_RUNS),
            "total": len(runs),
        }


def run_figure(run: Document) -> object:
    """Motion, residual and its spectrum for each coordinate of one run."""
    times = np.array(run["times_s"], dtype=np.float64)
    measured = _samples(run["measured"])
    predictions = {key: _samples(run[key]) for key in ("before", "after") if run.get(key)}
    coordinates = [str(name) for name in run["coordinates"]]

    def draw(sheet: Figure) -> None:
        grid = sheet.subplots(len(coordinates), 3, squeeze=False, width_ratios=[2, 2, 1.3])
        for row, name in enumerate(coordinates):
            unit, scale = _UNITS.get(name, _ANGLE)
            series = {key: scale * values[:, row] for key, values in predictions.items()}
            _draw_row(list(grid[row]), times, scale * measured[:, row], series)
            grid[row][0].set_ylabel(f"{plain(name)} ({unit})")
        for axes in grid[:, 2]:
            plain_log_axes(axes)
        for axes, title in zip(grid[0], ("motion", "residual", "its spectrum"), strict=True):
            axes.set_title(title, fontsize=9, loc="left")
        grid[-1][0].set_xlabel("time (s)")
        grid[-1][1].set_xlabel("time (s)")
        grid[-1][2].set_xlabel("frequency (Hz)")
        handles, labels = grid[0][0].get_legend_handles_labels()
        sheet.legend(handles, labels, loc="outside lower left", ncols=3, fontsize=8)

    caption = f"Run {run['run']}: measured (dark), predicted before (orange) and after (blue)."
    return figure(draw, 8.0, 0.9 + 1.35 * len(coordinates), caption)


def _draw_row(
    axes: list[Any], times: np.ndarray, measured: np.ndarray, series: dict[str, np.ndarray]
) -> None:
    colours = {"before": BEFORE, "after": AFTER}
    axes[0].plot(thin(times), thin(measured), color=MEASURED, label="measured")
    for key, predicted in series.items():
        residual = measured - predicted
        axes[0].plot(thin(times), thin(predicted), color=colours[key], lw=0.9, label=key)
        axes[1].plot(thin(times), thin(residual), color=colours[key], lw=0.9)
        frequencies, amplitudes = amplitude_spectrum(times, residual)
        axes[2].loglog(frequencies, amplitudes, color=colours[key], lw=0.9)


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
