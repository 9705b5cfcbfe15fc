"""Pulleys that robot.toml gives otherwise than they are: diameters for radii, turned axes.

Locked winches keep the lengths of their cables, to the noise of the poses. A pulley of another size
or on another axis makes them vary by tenths of a millimetre along a run: too little to be seen in
one sample, far more than is left in means, and enough to bend an inertia by many deviations.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from freeswing.cdpr.files.problems import DataError
from freeswing.cdpr.model.batch import evaluate
from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.robot import Array, Cable, Robot
from freeswing.ident.runs import SwingRun
from freeswing.ident.signals.regular_grid import white_noise_std

MEAN_OF_S = 0.1  # platforms swing at 0.3 to 3 Hz: they hardly move, and noise is a third or less
# Variance of the means beyond their noise, over the noise's. A run of 6 s has sixty of them, seven
# runs tell a variance to a fifteenth: more than this is no chance.
LEAST_CHANGE = 1.0
LEAST_RUNS = 3  # each about an equilibrium of its own: one is explained by many an error
LEAST_MEANS = 20  # of which a variance is told to a third
# Of the change beyond the noise that may be left (rms). Ends within a workshop's tolerance leave a
# fifth of what a radius twice too small does; another error in its place keeps most of it.
LEFT_OVER = 0.3


@dataclass(frozen=True, slots=True)
class _Reading:
    """Cables as they may have been meant.

    Attributes:
        said: what is wrong.
        remedy: what to do.
        meant: a cable as it was meant.
    """

    said: str
    remedy: str
    meant: Callable[[Cable], Cable]


def _radius(factor: float) -> Callable[[Cable], Cable]:
    return lambda cable: replace(cable, pulley_radius_m=factor * cable.pulley_radius_m)


def _turned(about: str) -> Callable[[Cable], Cable]:
    """The swivel frame a quarter turn on about one of its own axes."""

    def turned(cable: Cable) -> Cable:
        axes = {"x": cable.swivel_x, "y": cable.swivel_y, "z": cable.swivel_z}
        first, second = {"x": "yz", "y": "zx", "z": "xy"}[about]
        moved = axes | {first: axes[second], second: -axes[first]}
        return replace(cable, **{f"swivel_{name}": axis for name, axis in moved.items()})

    return turned


def _times(turn: Callable[[Cable], Cable], count: int) -> Callable[[Cable], Cable]:
    def turned(cable: Cable) -> Cable:
        for _ in range(count):
            cable = turn(cable)
        return cable

    return turned


READINGS = (
    _Reading(
        "robot.toml has the diameter for the pulley's radius",
        "pulley_radius_m is the groove's radius with half the cable's diameter: half of it",
        _radius(0.5),
    ),
    _Reading(
        "robot.toml has half of the pulley's radius",
        "pulley_radius_m is the groove's radius with half the cable's diameter: twice that",
        _radius(2.0),
    ),
    *(
        _Reading(
            f"robot.toml has the swivel frame turned by {degrees} degrees about its own {about}",
            "see docs/formats.md for swivel_x, swivel_y and swivel_z",
            _times(_turned(about), count),
        )
        for about in "xyz"
        for count, degrees in ((1, -90), (2, 180), (3, 90))
    ),
)


@dataclass(frozen=True, slots=True)
class _Changes:
    """What lengths of the cables do along runs, by the poses.

    Attributes:
        beyond: variance of means over `MEAN_OF_S` about each run's own, less the noise's, (n,), m2.
        noise: variance of these means by the samples' noise, (n,), m2.
        off: mean square of what runs are off their stated lengths, (n,), m2; zero: none stated.
    """

    beyond: Array
    noise: Array
    off: Array


@dataclass(frozen=True, slots=True)
class _Run:
    """Known poses (n, 6) of a run, how many make a mean, and stated lengths."""

    poses: Array
    count: int
    lengths_m: Array | None


def mistaken_cables(swings: Sequence[SwingRun], robot: Robot) -> tuple[str, str]:
    """How pulleys were meant, and what to do; empty where they are right or it cannot be told.

    Each cable tells by itself; the reading that the most of them tell is taken.

    Args:
        swings: runs with locked winches; those without full poses tell nothing.
        robot: as declared.

    Source:
        FIDIM 2022, eq. (3): the length over a pulley, constant along a free swing.
    """
    runs = [run for run in map(_known, swings) if run is not None]
    pulleys = robot.radii_m > 0.0
    if len(runs) < LEAST_RUNS or not pulleys.any():
        return "", ""
    stated = _changes(runs, robot)
    changing = pulleys & (stated.beyond > LEAST_CHANGE * stated.noise)
    if not changing.any():
        return "", ""
    best, told = (0, 0.0), ("", "")
    for reading in READINGS:
        so = _changes(runs, replace(robot, cables=tuple(map(reading.meant, robot.cables))))
        explained = changing & (so.beyond <= LEFT_OVER**2 * stated.beyond) & (so.off <= stated.off)
        rank = int(explained.sum()), -float(so.beyond[explained].sum())
        if explained.any() and rank > best:
            best = rank
            # A cable that hardly changed as stated, and does no more so, is like the others.
            quiet = pulleys & ~changing & (so.beyond <= LEAST_CHANGE * so.noise)
            alike = np.array_equal(explained, changing) and changing.sum() > 1
            cables = explained | quiet if alike else explained
            told = _sentence(reading, robot, cables, stated, so), reading.remedy
    return told


def refuse_mistaken_cables(swings: Sequence[SwingRun], robot: Robot) -> None:
    """Refuse a robot whose pulleys keep the lengths of their cables once they are read otherwise.

    Raises:
        DataError: naming the cables, and what to do.
    """
    said, remedy = mistaken_cables(swings, robot)
    if said:
        raise DataError(f"{said}; {remedy}")


def _sentence(
    reading: _Reading, robot: Robot, cables: Array, stated: _Changes, so: _Changes
) -> str:
    names = ", ".join(robot.cables[k].name for k in np.flatnonzero(cables))
    before, after = (
        1e3 * float(np.sqrt(max(part[cables].mean(), 0.0))) for part in (stated.beyond, so.beyond)
    )
    return (
        f"{reading.said} (cable{'s' if cables.sum() > 1 else ''} {names}): lengths, which locked "
        f"winches keep, change by {before:.2f} mm rms along the runs as stated, by {after:.2f} mm "
        "so, beside the noise"
    )


def _known(run: SwingRun) -> _Run | None:
    """What a run with full poses knows inside its window; None: too little."""
    part = run.known_poses()
    if part is None:
        return None
    count = max(1, round(MEAN_OF_S / float(np.median(np.diff(part.times_s)))))
    stated = run.lengths_m
    return _Run(part.values, count, stated) if len(part) >= LEAST_MEANS * count else None


def _changes(runs: Sequence[_Run], robot: Robot) -> _Changes:
    model, n = build_model(robot), robot.n_cables
    beyond, noise, off = np.zeros((3, len(runs), n))
    for k, run in enumerate(runs):
        lengths = evaluate(model.lengths, run.poses, model.start_values)[0].reshape(-1, n)
        whole = len(lengths) // run.count * run.count
        means = lengths[:whole].reshape(-1, run.count, n).mean(axis=1)
        noise[k] = white_noise_std(lengths) ** 2 / run.count
        beyond[k] = means.var(axis=0, ddof=1) - noise[k]
        if run.lengths_m is not None and len(run.lengths_m) == n:
            off[k] = (lengths.mean(axis=0) - run.lengths_m) ** 2
    return _Changes(beyond.mean(axis=0), noise.mean(axis=0), off.mean(axis=0))
