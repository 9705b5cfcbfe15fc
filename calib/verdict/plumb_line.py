"""The vertical in the base frame, from strings that hang in the cameras' sight."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.lens_models import PARAMETER_NAMES, Array
from freeswing.calib.verdict.calibration_result import CameraCovariance
from freeswing.cdpr.files.documents import DataError

WORST_STD_RAD = 0.05  # three degrees: people see that a frame does not stand upright by themselves
_ROUNDS = 4
_STEP = 1e-5
_TURN: tuple[str, ...] = ("rx_rad", "ry_rad", "rz_rad")

# A string this many click deviations long has its direction to 1/20 rad: shorter ones say nothing.
LEAST_LENGTH_STD = 20.0
# Scatter of the clicks over their deviation: people misjudge that by a half; twice is a wrong
# click.
WORST_SCATTER = 2.0
# Between the string and gravity_m_s2: by chance once in 90 where both are right.
DEVIATIONS = 3.0


@dataclass(frozen=True, slots=True)
class StringView:
    """Points clicked along one string in one camera, from the top down.

    Attributes:
        camera: its name.
        line: which string.
        pixels: pixel (0, 0) is the centre of the top-left pixel, (n, 2).
        std_px: standard deviation of each point's coordinates, (n,).
    """

    camera: str
    line: str
    pixels: Array
    std_px: Array

    def __str__(self) -> str:
        return f"string {self.line!r} in camera {self.camera}"


@dataclass(frozen=True, slots=True)
class Vertical:
    """Where down is.

    Attributes:
        down_base: unit vector in the base frame, (3,).
        covariance: of its small change, from the clicks and the cameras' calibration, (3, 3).
        scatter: rms of all residuals in units of their stated deviation; 1 is expected.
        degrees_of_freedom: of that rms; at 0 it is 0 and tells nothing.
        straightness_px: rms distance of each view's points from their straight image, (n_views,).
    """

    down_base: Array
    covariance: Array
    scatter: float
    degrees_of_freedom: int
    straightness_px: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class _Plane:
    """The plane through a camera's centre and a string, in the camera frame."""

    normal: Array
    covariance: Array
    residuals: Array  # in units of their deviation
    residuals_px: Array


def find_vertical(
    cameras: Sequence[Camera], views: Sequence[StringView], covariance: CameraCovariance
) -> Vertical:
    """The direction that lies in the planes of all views, by generalised least squares.

    Every string is vertical, so planes of different strings count alike. A camera's position
    does not matter to the direction; its rotation and lens do, with their joint covariance.

    Args:
        cameras: the calibrated rig.
        views: the clicked strings, of those cameras.
        covariance: of the cameras' lenses and poses.

    Raises:
        DataError: when a point has no ray, the views of a string disagree on which end is up, or
            the planes are so nearly the same that the direction is not known to 0.05 rad.
    """
    by_name = {camera.name: camera for camera in cameras}
    owners = [by_name[view.camera] for view in views]
    planes = [_plane(camera, view) for camera, view in zip(owners, views, strict=True)]
    slopes = [_camera_slopes(*each) for each in zip(owners, views, planes, strict=True)]
    pairs = zip(owners, planes, strict=True)
    normals = np.stack([camera.T_camera_base[:3, :3].T @ plane.normal for camera, plane in pairs])
    vertical = np.linalg.svd(normals)[2][2]
    for _ in range(_ROUNDS):
        noise = _noise(owners, planes, slopes, vertical, covariance)
        spread, gain = _spread_and_gain(normals, vertical, noise, views)
        vertical = vertical - spread @ gain @ vertical
        vertical /= np.linalg.norm(vertical)
    noise = _noise(owners, planes, slopes, vertical, covariance)
    left = normals @ vertical
    square = left @ np.linalg.solve(noise, left) + sum(np.sum(p.residuals**2) for p in planes)
    freedom = sum(len(plane.residuals) for plane in planes) - len(planes) - 2
    return Vertical(
        vertical * _sign(owners, views, vertical),
        _spread_and_gain(normals, vertical, noise, views)[0],
        float(np.sqrt(square / freedom)) if freedom else 0.0,
        freedom,
        tuple(float(np.sqrt(np.mean(plane.residuals_px**2))) for plane in planes),
    )


