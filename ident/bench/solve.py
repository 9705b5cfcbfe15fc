"""The rounds of a bench fit: rough, noise, colour, scatter, and whether the mass is believed."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.model.statics import Equilibrium, modes
from freeswing.cdpr.robot import Array
from freeswing.ident.bench.assemble import Assembled
from freeswing.ident.bench.noise import WIDE_SCATTER, rescaled, scatter_block, scatter_std
from freeswing.ident.bench.objects import moments, specific
from freeswing.ident.bench.runs import Bench
from freeswing.ident.bench.swing import IZZ, BenchSwing
from freeswing.ident.likelihood.fit_blocks import How, Solution, fit
from freeswing.ident.likelihood.unknowns import Gaussian, Unknowns

ROUGH = How(steps=30, tolerance=3.0)
FINE = How(steps=12, tolerance=0.1)
LEAST_FOR_SCATTER = 5  # runs: fewer cannot tell scatter from what is looked for
CONTRADICTED = 3.0  # standard deviations between payload runs and the declared mass
FIRST_SCATTER = 0.002  # of Izz, where too few runs tell: what rehanging a bench costs at its best


@dataclass(frozen=True, slots=True)
class MassVerdict:
    """The platform's mass by payload runs beside the declared one.

    Attributes:
        declared_kg: of the robot file.
        fitted_kg: by the runs alone.
        fitted_std_kg: its deviation.
        contradicted: whether they exclude each other: the fitted one then serves.
    """

    declared_kg: float
    fitted_kg: float
    fitted_std_kg: float
    contradicted: bool


@dataclass(frozen=True, slots=True)
class Solved:
    """A bench fit.

    Attributes:
        solution: all unknowns.
        swings: with the noise that was found.
        first: the unknowns before, whose priors say what rests on nothing else.
        scatter_std: of Izz between runs, kg m2; 0: none was seen.
        mass: what payload runs say of the mass, or None without one.
    """

    solution: Solution
    swings: tuple[BenchSwing, ...]
    first: Unknowns
    scatter_std: float
    mass: MassVerdict | None


def solved(model: Model, bench: Bench, start: Assembled) -> Solved:
    """Fit a bench session.

    Raises:
        ValueError: when a run's start cannot be simulated, naming it.
    """
    swings, unknowns = start.swings, start.unknowns
    unknowns = _rough(swings, unknowns)
    found = fit(swings, unknowns, ROUGH)
    fastest = _fastest(model, found, swings[0])
    for coloured in (False, True):
        swings = rescaled(swings, found, fastest, coloured)
        found = fit(swings, found.unknowns, FINE)
    izz = float(moments(found.value("platform"))[IZZ])
    tau = 0.0
    if len(swings) >= LEAST_FOR_SCATTER:
        wide = scatter_block(len(swings), izz, WIDE_SCATTER * izz)
        tau = scatter_std(fit(swings, found.unknowns.joined(wide), How(steps=3, tolerance=0.1)))
        if tau > 0.0:
            narrow = scatter_block(len(swings), izz, tau)
            found = fit(swings, found.unknowns.joined(narrow), FINE)
    found, mass = _mass(bench, model, swings, found, start)
    return Solved(found, swings, start.unknowns, tau, mass)


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
    found = fit(swings, held, ROUGH).unknowns
    return unknowns.moved({block.name: block.value for block in found.blocks})


def _fastest(model: Model, found: Solution, swing: BenchSwing) -> float:
    inertia = specific(swing.total(found.unknowns.of_run(0)))
    rest = Equilibrium(swing.rest, swing.lengths_m, np.zeros(model.robot.n_cables), True, True)
    try:
        return float(modes(model, rest, inertia).frequencies_hz.max())
    except (ValueError, np.linalg.LinAlgError):
        return 1.0


def _mass(
    bench: Bench,
    model: Model,
    swings: tuple[BenchSwing, ...],
    found: Solution,
    start: Assembled,
) -> tuple[Solution, MassVerdict | None]:
    """The declared mass is taken where payload runs do not contradict it."""
    declared = model.robot.platform.mass_kg
    if declared is None or not any(run.payloads for run in start.runs):
        return found, None
    block = found.unknowns.block("platform")
    prior = block.prior
    if prior is None:
        return found, None
    fitted, std = _without_prior(
        float(block.value[0]), float(found.std("platform")[0]), prior, bench.mass_std_kg
    )
    off = abs(fitted - declared) / np.hypot(std, bench.mass_std_kg or 0.0)
    verdict = MassVerdict(declared, fitted, std, bool(off > CONTRADICTED))
    if verdict.contradicted:
        loose = np.array(prior.std)
        loose[0] = max(declared, 10.0 * std)
        freed = found.unknowns.known("platform", Gaussian(prior.mean, loose, prior.source))
        return (fit(swings, freed, FINE), verdict) if bench.mass_std_kg else (found, verdict)
    if bench.mass_std_kg:
        return found, verdict
    value: Array = np.array(block.value)
    value[0] = declared
    estimated = np.array(block.mask)
    estimated[0] = False
    trusted = replace(block, value=value, estimated=estimated)
    held = Unknowns(
        tuple(trusted if one.name == "platform" else one for one in found.unknowns.blocks)
    )
    return fit(swings, held, FINE), verdict


def _without_prior(
    value: float, std: float, prior: Gaussian, stated: float | None
) -> tuple[float, float]:
    """Mass and deviation as the runs alone would have them."""
    own = 1.0 / std**2 - 1.0 / float(prior.std[0]) ** 2
    if not stated or own <= 0.0:
        return value, std
    mean = (value / std**2 - float(prior.mean[0]) / float(prior.std[0]) ** 2) / own
    return mean, float(np.sqrt(1.0 / own))
