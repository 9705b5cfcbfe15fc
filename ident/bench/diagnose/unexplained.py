"""What no cause explains: power near the swing that white noise of neighbouring samples lacks."""

from __future__ import annotations

from typing import Any

import numpy as np

from freeswing.cdpr.robot import Array
from freeswing.ident.bench.diagnose.weigh import Fit
from freeswing.ident.bench.noise import column_residuals

# Power near the swing over that of white noise: of tracks it is 2 to 8 (their errors last over
# neighbouring samples), of what the model lacks hundreds.
COLOURED = 10.0
SLOWEST_PARTS = 0.25  # of the band up to half the sampling rate: where swings are


def remaining(one: Fit) -> dict[str, Any]:
    """The entry `unexplained`: the coordinate that is left worst, its size and frequency."""
    worst, found = 0.0, None
    for name, (times, parts, unit) in _by_column(one).items():
        powers = [_powers(t, part) for t, part in zip(times, parts, strict=True)]
        low = float(np.mean([p[f <= SLOWEST_PARTS * f[-1]].mean() for f, p in powers]))
        high = float(np.mean([p[f > SLOWEST_PARTS * f[-1]].mean() for f, p in powers]))
        colour = low / max(high, 1e-300)
        if colour > max(worst, COLOURED):
            strongest = max(powers, key=lambda one: float(one[1].max()))
            hertz = float(strongest[0][int(np.argmax(strongest[1]))])
            rms = float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))
            worst, found = colour, (name, rms, unit, hertz)
    if found is None:
        return {"present": False, "signature": "", "evidence": {}}
    name, rms, unit, hertz = found
    return {
        "present": True,
        "signature": (
            f"{name} is off by {1e3 * rms:.2g} {unit} rms, most near {hertz:.2g} Hz, {worst:.0f} "
            "times the power of its white noise: none of the effects that were tried explains it"
        ),
        "evidence": {"coordinate": name, "rms": rms, "frequency_hz": hertz, "colour": worst},
    }


def _by_column(one: Fit) -> dict[str, tuple[list[Array], list[Array], str]]:
    found: dict[str, tuple[list[Array], list[Array], str]] = {}
    for swing, white in zip(one.swings, one.solution.residuals, strict=True):
        for column, part in zip(swing.columns, column_residuals(swing, white), strict=False):
            if column.coordinate is not None and len(part) > 8:
                unit = "mm" if column.coordinate < 3 else "mrad"
                times, parts, _ = found.setdefault(column.name, ([], [], unit))
                times.append(swing.times_s[column.known])
                parts.append(part * (column.factor * column.std)[column.known])
    return found


def _powers(times_s: Array, part: Array) -> tuple[Array, Array]:
    period = float(np.median(np.diff(times_s)))
    power = np.abs(np.fft.rfft(part)) ** 2 / len(part)
    return np.fft.rfftfreq(len(part), period)[1:], power[1:]
