"""Which parts of the geometry are grossly wrong, by the constancy of lengths, and how surely.

Stretch and creep change lengths too: they are fitted jointly, and left to the dynamics to name.
What is found goes on as a joint Gaussian.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from freeswing.cdpr.effects import Parameter, catalogue, effect_named
from freeswing.cdpr.model.batch import evaluate
from freeswing.cdpr.model.equations import Model, build_model
from freeswing.cdpr.robot import Array, Robot
from freeswing.cdpr.simulation.free_swing import Motion
from freeswing.ident.diagnose.lengths.joint_lengths import (
    Blocks,
    Normal,
    Solved,
    honest_covariance,
    log_odds,
    normal_equations,
    set_probabilities,
    solved,
    total,
)
from freeswing.ident.diagnose.lengths.length_rows import length_rows
from freeswing.ident.diagnose.variants import effect_of, inside
from freeswing.ident.likelihood.likelihood import LikelihoodFit
from freeswing.ident.likelihood.likelihood_run import Samples

# The threshold for accepting: wrong with probability above this.
ACCEPTED = 0.95
LINEARISATIONS = 3


@dataclass(frozen=True, slots=True)
class WrongPlace:
    """A block of the geometry that is grossly off.

    Attributes:
        key: an effect, or one cable's part of it.
        parameters: those of the block.
        values: of these, (k,).
        covariance: of these, all else that may be off allowed for, (k, k).
        probability: that the block is off.
        delta_bic: twice the log odds against it, its unknowns counted, negative for it.
        before_m: what lengths vary along the runs by the declared geometry, root mean square.
        after_m: and by the joint model.
    """

    key: str
    parameters: tuple[Parameter, ...]
    values: Array
    covariance: Array
    probability: float
    delta_bic: float
    before_m: float
    after_m: float

    def __str__(self) -> str:
        """What was seen, for a reader."""
        return (
            f"wrong with probability {self.probability:.3f}, whatever forces act: by all geometry "
            f"together the poses' cable lengths vary by {1e3 * self.after_m:.2g} instead of "
            f"{1e3 * self.before_m:.2g} mm along the runs"
        )


@dataclass(frozen=True, slots=True)
class Kinematics:
    """What lengths say.

    Attributes:
        wrong: blocks that are off, the surest first.
        probabilities: of each block to be off.
        sizes: of each run's slow errors over their usual size.
        besides: values of effects that make lengths vary, with standard deviations, by effect:
            fitted jointly, and left to the dynamics to accept.
    """

    wrong: tuple[WrongPlace, ...]
    probabilities: dict[str, float]
    sizes: tuple[float, ...]
    besides: dict[str, tuple[Array, Array]]

    def document(self) -> dict[str, Any]:
        """`lengths` of results/diagnosis.json."""
        return {
            "wrong": [
                {
                    "part": one.key,
                    "probability": one.probability,
                    "values": one.values.tolist(),
                    "std": np.sqrt(np.diag(one.covariance)).tolist(),
                    "before_m": one.before_m,
                    "after_m": one.after_m,
                }
                for one in self.wrong
            ],
            "probabilities": self.probabilities,
            "slow_errors": list(self.sizes),
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
        length_rows(model, motion, samples, noise_scales, at, pattern)
        for motion, samples, pattern in zip(fit.motions, fit.samples, patterns, strict=True)
    ]
    normal = normal_equations(rows, blocks.gross)
    chances = set_probabilities(normal, blocks)
    best = max(chances, key=lambda one: chances[one])
    return _Linearised(normal, chances, best, solved(total(normal), blocks.spread(best)))


def kinematics(fit: LikelihoodFit, keys: Sequence[str], noise_scales: Array) -> Kinematics | None:
    """The joint model of lengths along runs with full poses; None where there are none.

    Args:
        fit: of the declared model.
        keys: candidates that displace or measure: each is one block.
        noise_scales: of metres and radians, (2,).
    """
    if not all(run.is_pose for run in fit.samples):
        return None
    patterns = [_patterns(*pair) for pair in zip(fit.motions, fit.samples, strict=True)]
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
    normal, chances, wrong, found = last
    single = {key: sum(p for one, p in chances.items() if key in one) for key in blocks.columns}
    covariance = honest_covariance(normal, blocks.spread(wrong), found)
    variation = normal.variation_m(0.0 * found.values), normal.variation_m(found.values)
    places = []
    for key in sorted(set(wrong) & set(keys), key=lambda one: -single[one]):
        if single[key] > ACCEPTED:
            where = blocks.columns[key]
            block = covariance[np.ix_(where, where)]
            named = tuple(model.parameters[k] for k in where)
            found_there = found.values[where]
            against = -2.0 * float(log_odds(normal, blocks, wrong, key))
            places.append(
                WrongPlace(key, named, found_there, block, single[key], against, *variation)
            )
    rest = {name: _told(blocks.columns[name], found, covariance) for name in patterns[0]}
    return Kinematics(tuple(places), single, tuple(normal.sizes.tolist()), rest)


def _told(columns: np.ndarray, found: Solved, covariance: Array) -> tuple[Array, Array]:
    return found.values[columns], np.sqrt(np.diag(covariance)[columns])


def _finest(keys: Sequence[str]) -> list[str]:
    """The parts of effects that have some, else the whole effects: blocks may not overlap."""
    parted = {effect_of(key) for key in keys if ":" in key}
    return [key for key in keys if key not in parted]


def _patterns(motion: Motion, samples: Samples) -> dict[str, Array]:
    """How each effect that makes lengths vary would do it along a run, (n_t, n, k) by name."""
    times, values = samples.times_s, motion.values
    lengths = evaluate(motion.model.lengths, samples.values, values)[0]
    tensions = motion.tensions(times)
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
