"""Panel: a driven robot's runs: angles and residuals (Fig. 7), tensions, spectrum, what is left."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure

from freeswing.report.figures import (
    AFTER,
    BEFORE,
    DASHES,
    INK,
    MEASURED,
    SERIES,
    Draw,
    figures,
    key,
    plain_log_axes,
    roomy,
)
from freeswing.report.material import Material
from freeswing.report.words import plain
from freeswing.results.driven.motion import DriveMotion, DrivenRunMotion

MOST_RUNS = 3  # whose curves are shown, held-out ones first


class DrivenMotion:
    """What was measured and what is predicted, motor by motor."""

    name = "driven_motion"
    title = "Measured and predicted, motor by motor"

    def values(self, material: Material) -> dict[str, Any] | None:
        """Pictures a run; None where no driven robot's motion was written."""
        if material.drive is None or material.drive.motion is None:
            return None
        found = material.drive.motion
        runs = sorted(found.runs, key=_rank)[:MOST_RUNS]
        return {
            "runs": [(one.run, _angles(one, found), _tensions(one, found)) for one in runs],
            "shown": len(runs),
            "total": len(found.runs),
            "spectrum": _spectrum(found),
            "left": _left(material),
            "evidence": _evidence(material),
        }


def _rank(one: DrivenRunMotion) -> tuple[bool, int]:
    """Held-out runs first, the longest first."""
    return (one.role != "validate", -round(1e3 * (one.times_s[-1] or 0.0)))


def _angles(one: DrivenRunMotion, found: DriveMotion) -> Markup:
    """Fig. 7: of every motor the angle measured, predicted, and what is left of it."""
    times = np.array(one.times_s, dtype=float)
    angles = np.array(one.angles_rad, dtype=float)
    gaps = np.array(one.residuals_rad, dtype=float)
    draws = [
        _motor(name, times, angles[:, k], gaps[:, k], found.angle_noise_rad)
        for k, name in enumerate(found.cables)
    ]
    legend = [("measured", MEASURED, "-"), ("predicted", AFTER, "--"), ("residual", BEFORE, "-")]
    caption = (
        f"Run {one.run}: motor angles in rad, and below predicted less measured in mrad "
        "(the paper's Fig. 7)."
    )
    return figures([*draws, key(legend)], 2.2, caption)


def _motor(
    name: str, times: np.ndarray, angles: np.ndarray, gaps: np.ndarray, noise: float
) -> Draw:
    def draw(sheet: Figure) -> None:
        above, below = sheet.subplots(2, 1, sharex=True, height_ratios=(3, 2))
        above.plot(times, angles, color=MEASURED, lw=1.4)
        above.plot(times, angles + gaps, color=AFTER, ls="--")
        above.set_ylabel(f"motor {name}")
        below.plot(times, 1e3 * gaps, color=BEFORE, lw=0.7)
        for side in (-2e3, 2e3):
            below.axhline(side * noise, color=INK, lw=0.5, ls=":")
        below.set_ylabel("mrad")
        below.set_xlabel("time (s)")

    return draw


def _tensions(one: DrivenRunMotion, found: DriveMotion) -> Markup:
    """Tensions with their limits, and how long each cable would have pushed."""
    times = np.array(one.times_s, dtype=float)
    tensions = np.array(one.tensions_N, dtype=float)
    shares = np.array(one.slack_share, dtype=float)
    limits = np.unique(np.array(found.tension_limits_N, dtype=float))
    names = found.cables

    def draw(sheet: Figure) -> None:
        axes = sheet.subplots()
        for k, name in enumerate(names):
            axes.plot(times, tensions[:, k], lw=0.8, label=name, **_line(k))
        for limit in limits:
            axes.axhline(limit, color=INK, lw=0.8, ls=":")
        axes.axhline(0.0, color=INK, lw=0.8)
        axes.set_xlabel("time (s)")
        axes.set_ylabel("tension (N)")
        axes.legend(ncols=4, fontsize=7)

    def bars(sheet: Figure) -> None:
        axes = sheet.subplots()
        axes.bar(range(len(names)), 100.0 * shares, color=AFTER)
        axes.set_xticks(range(len(names)), names)
        axes.set_ylim(0.0, max(1.0, 110.0 * float(shares.max(initial=0.0))))
        axes.set_xlabel("cable")
        axes.set_ylabel("slack (% of samples)")

    caption = (
        f"Run {one.run}: tensions by the estimate, limits dotted, and the share of samples at "
        "which each cable would have had to push."
    )
    return figures([draw, bars], 2.6, caption, 4.4)


def _line(k: int) -> dict[str, Any]:
    """Colour and dash of the k-th line."""
    return {"color": SERIES[k % len(SERIES)], "ls": DASHES[k // len(SERIES) % len(DASHES)]}


def _spectrum(found: DriveMotion) -> Markup:
    """Power of the residuals against that of counts alone."""

    def draw(sheet: Figure) -> None:
        axes = roomy(sheet)
        top = 1.0
        for k, one in enumerate(found.runs):
            rates = np.array(one.spectrum_hz, dtype=float)
            top = max(top, float(rates.max(initial=1.0)))
            power = np.array(one.spectrum_rad2_hz, dtype=float)
            axes.plot(rates, power, lw=0.9, label=one.run, **_line(k))
        white = found.angle_noise_rad**2 / top
        axes.axhline(white, color=INK, lw=0.8, ls=":", label="counts alone")
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlabel("rate (Hz)")
        axes.set_ylabel("residual (rad²/Hz)")
        plain_log_axes(axes)
        axes.legend(fontsize=7, ncols=2)

    caption = (
        "Spectrum of the angles' residuals, motors together; counts alone would leave the dotted "
        "line."
    )
    return figures([draw], 3.2, caption, 5.6)


def _left(material: Material) -> str:
    """What no candidate explains, or that nothing was looked for."""
    if material.diagnosis is None:
        return "What the model lacks was not looked for: freeswing diagnose."
    left = material.diagnosis.unexplained
    if left is not None and left.present:
        return f"None of the known effects explains what remains: {left.signature}."
    return ""


def _evidence(material: Material) -> Sequence[dict[str, str]]:
    """Which seconds of which held-out run carry each accepted effect."""
    accepted = () if material.diagnosis is None else material.diagnosis.accepted
    return [
        {
            "effect": plain(effect.effect) + (f" ({effect.part})" if effect.part else ""),
            "run": one.run,
            "from (s)": f"{one.from_s:g}",
            "to (s)": f"{one.to_s:g}",
            "of what it explains (%)": f"{100.0 * (one.share or 0.0):.0f}",
        }
        for effect in accepted
        for one in effect.evidence
    ]
