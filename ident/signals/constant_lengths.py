"""A run's own cable lengths: the mean of those of its poses, and how far they may vary."""

from __future__ import annotations

import numpy as np

from freeswing.cdpr.model.batch import evaluate
from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.robot import Array
from freeswing.ident.signals.derivatives import Signals, UnusableRunError

# Ten deviations of a length from poses good to half a millimetre: a drum that slipped or a cable
# that hung through, which the doctor warned of from 3 mm on.
LENGTH_LIMIT_M = 0.005


def mean_lengths(model: Model, signals: Signals) -> Array:
    """A run's own cable lengths: the mean of those of its poses, (n_cables,).

    Raises:
        UnusableRunError: when a length does not stay constant, with the cable and by how much.

    Source:
        FIDIM 2022, sec. 5.2: locked lengths of a run.
    """
    lengths = evaluate(model.lengths, signals.values, model.start_values)[0]
    mean = lengths.mean(axis=0)
    off = np.abs(lengths - mean).max(axis=0)
    worst = int(np.argmax(off))
    if not off[worst] <= LENGTH_LIMIT_M:
        raise UnusableRunError(
            f"cable {model.robot.cables[worst].name} is off its mean length by up to "
            f"{1e3 * off[worst]:.1f} mm (limit {1e3 * LENGTH_LIMIT_M:g} mm): slack, its winch "
            "was not locked, or robot.toml has its ends wrong"
        )
    return mean
