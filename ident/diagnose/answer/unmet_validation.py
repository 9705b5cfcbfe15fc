"""Validation runs that an answer does not meet, though it meets the runs that it was fitted to."""

from __future__ import annotations

from dataclasses import replace

from freeswing.ident.diagnose.answer.averages import rms
from freeswing.ident.diagnose.heldout import HeldOut, HeldOutRun
from freeswing.ident.diagnose.unexplained import Unexplained

MOST_OVER_NOISE = 1.2
"""So many times worse than fitted runs are met, beside the noise of each, is no longer chance: of
120 sealed sessions that were answered right one lies above 1.05 (stretching cables that vibrate,
1.48), a bob on a string that was called a fan and a tether made it 1.28."""


def unmet(held: HeldOut, fitted_over_noise: float) -> HeldOutRun | None:
    """The validation run that is predicted worst, where their error as a whole is no chance.

    Args:
        held: the validation runs under the answer.
        fitted_over_noise: what the answer leaves of the fitted runs, in units of their noise. What
            is missing there is missing here too, and told of them.
    """
    error = _over_noise(held)
    if error is None or error < MOST_OVER_NOISE * max(fitted_over_noise, 1.0):
        return None
    return max(held.runs, key=_run_over_noise)


def share_removed(before: HeldOut, after: HeldOut) -> float:
    """Share of the validation runs' error power beyond the noise that an answer removes."""
    first, last = (_over_noise(one) or 1.0 for one in (before, after))
    return 1.0 - (last**2 - 1.0) / (first**2 - 1.0) if first > 1.0 else 0.0


def is_shown(before: HeldOut, after: HeldOut) -> bool:
    """Whether the validation runs are predicted better after than before."""
    first, last = (_over_noise(one) or 1.0 for one in (before, after))
    return last < first


def with_unmet(rest: Unexplained, held: HeldOut) -> Unexplained:
    """What remains, with the validation run that says so where one does."""
    worst = unmet(held, rest.over_noise)
    if worst is None:
        return rest
    met = "though fitted runs are met"
    if rest.over_noise >= MOST_OVER_NOISE:
        met = f"fitted runs {rest.over_noise:.1f} times"
    words = (
        f"validation run {worst.run} is predicted {_run_over_noise(worst):.1f} times worse than "
        f"its noise, {met}: something acts where that run went or when it was recorded, or its "
        "samples are wrong"
    )
    signature = f"{rest.signature}; {words}" if rest.signature else words
    evidence = rest.evidence | {"held_out_over_noise": _over_noise(held)}
    return replace(rest, present=True, signature=signature, evidence=evidence)


def _over_noise(held: HeldOut) -> float | None:
    """Prediction error in metres over the samples' noise, root mean squares over the runs."""
    error, floor = rms(held.errors_m), held.noise_floor_m
    return error / floor if error is not None and floor else None


def _run_over_noise(run: HeldOutRun) -> float:
    error = None if run.prediction is None else run.prediction.rmse_m
    return 0.0 if error is None or run.noise_floor_m <= 0.0 else error / run.noise_floor_m
