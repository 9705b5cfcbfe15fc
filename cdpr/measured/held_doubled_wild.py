"""Samples that the recording program made, not the platform: held, doubled and wild ones.

A capture that stalls repeats its last pose, an export at twice the rate writes each sample twice, a
wrong match throws one sample far away. A fit takes all of them for motion. Measured numbers are
never the same to the last digit where their noise is finer than that, so this is seen without a
model.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.files.problems import InputError
from freeswing.cdpr.measured.repeated_and_interpolated import interpolated, off_the_line, repeated
from freeswing.cdpr.measured.trajectory import Trajectory

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# So many samples alike, all digits of all coordinates: at the print's resolution chance makes two
# or three where a swing turns round.
FEWEST_HELD = 5
# ... where neighbours differ by this many steps of the print's resolution.
ABOVE_RESOLUTION = 5.0
# Every second sample repeated is half of the steps; a quarter stand still for other reasons.
DOUBLED_SHARE = 0.4
LONGEST_DOUBLE = 4
# Second differences this many deviations large are no motion: releases by hand reach ten.
WILD_DEVIATIONS = 50.0
NORMAL_BY_MAD = 1.4826
HALF_WITHIN = 0.2
# Rounding to a step makes a deviation of 1/sqrt(12) of it, and of the distance from the middle of
# two others sqrt(1.5) of that.
ROUNDED = 8.0**-0.5
# A step from one sample to the next, beyond that of its neighbours, this many usual ones large and
# this large: no platform jumps so, and a cable that goes taut makes less.
STEP_DEVIATIONS = 40.0
LEAST_STEP_M = 0.003
LEAST_STEP_RAD = 0.015
# ... and back again by as much: what is slung to and fro comes back by chance alone.
BACK_WITHIN = 0.3
# Samples between two such steps are a wrong match for a moment; a camera that was pushed stays so.
LONGEST_WILD_S = 0.5
# No swing is followed with a step of a second; in other units of time 1 to 5000 Hz are usual.
LONGEST_STEP_S = 1.0
USUAL_RATES_HZ = (5.0, 5000.0)
TIME_UNITS = {"milliseconds": 1e-3, "microseconds": 1e-6, "nanoseconds": 1e-9}


def check_stamps(trajectory: Trajectory, source: str) -> None:
    """Refuse stamps whose steps no recording in seconds has.

    Raises:
        InputError: naming the unit that they seem to be in.
    """
    steps = np.diff(trajectory.times_s)
    step = float(np.median(steps)) if len(steps) else 0.0
    if step < LONGEST_STEP_S:
        return
    low, high = USUAL_RATES_HZ
    units = [name for name, s in TIME_UNITS.items() if low <= 1.0 / (step * s) <= high]
    guess = f"; as {units[0]} that is {1.0 / (step * TIME_UNITS[units[0]]):g} Hz" if units else ""
    raise InputError(
        f"{source}: its times step by {step:g} s, at which no swing can be followed{guess}: times "
        "are in seconds"
    )


def sound_samples(trajectory: Trajectory) -> Trajectory:
    """The trajectory without doubled, held and wild samples; what went is in its notes."""
    notes: list[str] = []
    between = interpolated(trajectory)
    if between is not None:
        rate = trajectory.sample_rate_hz
        trajectory = trajectory.take(~between)
        notes.append(
            f"{rate:g} Hz interpolated from {trajectory.sample_rate_hz:g} Hz: {between.sum()} "
            "samples lie on the line between their neighbours; they are left out"
        )
    doubled = _doubled(trajectory)
    if doubled is not None:
        rate = trajectory.sample_rate_hz
        trajectory = trajectory.take(doubled)
        notes.append(
            f"every sample stands {len(doubled) / doubled.sum():.2g} times: {rate:g} Hz of a "
            f"capture of {trajectory.sample_rate_hz:g} Hz; one of each is used"
        )
    values = np.array(trajectory.values)
    steps = _steps(values, trajectory.times_s, trajectory.coordinates)
    held = list(_held(trajectory))
    for first, last in held:
        values[first + 1 : last + 1] = np.nan
        length = trajectory.times_s[last] - trajectory.times_s[first]
        if not _stands_off(steps, first, last):
            notes.append(
                f"the same sample stands from {trajectory.times_s[first]:.2f} s on for "
                f"{length:.2f} s: the capture stalled; the repeats are left out"
            )
    again = repeated(values)
    if again.any():
        notes.append(
            f"{again.sum()} samples repeat the one before to the last digit, the first at "
            f"{trajectory.times_s[np.argmax(again)]:.2f} s: copies, which lag; they are left out"
        )
        values[again] = np.nan
    fills = [one for one in (*held, *_copied(again)) if _stands_off(steps, *one)]
    if fills:
        notes.append(
            f"{len(fills)} times a sample that stands far from those around is repeated, the first "
            f"time at {trajectory.times_s[fills[0][0]]:.2f} s: it fills a gap and is left out"
        )
    for first, _ in fills:
        values[first] = np.nan
    for first, last in _wild(values, trajectory.times_s, trajectory.coordinates):
        notes.append(f"{_wild_text(trajectory, values, first, last)} left out")
        values[first : last + 1] = np.nan
    if not notes:
        return trajectory
    return replace(trajectory, values=values, notes=(*trajectory.notes, *notes))


def _same(values: Array) -> Mask:
    """Whether a sample equals the one before to the last digit, (n_t - 1,)."""
    return np.asarray((values[1:] == values[:-1]).all(axis=1))


def _runs(flags: Mask) -> Iterator[tuple[int, int]]:
    """First and last sample of each stretch of equal ones."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    yield from zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)


