"""The pixels along a tag's edges: what they tell, how many they are, where they do not serve."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from freeswing.calib.tags.corner_kernels import TagImage, accumulate, new_arrays
from freeswing.calib.tags.corners import fit_tag, pixel_rays, rimmed_cells
from freeswing.calib.tags.edge_pass import new_work, pass_over
from freeswing.calib.tags.edge_pixels import COUNTS, edge_pixels
from freeswing.calib.tags.gaussian_tables import TABLES
from freeswing.calib.tags.pattern_fit import PatternFit, Search, _fit_edges, _is_wide
from freeswing.calib.tags.tag_map import corners_of_map, map_of_square
from freeswing.vision.look.follow import MOST_PIXELS

SIZE_PX = (180, 180)
GRID = pixel_rays(SIZE_PX)
NOISE = 3.0
LEVELS = 40.0, 160.0


def drawn(corners: np.ndarray, blur: float, tag_id: int = 5) -> np.ndarray:
    """A tag's grey values (h, w): sharp print, blurred by Fourier's transform, averaged.

    Each pixel is the mean of 8 by 8 points; nothing of the fit but the homography takes part.
    """
    fine = 8
    cells = rimmed_cells("tag36h11", tag_id)
    at = (np.arange(SIZE_PX[0] * fine) + 0.5) / fine - 0.5
    x, y = np.meshgrid(at, at)
    h = map_of_square(corners, 8.0)
    w = h[2, 0] * x + h[2, 1] * y + h[2, 2]
    c = np.floor((h[0, 0] * x + h[0, 1] * y + h[0, 2]) / w).astype(int) + 1
    r = np.floor((h[1, 0] * x + h[1, 1] * y + h[1, 2]) / w).astype(int) + 1
    sharp = cells[np.clip(r, 0, 9), np.clip(c, 0, 9)]
    own = blur**2 - 1.0 / 12.0  # the pixel's square is the mean over its points
    frequency = np.fft.fftfreq(len(at), 1.0 / fine)
    bell = np.exp(-2.0 * (np.pi * frequency) ** 2 * own)
    soft = np.fft.ifft2(np.fft.fft2(sharp) * bell[:, None] * bell[None]).real
    return soft.reshape(SIZE_PX[1], fine, SIZE_PX[0], fine).mean(axis=(1, 3))


def square(side_px: float, turn: float = 0.3, at=(90.3, 89.6)) -> np.ndarray:
    """Corners TL TR BR BL of a slightly slanted square, (4, 2)."""
    unit = np.array([[-0.5, -0.5], [0.5, -0.47], [0.49, 0.5], [-0.5, 0.48]]) * side_px
    c, s = np.cos(turn), np.sin(turn)
    return unit @ np.array([[c, s], [-s, c]]) + np.array(at)


def exposed(clean: np.ndarray, seed: int, noise: float = NOISE) -> np.ndarray:
    grey = LEVELS[0] + LEVELS[1] * clean
    grey = grey + noise * np.random.default_rng(seed).standard_normal(clean.shape)
    return np.clip(np.round(grey), 0, 255).astype(np.uint8)


def deviation_of(normal: np.ndarray) -> float:
    """Mean deviation of the small homography from an upper triangle of normal equations."""
    whole = np.triu(normal) + np.triu(normal, 1).T
    return float(np.sqrt(np.diag(np.linalg.inv(whole))[:8]).mean())


def both(side_px: float, blur: float, most: float = 1e9):
    """Deviations by all pixels of a box and by those along the edges, and how many these are."""
    corners = square(side_px)
    image = exposed(drawn(corners, blur), 0)
    low, high = corners.min(axis=0) - side_px / 5, corners.max(axis=0) + side_px / 5
    box = np.array([*np.maximum(low, 0), *np.minimum(high + 1, SIZE_PX)]).astype(np.int64)
    tag = TagImage(image, GRID, np.eye(2), rimmed_cells("tag36h11", 5), box, *TABLES)
    h, state = map_of_square(corners, 8.0), np.array([*LEVELS, blur])
    whole = accumulate(tag, h, state, 1, NOISE, new_arrays())
    pixels = edge_pixels(tag, h, blur, most)
    edges = pass_over(tag, pixels, h, state, NOISE, new_work())
    return (
        deviation_of(whole.normal),
        deviation_of(edges.normal),
        int(pixels.fields[:, COUNTS].sum()),
        float(whole.pixels),
    )


@pytest.mark.parametrize(("side_px", "most_share"), [(50.0, 0.7), (80.0, 0.45), (130.0, 0.3)])
def test_the_edges_tell_what_all_pixels_tell(side_px, most_share) -> None:
    whole, edges, count, pixels = both(side_px, 0.76)
    assert whole <= edges < 1.015 * whole, f"{edges / whole:.4f} times the deviation of all pixels"
    assert count < most_share * pixels, f"{count} of {pixels:.0f} pixels"


def test_fewer_pixels_on_request() -> None:
    _, deviation, count, _ = both(130.0, 0.76)
    _, thinned, fewer, _ = both(130.0, 0.76, most=count / 3)
    assert fewer < 0.55 * count
    assert thinned == pytest.approx(deviation * np.sqrt(count / fewer), rel=0.25)


def corner_errors(side_px: float, blur: float, draws: int, noise: float, off_px=0.03):
    """Errors (draws, 8), covariances (draws, 8, 8), of fits as a follower makes them."""
    errors, covariances = [], []
    cells = rimmed_cells("tag36h11", 5)
    random = np.random.default_rng(3)
    corners, clean = np.zeros((4, 2)), np.zeros((2, 2))
    for k in range(draws):
        if k % 5 == 0:
            corners = square(side_px, at=90.0 + random.uniform(-1, 1, 2))
            clean = drawn(corners, blur)
        image = exposed(clean, k, noise)
        guess = corners + random.normal(0.0, off_px, 2)
        fit = fit_tag(
            image, GRID, guess, guess, cells, blurs_px=(blur,), most_pixels=MOST_PIXELS,
            before=(*LEVELS, blur, noise),
        )  # fmt: skip
        assert fit is not None, f"draw {k} was not found"
        errors.append((fit.rays - corners).ravel())
        covariances.append(fit.rays_covariance)
    return np.array(errors), np.array(covariances)


def test_pixels_without_a_ray_count_nothing() -> None:
    """A lens has no ray beyond its rim; what is told of the rest stays as it is."""
    corners, cells = square(80.0), rimmed_cells("tag36h11", 5)
    image, without = exposed(drawn(corners, 0.76), 0), GRID.copy()
    left = int(corners[:, 0].min())
    without[:, left - 2 : left + 4] = np.nan
    whole, fit = (
        fit_tag(
            image, rays, corners, corners, cells, blurs_px=(0.76,), before=(*LEVELS, 0.76, NOISE)
        )
        for rays in (GRID, without)
    )
    assert whole is not None
    assert fit is not None
    assert 0.7 * whole.pixels < fit.pixels < 0.95 * whole.pixels
    off = np.abs(fit.rays - corners).max()
    assert off < 0.05, f"{off:.3f} px off"


def test_80_px_corners_come_close_to_their_bound() -> None:
    errors, covariances = corner_errors(80.0, 0.76, 25, NOISE)
    rms = np.sqrt((errors**2).mean())
    bound = both(80.0, 0.76)[0]
    assert rms < 0.008, f"{rms:.4f} px an axis; the small homography's bound is {bound:.5f}"
    total = np.einsum("ni,nij,nj->", errors, np.linalg.inv(covariances), errors)
    low, high = chi2.ppf([0.0005, 0.9995], errors.size)
    assert low < total < high, f"chi-square {total:.0f}, expected {low:.0f} to {high:.0f}"


@pytest.mark.parametrize(("cell_blurs", "wide"), [(5.8, True), (5.2, False)])
def test_narrow_cells_are_read_from_the_whole_box(cell_blurs, wide) -> None:
    """Beyond the limit the next edge is not seen: the fit along the edges has no bias there."""
    blur = 1.3
    corners = square(8.0 * cell_blurs * blur)
    cells = rimmed_cells("tag36h11", 5)
    box = np.array([0, 0, *SIZE_PX], dtype=np.int64)
    tag = TagImage(exposed(drawn(corners, blur), 1, 0.5), GRID, np.eye(2), cells, box, *TABLES)
    assert _is_wide(tag, map_of_square(corners, 8.0), blur) == wide
    fit = fit_tag(
        tag.image, GRID, corners, corners, cells, blurs_px=(blur,), before=(*LEVELS, blur, 0.5)
    )
    assert fit is not None
    assert np.abs(fit.rays - corners).max() < 0.01, f"{np.abs(fit.rays - corners).max():.4f} px"


def fitted_along_edges(image: np.ndarray, guess: np.ndarray) -> PatternFit:
    """The fit along the edges of an image without noise, from a prediction of its corners."""
    box = np.array([0, 0, *SIZE_PX], dtype=np.int64)
    tag = TagImage(image, GRID, np.eye(2), rimmed_cells("tag36h11", 5), box, *TABLES)
    search = Search(np.array([0.76]), 1.0, 1e9, np.array([*LEVELS, 0.3]))
    state = np.array([*LEVELS, 0.76])
    return _fit_edges(tag, map_of_square(guess, 8.0), state, search, 2.6)


@pytest.mark.parametrize("at", [(90.3, 89.6), (89.1, 90.9)])
@pytest.mark.parametrize(("off_blurs", "again"), [(0.027, False), (0.037, True)])
def test_one_step_is_enough_from_three_hundredths_of_a_blur(off_blurs, again, at) -> None:
    """The last step is the way there; from farther off one more follows, which hardly moves.

    Either way what is left is within a tenth of the corners' own deviation, that of noise of 1.
    """
    corners = square(100.0, at=at)
    image = exposed(drawn(corners, 0.76), 1, 0.0)
    off = off_blurs * 0.76
    fit = fitted_along_edges(image, corners + np.array([off, 0.0]))
    share = fit.last / (off / (100.0 / 8.0))
    assert share < 0.5 if again else 0.9 < share < 1.1, f"{share:.3f} of the way by the last step"
    found, covariance, _ = corners_of_map(fit.pattern_from_ray, fit.covariance, 8)
    settled = fitted_along_edges(image, corners)
    away = np.abs(found - corners_of_map(settled.pattern_from_ray, settled.covariance, 8)[0]).max()
    deviation = float(np.sqrt(np.diag(covariance).min()))
    assert away < deviation / 10.0, f"{away:.6f} px of {deviation:.6f}"
