"""Frames that were lost while a camera's stamps were counted on, told by its own poses.

A recorder that drops frames and numbers the others hides the gap: the platform goes on farther in
one step than it can. What stretches of the same recording without a gap look like, as they are
and with frames left out on purpose, tells whether a step is one, and over how many frames.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.rotation import log_rotation
from freeswing.vision.rig.lag_search import OwnTrack

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

LEAST_FRAMES = 40
"""Of fewer frames no stretches are left beside a gap to compare it with."""
REGULAR = 0.07
"""Of a step: stamps farther from whole steps are no counter's; whole ms at 60 Hz are 0.06 off."""
MOSTLY = 0.9
"""Of all steps: the others may be gaps that ended between two counts."""
STRAINED = 6.5
"""Mean square of what eight frames leave of a quintic, in what they usually leave: of 850
stretches of samples/filmed 6.4 at most, with one frame lost inside 11 and more."""
AROUND = 2.0
"""All stretches about a gap leave so much, those beside it do not: one in twenty does by chance."""
SURE = 16.0
"""Twice the logarithm of how much likelier a gap is than any other: with eight frames to each side
the truth was never this far behind, in 5,600 trials on samples/filmed."""
FITS = 3.0
"""Mean square of a stretch in the usual ones' covariance; 2.4 at most where nothing was lost."""
MOST_LOST = 20
"""A second of a slow camera: what is lost of more than a swing's period is told by no motion."""
_MOST_BESIDE, _LEAST_BESIDE = 8, 4
"""Frames to each side that are looked at: three modes need seven numbers and more."""
_MOST_TWICE = 3
"""At two neighbouring places: a recorder that falls behind by more does so at once."""
_LEAST_CLUSTER, _MOST_CLUSTER = 5, 14
"""Steps in a row that three losses strain; of more a second and a half thousand ways are left."""
_LEAST_STRETCHES = 20
"""Six coordinates of so many stretches know the covariance of twenty numbers."""
_READING = 0.05
"""Of the noise's variance: few stretches make some combinations seem to vanish."""
_TOGETHER = 8
"""Frames that a quintic is held against: two numbers are left of each coordinate."""
_LONGEST = 12
"""Eight frames among which more are missing by the stamps are no smooth piece of a swing."""
_NORMAL_BY_MAD = 1.4826


@dataclass(frozen=True, slots=True)
class Loss:
    """Frames lost at one place.

    Attributes:
        after: index of the frame before them.
        frames: how many, each number that the motion allows: one where it is sure, none where
            nothing is told.
    """

    after: int
    frames: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Lost:
    """All that was lost of a recording.

    Attributes:
        losses: in order of time.
        unclear: indices of frames of which the motion does not tell on which side of one they are.
    """

    losses: tuple[Loss, ...] = ()
    unclear: tuple[int, ...] = ()


Steps = tuple[tuple[int, int], ...]
"""Frames lost: after which frame, and how many."""


