"""The rounds of a bench fit: rough, noise, colour, scatter, then the wires and the mass."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.model.statics import Equilibrium, modes
from freeswing.cdpr.robot import Array
from freeswing.ident.bench.assemble import Assembled
from freeswing.ident.bench.held_uncertain import Held, considered, gauge, holding, sees_sway, unseen
from freeswing.ident.bench.mass_verdict import CONTRADICTED, MassVerdict, doubt, weighed_mass
from freeswing.ident.bench.noise import left_worst, rescaled
from freeswing.ident.bench.objects import moments, specific
from freeswing.ident.bench.priors.wire_priors import UNSTATED_LENGTH_STD_M
from freeswing.ident.bench.runs import Bench
from freeswing.ident.bench.scatter_between_runs import WIDE_SCATTER, scatter_block, scatter_std
from freeswing.ident.bench.swing import COMMON, IZZ, BenchSwing
from freeswing.ident.bench.two_wires.free_roll import (
    freed,
    held_possible,
    levelled_as,
    rolls_unseen,
    unlevelled,
)
from freeswing.ident.likelihood.fit import Solution, fit
from freeswing.ident.likelihood.fit_blocks import Dense
from freeswing.ident.likelihood.unknowns import Unknowns

FIRST_S = 12.0  # of long runs: a guess from half of it still counts their swings right
LONGER = 3.0  # each next stretch: a fit of one knows its frequency to far less than a third
FEW = 1.5  # swings of a pendulum as long as the wires: a roll a third off is half of one off then
ROUGH = Dense(steps=30, tolerance=3.0)
FINE = Dense(steps=60, tolerance=0.1)
LEAST_FOR_SCATTER = 5  # runs: fewer cannot tell scatter from what is looked for


@dataclass(frozen=True, slots=True)
class WiresVerdict:
    """What sway says of all wires' length beside what is stated.

    Attributes:
        stated_m: mean of the stated lengths.
        shift_m: longer (or, negative, shorter) by so much, as sway has them.
        std_m: its deviation.
        allowed_m: how well the stated lengths are known, on the average of the wires.
        contradicted: whether they exclude each other: sway's length then serves.
    """

    stated_m: float
    shift_m: float
    std_m: float
    allowed_m: float
    contradicted: bool


@dataclass(frozen=True, slots=True)
class Solved:
    """A bench fit.

    Attributes:
        solution: all unknowns, their covariance with all that is held uncertain.
        swings: with the noise that was found.
        first: the unknowns before, whose priors say what rests on nothing else.
        scatter_std: of Izz between runs, kg m2; 0: none was seen.
        mass: what payload runs say of the mass, or None without one.
        wires: what sway says of the wires, or None where no column shows sway.
        held: what no run tells, by block.
        fastest_hz: highest frequency of the first run's small oscillations.
        doubts: what each shared block would change by, were it the other mass.
        held_scatter: covariance of what held numbers add to the runs' scatter, (r, r), or None
            without one.
    """

    solution: Solution
    swings: tuple[BenchSwing, ...]
    first: Unknowns
    scatter_std: float
    mass: MassVerdict | None
    wires: WiresVerdict | None = None
    held: Held = field(default_factory=dict)
    fastest_hz: float = 1.0
    doubts: Mapping[str, Array] = field(default_factory=dict)
    held_scatter: Array | None = None


def solved(model: Model, bench: Bench, start: Assembled) -> Solved:
    """Fit a bench session.

    Raises:
        ValueError: when a run's start cannot be simulated, naming it.
    """
    held = unseen(bench, start.runs, start.unknowns)
    swings = unlevelled(start.swings, held)
    unknowns = holding(start.unknowns, held)
    unknowns = holding(unknowns, gauge(bench, start.runs, unknowns))
    sway = sees_sway(bench, start.runs)
    unknowns = _rough(swings, unknowns.held(COMMON))
    if sway:
        unknowns = unknowns.estimating(COMMON, np.ones(1, bool))
    scattering = len(swings) >= LEAST_FOR_SCATTER
    izz = float(moments(unknowns.block("platform").value)[IZZ])
    if scattering:  # from the start, or the noise would be taken for as large as the scatter
        unknowns = unknowns.joined(scatter_block(len(swings), izz, WIDE_SCATTER * izz))
    found = first_fit(swings, unknowns)
    fastest_hz = _fastest(model, found, swings[0])
    swings = rescaled(swings, found, fastest_hz, coloured=True)
    found = fit(swings, found.unknowns, FINE)
    swings = rescaled(swings, found, fastest_hz, coloured=True)
    first, more = start.unknowns, None
    if rolls_unseen(model, held, any(run.coordinates for run in start.runs)):
        levelled = levelled_as(swings, start.swings)
        more = freed(model, levelled, _without_scatter(found.unknowns), held, first)
        swings = swings if more is None else levelled
    if more is not None:
        held, first = {}, more.first
        swings = rescaled(swings, more.solution, fastest_hz, coloured=True)
        known = more.solution.unknowns
        if scattering:
            known = known.joined(scatter_block(len(swings), izz, WIDE_SCATTER * izz))
        found = fit(swings, known, FINE)
    tau, kept = 0.0, found.unknowns
    if scattering:
        tau = scatter_std(found)
        kept = kept.without("scatter")
        kept = kept.joined(scatter_block(len(swings), izz, tau)) if tau > 0.0 else kept
    found = fit(swings, kept, FINE)
    wires = _wires(found, start) if sway else None
    if wires is not None and not wires.contradicted:
        found = fit(swings, _pinned(found.unknowns, COMMON), FINE)
    unweighed = found
    found, mass = weighed_mass(bench, model, swings, found, start, FINE)
    change = doubt(unweighed, mass)
    right = _who_is_right(found, wires) + np.outer(change, change)
    if model.robot.n_cables == 2:
        found = replace(found, unknowns=held_possible(found.unknowns, held))
        for name in held:
            first = first.known(name, found.unknowns.block(name).prior)
    alone = found
    found = considered(swings, found, held)
    held_scatter = None
    if "scatter" in found.unknowns:
        held_scatter = found.covariance_of("scatter") - alone.covariance_of("scatter")
    if more is not None:
        right = right + _padded(more.between, len(right))
    found = replace(found, covariance=found.covariance + right)
    names = (block.name for block in unweighed.unknowns.shared)
    doubts = {name: change[unweighed.unknowns.columns(name)] for name in names}
    return Solved(found, swings, first, tau, mass, wires, held, fastest_hz, doubts, held_scatter)


def first_fit(swings: tuple[BenchSwing, ...], unknowns: Unknowns) -> Solution:
    """The first fit of whole runs; where it is lost, the better one of two.

    A guess knows yaw's swing. How fast the platform rolls beside it, two wires hardly tell
    beforehand: taken for a third faster it has lost count of a run of ten seconds, and the fit
    found its bodies there, the largest moment 9 % off, without a doubt.
    """
    found = fit(swings, stretched(swings, unknowns, FIRST_S), ROUGH)
    if left_worst(swings, found) is None:
        return found
    lengths = [float(np.mean(swing.lengths_m)) for swing in swings]
    gravity = float(np.linalg.norm(swings[0].model.robot.gravity_m_s2))
    few_s = FEW * 2.0 * np.pi * np.sqrt(max(lengths) / gravity)
    try:
        again = fit(swings, stretched(swings, unknowns, few_s), ROUGH)
    except (ValueError, np.linalg.LinAlgError):  # no motion from where a stretch led to
        return found
    return again if again.cost < found.cost else found


def stretched(swings: tuple[BenchSwing, ...], unknowns: Unknowns, first_s: float) -> Unknowns:
    """The unknowns once growing stretches of the runs have been followed, all but the last.

    A guess that is right to a percent loses count of the swings of a minute.
    """
    longest = max(swing.span_s[1] - swing.span_s[0] for swing in swings)
    span = first_s
    while span < longest:
        parts = [swing.until(swing.span_s[0] + span) for swing in swings]
        unknowns = fit(parts, unknowns, ROUGH).unknowns
        span *= LONGER
    return unknowns


def _without_scatter(unknowns: Unknowns) -> Unknowns:
    return unknowns.without("scatter") if "scatter" in unknowns else unknowns


def _padded(covariance: Array, size: int) -> Array:
    """A covariance of the first unknowns as one of all: scatter stands last."""
    found = np.zeros((size, size))
    found[: len(covariance), : len(covariance)] = covariance
    return found


def _wires(found: Solution, start: Assembled) -> WiresVerdict:
    """Whether the sway wants wires of other lengths than those that are stated."""
    shift, std = float(found.value(COMMON)[0]), float(found.std(COMMON)[0])
    lengths = np.array([swing.lengths_m for swing in start.swings])
    stds = [run.lengths_std_m or UNSTATED_LENGTH_STD_M for run in start.runs]
    allowed = float(np.mean(stds)) / float(np.sqrt(lengths.shape[1]))
    off = abs(shift) / std  # the stated spread is in it: each wire's own shift is an unknown too
    return WiresVerdict(float(lengths.mean()), shift, std, allowed, bool(off > CONTRADICTED))


def _pinned(unknowns: Unknowns, name: str) -> Unknowns:
    """A block held at zero: what it was there for is not the case."""
    return unknowns.moved({name: 0.0 * unknowns.block(name).value}).held(name)


def _who_is_right(found: Solution, wires: WiresVerdict | None) -> Array:
    """Where sway contradicts the wires: what a deviation counts for all that hangs on it."""
    if wires is None or not wires.contradicted:
        return np.zeros_like(found.covariance)
    place = found.place(COMMON)
    column = found.covariance[:, place]
    change = column / found.covariance[place, place] * wires.shift_m
    return np.asarray(change @ change.T)


def _rough(swings: tuple[BenchSwing, ...], unknowns: Unknowns) -> Unknowns:
    """A first fit in which channels are straight: squares and cubes follow when all is near."""
    bent = {}
    for swing in swings:
        for column in swing.columns:
            if column.channel is not None and column.channel.order > 1:
                name = f"channel.{column.channel.name}"
                block = unknowns.block(name)
                straight = np.arange(block.size) < len(column.channel.coordinates)
                bent[name] = replace(block, estimated=block.mask & straight)
    if not bent:
        return unknowns
    held = Unknowns(tuple(bent.get(block.name, block) for block in unknowns.blocks))
    parts = [swing.until(swing.span_s[0] + FIRST_S) for swing in swings]
    found = fit(parts, held, ROUGH).unknowns
    return unknowns.moved({block.name: block.value for block in found.blocks})


def _fastest(model: Model, found: Solution, swing: BenchSwing) -> float:
    inertia = specific(swing.total(found.unknowns.of_run(0)))
    rest = Equilibrium(swing.rest, swing.lengths_m, np.zeros(model.robot.n_cables), True, True)
    try:
        return float(modes(model, rest, inertia).frequencies_hz.max())
    except (ValueError, np.linalg.LinAlgError):
        return 1.0
