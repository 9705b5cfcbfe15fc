"""What is known of a channel beforehand: its zero in every run, and its gains."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from freeswing.cdpr.robot import POSE_COORDINATES, Array
from freeswing.ident.bench.channels import Channel
from freeswing.ident.bench.first_guesses import Glimpse
from freeswing.ident.bench.swing import BenchSwing
from freeswing.ident.likelihood.unknowns import Gaussian, Unknown

BENT = 2.0  # squares of a channel per rad, over its gain: a wall hit at 45 degrees
TWICE_BENT = 4.0  # cubes likewise
UNKNOWN_GAIN = 1.0  # of a gain guessed from a usual twist
OWN_LEVER = 2.0  # gains for sway over that for yaw, 1/m: a dot on a wall half a metre away
OFFSET = 10.0  # times a channel's spread
FOLLOWED_RIDGE = 1e-4  # of the motion's variance: coordinates that hardly move get no large gain


def channel_blocks(
    channel: Channel,
    swings: Sequence[BenchSwing],
    glimpses: Sequence[Glimpse],
    gains: Array,
    named: tuple[int, ...] = (),
) -> list[Unknown]:
    """The offset of every run, and the gains with what is known of them.

    Args:
        channel: which.
        swings: of all runs.
        glimpses: of the same.
        gains: first guesses, (terms,).
        named: places of the sway coordinates that its gains name, see `considered.named_sway`.
    """
    mine = [column for swing in swings for column in swing.columns if column.channel == channel]
    spread = max(float(np.nanstd(column.values)) for column in mine)
    offsets = np.zeros((len(swings), 1))
    for run, swing in enumerate(swings):
        for column in swing.columns:
            if column.channel == channel:
                offsets[run] = np.nanmean(column.values)
    loose = Gaussian(
        np.array([offsets.mean()]),
        np.array([OFFSET * spread + np.ptp(offsets) + 1e-9]),
        "unknown zero",
    )
    if any(swing.columns[0].channel != channel for swing in swings) and not channel.gains:
        gains = _followed_gains(channel, swings, glimpses, gains, named)
    std = gain_spread(channel, gains)
    exact = np.array(
        [
            len(term) == 1
            and channel.coordinates[term[0]] in channel.gains
            and channel.coordinates[term[0]] not in channel.gains_std
            for term in channel.terms
        ]
    )
    mean = np.where(
        [
            len(term) == 1
            and (
                channel.coordinates[term[0]] in channel.gains
                or channel.coordinates[term[0]] == channel.main_coordinate
            )
            for term in channel.terms
        ],
        gains,
        0.0,
    )
    prior = Gaussian(mean, std, "gains" if channel.gains else "a usual twist")
    values = np.tile(gains, (len(swings), 1)) if channel.per_run else gains
    return [
        Unknown(f"offset.{channel.name}", offsets, np.array([spread]), loose, each_run=True),
        Unknown(
            f"channel.{channel.name}",
            values,
            std,
            prior,
            ~exact,
            each_run=channel.per_run,
        ),
    ]


def _followed_gains(
    channel: Channel,
    swings: Sequence[BenchSwing],
    glimpses: Sequence[Glimpse],
    gains: Array,
    named: tuple[int, ...],
) -> Array:
    """Linear gains by which a channel follows the motion that other columns tell, (terms,).

    What its gains name is not among what they tell: there the first guess stays.
    """
    rows, right, linear = [], [], len(channel.coordinates)
    for swing, first in zip(swings, glimpses, strict=True):
        for place, column in enumerate(swing.columns):
            if column.channel == channel:
                moved, values = first.moved[:, channel.columns], first.values[:, place]
                known = np.isfinite(values)
                rows.append((moved - moved.mean(axis=0))[known])
                right.append(values[known] - values[known].mean())
    design, told = np.vstack(rows), np.concatenate(right)
    design = np.where(np.isin(np.arange(linear), named), 0.0, design)
    held = np.sqrt(FOLLOWED_RIDGE * len(told)) * np.abs(design).max() * np.eye(linear)
    found = np.linalg.lstsq(
        np.vstack([design, held]), np.append(told, np.zeros(linear)), rcond=None
    )[0]
    found = np.where(np.isin(np.arange(linear), named), gains[:linear], found)
    return np.concatenate([found, np.zeros(len(gains) - linear)])


def gain_spread(channel: Channel, gains: Array) -> Array:
    """Prior standard deviations of a channel's terms, (terms,).

    Source:
        Bishop 2006, Pattern Recognition and Machine Learning, sec. 2.3: priors of a Taylor
        series' terms.
    """
    place = channel.coordinates.index(channel.main_coordinate)
    main = abs(float(gains[place])) or 1.0
    found = []
    for term in channel.terms:
        levers = sum(channel.coordinates[k] in POSE_COORDINATES[:3] for k in term)
        size = main * OWN_LEVER**levers * (1.0, BENT, TWICE_BENT)[len(term) - 1]
        if len(term) == 1:
            name = channel.coordinates[term[0]]
            if name in channel.gains:
                size = channel.gains_std.get(name, 1e-6 * abs(channel.gains[name]) + 1e-12)
            elif name == channel.coordinates[place]:
                size = UNKNOWN_GAIN * main
        found.append(size)
    return np.array(found)
