"""Two wires leave roll free, and roll pulls at yaw: yaw alone then tells most of every body.

What no run measures is held at first (`ident/bench/held_uncertain.py`). From there it is fitted, as
the numbers of a body that can be, from either side on which the platform's centre of mass may
lie: seen by yaw alone a bench and its mirror image look much alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.robot import Array, Robot
from freeswing.ident.bench.held_uncertain import Held
from freeswing.ident.bench.swing import BenchSwing
from freeswing.ident.likelihood.fit import Solution, fit
from freeswing.ident.likelihood.fit_blocks import Dense
from freeswing.ident.likelihood.unknowns import Gaussian, Unknown, Unknowns

MIDDLE_MOMENT = 0.8  # of Izz: half of it by width, the rest by height
WIDE_MOMENT = 1.0  # likewise: up to a cylinder twice as high as wide, or nearly a rod
LEAST_MOMENT = 0.02  # likewise: a rod of a seventh of its length
ASIDE = 0.5  # of what is believed of a centre of mass: where a start lies on either side
# A bent valley of mass, Iyy and products keeps steps short: the longest took 70 and 124 of them.
ROUGH = Dense(steps=150, tolerance=3.0)
FINE = Dense(steps=250, tolerance=0.1)


@dataclass(frozen=True, slots=True)
class Freed:
    """A fit of all that was held.

    Attributes:
        solution: the likeliest.
        first: its unknowns as they were before: what is believed of a body.
        between: covariance (p, p) of its shared unknowns by what else is nearly as likely.
    """

    solution: Solution
    first: Unknowns
    between: Array


def rolls_unseen(model: Model, held: Held, scaled: bool) -> bool:
    """Whether the platform is free to roll, and numbers are held that its roll would show.

    Args:
        model: of the bench.
        held: which are held, by block.
        scaled: whether a coordinate was measured: signals of unknown scale show too little, and
            freed with them an object ended 29 % off.
    """
    return scaled and model.robot.n_cables == 2 and any(m[1:].any() for m in held.values())


def not_freed_sentence(model: Model, held: Held, scaled: bool) -> str:
    """That numbers which roll would show are still held at a fit's end, and why; or nothing.

    Args:
        model: of the bench.
        held: which are held, by block, once all was fitted.
        scaled: whether a coordinate was measured.
    """
    if not rolls_unseen(model, held, scaled):
        return ""
    return (
        "what roll shows of bodies could not be fitted: no start led to a minimum. Centres of mass "
        "and moments beside Izz are held where they are believed, and deviations are wide for it: "
        "record one run with full poses"
    )


def unlevelled(swings: tuple[BenchSwing, ...], held: Held) -> tuple[BenchSwing, ...]:
    """The swings without what a level showed where centres of mass are held.

    Held centres cannot follow it: masses would, a platform's above all.
    """
    if not any(mask[1:4].any() for mask in held.values()):
        return swings
    known = [getattr(swing, "level_std_rad", None) for swing in swings]
    return tuple(
        swing if level is None else replace(swing, level_std_rad=None)
        for swing, level in zip(swings, known, strict=True)
    )


def levelled_as(
    swings: Sequence[BenchSwing], others: Sequence[BenchSwing]
) -> tuple[BenchSwing, ...]:
    """The swings with what a level showed of others."""
    both = zip(swings, others, strict=True)
    return tuple(replace(swing, level_std_rad=other.level_std_rad) for swing, other in both)


def freed(
    model: Model, swings: Sequence[BenchSwing], found: Unknowns, held: Held, first: Unknowns
) -> Freed | None:
    """Fit all that is held, from where the others came to lie.

    Args:
        model: of the bench.
        swings: with the noise of the fit so far.
        found: its unknowns.
        held: which are held, by block.
        first: the unknowns before any fit.

    Returns:
        None where no start led to a minimum.

    Source:
        Bishop 2006, Pattern Recognition and Machine Learning, sec. 4.4 and 2.3.9: each minimum a
        normal density, and their mixture.
    """
    for name, mask in held.items():
        believed = possible_body(found.block(name), mask)
        found = found.exchanged(believed).estimating(name, mask)
        first = first.known(name, believed.prior)
    ends = []
    for start in sides(model.robot, found):
        try:
            ends.append(fit(swings, start, ROUGH))
        except (ValueError, np.linalg.LinAlgError):
            continue
    ends = [one for one in ends if one.converged]
    if not ends:
        return None
    least = min(ends, key=lambda one: one.cost)
    best = fit(swings, least.unknowns, FINE)
    if not best.converged:
        return None
    others = [one for one in ends if one is not least]
    return Freed(best, first, between(best, others))


def possible_body(block: Unknown, held: Array) -> Unknown:
    """A body with what is believed of its held moments: by the one that yaw shows.

    Yaw shows the moment about the vertical, Izz; across, a body that has it may have anything from
    a rod's to a tower's, and never less than nothing.

    Args:
        block: of the body, as far as it is known.
        held: which of its ten numbers no run tells, (10,).

    Source:
        Featherstone 2008, Rigid Body Dynamics Algorithms, sec. 2.13: moments of a body are sums of
        two positive second moments each.
    """
    shown = block.value[4:7][~held[4:7]]
    if block.prior is None or not len(shown) or not held[4:7].any():
        return block
    moments = np.isin(np.arange(10), (4, 5, 6)) & held
    size = float(np.abs(shown).max())
    mean = np.where(moments, MIDDLE_MOMENT * size, block.prior.mean)
    std = np.where(moments, WIDE_MOMENT * size, block.prior.std)
    value = np.where(moments, MIDDLE_MOMENT * size, block.value)
    low = np.where(moments, LEAST_MOMENT * size, np.asarray(block.low))
    prior = Gaussian(mean, std, "a body that can be")
    return replace(block, value=value, prior=prior, low=low)


def held_possible(unknowns: Unknowns, held: Held) -> Unknowns:
    """Held moments with the spread of bodies that have the Izz found, about the held values.

    Roll pulls at yaw: beside two wires their first spread, twice a hoop through the wires, went
    through a straight line into most of what an object's Izz was said to be uncertain by.

    Args:
        unknowns: of a fit in which they were held.
        held: which are, by block.

    Source:
        JCGM 100:2008, sec. F.2.4.5: a known difference that is not corrected counts in full.
    """
    for name, mask in held.items():
        block = unknowns.block(name)
        prior, believed = block.prior, possible_body(block, mask).prior
        if prior is None or believed is None:
            continue
        changed = believed.std != prior.std
        off = np.where(changed, block.value - believed.mean, 0.0)
        spread = np.hypot(believed.std, off)
        unknowns = unknowns.known(name, Gaussian(believed.mean, spread, believed.source))
    return unknowns


def sides(robot: Robot, unknowns: Unknowns) -> list[Unknowns]:
    """The platform's centre of mass on either side of the line of the wires' lower ends."""
    block = unknowns.block("platform")
    if block.prior is None:
        return [unknowns]
    line = robot.attachments_m[1] - robot.attachments_m[0]
    across = np.cross(robot.gravity_m_s2, line)
    across = across / np.linalg.norm(across)
    step = ASIDE * np.linalg.norm(block.prior.std[1:4] * across) * across
    found = []
    for side in (-1.0, 1.0):
        value = np.array(block.value)
        value[1:4] += side * step
        found.append(unknowns.moved({"platform": value}))
    return found


def between(best: Solution, others: Sequence[Solution]) -> Array:
    """What other minima, each as likely as its cost says, add to the best one's covariance.

    Source:
        Bishop 2006, Pattern Recognition and Machine Learning, sec. 2.3.9: a mixture's spread.
    """
    here = _shared(best)
    added = np.zeros((len(here), len(here)))
    for other in others:
        odds = float(np.exp(-0.5 * max(other.cost - best.cost, 0.0)))
        off = _shared(other) - here
        added += odds / (1.0 + odds) * np.outer(off, off)
    return added


def _shared(solution: Solution) -> Array:
    return np.concatenate([block.value for block in solution.unknowns.shared])
