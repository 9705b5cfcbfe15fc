"""The noise of a trajectory as columns: standard deviations `std_...`, correlations `corr_a_b`.

Of poses, the orientation's noise is `std_rx_rad, std_ry_rad, std_rz_rad` of the small rotation
vector in the base frame, or (read alone) `std_qw, std_qx, std_qy, std_qz` of the quaternion.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.files.number_table import NumberTable
from freeswing.cdpr.files.problems import InputError
from freeswing.cdpr.measured.trajectory import Trajectory, angle_noise

Array = NDArray[np.float64]

POSE_NOISE = ("x", "y", "z", "rx", "ry", "rz")
QUATERNION = ("qw", "qx", "qy", "qz")
QUATERNION_NOISE = tuple(f"std_{name}" for name in QUATERNION)
LEAST_CORRELATION = 1e-12


def noise_names(names: tuple[str, ...]) -> tuple[str, ...]:
    """Columns of the standard deviations: x -> std_x_m, rx -> std_rx_rad."""
    return tuple(f"std_{name}_m" if name in "xyz" else f"std_{name}_rad" for name in names)


def correlation_names(names: tuple[str, ...]) -> dict[str, tuple[int, int]]:
    """Columns of the correlations, with the indices that each joins."""
    pairs = combinations(enumerate(names), 2)
    return {f"corr_{a}_{b}": (i, j) for (i, a), (j, b) in pairs}


def read_noise(
    path: Path | str,
    table: NumberTable,
    columns: Mapping[str, Array],
    names: tuple[str, ...],
    is_known: NDArray[np.bool_],
) -> Array | None:
    """Covariances (n_t, n, n) of `names`.

    None when a coordinate has no standard deviation (a part of them cannot weight a sample) or all
    are 0 (then they say nothing).

    Raises:
        InputError: for a standard deviation that is not above 0, a correlation beyond 1, or either
            left empty where the sample (`is_known`, (n_t,)) is not.

    Source:
        JCGM 100:2008, Guide to the Expression of Uncertainty in Measurement, eq. (14):
        correlations.
    """
    wanted = noise_names(names)
    by_quaternion = names == POSE_NOISE and wanted[3] not in columns
    read = (*wanted[:3], *QUATERNION_NOISE) if by_quaternion else wanted
    if not all(name in columns for name in read):
        return None
    if all(np.nanmax(np.abs(columns[name]), initial=0.0) == 0.0 for name in read):
        return None
    for name in read:
        # One quaternion entry may be exact, a coordinate may not.
        floor = 0.0 if name in QUATERNION_NOISE else np.nextafter(0.0, 1.0)
        _check(path, table, name, columns[name], is_known, floor, np.inf)
    variances = np.stack([columns[name] for name in read], axis=1) ** 2
    if by_quaternion:
        return _from_quaternion_noise(columns, variances)
    std = np.sqrt(variances)
    correlations = np.broadcast_to(np.eye(len(names)), (len(std), len(names), len(names))).copy()
    for name, (i, j) in correlation_names(names).items():
        if name in columns:
            _check(path, table, name, columns[name], is_known, -1.0, 1.0)
            correlations[:, i, j] = correlations[:, j, i] = columns[name]
    return correlations * std[:, :, None] * std[:, None, :]


def noise_columns(trajectory: Trajectory) -> tuple[list[str], Array]:
    """Names and values (n_t, n) of the columns that hold a trajectory's covariances.

    Correlations that are 0 throughout are left out; without covariances there are no columns.

    Source:
        JCGM 100:2008, Guide to the Expression of Uncertainty in Measurement, eq. (14):
        correlations.
    """
    names, covariances = trajectory.coordinates, trajectory.covariances
    if covariances is None:
        return [], np.empty((len(trajectory), 0))
    if trajectory.is_pose:
        names = POSE_NOISE
    else:
        covariances = angle_noise(names, trajectory.values, covariances)
    std = np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))
    scale = np.where(std > 0.0, std, 1.0)
    correlations = covariances / (scale[:, :, None] * scale[:, None, :])
    header, parts = list(noise_names(names)), [std]
    for name, (i, j) in correlation_names(names).items():
        column = np.clip(correlations[:, i, j], -1.0, 1.0)
        if np.nanmax(np.abs(column), initial=0.0) > LEAST_CORRELATION:
            header.append(name)
            parts.append(column[:, None])
    return header, np.concatenate(parts, axis=1)


def _check(
    path: Path | str,
    table: NumberTable,
    name: str,
    column: Array,
    is_known: NDArray[np.bool_],
    least: float,
    most: float,
) -> None:
    bad = np.flatnonzero((column < least) | (column > most) | (np.isnan(column) & is_known))
    if not len(bad):
        return
    line, value = table.lines[bad[0]], column[bad[0]]
    if np.isnan(value):
        raise InputError(f"{path}: line {line}: {name} is empty, but the sample is not")
    limit = "-1 to 1" if most == 1.0 else "> 0 (or 0 throughout, when unknown)"
    raise InputError(f"{path}: line {line}: {name} is {value:g}, must be {limit}")


def _from_quaternion_noise(columns: Mapping[str, Array], variances: Array) -> Array:
    """First order: the small rotation vector is twice the vector part of dq times q conjugate."""
    w, x, y, z = (columns[name] for name in QUATERNION)
    rows = [[-x, w, -z, y], [-y, z, w, -x], [-z, -y, x, w]]
    jacobian = 2.0 * np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
    covariances = np.zeros((len(w), 6, 6))
    covariances[:, :3, :3] = variances[:, :3, None] * np.eye(3)
    covariances[:, 3:, 3:] = (jacobian * variances[:, None, 3:]) @ jacobian.swapaxes(1, 2)
    return covariances
