"""First guesses of a bench fit: how heavy the platform turns, and how each run starts.

A scan over the size of the unknown tensor: at each size the small oscillations about the rest pose
are fitted to the first seconds, linearly; the size that leaves least is where the fit starts.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.model.statics import Equilibrium, modes
from freeswing.cdpr.robot import POSE_COORDINATES, Array
from freeswing.ident.bench.channels import Channel
from freeswing.ident.bench.swing import Column
from freeswing.ident.likelihood.rest_pose import rest_near

MODAL_S = 6.0  # so long do swings of a few degrees stay small oscillations
MOST_SAMPLES = 400
SIZES = np.exp(np.arange(-4.0, 3.0, 0.12))  # of the guessed tensor: a pen to a plank
RIDGE = 1e-4  # of a column's variance: equal modes share what they cannot tell apart
LEANS_RAD = 0.1  # of a guessed rest pose against the true: so much of one angle is another's
TYPICAL_YAW_RAD = 0.06  # three and a half degrees: a twist by hand
LITTLE = 0.1  # of a gain: not zero, for from zero times zero no step leads away
SWAY_M = 0.02  # what a further channel is there to see
LEVER_M = 1.0  # metres that turn a channel's gain for yaw into a first one for sway


T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Glimpse:
    """The first seconds of a run as small oscillations.

    Attributes:
        rest: the rest pose.
        zeta: pose at the first sample, (6,).
        rates: its rates, (6,).
        moved: the small oscillation, from rest, at the view's times, (n, 6).
        values: the columns at these times, (n, columns).
        share: of the columns' variance that is left.
        residuals: rms of each column, in its unit.
        frequencies_hz: of the modes.
    """

    rest: Equilibrium
    zeta: Array
    rates: Array
    moved: Array
    values: Array
    share: float
    residuals: Array
    frequencies_hz: Array


@dataclass(frozen=True, slots=True)
class Sight:
    """What a run's columns see of the pose: `seen` (columns, 6), times and values of the first s.

    Attributes:
        name: of the run.
        rest: the rest pose, which no tensor changes.
        times_s: (n,), from zero.
        values: (n, columns), gaps filled by the column's mean.
        known: (n, columns).
        seen: gradient of every column by the pose, (columns, 6).
        direct: which columns are coordinates, (columns,).
    """

    name: str
    rest: Equilibrium
    times_s: Array
    values: Array
    known: Array
    seen: Array
    direct: Array


def sight(
    model: Model,
    name: str,
    lengths_m: Array,
    inertia: Array,
    times_s: Array,
    columns: Sequence[Column],
    gains: Mapping[str, Array],
) -> Sight:
    """The first seconds of a run.

    Args:
        model: the robot.
        name: of the run.
        lengths_m: wire lengths, (n_cables,).
        inertia: a guess, (9,), of which the centre of mass counts.
        times_s: of the samples, (n,).
        columns: what was measured.
        gains: first guesses of every channel's terms.

    Raises:
        ValueError: without a stable rest pose.
    """
    inside = np.flatnonzero(times_s <= times_s[0] + MODAL_S)
    inside = inside[:: max(1, len(inside) // MOST_SAMPLES)]
    values = np.stack([column.values[inside] for column in columns], axis=1)
    seen = np.zeros((len(columns), 6))
    for row, column in enumerate(columns):
        if column.channel is None:
            seen[row, column.coordinate] = 1.0
        else:
            places = column.channel.columns
            seen[row, places] = gains[column.channel.name][: len(places)]
    direct = [one for one in columns if one.channel is None and one.place_m is None]
    places = [column.coordinate for column in direct if column.coordinate is not None]
    means = np.array([np.nanmean(column.values) for column in direct])
    rest = rest_near(model, lengths_m, inertia, places, means, name)
    since = times_s[inside] - times_s[inside[0]]
    is_direct = np.array([column.channel is None for column in columns])
    return Sight(name, rest, since, values, np.isfinite(values), seen, is_direct)


def first_gains(channel: Channel, columns: Sequence[Column], place: int = 0) -> Array:
    """A first guess of a channel's gains, (terms,): those given, else by a usual twist.

    Squares and cubes start at zero. Sway has no direction that uncalibrated channels could name:
    the first answers to its first sway coordinate, the second to the next, a little to the others.

    Args:
        channel: of which they are wanted.
        columns: what all runs hold of it.
        place: of the channel among all of the bench.

    Source:
        Press et al. 2007, Numerical Recipes, sec. 14.1: percentiles and medians as a scale.
    """
    sizes = [
        0.5 * float(np.nanpercentile(one.values, 99) - np.nanpercentile(one.values, 1))
        for one in columns
    ]
    main = channel.main_coordinate
    usual = channel.gains.get(main, float(np.median(sizes)) / TYPICAL_YAW_RAD)
    found = np.zeros(len(channel.terms))
    sway = [name for name in channel.coordinates if name in POSE_COORDINATES[:3]]
    for k, name in enumerate(channel.coordinates):
        guess = usual
        if name in sway:
            mine = sway.index(name) == place % len(sway)
            full = usual / LEVER_M if place == 0 else float(np.median(sizes)) / SWAY_M
            guess = full if mine else LITTLE * full
        found[k] = channel.gains.get(name, guess)
    return found


def glimpse(model: Model, view: Sight, inertia: Array) -> Glimpse:
    """Small oscillations (FIDIM 2022, eqs. 38, 39) fitted to a run's first seconds.

    Coordinates share the modes' amplitudes; every channel has its own, for its gains are unknown.
    Where there are channels alone, the first one's gains turn them into a motion.

    Raises:
        ValueError: when the rest pose is not stable at this inertia.
    """
    found = modes(model, view.rest, inertia)
    shapes = found.shapes / np.abs(found.shapes).max(axis=0)
    phase = 2.0 * np.pi * np.outer(view.times_s, found.frequencies_hz)
    waves = np.stack([np.cos(phase), np.sin(phase)], axis=2)  # (n, modes, 2)
    seen = view.seen @ shapes
    groups = [np.flatnonzero(view.direct), *[[k] for k in np.flatnonzero(~view.direct)]]
    left, squares, spreads = np.zeros(len(seen)), 0.0, 0.0
    amplitudes = None
    for group in groups:
        if not len(group):
            continue
        own, off = _waves_fitted(view, waves, seen, list(group))
        amplitudes = own if amplitudes is None else amplitudes
        for k, rest in zip(group, off.T, strict=True):
            known = view.known[:, k]
            left[k] = np.sqrt(np.mean(rest[known] ** 2))
            squares += float(np.mean(rest[known] ** 2)) / _variance(view, k)
            spreads += 1.0
    if amplitudes is None:
        raise ValueError(f"run {view.name}: nothing was measured")
    rates = shapes @ (2.0 * np.pi * found.frequencies_hz * amplitudes[:, 1])
    moved = np.einsum("nmw,mw->nm", waves, amplitudes) @ shapes.T
    zeta = view.rest.zeta + shapes @ amplitudes[:, 0]
    share = squares / spreads
    return Glimpse(view.rest, zeta, rates, moved, view.values, share, left, found.frequencies_hz)


def _variance(view: Sight, column: int) -> float:
    """By which a column counts: its own; a coordinate's, no less than what modes are off by.

    A platform that hangs level where its guess leans yaws without the pitch that the guess has
    with it: a pitch that is noise alone would hold yaw at zero.
    """
    own = float(np.var(view.values[view.known[:, column], column])) + 1e-300
    if not view.direct[column]:
        return own
    angle = np.asarray(view.seen[:, 3:].any(axis=1))
    alike = np.flatnonzero(view.direct & (angle == angle[column]))
    largest = max(float(np.var(view.values[view.known[:, k], k])) for k in alike)
    return own + LEANS_RAD**2 * largest


def _waves_fitted(view: Sight, waves: Array, seen: Array, group: list[int]) -> tuple[Array, Array]:
    """Amplitudes (modes, 2) that follow some columns, and what is left of these (n, group)."""
    n, count = waves.shape[:2]
    rows, right = [], []
    for place, k in enumerate(group):
        part = np.zeros((n, 2 * count + len(group)))
        part[:, : 2 * count] = (waves * seen[k][:, None]).reshape(n, -1)
        part[:, 2 * count + place] = 1.0
        weight = view.known[:, k] / np.sqrt(_variance(view, k))
        rows.append(part * weight[:, None])
        right.append(np.where(view.known[:, k], view.values[:, k], 0.0) * weight)
    design = np.vstack(rows)
    # Of each wave's own size: a coordinate that hardly moves has a weight of which a share would
    # hold all others at zero. A wave that no column sees stays within a sway.
    sizes = np.linalg.norm(design[:, : 2 * count], axis=0)
    ridge = np.sqrt(RIDGE) * np.hypot(sizes, np.sqrt(n) / SWAY_M)
    held = np.hstack([np.diag(ridge), np.zeros((2 * count, len(group)))])
    found = np.linalg.lstsq(
        np.vstack([design, held]), np.concatenate([*right, np.zeros(2 * count)]), rcond=None
    )[0]
    off = []
    for place, k in enumerate(group):
        told = (waves * seen[k][:, None]).reshape(n, -1) @ found[: 2 * count]
        off.append(told + found[2 * count + place] - view.values[:, k])
    return found[: 2 * count].reshape(count, 2), np.array(off).T


def best_size(
    model: Model, views: Sequence[Sight], inertia_of: Callable[[int, float], Array]
) -> float:
    """The size of an unknown tensor, as a factor on its guess, that follows some runs best.

    Args:
        model: the robot.
        views: of the runs.
        inertia_of: gives a run's specific inertia (9,) from its index and the factor.

    Raises:
        ValueError: where no factor gives every run a stable rest pose and modes.
    """

    def score(size: float) -> float:
        total = 0.0
        for index, view in enumerate(views):
            try:
                found = glimpse(model, view, inertia_of(index, size))
            except (ValueError, np.linalg.LinAlgError):
                return np.inf
            total += np.log(max(found.share, 1e-6))
        return total

    scores = np.array([score(size) for size in SIZES])
    if not np.isfinite(scores).any():
        glimpse(model, views[0], inertia_of(0, 1.0))
        raise ValueError(f"run {views[0].name}: no size of the platform gives it small swings")
    best = int(np.argmin(scores))
    fine = SIZES[best] * np.exp(np.linspace(-0.12, 0.12, 9))
    return float(fine[int(np.argmin([score(size) for size in fine]))])


def thinned(views: Sequence[T], most: int) -> list[T]:
    """At most so many of the views, spread over all: a scan needs no more."""
    step = max(1, len(views) // most)
    return list(views[::step][:most])
