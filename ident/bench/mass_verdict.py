"""The platform's mass as payload runs have it beside the declared one, and which of them serves."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.robot import Array
from freeswing.ident.bench.assemble import Assembled
from freeswing.ident.bench.runs import Bench
from freeswing.ident.bench.swing import BenchSwing
from freeswing.ident.likelihood.fit import Solution, fit
from freeswing.ident.likelihood.fit_blocks import Dense
from freeswing.ident.likelihood.unknowns import Gaussian, Unknowns

CONTRADICTED = 3.0  # standard deviations between what runs say and what is stated
GIVES_WAY = 0.01  # of the mass: stretch, or hooks that yield, by a hundredth of the wires' length
STRAINED = 2.0  # the same: by chance one session in twenty, so that what hangs on it counts
CHECKING = 0.05  # of the mass: payload runs that tell it as well check it, and what they say counts
# Of a declared mass of which nobody says how well it is known: hooks, a clamp or wires' ends that
# were not on the scale make a twentieth now and then, which is two deviations.
LEFT_OFF_THE_SCALE = 0.025


@dataclass(frozen=True, slots=True)
class MassVerdict:
    """The platform's mass by payload runs beside the declared one.

    Attributes:
        declared_kg: of the robot file.
        fitted_kg: by the runs alone.
        fitted_std_kg: its deviation.
        contradicted: whether they exclude each other: the fitted one then serves.
        stated: whether the file says how well the declared one is known.
    """

    declared_kg: float
    fitted_kg: float
    fitted_std_kg: float
    contradicted: bool
    stated: bool = False

    @property
    def is_small(self) -> bool:
        """Whether wires that stretch, or hooks that yield, could make runs want the other mass.

        Both make wires seem longer the more hangs on them; by a hundredth an eye sees it.
        """
        return abs(self.fitted_kg / self.declared_kg - 1.0) <= GIVES_WAY

    @property
    def strained(self) -> bool:
        """Whether runs speak against the declared mass, which serves, without excluding it."""
        off = abs(self.fitted_kg - self.declared_kg)
        return not self.contradicted and off > STRAINED * self.fitted_std_kg

    @property
    def shift_kg(self) -> float:
        """The declared mass over that of the runs where it counts in full, else 0.

        It does not where runs tell next to nothing of the mass and do not speak against the
        declared one either, or contradict it by more than wires and hooks that give way under a
        load could make of it.
        """
        checked = self.fitted_std_kg <= CHECKING * self.declared_kg
        counts = self.is_small if self.contradicted else checked or self.strained
        return self.declared_kg - self.fitted_kg if counts else 0.0

    @property
    def open_kg(self) -> float:
        """How far a declared mass that serves may be off beside that, nobody saying how well.

        By what runs leave open and by what a scale is usually not shown: normal densities multiply.

        Source:
            JCGM 100:2008, sec. 4.3.1: a deviation by general knowledge; Rasmussen, Williams 2006,
            Gaussian Processes for Machine Learning, eq. A.7: the product of normal densities.
        """
        if self.stated or self.contradicted:
            return 0.0
        usual = LEFT_OFF_THE_SCALE * self.declared_kg
        return usual * self.fitted_std_kg / float(np.hypot(usual, self.fitted_std_kg))

    @property
    def open_part(self) -> float:
        """What is open, of all that is counted of the mass; 0 where nothing is."""
        return self.open_kg / (float(np.hypot(self.shift_kg, self.open_kg)) or 1.0)


def weighed_mass(
    bench: Bench,
    model: Model,
    swings: tuple[BenchSwing, ...],
    found: Solution,
    start: Assembled,
    how: Dense,
) -> tuple[Solution, MassVerdict | None]:
    """The declared mass is taken where payload runs do not contradict it."""
    declared = model.robot.platform.mass_kg
    if declared is None or not any(run.payloads for run in start.runs):
        return found, None
    block = found.unknowns.block("platform")
    prior = block.prior
    if prior is None:
        return found, None
    spread = float(found.std("platform")[0])
    fitted, std = without_prior(float(block.value[0]), spread, prior, bench.mass_std_kg)
    off = abs(fitted - declared) / np.hypot(std, bench.mass_std_kg or 0.0)
    stated = bool(bench.mass_std_kg)
    verdict = MassVerdict(declared, fitted, std, bool(off > CONTRADICTED), stated)
    if verdict.contradicted:
        loose = np.array(prior.std)
        loose[0] = max(declared, 10.0 * std)
        freed = found.unknowns.known("platform", Gaussian(prior.mean, loose, prior.source))
        return (fit(swings, freed, how), verdict) if bench.mass_std_kg else (found, verdict)
    if bench.mass_std_kg:
        return found, verdict
    value: Array = np.array(block.value)
    value[4:] *= declared / value[0]  # what was seen is inertia over mass: it stays
    value[0] = declared
    estimated = np.array(block.mask)
    estimated[0] = False
    trusted = replace(block, value=value, estimated=estimated)
    held = Unknowns(
        tuple(trusted if one.name == "platform" else one for one in found.unknowns.blocks)
    )
    return fit(swings, held, how), verdict


def mass_left_free(unknowns: Unknowns, mass: MassVerdict) -> Unknowns:
    """The unknowns with the platform's mass to be found, and next to nothing believed of it.

    Source:
        JCGM 100:2008, sec. 4.3.1: a deviation by judgement of what is known.
    """
    block = unknowns.block("platform")
    wide, mean = np.full(block.size, np.inf), np.array(block.value)
    if block.prior is not None:
        wide, mean = np.array(block.prior.std), np.array(block.prior.mean)
    wide[0] = mass.declared_kg
    freed = unknowns.estimating("platform", np.arange(block.size) == 0)
    return freed.known("platform", Gaussian(mean, wide, "next to nothing known of the mass"))


def doubt(freed: Solution, mass: MassVerdict | None) -> Array:
    """By how much all shared unknowns would differ, were the mass off by all that it may be, (p,).

    Args:
        freed: the fit with the mass free.
        mass: what was made of it.

    Source:
        JCGM 100:2008, Guide to the Expression of Uncertainty in Measurement, sec. F.2.4.5: a
        correction that is not applied counts in full.
    """
    if mass is None or not (mass.shift_kg or mass.open_kg):
        return np.zeros(len(freed.covariance))
    place = int(freed.unknowns.columns("platform")[0])
    size = float(np.copysign(np.hypot(mass.shift_kg, mass.open_kg), mass.shift_kg))
    change = freed.covariance[:, place] / freed.covariance[place, place] * size
    # A mass that was fitted beside what is stated of it has its deviation already.
    change[place] = 0.0 if mass.stated and not mass.contradicted else size
    return np.asarray(change)


def without_prior(
    value: float, std: float, prior: Gaussian, stated: float | None
) -> tuple[float, float]:
    """Mass and deviation as the runs alone would have them: normal densities divide."""
    own = 1.0 / std**2 - 1.0 / float(prior.std[0]) ** 2
    if not stated or own <= 0.0:
        return value, std
    mean = (value / std**2 - float(prior.mean[0]) / float(prior.std[0]) ** 2) / own
    return mean, float(np.sqrt(1.0 / own))
