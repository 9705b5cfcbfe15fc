"""The inner loops of the pattern fit: Gauss-Newton on the pixels of one printed tag.

A pixel at the undistorted point x sees I = black + contrast * B(q), with q = H^-1 x in units of
cells and B the tag's cells (1 white, 0 black) blurred by a Gaussian. Blurring a grid of cells is
separable, so B comes from the Gaussian's integral at the four edges around q; where the view
slants, the blur's axes correlate and cell corners gain the first terms of the tetrachoric series
(Kendall 1941) of the bivariate integral. The unknowns are a
small homography composed on the pattern's side, black, contrast and the blur's width:

    q' = q - dq,  dq = (e0 x + e1 y + e2 - x (e6 x + e7 y),  e3 x + e4 y + e5 - y (e6 x + e7 y))

with (x, y) = (q - centre) / half, so that the design is well scaled.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

from freeswing.calib.tags.gaussian_tables import gaussian_edge
from freeswing.calib.tags.tag_map import blur_at_centre, compose

Array = NDArray[np.float64]

UNKNOWNS = 11
BLACK, CONTRAST, BLUR = 8, 9, 10
LEAST_BLUR = 0.289  # of the pixel's own square, in px
MOST_BLUR = 6.0
LEAST_ERROR = 0.02  # of the contrast: in a clean image every edge pixel would be an outlier
MOST_FREE_PASSES = 25  # sharp small tags settle slowly, others in four to six
_FLAT = 4.4  # blur widths from an edge at which nothing of it is left, with a margin


@numba.njit(cache=True, nogil=True)
def accumulate(
    image: NDArray[np.uint8],
    rays: Array,
    pattern_from_ray: Array,
    ray_step: Array,
    cells: Array,
    state: Array,
    box: NDArray[np.int64],
    stride: int,
    scale: float,
    step: Array,
    bell: Array,
    normal: Array,
    right: Array,
    histogram: NDArray[np.int64],
) -> tuple[float, float, float, float]:
    """One pass over the pixels: fills the normal equations at the present state.

    Args:
        image: (h, w).
        rays: undistorted coordinates of every pixel, (h, w, 2).
        pattern_from_ray: (x, y, 1) to cell coordinates, the tag's black border at 0 ... n.
        ray_step: how a pixel to the right and one down change the ray, (2, 2) columns.
        cells: the tag's cells with a rim of one cell, (n + 2, n + 2).
        state: black, contrast, blur in px.
        box: left, top, right, bottom (exclusive).
        stride: use one pixel in so many, spread over a lattice.
        scale: noise level beyond four times which a pixel loses weight.
        step: table of the Gaussian's integral.
        bell: table of its density.
        normal: out, (11, 11) upper triangle.
        right: out, (11,).
        histogram: out, counts of |residual| in 256 bins of one grey level / 4.

    Returns:
        Sum of weighted squared residuals, of weights, of pixels, and of squares about the mean.
    """
    normal[:] = 0.0
    right[:] = 0.0
    histogram[:] = 0
    n = cells.shape[0] - 2
    half = n / 2.0
    black, contrast, blur = state[0], state[1], state[2]
    squares = weights = count = 0.0
    total = total_squares = 0.0
    design = np.empty(UNKNOWNS)
    h = pattern_from_ray
    limit = 4.0 * scale
    flat_c, flat_r = blur_at_centre(h, ray_step, half, _FLAT * blur)
    skew = max(1, int(stride * 0.618 + 0.5))
    for v in range(box[1], box[3]):
        for u in range(box[0] + (v * skew) % stride, box[2], stride):
            rx, ry = rays[v, u, 0], rays[v, u, 1]
            w = 1.0 / (h[2, 0] * rx + h[2, 1] * ry + h[2, 2])
            c = (h[0, 0] * rx + h[0, 1] * ry + h[0, 2]) * w
            r = (h[1, 0] * rx + h[1, 1] * ry + h[1, 2]) * w
            if not (c > -1.0 and r > -1.0 and c < n + 1.0 and r < n + 1.0):
                continue
            k, m = math.floor(c) + 1, math.floor(r) + 1
            from_c, from_r = c - (k - 1), r - (m - 1)
            grey = float(image[v, u])
            if (
                from_c > flat_c
                and from_c < 1.0 - flat_c
                and from_r > flat_r
                and from_r < 1.0 - flat_r
                and k > 0
                and m > 0
                and k <= n
                and m <= n
            ):
                if (u + 2 * v) & 3:  # inside a cell a quarter of the pixels says as much
                    continue
                value = cells[m, k]
                residual = grey - black - contrast * value
                size = abs(residual)
                weight = 1.0 if size <= limit else (limit / size) ** 2
                histogram[min(int(size * 4.0), 255)] += 1
                squares += weight * residual * residual
                weights += weight
                count += 1.0
                total += grey
                total_squares += grey * grey
                normal[8, 8] += weight
                normal[8, 9] += weight * value
                normal[9, 9] += weight * value * value
                right[8] += weight * residual
                right[9] += weight * residual * value
                continue
            cx, cy = (h[0, 0] - c * h[2, 0]) * w, (h[0, 1] - c * h[2, 1]) * w
            dx, dy = (h[1, 0] - r * h[2, 0]) * w, (h[1, 1] - r * h[2, 1]) * w
            cu, cv = (
                cx * ray_step[0, 0] + cy * ray_step[1, 0],
                cx * ray_step[0, 1] + cy * ray_step[1, 1],
            )
            du, dv = (
                dx * ray_step[0, 0] + dy * ray_step[1, 0],
                dx * ray_step[0, 1] + dy * ray_step[1, 1],
            )
            blur_c = blur * math.sqrt(cu * cu + cv * cv)
            blur_r = blur * math.sqrt(du * du + dv * dv)
            rim_c = max(1.0 - 3.5 * blur_c, 0.2)
            rim_r = max(1.0 - 3.5 * blur_r, 0.2)
            if c < -rim_c or c > n + rim_c or r < -rim_r or r > n + rim_r:
                continue
            z0, z1 = (c - (k - 1)) / blur_c, (c - k) / blur_c
            y0, y1 = (r - (m - 1)) / blur_r, (r - m) / blur_r
            s0, g0 = gaussian_edge(z0, step, bell)
            s1, g1 = gaussian_edge(z1, step, bell)
            t0, b0 = gaussian_edge(y0, step, bell)
            t1, b1 = gaussian_edge(y1, step, bell)
            k0, k2 = max(k - 1, 0), min(k + 1, n + 1)
            m0, m2 = max(m - 1, 0), min(m + 1, n + 1)
            wc0, wc1, wc2 = 1.0 - s0, s0 - s1, s1
            wr0, wr1, wr2 = 1.0 - t0, t0 - t1, t1
            left = wr0 * cells[m0, k0] + wr1 * cells[m, k0] + wr2 * cells[m2, k0]
            middle = wr0 * cells[m0, k] + wr1 * cells[m, k] + wr2 * cells[m2, k]
            after = wr0 * cells[m0, k2] + wr1 * cells[m, k2] + wr2 * cells[m2, k2]
            upper = wc0 * cells[m0, k0] + wc1 * cells[m0, k] + wc2 * cells[m0, k2]
            centre = wc0 * cells[m, k0] + wc1 * cells[m, k] + wc2 * cells[m, k2]
            lower = wc0 * cells[m2, k0] + wc1 * cells[m2, k] + wc2 * cells[m2, k2]
            value = wc0 * left + wc1 * middle + wc2 * after
            rho = (cu * du + cv * dv) * blur * blur / (blur_c * blur_r)
            twist = 0.0
            if g0 * b0 > 0.0:
                mixed = cells[m, k] - cells[m, k0] - cells[m0, k] + cells[m0, k0]
                twist += mixed * g0 * b0 * (1.0 + 0.5 * rho * z0 * y0)
            if g1 * b0 > 0.0:
                mixed = cells[m, k2] - cells[m, k] - cells[m0, k2] + cells[m0, k]
                twist += mixed * g1 * b0 * (1.0 + 0.5 * rho * z1 * y0)
            if g0 * b1 > 0.0:
                mixed = cells[m2, k] - cells[m2, k0] - cells[m, k] + cells[m, k0]
                twist += mixed * g0 * b1 * (1.0 + 0.5 * rho * z0 * y1)
            if g1 * b1 > 0.0:
                mixed = cells[m2, k2] - cells[m2, k] - cells[m, k2] + cells[m, k]
                twist += mixed * g1 * b1 * (1.0 + 0.5 * rho * z1 * y1)
            value += rho * twist
            grad_c = (g0 * (middle - left) + g1 * (after - middle)) / blur_c
            grad_r = (b0 * (centre - upper) + b1 * (lower - centre)) / blur_r
            residual = grey - black - contrast * value
            size = abs(residual)
            weight = 1.0
            if size > limit:
                weight = (limit / size) ** 2
            histogram[min(int(size * 4.0), 255)] += 1
            squares += weight * residual * residual
            weights += weight
            count += 1.0
            total += grey
            total_squares += grey * grey
            if abs(grad_c) * blur_c + abs(grad_r) * blur_r < 1e-3:
                normal[8, 8] += weight
                normal[8, 9] += weight * value
                normal[9, 9] += weight * value * value
                right[8] += weight * residual
                right[9] += weight * residual * value
                continue
            x, y = (c - half) / half, (r - half) / half
            gc, gr = -contrast * grad_c, -contrast * grad_r
            lean = -(gc * x + gr * y)
            spread = -(
                z0 * g0 * (middle - left)
                + z1 * g1 * (after - middle)
                + y0 * b0 * (centre - upper)
                + y1 * b1 * (lower - centre)
            )
            design[0], design[1], design[2] = gc * x, gc * y, gc
            design[3], design[4], design[5] = gr * x, gr * y, gr
            design[6], design[7] = lean * x, lean * y
            design[8], design[9] = 1.0, value
            design[10] = contrast * spread / blur
            for i in range(UNKNOWNS):
                wi = weight * design[i]
                right[i] += wi * residual
                for j in range(i, UNKNOWNS):
                    normal[i, j] += wi * design[j]
    spread_about_mean = total_squares - total * total / max(count, 1.0)
    return squares, weights, count, spread_about_mean


@numba.njit(cache=True, nogil=True)
def _noise_from(histogram: NDArray[np.int64], count: float) -> float:
    """Noise level from the median of |residual|, grey levels."""
    seen = 0
    for k in range(256):
        seen += histogram[k]
        if 2 * seen >= count:
            below = seen - histogram[k]
            inside = (count / 2.0 - below) / max(histogram[k], 1)
            return max((k + inside) / 4.0 * 1.4826, 0.4)
    return 64.0


@numba.njit(cache=True, nogil=True)
def fit_pattern(
    image: NDArray[np.uint8],
    rays: Array,
    pattern_from_ray: Array,
    ray_step: Array,
    cells: Array,
    blurs: Array,
    box: NDArray[np.int64],
    noise: float,
    most_pixels: float,
    guess: Array,
    tables: Array,
) -> tuple[Array, Array, Array, Array]:
    """Gauss-Newton from coarse to fine.

    `blurs` lists blur widths held on the first passes, which widen the catch; then the blur is
    free, started at the last of them. `guess` holds black, contrast and noise of a good
    prediction (contrast 0: none): the first pass is then also the last, if it moves little. The
    last pass takes about `most_pixels` of the box, spread evenly.

    Returns:
        The map (3, 3), covariance of the small homography (8, 8), state (black, contrast, blur),
        and figures (noise, explained share, pixels, last step in cells, passes).
    """
    h = pattern_from_ray.copy()
    n = cells.shape[0] - 2
    half = n / 2.0
    state = np.array([40.0, 160.0, blurs[0]])
    normal = np.zeros((UNKNOWNS, UNKNOWNS))
    right = np.zeros(UNKNOWNS)
    change = np.zeros(UNKNOWNS)
    histogram = np.zeros(256, dtype=np.int64)
    figures = np.zeros(5)
    covariance = np.zeros((8, 8))
    step, bell = tables[0], tables[1]
    area = max((box[2] - box[0]) * (box[3] - box[1]), 1.0)
    fine = max(1, int(area / most_pixels + 0.5))
    coarse = max(fine, int(area / 1600.0))
    scale = 1e6
    predicted = guess[1] > 0.0
    if predicted:
        state[0], state[1] = guess[0], guess[1]
        scale = 2.0 * guess[2] + 2.0
    held = len(blurs) - 1
    last = 1e9
    for iteration in range(held + MOST_FREE_PASSES):
        free = iteration >= held
        if iteration <= held:
            state[2] = blurs[iteration]
        settled = free and last < 0.02
        at_once = predicted and iteration == 0
        stride = fine if settled or at_once or iteration > held + 3 else coarse
        if iteration == 0 and not predicted:
            _levels(
                image,
                rays,
                h,
                ray_step,
                cells,
                state,
                box,
                stride,
                step,
                bell,
                normal,
                right,
                histogram,
            )
        squares, weights, count, about = accumulate(
            image,
            rays,
            h,
            ray_step,
            cells,
            state,
            box,
            stride,
            scale,
            step,
            bell,
            normal,
            right,
            histogram,
        )
        figures[4] = iteration + 1.0
        if count < 4 * UNKNOWNS:
            figures[0] = 0.0
            figures[1] = 0.0
            return h, covariance, state, figures
        for i in range(UNKNOWNS):
            for j in range(i):
                normal[i, j] = normal[j, i]
        if not free or (state[2] <= LEAST_BLUR and right[BLUR] < 0.0):
            normal[BLUR, :] = 0.0
            normal[:, BLUR] = 0.0
            normal[BLUR, BLUR] = 1.0
            right[BLUR] = 0.0
        for i in range(UNKNOWNS):
            normal[i, i] *= 1.0 + 1e-9
            normal[i, i] += 1e-9
        change[:] = np.linalg.solve(normal, right)
        blur_change = min(max(change[BLUR], -0.3 * state[2]), 0.5 * state[2])
        blur_change = min(max(state[2] + blur_change, LEAST_BLUR), MOST_BLUR) - state[2]
        state[0] += change[BLACK]
        state[1] += change[CONTRAST]
        state[2] += blur_change
        largest = 0.0
        for i in range(8):
            largest = max(largest, abs(change[i]))
        if largest > 2.0:
            change[:8] *= 2.0 / largest
        h = compose(h, change, half)
        last = max(largest, 0.5 * abs(blur_change) / state[2] if free else 0.0)
        scale = max(_noise_from(histogram, count), 0.5 * noise, LEAST_ERROR * state[1])
        after = max(squares - change @ right, 0.0)  # what the step leaves, to first order
        variance = after / max(weights - UNKNOWNS, 1.0)
        figures[0] = math.sqrt(variance)
        figures[1] = 1.0 - after / max(about, 1e-9)
        figures[2] = count
        figures[3] = last
        if free and stride == fine and last < 0.006:
            inverse = np.linalg.inv(normal)
            covariance[:] = inverse[:8, :8] * max(variance, noise * noise)
            return h, covariance, state, figures
    figures[1] = 0.0
    return h, covariance, state, figures


@numba.njit(cache=True, nogil=True)
def _levels(
    image: NDArray[np.uint8],
    rays: Array,
    h: Array,
    ray_step: Array,
    cells: Array,
    state: Array,
    box: NDArray[np.int64],
    stride: int,
    step: Array,
    bell: Array,
    normal: Array,
    right: Array,
    histogram: NDArray[np.int64],
) -> None:
    """Black and contrast by linear least squares at the first guess of the place."""
    accumulate(
        image,
        rays,
        h,
        ray_step,
        cells,
        state,
        box,
        stride,
        1e6,
        step,
        bell,
        normal,
        right,
        histogram,
    )
    a, b, c = normal[8, 8], normal[8, 9], normal[9, 9]
    determinant = a * c - b * b
    if determinant > 1e-9:
        state[0] += (c * right[8] - b * right[9]) / determinant
        state[1] += (a * right[9] - b * right[8]) / determinant
    if state[1] < 10.0:
        state[1] = 10.0
