"""Let go by winch instead of by hand: a short motion of the winches that leaves the wanted swing.

The platform rests with its cables at the swing's own lengths. The winches then move out and back in
smooth strokes and stop where they began, just as the platform arrives at a state of the wanted
swing: what follows, winches locked, is that swing. The strokes are the gentlest that keep the
cables taut, found by sequential quadratic programming on the exact sensitivities of the motion;
nothing has to be measured while they run.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from freeswing.cdpr.effects import Parameter
from freeswing.cdpr.model.batch import evaluate, with_jacobian
from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.robot import Array
from freeswing.cdpr.simulation.free_swing import Motion, simulate
from freeswing.cdpr.simulation.sensitivity import Linearised, linearise
from freeswing.excite.quadratic_programme import least_effort
from freeswing.excite.swing import Bench, Swing

DURATIONS_S = (2.0, 3.0, 4.0)
_STAGES = (0.3, 0.6, 0.85, 1.0, 1.0, 1.0, 1.0)
_SWEEPS = 8
_CLOSED_M = 1e-9
_GRID_S = 0.01
_COARSE_S = 0.02
_TENSION_MARGIN = 0.002


@dataclass(frozen=True, slots=True)
class WinchRelease:
    """A motion of the winches that ends, locked, in a wanted swing.

    Attributes:
        duration_s: of the motion.
        phase_s: the swing's age at its end, counted from its pose of release.
        strokes_m: amplitudes of the strokes of each cable, (count, n).
        times_s: (t,), from the start of the motion.
        lengths_m: what each winch is told, (t, n).
        tension_N: smallest and largest tension on the way.
        fastest_m_s: largest speed of a cable.
        miss: largest departure from the swing at the end: of the pose, metres and radians, and
            of its rates, metres and radians a second.
    """

    duration_s: float
    phase_s: float
    strokes_m: Array
    times_s: Array
    lengths_m: Array
    tension_N: tuple[float, float]
    fastest_m_s: float
    miss: tuple[float, float]


def winch_release(
    bench: Bench, swing: Swing, durations_s: tuple[float, ...] = DURATIONS_S
) -> WinchRelease:
    """The quickest of the given motions that keeps every cable within the tension limits.

    Raises:
        ValueError: when none does, with the tensions of each.
    """
    low, high = bench.limits.tension_N
    period = 1 / swing.frequencies_hz[0]
    tried = []
    for duration in durations_s:
        for phase in (0.0, 0.25 * period, 0.5 * period, 0.75 * period):
            try:
                found = _release(bench, swing, duration, phase)
            except (ValueError, np.linalg.LinAlgError) as error:
                tried.append(f"{duration:g} s: {error}")
                continue
            least, most = found.tension_N
            if least >= low and most <= high:
                return found
            tried.append(f"{duration:g} s: tensions {least:.0f} to {most:.0f} N")
    raise ValueError(
        "no motion of the winches starts this swing within the tension limits: "
        f"{'; '.join(tried)}; release it by hand, or plan smaller swings"
    )


@dataclass(frozen=True, slots=True)
class Strokes:
    """The shapes that the winches' motions are made of: one bump, and the free modes under it.

    Small strokes in step with a mode build a large swing. All shapes are zero with two derivatives
    at both ends.

    Attributes:
        duration_s: of the motion.
        frequencies_hz: of the modes, (6 - n,).
    """

    duration_s: float
    frequencies_hz: tuple[float, ...]

    @property
    def count(self) -> int:
        """How many shapes there are."""
        return 1 + 2 * len(self.frequencies_hz)

    def symbolic(self, time: ca.SX) -> list[ca.SX]:
        """The shapes as expressions of time."""
        place = time / self.duration_s
        bump = 64 * place**3 * (1 - place) ** 3
        turns = [2 * ca.pi * f * (time - self.duration_s / 2) for f in self.frequencies_hz]
        waves = [wave(turn) for turn in turns for wave in (ca.cos, ca.sin)]
        return [bump, *(bump * wave for wave in waves)]

    def at(self, times_s: Array) -> Array:
        """The shapes at times, (t, count)."""
        time = ca.SX.sym("t")
        shapes = ca.Function("shapes", [time], [ca.vertcat(*self.symbolic(time))])
        return np.array(shapes(np.atleast_2d(times_s))).T


def driven_model(model: Model, shapes: Strokes) -> Model:
    """The model with winches that follow the strokes; its values are their amplitudes in metres.

    The tensions are those that give the lengths the winches' acceleration.
    """
    n = model.robot.n_cables
    time, zeta, rates = ca.SX.sym("t"), ca.SX.sym("zeta", 6), ca.SX.sym("rates", 6)
    inertia, strokes = ca.SX.sym("inertia", 9), ca.SX.sym("strokes", shapes.count * n)
    pulls, own = ca.SX.sym("pulls", n), ca.DM(model.start_values)
    loaded = model.pulled(time, zeta, rates, pulls, inertia, own)
    loose = ca.substitute(loaded, pulls, ca.SX.zeros(n))
    by_pulls = ca.jacobian(loaded, pulls)
    lengths_by = model.cables(zeta, own)[3]
    drift = model.cable_rates(zeta, rates, own)[0] @ rates
    told = ca.reshape(strokes, n, shapes.count) @ ca.vertcat(*shapes.symbolic(time))
    wanted = ca.jacobian(ca.jacobian(told, time), time)
    tensions = ca.inv(lengths_by @ by_pulls) @ (wanted - drift - lengths_by @ loose)
    speed = lengths_by @ rates - ca.jacobian(told, time)
    state = [time, zeta, rates, inertia, strokes]
    functions = {
        "acceleration": (state, [loose + by_pulls @ tensions, tensions]),
        "slip": (state, [speed]),
        "domain": ([zeta, strokes], model.domain(zeta, own)),
        "lengths": ([zeta, strokes], [model.lengths(zeta, own)]),
        "cables": ([zeta, strokes], model.cables(zeta, own)),
        "cable_rates": ([zeta, rates, strokes], model.cable_rates(zeta, rates, own)),
    }
    built = {
        name: ca.Function(
            name,
            inputs,
            outputs,
            getattr(model, name).name_in(),
            getattr(model, name).name_out(),
            {"cse": True},
        )
        for name, (inputs, outputs) in functions.items()
    }
    names = [f"stroke_{k + 1}_{c.name}_m" for k in range(shapes.count) for c in model.robot.cables]
    parameters = tuple(Parameter(name, -1.0, 1.0, 0.05) for name in names)
    return replace(model, parameters=parameters, names=tuple(names), **built)


def _release(bench: Bench, swing: Swing, duration_s: float, phase_s: float) -> WinchRelease:
    """Gentlest strokes that end in the swing's state at a phase, by continuation from rest."""
    drive = _Drive(bench, swing, duration_s)
    zetas, rates, _ = bench.course(swing.release, phase_s + 0.1).motion.at(np.array([phase_s]))
    goal = np.concatenate([zetas[0], rates[0]])
    rest = np.concatenate([swing.equilibrium.zeta, np.zeros(6)])
    strokes = np.zeros(drive.shapes.count * bench.model.robot.n_cables)
    for share in _STAGES:
        strokes = drive.towards(rest + share * (goal - rest), strokes)
    return drive.described(drive.closed(goal, strokes), goal, phase_s)


