"""A measured or simulated motion of the platform: times, coordinates, covariance, provenance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from freeswing.cdpr.files.problems import DataError
from freeswing.cdpr.measured.slow_errors import SlowErrors
from freeswing.cdpr.robot import POSE_COORDINATES
from freeswing.cdpr.rotation import angle_rate_matrix, angles_from_matrix, matrix_from_angles

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

ANGLES = POSE_COORDINATES[3:]


@dataclass(frozen=True, slots=True)
class Trajectory:
    """Samples of all or some of the pose coordinates; NaN is a missing sample.

    Attributes:
        times_s: strictly increasing, (n_t,).
        coordinates: names out of x y z phi theta chi, n_c of them.
        values: m and rad, (n_t, n_c); angles are continuous in time.
        covariances: (n_t, n_c, n_c) or None when the noise is unknown. With all three angles
            present their entries are those of the small rotation vector in the base frame
            (R_true = exp(delta) R); otherwise those of the angles themselves.
        provenance: one line: where the numbers come from.
        slow: how far all samples err together (markers that sit elsewhere or drift), None: unknown.
        notes: what was left out of the recording and why, one sentence each.
    """

    times_s: Array
    coordinates: tuple[str, ...]
    values: Array
    covariances: Array | None = None
    provenance: str = ""
    slow: SlowErrors | None = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        coordinates = tuple(self.coordinates)
        _check_coordinates(coordinates)
        times = _read_only(self.times_s)
        _check_times(times)
        n_t, n_c = len(times), len(coordinates)
        values = _read_only(self.values)
        _check_shape("values", values, (n_t, n_c))
        if np.isinf(values).any():
            raise ValueError("values: a number is infinite; a missing sample is NaN")
        object.__setattr__(self, "coordinates", coordinates)
        object.__setattr__(self, "times_s", times)
        object.__setattr__(self, "values", values)
        if self.covariances is not None:
            covariances = _read_only(self.covariances)
            _check_shape("covariances", covariances, (n_t, n_c, n_c))
            object.__setattr__(self, "covariances", covariances)

    def __len__(self) -> int:
        return len(self.times_s)

    @property
    def is_pose(self) -> bool:
        """Whether all six pose coordinates are there, in the order x y z phi theta chi."""
        return self.coordinates == POSE_COORDINATES

    @property
    def is_known(self) -> Mask:
        """Samples of which every coordinate is known, (n_t,)."""
        return np.asarray(np.isfinite(self.values).all(axis=1))

    @property
    def duration_s(self) -> float:
        """Last minus first time."""
        return float(self.times_s[-1] - self.times_s[0])

    @property
    def sample_rate_hz(self) -> float:
        """One over the median time step; NaN for a single sample."""
        steps = np.diff(self.times_s)
        return float(1.0 / np.median(steps)) if len(steps) else float("nan")

    def positions(self) -> Array:
        """x, y, z of a pose trajectory, (n_t, 3).

        Raises:
            ValueError: when a coordinate is not part of it.
        """
        return self.values[:, self._columns(POSE_COORDINATES[:3])]

    def rotations(self) -> Array:
        """R_base_platform of a pose trajectory, (n_t, 3, 3), NaN where missing.

        Raises:
            ValueError: when an angle is not part of it.
        """
        return matrix_from_angles(self.values[:, self._columns(ANGLES)])

    def standard_deviations(self) -> Array | None:
        """Square roots of the covariances' diagonals, (n_t, n_c), None when unknown."""
        if self.covariances is None:
            return None
        return np.sqrt(np.diagonal(self.covariances, axis1=1, axis2=2))

    def select(self, coordinates: Sequence[str]) -> Trajectory:
        """The same samples of some coordinates, in the order given.

        Angle variances leave the small rotation vector for the angles themselves when a part of
        the angles is selected (first order, H^-1 of `angle_rate_matrix`).

        Raises:
            ValueError: when a coordinate is not part of it.
        """
        wanted = tuple(coordinates)
        columns = self._columns(wanted)
        covariances = None
        if self.covariances is not None:
            full = self.covariances
            if not set(ANGLES) <= set(wanted):
                full = angle_noise(self.coordinates, self.values, full)
            covariances = full[:, columns[:, None], columns]
        return replace(
            self, coordinates=wanted, values=self.values[:, columns], covariances=covariances
        )

    def window(self, start_s: float, end_s: float) -> Trajectory:
        """Samples with start_s <= t <= end_s.

        Raises:
            DataError: when there is none.
        """
        # A window of 8 s at 100 Hz means sample 800, whatever its time's last bit.
        slack = 1e-6 * float(np.median(np.diff(self.times_s))) if len(self) > 1 else 0.0
        inside = (self.times_s >= start_s - slack) & (self.times_s <= end_s + slack)
        if not inside.any():
            raise DataError(
                f"{self.provenance or 'trajectory'}: no sample from {start_s:.10g} to "
                f"{end_s:.10g} s; it lasts from {self.times_s[0]:.10g} to "
                f"{self.times_s[-1]:.10g} s: correct the window"
            )
        return self.take(inside)

    def take(self, samples: Mask | NDArray[np.intp]) -> Trajectory:
        """The samples of a mask (n_t,) or of increasing indices."""
        covariances = None if self.covariances is None else self.covariances[samples]
        return replace(
            self,
            times_s=self.times_s[samples],
            values=self.values[samples],
            covariances=covariances,
        )

    @staticmethod
    def from_poses(
        times_s: ArrayLike,
        positions_m: ArrayLike,
        rotations: ArrayLike,
        covariances: ArrayLike | None = None,
        provenance: str = "",
        slow: SlowErrors | None = None,
    ) -> Trajectory:
        """From positions (n_t, 3) and rotations (n_t, 3, 3), NaN where missing.

        The covariances (n_t, 6, 6) are of position, then small rotation vector in the base frame.
        """
        angles = unwrapped(angles_from_matrix(rotations))
        values = np.concatenate([np.asarray(positions_m, dtype=np.float64), angles], axis=1)
        known = None if covariances is None else np.asarray(covariances, dtype=np.float64)
        return Trajectory(
            np.asarray(times_s, dtype=np.float64), POSE_COORDINATES, values, known, provenance, slow
        )

    def _columns(self, names: Sequence[str]) -> NDArray[np.intp]:
        absent = [name for name in names if name not in self.coordinates]
        if absent:
            raise ValueError(
                f"{self.provenance or 'trajectory'}: {', '.join(absent)} not measured; "
                f"it holds {', '.join(self.coordinates)}"
            )
        return np.array([self.coordinates.index(name) for name in names], dtype=np.intp)


