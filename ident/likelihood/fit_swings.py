"""Maximum likelihood over the free motions themselves (beyond the published FIDIM).

Every run's initial state and cable lengths, the inertia and any effect values are estimated
together: predicted samples against measured ones, stated lengths as priors. The fitted stretch
grows from the start of each run to its whole length, so that runs of any length converge from a
rough start. Derivatives are exact throughout.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from freeswing.cdpr.descent import Stop
from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.robot import Array
from freeswing.cdpr.simulation.free_swing import Motion
from freeswing.ident.likelihood.between_runs import jackknife_std
from freeswing.ident.likelihood.blocks import model_unknowns, none_free, state_of
from freeswing.ident.likelihood.fit_blocks import Solution
from freeswing.ident.likelihood.joint_problem import TOLERANCE_M, Problem, State, Step
from freeswing.ident.likelihood.minimise import minimised
from freeswing.ident.likelihood.payload_runs import Loads
from freeswing.ident.likelihood.run_residuals import Samples, differences, predicted, residuals
from freeswing.ident.likelihood.unknowns import Unknowns

Progress = Callable[[str, float], None]

FIRST_STATES_S = 0.4  # short enough that no mode turns round: rough first states become good
FIRST_STRETCH_S = 1.5
STRETCH_GROWTH = 2.5
STEPS = 30
LOW_BAND_HZ = 5.0  # hanging platforms swing at 0.3 to 3 Hz: what a model misses follows them
CONVERGED_DECREASE = 0.01
ROUGH_DECREASE = 5.0
COLOURED = 1.2  # correlation from which residuals are not white
# Lengths known to a micrometre are walls that a step cannot follow: they are let down in stages.
LOOSE_LENGTH_STD_M = 5e-4
TIGHTER_LENGTH_STD_M = 2e-5


@dataclass(frozen=True, slots=True)
class LikelihoodFit:
    """The estimate.

    Attributes:
        model: the equations fitted.
        inertia: `INERTIA_NAMES` values, (9,).
        loads: what payload runs add to the unknowns (see `ident.likelihood.payload_runs`), (u,).
        values: effect values, (k,); root mean squares over the runs of those that each run has
            for itself (its motion holds them).
        free: which of the shared unknowns were estimated: inertia, values, loads, (9 + k + u,).
        covariance: of all shared unknowns, (9 + k + u, 9 + k + u), zero where not estimated,
            infinite on the diagonal where the rank does not suffice; enlarged by `correlation`.
        correlation: power of the residuals in the band of the motion over that of white noise of
            the same variance: above 1 the model misses something, or the noise is not white.
        scales: factors on the stated (or unit) noise of metres and radians, (2,).
        noise: rms of the residuals in metres and radians, (2,), NaN where there are none.
        deviance: -2 log likelihood up to a constant.
        cost: sum of squared whitened residuals.
        motions: one fitted motion a run.
        samples: what they were fitted to.
        singular_values: of the whitened, column-scaled joint problem, descending.
        rank: how many of them count.
        steps: Gauss-Newton steps taken.
        stop: why the iteration ended.
        between: standard deviations of the shared unknowns by leaving out one run at a time,
            (9 + k + u,), zero where not estimated or where there are fewer than three runs.
    """

    model: Model
    inertia: Array
    values: Array
    loads: Array
    free: np.ndarray
    covariance: Array
    correlation: float
    scales: Array
    noise: Array
    deviance: float
    cost: float
    motions: tuple[Motion, ...]
    samples: tuple[Samples, ...]
    singular_values: Array
    rank: int
    steps: int
    stop: Stop
    between: Array

    @property
    def reason(self) -> str:
        """Why the iteration ended, a sentence."""
        return self.stop.sentence

    @property
    def std(self) -> Array:
        """Standard deviations of the shared unknowns, (9 + k + u,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def unknowns(self) -> Unknowns:
        """All of them by name (see `ident.likelihood.blocks`)."""
        own = np.array([motion.values[self.model.own_values] for motion in self.motions])
        loads = Loads.of([run.payload for run in self.samples])
        return model_unknowns(
            self.model, self.inertia, self.values, own, loads, self.loads, self.free
        )

    @property
    def solution(self) -> Solution:
        """The same as every fit of named blocks gives it."""
        pairs = zip(self.motions, self.samples, strict=True)
        white = tuple(residuals(motion, run, self.scales).ravel() for motion, run in pairs)
        found = (self.unknowns, self.covariance, self.cost, white, self.singular_values)
        return Solution(*found, self.rank, self.steps, self.stop)

    def covariance_of(self, *names: str) -> Array:
        """Joint covariance of some blocks of the shared unknowns."""
        places = self.unknowns.columns(*names)
        return self.covariance[np.ix_(places, places)]

    def std_of(self, name: str) -> Array:
        """Standard deviations of a block of the shared unknowns."""
        return self.std[self.unknowns.place(name)]

    def start_of(self, unknowns: Unknowns, model: Model, scales: Array) -> State:
        """Where a fit of another model goes on from the runs' states as they are here."""
        return state_of(unknowns, model, self.state.starts, scales)

    @property
    def enlargement(self) -> float:
        """By what the covariance was multiplied for residuals that are not white."""
        return _enlargement(self.correlation)

    @property
    def n_samples(self) -> int:
        """How many numbers were fitted."""
        return sum(run.values.size for run in self.samples)

    @property
    def state(self) -> State:
        """All unknowns, to start another fit from."""
        starts = np.array([np.concatenate([m.zetas[0], m.rates[0]]) for m in self.motions])
        own = np.array([m.values[self.model.own_values] for m in self.motions])
        return State(self.inertia, self.values, starts, self.scales, self.motions, own, self.loads)


def fit(
    model: Model,
    samples: Sequence[Samples],
    start: State,
    free: np.ndarray | None = None,
    progress: Progress | None = None,
    estimate_scales: bool = True,
    grow: bool = True,
    steps: int = STEPS,
    tolerance: float = CONVERGED_DECREASE,
    accuracy_m: float = TOLERANCE_M,
    consistent: bool = False,
) -> LikelihoodFit:
    """Fit inertia, effect values, initial states and lengths to the samples of the runs.

    Args:
        model: the equations, with the effects to be estimated.
        samples: of the runs; see `ident.likelihood.raw_samples.prepare`.
        start: first guesses; its motions are not needed.
        free: which of the 9 + k shared unknowns to estimate; None for all.
        progress: told a label and a fraction.
        estimate_scales: whether noise scales follow the residuals.
        grow: False when the start is close over the whole length of the runs already.
        steps: at most so many Gauss-Newton steps on the whole runs.
        tolerance: converged when an undamped step lowers the cost by less.
        accuracy_m: local error of the simulated motions.
        consistent: hold the inertia, of which all is then free, to what a body can have.

    Raises:
        ValueError: when no run is given, or a start cannot be simulated, with the reason.
    """
    if not samples:
        raise ValueError("no run to fit")
    stages = stretches(samples) if grow else []
    state, total = start, len(stages) + 1
    none = none_free(model)
    for index, end_s in enumerate(stages):
        if progress:
            progress(f"maximum likelihood: first {end_s:.1f} s", index / total)
        parts = [run.until(run.span_s[0] + end_s).loosened(LOOSE_LENGTH_STD_M) for run in samples]
        if index == 0:
            for first_s in (FIRST_STATES_S, end_s):
                short = [run.until(run.span_s[0] + first_s) for run in parts]
                states_alone = Problem(model, short, none, estimate_scales)
                state = minimised(states_alone, state, STEPS, ROUGH_DECREASE)[0]
        problem = Problem(model, parts, free, estimate_scales, consistent=consistent)
        state = minimised(problem, state, STEPS, ROUGH_DECREASE)[0]
    if progress:
        progress("maximum likelihood: whole runs", (total - 1) / total)
    if grow:
        for std in (LOOSE_LENGTH_STD_M, TIGHTER_LENGTH_STD_M):
            if any(run.lengths_m is not None and run.lengths_std_m < std for run in samples):
                loose = [run.loosened(std) for run in samples]
                problem = Problem(model, loose, free, estimate_scales, consistent=consistent)
                state = minimised(problem, state, STEPS, ROUGH_DECREASE)[0]
    problem = Problem(model, samples, free, estimate_scales, accuracy_m, consistent)
    state, step, taken, stop = minimised(problem, state, steps, tolerance)
    if progress:
        progress("maximum likelihood", 1.0)
    return _packed(problem, state, step, taken, stop)


def stretches(samples: Sequence[Samples]) -> list[float]:
    """Lengths in seconds of the partial fits that come before the whole runs."""
    longest = max(run.span_s[1] - run.span_s[0] for run in samples)
    lengths, length = [], FIRST_STRETCH_S
    while length < 0.6 * longest:
        lengths.append(length)
        length *= STRETCH_GROWTH
    return lengths


def _packed(problem: Problem, state: State, step: Step, taken: int, stop: Stop) -> LikelihoodFit:
    correlation = correlation_factor(state.motions, problem.samples, state.scales)
    squares, counts = np.zeros(2), np.zeros(2)
    for motion, samples in zip(state.motions, problem.samples, strict=True):
        difference = differences(predicted(motion, samples.times_s), samples)
        for g in (0, 1):
            squares[g] += np.sum(difference[:, samples.groups == g] ** 2)
            counts[g] += difference[:, samples.groups == g].size
    noise = np.full(2, np.nan)
    noise[counts > 0] = np.sqrt(squares[counts > 0] / counts[counts > 0])
    cost = problem.cost(state)
    return LikelihoodFit(
        model=problem.model,
        inertia=state.inertia,
        values=_values(problem, state),
        loads=problem.loads_of(state),
        free=problem.free,
        covariance=_covariance(problem, step) * _enlargement(correlation),
        correlation=correlation,
        scales=state.scales,
        noise=noise,
        deviance=cost + 2.0 * float(counts @ np.log(state.scales)),
        cost=cost,
        motions=state.motions,
        samples=problem.samples,
        singular_values=step.singular_values,
        rank=step.rank,
        steps=taken,
        stop=stop,
        between=jackknife_std(step.runs, step.priors, problem.free, problem.unit),
    )


def _enlargement(correlation: float) -> float:
    return correlation if correlation > COLOURED else 1.0


def _values(problem: Problem, state: State) -> Array:
    values, own = state.values.copy(), problem.model.own_values
    each = np.array([motion.values[own] for motion in state.motions])
    values[own] = np.sqrt(np.mean(each**2, axis=0))
    return values


def _covariance(problem: Problem, step: Step) -> Array:
    count = len(problem.free)
    covariance = np.zeros((count, count))
    free = np.flatnonzero(problem.free)
    if step.rank < len(free):
        covariance[free, free] = np.inf
    elif len(free):
        inverse = np.linalg.inv(step.triangle) * problem.unit[free][:, None]
        covariance[np.ix_(free, free)] = inverse @ inverse.T
    return covariance


def correlation_factor(
    motions: Sequence[Motion], samples: Sequence[Samples], scales: Array
) -> float:
    """Power of the residuals below 5 Hz over what white noise of their variance would have."""
    pairs = zip(motions, samples, strict=True)
    return low_band_factor([(residuals(motion, run, scales), run.times_s) for motion, run in pairs])


def low_band_factor(series: Sequence[tuple[Array, Array]]) -> float:
    """Power of series (n, c), each with its times (n,), below 5 Hz over that of white noise."""
    low, whole = 0.0, 0.0
    for white, times_s in series:
        power = np.abs(np.fft.rfft(white, axis=0)) ** 2
        frequencies = np.fft.rfftfreq(len(white), float(np.median(np.diff(times_s))))
        inside = (frequencies > 0.0) & (frequencies <= LOW_BAND_HZ)
        low += float(power[inside].mean(axis=0).sum())
        whole += float(power[1:].mean(axis=0).sum())
    return low / whole if whole > 0 else 1.0
