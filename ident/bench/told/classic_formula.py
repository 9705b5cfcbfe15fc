"""The classic formula of bifilar and trifilar benches beside the fit, and why it differs.

I = m g R r T^2 / (4 pi^2 L): equal wires, the centre of mass in their middle, small angles, no sway
(du Bois, Lieven, Adhikari, Error analysis in trifilar inertia measurements, 2009, eq. 1).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from freeswing.cdpr.robot import Array
from freeswing.cdpr.simulation.parallel_wires import hangs_parallel
from freeswing.ident.bench.fit_rounds import Solved
from freeswing.ident.bench.objects import moments
from freeswing.ident.bench.runs import BenchRun
from freeswing.ident.bench.swing import IZZ, BenchSwing
from freeswing.ident.bench.told.classic_reasons import (
    BESIDE,
    CHI,
    Measured,
    reasons_of,
    spread_of,
)

LEAST_PERIODS = 2.0  # in a record: a sine and a slow drift look alike on fewer
LEANING_PERCENT = 1.0  # of Izz: what a bench is asked for


@dataclass(frozen=True, slots=True)
class ClassicRun:
    """One run by the formula.

    Attributes:
        run: its name.
        period_s: of the yaw.
        izz_kg_m2: by the formula, of platform and all it carries.
        fitted_kg_m2: by the fit, about P.
        reasons: what of the difference is from what, in per cent, by sentence.
    """

    run: str
    period_s: float
    izz_kg_m2: float
    fitted_kg_m2: float
    reasons: tuple[tuple[str, float], ...]

    @property
    def off_percent(self) -> float:
        """By how much the formula is above the fit."""
        return 100.0 * (self.izz_kg_m2 / self.fitted_kg_m2 - 1.0)

    def document(self) -> dict[str, Any]:
        """The entry of `classic` in results/identification.json."""
        return {
            "run": self.run,
            "period_s": self.period_s,
            "Izz_kg_m2": self.izz_kg_m2,
            "fitted_Izz_kg_m2": self.fitted_kg_m2,
            "off_percent": self.off_percent,
            "reasons": [{"what": what, "percent": share} for what, share in self.reasons],
        }


def classic_runs(solved: Solved, declared_kg: float | None) -> list[ClassicRun]:
    """The formula for every run in which yaw can be seen, with the declared mass and lengths."""
    found = []
    for index, swing in enumerate(solved.swings):
        period = period_of(swing)
        if period is None:
            continue
        values = solved.solution.unknowns.of_run(index)
        total = swing.total(values)
        added = total[0] - values["platform"][0]
        mass = total[0] if declared_kg is None else declared_kg + added
        top, bottom, length = radii(swing)
        gravity = float(np.linalg.norm(swing.model.robot.gravity_m_s2))
        izz = mass * gravity * top * bottom / length * (period / (2.0 * np.pi)) ** 2
        measured = Measured(mass, float(izz), period, _simulated(swing, values))
        reasons = reasons_of(swing, values, measured)
        found.append(ClassicRun(swing.name, period, float(izz), float(total[IZZ]), reasons))
    return found


def radii(swing: BenchSwing) -> tuple[float, float, float]:
    """Radii of the wires' upper and lower ends about their middle, and the mean length."""
    robot = swing.model.robot
    top, bottom = (spread_of(points) for points in (robot.entries_m, robot.attachments_m))
    return top, bottom, float(np.mean(swing.lengths_m))


def period_of(swing: BenchSwing) -> float | None:
    """Period of yaw in the column that shows it, by one sine; None: too short or not there."""
    column = next((one for one in swing.columns if one.coordinate == 5), None)
    if column is None:
        column = next((one for one in swing.columns if one.channel is not None), None)
    if column is None:
        return None
    return sine_period(swing.times_s[column.known], column.values[column.known])


