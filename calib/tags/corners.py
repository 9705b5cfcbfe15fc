"""Sub-pixel corners of square tags, with covariance, by fitting the whole printed pattern.

Every pixel of the tag takes part: a homography, two grey levels and the blur are fitted to the
grey values by Gauss-Newton (kernels in `calib.tags.corner_kernels`), in undistorted coordinates,
since a lens bends edges. That uses the inner edges too and comes close to the Cramer-Rao bound of
the four corners. The covariance is that of the pixel noise which the fit itself finds.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.camera import lens_models
from freeswing.calib.camera.camera import Camera
from freeswing.calib.tags.accept_tag import (
    BLACK,
    COVARIANCE,
    PIXELS,
    RAYS,
    fit_guess,
    fit_guesses,
)
from freeswing.calib.tags.corner_kernels import Rays
from freeswing.calib.tags.gaussian_tables import TABLES
from freeswing.calib.tags.tag_patterns import tag_cells

Array = NDArray[np.float64]
Image = NDArray[np.uint8]

FIRST_BLURS_PX = (2.0, 1.2, 0.8)
ALL_PIXELS = 10_000_000
_NO_GUESS = np.zeros(3)


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


def lens_rays(camera: Camera) -> Rays:
    """Undistorted x/z, y/z of every pixel of the camera, (h, w, 2); not to be written to.

    They take a while and are kept for the last lenses: in single precision, which is 1e-4 px at
    most and half the memory to go through.
    """
    return _lens_rays(camera.model, tuple(camera.params.tolist()), camera.size_px)


@lru_cache(maxsize=2)
def _lens_rays(model: str, params: tuple[float, ...], size_px: tuple[int, int]) -> Rays:
    pixels = pixel_rays(size_px).astype(np.float64)
    rays = lens_models.normalise(model, pixels, np.array(params))
    return np.ascontiguousarray(rays, dtype=np.float32)


def pixel_rays(size_px: tuple[int, int]) -> Rays:
    """Pixels as their own coordinates, for images whose lens is not known yet, (h, w, 2)."""
    width, height = size_px
    grid = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1)
    return grid.astype(np.float32)


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


def fit_tag(
    image: Image,
    rays: Rays,
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
        blurs_px: blur widths from coarse to fine (`FIRST_BLURS_PX` catches a guess 2 px off);
            the last also starts the free blur.
        noise: least standard deviation of a pixel; the fit's own residual counts when larger.
        most_pixels: of the tag's box that take part, spread evenly; fewer are faster.
        before: black, contrast, blur in px and noise of the same tag in the frame before, for a
            prediction good to some tenths of a pixel; `blurs_px` then starts with that blur.
    """
    guess = np.empty((2, 4, 2))
    guess[0], guess[1] = corner_rays, corners_px
    found = fit_guess(
        image,
        rays,
        guess,
        cells,
        np.array(blurs_px),
        _NO_GUESS if before is None else np.array([before[0], before[1], before[3]]),
        np.array([noise, most_pixels], dtype=np.float64),
        TABLES,
    )
    return _tag_fit(found)


def fit_predicted(
    image: Image,
    rays: Rays,
    guesses: Array,
    cells: Array,
    before: Array,
    *,
    noise: float = 1.0,
    most_pixels: int = ALL_PIXELS,
) -> list[TagFit | None]:
    """`fit_tag` of several tags that have as many cells, from good predictions, at one call.

    Args:
        image: grey, (h, w).
        rays: `lens_rays` of the camera.
        guesses: corners in the coordinates of `rays` and in pixels, (n, 2, 4, 2).
        cells: `rimmed_cells` of each tag, (n, m + 2, m + 2).
        before: black, contrast, blur in px and noise of each in the frame before, (n, 4).
        noise: as of `fit_tag`.
        most_pixels: as of `fit_tag`.
    """
    limits = np.array([noise, most_pixels], dtype=np.float64)
    found = fit_guesses(image, rays, guesses, cells, before, limits, TABLES)
    return [_tag_fit(one) for one in found]


def _tag_fit(found: Array) -> TagFit | None:
    """From what `fit_guess` gives."""
    pixels = int(found[PIXELS])
    if not pixels:
        return None
    black, contrast, blur_px, least, explained = found[BLACK:PIXELS].tolist()
    corners, covariance = found[RAYS].reshape(4, 2), found[COVARIANCE].reshape(8, 8)
    return TagFit(corners, covariance, black, contrast, blur_px, least, explained, pixels)


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
