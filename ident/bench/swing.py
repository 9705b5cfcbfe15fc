"""A run of a bench as the fit sees it: what was measured against a simulated swing.

Every measured column is one coordinate or one channel, each with its own noise and its own gaps.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple, Self

import numpy as np

from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.robot import Array
from freeswing.cdpr.simulation.free_swing import Motion, simulate
from freeswing.cdpr.simulation.sensitivity import linearise
from freeswing.ident.bench.channels import Channel
from freeswing.ident.bench.chart import Chart
from freeswing.ident.bench.from_rest import from_rest, from_rest_slope
from freeswing.ident.bench.objects import moments, moments_slope, specific, specific_slope
from freeswing.ident.bench.two_wires.level import lean

TOLERANCE_M = 1e-7  # a thousandth of the best tracks' noise
IZZ = 6  # of the ten moments
COMMON = "wires_common"  # block: by what all wires of all runs differ from what is stated, (1,)


@dataclass(frozen=True, slots=True)
class Column:
    """One measured column of a run.

    Attributes:
        name: of the coordinate or the channel.
        values: (n,); NaN: not measured.
        std: stated or assumed noise of every sample, (n,).
        coordinate: its place in the pose; None for a channel.
        channel: the channel; None for a coordinate.
        factor: on the noise, from the residuals: their size, and their colour.
        place_m: as `Signal.place_m`: the coordinate is that of this point, from an unknown zero.
    """

    name: str
    values: Array
    std: Array
    coordinate: int | None = None
    channel: Channel | None = None
    factor: float = 1.0
    place_m: Array | None = None

    @property
    def known(self) -> Array:
        """Which samples there are, (n,)."""
        return np.isfinite(self.values)


@dataclass(frozen=True, slots=True)
class Riding:
    """A body on the platform in a run: its block of unknowns, and how it is placed.

    Attributes:
        block: name of the unknowns.
        turn: R_platform_body, (3, 3).
        shift_m: its origin in the platform frame, (3,).
    """

    block: str
    turn: Array
    shift_m: Array


@dataclass(frozen=True, slots=True)
class Acting:
    """An effect that all runs share: its block of unknowns, and what it is in this run.

    Attributes:
        block: name of the unknowns.
        matrix: from them to the model's values after those of drag, (k, size).
    """

    block: str
    matrix: Array


class Responses(NamedTuple):
    """Derivatives (.., size) of a state or of poses by what moves them.

    Attributes:
        start: by the numbers of the start.
        lengths: by the wires' lengths.
        effects: by drag.
        inertia: by the nine specific numbers.
    """

    start: Array
    lengths: Array
    effects: Array
    inertia: Array


@dataclass(frozen=True, slots=True)
class BenchSwing:
    """One run.

    Attributes:
        name: of the run.
        model: the robot's equations.
        times_s: of the samples, (n,).
        columns: what was measured.
        lengths_m: stated wire lengths, (n_cables,).
        wires: name of the block of what is wrong with them, common to runs on the same wires.
        rest: pose that channels count from, (6,).
        chart: of start states.
        riding: bodies whose inertia is unknown, the platform first.
        known: moments (10,) of known payloads.
        loose: how far from rest each coordinate may start, (6,); infinite where it is measured.
        place: of the run among those of the fit.
        acting: effects beside drag, in a model that has them.
        level_std_rad: how well it was seen to hang level, on two wires; None: nobody looked.
    """

    name: str
    model: Model
    times_s: Array
    columns: tuple[Column, ...]
    lengths_m: Array
    wires: str
    rest: Array
    chart: Chart
    riding: tuple[Riding, ...]
    known: Array
    loose: Array
    place: int = 0
    acting: tuple[Acting, ...] = ()
    level_std_rad: float | None = None

    @property
    def span_s(self) -> tuple[float, float]:
        """First and last sample."""
        return float(self.times_s[0]), float(self.times_s[-1])

    def until(self, end_s: float) -> Self:
        """The run up to some time."""
        inside = self.times_s <= end_s
        columns = (
            replace(column, values=column.values[inside], std=column.std[inside])
            for column in self.columns
        )
        return replace(self, times_s=self.times_s[inside], columns=tuple(columns))

    def total(self, values: Mapping[str, Array]) -> Array:
        """Mass, first moments and tensor about P of everything that swings, (10,)."""
        found = np.array(self.known)
        for one in self.riding:
            found += moments(values[one.block], one.turn, one.shift_m)
        if "scatter" in values:
            found[IZZ] += values["scatter"][self.place]
        return found

    def lengths(self, values: Mapping[str, Array]) -> Array:
        """Wire lengths, (n,)."""
        found = self.lengths_m + values[self.wires] + values.get(COMMON, np.zeros(1))
        return found + values["wires_each"] if "wires_each" in values else found

    def effects(self, values: Mapping[str, Array]) -> Array:
        """The model's values: the run's own drag, then what all runs share, (k,)."""
        own = values["effects"]
        if not self.acting:
            return own
        shared = self.model.start_values[len(own) :]
        for one in self.acting:
            shared = shared + one.matrix @ values[one.block]
        return np.concatenate([own, shared])

    def simulated(self, values: Mapping[str, Array]) -> Motion:
        """The simulated swing.

        Raises:
            ValueError: naming the run, where it cannot be followed.
        """
        total = self.total(values)
        if not total[0] > 0.0:
            raise ValueError(f"run {self.name}: a mass of {total[0]:.3g} kg")
        inertia, effects = specific(total), self.effects(values)
        start_s = self.span_s[0]
        lengths = self.lengths(values)
        try:
            state = self.chart.state(values["start"], lengths, start_s, inertia, effects)
            return simulate(
                self.model, state[:6], state[6:], self.span_s, inertia, effects, TOLERANCE_M
            )
        except (ValueError, np.linalg.LinAlgError) as error:
            raise ValueError(f"run {self.name}: {error}") from error

    def residuals(self, values: Mapping[str, Array], motion: Motion) -> Array:
        """Whitened prediction minus measurement of all known samples, (m,)."""
        moved = motion.at(self.times_s)[0]
        off = [self._off(column, moved, values) for column in self.columns]
        return np.concatenate([*off, self._astray(motion), self._leaning(values)[0]])

    def linearised(
        self, values: Mapping[str, Array], motion: Motion
    ) -> tuple[Array, dict[str, Array]]:
        """The same, and its slopes by every block that it knows."""
        zetas = motion.at(self.times_s)[0]
        state, change = self._changes(motion, values)
        sizes = {name: len(np.atleast_1d(value)) for name, value in values.items()}
        off, rows = [], []
        for column in self.columns:
            white = (column.factor * column.std)[column.known]
            slope, own = self._slope(column, zetas, values)
            known = column.known
            by_block = {
                name: np.einsum("nc,ncs->ns", slope[known], part[known]) / white[:, None]
                for name, part in change.items()
            }
            by_block |= {name: part[known] / white[:, None] for name, part in own.items()}
            rows.append(by_block)
            off.append(self._off(column, zetas, values))
        off.append(self._astray(motion))
        _, places, spread = self._reach()
        rows.append({name: part[places] / spread[:, None] for name, part in state.items()})
        leaning, by_total = self._leaning(values)
        off.append(leaning)
        rows.append(self._by_body(by_total, values))
        names = {name for row in rows for name in row}
        stacked = {
            name: np.vstack(
                [
                    row.get(name, np.zeros((len(part), sizes[name])))
                    for row, part in zip(rows, off, strict=True)
                ]
            )
            for name in names
        }
        return np.concatenate(off), stacked

    def _reach(self) -> tuple[Array, Array, Array]:
        """Where unmeasured coordinates rest, their places in [zeta; rates] and their spread."""
        pendulum = np.sqrt(9.81 / float(np.mean(self.lengths_m)))
        spread = np.concatenate([self.loose, pendulum * self.loose])
        places = np.flatnonzero(np.isfinite(spread))
        rest = np.concatenate([self.rest, np.zeros(6)])
        return rest[places], places, spread[places]

    def _astray(self, motion: Motion) -> Array:
        """Distance of the start from rest where nothing measures it, whitened."""
        state = np.concatenate([motion.zetas[0], motion.rates[0]])
        rest, places, spread = self._reach()
        return np.asarray((state[places] - rest) / spread)

    def _leaning(self, values: Mapping[str, Array]) -> tuple[Array, Array]:
        """Roll at rest where a level showed none, whitened, (1,); its slope by moments, (1, 10)."""
        if self.level_std_rad is None:
            return np.zeros(0), np.zeros((0, 10))
        off, slope = lean(self.total(values), self.model.robot)
        return np.array([off]) / self.level_std_rad, slope[None] / self.level_std_rad

    def predicted(self, column: Column, zetas: Array, values: Mapping[str, Array]) -> Array:
        """What a column would read along poses (n, 6), (n,)."""
        if column.channel is None:
            if column.place_m is not None and column.coordinate is not None:
                return from_rest(column.coordinate, zetas, self.rest, values)
            return np.asarray(zetas[:, column.coordinate])
        design = column.channel.design(zetas - self.rest)
        name = column.channel.name
        return np.asarray(values[f"offset.{name}"][0] + design @ values[f"channel.{name}"])

    def _off(self, column: Column, zetas: Array, values: Mapping[str, Array]) -> Array:
        difference = self.predicted(column, zetas, values) - column.values
        return np.asarray((difference / (column.factor * column.std))[column.known])

    def _slope(
        self, column: Column, zetas: Array, values: Mapping[str, Array]
    ) -> tuple[Array, dict[str, Array]]:
        """Derivatives of a column by the pose (n, 6), and by the channel's own blocks."""
        if column.channel is None:
            if column.place_m is not None and column.coordinate is not None:
                return from_rest_slope(column.coordinate, zetas, self.rest, values)
            slope = np.zeros(zetas.shape)
            slope[:, column.coordinate] = 1.0
            return slope, {}
        moved, name = zetas - self.rest, column.channel.name
        slope = column.channel.slopes(moved, values[f"channel.{name}"])
        own = {
            f"offset.{name}": np.ones((len(zetas), 1)),
            f"channel.{name}": column.channel.design(moved),
        }
        return slope, own

    def _changes(
        self, motion: Motion, values: Mapping[str, Array]
    ) -> tuple[dict[str, Array], dict[str, Array]]:
        """Derivatives of the start state (12, size) and of the pose at the samples (n, 6, size).

        By every block that moves them.
        """
        state, pose = self._responses(motion, values)
        return self._by_block(state, values), self._by_block(pose, values)

    def _responses(
        self, motion: Motion, values: Mapping[str, Array]
    ) -> tuple[Responses, Responses]:
        """How the start state, and the pose at the samples, answer to what moves them."""
        by_all = linearise(motion).at(self.times_s)[0]
        by_state, by_rest = by_all[:, :, :12], by_all[:, :, 12:]
        first = np.concatenate([motion.zetas[0], motion.rates[0]])
        by_numbers, by_lengths, start_by_rest = self.chart.slopes(
            first, self.lengths(values), self.span_s[0], motion.inertia, motion.values
        )
        state = Responses(by_numbers, by_lengths, start_by_rest[:, 9:], start_by_rest[:, :9])
        pose = Responses(
            by_state @ by_numbers,
            by_state @ by_lengths,
            by_state @ state.effects + by_rest[:, :, 9:],
            by_state @ state.inertia + by_rest[:, :, :9],
        )
        return state, pose

    def _by_block(self, answer: Responses, values: Mapping[str, Array]) -> dict[str, Array]:
        own = len(values["effects"])
        found = {"start": answer.start, self.wires: answer.lengths}
        found["effects"] = answer.effects[..., :own]
        for one in self.acting:
            found[one.block] = answer.effects[..., own:] @ one.matrix
        if COMMON in values:
            found[COMMON] = answer.lengths.sum(axis=-1, keepdims=True)
        if "wires_each" in values:
            found["wires_each"] = answer.lengths
        total = answer.inertia @ specific_slope(self.total(values))
        return found | self._by_body(total, values)

    def _by_body(self, by_total: Array, values: Mapping[str, Array]) -> dict[str, Array]:
        """Slopes by all that swings from one by its moments, (.., 10)."""
        found: dict[str, Array] = {}
        for one in self.riding:
            part = moments_slope(values[one.block], one.turn, one.shift_m)
            found[one.block] = found.get(one.block, 0.0) + by_total @ part
        if "scatter" in values:
            only = np.zeros((10, len(values["scatter"])))
            only[IZZ, self.place] = 1.0
            found["scatter"] = by_total @ only
        return found
