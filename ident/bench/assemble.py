"""A bench session as unknowns and swings: what is looked for, what is known of it beforehand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.robot import POSE_COORDINATES, Array, Robot
from freeswing.ident.bench.averaged import averaged
from freeswing.ident.bench.channels import Channel
from freeswing.ident.bench.chart import Chart
from freeswing.ident.bench.first_guesses import (
    Glimpse,
    best_size,
    first_gains,
    glimpse,
    sight,
    thinned,
)
from freeswing.ident.bench.from_rest import zero_blocks
from freeswing.ident.bench.held_uncertain import named_sway, reference
from freeswing.ident.bench.modal import ModalSwing
from freeswing.ident.bench.objects import body_of, moments, specific
from freeswing.ident.bench.priors.body_priors import extent, load_block, platform_block
from freeswing.ident.bench.priors.channel_priors import channel_blocks
from freeswing.ident.bench.priors.motion_priors import (
    amplitude_block,
    creep_block,
    loose_coordinates,
    starts_block,
)
from freeswing.ident.bench.priors.wire_priors import (
    EACH_LENGTH,
    UNSTATED_LENGTH_STD_M,
    WRONG_LENGTH,
    centred_block,
)
from freeswing.ident.bench.runs import Bench, BenchRun, Load
from freeswing.ident.bench.swing import COMMON, BenchSwing, Column, Riding
from freeswing.ident.likelihood.unknowns import Gaussian, Unknown, Unknowns
from freeswing.ident.signals.usable_runs import guessed_inertia

EFFECTS = ("rotational_drag", "translational_drag")  # air is never absent
UNIT_NOISE_M, UNIT_NOISE_RAD = 1e-4, 5e-4
SCANNED_RUNS = 4


Gains = Mapping[str, Array]


@dataclass(frozen=True, slots=True)
class Assembled:
    """A fit made ready.

    Attributes:
        swings: one a run.
        unknowns: with their first values.
        prior: the same before anything was fitted, for what rests on the prior alone.
        runs: as recorded, in the order of the swings.
    """

    swings: tuple[BenchSwing, ...]
    unknowns: Unknowns
    runs: tuple[BenchRun, ...]


@dataclass(frozen=True, slots=True)
class Guess:
    """First bodies: the platform's and every load's `BODY_NAMES` values."""

    platform: Array
    loads: Mapping[str, Array]

    def total(self, run: BenchRun) -> Array:
        """Moments about P of all that a run carries, (10,)."""
        found = moments(self.platform)
        for one in run.payloads:
            found = found + moments(one.body)
        for placed in run.loads:
            found = found + moments(self.loads[placed.load], placed.turn, placed.shift_m)
        return found


def columns_of(run: BenchRun, channels: Sequence[Channel]) -> tuple[Column, ...]:
    """A run's signals as columns of the fit: coordinates, and the channels that it holds."""
    by_column = {channel.column: channel for channel in channels}
    found = []
    for signal in run.signals:
        if signal.is_coordinate:
            place = POSE_COORDINATES.index(signal.column)
            unit = UNIT_NOISE_M if place < 3 else UNIT_NOISE_RAD
            std = np.full(len(signal.values), unit) if signal.std is None else signal.std
            found.append(Column(signal.column, signal.values, std, place, place_m=signal.place_m))
        elif signal.column in by_column:
            channel = by_column[signal.column]
            spread = float(np.nanstd(signal.values)) or 1.0
            std = np.full(len(signal.values), 0.02 * spread) if signal.std is None else signal.std
            found.append(Column(channel.name, signal.values, std, channel=channel))
    return tuple(found)


