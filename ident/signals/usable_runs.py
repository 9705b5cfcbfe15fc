"""Recorded runs made ready: signals, lengths, free coordinates, motions; and why some are not."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from freeswing.cdpr.model.batch import evaluate
from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.model.free_motion import (
    amplification,
    assemble,
    choose_free_coordinates,
    coordinate_indices,
)
from freeswing.cdpr.model.regressor import SwingMotion
from freeswing.cdpr.robot import POSE_COORDINATES, Array, Robot
from freeswing.cdpr.system.progress import Progress
from freeswing.ident.likelihood.rest_pose import rest_near
from freeswing.ident.runs import DroppedRun, Payload, SwingRun
from freeswing.ident.signals.derivatives import (
    Signals,
    SignalSettings,
    UnusableRunError,
    signals_of,
)
from freeswing.ident.signals.motions import free_motion, full_motion

# Poses move this many times more than the free coordinates: noise of 0.1 mm becomes 2 mm, a tenth
# of a usual swing.
LARGEST_AMPLIFICATION = 20.0
_LEAD_IN = 40
# A velocity over its smoothed noise: below, the equations' noise is larger than a fifth of
# themselves.
LEAST_SIGNAL = 5.0


@dataclass(frozen=True, slots=True)
class PreparedRun:
    """A run that can serve, in one or both ways.

    Attributes:
        run: as recorded.
        signals: of all coordinates that were measured.
        lengths_m: stated cable lengths, or the run's own from its poses, (n,).
        full: the motion by full poses, None where they were not measured.
        free: the motion by free coordinates alone, None where these cannot serve.
        free_signals: what `free` was made from.
        why_not_free: why `free` is None, with the number.
    """

    run: SwingRun
    signals: Signals
    lengths_m: Array
    full: SwingMotion | None
    free: SwingMotion | None
    free_signals: Signals | None
    why_not_free: str = ""

    @property
    def name(self) -> str:
        """The run's name."""
        return self.run.name


@dataclass(frozen=True, slots=True)
class PreparedRuns:
    """All runs.

    Attributes:
        free: the free coordinates.
        amplification: how many times more the pose moves than they do, at worst over the runs.
        runs: those that can serve.
        dropped: the others.
    """

    free: tuple[str, ...]
    amplification: float
    runs: tuple[PreparedRun, ...]
    dropped: tuple[DroppedRun, ...]


def prepare_runs(
    runs: list[SwingRun],
    model: Model,
    settings: SignalSettings,
    progress: Progress | None = None,
) -> PreparedRuns:
    """Smooth every run and work out its motion.

    Raises:
        ValueError: when the free coordinates cannot be settled, with the remedy.
    """
    found: list[tuple[SwingRun, Signals]] = []
    dropped: list[DroppedRun] = []
    for i, run in enumerate(runs):
        if progress:
            progress("samples to signals", i / len(runs))
        try:
            found.append((run, _checked_signals(run, settings)))
        except UnusableRunError as error:
            dropped.append(DroppedRun(run.name, str(error)))
    free = _free_coordinates(model, [signals for _, signals in found])
    prepared: list[PreparedRun] = []
    worst = 0.0
    for run, signals in found:
        try:
            one, amount = _prepared(model, run, signals, free)
        except UnusableRunError as error:
            dropped.append(DroppedRun(run.name, str(error)))
            continue
        worst = max(worst, amount)
        prepared.append(one)
    return PreparedRuns(free, worst, tuple(prepared), tuple(dropped))


