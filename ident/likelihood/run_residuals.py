"""One run's share of the likelihood: whitened residuals and their derivatives, reduced by QR.

Unknowns of a run are its initial pose and those rates that the cables allow: 12 - n numbers.
They are eliminated here; what goes on to the joint problem are the rows that are left for the
shared unknowns (inertia and effects).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from freeswing.cdpr.effects import effect_named
from freeswing.cdpr.measured.pose_errors import PoseErrors
from freeswing.cdpr.measured.slow_errors import BESIDE_STATED, STATED_BY_RUN, SlowErrors
from freeswing.cdpr.model.batch import evaluate, moved_columns, with_jacobian
from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.model.free_motion import coordinate_indices
from freeswing.cdpr.robot import POSE_COORDINATES, Array
from freeswing.cdpr.rotation import angle_rate_matrix, log_slope, pose_differences
from freeswing.cdpr.simulation.free_swing import Motion
from freeswing.cdpr.simulation.sensitivity import STATE, Linearised
from freeswing.ident.runs import Payload

BY_ALL = (1, 2, 3, 4)  # all inputs of a model's functions but time
BLOCK_OF_COLUMNS = 12  # rows a column: 0.2 MB for fifty


@dataclass(frozen=True, slots=True)
class Samples:
    """A run's samples, ready for whitening.

    Attributes:
        name: of the run.
        times_s: of the samples in which all coordinates are known, (n,).
        coordinates: what was measured.
        values: (n, c).
        whitener: inverse Cholesky factors of the stated or unit noise covariance, (n, c, c).
        groups: 0 for metres, 1 for radians, (c,).
        lengths_m: stated cable lengths, (n_cables,), or None.
        lengths_std_m: their standard deviation.
        span_s: start and end of the window.
        payload: a known mass on the platform, or None.
        temper: factor on its noise, where the model is known to follow it worse than others.
        slow: how far its poses err together, None where that is not known.
        errors: what causes that all runs share may do to its poses, None where that is not known.
        freed: amplitudes of these errors that are taken out of its values, (r,); None: none are.
    """

    name: str
    times_s: Array
    coordinates: tuple[str, ...]
    values: Array
    whitener: Array
    groups: np.ndarray
    lengths_m: Array | None
    lengths_std_m: float
    span_s: tuple[float, float]
    payload: Payload | None = None
    temper: float = 1.0
    slow: SlowErrors | None = None
    errors: PoseErrors | None = None
    freed: Array | None = None

    def until(self, end_s: float) -> Samples:
        """The samples up to a time."""
        count = int(np.searchsorted(self.times_s, end_s, side="right"))
        return replace(
            self,
            times_s=self.times_s[:count],
            values=self.values[:count],
            whitener=self.whitener[:count],
            span_s=(self.span_s[0], float(self.times_s[count - 1])),
        )

    def loosened(self, std_m: float) -> Samples:
        """The same with lengths known no better than to `std_m`."""
        return replace(self, lengths_std_m=max(self.lengths_std_m, std_m))

    @property
    def columns(self) -> list[int]:
        """Positions of the measured coordinates in the pose."""
        return coordinate_indices(self.coordinates)

    @property
    def is_pose(self) -> bool:
        """Whether full poses were measured."""
        return self.coordinates == POSE_COORDINATES


@dataclass(frozen=True, slots=True)
class Reduced:
    """A run's linearised residuals after its own unknowns were eliminated.

    Attributes:
        rows: triangle over [shared unknowns; residual], (p + 1, p + 1).
        own: triangle over [own unknowns; shared unknowns; residual]: 12 - n state directions,
            then the effect values that are the run's own.
        basis: state change by [state directions; shared; 1], (12, 12 - n + p + 1).
        own_columns: where the run's own effect values stand among the shared unknowns, (o,).
        plucked: how the start plucks cables by [own unknowns; 1], over what is known of that,
            (2 n, 12 + n + o + 1); no rows where they are held.
    """

    rows: Array
    own: Array
    basis: Array
    own_columns: np.ndarray
    plucked: Array

    def own_change(self, shared: Array) -> tuple[Array, Array]:
        """Change of the initial [zeta; rates], and of the run's own effect values.

        Args:
            shared: change of the shared unknowns, zero where a run has its own, (p,).
        """
        n_own = self.own.shape[0]
        right = -(self.own[:, n_own:-1] @ shared + self.own[:, -1])
        own = np.linalg.solve(self.own[:, :n_own], right)
        directions = n_own - len(self.own_columns)
        everything = shared.copy()
        everything[self.own_columns] = own[directions:]
        state = self.basis @ np.concatenate([own[:directions], everything, [1.0]])
        return state, own[directions:]


def predicted(motion: Motion, times_s: Array) -> Array:
    """What would be measured of the pose at times (n,), all six coordinates, (n, 6)."""
    if not _changes_measurement(motion):
        return motion.poses_at(times_s)
    return evaluate(motion.model.measured, *_measured_from(motion, times_s))[0]


def differences(seen: Array, samples: Samples) -> Array:
    """Prediction minus measurement, (n, c); of full poses `pose_differences`.

    Args:
        seen: what `predicted` gives, (n, 6).
        samples: what was measured.
    """
    if samples.is_pose:
        return pose_differences(seen, samples.values)
    return seen[:, samples.columns] - samples.values


def residuals(motion: Motion, samples: Samples, scales: Array) -> Array:
    """Whitened `differences` of a motion, (n, c)."""
    return _whitened(differences(predicted(motion, samples.times_s), samples), samples, scales)


def lengths_residual(motion: Motion, samples: Samples) -> Array:
    """Predicted minus stated lengths over their standard deviation, (n_cables,) or (0,).

    Source:
        FIDIM 2022, eq. (44), over the stated deviations.
    """
    if samples.lengths_m is None:
        return np.zeros(0)
    start = (motion.starts_s[0], motion.zetas[0], motion.rates[0], motion.inertia, motion.values)
    told = evaluate(motion.model.told, *start)[0]
    return (told - samples.lengths_m) / samples.lengths_std_m


def reduce_run(
    linear: Linearised,
    samples: Samples,
    scales: Array,
    shifts: Array | None = None,
    prior_weight: float = 1.0,
) -> Reduced:
    """Linearise one run's residuals at a motion and eliminate its own unknowns.

    Args:
        linear: the motion's first-order answer; by unknowns that it was not asked for nothing
            changes.
        samples: what was measured.
        scales: noise scale of metres and of radians, (2,).
        shifts: what further shared unknowns, which come after the others, add to the measured
            pose, (n, 6, r).
        prior_weight: of what is known of the run's own effect values; above 1 where the samples
            count for more than they are worth, as they do in units of a noise far below what the
            model leaves.
    """
    motion = linear.motion
    seen = predicted(motion, samples.times_s)
    off = differences(seen, samples)
    maps = _residual_map(seen, off, samples, scales)
    matrix = _sample_rows(linear, samples, maps)
    white = _whitened(off, samples, scales)
    count = len(linear.asked)
    further = 0 if shifts is None else shifts.shape[2]
    plucked, by_all = _plucked_rows(motion)
    beside = np.concatenate([lengths_residual(motion, samples), prior_weight * plucked])
    by_beside = np.vstack([_length_rows(motion, samples), prior_weight * by_all])
    everything = np.zeros((white.size + len(beside), count + further + 1))
    everything[: white.size, :count] = matrix.reshape(-1, count)
    everything[white.size :, :count] = by_beside[:, linear.asked]
    everything[:, -1] = np.concatenate([white.reshape(-1), beside])
    if shifts is not None:
        everything[: white.size, count:-1] = (maps @ shifts).reshape(white.size, -1)
    # What follows combines columns: a triangle of them serves as well, and is a hundredth as long.
    triangle = _triangle(everything)
    beside, right = triangle[:, count:-1], triangle[:, -1]
    rows = np.zeros((len(triangle), STATE + motion.inertia.size + motion.values.size))
    rows[:, linear.asked] = triangle[:, :count]
    basis = _allowed_states(motion)
    directions = STATE - motion.model.held
    body = rows[:, :STATE] @ basis
    shared = body[:, directions:-1] + rows[:, STATE:]
    shared[:, np.setdiff1d(np.arange(shared.shape[1]), linear.asked[STATE:] - STATE)] = 0.0
    mine = motion.inertia.size + motion.model.own_values
    own = np.hstack([body[:, :directions], shared[:, mine]])
    shared[:, mine] = 0.0
    n_own = own.shape[1]
    together = np.column_stack([own, shared, beside, right + body[:, -1]])
    known = prior_weight * _own_priors(motion, samples, directions, together.shape[1])
    together = np.vstack([together, known])
    triangle = np.linalg.qr(together, mode="r")
    size = together.shape[1]
    full = np.zeros((size, size))
    full[: len(triangle)] = triangle
    by_own = np.hstack([by_all[:, :STATE] @ basis[:, :directions], by_all[:, STATE + mine]])
    plucked = np.column_stack([by_own, plucked])
    return Reduced(full[n_own:, n_own:], full[:n_own], basis, mine, plucked)


def _triangle(rows: Array) -> Array:
    """R of tall rows, (n, c), from those of blocks that the near cache holds: in half the time.

    Source:
        Demmel, Grigori, Hoemmen, Langou 2012, Communication-optimal parallel and sequential QR
        and LU factorizations.
    """
    count, columns = rows.shape
    blocks = count // (BLOCK_OF_COLUMNS * columns)
    if blocks < 2:
        return np.asarray(np.linalg.qr(rows, mode="r"))
    whole = count // blocks * blocks
    parts = np.linalg.qr(rows[:whole].reshape(blocks, -1, columns), mode="r")
    return np.asarray(np.linalg.qr(np.vstack([*parts, rows[whole:]]), mode="r"))


def own_prior(motion: Motion, samples: Samples) -> Array:
    """A run's own effect values over what is known of them, (o,).

    Source:
        Bishop 2006, Pattern Recognition and Machine Learning, sec. 3.3: a Gaussian prior as
        rows.
    """
    return _own_whitener(motion.model, samples) @ motion.values[motion.model.own_values]


def own_covariance(model: Model, samples: Samples) -> Array:
    """What is known of a run's own effect values beforehand, as their covariance, (o, o).

    A frame that is said to be known as a run states it is known so where the run does; one that is
    said to differ by more, by so much beside it.

    Source:
        JCGM 100:2008, Guide to the Expression of Uncertainty in Measurement, sec. 5.1: independent
        errors add by their squares.
    """
    places = model.own_values
    known = np.diag([model.parameters[k].prior_std ** 2 for k in places])
    if samples.slow is None:
        return known
    for source, share in ((STATED_BY_RUN, 0.0), (BESIDE_STATED, 1.0)):
        frame = [i for i, k in enumerate(places) if model.parameters[k].source == source]
        if frame:
            block = np.ix_(frame, frame)
            known[block] = share * known[block] + samples.slow.frame_covariance
    return known


def _own_whitener(model: Model, samples: Samples) -> Array:
    """Turns a run's own effect values into independent ones of unit deviation, (o, o)."""
    return np.linalg.inv(np.linalg.cholesky(own_covariance(model, samples)))


