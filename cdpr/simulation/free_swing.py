"""Free motion of a model from an initial state: collocation with error-controlled segments."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre

from freeswing.cdpr.model.batch import Bound, evaluate, only
from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.model.undefined_poses import check_domain, domain_problems
from freeswing.cdpr.robot import Array, finite
from freeswing.cdpr.simulation.collocation import Table, interpolation, of_segments, table

NODES = 12
LONGEST_SEGMENT_S = 0.4
SHORTEST_SEGMENT_S = 5e-4
SWEEPS = 12
KEPT_ORDERS = 6
LARGEST_SLIP_M_S = 1e-7
LARGEST_JUMP_RAD = 1.5
LARGEST_TAIL = 4.0  # tolerances that a segment's last two orders may hold before it is cut
SMALL = 1e-6  # m, rad and these a second: a difference right to six digits
AXES = np.arange(6)
BESIDE = AXES + 1
SETTLED = 1e-3  # of the tolerance: what a further step of Newton's would change is left out


@dataclass(frozen=True, slots=True)
class Motion:
    """A free motion as one polynomial a segment.

    Attributes:
        model: the equations it obeys.
        inertia: `INERTIA_NAMES` values, (9,).
        values: effect values, (k,).
        starts_s: start of each segment, (s,).
        steps_s: length of each segment, (s,).
        zetas: pose coordinates at the segment starts, (s, 6).
        rates: their rates at the segment starts, (s, 6).
        accelerations: second derivatives at the Gauss nodes, (s, m, 6).
    """

    model: Model
    inertia: Array
    values: Array
    starts_s: Array
    steps_s: Array
    zetas: Array
    rates: Array
    accelerations: Array

    @property
    def end_s(self) -> float:
        """Time up to which the motion is known."""
        return float(self.starts_s[-1] + self.steps_s[-1])

    def at(self, times_s: Array) -> tuple[Array, Array, Array]:
        """Pose coordinates, rates and accelerations at times (n,), each (n, 6).

        Raises:
            ValueError: when a time lies outside the motion.
        """
        index, fractions = self.locate(times_s)
        step, before = self.steps_s[index, None], self.rates[index]
        maps = interpolation(self.accelerations.shape[1], fractions)
        values, once, twice = (of_segments(part, self.accelerations, index) for part in maps)
        zetas = self.zetas[index] + step * fractions[:, None] * before + step**2 * twice
        return zetas, before + step * once, values

    def poses_at(self, times_s: Array) -> Array:
        """Pose coordinates alone at times (n,), (n, 6).

        Raises:
            ValueError: when a time lies outside the motion.
        """
        index, fractions = self.locate(times_s)
        step = self.steps_s[index, None]
        twice = interpolation(self.accelerations.shape[1], fractions)[2]
        drifted = self.zetas[index] + step * fractions[:, None] * self.rates[index]
        return drifted + step**2 * of_segments(twice, self.accelerations, index)

    def locate(self, times_s: Array) -> tuple[Array, Array]:
        """Segment index and fraction within it of each time.

        Raises:
            ValueError: when a time lies outside the motion.
        """
        times = np.asarray(times_s, dtype=np.float64)
        slack = 1e-9
        if times.size and not (
            times.min() >= self.starts_s[0] - slack and times.max() <= self.end_s + slack
        ):
            raise ValueError(
                f"times {times.min():.6f} to {times.max():.6f} s lie outside the motion, "
                f"{self.starts_s[0]:.6f} to {self.end_s:.6f} s"
            )
        index = np.clip(np.searchsorted(self.starts_s, times, side="right") - 1, 0, None)
        fractions = (times - self.starts_s[index]) / self.steps_s[index]
        return index, np.clip(fractions, 0.0, 1.0)

    def tensions(self, times_s: Array) -> Array:
        """Specific cable tensions tau / m at times (n,), (n, n_cables) in m/s^2."""
        zetas, rates, _ = self.at(times_s)
        arguments = (np.asarray(times_s), zetas, rates, self.inertia, self.values)
        return evaluate(only(self.model.acceleration, 1), *arguments)[0]


def simulate(
    model: Model,
    zeta: Array,
    rates: Array,
    span_s: tuple[float, float],
    inertia: Array,
    values: Array | None = None,
    tolerance_m: float = 1e-10,
    longest_s: float = LONGEST_SEGMENT_S,
) -> Motion:
    """Integrate the free motion from a state that obeys the constraints.

    `cdpr.simulation.sensitivity.linearise(motion)` gives the exact derivatives of the motion by its
    initial state, the inertia and the effect values; `cdpr.simulation.start_state` turns those of
    the state into derivatives by free coordinates and cable lengths. Derivatives by geometry are
    those by the values of the geometric effects (`anchor_offset`, `attachment_offset`,
    `pulley_radius`, ...).

    Args:
        model: the equations.
        zeta: pose coordinates at the start, (6,).
        rates: their rates, (6,); see `cdpr.model.free_motion.admissible_rates`.
        span_s: start and end time.
        inertia: `INERTIA_NAMES` values, (9,).
        values: effect values, (k,); None for those that leave the declared model as it is.
        tolerance_m: local error bound of a segment, metres and radians.
        longest_s: longest segment.

    Returns:
        The motion. Cable lengths keep their value without stabilisation: the constraint is an
        invariant that the segments' order of accuracy preserves.

    Raises:
        ValueError: for wrong shapes, numbers that are not finite, an empty span, rates that the
            cables do not allow, and when the motion cannot be followed, with the time at which it
            fails and why (a cable reaches its pulley or swivel axis, the angles theta = 90
            degrees, or the constraints lose rank).
    """
    values = model.start_values if values is None else values
    zeta, rates = finite("zeta", zeta, 6), finite("rates", rates, 6)
    inertia, values = finite("inertia", inertia, 9), finite("values", values, len(model.names))
    check_start(model, span_s, zeta, rates, inertia, values, tolerance_m)
    stepper = _Stepper(model, inertia, values, tolerance_m)
    time, end = map(float, span_s)
    state = zeta, rates
    step, guess = min(0.1, longest_s, end - time), None
    rows: list[tuple[float, float, Array, Array, Array]] = []
    while end - time > 1e-12:
        step = min(step, end - time, longest_s)
        found, factor = stepper.segment(time, step, *state, guess)
        if found is None:
            if step <= SHORTEST_SEGMENT_S:
                raise ValueError(_stuck(model, time, *state, inertia, values))
            step, guess = step * factor, None
            continue
        rows.append((time, step, *state, found))
        state = stepper.end(step, *state, found)
        time += step
        following = min(step * factor, longest_s, max(end - time, 1e-12))
        guess = _extrapolated(found, step, following)
        step = following
    starts, steps, zetas, speeds, accelerations = (
        np.array(column) for column in zip(*rows, strict=True)
    )
    motion = Motion(model, inertia, values, starts, steps, zetas, speeds, accelerations)
    check_swivels(motion)
    return motion


def tails(motion: Motion) -> Array:
    """What the last two orders of each segment's accelerations move the platform by, (s,).

    Source:
        Boyd 2001, Chebyshev and Fourier Spectral Methods, ch. 2: the last coefficients as
        error.
    """
    nodes = motion.accelerations.shape[1]
    last = np.abs(table(nodes).spectrum[-2:] @ motion.accelerations).max(axis=(1, 2))
    return motion.steps_s**2 * last / (4 * nodes**2)


def check_swivels(motion: Motion) -> None:
    """Refuse a motion that has stepped across a swivel axis, where a pulley would have to flip."""
    model, values = motion.model, motion.values
    times = np.append(motion.starts_s, motion.end_s)
    zetas = np.vstack([motion.zetas, motion.at(times[-1:])[0]])
    swivels = evaluate(only(model.cables, 1), zetas, values)[0]
    jumps = np.abs(np.angle(np.exp(1j * np.diff(swivels, axis=0)))) * (model.robot.radii_m > 0.0)
    if jumps.max(initial=0.0) > LARGEST_JUMP_RAD:
        sample, cable = np.unravel_index(int(np.argmax(jumps)), jumps.shape)
        name = model.robot.cables[cable].name
        raise ValueError(
            f"the free motion cannot be followed beyond {times[sample]:.4f} s from pose "
            f"{np.array2string(zetas[sample], precision=4)}: cable {name} "
            f"crosses its swivel axis (its pulley would turn by {jumps[sample, cable]:.2f} rad in "
            f"{times[sample + 1] - times[sample]:.4f} s); check swivel_z or take a smaller swing"
        )


def check_start(
    model: Model,
    span_s: tuple[float, float],
    zeta: Array,
    rates: Array,
    inertia: Array,
    values: Array,
    tolerance_m: float,
) -> None:
    """A simulation that starts wrong would drift in silence."""
    if not (np.isfinite(span_s).all() and span_s[1] > span_s[0]):
        raise ValueError(f"span_s is {tuple(span_s)}: the end must come after the start")
    if not tolerance_m > 0.0:
        raise ValueError(f"tolerance_m is {tolerance_m}, must be above 0; 1e-10 is usual")
    check_domain(model, zeta, values)
    slip = evaluate(model.slip, span_s[0], zeta, rates, inertia, values)[0]
    worst = int(np.argmax(np.abs(slip)))
    if not np.abs(slip[worst]) <= LARGEST_SLIP_M_S:
        raise ValueError(
            f"the rates lengthen cable {model.robot.cables[worst].name} by {slip[worst]:.2e} m/s "
            f"(limit {LARGEST_SLIP_M_S:g}); "
            "take cdpr.model.free_motion.admissible_rates of them"
        )


def _stuck(
    model: Model, time: float, zeta: Array, rates: Array, inertia: Array, values: Array
) -> str:
    """Why a motion cannot be followed beyond a state."""
    begin = f"the free motion cannot be followed beyond {time:.4f} s from pose "
    begin += f"{np.array2string(zeta, precision=4)}: "
    ahead = zeta + np.linspace(0.0, 2 * SHORTEST_SEGMENT_S, 20)[:, None] * rates
    problems = domain_problems(model, ahead, values)
    if problems:
        return f"{begin}{str(problems[0]).split(': ', 1)[1]}"
    jacobian = evaluate(model.cables, zeta, values)[3]
    ratio = np.divide(*np.linalg.svd(jacobian, compute_uv=False)[[-1, 0]])
    tensions = evaluate(model.acceleration, time, zeta, rates, inertia, values)[1]
    return (
        f"{begin}the equations turn singular or too fast there (cable Jacobian's singular values "
        f"{ratio:.1e} apart, largest specific tension {np.abs(tensions).max():.1e} m/s^2, largest "
        f"rate {np.abs(rates).max():.1e}); start from a smaller swing"
    )


def _extrapolated(accelerations: Array, step: float, following: float) -> Array:
    """The last segment's low-order polynomial carried on into the next one."""
    t = table(accelerations.shape[0])
    fractions = 1.0 + t.nodes * following / step
    coefficients = t.spectrum[:KEPT_ORDERS] @ accelerations
    return legendre.legvander(2 * fractions - 1, KEPT_ORDERS - 1) @ coefficients


