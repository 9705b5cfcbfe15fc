"""Samples far from a motion that follows all others: named, since one of them decides an error."""

from __future__ import annotations

import numpy as np

from freeswing.cdpr.robot import POSE_COORDINATES, Array
from freeswing.ident.judge.prediction import Prediction

# Times the usual distance of a sample from the motion. What a model lacks makes three or four.
FAR = 10.0
# More of them are no few wrong samples, but a motion that is not followed.
MOST_FAR = 0.05


def far_from_prediction(prediction: Prediction) -> str:
    """Which samples of a run are wrong rather than badly predicted; empty where none are."""
    off = prediction.measured - prediction.predicted
    return far_sentence(prediction.run, prediction.times_s, prediction.coordinates, off)


def far_sentence(run: str, times_s: Array, coordinates: tuple[str, ...], off: Array) -> str:
    """A sentence about the few samples that lie far from a motion, empty where there are none.

    Args:
        run: its name.
        times_s: of the samples, (n,).
        coordinates: what was measured.
        off: samples minus motion, (n, n_c).
    """
    places = [k for k, name in enumerate(coordinates) if name in POSE_COORDINATES[:3]]
    unit, names = ("mm", places) if places else ("mrad", list(range(len(coordinates))))
    distance = np.linalg.norm(off[:, names], axis=1)
    usual = float(np.median(distance))
    far = distance > FAR * usual
    if not far.any() or far.mean() > MOST_FAR:
        return ""
    when = f"{times_s[far][0]:.2f} s"
    if far.sum() > 1:
        when = f"{when} to {times_s[far][-1]:.2f} s"
    error, rest = (1e3 * np.sqrt(np.mean(off[part][:, names] ** 2)) for part in (far | True, ~far))
    return (
        f"run {run}: {far.sum()} of {len(far)} samples ({when}) lie up to "
        f"{1e3 * distance.max():.3g} {unit} from the motion that the others follow, "
        f"{distance.max() / usual:.0f} times the usual distance: with them it is off by "
        f"{error:.3g} {unit}, without them by {rest:.3g} {unit}. Look at the recording there"
    )