def _simulated(swing: BenchSwing, values: Mapping[str, Array]) -> float | None:
    """Period of yaw in the fitted swing, by the same sine as the samples'."""
    return sine_period(swing.times_s, swing.simulated(values).at(swing.times_s)[0][:, CHI])


def sine_period(times: Array, values: Array) -> float | None:
    """Period of the sine that leaves least of some samples, (n,) each, s; None: too short."""
    span = times[-1] - times[0]
    rates = np.arange(LEAST_PERIODS / span, min(5.0, 0.25 / np.median(np.diff(times))), 0.1 / span)
    if not len(rates):
        return None
    best = rates[int(np.argmin([_left(times, values, rate) for rate in rates]))]
    for width in (0.1, 0.01, 0.001):
        near = best + np.linspace(-width, width, 21) / span
        best = near[int(np.argmin([_left(times, values, rate) for rate in near]))]
    return float(1.0 / best)


def _left(times: Array, values: Array, rate: float) -> float:
    phase = 2.0 * np.pi * rate * times
    design = np.column_stack([np.ones_like(times), np.cos(phase), np.sin(phase)])
    found = np.linalg.lstsq(design, values, rcond=None)[0]
    return float(np.sum((values - design @ found) ** 2))


def leaning_sentence(classic: Sequence[ClassicRun], sway_seen: bool) -> str:
    """A warning where Izz leans on a centre of mass that no calibrated column has shown.

    Args:
        classic: the runs by the formula.
        sway_seen: whether some run measures x or y itself.
    """
    shares = [abs(share) for run in classic for what, share in run.reasons if what == BESIDE]
    if sway_seen or not shares or float(np.median(shares)) < LEANING_PERCENT:
        return ""
    return (
        f"DO NOT RELY ON Izz about P: {np.median(shares):.1f} % of it comes from a centre of mass "
        "beside the middle, which only shows in sway, and no run measures x or y itself: how an "
        "uncalibrated signal or yaw alone answers to sway may look the same. Give com_m, measure x "
        "and y in one run, or hang the platform so that its wires share the weight alike"
    )


def held_sentences(solved: Solved) -> list[str]:
    """What no run tells, and how far it is believed to be off."""
    found = []
    for block, mask in solved.held.items():
        spread = solved.solution.std(block)
        if not block.startswith("channel.") and mask[1:3].any():
            who = "the platform" if block == "platform" else block.removeprefix("load.")
            value = np.round(solved.solution.value(block), 9) + 0.0
            found.append(
                f"{who}: no run shows its centre of mass, which is held at x {value[1]:.4g}, "
                f"y {value[2]:.4g} m; that it may be {1e3 * float(spread[1:3].max()):.2g} mm off "
                "(one deviation) is counted"
            )
    return found


def unchecked_lengths(solved: Solved, runs: Sequence[BenchRun]) -> str:
    """That nothing checks the wires' length, where neither sway nor a known mass does; or "".

    Args:
        solved: the fit.
        runs: as fitted.

    Source:
        The classic formula, I = m g R r T^2 / (4 pi^2 L): yaw's period tells I L.
    """
    swing = solved.swings[0]
    checked = solved.wires is not None or any(run.payloads for run in runs)
    if checked or not hangs_parallel(swing.model.robot):
        return ""
    length = float(np.mean(swing.lengths_m))
    gravity = float(np.linalg.norm(swing.model.robot.gravity_m_s2))
    sways = 2.0 * np.pi * float(np.sqrt(length / gravity))
    return (
        f"no run shows sway or carries a known mass, and yaw alone cannot check the wires' length: "
        f"Izz goes as one over it, so that wires twice as long as the stated {length:.3g} m would "
        f"halve it unseen. Time ten sways ({10.0 * sways:.1f} s on such wires), measure x or y in "
        "one run, or hang a known mass far from the middle"
    )


def own_izz(solved: Solved) -> float:
    """The platform's Izz about P, kg m2."""
    return float(moments(solved.solution.value("platform"))[IZZ])
