"""The swing that would tell two models apart best, in numbers: how far, and how long."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from freeswing.cdpr.model.elastic_motion import at_ease
from freeswing.cdpr.model.free_motion import admissible_rates
from freeswing.cdpr.robot import Array
from freeswing.cdpr.simulation.free_swing import Motion, simulate
from freeswing.cdpr.simulation.sensitivity import linearise
from freeswing.ident.diagnose.refit import Refit, colour_of
from freeswing.ident.diagnose.screen import known_rows
from freeswing.ident.likelihood.calibration_modes import motion_shifts
from freeswing.ident.likelihood.run_residuals import Samples, predicted, reduce_run

# Times what was recorded: how far from the middle of that run a swing starts, how long it lasts.
REACHES = (0.3, 1.0)
DURATIONS = (1.0, 3.0)


@dataclass(frozen=True, slots=True)
class NextSwing:
    """A swing to record.

    Attributes:
        like: the run whose equilibrium it is about.
        reach_m: how far P swings from its middle.
        duration_s: of the recording.
        times_better: how many times as far it would part the two models, in standard deviations,
            as one more run like that one; values, inertia and start fitted anew. How far that is
            nobody knows who does not know what else both models lack.
    """

    like: str
    reach_m: float
    duration_s: float
    times_better: float

    def document(self) -> dict[str, Any]:
        """For results/diagnosis.json."""
        return {
            "like": self.like,
            "reach_m": self.reach_m,
            "duration_s": self.duration_s,
            "times_better": self.times_better,
        }

    def __str__(self) -> str:
        """For a reader."""
        return (
            f"a swing like {self.like}, {1e3 * self.reach_m:.0f} mm to each side of its middle and "
            f"recorded for {self.duration_s:.0f} s, parts them {self.times_better:.1f} times as "
            f"well as that run: freeswing excite ROBOT --reach-m {self.reach_m:.3f} --duration-s "
            f"{self.duration_s:.0f}"
        )


def next_swing(best: Refit, rival: Refit, noise_scales: Array) -> NextSwing | None:
    """The swing about the largest recorded one's middle that parts two fits best.

    Args:
        best: the fit that stands in the model.
        rival: one that the recordings cannot tell from it, of the same runs.
        noise_scales: of metres and radians, (2,).

    Returns:
        None where neither model can follow any of the swings that were tried.
    """
    found = best.fit
    spans = [np.ptp(predicted(m, s.times_s)[:, :3], axis=0).max() for m, s in _pairs(best)]
    run = int(np.argmax(spans))
    scales = noise_scales * np.sqrt(colour_of(found, noise_scales))
    recorded = _recorded(best, noise_scales, scales)
    middle = found.motions[run].at(found.samples[run].times_s)[0].mean(axis=0)
    told: dict[tuple[float, float], tuple[float, float, float]] = {}
    for reach, duration in product(REACHES, DURATIONS):
        try:
            motions = [_swung(one, run, middle, reach, duration) for one in (best, rival)]
        except (ValueError, np.linalg.LinAlgError):
            continue
        samples = _seen(motions, found.samples[run])
        apart = _apart(motions[0], samples, scales, recorded, best)
        way = motions[0].at(samples.times_s)[0][:, :3] - middle[:3]
        far = float(np.linalg.norm(way, axis=1).max())
        told[reach, duration] = (apart, far, samples.span_s[1] - samples.span_s[0])
    usual = told.get((1.0, 1.0))
    if usual is None or not usual[0] > 0.0:
        return None
    apart, far, long = max(told.values())
    return NextSwing(found.samples[run].name, far, long, apart / usual[0])


def _pairs(one: Refit) -> zip[tuple[Motion, Samples]]:
    return zip(one.fit.motions, one.fit.samples, strict=True)


def _swung(one: Refit, run: int, middle: Array, reach: float, duration: float) -> Motion:
    """The run again from nearer to its middle, and for longer.

    Raises:
        ValueError: when it cannot be followed.
    """
    motion, (start, end) = one.fit.motions[run], one.fit.samples[run].span_s
    zeta = middle + reach * (motion.zetas[0] - middle)
    model, inertia, rates = motion.model, motion.inertia, reach * motion.rates[0]
    values = at_ease(model, zeta, rates, inertia, motion.values, start)
    rates = admissible_rates(model, zeta, rates, inertia, values, start)
    span = start, start + duration * (end - start)
    return simulate(model, zeta, rates, span, inertia, values, 1e-7)


def _seen(motions: list[Motion], like: Samples) -> Samples:
    """What cameras like those of a run would see of the second motion, and of the first's poses."""
    step = float(np.median(np.diff(like.times_s)))
    end = min(one.end_s for one in motions)
    times = np.arange(motions[0].starts_s[0], end - 1e-9, step)
    whitener = np.broadcast_to(
        np.median(like.whitener, axis=0), (len(times), *like.whitener.shape[1:])
    )
    values = predicted(motions[1], times)[:, like.columns]
    return replace(
        like,
        times_s=times,
        values=values,
        whitener=whitener,
        lengths_m=None,
        span_s=(float(times[0]), float(times[-1])),
        temper=1.0,
    )


def _recorded(best: Refit, noise_scales: Array, scales: Array) -> Array:
    """What the recordings know of the shared unknowns, as rows over [unknowns; 0]."""
    triangles = best.evidence.triangles * float(noise_scales[0] / scales[0])
    rows = triangles.reshape(-1, triangles.shape[-1]).copy()
    rows[:, -1] = 0.0
    known = known_rows(best.fit.model, best.fit.values, best.fit.samples)
    known[:, -1] = 0.0
    return np.vstack([rows, known])


def _apart(motion: Motion, samples: Samples, scales: Array, recorded: Array, best: Refit) -> float:
    """Deviations that remain where the first model fits what the second one does."""
    shifts = motion_shifts(motion, samples, best.evidence.common)
    new = reduce_run(linearise(motion), samples, scales, shifts).rows
    columns = best.evidence.columns(np.flatnonzero(best.fit.free))
    together = np.vstack([new, recorded])[:, columns]
    triangle = np.asarray(np.linalg.qr(together, mode="r"), dtype=np.float64)
    return float(abs(triangle[-1, -1]))