def first_guess(
    model: Model,
    bench: Bench,
    runs: Sequence[BenchRun],
    columns: Sequence[tuple[Column, ...]],
    gains: Gains,
) -> Guess:
    """The platform's tensor, then every load's, by what their runs' first seconds say."""
    robot = model.robot
    mass = robot.platform.mass_kg or 1.0
    start = body_of(mass, guessed_inertia(robot))
    loads = {load.name: _guessed_load(load, robot) for load in bench.loads}
    guess = Guess(start, loads)
    without = [k for k, run in enumerate(runs) if not run.loads]
    if without:
        size = _scanned(model, guess, runs, columns, without, gains, "platform")
        guess = _resized(guess, "platform", size)
    for load in bench.loads:
        mine = [k for k, run in enumerate(runs) if [one.load for one in run.loads] == [load.name]]
        if mine:
            size = _scanned(model, guess, runs, columns, mine, gains, load.name)
            guess = _resized(guess, load.name, size)
    return guess


def _scanned(
    model: Model,
    guess: Guess,
    runs: Sequence[BenchRun],
    columns: Sequence[tuple[Column, ...]],
    which: Sequence[int],
    gains: Gains,
    name: str,
) -> float:
    chosen = thinned(which, SCANNED_RUNS)
    views = [
        sight(
            model,
            runs[k].name,
            _lengths(runs[k]),
            specific(guess.total(runs[k])),
            runs[k].times_s,
            columns[k],
            gains,
        )
        for k in chosen
    ]

    def inertia_of(index: int, size: float) -> Array:
        return specific(_resized(guess, name, size).total(runs[chosen[index]]))

    return best_size(model, views, inertia_of)


def _resized(guess: Guess, name: str, size: float) -> Guess:
    factors = np.concatenate([np.ones(4), np.full(6, size)])
    if name == "platform":
        return replace(guess, platform=guess.platform * factors)
    return replace(guess, loads={**guess.loads, name: guess.loads[name] * factors})


def _guessed_load(load: Load, robot: Robot) -> Array:
    com = np.zeros(3) if load.com_m is None else load.com_m
    size = 0.1 * load.mass_kg * extent(robot) ** 2
    return np.concatenate([[load.mass_kg], com, [size, size, size, 0.0, 0.0, 0.0]])


def _lengths(run: BenchRun) -> Array:
    if run.lengths_m is None:
        raise ValueError(
            f"run {run.name}: it measures less than a pose and cable_lengths_m is not given: give "
            "the wires' lengths"
        )
    return run.lengths_m


def assembled(model: Model, bench: Bench, runs: Sequence[BenchRun]) -> Assembled:
    """The fit of some runs, ready to start.

    Raises:
        ValueError: when no motion of a run can be started, naming it.
    """
    runs = [averaged(run) for run in runs]
    columns = [columns_of(run, bench.channels) for run in runs]
    gains = {
        channel.name: first_gains(channel, held, place)
        for place, channel in enumerate(bench.channels)
        if (held := [one for seen in columns for one in seen if one.channel == channel])
    }
    guess = first_guess(model, bench, runs, columns, gains)
    wires = _wire_groups(runs)
    swings, glimpses = [], []
    # Without a measured coordinate in any run the motion's scale is not known: see modal.py.
    kind = BenchSwing if any(run.coordinates for run in runs) else ModalSwing
    for run, seen, name in zip(runs, columns, wires, strict=True):
        inertia = specific(guess.total(run))
        view = sight(model, run.name, _lengths(run), inertia, run.times_s, seen, gains)
        first = glimpse(model, view, inertia)
        swing = _swing(kind, model, run, seen, first, name)
        swings.append(replace(swing, place=len(swings)))
        glimpses.append(first)
    unknowns = _unknowns(model, bench, runs, swings, glimpses, guess, gains)
    return Assembled(tuple(swings), unknowns, tuple(runs))


def _wire_groups(runs: Sequence[BenchRun]) -> list[str]:
    """Runs that state the same lengths hang on the same wires, and share what is wrong there."""
    groups: dict[tuple[float, ...], str] = {}
    for run in runs:
        groups.setdefault(tuple(_lengths(run)), f"wires.{len(groups) + 1}")
    return [groups[tuple(_lengths(run))] for run in runs]


