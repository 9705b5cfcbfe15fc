"""Panel: how swings die away: by the declared model and the one found, or by laws of loss."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator, NullLocator

from freeswing.report.figures import AFTER, BEFORE, DASHES, INK, SERIES, figure
from freeswing.report.material import Material
from freeswing.report.words import number
from freeswing.results.codec import Numbers
from freeswing.results.diagnosis import Decay
from freeswing.results.identification import YawAmplitudes, YawDecay

MOST_SHOWN = 6
CAPTION = (
    "Speed of a point mass of the swing's kinetic energy, averaged over parts of the run: measured "
    "(dots), by the declared model (orange, dashed) and by the one found (blue)."
)
YAW_CAPTION = (
    "Amplitude of yaw in parts of the run: measured (dots, with one deviation), and by three laws "
    "fitted to each run: linear drag (blue), quadratic drag (orange, dashed), dry friction (green, "
    "dash-dotted)."
)
SPEEDS_SAY = (
    "Lines side by side lose the same share: linear losses. Where slow swings lose a larger share "
    "than fast ones, dry friction takes part; where they lose a smaller one, quadratic drag does."
)
LAW_WORDS = {"linear": "linear drag", "quadratic": "quadratic drag", "dry": "dry friction"}


@dataclass(frozen=True, slots=True)
class Line:
    """One run as it is drawn: measured with its deviations, and its curves (numbers, dash, colour).

    Times in s.
    """

    times_s: Numbers
    measured: Numbers
    std: Numbers
    curves: tuple[tuple[Numbers, str, str], ...]


class SwingDecay:
    """Amplitude against time, which tells losses apart where runs are long enough."""

    name = "decay"
    title = "How the swings die away"

    def values(self, material: Material) -> dict[str, Any] | None:
        """The picture, and what each run loses."""
        diagnosis, found = material.diagnosis, material.identification
        runs = () if diagnosis is None else [one for one in diagnosis.decay if _start(one) > 0.0]
        if runs:
            shown = [_speeds(one) for one in _chosen(sorted(runs, key=_start))]
            chart = _chart(shown, "speed (m/s)", CAPTION)
            return {"chart": chart, "says": SPEEDS_SAY, "rows": [_row(one) for one in runs]}
        yaw = None if found is None else found.yaw_decay
        if yaw is None or not yaw.runs:
            return None
        shown = [_amplitudes(one) for one in _chosen(sorted(yaw.runs, key=_first))]
        chart = _chart(shown, "amplitude of yaw (rad)", YAW_CAPTION)
        return {"chart": chart, "says": _law(yaw), "rows": [_yaw_row(one) for one in yaw.runs]}


def _start(one: Decay) -> float:
    return (one.measured_m_s[0] or 0.0) if one.measured_m_s else 0.0


def _first(one: YawAmplitudes) -> float:
    return (one.measured_rad[0] or 0.0) if one.measured_rad else 0.0


def _row(one: Decay) -> dict[str, str]:
    return {
        "run": one.run,
        "speed at first (m/s)": number(_start(one)),
        "lost, measured (%)": _lost(one.measured_m_s),
        "declared model (%)": _lost(one.before_m_s),
        "model found (%)": _lost(one.after_m_s),
    }


def _yaw_row(one: YawAmplitudes) -> dict[str, str]:
    return {
        "run": one.run,
        "amplitude at first (rad)": number(_first(one)),
        "lost, measured (%)": _lost(one.measured_rad),
        "linear (%)": _lost(one.linear_rad),
        "quadratic (%)": _lost(one.quadratic_rad),
        "dry (%)": _lost(one.dry_rad),
    }


def _law(yaw: YawDecay) -> str:
    """Which law the runs follow, in so far as they tell."""
    ranked = sorted(yaw.laws.items(), key=lambda one: -one[1])
    told = ", ".join(f"{LAW_WORDS.get(name, name)} {100.0 * one:.0f} %" for name, one in ranked)
    return (
        f"If one law alone takes it away, it is with probability: {told}. Laws differ where a run "
        "loses much: record until half of the amplitude is gone."
    )


def _lost(sizes: Numbers) -> str:
    first, last = (sizes[0], sizes[-1]) if sizes else (None, None)
    return number(100.0 * (1.0 - last / first), 2) if first and last is not None else "–"


def _drawn(numbers: Numbers) -> np.ndarray:
    """NaN, which leaves a gap, where a number is not known."""
    return np.array(numbers, dtype=np.float64)


def _chosen(runs: Sequence[Any]) -> list[Any]:
    """Runs from the slowest to the fastest, evenly chosen: what amplitude does meets the eye."""
    step = max(len(runs) - 1, 1) / max(min(len(runs), MOST_SHOWN) - 1, 1)
    return [runs[round(k * step)] for k in range(min(len(runs), MOST_SHOWN))]


def _speeds(one: Decay) -> Line:
    curves = ((one.before_m_s, "--", BEFORE), (one.after_m_s, "-", AFTER))
    return Line(one.times_s, one.measured_m_s, (), curves)


def _amplitudes(one: YawAmplitudes) -> Line:
    laws = (one.linear_rad, one.quadratic_rad, one.dry_rad)
    curves = tuple(zip(laws, DASHES, SERIES, strict=False))
    return Line(one.times_s, one.measured_rad, one.std_rad, curves)


def _chart(lines: Sequence[Line], label: str, caption: str) -> object:
    def draw(sheet: Figure) -> None:
        axes = sheet.subplots()
        for one in lines:
            times = _drawn(one.times_s)
            for sizes, dash, colour in one.curves:
                axes.plot(times, _drawn(sizes), dash, color=colour, lw=1.0)
            std = _drawn(one.std) if one.std else None
            axes.errorbar(times, _drawn(one.measured), std, fmt="o", color=INK, ms=3, lw=1.0)
        axes.set_yscale("log")
        axes.yaxis.set_major_locator(MaxNLocator(4))  # decades are too far apart for any number
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.yaxis.set_minor_locator(NullLocator())
        axes.set_xlabel("time from the start of the swing (s)")
        axes.set_ylabel(label)

    return figure(draw, 4.6, 2.8, caption)