def _doubled(trajectory: Trajectory) -> Mask | None:
    """Samples to keep where all are written several times, None where they are not."""
    same = _same(trajectory.values)
    if not len(same) or same.mean() < DOUBLED_SHARE or not _is_finer(trajectory.values, same):
        return None
    longest = max(last - first + 1 for first, last in _runs(same))
    return np.concatenate([[True], ~same]) if longest <= LONGEST_DOUBLE else None


def _held(trajectory: Trajectory) -> Iterator[tuple[int, int]]:
    same = _same(trajectory.values)
    if not _is_finer(trajectory.values, same):
        return
    for first, last in _runs(same):
        if last - first >= FEWEST_HELD:
            yield first, last


def _copied(again: Mask) -> Iterator[tuple[int, int]]:
    """First and last of each stretch of samples that are one sample and its copies."""
    for first, end in _runs(again):
        yield first - 1, end - 1


def _is_finer(values: Array, same: Mask) -> bool:
    """Whether numbers are written finer than neighbours differ, in any coordinate."""
    steps = np.abs(np.diff(values, axis=0))[~same]
    for column in steps.T:
        moved = column[column > 0.0]
        if len(moved) > FEWEST_HELD and np.median(moved) > ABOVE_RESOLUTION * moved.min():
            return True
    return False


def _wild(values: Array, times_s: Array, coordinates: tuple[str, ...]) -> list[tuple[int, int]]:
    """First and last of each few samples that lie far from those around them."""
    single = _single(values, times_s)
    rest = np.where(single[:, None], np.nan, values)
    steps, known = _steps(rest, times_s, coordinates), np.asarray(np.isfinite(rest).all(axis=1))
    found = [(k, k) for k in np.flatnonzero(single).tolist()]
    joined = known[1:] & known[:-1] & ~steps.any(axis=1)
    starts = np.flatnonzero(known & ~np.concatenate([[False], joined])).tolist()
    ends = np.flatnonzero(known & ~np.concatenate([joined, [False]])).tolist()
    for first, last in zip(starts, ends, strict=True):
        is_short = times_s[last] - times_s[first] <= LONGEST_WILD_S
        if is_short and _stands_off(steps, first, last):
            found.append((first, last))
    return sorted(found)


def _stands_off(steps: Array, first: int, last: int) -> bool:
    """Whether a step leads to these samples and one leads back; one at the recording's ends."""
    if first == 0 and last == len(steps):
        return False
    if first == 0:
        return bool(steps[last].any())
    if last == len(steps):
        return bool(steps[first - 1].any())
    there, back = steps[first - 1], steps[last]
    sizes = np.maximum(np.abs(there), np.abs(back))
    return bool(((np.abs(there + back) < BACK_WITHIN * sizes) & (sizes > 0.0)).any())