def lost_frames(track: OwnTrack) -> Lost:
    """Where frames are missing without a gap in the stamps.

    What contradicts every count, a knock or a wrong pose, is none; nor is what might be no loss.

    Source:
        Bishop 2006, Pattern Recognition and Machine Learning, sec. 2.3: likelihoods of a Gaussian
        whose covariance is that of stretches without a gap.
    """
    numbers = counted(track.times_s)
    if numbers is None:
        return Lost()
    middle = track.rotations[len(track.rotations) // 2]
    values = np.hstack([track.positions_m, log_rotation(track.rotations @ middle.T)])
    found: list[Loss] = []
    settled: set[int] = set()
    unclear: set[int] = set()
    while True:
        scaled = _in_noise(numbers, values)
        groups = _groups(strained_steps(numbers, scaled) - settled)
        told = [_judged(numbers, scaled, group, groups) for group in groups]
        sure = [
            (one, group)
            for one, group in zip(told, groups, strict=True)
            if one is not None and one.margin >= SURE
        ]
        if not sure:
            sure = _hidden(numbers, scaled, groups, settled)
        if not sure:
            break
        best, group = max(sure, key=lambda one: one[0].margin)
        settled |= set(group)
        unclear |= best.unclear
        for step, count in best.steps:
            found.append(Loss(step, (count,)))
            numbers[step + 1 :] += count
    losses = [loss if _holds(numbers, scaled, loss) else Loss(loss.after) for loss in found]
    pairs = list(zip(groups, told, strict=True))
    losses += [
        Loss(t.steps[0][0], t.counts) for _, t in pairs if t is not None and 0 not in t.counts
    ]
    untold = [group for group, t in pairs if t is None or 0 in t.counts]
    for group in untold if losses else ():  # of one that lost frames, more is likely
        if group[0] < _LEAST_BESIDE:
            unclear |= set(range(group[-1] + 1))
        elif group[-1] >= len(numbers) - 1 - _LEAST_BESIDE:
            unclear |= set(range(group[0] + 1, len(numbers)))
        else:
            losses.append(Loss(group[len(group) // 2]))
    return Lost(tuple(sorted(losses, key=lambda loss: loss.after)), tuple(sorted(unclear)))


def _hidden(
    numbers: Ints, values: Array, groups: list[list[int]], settled: set[int]
) -> list[tuple[Told, list[int]]]:
    """Steps that strain no quintic, as of a slow swing, at which frames surely were lost."""
    near = {k for one in groups for k in range(one[0] - _MOST_BESIDE, one[-1] + _MOST_BESIDE + 1)}
    broken = np.array([step for one in groups for step in one], dtype=np.int64)
    for step in range(_MOST_BESIDE - 1, len(numbers) - _MOST_BESIDE):
        if step in near or step in settled:
            continue
        frames = np.arange(step - _MOST_BESIDE + 1, step + _MOST_BESIDE + 1)
        ways: list[Steps] = [(), ((step, 1),), ((step, 2),)]
        told = likeliest(numbers, values, frames, ways, broken)
        if told is not None and told.steps and told.margin >= SURE:
            told = _judged(numbers, values, [step], sorted([*groups, [step]]))
            if told is not None and told.steps and told.margin >= SURE:
                return [(told, [step])]
    return []


def counted(times_s: Array) -> Ints | None:
    """Frame numbers by stamps at whole steps, (n,); None where they are too few or at none.

    Source:
        Press et al. 2007, Numerical Recipes, sec. 14.1: the median, here of the steps.
    """
    if len(times_s) < LEAST_FRAMES:
        return None
    steps = np.diff(times_s) / np.median(np.diff(times_s))
    whole = np.maximum(np.round(steps), 1.0)
    if np.mean(np.abs(steps - whole) < REGULAR) < MOSTLY:
        return None
    return np.concatenate([[0.0], np.cumsum(whole)]).astype(np.int64)


def _holds(numbers: Ints, values: Array, loss: Loss) -> bool:
    """Whether a gap fits once all are closed, and no other count does as well."""
    first = max(loss.after - _MOST_BESIDE + 1, 0)
    frames = np.arange(first, min(loss.after + _MOST_BESIDE + 1, len(numbers)))
    others = [((loss.after, count),) for count in range(-loss.frames[0], MOST_LOST) if count]
    told = likeliest(numbers, values, frames, [(), *others], np.zeros(0, dtype=np.int64))
    return told is not None and told.steps == () and told.margin >= SURE


def _in_noise(numbers: Ints, values: Array) -> Array:
    """Coordinates (n, 6) about their mean, in what cubics through six frames leave of them."""
    pattern = np.arange(6)
    left = np.einsum("cp,bpx->bcx", _contrasts(pattern, 3), values[_stretches(numbers, pattern)])
    noise = _NORMAL_BY_MAD * np.median(np.abs(left), axis=(0, 1))
    return np.asarray((values - values.mean(axis=0)) / np.maximum(noise, 1e-12))


def _contrasts(pattern: Ints, degree: int) -> Array:
    """Unit combinations of samples at these times that polynomials leave alone, (c, n)."""
    x = 2.0 * (pattern - pattern[0]) / (pattern[-1] - pattern[0]) - 1.0
    q, _ = np.linalg.qr(np.vander(x, degree + 1), mode="complete")
    return np.asarray(q[:, degree + 1 :].T)


def _stretches(numbers: Ints, pattern: Ints) -> Ints:
    """Indices of frames that lie to each other as the pattern does, (stretches, len(pattern))."""
    place = np.full(int(numbers[-1]) + int(pattern[-1]) + 1, -1, dtype=np.int64)
    place[numbers] = np.arange(len(numbers))
    found = place[numbers[:, None] + pattern]
    return found[(found >= 0).all(axis=1)]


def strained_steps(numbers: Ints, values: Array) -> set[int]:
    """Frames after which every stretch over the step is strained.

    Args:
        numbers: of the frames, as far as is known, rising, (n,).
        values: of all coordinates, (n, m).

    Source:
        Rousseeuw, Croux 1993, Alternatives to the median absolute deviation, for the scale.
    """
    least, most = np.full(len(values), np.inf), np.zeros(len(values))
    rows = np.arange(len(numbers) - _TOGETHER + 1)[:, None] + np.arange(_TOGETHER)
    patterns = numbers[rows] - numbers[rows[:, :1]]
    for pattern in np.unique(patterns, axis=0):
        alike = _stretches(numbers, pattern)
        if pattern[-1] > _LONGEST or len(alike) < _LEAST_STRETCHES:
            continue
        contrasts = _contrasts(pattern, 5)
        left = np.einsum("cp,bpx->bcx", contrasts, values[alike])
        usual = np.maximum(_NORMAL_BY_MAD * np.median(np.abs(left), axis=0), 1e-12)
        own = rows[(patterns == pattern).all(axis=1)]
        scaled = np.einsum("cp,bpx->bcx", contrasts, values[own]) / usual
        strain = np.mean(scaled**2, axis=(1, 2))
        for place in range(1, _TOGETHER - 2):  # two frames at least to each side of the step
            np.minimum.at(least, own[:, place], strain)
            np.maximum.at(most, own[:, place], strain)
    return set(np.flatnonzero(is_strained(least, most)).tolist())


def is_strained(least: Array, most: Array) -> NDArray[np.bool_]:
    """Steps by the least and the most that stretches over them leave, (n,).

    Source:
        Press et al. 2007, Numerical Recipes, sec. 15.1: mean squares in their usual size.
    """
    return (most > STRAINED) & (least > AROUND) & np.isfinite(least)


def _groups(steps: set[int]) -> list[list[int]]:
    """Steps so near to each other that no stretch lies between them, together."""
    groups: list[list[int]] = []
    for step in sorted(steps):
        if groups and step < groups[-1][-1] + _LEAST_BESIDE:
            groups[-1].append(step)
        else:
            groups.append([step])
    return groups


@dataclass(frozen=True, slots=True)
class Told:
    """What is said of neighbouring steps, some of which strain the motion.

    Attributes:
        steps: what is likeliest lost.
        counts: frames lost in all that are nearly as likely.
        margin: by how much likelier that number is than any other, twice the logarithm.
        unclear: frames that may be on either side of a loss.
    """

    steps: Steps
    counts: tuple[int, ...]
    margin: float
    unclear: frozenset[int]


def _judged(numbers: Ints, values: Array, group: list[int], groups: list[list[int]]) -> Told | None:
    """What was likeliest lost at a group's steps, by as many frames as tell; None where none do."""
    first, last = max(group[0] - 1, 0), min(group[-1] + 1, len(numbers) - 2)
    ends = [0, *(g[-1] + 1 for g in groups if g[-1] < group[0])]
    starts = [*(g[0] for g in groups if g[0] > group[-1]), len(numbers) - 1]
    most = min(_MOST_BESIDE, first - max(ends) + 1, min(starts) - last)
    broken = np.array([step for one in groups for step in one])
    steps = list(range(first, last + 1))  # one beside a turn may strain the next one more
    told = None
    for beside in range(most, _LEAST_BESIDE - 1, -1):
        frames = np.arange(first - beside + 1, last + beside + 1)
        found = likeliest(numbers, values, frames, ways_to_lose(steps), broken)
        if found is not None and _is_far_from_ends(found, len(numbers)):
            told = found if told is None or found.margin > told.margin else told
        if told is not None and told.margin >= SURE:
            break
    return told


def _is_far_from_ends(told: Told, count: int) -> bool:
    """Whether as many frames as two stretches hold lie to both sides of a long gap.

    A release, or what else begins a recording, is held against its swing by few of its frames.
    """
    ends = 2 * _MOST_BESIDE
    return all(
        lost <= _MOST_TWICE or (ends <= step < count - ends and lost < MOST_LOST)
        for step, lost in told.steps
    )


def likeliest(
    numbers: Ints, values: Array, frames: Ints, ways: Iterable[Steps], broken: Ints
) -> Told | None:
    """What was likeliest lost of some ways to lose frames; None where none that can be held fits.

    Args:
        numbers: of all frames, as far as is known, (n,).
        values: of all coordinates, (n, m).
        frames: indices of those that are held against others.
        ways: to lose frames.
        broken: steps that no other stretch may hold.

    Source:
        Bishop 2006, Pattern Recognition and Machine Learning, sec. 3.4: odds of models.
    """
    scores: dict[Steps, float] = {}
    fits: dict[Steps, float] = {}
    for steps in ways:
        pattern = numbers[frames] - numbers[frames[0]] + _shift(frames, steps)
        told = unlikeliness(numbers, values, frames, pattern, broken)
        if told is not None:
            rare = sum(4.0 * np.log(max(abs(count), 1)) for _, count in steps)
            scores[steps], fits[steps] = told[0] + rare, told[1]
    if not any(scores):
        return None
    best = min(scores, key=lambda steps: scores[steps])
    if fits[best] > FITS:
        return None
    own = _total(best)
    near = [steps for steps, score in scores.items() if score < scores[best] + SURE]
    others = [score for steps, score in scores.items() if _total(steps) != own]
    margin = min(others, default=scores[best]) - scores[best]
    shifts = np.array([_shift(frames, steps) for steps in near if _total(steps) == own])
    unclear = frozenset(frames[np.ptp(shifts, axis=0) > 0].tolist())
    counts = tuple(sorted({_total(steps) for steps in near}))
    return Told(best, counts, float(margin), unclear)


def ways_to_lose(group: list[int]) -> Iterator[Steps]:
    """Every way to lose frames at one step of a group, a few at two, or one each at three."""
    yield ()
    for step in group:
        for count in range(1, MOST_LOST + 1):
            yield ((step, count),)
    if _LEAST_CLUSTER <= len(group) <= _MOST_CLUSTER:
        for three in combinations(group, 3):
            yield tuple((step, 1) for step in three)
    for one, other in combinations(group, 2):
        for counts in product(range(1, _MOST_TWICE + 1), repeat=2):
            yield ((one, counts[0]), (other, counts[1]))


def _total(steps: Steps) -> int:
    return sum(count for _, count in steps)


def _shift(frames: Ints, steps: Steps) -> Ints:
    """By how many frames the numbers of frames are too small."""
    return sum((count * (frames > step) for step, count in steps), np.zeros_like(frames))


def unlikeliness(
    numbers: Ints, values: Array, frames: Ints, pattern: Ints, broken: Ints
) -> tuple[float, float] | None:
    """Minus twice the log likelihood of frames that lie to each other so, and mean square a number.

    None where too few stretches without a broken step have that pattern.

    Source:
        Bishop 2006, Pattern Recognition and Machine Learning, sec. 2.3: a Gaussian's likelihood.
    """
    rows = _stretches(numbers, pattern)
    if len(broken):
        inside = (rows[:, :1] <= broken) & (broken < rows[:, -1:])
        rows = rows[~inside.any(axis=1)]
    if len(rows) < _LEAST_STRETCHES:
        return None
    base = _contrasts(np.arange(len(pattern)), 0)  # where the platform hangs tells nothing
    seen = np.einsum("cp,bpx->bcx", base, values[rows])
    covariance = np.einsum("bcx,bdx->cd", seen, seen) / (len(rows) * values.shape[1])
    covariance += _READING * np.eye(len(base))
    own = base @ values[frames]
    square = float(np.sum(own * np.linalg.solve(covariance, own)))
    scale = float(np.linalg.slogdet(covariance)[1])
    return square + values.shape[1] * scale, square / own.size
