"""Which parts of the geometry are grossly wrong, by the constancy of lengths, and how surely.

Stretch and creep change lengths too: they are fitted jointly, and left to the dynamics to name.
What is found goes on as a joint Gaussian.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from freeswing.cdpr.effects import catalogue, effect_named
from freeswing.cdpr.model.batch import evaluate, only
from freeswing.cdpr.model.equations import Model, build_model
from freeswing.cdpr.robot import Array, Robot
from freeswing.ident.diagnose.lengths.equilibria import Equilibrium, Witness, equilibrium, heard
from freeswing.ident.diagnose.lengths.joint_lengths import (
    Blocks,
    Normal,
    Solved,
    log_odds,
    normal_equations,
    solved,
    total,
)
from freeswing.ident.diagnose.lengths.length_rows import length_rows, measured_rates
from freeswing.ident.diagnose.lengths.place_probabilities import (
    Chances,
    alone,
    groups,
    mixed,
    probability,
    set_probabilities,
)
from freeswing.ident.diagnose.variants import effect_of, inside
from freeswing.ident.likelihood.fit_swings import LikelihoodFit
from freeswing.ident.likelihood.run_residuals import Samples

LINEARISATIONS = 3
# Runs whose slow errors are this many times as large as the usual run's are named.
LESS_TRUST = 2.0


class Way(NamedTuple):
    """One block of a group, as if it were the only one of them that is off.

    Attributes:
        key: an effect, or one cable's part of it.
        probability: that it is off.
        values: of its parameters, (k,).
        std: of these, all else that may be off allowed for, (k,).
        unit: of these, m or rad or others.
    """

    key: str
    probability: float
    values: Array
    std: Array
    unit: str

    def document(self) -> dict[str, Any]:
        """Of `lengths` in results/diagnosis.json."""
        told = {"values": self.values.tolist(), "std": self.std.tolist()}
        return {"part": self.key, "probability": self.probability, **told}

    def __str__(self) -> str:
        """Its values, for a reader."""
        factor, unit = (1e3, f"m{self.unit}") if self.unit in ("m", "rad") else (1.0, self.unit)
        pairs = zip(factor * self.values, factor * self.std, strict=True)
        return f"{self.key} by " + ", ".join(f"{v:.1f} +- {s:.1f}" for v, s in pairs) + f" {unit}"


@dataclass(frozen=True, slots=True)
class WrongPlace:
    """A block of the geometry that is grossly off, or several of which at least one is.

    Attributes:
        keys: effects, or one cable's part of them, the likeliest first.
        values: of all their parameters, key after key, (k,).
        covariance: of these, over all that may be off beside, (k, k).
        ways: one for each key.
        probability: that at least one of the blocks is off.
        delta_bic: twice the log odds against the first, its unknowns counted, negative for it.
        before_m: what lengths vary along the runs by the declared geometry, root mean square.
        after_m: and by the joint model.
        witness: what the equilibria of the runs say of the values.
    """

    keys: tuple[str, ...]
    values: Array
    covariance: Array
    ways: tuple[Way, ...]
    probability: float
    delta_bic: float
    before_m: float
    after_m: float
    witness: Witness

    @property
    def key(self) -> str:
        """The likeliest."""
        return self.keys[0]

    def __str__(self) -> str:
        """What was seen, for a reader."""
        told = (
            f"wrong with probability {self.probability:.3f}, whatever forces act: by all geometry "
            f"together the poses' cable lengths vary by {1e3 * self.after_m:.2g} instead of "
            f"{1e3 * self.before_m:.2g} mm along the runs"
        )
        if len(self.keys) == 1:
            return f"{told}; {self.witness}"
        ways = " or ".join(f"{way} ({100 * way.probability:.0f} %)" for way in self.ways)
        return f"{told}; these recordings cannot tell {ways}"


class RunLengths(NamedTuple):
    """What the cable lengths of one run vary along it, root mean square.

    Attributes:
        run: its name.
        before_m: by the declared geometry.
        after_m: by the joint model.
        slow_errors: their size over the usual one.
    """

    run: str
    before_m: float
    after_m: float
    slow_errors: float


@dataclass(frozen=True, slots=True)
class Kinematics:
    """What lengths say.

    Attributes:
        wrong: blocks that are off, the surest first.
        probabilities: of each block to be off.
        runs: what each run's lengths vary along it, before and after, and how large its slow
            errors are.
        besides: values of effects that make lengths vary, with standard deviations, by effect:
            fitted jointly, and left to the dynamics to accept.
    """

    wrong: tuple[WrongPlace, ...]
    probabilities: dict[str, float]
    runs: tuple[RunLengths, ...]
    besides: dict[str, tuple[Array, Array]]

    def notes(self) -> list[str]:
        """Runs that deserve less trust, and witnesses that contradict lengths, a sentence each."""
        usual = float(np.median([one.slow_errors for one in self.runs])) if self.runs else 0.0
        against = [
            f"{' or '.join(one.keys)}: {one.witness}"
            for one in self.wrong
            if not one.witness.agrees
        ]
        return against + [
            f"run {one.run}: its cable lengths keep {one.slow_errors / usual:.1f} times the usual "
            "run's variation whatever the geometry: its poses are worse than they say, and it "
            "weighs less where lengths are judged"
            for one in self.runs
            if one.slow_errors > LESS_TRUST * usual
        ]

    def document(self) -> dict[str, Any]:
        """`lengths` of results/diagnosis.json."""
        return {
            "wrong": [
                {
                    **one.ways[0].document(),
                    "probability": one.probability,
                    "rivals": [way.document() for way in one.ways[1:]],
                    "before_m": one.before_m,
                    "after_m": one.after_m,
                    "equilibria": one.witness.document(),
                }
                for one in self.wrong
            ],
            "probabilities": self.probabilities,
            "runs": [one._asdict() for one in self.runs],
            "besides": {
                name: {"values": values.tolist(), "std": stds.tolist()}
                for name, (values, stds) in self.besides.items()
            },
        }


class _Linearised(NamedTuple):
    """What the lengths say, linearised at values."""

    normal: Normal
    chances: dict[tuple[str, ...], float]
    wrong: tuple[str, ...]
    found: Solved
    at: Array


def _linearised(
    fit: LikelihoodFit,
    model: Model,
    patterns: Sequence[dict[str, Array]],
    blocks: Blocks,
    noise_scales: Array,
    values: Array,
) -> _Linearised:
    """Chances of every set of gross blocks, and the solution with the likeliest."""
    at = np.where(_displaces(model), values, 0.0)
    rows = [
        length_rows(model, fit.inertia, samples, noise_scales, at, pattern)
        for samples, pattern in zip(fit.samples, patterns, strict=True)
    ]
    normal = normal_equations(rows, blocks.gross)
    chances = set_probabilities(normal, blocks)
    best = max(chances, key=lambda one: chances[one])
    found = solved(total(normal), blocks.spread(best))
    return _Linearised(normal, chances, best, found, at)


def kinematics(fit: LikelihoodFit, keys: Sequence[str], noise_scales: Array) -> Kinematics | None:
    """The joint model of lengths along runs with full poses; None where there are none.

    Args:
        fit: of the declared model.
        keys: candidates that displace or measure: each is one block.
        noise_scales: of metres and radians, (2,).
    """
    if not all(run.is_pose for run in fit.samples):
        return None
    patterns = [_patterns(fit, samples) for samples in fit.samples]
    keys = _finest([key for key in keys if effect_of(key) not in patterns[0]])
    model = build_model(fit.model.robot, tuple(dict.fromkeys(map(effect_of, keys))))
    blocks = _blocks(model, keys, patterns[0])
    last = _linearised(fit, model, patterns, blocks, noise_scales, np.zeros(len(model.parameters)))
    for _ in range(LINEARISATIONS - 1):
        if not last.wrong:
            break
        values, before = last.found.values[: len(model.parameters)], last.wrong
        last = _linearised(fit, model, patterns, blocks, noise_scales, values)
        if last.wrong == before:
            break
    normal, chances = last.normal, last.chances
    everything = mixed(normal, blocks, chances, ())
    runs = _runs(normal, everything.values)
    before, after = (np.array([one[k] for one in runs]) for k in (1, 2))
    variation = float(np.sqrt(np.mean(before**2))), float(np.sqrt(np.mean(after**2)))
    sure = groups(chances, _shown(chances, keys))
    balances = [
        equilibrium(model, fit.inertia, samples, last.at) for samples in fit.samples if sure
    ]
    places = tuple(_place(model, last, blocks, group, variation, balances) for group in sure)
    singles = {key: probability(chances, [key]) for key in blocks.columns}
    rest = {name: _told(blocks.columns[name], everything) for name in patterns[0]}
    return Kinematics(places, singles, runs, rest)


def _runs(normal: Normal, values: Array) -> tuple[RunLengths, ...]:
    before, after = normal.variations_m(0.0 * values), normal.variations_m(values)
    names = [one.run for one in normal.rows]
    columns = before.tolist(), after.tolist(), normal.sizes.tolist()
    return tuple(RunLengths(*one) for one in zip(names, *columns, strict=True))


def _shown(chances: Chances, keys: Sequence[str]) -> list[str]:
    """Keys that some run shows."""
    weighed = {key for wrong in chances for key in wrong}
    return [key for key in keys if key in weighed]


def _place(
    model: Model,
    last: _Linearised,
    lengths: Blocks,
    group: tuple[str, ...],
    variation: tuple[float, float],
    balances: Sequence[Equilibrium],
) -> WrongPlace:
    chances = last.chances
    told = heard(last.normal, lengths, chances, group, balances)
    normal, blocks = told.normal, told.blocks
    found = mixed(normal, blocks, chances, group)
    ways = []
    for key in group:
        own = mixed(normal, blocks, alone(chances, key, group), [key])
        values, stds = _told(blocks.columns[key], own)
        unit = model.names[blocks.columns[key][0]].rpartition("_")[2]
        ways.append(Way(key, probability(chances, [key]), values, stds, unit))
    where = np.concatenate([blocks.columns[key] for key in group])
    beside = [key for key in last.wrong if key not in group]
    against = -2.0 * float(log_odds(last.normal, lengths, [*beside, group[0]], group[0]))
    covariance = found.covariance[np.ix_(where, where)]
    chance = probability(chances, group)
    values = found.values[where]
    ways = tuple(ways)
    return WrongPlace(group, values, covariance, ways, chance, against, *variation, told.witness)


def _told(columns: np.ndarray, found: Solved) -> tuple[Array, Array]:
    return found.values[columns], np.sqrt(np.diag(found.covariance)[columns])


def _finest(keys: Sequence[str]) -> list[str]:
    """The parts of effects that have some, else the whole effects: blocks may not overlap."""
    parted = {effect_of(key) for key in keys if ":" in key}
    return [key for key in keys if key not in parted]


def _patterns(fit: LikelihoodFit, samples: Samples) -> dict[str, Array]:
    """How each effect that makes lengths vary would do it along a run, (n_t, n, k) by name.

    The state sets the tensions of a platform on cables: they come from the measured one.
    """
    times, zetas, model = samples.times_s, samples.values, build_model(fit.model.robot)
    lengths = evaluate(model.lengths, zetas, model.start_values)[0]
    state = times, zetas, measured_rates(times, zetas), fit.inertia, model.start_values
    tensions = evaluate(only(model.acceleration, 1), *state)[0]
    found = {n: e.length_pattern(times, lengths, tensions) for n, e in catalogue().items()}
    return {name: pattern for name, pattern in found.items() if pattern is not None}


def _blocks(model: Model, keys: Sequence[str], patterns: dict[str, Array]) -> Blocks:
    robot = model.robot
    columns = {
        key: model.place_of(effect_of(key)).start + np.flatnonzero(inside(robot, key))
        for key in keys
    }
    small = [one for name in model.effects for one in _tolerance(robot, name)]
    for name, pattern in patterns.items():
        columns[name] = len(small) + np.arange(pattern.shape[-1])
        small += [_tolerance(robot, name)[0]] * pattern.shape[-1]
    tolerance = np.array(small)
    return Blocks(columns, tolerance, robot.tolerances.gross * tolerance)


def _tolerance(robot: Robot, name: str) -> list[float]:
    """Standard deviation of each of an effect's values where nobody has erred."""
    effect = effect_named(name)
    parameters = effect.parameters(robot)
    if not effect.tolerance:
        return [p.prior_std / robot.tolerances.gross for p in parameters]
    return [getattr(robot.tolerances, effect.tolerance)] * len(parameters)


def _displaces(model: Model) -> np.ndarray:
    """Which values displace the geometry itself, (k,)."""
    measuring = {name for name in model.effects if effect_named(name).changes_measurement}
    return np.array([name.partition(".")[0] not in measuring for name in model.names])
