"""Sub-pixel corners of square tags, with covariance, by fitting the whole printed pattern.

Every pixel of the tag takes part: a homography, two grey levels and the blur are fitted to the
grey values by Gauss-Newton (kernels in `calib.tags.corner_kernels`), in undistorted coordinates,
since a lens bends edges. That uses the inner edges too and comes close to the Cramer-Rao bound of
the four corners. The covariance is that of the pixel noise which the fit itself finds.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.camera.camera import Camera
from freeswing.calib.tags.corner_kernels import TagImage
from freeswing.calib.tags.gaussian_tables import TABLES
from freeswing.calib.tags.pattern_fit import Search, fit_pattern
from freeswing.calib.tags.tag_map import corners_of_map
from freeswing.calib.tags.tag_patterns import tag_cells

Array = NDArray[np.float64]
Image = NDArray[np.uint8]

FIRST_BLURS_PX = (2.0, 1.2, 0.8)
NEAR_BLURS_PX = (0.8,)
ALL_PIXELS = 10_000_000
_NO_GUESS = np.zeros(3)
_LEAST_EXPLAINED = 0.75
_LEAST_CONTRAST = 8.0
# Cells narrower than 2.8 blur widths see their neighbours' neighbours, which the kernel leaves
# out: rendered tags at grazing angles then show a bias of about 0.05 px a blur width.
_CROWDED_CELLS = 2.8
_CROWDED_PX = 0.05
_TOO_CROWDED = 1.2


@dataclass(frozen=True, slots=True)
class TagFit:
    """A tag found in an image by `fit_tag`.

    Attributes:
        rays: corners TL TR BR BL in undistorted coordinates x/z, y/z, (4, 2).
        rays_covariance: of the eight numbers x0 y0 x1 ... y3, (8, 8).
        black: grey level of the print.
        contrast: white minus black.
        blur_px: standard deviation of the point spread, the pixel's own square included.
        noise: standard deviation of a pixel about the fitted pattern, grey levels.
        explained: share of the grey values' variance that the pattern explains.
        pixels: number of pixels that took part.
    """

    rays: Array
    rays_covariance: Array
    black: float
    contrast: float
    blur_px: float
    noise: float
    explained: float
    pixels: int


def lens_rays(camera: Camera) -> Array:
    """Undistorted x/z, y/z of every pixel of the camera, (h, w, 2); keep it, it takes a while."""
    width, height = camera.size_px
    grid = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1)
    return np.ascontiguousarray(camera.normalise(grid.astype(np.float64)))


def pixel_rays(size_px: tuple[int, int]) -> Array:
    """Pixels as their own coordinates, for images whose lens is not known yet, (h, w, 2)."""
    width, height = size_px
    grid = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1)
    return grid.astype(np.float64)


@cache
def rimmed_cells(
    family: str, tag_id: int, border_cells: int = 1, *, corner_squares: bool = False
) -> Array:
    """The tag's cells (1 white, 0 black) with the white rim around its border, (n + 2, n + 2).

    `corner_squares` makes the rim's corners black, as on an AprilGrid.
    """
    cells = np.pad(tag_cells(family, tag_id, border_cells).astype(float), 1, constant_values=1.0)
    if corner_squares:
        cells[[0, 0, -1, -1], [0, -1, 0, -1]] = 0.0
    cells.flags.writeable = False
    return cells


def square_map(rays: Array, side: float) -> Array:
    """Homography from undistorted (x, y, 1) to cells, corners TL TR BR BL at 0 ... side, (3, 3).

    Raises:
        ValueError: when three corners lie on a line.

    Source:
        Hartley, Zisserman 2004, Multiple View Geometry in Computer Vision, sec. 4.1.
    """
    (x0, y0), (x1, y1), (x2, y2), (x3, y3) = rays
    sx, sy = x0 - x1 + x2 - x3, y0 - y1 + y2 - y3
    dx1, dy1, dx2, dy2 = x1 - x2, y1 - y2, x3 - x2, y3 - y2
    determinant = dx1 * dy2 - dx2 * dy1
    if abs(determinant) < 1e-14:
        raise ValueError(f"corners {rays.tolist()} are on a line; a tag needs four apart")
    g = (sx * dy2 - dx2 * sy) / determinant
    h = (dx1 * sy - sx * dy1) / determinant
    rays_from_unit = np.array(
        [
            [x1 - x0 + g * x1, x3 - x0 + h * x3, x0],
            [y1 - y0 + g * y1, y3 - y0 + h * y3, y0],
            [g, h, 1.0],
        ]
    )
    inverse = np.linalg.inv(rays_from_unit)
    inverse[:2] *= side
    return inverse


def fit_tag(
    image: Image,
    rays: Array,
    corner_rays: Array,
    corners_px: Array,
    cells: Array,
    *,
    blurs_px: tuple[float, ...] = FIRST_BLURS_PX,
    noise: float = 1.0,
    most_pixels: int = ALL_PIXELS,
    before: tuple[float, float, float, float] | None = None,
) -> TagFit | None:
    """Fits a tag near a first guess of its corners; None where the pattern is not there.

    Args:
        image: grey, (h, w).
        rays: `lens_rays` of the camera, or `pixel_rays`.
        corner_rays: first guess in the coordinates of `rays`, TL TR BR BL, (4, 2).
        corners_px: the same guess in pixels, (4, 2).
        cells: `rimmed_cells` of the tag.
        blurs_px: blur widths from coarse to fine (`FIRST_BLURS_PX` catches a guess 2 px off,
            `NEAR_BLURS_PX` is for a good prediction); the last also starts the free blur.
        noise: least standard deviation of a pixel; the fit's own residual counts when larger.
        most_pixels: of the tag's box that take part, spread evenly; fewer are faster.
        before: black, contrast, blur in px and noise of the same tag in the frame before, for a
            prediction good to some tenths of a pixel; `blurs_px` then starts with that blur.
    """
    n = cells.shape[0] - 2
    height, width = image.shape
    low, high = corners_px.min(axis=0), corners_px.max(axis=0)
    if not np.isfinite(low + high).all() or (high < 2).any() or low[0] > width - 3:
        return None
    rim = (high - low).max() / n * 1.5 + 1.0
    left, top = np.maximum(np.floor(low - rim), 0).astype(np.int64)
    right = min(int(high[0] + rim) + 2, width)
    bottom = min(int(high[1] + rim) + 2, height)
    if right - left < 8 or bottom - top < 8:
        return None
    u = min(max(int(corners_px[:, 0].mean()), 1), width - 2)
    v = min(max(int(corners_px[:, 1].mean()), 1), height - 2)
    ray_step = np.column_stack(
        [(rays[v, u + 1] - rays[v, u - 1]) / 2, (rays[v + 1, u] - rays[v - 1, u]) / 2]
    )
    try:
        start = square_map(corner_rays, float(n))
    except (ValueError, np.linalg.LinAlgError):
        return None
    box = np.array([left, top, right, bottom], dtype=np.int64)
    guess = np.array([before[0], before[1], before[3]]) if before else _NO_GUESS
    fitted = fit_pattern(
        TagImage(image, rays, ray_step, cells, box, *TABLES),
        start,
        Search(np.array(blurs_px), noise, float(most_pixels), guess),
    )
    black, contrast, blur_px = (float(number) for number in fitted.state)
    if fitted.explained < _LEAST_EXPLAINED or contrast < _LEAST_CONTRAST:
        return None
    found, spread, narrowest = corners_of_map(fitted.pattern_from_ray, fitted.covariance, n)
    area = ray_step[0, 0] * ray_step[1, 1] - ray_step[0, 1] * ray_step[1, 0]
    pixel_ray = float(np.sqrt(abs(area)))
    crowded = _CROWDED_CELLS - narrowest / pixel_ray / n / blur_px
    if crowded > _TOO_CROWDED:
        return None
    if crowded > 0.0:
        spread = spread + (_CROWDED_PX * crowded * pixel_ray) ** 2 * np.eye(8)
    return TagFit(
        found,
        spread,
        black,
        contrast,
        blur_px,
        fitted.noise,
        fitted.explained,
        int(fitted.pixels),
    )


def to_pixels(camera: Camera, rays: Array, covariance: Array) -> tuple[Array, Array]:
    """Corners in pixels (4, 2) and their covariance (8, 8) from those in undistorted rays.

    Source:
        JCGM 100:2008, Guide to the Expression of Uncertainty in Measurement, eq. (13):
        propagation.
    """
    points = np.column_stack([rays, np.ones(len(rays))])
    pixels, d_point, _ = camera.project_jacobian(points)
    jacobian = np.zeros((2 * len(rays), 2 * len(rays)))
    for k in range(len(rays)):
        jacobian[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = d_point[k, :, :2]
    return pixels, jacobian @ covariance @ jacobian.T
