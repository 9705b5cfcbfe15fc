"""Area-sampled planes and spheres through a lens: the inner loops of the renderer.

Each pixel is sampled on a fine grid of s x s sub-pixels. A sub-pixel holds the pattern averaged
over its own footprint (a ramp across the nearest cell edge, symmetric, hence without bias), and a
separable filter (pixel square convolved with a Gaussian point spread) gathers sub-pixels into
pixels. Light and coverage are filtered alike, so that layers are composited exactly.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.compiled.kernels import kernel

Array = NDArray[np.float64]
Samples = NDArray[np.float32]
_At = tuple[int, int, int]  # the first sample's row and column, samples to a pixel's side


def gathering_weights(psf_px: float, subpixels: int) -> NDArray[np.float32]:
    """Weights of the sub-pixels around a pixel, (2 m + 1) * subpixels of them, summing to 1.

    The Gaussian loses the variance that the sub-pixel's own footprint already has.

    Source:
        Abramowitz, Stegun 1964, Handbook of Mathematical Functions, eq. (7.1.1): a Gaussian
        over pixels.
    """
    own = 1.0 / (12.0 * subpixels**2)
    sigma = math.sqrt(max(psf_px**2 - own, 1e-6))
    margin = math.ceil(4.0 * sigma)
    count = (2 * margin + 1) * subpixels
    at = (np.arange(count) + 0.5) / subpixels - margin - 0.5
    scale = 1.0 / (math.sqrt(2.0) * sigma)
    weights = np.array([math.erf((d + 0.5) * scale) - math.erf((d - 0.5) * scale) for d in at])
    return (weights / weights.sum()).astype(np.float32)


class Buffer(NamedTuple):
    """Sub-pixels of a part of the image.

    Attributes:
        samples: light and coverage, (2, rows * s, columns * s).
        left: image column of the first pixel.
        top: image row of the first pixel.
        subpixels: s, of a pixel's side.
    """

    samples: NDArray[np.float32]
    left: int
    top: int
    subpixels: int


class Plane(NamedTuple):
    """A plane of cells, with a rim that is not covered.

    Attributes:
        light: (R + 2, C + 2).
        cover: likewise.
        cells_from_ray: maps a ray (x, y, 1) to (column, row, 1) up to scale, for each image row of
            the buffer, (rows, 3, 3).
    """

    light: Array
    cover: Array
    cells_from_ray: Array


class _Ray(NamedTuple):
    """A pixel's ray, and how it changes to the next column (u) and row (v)."""

    x: float
    y: float
    xu: float
    yu: float
    xv: float
    yv: float


class _Place(NamedTuple):
    """Where a ray meets the cells, and half the side of a pixel there, in cells."""

    c: float
    r: float
    foot_c: float
    foot_r: float


class _Slopes(NamedTuple):
    """How the place changes to the next column (u) and row (v), and the depth w in parts of it."""

    cu: float
    cv: float
    ru: float
    rv: float
    wu: float
    wv: float


@kernel(forceinline=True)
def _ray_of(rays: Array, column: int, row: int) -> _Ray:
    """The ray of a pixel, continued beyond the image's edge."""
    height, width = rays.shape[0], rays.shape[1]
    v = min(max(row, 0), height - 1)
    v0, v1 = max(v - 1, 0), min(v + 1, height - 1)
    u = min(max(column, 0), width - 1)
    u0, u1 = max(u - 1, 0), min(u + 1, width - 1)
    across, down = 1.0 / (u1 - u0), 1.0 / (v1 - v0)
    xu = (rays[v, u1, 0] - rays[v, u0, 0]) * across
    yu = (rays[v, u1, 1] - rays[v, u0, 1]) * across
    xv = (rays[v1, u, 0] - rays[v0, u, 0]) * down
    yv = (rays[v1, u, 1] - rays[v0, u, 1]) * down
    x = rays[v, u, 0] + (column - u) * xu + (row - v) * xv
    y = rays[v, u, 1] + (column - u) * yu + (row - v) * yv
    return _Ray(x, y, xu, yu, xv, yv)


@kernel(forceinline=True)
def _place_of(h: Array, ray: _Ray, depth: float) -> tuple[_Place, _Slopes]:
    """Where a ray of that depth meets the cells, by the map h (3, 3)."""
    x, y, xu, yu, xv, yv = ray
    nearer = 1.0 / depth
    c = (h[0, 0] * x + h[0, 1] * y + h[0, 2]) * nearer
    r = (h[1, 0] * x + h[1, 1] * y + h[1, 2]) * nearer
    cx, cy = (h[0, 0] - c * h[2, 0]) * nearer, (h[0, 1] - c * h[2, 1]) * nearer
    rx, ry = (h[1, 0] - r * h[2, 0]) * nearer, (h[1, 1] - r * h[2, 1]) * nearer
    wx, wy = h[2, 0] * nearer, h[2, 1] * nearer
    cu, cv, ru, rv = cx * xu + cy * yu, cx * xv + cy * yv, rx * xu + ry * yu, rx * xv + ry * yv
    wu, wv = wx * xu + wy * yu, wx * xv + wy * yv
    place = _Place(c, r, abs(cu) + abs(cv), abs(ru) + abs(rv))
    return place, _Slopes(cu, cv, ru, rv, wu, wv)


