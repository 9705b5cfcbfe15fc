"""A run whose scale nobody knows as small oscillations: yaw and sway, each with its own decay.

Where nothing but uncalibrated signals was recorded, how far the platform swung is not known, and
what grows with the square of it (yaw and sway that pull at each other) cannot be computed: a fit
would set the scale by whatever it is that the model lacks. Frequencies of small oscillations do not
depend on the scale; how yaw's falls with amplitude is put in for the amplitude that is believed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from freeswing.cdpr.model.batch import evaluate, only
from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.model.statics import Equilibrium, equilibrium_at_lengths
from freeswing.cdpr.robot import Array
from freeswing.cdpr.simulation.parallel_wires import bending
from freeswing.ident.bench.objects import specific
from freeswing.ident.bench.swing import BenchSwing, Responses

CHI = 5  # of the pose
IZZ_SPECIFIC = 5  # of the nine specific numbers
SQUARE = "amplitude"  # block: true amplitudes squared over those of the assumed gains, (1,)
CREEP = "creep"  # block of each run: see `SmallMotion`, (1,)
STEP = 1e-6  # m, m2, ..: a slope is then right to 1e-4 over a hundred radians of phase


@dataclass(frozen=True, slots=True)
class Small:
    """Small oscillations: squared mode frequencies, shapes and what they answer to.

    Attributes:
        omegas: rad/s, rising, (m,).
        shapes: columns in the run's free coordinates, (m, m).
        answers: rows, so that shapes @ answers is one, (m, m).
        yaw: which of the modes turns about the vertical most.
        decays: of the amplitudes, 1/s, (m,).
        bent: relative change of yaw's frequency over its amplitude's square, 1/rad^2.
    """

    omegas: Array
    shapes: Array
    answers: Array
    yaw: int
    decays: Array
    bent: float


@dataclass(frozen=True, slots=True)
class SmallMotion:
    """The motion of a run: pose at any time, as `Motion` has it.

    Attributes:
        small: the oscillations.
        free: the run's free directions, (6, m).
        rest: about which it oscillates, (6,).
        start: free coordinates and their rates at the first sample, (2 m,).
        start_s: time of it.
        lasts_s: from there to the last sample.
        creep: what the frequency changes by at the run's end beside what decay makes of it, in
            units of what it changed by with amplitude at the start.
    """

    small: Small
    free: Array
    rest: Array
    start: Array
    start_s: float
    lasts_s: float = 1.0
    creep: float = 0.0

    @property
    def zetas(self) -> Array:
        """Pose at the first sample, (1, 6)."""
        return (self.rest + self.free @ np.split(self.start, 2)[0])[None]

    @property
    def rates(self) -> Array:
        """Its rates, (1, 6)."""
        return (self.free @ np.split(self.start, 2)[1])[None]

    def at(self, times_s: Array) -> tuple[Array]:
        """Poses at times (n,), (n, 6)."""
        small = self.small
        places, rates = (small.answers @ one for one in np.split(self.start, 2))
        since = (np.asarray(times_s) - self.start_s)[:, None] * np.ones(len(small.omegas))
        falls = np.exp(-small.decays * since)
        since[:, small.yaw] += self._early(since[:, small.yaw], places, rates)
        waves = places * np.cos(small.omegas * since)
        along = (rates + small.decays * places) / small.omegas
        waves = waves + along * np.sin(small.omegas * since)
        return (self.rest + (falls * waves) @ small.shapes.T @ self.free.T,)

    def _early(self, since: Array, places: Array, rates: Array) -> Array:
        """By how much yaw is early, s: its frequency goes with the square of what is left of it.

        It creeps by more than decay explains (sway that comes and goes, other laws of drag): by how
        much is each run's own, or the gain would be set by that.
        """
        small = self.small
        turn = (self.free @ small.shapes[:, small.yaw])[CHI]
        square = places[small.yaw] ** 2 + (rates[small.yaw] / small.omegas[small.yaw]) ** 2
        twice = 2.0 * small.decays[small.yaw]
        flat = abs(twice) * self.lasts_s < 1e-9
        spent = since if flat else -np.expm1(-twice * since) / twice
        crept = self.creep * since * (since - self.lasts_s) / self.lasts_s
        return np.asarray(small.bent * turn**2 * square * (spent + crept))


def stable_rest(model: Model, rest: Array, lengths_m: Array, inertia: Array) -> Equilibrium:
    """The rest pose that wires of lengths (n,) m have near a pose (6,); inertia (9,), specific.

    Raises:
        ValueError: where there is none that is stable.

    Source:
        FIDIM 2022, eq. (38).
    """
    found = equilibrium_at_lengths(model, lengths_m, rest, inertia)
    if found is None or not found.stable:
        raise ValueError(f"no stable rest pose at wires of {np.round(lengths_m, 4)} m")
    return found


def small_oscillations(
    model: Model, rest: Array, free: Array, lengths_m: Array, inertia: Array, drag: Array
) -> Small:
    """The oscillations about the rest pose that wires of some lengths have near `rest`.

    Args:
        model: the robot.
        rest: a pose near, (6,).
        free: the run's free directions, (6, m).
        lengths_m: wire lengths, (n,).
        inertia: specific, (9,).
        drag: rotational (m2/s) and translational (1/s) rates first, per unit of mass.

    Raises:
        ValueError: where there is no stable rest pose, or the inertia is no body's.

    Source:
        FIDIM 2022, eqs. (38), (39).
    """
    found = stable_rest(model, rest, lengths_m, inertia)
    values = model.start_values
    jacobian = evaluate(only(model.cables, 3), found.zeta, values)[0]
    null = np.linalg.svd(jacobian)[2][len(lengths_m) :].T
    # The same free coordinates as the run's, whatever basis the directions come in.
    along = null @ np.linalg.inv(free.T @ null)
    hessian = evaluate(model.lagrangian, found.zeta, found.tensions, inertia, values)[2]
    mass = along.T @ evaluate(model.mass_matrix, found.zeta, inertia, values)[0] @ along
    if not np.linalg.eigvalsh(mass)[0] > 0.0:
        raise ValueError("the inertia is that of no body")
    unit = np.linalg.inv(np.linalg.cholesky(mass)).T
    squares, vectors = np.linalg.eigh(unit.T @ (along.T @ hessian @ along) @ unit)
    if not squares[0] > 0.0:
        raise ValueError(f"smallest squared frequency {squares[0]:.3g} rad^2/s^2")
    shapes = unit @ vectors
    poses = along @ shapes
    yaw = int(np.argmax(np.abs(poses[CHI]) / np.linalg.norm(poses[:2], axis=0).clip(1e-12)))
    # Yaw turns about the centre of mass. How far that is from P an uncalibrated signal cannot tell
    # from its gains: it is taken to turn about P, and sway to move the centre.
    poses[:2, yaw] = 0.0
    shapes[:, yaw] = free.T @ poses[:, yaw]
    decays = np.full(len(squares), 0.5 * float(drag[1]))
    decays[yaw] += 0.5 * float(drag[0]) / float(inertia[IZZ_SPECIFIC])
    about_centre = float(inertia[IZZ_SPECIFIC] - inertia[0] ** 2 - inertia[1] ** 2)
    top, bottom = (_radius(ends) for ends in (model.robot.entries_m, model.robot.attachments_m))
    bent = bending(top, bottom, float(np.mean(lengths_m)), about_centre)
    return Small(np.sqrt(squares), shapes, np.linalg.inv(shapes), yaw, decays, bent)


def _radius(ends: Array) -> float:
    return float(np.sqrt(np.mean(np.sum((ends - ends.mean(axis=0))[:, :2] ** 2, axis=1))))


class ModalSwing(BenchSwing):
    """A run by its small oscillations; all else as any other run of a bench."""

    __slots__ = ()

    def simulated(self, values: Mapping[str, Array]) -> SmallMotion:  # type: ignore[override]
        """The oscillation.

        Raises:
            ValueError: naming the run, where it cannot be.
        """
        total = self.total(values)
        if not total[0] > 0.0:
            raise ValueError(f"run {self.name}: a mass of {total[0]:.3g} kg")
        try:
            small = self._small(specific(total), self.lengths(values), values["effects"])
        except (ValueError, np.linalg.LinAlgError) as error:
            raise ValueError(f"run {self.name}: {error}") from error
        return self._motion(_rescaled(small, values), values["start"], _creep(values))

    def _changes(  # type: ignore[override]
        self, motion: SmallMotion, values: Mapping[str, Array]
    ) -> tuple[dict[str, Array], dict[str, Array]]:
        state, pose = BenchSwing._changes(self, motion, values)  # type: ignore[arg-type]
        if SQUARE in values:
            straight = replace(motion, small=replace(motion.small, bent=0.0))
            turned = motion.small.bent / float(values[SQUARE][0])

            def poses(square: Array) -> Array:
                bent = replace(motion.small, bent=turned * float(square[0]))
                return replace(straight, small=bent).at(self.times_s)[0]

            state[SQUARE] = np.zeros((12, 1))
            pose[SQUARE] = _slopes(poses, values[SQUARE])
        if CREEP in values:
            state[CREEP] = np.zeros((12, 1))
            pose[CREEP] = _slopes(
                lambda one: replace(motion, creep=float(one[0])).at(self.times_s)[0], values[CREEP]
            )
        return state, pose

    def _small(self, inertia: Array, lengths_m: Array, drag: Array) -> Small:
        return small_oscillations(self.model, self.rest, self.chart.free, lengths_m, inertia, drag)

    def _motion(self, small: Small, start: Array, creep: float) -> SmallMotion:
        first_s, last_s = self.span_s
        asked = self.chart.free, self.rest, start, first_s, last_s - first_s
        return SmallMotion(small, *asked, creep)

    def _responses(  # type: ignore[override]
        self, motion: SmallMotion, values: Mapping[str, Array]
    ) -> tuple[Responses, Responses]:
        inertia, lengths = specific(self.total(values)), self.lengths(values)
        drag, start = values["effects"], values["start"]

        def poses(inertia: Array, lengths_m: Array, drag: Array, start: Array) -> Array:
            small = _rescaled(self._small(inertia, lengths_m, drag), values)
            return self._motion(small, start, motion.creep).at(self.times_s)[0]

        def poses_of_start(numbers: Array) -> Array:
            return replace(motion, start=numbers).at(self.times_s)[0]

        by_pose = Responses(
            _slopes(poses_of_start, start),
            _slopes(lambda one: poses(inertia, one, drag, start), lengths),
            _slopes(lambda one: poses(inertia, lengths, one, start), drag),
            _slopes(lambda one: poses(one, lengths, drag, start), inertia, flat=3),
        )
        half = len(start) // 2
        first = np.zeros((12, len(start)))
        first[:6, :half] = first[6:, half:] = self.chart.free
        nothing = (np.zeros((12, len(one))) for one in (lengths, drag, inertia))
        return Responses(first, *nothing), by_pose


def _rescaled(small: Small, values: Mapping[str, Array]) -> Small:
    """Oscillations whose frequency changes with the true amplitude, not that of assumed gains."""
    if SQUARE not in values:
        return small
    return replace(small, bent=small.bent * float(values[SQUARE][0]))


def _creep(values: Mapping[str, Array]) -> float:
    return float(values[CREEP][0]) if CREEP in values else 0.0


def _slopes(poses: Callable[[Array], Array], about: Array, flat: int = 0) -> Array:
    """Slopes of poses (n, 6) by some numbers (k,), by differences, (n, 6, k).

    Args:
        poses: of the numbers.
        about: where.
        flat: so many of the first are taken from both sides: there the slope may be near zero.
    """
    here, found = poses(about), []
    for k, value in enumerate(about):
        step = np.zeros(len(about))
        step[k] = STEP * max(1.0, abs(float(value)))
        behind, width = (poses(about - step), 2.0) if k < flat else (here, 1.0)
        found.append((poses(about + step) - behind) / (width * step[k]))
    return np.stack(found, axis=-1)