def guessed_inertia(robot: Robot) -> Array:
    """Nominal inertia, or one of a body as large as the attachments spread, hung below them, (9,).

    Good enough to tell which way the platform hangs; never a result.

    Source:
        Featherstone 2008, Rigid Body Dynamics Algorithms, sec. 2.13: a solid ball about its
        centre.
    """
    if robot.inertia is not None:
        return robot.inertia
    attachments = robot.attachments_m
    size = float(np.sqrt(np.mean(np.sum((attachments - attachments.mean(axis=0)) ** 2, axis=1))))
    down = robot.gravity_m_s2 / np.linalg.norm(robot.gravity_m_s2)
    com = robot.platform.com_m
    if com is None:
        com = attachments.mean(axis=0) + 0.3 * max(size, 0.05) * down
    tensor = 0.4 * max(size, 0.05) ** 2 * np.eye(3) + (com @ com) * np.eye(3) - np.outer(com, com)
    return np.concatenate([com, np.diag(tensor), [tensor[0, 1], tensor[0, 2], tensor[1, 2]]])


def _checked_signals(run: SwingRun, settings: SignalSettings) -> Signals:
    """Signals of a run that swings at all.

    Raises:
        UnusableRunError: also when its motion does not stand out from its noise.
    """
    signals = signals_of(run, settings)
    n_c = len(signals.coordinates)
    noise = np.sqrt(signals.covariances.diagonal(axis1=1, axis2=2)[:, n_c : 2 * n_c].mean(axis=0))
    speed = np.sqrt(np.mean(signals.velocities**2, axis=0))
    with np.errstate(divide="ignore", invalid="ignore"):
        over = np.where(noise > 0.0, speed / noise, np.inf)
    best = int(np.argmax(over))
    if not over[best] >= LEAST_SIGNAL:
        raise UnusableRunError(
            f"it hardly moves: its velocity is {over[best]:.1f} times the noise at most "
            f"(in {signals.coordinates[best]}), {LEAST_SIGNAL:g} times are needed; swing wider"
        )
    return signals