def unwrapped(angles: Array) -> Array:
    """Columns of angles made continuous in time across missing (NaN) samples, (n_t, n_c)."""
    result = np.array(angles, dtype=np.float64)
    for column in result.T:
        known = np.isfinite(column)
        column[known] = np.unwrap(column[known])
    return result


def angle_noise(coordinates: tuple[str, ...], values: Array, covariances: Array) -> Array:
    """Covariances of the angles from those of the small rotation vector, (n_t, n_c, n_c).

    First order, with omega = H (phi', theta', chi') of `angle_rate_matrix`; unchanged unless all
    three angles are among the coordinates.
    """
    return _turned_noise(coordinates, values, covariances, to_angles=True)


def rotation_noise(coordinates: tuple[str, ...], values: Array, covariances: Array) -> Array:
    """The inverse of `angle_noise`."""
    return _turned_noise(coordinates, values, covariances, to_angles=False)


def _turned_noise(
    coordinates: tuple[str, ...], values: Array, covariances: Array, *, to_angles: bool
) -> Array:
    if not set(ANGLES) <= set(coordinates):
        return covariances
    columns = np.array([coordinates.index(name) for name in ANGLES])
    angles = values[:, columns]
    known = np.asarray(np.isfinite(angles).all(axis=1))
    H = angle_rate_matrix(np.where(known[:, None], angles, 0.0))
    change = np.broadcast_to(np.eye(len(coordinates)), covariances.shape).copy()
    change[:, columns[:, None], columns] = np.linalg.inv(H) if to_angles else H
    return change @ covariances @ change.swapaxes(1, 2)


def _read_only(values: ArrayLike) -> Array:
    array = np.array(values, dtype=np.float64)
    array.flags.writeable = False
    return array


def _check_coordinates(coordinates: tuple[str, ...]) -> None:
    unknown = [name for name in coordinates if name not in POSE_COORDINATES]
    if unknown or not coordinates or len(set(coordinates)) < len(coordinates):
        raise ValueError(
            f"coordinates: {coordinates} must be different names out of {POSE_COORDINATES}"
        )


def _check_times(times: Array) -> None:
    if times.ndim != 1 or len(times) == 0:
        raise ValueError(f"times_s: shape {times.shape}, expected (n_t,) with n_t >= 1")
    if not np.isfinite(times).all():
        raise ValueError("times_s: a time is not finite")
    late = np.flatnonzero(np.diff(times) <= 0.0)
    if len(late):
        i = int(late[0])
        raise ValueError(
            f"times_s: sample {i + 1} at {times[i + 1]} s does not follow {times[i]} s; "
            "times must increase"
        )


def _check_shape(what: str, array: Array, shape: tuple[int, ...]) -> None:
    if array.shape != shape:
        raise ValueError(f"{what}: shape {array.shape}, expected {shape}")
