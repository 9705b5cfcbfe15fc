"""What is known of a bench's motion before any run: where it starts, how wide it swings."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from freeswing.cdpr.robot import Array
from freeswing.ident.bench.channels import Channel
from freeswing.ident.bench.first_guesses import (
    Glimpse,
)
from freeswing.ident.bench.modal import CREEP, SQUARE
from freeswing.ident.bench.swing import BenchSwing, Column
from freeswing.ident.likelihood.unknowns import Gaussian, Unknown

TWICE_AS_WIDE = 3.0  # of squared amplitude: a twist of twice the usual is one deviation off
CREEPS = 0.5  # of what amplitude changes yaw's frequency by: sway that is half as strong as yaw
SWAY_RAD = 0.02  # unseen sway after a twist by hand: a degree
UNSEEN_RAD = 0.3  # an angle that no column measures directly
SEEN_RAD = 0.5  # where it is measured the samples say all: nothing is assumed


def amplitude_block(channel: Channel) -> Unknown:
    """How much larger than assumed amplitudes are, squared: as wide as the gain's own spread."""
    main = channel.main_coordinate
    wide = TWICE_AS_WIDE
    if main in channel.gains:
        wide = 2.0 * channel.gains_std.get(main, 0.0) / abs(channel.gains[main]) + 1e-6
    prior = Gaussian(np.ones(1), np.full(1, wide), "gains" if main in channel.gains else "a twist")
    low = np.full(1, 1e-3)
    return Unknown(SQUARE, np.ones(1), np.full(1, min(1.0, wide)), prior, low=low)


def creep_block(runs: int) -> Unknown:
    """How yaw's frequency creeps in each run beside its decay: see `SmallMotion`."""
    prior = Gaussian(np.zeros(1), np.full(1, CREEPS), "sway that comes and goes")
    return Unknown(CREEP, np.zeros((runs, 1)), np.full(1, CREEPS), prior, each_run=True)


def starts_block(swings: Sequence[BenchSwing], glimpses: Sequence[Glimpse]) -> Unknown:
    """Where each run's motion starts, in numbers of its chart."""
    values = np.array(
        [
            swing.chart.numbers(first.zeta, first.rates)
            for swing, first in zip(swings, glimpses, strict=True)
        ]
    )
    spread = np.full(values.shape[1], SEEN_RAD)
    spread[len(spread) // 2 :] *= 2.0 * np.pi  # turned round once a second
    prior = Gaussian(np.zeros(len(spread)), spread, "a swing")
    return Unknown("start", values, 0.2 * spread, prior, each_run=True)


def loose_coordinates(columns: Sequence[Column], lengths_m: Array) -> Array:
    """How far coordinates that no column measures directly may be from rest, (6,)."""
    seen = [column.coordinate for column in columns if column.coordinate is not None]
    found = np.repeat([SWAY_RAD * float(np.mean(lengths_m)), UNSEEN_RAD], 3)
    found[seen] = np.inf
    return found