def _own_priors(motion: Motion, samples: Samples, directions: int, columns: int) -> Array:
    """Rows that keep a run's own effect values near what is known of them, (o, columns)."""
    count = len(motion.model.own_values)
    rows = np.zeros((count, columns))
    rows[:, directions : directions + count] = _own_whitener(motion.model, samples)
    rows[:, -1] = own_prior(motion, samples)
    return rows


def _changes_measurement(motion: Motion) -> bool:
    return any(effect_named(name).changes_measurement for name in motion.model.effects)


def _measured_from(motion: Motion, times_s: Array) -> tuple[Array, Array, Array, Array, Array]:
    """What the model's `measured` takes at times (n,); no rates (zeros) where it uses none."""
    by_rates = any(6 <= k < STATE for k in moved_columns(motion.model.measured, BY_ALL)[1])
    if by_rates:
        zetas, rates, _ = motion.at(times_s)
    else:
        zetas = motion.poses_at(times_s)
        rates = np.zeros_like(zetas)
    return times_s, zetas, rates, motion.inertia, motion.values


def _whitened(off: Array, samples: Samples, scales: Array) -> Array:
    noise = samples.temper * scales[samples.groups]
    return (samples.whitener @ off[..., None])[..., 0] / noise


def _sample_rows(linear: Linearised, samples: Samples, maps: Array) -> Array:
    """Derivatives of the whitened residuals by the unknowns asked for, (n, c, q)."""
    motion = linear.motion
    found = np.zeros((*maps.shape[:2], len(linear.asked)))
    told = np.searchsorted(linear.asked, linear.columns)
    if not _changes_measurement(motion):
        found[..., told] = maps @ linear.poses_at(samples.times_s)
        return found
    function, columns = moved_columns(motion.model.measured, BY_ALL, tuple(linear.asked.tolist()))
    slopes = maps @ evaluate(function, *_measured_from(motion, samples.times_s))[0]
    by_state = np.zeros((*maps.shape[:2], STATE))
    states = [k for k in columns if k < STATE]
    by_state[..., states] = slopes[..., : len(states)]
    if by_state[..., 6:].any():
        change, change_rates = linear.at(samples.times_s)
        found[..., told] = by_state[..., :6] @ change + by_state[..., 6:] @ change_rates
    else:
        found[..., told] = by_state[..., :6] @ linear.poses_at(samples.times_s)
    found[..., np.searchsorted(linear.asked, columns[len(states) :])] += slopes[..., len(states) :]
    return found


