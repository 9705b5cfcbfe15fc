"""Frames that were lost while a camera's stamps were counted on, told by its own poses.

A recorder that drops frames and numbers the others hides the gap: the platform goes on farther in
one step than it can. What stretches of the same recording without a gap look like, as they are
and with frames left out on purpose, tells whether a step is one, and over how many frames.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.rotation import log_rotation
from freeswing.vision.rig.lag_search import OwnTrack
from freeswing.vision.rig.lost.kinks import is_kink, kink_unlikeliness
from freeswing.vision.rig.lost.usual_stretches import (
    FITS,
    NO_STEPS,
    Stretches,
    in_noise,
    strained_steps,
)

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

LEAST_FRAMES = 40
"""Of fewer frames no stretches are left beside a gap to compare it with."""
REGULAR = 0.07
"""Of a step: stamps farther from whole steps are no counter's; whole ms at 60 Hz are 0.06 off."""
MOSTLY = 0.9
"""Of all steps: the others may be gaps that ended between two counts."""
SURE = 16.0
"""Twice the logarithm of how much likelier a gap is than any other: with eight frames to each side
the truth was never this far behind, in 5,600 trials on samples/filmed."""
MOST_LOST = 20
"""A second of a slow camera: what is lost of more than a swing's period is told by no motion."""
_MOST_BESIDE = 8
"""Frames to each side that are looked at: three modes need seven numbers and more."""
_LEAST_BESIDE = 4
"""The same beside another such place, or near an end."""
_MOST_TWICE = 3
"""At two neighbouring places: a recorder that falls behind by more does so at once."""
_LEAST_CLUSTER = 5
"""Steps in a row that three losses strain: fewer are strained by two."""
_MOST_CLUSTER = 14
"""Of so many steps fifteen hundred ways are left, of more they take seconds."""


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
        kinks: indices of frames after which speeds change as after a knock or a release, or over
            lost frames that no motion counts: what came before meets what comes after.
    """

    losses: tuple[Loss, ...] = ()
    unclear: tuple[int, ...] = ()
    kinks: tuple[int, ...] = ()


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
    stamped = Stretches(numbers.copy(), in_noise(numbers, values), NO_STEPS)
    accepted: list[tuple[Told, list[int]]] = []
    settled: set[int] = set()
    while True:
        scaled = in_noise(numbers, values)
        groups = _groups(strained_steps(numbers, scaled) - settled)
        stretches = Stretches(numbers, scaled, _steps_of(groups))
        told = [_judged(stretches, group, groups) for group in groups]
        pairs = list(zip(told, groups, strict=True))
        sure = [(one, group) for one, group in pairs if one is not None and one.margin >= SURE]
        sure = sure or _hidden(numbers, scaled, groups, settled)
        if not sure:
            break
        accepted.append(max(sure, key=lambda one: one[0].margin))
        settled |= set(accepted[-1][1])
        for step, count in accepted[-1][0].steps:
            numbers[step + 1 :] += count
    broken = _steps_of([*groups, *(group for _, group in accepted)])
    kinked = partial(is_kink, Stretches(stamped.numbers, stamped.values, broken))
    held = _held(Stretches(numbers, scaled, NO_STEPS), [told for told, _ in accepted])
    return _with_untold(held, pairs, len(numbers), kinked)


def _held(closed: Stretches, accepted: list[Told]) -> Lost:
    """What was sure at its turn; without a count where it is not, now that all gaps are closed."""
    found = [Loss(step, (count,)) for told in accepted for step, count in told.steps]
    losses = [loss if _holds(closed, loss) else Loss(loss.after) for loss in found]
    unclear = {frame for told in accepted for frame in told.unclear}
    return Lost(tuple(losses), tuple(unclear))


def _with_untold(
    held: Lost,
    pairs: list[tuple[Told | None, list[int]]],
    count: int,
    kinked: Callable[[list[int]], bool],
) -> Lost:
    """The same with the places that strain the motion and of which nothing is sure."""
    losses, unclear, kinks = list(held.losses), set(held.unclear), []
    for told, group in pairs:
        if told is not None and 0 not in told.counts:
            if kinked(group):
                kinks.append(told.steps[0][0])
            else:
                losses.append(Loss(told.steps[0][0], told.counts))
    untold = [group for told, group in pairs if told is None or 0 in told.counts]
    for group in untold if losses else ():  # of one that lost frames, more is likely
        if group[0] < _LEAST_BESIDE:
            unclear |= set(range(group[-1] + 1))
        elif group[-1] >= count - 1 - _LEAST_BESIDE:
            unclear |= set(range(group[0] + 1, count))
        elif kinked(group):
            kinks.append(group[len(group) // 2])
        else:
            losses.append(Loss(group[len(group) // 2]))
    losses.sort(key=lambda loss: loss.after)
    return Lost(tuple(losses), tuple(sorted(unclear)), tuple(sorted(kinks)))


def _steps_of(groups: list[list[int]]) -> Ints:
    return np.array([step for one in groups for step in one], dtype=np.int64)


def _hidden(
    numbers: Ints, values: Array, groups: list[list[int]], settled: set[int]
) -> list[tuple[Told, list[int]]]:
    """Steps that strain no quintic, as of a slow swing, at which frames surely were lost."""
    reach = np.arange(-_MOST_BESIDE, _MOST_BESIDE + 1)
    broken = _steps_of(groups)
    steps = np.arange(_MOST_BESIDE - 1, len(numbers) - _MOST_BESIDE)
    steps = np.setdiff1d(steps, np.append((broken[:, None] + reach).ravel(), sorted(settled)))
    if not len(steps):
        return []
    stretches = Stretches(numbers, values, broken)
    for step in steps[_may_hide(stretches, steps)].tolist():
        own = sorted([*groups, [step]])
        whole = Stretches(numbers, values, np.append(broken, step))
        told = _judged(whole, [step], own)
        if told is not None and told.steps and told.margin >= SURE:
            return [(told, [step])]
    return []


def _may_hide(stretches: Stretches, steps: Ints) -> NDArray[np.bool_]:
    """Of steps (n,), those at which one or two lost frames are surely likelier than none.

    Source:
        Bishop 2006, Pattern Recognition and Machine Learning, sec. 3.4: odds of models.
    """
    rows = steps[:, None] + np.arange(-_MOST_BESIDE + 1, _MOST_BESIDE + 1)
    patterns = stretches.pattern(rows)
    count = stretches.values.shape[1]
    scores = np.full((3, len(steps)), np.inf)
    fits = np.full((3, len(steps)), np.inf)
    kinds, which = np.unique(patterns, axis=0, return_inverse=True)
    for kind, pattern in enumerate(kinds):
        own = np.flatnonzero(which.reshape(-1) == kind)
        for lost in range(3):
            usual = stretches.usual(pattern + lost * (np.arange(2 * _MOST_BESIDE) >= _MOST_BESIDE))
            if usual is not None:
                squares = usual.squares(stretches.values[rows[own]])
                scores[lost, own] = squares + count * usual.scale + 4.0 * np.log(max(lost, 1))
                fits[lost, own] = squares / (count * (rows.shape[1] - 1))
    best = scores.argmin(axis=0)
    own, fit = (np.take_along_axis(one, best[None], axis=0)[0] for one in (scores, fits))
    np.put_along_axis(scores, best[None], np.inf, axis=0)
    others = scores.min(axis=0)
    margin = np.subtract(others, own, out=np.zeros(len(steps)), where=np.isfinite(others))
    return (best > 0) & (fit <= FITS) & (margin >= SURE)


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


def _holds(stretches: Stretches, loss: Loss) -> bool:
    """Whether a gap fits once all are closed, and no other count does as well."""
    first = max(loss.after - _MOST_BESIDE + 1, 0)
    frames = np.arange(first, min(loss.after + _MOST_BESIDE + 1, len(stretches.numbers)))
    others = [((loss.after, count),) for count in range(-loss.frames[0], MOST_LOST) if count]
    told = likeliest(stretches, frames, [(), *others])
    return told is not None and told.steps == () and told.margin >= SURE


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
        score: minus twice the logarithm of how likely that is.
    """

    steps: Steps
    counts: tuple[int, ...]
    margin: float
    unclear: frozenset[int]
    score: float


