"""From recorded samples to position, velocity and acceleration on common time stamps, with noise.

One linear smoother makes all three, so that the covariance of the recorded samples gives theirs
exactly (white noise in time is the assumption). Samples are used only inside the free motion, and
only where the smoother's whole span is there: nothing is bridged beyond the stated gap.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.frozen import freeze
from freeswing.cdpr.robot import Array
from freeswing.cdpr.rotation import angle_rate_matrix
from freeswing.ident.runs import SwingRun
from freeswing.ident.signals.band import LOWEST_PASS_HZ, best_pass_hz
from freeswing.ident.signals.filters import Smoother, forward_difference_smoother, smoother
from freeswing.ident.signals.jumps import jumps_in
from freeswing.ident.signals.regular_grid import (
    Bridge,
    Grid,
    bridged,
    bridges,
    gaps,
    incomplete,
    regular_grid,
    white_noise_std,
)
from freeswing.ident.signals.window import free_window

Processing = Literal["centred", "authors"]
_ANGLES = ("phi", "theta", "chi")
_LEAST_OUTPUTS = 10  # one more than the nine parameters
_LEVER_M = 0.2  # makes angles comparable to metres where only their relative size matters


class UnusableRunError(ValueError):
    """A run that cannot serve, with the number that says why."""


@dataclass(frozen=True, slots=True)
class SignalSettings:
    """How samples become signals.

    Attributes:
        processing: `centred`, or `authors`: the published one, whose derivatives lag.
        pass_hz: the motion's frequencies lie below; None: chosen from each run's spectrum.
        stop_hz: silent from here on; None: three quarters of the pass band above it, at
            least 5 Hz.
        attenuation_db: sets the smoother's span.
        output_hz: rate after decimation; 0 keeps every sample.
        longest_gap_s: longer gaps stay open.
        largest_missing: share of missing samples at which a run is dropped.
        jump_limit_m: a platform does not jump: the smoother does not reach across larger steps.
        jump_limit_rad: the same of angles.
    """

    processing: Processing = "centred"
    pass_hz: float | None = None
    stop_hz: float | None = None
    attenuation_db: float = 60.0
    output_hz: float = 10.0
    longest_gap_s: float = 0.05
    largest_missing: float = 0.5
    jump_limit_m: float = 0.003
    jump_limit_rad: float = 0.015

    def kernels(self, period_s: float, pass_hz: float = LOWEST_PASS_HZ) -> Smoother:
        """The smoother for samples of this period, of this pass band where none is set."""
        if self.processing == "authors":
            # FIDIM 2022, sec. 5.2: stop band at 10 Hz.
            bands = self.pass_hz or 5.0, self.stop_hz or 10.0
            return forward_difference_smoother(period_s, *bands, self.attenuation_db)
        pass_hz = self.pass_hz or pass_hz
        stop_hz = self.stop_hz or pass_hz + max(5.0, 0.75 * pass_hz)
        return smoother(period_s, pass_hz, stop_hz, self.attenuation_db)


@dataclass(frozen=True, slots=True)
class Signals:
    """A run's free motion, smoothed.

    Attributes:
        run: its name.
        coordinates: names of the n_c coordinates.
        times_s: (n,).
        values: (n, n_c) in m and rad.
        velocities: (n, n_c).
        accelerations: (n, n_c).
        covariances: of values, velocities, accelerations stacked, (n, 3 n_c, 3 n_c).
        noise_std: of one recorded sample, (n_c,).
        window_s: the free motion that the samples were taken from.
        pass_hz: end of the smoother's pass band.
        missing: share of recorded samples that were missing in the window.
        jumps: steps that the smoother did not reach across.
    """

    run: str
    coordinates: tuple[str, ...]
    times_s: Array
    values: Array
    velocities: Array
    accelerations: Array
    covariances: Array
    noise_std: Array
    window_s: tuple[float, float]
    pass_hz: float
    missing: float
    jumps: int

    def __post_init__(self) -> None:
        freeze(self, "times_s", "values", "velocities", "accelerations", "covariances")
        freeze(self, "noise_std")

    def select(self, coordinates: tuple[str, ...]) -> Signals:
        """The same signals of some of the coordinates, in the order asked for."""
        places = [self.coordinates.index(name) for name in coordinates]
        n_c = len(self.coordinates)
        stacked = np.concatenate([np.array(places) + d * n_c for d in range(3)])
        return replace(
            self,
            coordinates=coordinates,
            values=self.values[:, places],
            velocities=self.velocities[:, places],
            accelerations=self.accelerations[:, places],
            covariances=self.covariances[:, stacked[:, None], stacked],
            noise_std=self.noise_std[places],
        )


def signals_of(run: SwingRun, settings: SignalSettings | None = None) -> Signals:
    """Smooth a run's free motion.

    Raises:
        UnusableRunError: when the run is mostly missing, not free or too short, with the number.
    """
    settings = settings or SignalSettings()
    trajectory = run.trajectory
    try:
        grid = regular_grid(trajectory.times_s, trajectory.values)
        rough = settings.kernels(grid.period_s)
    except ValueError as error:
        raise UnusableRunError(str(error)) from error
    gap_samples = int(settings.longest_gap_s / grid.period_s + 1e-9)
    made = bridges(incomplete(grid.values), gap_samples)
    filled = bridged(grid.values, made)
    jumps = jumps_in(filled, _jump_limits(trajectory.coordinates, settings))
    window = _window(run, grid, filled, jumps, rough)
    inside = (grid.times_s >= window[0] - 1e-9) & (grid.times_s <= window[1] + 1e-9)
    missing = _missing_share(grid, inside, settings)
    usable = ~incomplete(filled)
    kernels = settings.kernels(
        grid.period_s, _pass_band(filled, usable & inside, trajectory.coordinates, grid.period_s)
    )
    if settings.processing == "centred":
        usable &= inside
    centres = _centres(usable, inside, jumps, kernels, settings)
    if len(centres) < _LEAST_OUTPUTS:
        raise UnusableRunError(
            f"only {len(centres)} of the samples in {window[0]:.2f} to {window[1]:.2f} s have "
            f"{kernels.half * kernels.period_s:.2f} s of unbroken motion around them, "
            f"{_LEAST_OUTPUTS} are needed"
        )
    noise = _noise_covariances(run, grid, filled, inside)
    smoothed = _apply(filled, kernels, centres)
    return Signals(
        run=run.name,
        coordinates=trajectory.coordinates,
        times_s=grid.times_s[centres],
        values=smoothed[0],
        velocities=smoothed[1],
        accelerations=smoothed[2],
        covariances=_propagate(kernels, centres, noise, made),
        noise_std=np.sqrt(np.median(noise[inside].diagonal(axis1=1, axis2=2), axis=0)),
        window_s=window,
        pass_hz=kernels.pass_hz,
        missing=missing,
        jumps=int(jumps[inside].sum()),
    )


def _missing_share(grid: Grid, inside: NDArray[np.bool_], settings: SignalSettings) -> float:
    if not inside.any():
        raise UnusableRunError(
            f"no sample in its window; the recording covers {grid.times_s[0]:.2f} to "
            f"{grid.times_s[-1]:.2f} s"
        )
    missing = float(incomplete(grid.values[inside]).mean())
    if missing > settings.largest_missing:
        raise UnusableRunError(
            f"{100 * missing:.0f} % of its samples are missing (occluded), "
            f"at most {100 * settings.largest_missing:.0f} % may be"
        )
    return missing


def _window(
    run: SwingRun, grid: Grid, filled: Array, jumps: NDArray[np.bool_], kernels: Smoother
) -> tuple[float, float]:
    """The stated window, or the one found from the smoothed samples."""
    if run.window_s is not None:
        return run.window_s
    unbroken = _unbroken(~incomplete(filled), jumps, kernels.half)
    centres = np.flatnonzero(unbroken)
    if len(centres) < _LEAST_OUTPUTS:
        raise UnusableRunError("no unbroken stretch of samples to look for free motion in")
    values, velocities, accelerations = _apply(filled, kernels, centres)
    scale = _scale(run.trajectory.coordinates)
    try:
        return free_window(grid.times_s[centres], values, velocities, accelerations, scale)
    except ValueError as error:
        raise UnusableRunError(str(error)) from error


def _scale(coordinates: tuple[str, ...]) -> Array:
    return np.array([_LEVER_M if name in _ANGLES else 1.0 for name in coordinates])


def _pass_band(
    filled: Array, usable: NDArray[np.bool_], coordinates: tuple[str, ...], period_s: float
) -> float:
    """Pass band from the longest unbroken stretch; whole tenths of a hertz, to share designs."""
    stretches = gaps(usable)
    if not stretches:
        return LOWEST_PASS_HZ
    start, end = max(stretches, key=lambda stretch: stretch[1] - stretch[0])
    return round(best_pass_hz(filled[start:end], period_s, _scale(coordinates)), 1)


def _jump_limits(coordinates: tuple[str, ...], settings: SignalSettings) -> Array:
    angular = np.array([name in _ANGLES for name in coordinates])
    return np.where(angular, settings.jump_limit_rad, settings.jump_limit_m)


def _unbroken(usable: NDArray[np.bool_], jumps: NDArray[np.bool_], half: int) -> NDArray[np.bool_]:
    """True where the smoother's whole span is usable and free of jumps, (n,)."""
    span = 2 * half + 1
    n = len(usable)
    good = np.zeros(n, dtype=bool)
    if n < span:
        return good
    bad = np.concatenate([[0], np.cumsum(~usable)])
    steps = np.concatenate([[0], np.cumsum(jumps)])
    starts = np.arange(n - span + 1)
    whole = (bad[starts + span] == bad[starts]) & (steps[starts + span] == steps[starts + 1])
    good[half : n - half] = whole
    return good