@kernel(forceinline=True)
def _cell_of(plane: Plane, place: _Place, subpixels: int) -> tuple[int, int]:
    """Row and column of a cell that all of the pixel looks like; (-1, -1): there is none."""
    light, cover = plane.light, plane.cover
    c, r, foot_c, foot_r = place
    reach = 0.5 + 0.6 / subpixels
    k0, k1 = math.floor(c - reach * foot_c), math.floor(c + reach * foot_c)
    m0, m1 = math.floor(r - reach * foot_r), math.floor(r + reach * foot_r)
    if k0 < 0 or m0 < 0 or k1 >= light.shape[1] - 2 or m1 >= light.shape[0] - 2:
        return -1, -1
    first, covered = light[m0 + 1, k0 + 1], cover[m0 + 1, k0 + 1]
    for m in range(m0 + 1, m1 + 2):
        for k in range(k0 + 1, k1 + 2):
            if light[m, k] != first or cover[m, k] != covered:
                return -1, -1
    return m0 + 1, k0 + 1


@kernel(forceinline=True)
def _sample_pixel(plane: Plane, place: _Place, slopes: _Slopes, out: Samples, at: _At) -> None:
    """Adds light and coverage of one pixel's samples, each cell edge a ramp as wide as a foot."""
    light, cover = plane.light, plane.cover
    last_row, last_column = light.shape[0] - 1, light.shape[1] - 1
    p, q, subpixels = at
    step = 1.0 / subpixels
    sharp_c, sharp_r = subpixels / place.foot_c, subpixels / place.foot_r
    for a in range(subpixels):
        dv = (a + 0.5) * step - 0.5
        for b in range(subpixels):
            du = (b + 0.5) * step - 0.5
            nearer = du * slopes.wu + dv * slopes.wv
            scale = 1.0 - nearer + nearer * nearer  # of 1 / (1 + nearer), which is below 1e-3
            c = place.c + (du * slopes.cu + dv * slopes.cv) * scale
            r = place.r + (du * slopes.ru + dv * slopes.rv) * scale
            k, m = math.floor(c + 0.5), math.floor(r + 0.5)
            fc = min(max(0.5 + (c - k) * sharp_c, 0.0), 1.0)
            fr = min(max(0.5 + (r - m) * sharp_r, 0.0), 1.0)
            k0, k1 = min(max(k, 0), last_column), min(max(k + 1, 0), last_column)
            m0, m1 = min(max(m, 0), last_row), min(max(m + 1, 0), last_row)
            upper = light[m0, k0] + fc * (light[m0, k1] - light[m0, k0])
            lower = light[m1, k0] + fc * (light[m1, k1] - light[m1, k0])
            out[0, p + a, q + b] += upper + fr * (lower - upper)
            if 0 < k < last_column - 1 and 0 < m < last_row - 1:
                out[1, p + a, q + b] += 1.0
                continue
            upper = cover[m0, k0] + fc * (cover[m0, k1] - cover[m0, k0])
            lower = cover[m1, k0] + fc * (cover[m1, k1] - cover[m1, k0])
            out[1, p + a, q + b] += upper + fr * (lower - upper)