def _spread_and_gain(
    normals: Array, vertical: Array, noise: Array, views: Sequence[StringView]
) -> tuple[Array, Array]:
    """Covariance of the direction across itself and the normal equations' matrix, (3, 3) each."""
    basis = np.asarray(np.linalg.svd(vertical[None])[2][1:].T, dtype=np.float64)
    gain = normals.T @ np.linalg.solve(noise, normals)
    information = basis.T @ gain @ basis
    _refuse_one_plane(information, views)
    return basis @ np.linalg.solve(information, basis.T), gain


def _fitted_line(rays: Array, std: Array) -> tuple[Array, Array]:
    """Unit vector nearest to normal to all rays of these deviations, and its covariance."""
    moment = (rays / std[:, None]).T @ (rays / std[:, None])
    values, vectors = np.linalg.eigh(moment)
    return vectors[:, 0], (vectors[:, 1:] / values[1:]) @ vectors[:, 1:].T


def _plane(camera: Camera, view: StringView) -> _Plane:
    """The homogeneous line of least distance in pixels to the undistorted points."""
    rays = np.column_stack([camera.normalise(view.pixels), np.ones(len(view.pixels))])
    if not np.isfinite(rays).all():
        raise DataError(f"{view}: no ray of the lens lands on a clicked point; click it again")
    to_rays = np.linalg.inv(camera.project_jacobian(rays)[1][:, :, :2])
    per_px = np.full(len(rays), 1.0 / float(np.mean(camera.focal_px)))
    for _ in range(_ROUNDS):
        normal = _fitted_line(rays, view.std_px * per_px)[0]
        per_px = np.linalg.norm(np.einsum("nij,i->nj", to_rays, normal[:2]), axis=1)
    normal, spread = _fitted_line(rays, view.std_px * per_px)
    distance_px = rays @ normal / per_px
    return _Plane(normal, spread, distance_px / view.std_px, distance_px)


def _noise(
    owners: Sequence[Camera],
    planes: Sequence[_Plane],
    slopes: Sequence[Mapping[str, Array]],
    vertical: Array,
    covariance: CameraCovariance,
) -> Array:
    """Covariance of normal . vertical of all views, (n_views, n_views)."""
    seen = [camera.T_camera_base[:3, :3] @ vertical for camera in owners]
    clicks = [down @ plane.covariance @ down for down, plane in zip(seen, planes, strict=True)]
    names = list(dict.fromkeys(name for slope in slopes for name in slope))
    table = np.zeros((len(planes), len(names)))
    for row, (down, slope) in enumerate(zip(seen, slopes, strict=True)):
        table[row, [names.index(name) for name in slope]] = [s @ down for s in slope.values()]
    return np.diag(clicks) + table @ covariance.block(names) @ table.T


def _camera_slopes(camera: Camera, view: StringView, plane: _Plane) -> dict[str, Array]:
    """Derivatives of the normal by the camera's rotation (dr) and lens parameters, (3,) each."""
    slopes: dict[str, Array] = dict(zip(_TURN, np.cross(plane.normal, np.eye(3)), strict=True))
    for index, name in enumerate(PARAMETER_NAMES[camera.model]):
        step = _STEP * max(1.0, abs(float(camera.params[index])))
        ends = []
        for side in (step, -step):
            params = camera.params + side * (np.arange(len(camera.params)) == index)
            normal = _plane(replace(camera, params=params), view).normal
            ends.append(normal * np.sign(normal @ plane.normal))
        slopes[name] = (ends[0] - ends[1]) / (2.0 * step)
    return {f"{camera.name}.{name}": slope for name, slope in slopes.items()}