def _single(values: Array, times_s: Array) -> Mask:
    """Samples far from the line through their neighbours, (n_t,)."""
    wild = np.zeros(len(values), dtype=bool)
    if len(values) < 2 * FEWEST_HELD:
        return wild
    off = np.full(values.shape, np.nan)
    ahead = np.full(len(values), np.nan)  # how much of that line is the sample after
    off[1:-1], ahead[1:-1] = off_the_line(values, times_s)
    pulls = np.nan_to_num(ahead[:-2], nan=0.5), np.nan_to_num(1.0 - ahead[2:], nan=0.5)
    for column, printed in zip(off.T, _print_steps(values), strict=True):
        known = np.isfinite(column)
        if known.sum() < FEWEST_HELD:
            continue
        usual = NORMAL_BY_MAD * float(np.median(np.abs(column[known])))
        usual = max(usual, ROUNDED * printed)
        size = np.nan_to_num(np.abs(column))
        # It pulls both neighbours' lines by its part of how far it lies off, and no others do: half
        # where stamps are even.
        before, here, after = column[:-2], column[1:-1], column[2:]
        halves = [
            np.isnan(one) | (np.abs(one + part * here) < HALF_WITHIN * np.abs(here))
            for one, part in zip((before, after), pulls, strict=True)
        ]
        told = halves[0] & halves[1] & (np.isfinite(before) | np.isfinite(after))
        wild[1:-1] |= told & (size[1:-1] > WILD_DEVIATIONS * usual) & (usual > 0.0)
    return wild


def _print_steps(values: Array) -> Array:
    """The least by which neighbours differ: what numbers are written to, or above it, (n_c,)."""
    steps = np.abs(np.diff(values, axis=0))
    steps[~(steps > 0.0)] = np.inf
    least = steps.min(axis=0, initial=np.inf)
    return np.where(np.isfinite(least), least, 0.0)


def _steps(values: Array, times_s: Array, coordinates: tuple[str, ...]) -> Array:
    """Steps from one sample to the next beyond their neighbours', 0 where usual, (n_t - 1, n_c).

    Neighbours' steps count by how long they took: where frames were thrown away some are longer.
    """
    steps, took_s = np.diff(values, axis=0), np.diff(times_s)[:, None]
    if len(steps) < 2 * FEWEST_HELD:
        return np.zeros(steps.shape)
    padded = np.pad(steps / took_s, ((2, 2), (0, 0)), constant_values=np.nan)
    around = np.stack([padded[k : len(steps) + k] for k in (0, 1, 3, 4)]) * took_s
    beyond = np.nan_to_num(steps - around, nan=np.inf)  # of what a gap hides nothing is said
    nearest = np.abs(beyond).argmin(axis=0)
    off = np.take_along_axis(beyond, nearest[None], axis=0)[0]
    off[~np.isfinite(off)] = 0.0
    usual = NORMAL_BY_MAD * np.median(np.abs(off), axis=0)
    least = [LEAST_STEP_M if name in ("x", "y", "z") else LEAST_STEP_RAD for name in coordinates]
    limit = np.where(usual > 0.0, np.maximum(STEP_DEVIATIONS * usual, least), np.inf)
    longer = np.maximum(took_s / np.median(took_s), 1.0)
    return np.where(np.abs(off) > limit * longer**2, off, 0.0)  # accelerations bend it by squares


def _wild_text(trajectory: Trajectory, values: Array, first: int, last: int) -> str:
    """What is wrong with these samples; ends with the verb of what is done about it."""
    beside = [k for k in (first - 1, last + 1) if 0 <= k < len(values)]
    known = [k for k in beside if np.isfinite(values[k]).all()] or beside
    off = np.abs(values[first : last + 1].mean(axis=0) - values[known].mean(axis=0))
    column = int(np.argmax(np.nan_to_num(off)))
    name, times = trajectory.coordinates[column], trajectory.times_s
    unit = "mm" if name in ("x", "y", "z") else "mrad"
    size = f"{1e3 * off[column]:.1f} {unit} off"
    if first == last:
        return f"the sample at {times[first]:.2f} s is {size} its neighbours in {name}; it is"
    return (
        f"the samples from {times[first]:.2f} to {times[last]:.2f} s are {size} their neighbours "
        f"in {name}; they are"
    )