class _Drive:
    """The platform driven from rest by its winches, and its first order in the strokes."""

    def __init__(self, bench: Bench, swing: Swing, duration_s: float) -> None:
        n = bench.model.robot.n_cables
        self.bench, self.swing, self.duration_s = bench, swing, duration_s
        self.shapes = Strokes(duration_s, tuple(swing.frequencies_hz.tolist()))
        self.driven = driven_model(bench.model, self.shapes)
        self.grid = np.linspace(0, duration_s, round(duration_s / _COARSE_S) + 1)
        curves = np.gradient(np.gradient(self.shapes.at(self.grid), axis=0), axis=0)
        effort = curves.T @ curves / _COARSE_S**4 / len(self.grid)
        self.effort: Array = np.kron(effort, np.eye(n)).astype(np.float64)

    def motion(self, strokes: Array) -> Motion:
        """From rest, with these strokes."""
        span = (0.0, self.duration_s)
        rest = self.swing.equilibrium.zeta
        return simulate(self.driven, rest, np.zeros(6), span, self.bench.inertia, strokes, 1e-9)

    def towards(self, goal: Array, strokes: Array) -> Array:
        """One step: least effort, the goal met, tensions within limits, all to first order."""
        bench, motion = self.bench, self.motion(strokes)
        linear = linearise(motion)
        gap, by_strokes = self._end(goal, motion, linear)
        target = gap + by_strokes @ strokes
        tensions, tension_by = self._tensions(motion, linear, strokes)
        base = tensions.ravel() - tension_by @ strokes
        low, high = bench.limits.tension_N
        margin = _TENSION_MARGIN * (high - low)
        return least_effort(
            self.effort, by_strokes, target, tension_by, low + margin - base, high - margin - base
        )

    def closed(self, goal: Array, strokes: Array) -> Array:
        """The nearest strokes that meet the goal exactly, nearest by their effort.

        Raises:
            ValueError: when they move away from it.
        """
        gap = np.full(1, np.inf)
        for _ in range(_SWEEPS):
            motion = self.motion(strokes)
            gap, by_strokes = self._end(goal, motion, linearise(motion))
            if np.abs(gap).max() < _CLOSED_M:
                return strokes
            easy = np.linalg.solve(self.effort, by_strokes.T)
            strokes = strokes + easy @ np.linalg.solve(by_strokes @ easy, gap)
        raise ValueError(f"the swing is missed by {np.abs(gap).max():.1e}")

    def _end(self, goal: Array, motion: Motion, linear: Linearised) -> tuple[Array, Array]:
        """What is missing of the goal at the end, and its derivatives by the strokes.

        The lengths at the end are those at the start whatever the strokes: only the free
        directions there are left to be met.
        """
        from scipy.linalg import null_space

        model = self.bench.model
        jacobian = evaluate(model.cables, goal[:6], model.start_values)[3]
        onto = np.kron(np.eye(2), null_space(jacobian).T)
        states = linear.at(np.array([self.duration_s]))
        by_strokes = onto @ np.concatenate([part[0][:, 21:] for part in states])
        return onto @ (goal - _end_state(motion, self.duration_s)), by_strokes

    def _tensions(self, motion: Motion, linear: Linearised, strokes: Array) -> tuple[Array, Array]:
        """Tensions on the grid (t, n) in N and their derivatives by the strokes, (t n, k)."""
        zetas, rates, _ = motion.at(self.grid)
        zetas_by, rates_by = (part[..., 21:] for part in linear.at(self.grid))
        function = with_jacobian(self.driven.acceleration, (1, 2, 4), 1)
        value, by = evaluate(function, self.grid, zetas, rates, self.bench.inertia, strokes)
        moved = by[..., :6] @ zetas_by + by[..., 6:12] @ rates_by + by[..., 12:]
        mass = self.bench.mass_kg
        return mass * value, mass * moved.reshape(-1, len(strokes))

    def described(self, strokes: Array, goal: Array, phase_s: float) -> WinchRelease:
        """What the winches do and where it ends."""
        n, motion = self.bench.model.robot.n_cables, self.motion(strokes)
        grid = np.linspace(0, self.duration_s, round(self.duration_s / _GRID_S) + 1)
        told = self.shapes.at(grid) @ strokes.reshape(self.shapes.count, n)
        tensions = self.bench.mass_kg * motion.tensions(grid)
        gap = np.abs(_end_state(motion, self.duration_s) - goal)
        return WinchRelease(
            duration_s=self.duration_s,
            phase_s=phase_s,
            strokes_m=strokes.reshape(self.shapes.count, n),
            times_s=grid,
            lengths_m=self.swing.equilibrium.lengths_m + told,
            tension_N=(float(tensions.min()), float(tensions.max())),
            fastest_m_s=float(np.abs(np.gradient(told, grid, axis=0)).max()),
            miss=(float(gap[:6].max()), float(gap[6:].max())),
        )


def _end_state(motion: Motion, duration_s: float) -> Array:
    zetas, rates, _ = motion.at(np.array([duration_s]))
    return np.concatenate([zetas[0], rates[0]])
