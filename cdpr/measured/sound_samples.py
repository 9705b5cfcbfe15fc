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
    doubled = _doubled(trajectory)
    notes: list[str] = []
    if doubled is not None:
        rate = trajectory.sample_rate_hz
        trajectory = trajectory.take(doubled)
        notes.append(
            f"every sample stands {len(doubled) / doubled.sum():.2g} times: {rate:g} Hz of a "
            f"capture of {trajectory.sample_rate_hz:g} Hz; one of each is used"
        )
    values = np.array(trajectory.values)
    for first, last in _held(trajectory):
        length = trajectory.times_s[last] - trajectory.times_s[first]
        notes.append(
            f"the same sample stands from {trajectory.times_s[first]:.2f} s on for {length:.2f} s: "
            "the capture stalled; the repeats are left out"
        )
        values[first + 1 : last + 1] = np.nan
    wild = _wild(values)
    for k in np.flatnonzero(wild.any(axis=1)):
        notes.append(f"{_wild_text(trajectory, values, wild, int(k))}; it is left out")
    values[wild.any(axis=1)] = np.nan
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


def _is_finer(values: Array, same: Mask) -> bool:
    """Whether numbers are written finer than neighbours differ, in any coordinate."""
    steps = np.abs(np.diff(values, axis=0))[~same]
    for column in steps.T:
        moved = column[column > 0.0]
        if len(moved) > FEWEST_HELD and np.median(moved) > ABOVE_RESOLUTION * moved.min():
            return True
    return False


def _wild(values: Array) -> Mask:
    """Single samples far from the middle of their neighbours, (n_t, n_c)."""
    wild = np.zeros(values.shape, dtype=bool)
    if len(values) < 2 * FEWEST_HELD:
        return wild
    off = np.full(values.shape, np.nan)
    off[1:-1] = values[1:-1] - 0.5 * (values[2:] + values[:-2])
    for k, column in enumerate(off.T):
        known = np.isfinite(column)
        if known.sum() < FEWEST_HELD:
            continue
        usual = NORMAL_BY_MAD * float(np.median(np.abs(column[known])))
        size = np.nan_to_num(np.abs(column))
        peak = (size[1:-1] > size[2:]) & (size[1:-1] > size[:-2])
        wild[1:-1, k] = peak & (size[1:-1] > WILD_DEVIATIONS * usual) & (usual > 0.0)
    return wild


def _wild_text(trajectory: Trajectory, values: Array, wild: Mask, k: int) -> str:
    off = np.abs(values[k] - 0.5 * (values[k + 1] + values[k - 1]))
    column = int(np.flatnonzero(wild[k])[0])
    name = trajectory.coordinates[column]
    unit = "mm" if name in ("x", "y", "z") else "mrad"
    time = trajectory.times_s[k]
    return (
        f"the sample at {time:.2f} s is {1e3 * off[column]:.1f} {unit} off its neighbours in {name}"
    )