def _swing(
    kind: type[BenchSwing],
    model: Model,
    run: BenchRun,
    columns: tuple[Column, ...],
    first: Glimpse,
    wires: str,
) -> BenchSwing:
    noisy = []
    for column, left in zip(columns, first.residuals, strict=True):
        guessed = column.channel is not None and len(set(column.std)) == 1
        std = np.full(len(column.std), left) if guessed and left > 0.0 else column.std
        noisy.append(replace(column, std=std))
    riding = [Riding("platform", np.eye(3), np.zeros(3))]
    riding += [Riding(f"load.{one.load}", one.turn, one.shift_m) for one in run.loads]
    known = sum((moments(one.body) for one in run.payloads), np.zeros(10))
    chart = Chart.about(model, first.rest.zeta)
    return kind(
        name=run.name,
        model=model,
        times_s=run.times_s,
        columns=tuple(noisy),
        lengths_m=_lengths(run),
        wires=wires,
        rest=first.rest.zeta,
        chart=chart,
        riding=tuple(riding),
        known=known,
        loose=loose_coordinates(columns, _lengths(run)),
        level_std_rad=run.level_std_rad,
    )


def _unknowns(
    model: Model,
    bench: Bench,
    runs: Sequence[BenchRun],
    swings: Sequence[BenchSwing],
    glimpses: Sequence[Glimpse],
    guess: Guess,
    gains: Gains,
) -> Unknowns:
    robot = model.robot
    blocks = [platform_block(robot, bench, runs, guess.platform)]
    blocks += [load_block(bench.load(name), robot, body) for name, body in guess.loads.items()]
    blocks.append(_effects(model, len(runs)))
    for name in dict.fromkeys(swing.wires for swing in swings):
        run = runs[[swing.wires for swing in swings].index(name)]
        std = run.lengths_std_m or UNSTATED_LENGTH_STD_M
        blocks.append(centred_block(name, np.zeros(robot.n_cables), std, "cable_lengths_std_m"))
    mean = float(np.mean([_lengths(run) for run in runs]))
    blocks.append(centred_block(COMMON, np.zeros(1), WRONG_LENGTH * mean, "wires as sway has them"))
    each = EACH_LENGTH * mean
    zero = np.zeros((len(runs), robot.n_cables))
    blocks.append(centred_block("wires_each", zero, each, "wires between runs", each_run=True))
    blocks.append(starts_block(swings, glimpses))
    for place, channel in enumerate(bench.channels):
        if channel.name in gains:
            named = named_sway(bench, runs, place)
            blocks += channel_blocks(channel, swings, glimpses, gains[channel.name], named)
    blocks += zero_blocks(_places(swings), len(runs))
    if any(isinstance(swing, ModalSwing) for swing in swings):
        blocks.append(creep_block(len(runs)))
    scaled = reference(bench, runs)
    if scaled is not None:
        blocks.append(amplitude_block(scaled))
    return Unknowns(tuple(blocks))


def _places(swings: Sequence[BenchSwing]) -> dict[int, Array]:
    """The point that a camera from above followed, by the coordinates that it gave."""
    return {
        column.coordinate: column.place_m
        for swing in swings
        for column in swing.columns
        if column.coordinate is not None and column.place_m is not None
    }


def _effects(model: Model, runs: int) -> Unknown:
    """Drag, which each run has for itself: what it acts on differs with the load."""
    start = model.start_values
    spread = np.array([parameter.prior_std for parameter in model.parameters])
    scale = np.array([parameter.scale for parameter in model.parameters])
    rates = np.array([parameter.amplitude for parameter in model.parameters])
    values = np.tile(start, (runs, 1))
    prior = Gaussian(start, spread, "plausible drag")
    return Unknown("effects", values, scale, prior, rates, each_run=True)
