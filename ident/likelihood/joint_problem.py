"""The joint problem of all runs: cost, Gauss-Newton steps and noise scales."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.model.free_motion import admissible_rates
from freeswing.cdpr.model.known_values import prior_whitener
from freeswing.cdpr.robot import Array
from freeswing.cdpr.simulation.free_swing import LARGEST_TAIL, Motion, simulate, tails
from freeswing.cdpr.simulation.sensitivity import linearise
from freeswing.cdpr.simulation.simplified_newton import Surroundings
from freeswing.cdpr.system.threads import side_by_side
from freeswing.ident.judge.physical_consistency import nearest_possible
from freeswing.ident.likelihood.fit import RANK_LIMIT
from freeswing.ident.likelihood.payload_runs import Loads
from freeswing.ident.likelihood.run_residuals import (
    Reduced,
    Samples,
    lengths_residual,
    own_numbers,
    own_prior,
    plucked_start,
    reduce_run,
    residuals,
)
from freeswing.ident.likelihood.unknowns import Layout

INERTIA, EFFECTS, PAYLOADS = "inertia", "effects", "payloads"
TOLERANCE_M = 1e-8
INERTIA_UNIT = np.array([0.05, 0.05, 0.05, 0.02, 0.02, 0.02, 0.01, 0.01, 0.01])
STATE_UNIT = 0.05  # m, rad, and these a second: a start


@dataclass(frozen=True, slots=True)
class State:
    """Values of all unknowns.

    Attributes:
        inertia: (9,).
        values: effect values, (k,).
        starts: initial [zeta; rates] of each run, (runs, 12).
        scales: noise scales of metres and radians, (2,).
        motions: the simulated motions; empty before the first simulation.
        own_values: of the effect values that each run has for itself, (runs, o); None for those
            in `values`, which otherwise do not count for them.
        loads: unknowns that payload runs add (see `ident.likelihood.payload_runs`), (u,); None: to
            be guessed.
    """

    inertia: Array
    values: Array
    starts: Array
    scales: Array
    motions: tuple[Motion, ...] = ()
    own_values: Array | None = None
    loads: Array | None = None

    def values_of(self, run: int, own: np.ndarray) -> Array:
        """All effect values of a run, (k,)."""
        values = self.values.copy()
        if self.own_values is not None:
            values[own] = self.own_values[run]
        return values


@dataclass(frozen=True, slots=True)
class FirstOrder:
    """All runs to first order at a state.

    Attributes:
        reduced: each run without its own unknowns.
        surroundings: of each run's motion.
    """

    reduced: tuple[Reduced, ...]
    surroundings: tuple[Surroundings, ...]


@dataclass(frozen=True, slots=True)
class Step:
    """A damped Gauss-Newton step.

    Attributes:
        shared: change of inertia, values and what payload runs add, (9 + k + u,).
        states: change of each run's initial [zeta; rates], (12,).
        own: change of each run's own effect values, (o,).
        triangle: R of the scaled joint problem in the free unknowns.
        singular_values: of that triangle, descending.
        rank: how many of them count.
        promised: decrease of the cost that an undamped linear step would bring.
        longest: largest change of a shared unknown or start, each in its unit.
        runs: rows of each run over [shared unknowns; residual].
        priors: rows of what is known beforehand.
    """

    shared: Array
    states: tuple[Array, ...]
    own: tuple[Array, ...]
    triangle: Array
    singular_values: Array
    rank: int
    promised: float
    longest: float
    runs: tuple[Array, ...]
    priors: Array


class NotFollowedError(ValueError):
    """A run that cannot be simulated from where it should start: names it, and why."""


class Problem:
    """What does not change while the unknowns do.

    Args:
        model: the equations, with the effects to be estimated.
        samples: of the runs.
        free: which of the shared unknowns to estimate, (9 + k + u,); None for all.
        estimate_scales: whether noise scales follow the residuals.
        tolerance_m: local error of the simulated motions.
        consistent: whether the inertia is held to what a body can have; all nine are then free.
        known: means (k,) of the effects' values and what whitens distances from them, (k, k); None:
            as the model knows them.
    """

    def __init__(
        self,
        model: Model,
        samples: Sequence[Samples],
        free: np.ndarray | None = None,
        estimate_scales: bool = True,
        tolerance_m: float = TOLERANCE_M,
        consistent: bool = False,
        known: tuple[Array, Array] | None = None,
    ) -> None:
        parameters = model.parameters
        self.model = model
        self.samples = tuple(samples)
        self.loads = Loads.of([run.payload for run in samples])
        self.seen = Layout(((INERTIA, len(INERTIA_UNIT)), (EFFECTS, len(parameters))))
        self.layout = self.seen.joined(PAYLOADS, self.loads.count)
        self.free = np.ones(self.layout.size, dtype=bool) if free is None else np.array(free)
        self.free[self.layout.place(EFFECTS)][model.own_values] = False
        self.wanted = self.free[: self.seen.size].copy()
        self.wanted[self.seen.place(EFFECTS)][model.own_values] = True
        # What payloads do goes through the inertia that a run sees.
        through = np.append(self.free[self.seen.place(INERTIA)], self.free[self.seen.size :])
        self.wanted[self.seen.place(INERTIA)] = through.any()
        self.consistent = consistent
        self.estimate_scales = estimate_scales
        self.tolerance_m = tolerance_m
        self.prior_centre, whitened = known or (model.start_values, prior_whitener(model))
        self.prior_whitener = whitened.copy()
        self.prior_whitener[model.own_values] = 0.0
        self.unit = np.concatenate([INERTIA_UNIT, [p.scale for p in parameters], self.loads.unit])
        far = [3.0 * INERTIA_UNIT, [(p.high - p.low) / 3.0 for p in parameters], self.loads.unit]
        self.farthest = np.concatenate(far)

    def simulated(
        self, state: State, near: Sequence[Surroundings] = (), most: float = np.inf
    ) -> State:
        """The state with motions from its starts, whose rates are made admissible.

        Args:
            state: its motions do not count.
            near: of motions that may be near, one a run, or none.
            most: runs are followed until they cost more together.

        Raises:
            ValueError: when one cannot be followed, naming the run, and where they cost more.
        """
        runs = range(len(state.starts))
        costs = [] if np.isinf(most) else [self._shared_cost(state)]

        def refuse_more() -> None:
            if sum(costs) > most:
                raise ValueError(f"the runs cost more than {most:g}")

        def followed(run: int, start: Array, near: Surroundings | None) -> Motion:
            refuse_more()
            motion = self._followed(state, run, start, near)
            if costs:
                costs.append(_run_cost(motion, self.samples[run], state.scales))
                refuse_more()
            return motion

        motions = tuple(side_by_side(followed, runs, state.starts, near or [None] * len(runs)))
        starts = np.array([np.concatenate([one.zetas[0], one.rates[0]]) for one in motions])
        return replace(state, starts=starts, motions=motions)

    def begun(self, state: State) -> State:
        """The state with motions: those that it has where they are its own, else simulated.

        Raises:
            ValueError: when one cannot be followed, naming the run.
        """
        runs = range(len(self.samples))
        if len(state.motions) == len(runs) and all(self._is_own(state, run) for run in runs):
            return state
        return self.simulated(state)

    def _is_own(self, state: State, run: int) -> bool:
        """Whether a state's motion of a run is what a simulation from it would be."""
        motion, span = state.motions[run], self.samples[run].span_s
        inertia = self.loads.inertia(run, state.inertia, self.loads_of(state))
        has = (np.append(motion.zetas[0], motion.rates[0]), motion.inertia, motion.values)
        needs = (state.starts[run], inertia, state.values_of(run, self.model.own_values))
        return bool(
            motion.model is self.model
            and np.allclose((motion.starts_s[0], motion.end_s), span, rtol=0.0, atol=1e-9)
            and all(np.array_equal(a, b) for a, b in zip(has, needs, strict=True))
            and tails(motion).max() <= LARGEST_TAIL * self.tolerance_m
        )

    def _followed(self, state: State, run: int, start: Array, near: Surroundings | None) -> Motion:
        samples = self.samples[run]
        zeta, span = start[:6], samples.span_s
        inertia = self.loads.inertia(run, state.inertia, self.loads_of(state))
        values = state.values_of(run, self.model.own_values)
        try:
            rates = admissible_rates(self.model, zeta, start[6:], inertia, values, span[0])
            if near is not None:
                moved = near.motion_at(zeta, rates, inertia, values, self.tolerance_m)
                if moved is not None:
                    return moved
            return simulate(self.model, zeta, rates, span, inertia, values, self.tolerance_m)
        except (ValueError, np.linalg.LinAlgError) as error:
            raise NotFollowedError(f"run {samples.name}: {error}") from error

    def cost(self, state: State) -> float:
        """Sum of squared whitened residuals, lengths and priors included."""
        total = self._shared_cost(state)
        for motion, samples in zip(state.motions, self.samples, strict=True):
            total += _run_cost(motion, samples, state.scales)
        return total

    def _shared_cost(self, state: State) -> float:
        """Squared distances from what is known of the unknowns that all runs share."""
        loads = self.loads_of(state) / self.loads.prior_std
        return float(np.sum(self.prior(state.values) ** 2)) + float(np.sum(loads**2))

    def loads_of(self, state: State) -> Array:
        """What payload runs add to the unknowns, (u,)."""
        return self.loads.start() if state.loads is None else state.loads

    def prior(self, values: Array) -> Array:
        """Independent distances of unit deviation from what is known of the values, (k,)."""
        return self.prior_whitener @ (values - self.prior_centre)

    def linear(self, state: State) -> FirstOrder:
        """The motions of a state to first order."""

        def one(motion: Motion, samples: Samples) -> tuple[Reduced, Surroundings]:
            linear = linearise(motion, wanted=self.wanted)
            return reduce_run(linear, samples, state.scales), Surroundings.of(linear)

        found = side_by_side(one, state.motions, self.samples)
        reduced, surroundings = zip(*found, strict=True)
        return FirstOrder(reduced, surroundings)

    def step(self, state: State, linear: FirstOrder, damping: float) -> Step:
        """A damped Gauss-Newton step from a state with its motions to first order."""
        reduced = linear.reduced
        maps = [self.shared_map(run, state) for run in range(len(reduced))]
        parts = [
            np.column_stack([run.rows[:-1, :-1] @ one, run.rows[:-1, -1]])
            for run, one in zip(reduced, maps, strict=True)
        ]
        priors = self.prior_rows(state)
        rows = np.vstack([*parts, priors])
        free = self.free
        scaled = rows[:, :-1][:, free] * self.unit[free]
        shared = np.zeros(len(free))
        n_free = int(free.sum())
        full = np.asarray(np.linalg.qr(np.column_stack([scaled, rows[:, -1]]), mode="r"))
        triangle, right = full[:n_free, :n_free], full[:n_free, -1]
        left, singular, back = np.linalg.svd(triangle)
        largest = singular.max(initial=0.0)
        kept = singular > RANK_LIMIT * largest
        gains = np.where(kept, singular / (singular**2 + damping * largest**2 + 1e-300), 0.0)
        shared[free] = -self.unit[free] * (back.T @ (gains * (left.T @ right)))
        if self.consistent:
            curves = singular**2 + (damping + RANK_LIMIT**2) * largest**2
            aimed = state.inertia + shared[self.layout.place(INERTIA)]
            shared += self._held(aimed, (back.T / curves) @ back)
        shared *= min(1.0, 1.0 / max(np.abs(shared / self.farthest).max(initial=0.0), 1e-300))
        changes = [run.own_change(one @ shared) for run, one in zip(reduced, maps, strict=True)]
        states, own = (tuple(part) for part in zip(*changes, strict=True))
        gains = [float(part @ part) for part in (right, *(run.own[:, -1] for run in reduced))]
        lengths = [np.abs(shared / self.unit), *(np.abs(one) / STATE_UNIT for one in states)]
        longest = max(float(part.max(initial=0.0)) for part in lengths)
        return Step(
            shared,
            states,
            own,
            triangle,
            singular,
            int(kept.sum()),
            sum(gains),
            longest,
            tuple(parts),
            priors,
        )

    def shared_map(self, run: int, state: State) -> Array:
        """What a run sees, inertia with its payload and values, by the unknowns, (9 + k, p)."""
        seen, by = self.seen, self.layout
        found = np.zeros((seen.size, by.size))
        found[seen.place(EFFECTS), by.place(EFFECTS)] = np.eye(len(self.prior_centre))
        by_inertia, by_payloads = self.loads.slopes(run, state.inertia, self.loads_of(state))
        found[seen.place(INERTIA), by.place(INERTIA)] = by_inertia
        found[seen.place(INERTIA), by.place(PAYLOADS)] = by_payloads
        return found

    def _held(self, inertia: Array, scaled_covariance: Array) -> Array:
        """Change of the shared unknowns (p,) that makes an inertia aimed at a possible body's."""
        free, body = np.flatnonzero(self.free), self.layout.place(INERTIA)
        covariance = scaled_covariance * np.outer(self.unit[free], self.unit[free])
        own = covariance[body, body]  # all nine are free, and they come first
        change = nearest_possible(inertia, own) - inertia
        found = np.zeros(len(self.free))
        found[free] = covariance[:, body] @ np.linalg.solve(own, change)
        return found

    def prior_rows(self, state: State) -> Array:
        """Rows of the priors of effect values and payloads, (k + u, p + 1)."""
        effects = np.zeros((len(self.prior_centre), self.layout.size + 1))
        effects[:, self.layout.place(EFFECTS)] = self.prior_whitener
        effects[:, -1] = self.prior(state.values)
        payloads = np.zeros((self.loads.count, self.layout.size + 1))
        payloads[:, self.layout.place(PAYLOADS)] = np.diag(1.0 / self.loads.prior_std)
        payloads[:, -1] = self.loads_of(state) / self.loads.prior_std
        return np.vstack([effects, payloads])

    def moved(
        self, state: State, step: Step, near: Sequence[Surroundings], most: float = np.inf
    ) -> State | None:
        """The simulated state after a step, or None where it cannot be simulated.

        Args:
            state: from which the step leads.
            step: the step.
            near: of the state's motions.
            most: None as well where it costs more.
        """
        change = self.layout.split(step.shared)
        aimed = replace(
            state,
            inertia=state.inertia + change[INERTIA],
            values=state.values + change[EFFECTS],
            starts=state.starts + np.array(step.states),
            own_values=self._own_of(state) + np.array(step.own),
            loads=self.loads_of(state) + change[PAYLOADS],
        )
        try:
            return self.simulated(aimed, near, most)
        except ValueError:
            return None

    def _own_of(self, state: State) -> Array:
        own = self.model.own_values
        runs = range(len(self.samples))
        return np.array([state.values_of(run, own)[own] for run in runs])

    def rescaled(self, state: State) -> State:
        """The state with noise scales that make the whitened residuals' variance one."""
        if not self.estimate_scales:
            return state
        squares, counts = np.zeros(2), np.zeros(2)
        for motion, samples in zip(state.motions, self.samples, strict=True):
            white = residuals(motion, samples, state.scales)
            for g in (0, 1):
                squares[g] += np.sum(white[:, samples.groups == g] ** 2)
                counts[g] += white[:, samples.groups == g].size
        own = own_numbers(self.model)
        share = 1.0 - min(0.9, (own * len(self.samples) + self.free.sum()) / max(counts.sum(), 1.0))
        factors = np.sqrt(squares / np.maximum(share * counts, 1.0))
        scales = np.where(counts > 0, state.scales * np.maximum(factors, 1e-6), state.scales)
        return replace(state, scales=scales)


def _run_cost(motion: Motion, samples: Samples, scales: Array) -> float:
    """Sum of squares of a run: residuals, lengths, and what is known of its own effect values."""
    total = float(np.sum(residuals(motion, samples, scales) ** 2))
    total += float(np.sum(lengths_residual(motion, samples) ** 2))
    total += float(np.sum(plucked_start(motion) ** 2))
    return total + float(np.sum(own_prior(motion, samples) ** 2))
