"""What a bench session is: runs that measure less than a pose, channels, loads, known bodies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from freeswing.cdpr.files.problems import DataError
from freeswing.cdpr.robot import POSE_COORDINATES, Array
from freeswing.ident.bench.channels import Channel

STILL = 1.5  # of the noise between neighbours: noise alone spreads by 1, five samples a swing by 2

Role = Literal["identify", "validate"]


@dataclass(frozen=True, slots=True)
class Signal:
    """One measured column of a run.

    Attributes:
        column: its name in the file: a coordinate of the pose, or a channel's column.
        values: (n,), NaN where not measured.
        std: stated noise, (n,), or None.
        place_m: the platform's point that a camera from above followed, (3,): x, y and chi then
            count from an unknown zero; None: a coordinate of P in the base frame.
    """

    column: str
    values: Array
    std: Array | None = None
    place_m: Array | None = None

    @property
    def is_coordinate(self) -> bool:
        """Whether it is one of x y z phi theta chi."""
        return self.column in POSE_COORDINATES


@dataclass(frozen=True, slots=True)
class KnownBody:
    """A payload: known mass, place and own inertia, platform frame.

    Attributes:
        mass_kg: > 0.
        position_m: its centre of mass, (3,).
        inertia_kg_m2: xx yy zz xy xz yz about that centre, (6,); zeros: a point.
    """

    mass_kg: float
    position_m: Array
    inertia_kg_m2: Array

    @property
    def body(self) -> Array:
        """`BODY_NAMES` values, (10,)."""
        return np.concatenate([[self.mass_kg], self.position_m, self.inertia_kg_m2])


@dataclass(frozen=True, slots=True)
class Load:
    """An object to be measured.

    Attributes:
        name: label.
        mass_kg: weighed.
        mass_std_kg: how well, or None: exactly.
        com_m: where its centre of mass should be, own frame, (3,), or None: unknown.
        com_std_m: how well, (3,), or None.
    """

    name: str
    mass_kg: float
    mass_std_kg: float | None = None
    com_m: Array | None = None
    com_std_m: Array | None = None


@dataclass(frozen=True, slots=True)
class Placed:
    """A load on the platform: R_platform_load (3, 3) and its origin in the platform frame, (3,)."""

    load: str
    turn: Array
    shift_m: Array


@dataclass(frozen=True, slots=True)
class BenchRun:
    """One recorded swing of a bench.

    Attributes:
        name: label.
        role: `identify`, or `validate`: never fitted.
        times_s: (n,), increasing.
        signals: what was measured.
        lengths_m: wire lengths, (n_cables,), or None: from full poses.
        lengths_std_m: how well they are known, or None.
        window_s: the free motion, or None: all of it, or as found.
        payloads: known bodies on the platform.
        loads: objects to be measured on it.
        level_std_rad: how well it was seen to hang level at rest, on two wires, or None.
        notes: what its recording's reader left out, one sentence each.
    """

    name: str
    role: Role
    times_s: Array
    signals: tuple[Signal, ...]
    lengths_m: Array | None = None
    lengths_std_m: float | None = None
    window_s: tuple[float, float] | None = None
    payloads: tuple[KnownBody, ...] = ()
    loads: tuple[Placed, ...] = ()
    level_std_rad: float | None = None
    notes: tuple[str, ...] = ()

    @property
    def coordinates(self) -> tuple[str, ...]:
        """The pose coordinates that it measures, in the pose's order."""
        mine = {signal.column for signal in self.signals if signal.is_coordinate}
        return tuple(name for name in POSE_COORDINATES if name in mine)


@dataclass(frozen=True, slots=True)
class Bench:
    """A bench session beside its robot.

    Attributes:
        runs: all of them.
        channels: uncalibrated signals that runs may hold.
        loads: objects to be measured.
        mass_std_kg: how well the robot file's platform mass is known, or None: trusted.
    """

    runs: tuple[BenchRun, ...]
    channels: tuple[Channel, ...] = ()
    loads: tuple[Load, ...] = ()
    mass_std_kg: float | None = None

    def load(self, name: str) -> Load:
        """The load of that name."""
        return next(load for load in self.loads if load.name == name)


def check_swings(run: BenchRun) -> None:
    """Refuses a run whose coordinates stand still: its noise would be taken for nothing.

    A yaw of the same number throughout made a session 94 % wrong, and sure.

    Args:
        run: any; one with channels is looked at by theirs.

    Raises:
        DataError: naming the run, and the columns or the one that never changes.
    """
    mine = [signal for signal in run.signals if signal.is_coordinate]
    for signal in mine:
        if not np.nanmax(signal.values) > np.nanmin(signal.values):
            raise DataError(
                f"run {run.name}: column {signal.column} is the same number throughout, which no "
                "sensor gives: leave it out"
            )
    if mine and len(mine) == len(run.signals) and not any(_moves(one.values) for one in mine):
        names = ", ".join(signal.column for signal in mine)
        raise DataError(
            f"run {run.name}: nothing moves above its noise in {names}: twist wider, or leave the "
            "run out"
        )


def _moves(values: Array) -> bool:
    """Whether a column's spread is more than the noise between its neighbours."""
    known = values[np.isfinite(values)]
    noise = float(np.std(np.diff(known, 2))) / np.sqrt(6.0)
    return float(np.std(known)) > STILL * noise