@kernel
def sample_plane(plane: Plane, rays: Array, buffer: Buffer) -> Buffer:
    """The buffer with one plane added to its samples (in place).

    `rays` (h, w, 2) are the whole image's undistorted pixels.
    """
    out, left, top, subpixels = buffer
    last_row, last_column = plane.light.shape[0] - 1, plane.light.shape[1] - 1
    for i in range(out.shape[1] // subpixels):
        h = plane.cells_from_ray[i]
        for j in range(out.shape[2] // subpixels):
            ray = _ray_of(rays, left + j, top + i)
            depth = h[2, 0] * ray.x + h[2, 1] * ray.y + h[2, 2]
            if not depth > 0.0:
                continue
            place, slopes = _place_of(h, ray, depth)
            c, r, foot_c, foot_r = place
            if (
                c < -foot_c
                or r < -foot_r
                or c > last_column - 1 + foot_c
                or r > last_row - 1 + foot_r
            ):
                continue
            m, k = _cell_of(plane, place, subpixels)
            p, q = i * subpixels, j * subpixels
            if m >= 0:
                light, cover = np.float32(plane.light[m, k]), np.float32(plane.cover[m, k])
                for a in range(subpixels):
                    for b in range(subpixels):
                        out[0, p + a, q + b] += light
                        out[1, p + a, q + b] += cover
                continue
            _sample_pixel(plane, place, slopes, out, (p, q, subpixels))
    return buffer


@kernel
def sample_sphere(
    grey: float, centres: Array, radius_m: float, rays: Array, buffer: Buffer
) -> Buffer:
    """The buffer with a bright sphere added (in place); `centres` (rows, 3) in the camera frame."""
    out, left, top, subpixels = buffer
    rows = out.shape[1] // subpixels
    columns = out.shape[2] // subpixels
    height, width = rays.shape[0], rays.shape[1]
    for i in range(rows):
        centre = centres[i]
        distance = math.sqrt(centre[0] ** 2 + centre[1] ** 2 + centre[2] ** 2)
        limit = math.asin(min(radius_m / distance, 1.0))
        v = min(max(top + i, 1), height - 2)
        for j in range(columns):
            u = min(max(left + j, 1), width - 2)
            xu, yu = (rays[v, u + 1] - rays[v, u - 1]) / 2.0
            xv, yv = (rays[v + 1, u] - rays[v - 1, u]) / 2.0
            x = rays[v, u, 0] + (left + j - u) * xu + (top + i - v) * xv
            y = rays[v, u, 1] + (left + j - u) * yu + (top + i - v) * yv
            if not math.isfinite(x + xu + xv):
                continue
            foot = math.sqrt(abs(xu * yv - xv * yu)) / (1.0 + x * x + y * y) / subpixels
            for a in range(subpixels):
                dv = (a + 0.5) / subpixels - 0.5
                for b in range(subpixels):
                    du = (b + 0.5) / subpixels - 0.5
                    xs, ys = x + du * xu + dv * xv, y + du * yu + dv * yv
                    nx = ys * centre[2] - centre[1]
                    ny = centre[0] - xs * centre[2]
                    nz = xs * centre[1] - ys * centre[0]
                    across = math.sqrt(nx * nx + ny * ny + nz * nz)
                    along = xs * centre[0] + ys * centre[1] + centre[2]
                    angle = math.atan2(across, along)
                    part = min(max(0.5 + (limit - angle) / foot, 0.0), 1.0)
                    out[0, i * subpixels + a, j * subpixels + b] += grey * part
                    out[1, i * subpixels + a, j * subpixels + b] += part
    return buffer


@kernel(fastmath={"reassoc", "contract"})
def composite(
    buffer: Buffer, weights: NDArray[np.float32], share: float, image: NDArray[np.float32]
) -> NDArray[np.float32]:
    """The image (h, w) with the buffer's pixels laid over it (in place).

    The buffer's outer pixels are only the filter's margin. `share` scales light and coverage (one
    of several exposure samples: 1 / count).

    Source:
        Porter, Duff 1984, Compositing Digital Images.
    """
    samples, left, top, subpixels = buffer
    taps = weights.shape[0]
    margin = (taps // subpixels - 1) // 2
    rows, columns = samples.shape[1] // subpixels, samples.shape[2] // subpixels
    inner_rows, inner_columns = rows - 2 * margin, columns - 2 * margin
    down = np.empty((2, columns * subpixels), dtype=np.float32)
    for i in range(inner_rows):
        v = top + margin + i
        if v < 0 or v >= image.shape[0]:
            continue
        down[:] = 0.0
        for channel in range(2):
            line = down[channel]
            for k in range(taps):
                w = weights[k]
                source = samples[channel, i * subpixels + k]
                for j in range(columns * subpixels):
                    line[j] += w * source[j]
        for j in range(inner_columns):
            u = left + margin + j
            if u < 0 or u >= image.shape[1]:
                continue
            light = np.float32(0.0)
            cover = np.float32(0.0)
            for k in range(taps):
                light += weights[k] * down[0, j * subpixels + k]
                cover += weights[k] * down[1, j * subpixels + k]
            image[v, u] += share * (light - cover * image[v, u])
    return image


@kernel
def expose(
    image: NDArray[np.float32], noise: NDArray[np.float32], start: int, sigma: float
) -> NDArray[np.uint8]:
    """Adds noise (a bank of unit normals read from `start`) and rounds to 0 ... 255.

    Source:
        EMVA Standard 1288, release 4.0, 2021, sec. 2: the linear camera.
    """
    out = np.empty(image.shape, dtype=np.uint8)
    at = start
    for i in range(image.shape[0]):
        for j in range(image.shape[1]):
            value = image[i, j] + sigma * noise[at] + 0.5
            out[i, j] = np.uint8(min(max(value, 0.0), 255.0))
            at += 1
    return out