def _centres(
    usable: NDArray[np.bool_],
    inside: NDArray[np.bool_],
    jumps: NDArray[np.bool_],
    kernels: Smoother,
    settings: SignalSettings,
) -> NDArray[np.int64]:
    """Grid places of the decimated outputs, counted from the first usable one."""
    good = np.flatnonzero(_unbroken(usable, jumps, kernels.half) & inside)
    if not len(good) or settings.output_hz <= 0.0:
        return good
    step = max(1, round(1.0 / (settings.output_hz * kernels.period_s)))
    return good[(good - good[0]) % step == 0]


def _apply(filled: Array, kernels: Smoother, centres: NDArray[np.int64]) -> Array:
    """Value, velocity and acceleration at the centres, (3, n, n_c)."""
    windows = np.lib.stride_tricks.sliding_window_view(filled, 2 * kernels.half + 1, axis=0)
    return np.einsum("dk,nck->dnc", kernels.kernels, windows[centres - kernels.half])


def _noise_covariances(
    run: SwingRun, grid: Grid, filled: Array, inside: NDArray[np.bool_]
) -> Array:
    """Covariance of each recorded sample in its own coordinates, (n_grid, n_c, n_c).

    As the trajectory states it, or else estimated from its highest frequencies.
    """
    trajectory = run.trajectory
    n_c = len(trajectory.coordinates)
    std = white_noise_std(filled[inside])
    estimated = np.diag(np.where(np.isfinite(std), std, 0.0) ** 2)
    noise = np.broadcast_to(estimated, (len(grid.times_s), n_c, n_c)).copy()
    if trajectory.covariances is None:
        return noise
    stated = np.array(trajectory.covariances)
    if trajectory.is_pose:
        # A small rotation of the base frame into angle rates: d(angles) = H^-1 d(rotation).
        turn = np.zeros((len(stated), 6, 6))
        turn[:, :3, :3] = np.eye(3)
        angles = np.nan_to_num(trajectory.values[:, 3:])
        turn[:, 3:, 3:] = np.linalg.pinv(angle_rate_matrix(angles))
        stated = turn @ stated @ np.swapaxes(turn, 1, 2)
    present = grid.source >= 0
    known = np.zeros(len(present), dtype=bool)
    known[present] = np.isfinite(stated[grid.source[present]]).all(axis=(1, 2))
    noise[known] = stated[grid.source[known]]
    return noise