def _free_coordinates(model: Model, signals: list[Signals]) -> tuple[str, ...]:
    """As declared, or as measured, or else chosen for the smallest amplification."""
    n_free = 6 - model.robot.n_cables
    declared = model.robot.free_coordinates
    if declared is not None:
        return declared
    measured = {one.coordinates for one in signals if one.coordinates != POSE_COORDINATES}
    if len(measured) == 1 and len(next(iter(measured))) == n_free:
        return next(iter(measured))
    if measured:
        raise ValueError(
            f"the runs measure {sorted(measured)}: name the {n_free} free coordinates in the robot "
            "file (free_coordinates)"
        )
    poses = [one.values[:: max(1, len(one.values) // 10)] for one in signals]
    if not poses:
        return POSE_COORDINATES[:n_free]
    return choose_free_coordinates(model, np.concatenate(poses))[0]


def _prepared(
    model: Model, run: SwingRun, signals: Signals, free: tuple[str, ...]
) -> tuple[PreparedRun, float]:
    """One run's motions and the amplification of its free coordinates."""
    if run.lengths_m is not None and len(run.lengths_m) != model.robot.n_cables:
        raise UnusableRunError(
            f"cable_lengths_m holds {len(run.lengths_m)} lengths, the robot has "
            f"{model.robot.n_cables} cables"
        )
    full = None
    if signals.coordinates == POSE_COORDINATES:
        full = full_motion(model, signals, free, run.lengths_m)
        lengths, poses = full.lengths_m, full.zetas
    elif run.lengths_m is None:
        raise UnusableRunError(
            f"it measures {', '.join(signals.coordinates)} alone and cable_lengths_m is not given: "
            "give the lengths that the winches held, or measure full poses"
        )
    else:
        lengths, poses = run.lengths_m, None
    missing = [name for name in free if name not in signals.coordinates]
    if missing:
        raise UnusableRunError(f"its free coordinates {', '.join(missing)} were not measured")
    selected = signals.select(free)
    try:
        start = _start_pose(model, selected, lengths) if poses is None else poses[0]
        motion = free_motion(model, selected, lengths, start)
        amount = float(amplification(model, free, motion.zetas).max())
        if not amount <= LARGEST_AMPLIFICATION:
            raise UnusableRunError(_amplified_sentence(free, amount))
    except (ValueError, np.linalg.LinAlgError) as error:
        why, amount = str(error), 0.0
        if full is not None:
            amount = float(amplification(model, free, full.zetas).max())
            why = _amplified_sentence(free, amount) if amount > LARGEST_AMPLIFICATION else why
        return PreparedRun(run, signals, lengths, full, None, None, why), amount
    return PreparedRun(run, signals, lengths, full, motion, selected), amount


def _amplified_sentence(free: tuple[str, ...], amount: float) -> str:
    return (
        f"the pose moves up to {amount:.3g} times more than its free coordinates "
        f"{', '.join(free)} (limit {LARGEST_AMPLIFICATION:g}): their noise swamps it; measure "
        'other coordinates there, or set free_coordinates = "auto"'
    )


def _start_pose(model: Model, signals: Signals, lengths_m: Array) -> Array:
    """The pose at the first sample of free coordinates, from the equilibrium at these lengths."""
    inertia = guessed_inertia(model.robot)
    columns, means = coordinate_indices(signals.coordinates), signals.values.mean(axis=0)
    rest = rest_near(model, lengths_m, inertia, columns, means, signals.run).zeta
    # From rest to the first sample in small steps, so as to stay in the same assembly mode.
    home = rest[coordinate_indices(signals.coordinates)]
    path = home + np.linspace(0.0, 1.0, _LEAD_IN)[:, None] * (signals.values[0] - home)
    return assemble(model, signals.coordinates, lengths_m, path, rest).zetas[-1]


def length_differences(model: Model, prepared: PreparedRun) -> Array | None:
    """Stated minus pose-derived cable lengths, (n,), where both are there."""
    if prepared.full is None or prepared.run.lengths_m is None:
        return None
    own = evaluate(model.lengths, prepared.full.zetas, model.start_values)[0].mean(axis=0)
    return prepared.run.lengths_m - own


def without(prepared: PreparedRuns, names: dict[str, str]) -> PreparedRuns:
    """The same without some runs, which are added to the dropped ones with their reasons."""
    return replace(
        prepared,
        runs=tuple(run for run in prepared.runs if run.name not in names),
        dropped=prepared.dropped + tuple(DroppedRun(run, why) for run, why in names.items()),
    )


def motion_of(run: PreparedRun, full: bool) -> SwingMotion:
    """The motion by full poses or by free coordinates.

    Raises:
        ValueError: where the run has none, with the reason.
    """
    motion = run.full if full else run.free
    if motion is None:
        raise ValueError(f"run {run.name}: {run.why_not_free or 'full poses were not measured'}")
    return motion


def signals_used(run: PreparedRun, full: bool) -> Signals:
    """What that motion was made from."""
    return run.signals if full or run.free_signals is None else run.free_signals


def usable(prepared: PreparedRuns, full: bool, payload: Payload | None) -> list[PreparedRun]:
    """Runs to identify from, with this payload, that have the motion asked for."""
    return [
        run
        for run in prepared.runs
        if run.run.role == "identify"
        and _same_payload(run.run.payload, payload)
        and (run.full if full else run.free) is not None
    ]


def fittable(prepared: PreparedRuns, full: bool) -> list[PreparedRun]:
    """Runs whose samples can be fitted, with payloads or not.

    A singularity of the free coordinates is no obstacle.
    """
    return [
        run
        for run in prepared.runs
        if run.run.role == "identify"
        and (run.full is not None if full else set(prepared.free) <= set(run.signals.coordinates))
    ]


def _same_payload(one: Payload | None, other: Payload | None) -> bool:
    if one is None or other is None:
        return one is other
    return one.mass_kg == other.mass_kg and bool((one.position_m == other.position_m).all())


def left_out(prepared: PreparedRuns, full: bool) -> tuple[DroppedRun, ...]:
    """Runs left out of an estimate, those included that lack its motion."""
    if full:
        return prepared.dropped
    own = tuple(DroppedRun(r.name, r.why_not_free) for r in prepared.runs if r.free is None)
    return prepared.dropped + own