class _Stepper:
    """Solves one segment after another; inputs that do not change are bound once."""

    def __init__(self, model: Model, inertia: Array, values: Array, tolerance: float) -> None:
        self.tolerance = tolerance
        self.table: Table = table(NODES)
        self.integrals = np.vstack([self.table.twice, self.table.once])
        _, self.once_middle, self.twice_middle = interpolation(NODES, np.array([0.5]))
        self.force = Bound(only(model.acceleration, 0), NODES)
        self.near = Bound(only(model.acceleration, 0), 13)
        for bound in (self.force, self.near):
            bound.inputs[3][:] = inertia
            bound.inputs[4][:] = values

    def segment(
        self, time: float, step: float, zeta: Array, rates: Array, guess: Array | None
    ) -> tuple[Array | None, float]:
        """Node accelerations, or None, and the factor by which to change the step."""
        t = self.table
        inverse, value = self._newton_matrix(time, step, zeta, rates, guess)
        found = np.tile(value, (NODES, 1)) if guess is None else guess
        force = self.force
        into_zetas, into_rates, accelerations = force.inputs[1], force.inputs[2], force.outputs[0]
        force.inputs[0][:, 0] = time + step * t.nodes
        drifted = zeta + step * t.nodes[:, None] * rates
        integrals = self.integrals * np.repeat([step**2, step], NODES)[:, None]
        change = np.inf
        for _ in range(SWEEPS):
            moved = integrals @ found
            np.add(drifted, moved[:NODES], out=into_zetas)
            np.add(rates, moved[NODES:], out=into_rates)
            force.run()
            delta = inverse @ (accelerations - found).reshape(-1)
            found = found + delta.reshape(NODES, 6)
            last, change = change, step**2 * float(delta @ delta) ** 0.5
            if not np.isfinite(change) or (change > 1e-3 and change > last):
                return None, 0.4
            # The next change would be about change^2 / last: stop when that is negligible.
            ratio = change / last if np.isfinite(last) else 1.0
            if change * min(1.0, ratio) < SETTLED * self.tolerance:
                break
        else:
            return None, 0.5
        tail = step**2 * float(np.abs(t.spectrum[-2:] @ found).max()) / (4 * NODES**2)
        factor = 0.85 * (self.tolerance / max(tail, 1e-300)) ** (1.0 / NODES)
        if tail > LARGEST_TAIL * self.tolerance and step > SHORTEST_SEGMENT_S:
            return None, float(np.clip(factor, 0.2, 0.8))
        return found, float(np.clip(factor, 0.5, 1.6))

    def _newton_matrix(
        self, time: float, step: float, zeta: Array, rates: Array, guess: Array | None
    ) -> tuple[Array, Array]:
        """Inverse of the collocation equations' Jacobian with mid-segment slopes; a first guess.

        The slopes are differences: they only lead Newton's steps, and a block of points costs a
        tenth of exact ones.
        """
        near, t = self.near, self.table
        near.inputs[0][:] = time + step / 2
        zetas, speeds = near.inputs[1], near.inputs[2]
        zetas[:], speeds[:] = zeta + 0.5 * step * rates, rates
        if guess is not None:
            zetas += step**2 * (self.twice_middle @ guess)[0]
            speeds += step * (self.once_middle @ guess)[0]
        zetas[BESIDE, AXES] += SMALL
        speeds[BESIDE + 6, AXES] += SMALL
        near.run()
        forces = near.outputs[0]
        jacobian = (forces[1:] - forces[0]) / SMALL  # (12, 6): transposed
        blocks = (-(step**2) * t.twice)[:, None, :, None] * jacobian[:6].T[:, None, :]
        blocks -= (step * t.once)[:, None, :, None] * jacobian[6:].T[:, None, :]
        matrix = blocks.reshape(6 * NODES, 6 * NODES)
        matrix.flat[:: 6 * NODES + 1] += 1.0
        return np.linalg.inv(matrix), forces[0].copy()

    def end(self, step: float, zeta: Array, rates: Array, found: Array) -> tuple[Array, Array]:
        """State at the end of a segment."""
        t = self.table
        return zeta + step * rates + step**2 * (t.twice_end @ found), rates + step * (
            t.once_end @ found
        )
