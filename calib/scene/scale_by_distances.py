"""The scale of a map that distances between marked points give."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from freeswing.calib.camera.lens_models import Array
from freeswing.calib.rig.reprojection import Scene, camera_slices
from freeswing.calib.rig.reprojection_kernels import POSE, WARP
from freeswing.calib.rig.solve_rig import Rig
from freeswing.calib.rig.views import FixedPoints
from freeswing.calib.scene.frame_by_survey import adjusted_beside, placed_points
from freeswing.calib.scene.scene_rig import scaled
from freeswing.calib.scene.tape_measured import Distance
from freeswing.cdpr.files.documents import DataError

# Between two distances, of what both are known to: by chance once in 16,000.
DISTANCE_SIGMAS = 4.0
_UNKNOWN_M = 1e3  # a deviation that says nothing


def with_distances(rig: Rig, marks: FixedPoints, distances: Sequence[Distance]) -> Rig:
    """The rig in metres, its first camera still the base frame.

    Args:
        rig: in a scale of its own.
        marks: clicked points of unknown places.
        distances: measured between them, each both ends of which two images show.

    Raises:
        DataError: a point that fewer than two images show, or distances that disagree.
    """
    places = placed_points(rig, marks)
    names = [name.removesuffix(" point") for name in marks.names]
    for name, place in zip(names, places, strict=True):
        if not np.isfinite(place).all():
            raise DataError(
                f"point {name}: fewer than two images that are in the map show it; click it in "
                "two images that look at it from different sides"
            )
    loose = replace(marks, points_base_m=places, std_m=np.full(len(places), _UNKNOWN_M))
    end = camera_slices(rig.cameras)[-1].stop + WARP
    ends = np.ones(3 * len(places), dtype=bool)
    rig = adjusted_beside(rig, loose, np.concatenate([rig.problem.free[:end], ends]))
    scene, covariance = rig.adjustment.scene, rig.adjustment.covariance
    rows, factors = [], []
    for one in distances:
        a, b = (names.index(name) for name in one.between)
        apart = scene.base_points_m[b] - scene.base_points_m[a]
        length = float(np.linalg.norm(apart))
        row = np.zeros(len(covariance))
        row[end + 3 * b : end + 3 * b + 3] = apart / length**2
        row[end + 3 * a : end + 3 * a + 3] = -apart / length**2
        rows.append(row)
        factors.append(one.distance_m / length)
    factor, gain, known = scale_of(
        np.array(factors),
        np.array(rows),
        covariance,
        np.array([one.std_m / one.distance_m for one in distances]),
        [" to ".join(one.between) for one in distances],
    )
    lengths, is_length = _lengths_of(scene)
    spread = np.diag(np.where(is_length, factor, 1.0)) - np.outer(factor * lengths, gain)
    covariance = spread @ covariance @ spread.T
    covariance += np.outer(lengths, lengths) * (factor * known) ** 2
    rig = scaled(rig, factor)
    return replace(rig, adjustment=replace(rig.adjustment, covariance=covariance))


def scale_of(
    factors: Array, rows: Array, covariance: Array, relative_std: Array, names: Sequence[str]
) -> tuple[float, Array, float]:
    """The scale that several distances give, the gradient of its logarithm, and its own deviation.

    Args:
        factors: what each distance alone gives, (n,).
        rows: derivative of each measured length's logarithm by the unknowns, (n, p).
        covariance: of the unknowns, (p, p).
        relative_std: of each stated distance, (n,).
        names: of the distances, for messages.

    Returns:
        The scale; -d log(scale) / d unknowns, (p,); the deviation that the statements leave.

    Raises:
        DataError: two distances disagree.

    Source:
        JCGM 100:2008, Guide to the Expression of Uncertainty in Measurement, eq. (13); the
        mean of correlated numbers: Press et al. 2007, Numerical Recipes, sec. 15.4.
    """
    spread = rows @ covariance @ rows.T + np.diag(relative_std**2)
    weights = np.linalg.solve(spread, np.ones(len(factors)))
    weights = weights / weights.sum()
    scale = float(np.exp(weights @ np.log(factors)))
    for name, factor, variance in zip(names, factors, np.diag(spread), strict=True):
        off = float(factor / scale - 1.0)
        if abs(off) > DISTANCE_SIGMAS * np.sqrt(variance):
            raise DataError(
                f"distance {name} is {100 * off:+.2f} % off what the others say, known to "
                f"{100 * np.sqrt(variance):.2f} %: measure it again, or click its ends again"
            )
    return scale, weights @ rows, float(np.sqrt(np.sum((weights * relative_std) ** 2)))


def _lengths_of(scene: Scene) -> tuple[Array, np.ndarray]:
    """The shared unknowns that grow with the scale: their values (0 for others), and which."""
    parts: list[Array] = []
    which: list[np.ndarray] = []
    for camera in scene.cameras:
        k = len(camera.params)
        parts += [np.zeros(k), camera.T_camera_base[:3, 3], np.zeros(POSE - 3 + 2)]
        which += [np.zeros(k), np.ones(3), np.zeros(POSE - 3 + 2)]
    parts += [np.zeros(WARP), scene.base_points_m.ravel()]
    which += [np.zeros(WARP), np.ones(scene.base_points_m.size)]
    return np.concatenate(parts), np.concatenate(which).astype(bool)
