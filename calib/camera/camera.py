"""A calibrated camera: lens, pose in the base frame and clock."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from freeswing.calib.camera import lens_models
from freeswing.calib.camera.lens_models import PARAMETER_NAMES, Array


@dataclass(frozen=True, slots=True)
class Camera:
    """One camera; pixel (0, 0) is the centre of the top-left pixel, the frame is OpenCV's.

    A sample stamped t by this camera was taken at base time
    t + clock_offset_s + row * line_time_s, row being its vertical pixel coordinate.

    Covariances of a camera's pose are those of the 6-vector (dt, dr), metres then radians, with
    t_true = t + dt and R_true = exp(dr) R for T_camera_base = [R t]: dr is a small rotation
    about the camera's own axes.

    Attributes:
        name: the recording's name without suffix.
        size_px: image width and height.
        model: one of `PARAMETER_NAMES` (COLMAP's names).
        params: lens parameters in the order of `PARAMETER_NAMES[model]`, (k,).
        T_camera_base: base coordinates to camera coordinates, (4, 4).
        clock_offset_s: added to the camera's stamps to give base time.
        line_time_s: delay from one image row to the next (rolling shutter), 0 when global.
    """

    name: str
    size_px: tuple[int, int]
    model: str
    params: Array
    T_camera_base: Array
    clock_offset_s: float = 0.0
    line_time_s: float = 0.0

    def __post_init__(self) -> None:
        if self.model not in PARAMETER_NAMES:
            known = ", ".join(PARAMETER_NAMES)
            raise ValueError(f"camera {self.name}: model {self.model!r} is not one of {known}")
        count = len(PARAMETER_NAMES[self.model])
        params = np.array(self.params, dtype=np.float64)
        if params.shape != (count,):
            raise ValueError(
                f"camera {self.name}: {self.model} takes {count} params "
                f"({', '.join(PARAMETER_NAMES[self.model])}), got {params.size}"
            )
        pose = np.array(self.T_camera_base, dtype=np.float64)
        if pose.shape != (4, 4):
            raise ValueError(
                f"camera {self.name}: T_camera_base has shape {pose.shape}, not (4, 4)"
            )
        if not (np.isfinite(params).all() and np.isfinite(pose).all()):
            raise ValueError(f"camera {self.name}: params or pose hold a number that is not finite")
        params.flags.writeable = False
        pose.flags.writeable = False
        object.__setattr__(self, "params", params)
        object.__setattr__(self, "T_camera_base", pose)
        object.__setattr__(self, "size_px", (int(self.size_px[0]), int(self.size_px[1])))

    @property
    def focal_px(self) -> Array:
        """Focal lengths fx, fy, (2,)."""
        return lens_models.focal_and_centre(self.model, self.params)[0]

    @property
    def centre_px(self) -> Array:
        """Principal point, (2,)."""
        return lens_models.focal_and_centre(self.model, self.params)[1]

    @property
    def position_base_m(self) -> Array:
        """The optical centre in the base frame, (3,)."""
        return -self.T_camera_base[:3, :3].T @ self.T_camera_base[:3, 3]

    def to_camera(self, points_base: Array) -> Array:
        """Base-frame points (..., 3) in the camera frame, (..., 3)."""
        return points_base @ self.T_camera_base[:3, :3].T + self.T_camera_base[:3, 3]

    def project(self, points_camera: Array) -> Array:
        """Pixels (..., 2) of camera-frame points (..., 3); NaN behind the camera.

        The lens is applied as a formula: `sees` tells where it still means something.
        """
        return lens_models.project(self.model, np.asarray(points_camera, float), self.params)

    def project_jacobian(self, points_camera: Array) -> tuple[Array, Array, Array]:
        """`project` with its derivatives by the point (..., 2, 3) and params (..., 2, k)."""
        points = np.asarray(points_camera, dtype=np.float64)
        return lens_models.project_jacobian(self.model, points, self.params)

    def normalise(self, pixels: Array) -> Array:
        """Undistorted x/z, y/z of pixels (..., 2); NaN where no ray of the lens lands there."""
        return lens_models.normalise(self.model, pixels, self.params)

    def sees(self, points_camera: Array) -> np.ndarray:
        """Whether camera-frame points (..., 3) fall inside the image, bool (...).

        Refuses points past the radius at which the lens polynomial turns back, which would
        otherwise reappear inside the image.
        """
        points = np.asarray(points_camera, dtype=np.float64)
        radius, depth = np.hypot(points[..., 0], points[..., 1]), points[..., 2]
        limit = lens_models.radius_limit(self.model, self.params)
        if self.model == lens_models.FISHEYE:
            one_to_one = np.arctan2(radius, depth) < limit
        else:
            one_to_one = (depth > 0.0) & (radius < limit * depth)
        pixels = self.project(points)
        width, height = self.size_px
        with np.errstate(invalid="ignore"):
            inside = (np.abs(pixels - (np.array([width, height]) - 1) / 2)) <= (
                np.array([width, height]) / 2
            )
        return one_to_one & inside.all(axis=-1)
