"""What every bench fit takes for granted, taken away: drag, and wires that differ from each other.

Since `identify` has them always, a fit without them says whether they are there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from freeswing.cdpr.effects import effect_named
from freeswing.cdpr.robot import Array
from freeswing.ident.bench.assemble import EFFECTS
from freeswing.ident.bench.diagnose.causes import LENGTHS
from freeswing.ident.bench.diagnose.search import Ground
from freeswing.ident.bench.diagnose.weigh import Fit, needed
from freeswing.ident.bench.fit_rounds import FINE
from freeswing.ident.bench.priors.wire_priors import UNSTATED_LENGTH_STD_M
from freeswing.ident.bench.runs import Bench
from freeswing.ident.bench.told.report_objects import RESTS_ON_PRIOR
from freeswing.ident.diagnose.decision import ACCEPTED, LEAST_GAIN, MOST_WORSE, runs_worse
from freeswing.ident.likelihood.fit import fit
from freeswing.ident.likelihood.unknowns import Unknowns

SURE = 3.0  # deviations: a wire that differs by less is not the one, a rate below is no drag


@dataclass(frozen=True, slots=True)
class Removed:
    """One thing that is taken for granted, and what its absence costs.

    Attributes:
        effect: of the catalogue.
        blocks: of its unknowns.
        masks: which of each block's numbers are its own.
        accepted: whether the runs show that it is there.
        part: the one wire that it is of, or "".
        names: of its numbers.
        values: of them.
        stds: their deviations.
        chance: that it is there rather than nothing.
        gain: share of the left-out runs' excess that it takes away.
        delta_bic: BIC with it less BIC without.
        reason: a sentence.
        told: whether runs tell it at all, beyond what is stated.
    """

    effect: str
    blocks: tuple[str, ...]
    masks: tuple[Array, ...]
    accepted: bool = False
    part: str = ""
    names: tuple[str, ...] = ()
    values: tuple[float, ...] = ()
    stds: tuple[float, ...] = ()
    chance: float = 0.0
    gain: float = 0.0
    delta_bic: float = 0.0
    reason: str = ""
    told: bool = True

    def without(self, unknowns: Unknowns) -> Unknowns:
        """The unknowns with it held at nothing."""
        for name, mask in zip(self.blocks, self.masks, strict=True):
            block = unknowns.block(name)
            gone = replace(
                block, value=np.where(mask, 0.0, block.value), estimated=block.mask & ~mask
            )
            others = [gone if one.name == name else one for one in unknowns.blocks]
            unknowns = Unknowns(tuple(others))
        return unknowns


def removals(
    ground: Ground, last: Fit, bench: Bench, only: Sequence[str] | None
) -> tuple[Removed, ...]:
    """Drag in turning, drag in moving, and the wires' own lengths, each judged.

    Args:
        ground: of all fits.
        last: the fit that has them all.
        bench: the session.
        only: effects to consider; None for all.
    """
    found = []
    for one in _granted(last.solution.unknowns, last):
        if only is None or one.effect in only:
            found.append(_judged(ground, last, bench, one))
    return tuple(found)


def _granted(unknowns: Unknowns, last: Fit) -> list[Removed]:
    found, first = [], 0
    robot = last.swings[0].model.robot
    size = unknowns.block("effects").size
    for name in EFFECTS:
        parameters = effect_named(name).parameters(robot)
        mask = np.zeros(size, dtype=bool)
        mask[first] = True  # the rate; where it acts stays where it starts
        found.append(Removed(name, ("effects",), (mask,), names=(parameters[0].name,)))
        first += len(parameters)
    wires = tuple(dict.fromkeys(swing.wires for swing in last.swings))
    every = np.ones(robot.n_cables, dtype=bool)
    names = tuple(f"bias_{cable.name}_m" for cable in robot.cables)
    found.append(Removed(LENGTHS, wires, (every,) * len(wires), names=names))
    return found


def _judged(ground: Ground, last: Fit, bench: Bench, one: Removed) -> Removed:
    try:
        found = fit(last.swings, one.without(last.solution.unknowns), FINE)
    except (ValueError, np.linalg.LinAlgError) as error:
        return replace(one, reason=f"runs cannot be followed without it: {error}")
    without = Fit(last.swings, found, last.causes)
    each_run = one.blocks == ("effects",)
    counts = last.squares
    chance = needed(without, last, int(each_run))
    gains = without.score.surprise - last.score.surprise
    excess = float(without.score.surprise.sum() - counts.sum())
    more = len(counts) if each_run else len(one.names) * len(one.blocks)
    bic = last.solution.cost - without.solution.cost
    bic += 2.0 * more if each_run else more * float(np.log(counts.sum()))
    one = replace(
        one,
        chance=chance,
        gain=float(gains.sum()) / max(excess, LEAST_GAIN),
        delta_bic=float(bic),
    )
    one = _drag(ground, last, one) if each_run else _wires(last, one)
    worse = runs_worse(gains, without.score)
    allowed = 0.0 if each_run else _stated(bench)
    largest = max(abs(value) for value in one.values)
    reason, there = f"removes {100 * one.gain:.1f} % of the left-out runs' excess", False
    if not one.told:
        reason = "these runs tell no more of it than cable_lengths_std_m does"
    elif chance <= ACCEPTED:
        reason = f"not sure: with probability {chance:.2g} it is there rather than nothing"
    elif gains.sum() <= 0.0 or worse > MOST_WORSE * len(gains):
        reason = f"{worse} of {len(gains)} left-out runs are predicted worse with it"
    elif each_run and no_drag(one):
        reason = no_drag(one)
    elif largest <= allowed:
        reason = (
            f"wires differ by up to {1e3 * largest:.2g} mm, within what cable_lengths_std_m allows "
            f"({1e3 * allowed:.2g} mm): every fit counts it"
        )
    else:
        there = True
    return replace(one, accepted=there, reason=reason)


def no_drag(one: Removed) -> str:
    """Why a rate that each run has for itself is no drag; empty where it is one."""
    value, std = one.values[0], one.stds[0]
    if value <= 0.0:
        return f"its rate comes out negative ({value:.2g}): no drag"
    if value <= SURE * std:
        return f"its rate is {value:.2g} +- {std:.2g} over the runs: not told from nothing"
    return ""


def _stated(bench: Bench) -> float:
    stds = [run.lengths_std_m or UNSTATED_LENGTH_STD_M for run in bench.runs]
    return float(np.median(stds))


def _drag(ground: Ground, last: Fit, one: Removed) -> Removed:
    """Its rate for the platform alone, from all runs, each by what hangs in it."""
    place = int(np.argmax(one.masks[0]))
    rates = last.solution.value("effects")[:, place] * ground.shares
    std = float(np.std(rates, ddof=1) / np.sqrt(len(rates))) if len(rates) > 1 else np.inf
    return replace(one, values=(float(np.mean(rates)),), stds=(std,))


def _wires(last: Fit, one: Removed) -> Removed:
    """Each wire over what is told, the mean over all groups; which of them is the one, if any."""
    values = np.mean([last.solution.value(name) for name in one.blocks], axis=0)
    stds = np.sqrt(np.mean([last.solution.std(name) ** 2 for name in one.blocks], axis=0))
    off = np.abs(values) > SURE * stds
    part = ""
    if off.sum() == 1:
        part = last.swings[0].model.robot.cables[int(np.argmax(off))].name
    priors = [last.solution.unknowns.block(name).prior for name in one.blocks]
    stated = np.sqrt(np.mean([known.std**2 for known in priors if known is not None], axis=0))
    told = bool(np.any(stds**2 < RESTS_ON_PRIOR * stated**2))
    return replace(
        one, values=tuple(values.tolist()), stds=tuple(stds.tolist()), part=part, told=told
    )