def _refuse_one_plane(information: Array, views: Sequence[StringView]) -> None:
    std = float(1.0 / np.sqrt(max(np.linalg.eigvalsh(information)[0], 1e-300)))
    if std > WORST_STD_RAD:
        raise DataError(
            f"plumb line: {', '.join(map(str, views))}: their planes are nearly one, so "
            f"the vertical is uncertain by {min(std, np.pi):.2g} rad, more than {WORST_STD_RAD}; "
            "click the string in a camera that sees it from another side, or a second string"
        )


def _sign(owners: Sequence[Camera], views: Sequence[StringView], vertical: Array) -> float:
    """+1 where the direction runs as the points were clicked, -1 against them."""
    signs = []
    for camera, view in zip(owners, views, strict=True):
        first, last = np.column_stack([camera.normalise(view.pixels[[0, -1]]), [1.0, 1.0]])
        along = np.cross(first, camera.T_camera_base[:3, :3] @ vertical)
        signs.append(1.0 if np.cross(first, last) @ along > 0.0 else -1.0)
    against = [str(view) for view, sign in zip(views, signs, strict=True) if sign != signs[0]]
    if against:
        raise DataError(
            f"plumb line: {', '.join(against)} clicked in the other direction than {views[0]}; "
            "list every string's points from the top down"
        )
    return signs[0]


def vertical_entry(
    vertical: Vertical, views: Sequence[StringView], gravity_m_s2: Array
) -> dict[str, Any]:
    """The `vertical` of results/calibration.json; `verdict` is agrees, differs or inconsistent.

    Deviations are the claimed ones, times the scatter where that is above one.
    """
    size = float(np.linalg.norm(gravity_m_s2))
    declared, down = gravity_m_s2 / size, vertical.down_base
    angle = float(np.arctan2(np.linalg.norm(np.cross(declared, down)), declared @ down))
    covariance = vertical.covariance * max(1.0, vertical.scatter) ** 2
    std = _std_along(declared - down * (declared @ down), covariance)
    verdict, sentence = _judged(vertical, angle, std, size * down)
    return {
        "verdict": verdict,
        "sentence": sentence,
        "down_base": down.tolist(),
        "covariance": covariance.tolist(),
        "gravity_m_s2": (size * down).tolist(),
        "angle_to_gravity_mrad": 1e3 * angle,
        "angle_std_mrad": 1e3 * std,
        "scatter": vertical.scatter,
        "degrees_of_freedom": vertical.degrees_of_freedom,
        "views": [
            {
                "camera": view.camera,
                "line": view.line,
                "points": len(view.pixels),
                "straightness_px": straightness,
            }
            for view, straightness in zip(views, vertical.straightness_px, strict=True)
        ],
    }


def _std_along(difference: Array, covariance: Array) -> float:
    """Deviation of the vertical along the difference; the largest one where there is none."""
    length = float(np.linalg.norm(difference))
    if length < 1e-9:
        return float(np.sqrt(np.linalg.eigvalsh(covariance)[-1]))
    return float(np.sqrt(difference @ covariance @ difference)) / length


def _judged(vertical: Vertical, angle: float, std: float, gravity: Array) -> tuple[str, str]:
    told = f"the plumb line is {1e3 * angle:.2f} mrad from gravity_m_s2 (deviation {1e3 * std:.2f})"
    if vertical.scatter > WORST_SCATTER:
        return "inconsistent", (
            f"{told}, but the clicked points scatter by {vertical.scatter:.1f} times their "
            f"std_px about one vertical, more than {WORST_SCATTER:g}: look for a wrong click, a "
            "string that swayed or touched something, or state a larger std_px"
        )
    if angle <= DEVIATIONS * std:
        return "agrees", f"{told}: they agree within {DEVIATIONS:g} deviations"
    vector = ", ".join(f"{value:.5f}" for value in gravity)
    turned = "the strings were clicked from the bottom up, or " if angle > np.pi / 2 else ""
    return "differs", f"{told}: {turned}set gravity_m_s2 = [{vector}] in robot.toml"