def _residual_map(seen: Array, off: Array, samples: Samples, scales: Array) -> Array:
    """What a change of the predicted pose does to the whitened residuals, (n, c, 6).

    Args:
        seen: the prediction, (n, 6).
        off: its `differences`, (n, c).
        samples: what was measured.
        scales: noise scale of metres and of radians, (2,).
    """
    maps = np.zeros((len(samples.times_s), len(samples.coordinates), 6))
    if samples.is_pose:
        maps[:, :3, :3] = np.eye(3)
        maps[:, 3:, 3:] = log_slope(off[:, 3:]) @ angle_rate_matrix(seen[:, 3:])
    else:
        maps[:, np.arange(len(samples.columns)), samples.columns] = 1.0
    return samples.whitener @ maps / (samples.temper * scales[samples.groups])[:, None]


def _length_rows(motion: Motion, samples: Samples) -> Array:
    columns = STATE + motion.inertia.size + motion.values.size
    if samples.lengths_m is None:
        return np.zeros((0, columns))
    return _start_slopes(motion, motion.model.told)[1] / samples.lengths_std_m


def _start_slopes(motion: Motion, function: object) -> tuple[Array, Array]:
    start = (motion.starts_s[0], motion.zetas[0], motion.rates[0], motion.inertia, motion.values)
    value, slopes = evaluate(with_jacobian(function, BY_ALL), *start)
    return value, slopes


def plucked_start(motion: Motion) -> Array:
    """How a run's start plucks cables that are springs, over what is known of that; (0,): held."""
    return _plucked_rows(motion)[0]


def _plucked_rows(motion: Motion) -> tuple[Array, Array]:
    """The same, (q,), and its derivatives by [state; inertia; values], (q, 21 + k)."""
    if motion.model.plucked is None:
        return np.zeros(0), np.zeros((0, STATE + motion.inertia.size + motion.values.size))
    return _start_slopes(motion, motion.model.plucked)


def own_numbers(model: Model) -> int:
    """How many numbers a run takes for itself, but for those that its prior tells as well."""
    n = model.robot.n_cables
    return STATE - n + len(model.own_values) - (n - model.held)


def _allowed_states(motion: Motion) -> Array:
    """State changes by [own; shared; 1] that keep the rates within what the cables allow."""
    slip, slopes = _start_slopes(motion, motion.model.slip)
    by_state, by_shared = slopes[:, :STATE], slopes[:, STATE:]
    inverse = np.linalg.pinv(by_state)
    free = np.linalg.svd(by_state)[2][motion.model.held :].T
    return np.column_stack([free, -inverse @ by_shared, -inverse @ slip])
