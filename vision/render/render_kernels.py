"""Area-sampled planes and spheres through a lens: the inner loops of the renderer.

Each pixel is sampled on a fine grid of s x s sub-pixels. A sub-pixel holds the pattern averaged
over its own footprint (a ramp across the nearest cell edge, symmetric, hence without bias), and a
separable filter (pixel square convolved with a Gaussian point spread) gathers sub-pixels into
pixels. Light and coverage are filtered alike, so that layers are composited exactly.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def gathering_weights(psf_px: float, subpixels: int) -> NDArray[np.float32]:
    """Weights of the sub-pixels around a pixel, (2 m + 1) * subpixels of them, summing to 1.

    The Gaussian loses the variance that the sub-pixel's own footprint already has.
    """
    own = 1.0 / (12.0 * subpixels**2)
    sigma = math.sqrt(max(psf_px**2 - own, 1e-6))
    margin = math.ceil(4.0 * sigma)
    count = (2 * margin + 1) * subpixels
    at = (np.arange(count) + 0.5) / subpixels - margin - 0.5
    scale = 1.0 / (math.sqrt(2.0) * sigma)
    weights = np.array([math.erf((d + 0.5) * scale) - math.erf((d - 0.5) * scale) for d in at])
    return (weights / weights.sum()).astype(np.float32)


@numba.njit(cache=True, nogil=True)
def sample_plane(
    light: Array,
    cover: Array,
    cells_from_ray: Array,
    rays: Array,
    left: int,
    top: int,
    subpixels: int,
    out: NDArray[np.float32],
) -> None:
    """Adds one plane to the sub-pixel buffer `out` (2, rows * s, columns * s).

    `light` and `cover` (R + 2, C + 2) hold the cells with a rim that is not covered;
    `cells_from_ray` (rows, 3, 3) maps a ray (x, y, 1) to (column, row, 1) up to scale, for each
    image row of the buffer; `rays` (h, w, 2) are the whole image's undistorted pixels.
    """
    rows = out.shape[1] // subpixels
    columns = out.shape[2] // subpixels
    height, width = rays.shape[0], rays.shape[1]
    last_row, last_column = light.shape[0] - 1, light.shape[1] - 1
    for i in range(rows):
        h = cells_from_ray[i]
        v = min(max(top + i, 0), height - 1)
        v0, v1 = max(v - 1, 0), min(v + 1, height - 1)
        for j in range(columns):
            u = min(max(left + j, 0), width - 1)
            u0, u1 = max(u - 1, 0), min(u + 1, width - 1)
            xu = (rays[v, u1, 0] - rays[v, u0, 0]) / (u1 - u0)
            yu = (rays[v, u1, 1] - rays[v, u0, 1]) / (u1 - u0)
            xv = (rays[v1, u, 0] - rays[v0, u, 0]) / (v1 - v0)
            yv = (rays[v1, u, 1] - rays[v0, u, 1]) / (v1 - v0)
            x = rays[v, u, 0] + (left + j - u) * xu + (top + i - v) * xv
            y = rays[v, u, 1] + (left + j - u) * yu + (top + i - v) * yv
            depth = h[2, 0] * x + h[2, 1] * y + h[2, 2]
            if not depth > 0.0:
                continue
            c = (h[0, 0] * x + h[0, 1] * y + h[0, 2]) / depth
            r = (h[1, 0] * x + h[1, 1] * y + h[1, 2]) / depth
            cx, cy = (h[0, 0] - c * h[2, 0]) / depth, (h[0, 1] - c * h[2, 1]) / depth
            rx, ry = (h[1, 0] - r * h[2, 0]) / depth, (h[1, 1] - r * h[2, 1]) / depth
            foot_c = abs(cx * xu + cy * yu) + abs(cx * xv + cy * yv)
            foot_r = abs(rx * xu + ry * yu) + abs(rx * xv + ry * yv)
            if (
                c < -foot_c
                or r < -foot_r
                or c > last_column - 1 + foot_c
                or r > last_row - 1 + foot_r
            ):
                continue
            reach = 0.5 + 0.6 / subpixels
            k, m = math.floor(c - reach * foot_c), math.floor(r - reach * foot_r)
            if (
                math.floor(c + reach * foot_c) == k
                and math.floor(r + reach * foot_r) == m
                and 0 <= k < last_column - 1
                and 0 <= m < last_row - 1
            ):  # the whole pixel lies within one cell
                p, q = i * subpixels, j * subpixels
                out[0, p : p + subpixels, q : q + subpixels] += light[m + 1, k + 1]
                out[1, p : p + subpixels, q : q + subpixels] += cover[m + 1, k + 1]
                continue
            foot_c /= subpixels
            foot_r /= subpixels
            for a in range(subpixels):
                dv = (a + 0.5) / subpixels - 0.5
                for b in range(subpixels):
                    du = (b + 0.5) / subpixels - 0.5
                    xs, ys = x + du * xu + dv * xv, y + du * yu + dv * yv
                    scale = 1.0 / (h[2, 0] * xs + h[2, 1] * ys + h[2, 2])
                    cs = (h[0, 0] * xs + h[0, 1] * ys + h[0, 2]) * scale
                    rs = (h[1, 0] * xs + h[1, 1] * ys + h[1, 2]) * scale
                    k, m = math.floor(cs + 0.5), math.floor(rs + 0.5)
                    fc = min(max(0.5 + (cs - k) / foot_c, 0.0), 1.0)
                    fr = min(max(0.5 + (rs - m) / foot_r, 0.0), 1.0)
                    k0, k1 = min(max(k, 0), last_column), min(max(k + 1, 0), last_column)
                    m0, m1 = min(max(m, 0), last_row), min(max(m + 1, 0), last_row)
                    w00, w01 = (1.0 - fr) * (1.0 - fc), (1.0 - fr) * fc
                    w10, w11 = fr * (1.0 - fc), fr * fc
                    p, q = i * subpixels + a, j * subpixels + b
                    out[0, p, q] += (
                        w00 * light[m0, k0]
                        + w01 * light[m0, k1]
                        + w10 * light[m1, k0]
                        + w11 * light[m1, k1]
                    )
                    out[1, p, q] += (
                        w00 * cover[m0, k0]
                        + w01 * cover[m0, k1]
                        + w10 * cover[m1, k0]
                        + w11 * cover[m1, k1]
                    )


@numba.njit(cache=True, nogil=True)
def sample_sphere(
    grey: float,
    centres: Array,
    radius_m: float,
    rays: Array,
    left: int,
    top: int,
    subpixels: int,
    out: NDArray[np.float32],
) -> None:
    """Adds a bright sphere to the sub-pixel buffer; `centres` (rows, 3) in the camera frame."""
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


@numba.njit(cache=True, nogil=True, fastmath={"reassoc", "contract"})
def composite(
    samples: NDArray[np.float32],
    weights: NDArray[np.float32],
    subpixels: int,
    left: int,
    top: int,
    share: float,
    image: NDArray[np.float32],
) -> None:
    """Gathers sub-pixels into pixels and lays them over `image` (h, w).

    The buffer starts at pixel (left, top); its outer pixels are only the filter's margin.
    `share` scales light and coverage (one of several exposure samples: 1 / count).
    """
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


@numba.njit(cache=True, nogil=True)
def expose(
    image: NDArray[np.float32], noise: NDArray[np.float32], start: int, sigma: float
) -> NDArray[np.uint8]:
    """Adds noise (a bank of unit normals read from `start`) and rounds to 0 ... 255."""
    out = np.empty(image.shape, dtype=np.uint8)
    at = start
    for i in range(image.shape[0]):
        for j in range(image.shape[1]):
            value = image[i, j] + sigma * noise[at] + 0.5
            out[i, j] = np.uint8(min(max(value, 0.0), 255.0))
            at += 1
    return out