def _propagate(
    kernels: Smoother, centres: NDArray[np.int64], noise: Array, made: list[Bridge]
) -> Array:
    """Covariance of value, velocity, acceleration from that of the samples, (n, 3 n_c, 3 n_c)."""
    half, n_c = kernels.half, noise.shape[1]
    weights = kernels.kernels
    pairs = weights[:, None, :] * weights[None, :, :]
    span = np.lib.stride_tricks.sliding_window_view(noise, 2 * half + 1, axis=0)
    covariances = np.einsum("dek,nabk->ndaeb", pairs, span[centres - half], optimize=True)
    for place, centre in enumerate(centres):
        near = [b for b in made if abs(b.index - centre) <= half]
        if near:
            covariances[place] = _bridged_covariance(kernels, int(centre), noise, near)
    return covariances.reshape(len(centres), 3 * n_c, 3 * n_c)


def _bridged_covariance(kernels: Smoother, centre: int, noise: Array, near: list[Bridge]) -> Array:
    """The same where bridged samples pass their weight on to their donors, (3, n_c, 3, n_c)."""
    lowest = min(centre - kernels.half, *(int(b.donors.min()) for b in near))
    highest = max(centre + kernels.half, *(int(b.donors.max()) for b in near))
    weights = np.zeros((3, highest - lowest + 1))
    first = centre - kernels.half - lowest
    weights[:, first : first + 2 * kernels.half + 1] = kernels.kernels
    for bridge in near:
        passed = weights[:, bridge.index - lowest].copy()
        weights[:, bridge.index - lowest] = 0.0
        weights[:, bridge.donors - lowest] += passed[:, None] * bridge.weights
    pairs = weights[:, None, :] * weights[None, :, :]
    return np.einsum("dek,kab->daeb", pairs, noise[lowest : highest + 1])