def _judged(stretches: Stretches, group: list[int], groups: list[list[int]]) -> Told | None:
    """What was likeliest lost at a group's steps, by as many frames as tell; None where none do."""
    count = len(stretches.numbers)
    first, last = max(group[0] - 1, 0), min(group[-1] + 1, count - 2)
    ends = [0, *(g[-1] + 1 for g in groups if g[-1] < group[0])]
    starts = [*(g[0] for g in groups if g[0] > group[-1]), count - 1]
    most = min(_MOST_BESIDE, first - max(ends) + 1, min(starts) - last)
    steps = list(range(first, last + 1))  # one beside a turn may strain the next one more
    told = None
    for beside in range(most, _LEAST_BESIDE - 1, -1):
        frames = np.arange(first - beside + 1, last + beside + 1)
        found = likeliest(stretches, frames, ways_to_lose(steps))
        found = found and _beside_kinks(stretches, frames, found)
        if found is not None and is_far_from_ends(found, count):
            told = found if told is None or found.margin > told.margin else told
        if told is not None and told.margin >= SURE:
            break
    return told


def _beside_kinks(stretches: Stretches, frames: Ints, told: Told) -> Told:
    """The same, no surer than that frames were lost at one place and the platform not knocked."""
    if len(told.steps) != 1 or told.margin < SURE:
        return told
    margin = min(told.margin, kink_unlikeliness(stretches, frames) - told.score)
    counts = told.counts if margin >= SURE else (0, *told.counts)
    return replace(told, margin=margin, counts=counts)


def is_far_from_ends(told: Told, count: int) -> bool:
    """Whether as many frames as two stretches hold lie to both sides of a long gap.

    A release, or what else begins a recording, is held against its swing by few of its frames.
    """
    ends = 2 * _MOST_BESIDE
    return all(
        lost <= _MOST_TWICE or (ends <= step < count - ends and lost < MOST_LOST)
        for step, lost in told.steps
    )


def likeliest(stretches: Stretches, frames: Ints, ways: Iterable[Steps]) -> Told | None:
    """What was likeliest lost of some ways to lose frames; None where none that can be held fits.

    Args:
        stretches: of the recording, without a broken step.
        frames: indices of those that are held against others.
        ways: to lose frames.

    Source:
        Bishop 2006, Pattern Recognition and Machine Learning, sec. 3.4: odds of models.
    """
    unshifted = stretches.pattern(frames)
    scores: dict[Steps, float] = {}
    fits: dict[Steps, float] = {}
    for steps in ways:
        told = stretches.unlikeliness(frames, unshifted + _shift(frames, steps))
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
    return Told(best, counts, float(margin), unclear, float(scores[best]))


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
