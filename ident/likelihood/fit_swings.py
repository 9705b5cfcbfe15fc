"""Maximum likelihood over the free motions themselves (beyond the published FIDIM).

Every run's initial state and cable lengths, the inertia and any effect values are estimated
together: predicted samples against measured ones, stated lengths as priors. The fitted stretch
grows from the start of each run to its whole length, so that runs of any length converge from a
rough start. Derivatives are exact throughout.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from freeswing.cdpr.descent import Stop
from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.robot import Array
from freeswing.cdpr.simulation.free_swing import Motion
from freeswing.cdpr.simulation.simplified_newton import obeys
from freeswing.cdpr.system.progress import Progress
from freeswing.ident.likelihood.between_runs import jackknife_std
from freeswing.ident.likelihood.blocks import (
    as_known,
    effect_values,
    free_of,
    model_unknowns,
    refuse_others,
    state_of,
)
from freeswing.ident.likelihood.fit import Solution, shared_covariance
from freeswing.ident.likelihood.joint_problem import INERTIA, TOLERANCE_M, Problem, State, Step
from freeswing.ident.likelihood.minimise import minimised
from freeswing.ident.likelihood.payload_runs import Loads
from freeswing.ident.likelihood.run_residuals import Samples, differences, predicted, residuals
from freeswing.ident.likelihood.unknowns import Mask, Unknowns
from freeswing.ident.signals.residual_colour import enlargement, low_band_factor

Begun = Callable[[Array, Array], None]
WHOLE = "maximum likelihood: whole runs"

FIRST_STATES_S = 0.4  # short enough that no mode turns round: rough first states become good
FIRST_STRETCH_S = 1.5
STRETCH_GROWTH = 2.5
STEPS = 30
CONVERGED_DECREASE = 0.01
ROUGH_DECREASE = 5.0
# Lengths known to a micrometre are walls that a step cannot follow: they are let down in stages.
LOOSE_LENGTH_STD_M = 5e-4
TIGHTER_LENGTH_STD_M = 2e-5


@dataclass(frozen=True, slots=True)
class Swings:
    """Runs of free swings as a fit sees them.

    Attributes:
        model: the equations, with the effects to be estimated.
        samples: one a run; see `ident.likelihood.samples_and_noise.prepare`.
        scales: factors on the stated (or unit) noise of metres and radians, (2,).
        motions: of the runs, where known: not simulated again where the unknowns are theirs.
    """

    model: Model
    samples: tuple[Samples, ...]
    scales: Array
    motions: tuple[Motion, ...] = ()

    def __len__(self) -> int:
        """How many there are."""
        return len(self.samples)

    @property
    def loads(self) -> Loads:
        """What the runs carry."""
        return Loads.of([run.payload for run in self.samples])

    def under(self, model: Model, unknowns: Unknowns, tolerance_m: float) -> Swings:
        """The same runs under another model; their motions stay where it has them too.

        A candidate that does nothing yet changes no motion: none has to be simulated again.

        Args:
            model: which the motions may obey.
            unknowns: of that model, starts those of the motions.
            tolerance_m: local error that a segment may have.
        """
        state = state_of(unknowns, model, self.scales)
        told = tuple(
            replace(one, model=model, values=state.values_of(run, model.own_values))
            for run, one in enumerate(self.motions)
        )
        kept = told if all(obeys(one, tolerance_m) for one in told) else ()
        return replace(self, model=model, motions=kept)


@dataclass(frozen=True, slots=True)
class LikelihoodFit(Solution):
    """The estimate.

    Its `unknowns` are inertia, effects, payloads and starts (see `ident.likelihood.blocks`); of the
    shared ones `covariance` is (p, p), p = 9 + k + u, and enlarged by `correlation`.

    Attributes:
        swings: the runs, with the noise scales and the motions found.
        correlation: power of the residuals in the band of the motion over that of white noise of
            the same variance: above 1 the model misses something, or the noise is not white.
        noise: rms of the residuals in metres and radians, (2,), NaN where there are none.
        deviance: -2 log likelihood up to a constant.
        between: standard deviations of the shared unknowns by leaving out one run at a time, (p,),
            zero where not estimated or where there are fewer than three runs.
    """

    swings: Swings
    correlation: float
    noise: Array
    deviance: float
    between: Array

    @property
    def model(self) -> Model:
        """The equations fitted."""
        return self.swings.model

    @property
    def samples(self) -> tuple[Samples, ...]:
        """What was fitted, one a run."""
        return self.swings.samples

    @property
    def motions(self) -> tuple[Motion, ...]:
        """What was found, one a run."""
        return self.swings.motions

    @property
    def scales(self) -> Array:
        """Factors on the stated (or unit) noise of metres and radians, (2,)."""
        return self.swings.scales

    @property
    def inertia(self) -> Array:
        """`INERTIA_NAMES` values, (9,)."""
        return self.value(INERTIA)

    @property
    def values(self) -> Array:
        """Effect values, (k,); of those that each run has for itself root mean squares."""
        return effect_values(self.unknowns, self.model)

    @property
    def free(self) -> Mask:
        """Which of the shared unknowns were estimated, (p,)."""
        return free_of(self.unknowns, self.model)

    @property
    def stds(self) -> Array:
        """Standard deviations of the shared unknowns, (p,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def enlargement(self) -> float:
        """By what the covariance was multiplied for residuals that are not white."""
        return enlargement(self.correlation)

    @property
    def n_samples(self) -> int:
        """How many numbers were fitted."""
        return sum(run.values.size for run in self.samples)


@dataclass(frozen=True, slots=True)
class FreeSwing:
    """How to fit free swings: each reduced to a triangle; a search that may climb.

    Attributes:
        steps: at most so many Gauss-Newton steps on the whole runs.
        tolerance: converged when an undamped step lowers the cost by less.
        grow: False when the start is close over the whole length of the runs already.
        own_noise: whether noise scales follow the residuals.
        consistent: hold the inertia, of which all is then free, to what a body can have.
        accuracy_m: local error of the simulated motions.
        foresees: whether it ends a step sooner where the steps to come would lower the cost by less
            than the tolerance: where no digits are told.
        progress: told a label and a fraction.
        begun: told inertia and its standard deviations, (9,) each, once the first stretch is
            fitted; what it raises ends the fit.
    """

    steps: int = STEPS
    tolerance: float = CONVERGED_DECREASE
    grow: bool = True
    own_noise: bool = True
    consistent: bool = False
    accuracy_m: float = TOLERANCE_M
    foresees: bool = False
    progress: Progress | None = None
    begun: Begun | None = None

    def fitted(self, swings: Swings, unknowns: Unknowns) -> LikelihoodFit:
        """Inertia, effect values, payloads, initial states and lengths that make runs likeliest.

        Raises:
            ValueError: when a block is not what the model makes of it, or a start cannot be
                simulated, with the reason.
        """
        refuse_others(unknowns, swings.model, swings.loads)
        state = replace(state_of(unknowns, swings.model, swings.scales), motions=swings.motions)
        if self.grow:
            state = _grown(swings, state, unknowns, self)
        else:
            self.tell(WHOLE, 0.0)
        problem = _problem(swings.model, swings.samples, unknowns, self, self.accuracy_m)
        state, step, taken, stop = minimised(
            problem, state, self.steps, self.tolerance, self.foresees
        )
        self.tell("maximum likelihood", 1.0)
        found = _packed(problem, state, step, taken, stop)
        return replace(found, unknowns=as_known(found.unknowns, swings.model, unknowns))

    def tell(self, label: str, fraction: float) -> None:
        """How far the fit is, to whom it may concern."""
        if self.progress:
            self.progress(label, fraction)


ONWARD = FreeSwing(grow=False, own_noise=False)  # from where another fit stands, its noise told


def _grown(swings: Swings, state: State, unknowns: Unknowns, how: FreeSwing) -> State:
    """Near enough to fit whole runs: fitted to growing stretches, lengths let down in stages."""
    model, samples = swings.model, swings.samples
    stages = stretches(samples)
    total, held = len(stages) + 1, unknowns.all_held()
    for index, end_s in enumerate(stages):
        how.tell(f"maximum likelihood: first {end_s:.1f} s", index / total)
        parts = [run.until(run.span_s[0] + end_s).loosened(LOOSE_LENGTH_STD_M) for run in samples]
        if index == 0:
            for first_s in (FIRST_STATES_S, end_s):
                short = [run.until(run.span_s[0] + first_s) for run in parts]
                states_alone = _problem(model, short, held, replace(how, consistent=False))
                state = minimised(states_alone, state, STEPS, ROUGH_DECREASE)[0]
        problem = _problem(model, parts, unknowns, how)
        state, step, *_ = minimised(problem, state, STEPS, ROUGH_DECREASE)
        if index == 0 and how.begun:
            how.begun(state.inertia, _inertia_stds(problem, step))
    how.tell(WHOLE, (total - 1) / total)
    for std in (LOOSE_LENGTH_STD_M, TIGHTER_LENGTH_STD_M):
        if any(run.lengths_m is not None and run.lengths_std_m < std for run in samples):
            problem = _problem(model, [run.loosened(std) for run in samples], unknowns, how)
            state = minimised(problem, state, STEPS, ROUGH_DECREASE)[0]
    return state


def _inertia_stds(problem: Problem, step: Step) -> Array:
    """Standard deviations of the inertia by a step's triangle, (9,)."""
    determined = step.rank >= int(problem.free.sum())
    covariance = shared_covariance(step.triangle, determined, problem.free, problem.unit)
    return np.sqrt(np.diag(covariance))[problem.layout.place(INERTIA)]


def _problem(
    model: Model,
    samples: Sequence[Samples],
    unknowns: Unknowns,
    how: FreeSwing,
    accuracy_m: float = TOLERANCE_M,
) -> Problem:
    free, known = free_of(unknowns, model), unknowns.known_of(*model.effects)
    return Problem(model, samples, free, how.own_noise, accuracy_m, how.consistent, known)


def stretches(samples: Sequence[Samples]) -> list[float]:
    """Lengths in seconds of the partial fits that come before the whole runs."""
    longest = max(run.span_s[1] - run.span_s[0] for run in samples)
    lengths, length = [], FIRST_STRETCH_S
    while length < 0.6 * longest:
        lengths.append(length)
        length *= STRETCH_GROWTH
    return lengths


def _packed(problem: Problem, state: State, step: Step, taken: int, stop: Stop) -> LikelihoodFit:
    pairs = list(zip(state.motions, problem.samples, strict=True))
    white = [residuals(motion, run, state.scales) for motion, run in pairs]
    times = [run.times_s for run in problem.samples]
    correlation = low_band_factor(list(zip(white, times, strict=True)))
    squares, counts = np.zeros(2), np.zeros(2)
    for motion, samples in pairs:
        difference = differences(predicted(motion, samples.times_s), samples)
        for g in (0, 1):
            squares[g] += np.sum(difference[:, samples.groups == g] ** 2)
            counts[g] += difference[:, samples.groups == g].size
    noise = np.full(2, np.nan)
    noise[counts > 0] = np.sqrt(squares[counts > 0] / counts[counts > 0])
    cost = problem.cost(state)
    swings = Swings(problem.model, problem.samples, state.scales, state.motions)
    found = replace(state, values=_values(problem, state))
    determined = step.rank >= int(problem.free.sum())
    covariance = shared_covariance(step.triangle, determined, problem.free, problem.unit)
    return LikelihoodFit(
        unknowns=model_unknowns(problem.model, problem.loads, found, problem.free),
        covariance=covariance * enlargement(correlation),
        cost=cost,
        residuals=tuple(run.ravel() for run in white),
        singular_values=step.singular_values,
        rank=step.rank,
        steps=taken,
        stop=stop,
        swings=swings,
        correlation=correlation,
        noise=noise,
        deviance=cost + 2.0 * float(counts @ np.log(state.scales)),
        between=jackknife_std(step.runs, step.priors, problem.free, problem.unit),
    )


def _values(problem: Problem, state: State) -> Array:
    values, own = state.values.copy(), problem.model.own_values
    each = np.array([motion.values[own] for motion in state.motions])
    values[own] = np.sqrt(np.mean(each**2, axis=0))
    return values


def correlation_factor(
    motions: Sequence[Motion], samples: Sequence[Samples], scales: Array
) -> float:
    """Power of the residuals below 5 Hz over what white noise of their variance would have."""
    pairs = zip(motions, samples, strict=True)
    return low_band_factor([(residuals(motion, run, scales), run.times_s) for motion, run in pairs])
