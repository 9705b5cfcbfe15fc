"""Panel: how the swings die away, measured, by the declared model and by the one found."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator, NullLocator

from freeswing.report.figures import AFTER, BEFORE, INK, figure
from freeswing.report.material import Material
from freeswing.report.words import number
from freeswing.results.codec import Numbers
from freeswing.results.diagnosis import Decay

MOST_SHOWN = 6
CAPTION = (
    "Speed of a point mass of the swing's kinetic energy, averaged over parts of the run: measured "
    "(dots), by the declared model (orange, dashed) and by the one found (blue)."
)


class SwingDecay:
    """Amplitude against time, which tells losses apart where runs are long enough."""

    name = "decay"
    title = "How the swings die away"

    def values(self, material: Material) -> dict[str, Any] | None:
        """The picture, and what each run loses."""
        diagnosis = material.diagnosis
        runs = () if diagnosis is None else [one for one in diagnosis.decay if _start(one) > 0.0]
        if not runs:
            return None
        return {"chart": _chart(sorted(runs, key=_start)), "rows": [_row(one) for one in runs]}


def _start(one: Decay) -> float:
    return (one.measured_m_s[0] or 0.0) if one.measured_m_s else 0.0


def _row(one: Decay) -> dict[str, str]:
    return {
        "run": one.run,
        "speed at first (m/s)": number(_start(one)),
        "lost, measured (%)": _lost(one.measured_m_s),
        "declared model (%)": _lost(one.before_m_s),
        "model found (%)": _lost(one.after_m_s),
    }


def _lost(speeds: tuple[float | None, ...]) -> str:
    first, last = (speeds[0], speeds[-1]) if speeds else (None, None)
    return number(100.0 * (1.0 - last / first), 2) if first and last is not None else "–"


def _drawn(numbers: Numbers) -> np.ndarray:
    """NaN, which leaves a gap, where a number is not known."""
    return np.array(numbers, dtype=np.float64)


def _chart(runs: list[Decay]) -> object:
    """Runs from the slowest to the fastest, evenly chosen: what amplitude does meets the eye."""
    step = max(len(runs) - 1, 1) / max(min(len(runs), MOST_SHOWN) - 1, 1)
    shown = [runs[round(k * step)] for k in range(min(len(runs), MOST_SHOWN))]

    def draw(sheet: Figure) -> None:
        axes = sheet.subplots()
        for one in shown:
            times = _drawn(one.times_s)
            axes.plot(times, _drawn(one.before_m_s), "--", color=BEFORE, lw=1.0)
            axes.plot(times, _drawn(one.after_m_s), "-", color=AFTER, lw=1.0)
            axes.plot(times, _drawn(one.measured_m_s), "o", color=INK, ms=3)
        axes.set_yscale("log")
        axes.yaxis.set_major_locator(MaxNLocator(4))  # decades are too far apart for any number
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.yaxis.set_minor_locator(NullLocator())
        axes.set_xlabel("time from the start of the swing (s)")
        axes.set_ylabel("speed (m/s)")

    return figure(draw, 4.6, 2.8, CAPTION)
