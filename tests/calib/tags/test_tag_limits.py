"""Which tags are believed, and how well: both sides of each limit."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.calib.tags import base_tags
from freeswing.calib.tags.corner_kernels import UNKNOWNS, Pass
from freeswing.calib.tags.corners import TagFit, fit_tag, rimmed_cells
from freeswing.calib.tags.pattern_fit import _settled_at, _step
from tests.calib.tags.test_edge_pixels import GRID, drawn, square

CELLS = rimmed_cells("tag36h11", 5)


def fitted(
    side_px: float, blur: float, black=40.0, contrast=160.0, noise=0.3, least=0.01
) -> TagFit | None:
    """A fit of a drawn tag that starts at its true corners and half as blurred again."""
    corners = square(side_px, turn=0.0)
    shade = noise * np.random.default_rng(1).standard_normal(GRID.shape[:2])
    image = np.clip(np.round(black + contrast * drawn(corners, blur) + shade), 0, 255)
    return fit_tag(
        image.astype(np.uint8), GRID, corners, corners, CELLS, blurs_px=(0.7 * blur,), noise=least
    )


@pytest.mark.parametrize(("blur", "found"), [(5.4, 5.4), (6.6, 6.0)])
def test_blur_up_to_six_pixels(blur, found) -> None:
    fit = fitted(140.0, blur)
    assert fit is not None
    assert fit.blur_px == pytest.approx(found, rel=0.04)


@pytest.mark.parametrize(("contrast", "seen"), [(7.5, False), (8.6, True)])
def test_print_that_stands_out_by_eight_grey_levels(contrast, seen) -> None:
    assert (fitted(80.0, 0.76, 100.0, contrast) is not None) == seen


@pytest.mark.parametrize(("noise", "seen"), [(23.5, True), (27.5, False)])
def test_a_pattern_that_explains_three_quarters(noise, seen) -> None:
    """Of the grey values: 77 and 71 %."""
    fit = fitted(80.0, 0.76, 70.0, 110.0, noise)
    assert (fit is not None) == seen
    assert fit is None or fit.explained < 0.79, fit.explained


@pytest.mark.parametrize(("cell_blurs", "seen"), [(1.5, False), (1.68, True)])
def test_cells_that_blend(cell_blurs, seen) -> None:
    """By the blur that the fit finds, 6 % below the true one there."""
    assert (fitted(8.0 * 2.0 * cell_blurs, 2.0, noise=0.0) is not None) == seen


def test_crowded_cells_count_as_less_certain() -> None:
    """A twentieth of a pixel where cells are one blur width narrower than 2.8, and in proportion.

    Without noise nothing else is left.
    """
    for cell_blurs in (1.9, 2.4):
        fit = fitted(8.0 * 2.0 * cell_blurs, 2.0, noise=0.0)
        assert fit is not None
        std = float(np.sqrt(np.diag(fit.rays_covariance)).mean())
        narrowest = np.linalg.norm(fit.rays - np.roll(fit.rays, 1, axis=0), axis=1).min() / 8.0
        missing = 2.8 - narrowest / fit.blur_px
        assert std == pytest.approx(0.05 * missing, rel=0.1), f"{std:.4f} px"


def a_pass(outlying: float = 0.0, scale: float = 1.0) -> Pass:
    """Of a thousand pixels of which so many per cent lie beyond four noise levels."""
    histogram = np.zeros(256, dtype=np.int64)
    far = round(10 * outlying)
    histogram[0], histogram[int(16.0 * scale) + 20] = 1000 - far, far
    return Pass(np.eye(UNKNOWNS), np.zeros(UNKNOWNS), histogram, 1.0, 1000.0, 1000.0, 1e4)


def test_print_is_as_even_as_a_fiftieth_of_its_contrast() -> None:
    """Residuals below it are no outliers, however clean the picture is."""
    step = _step(a_pass(), np.eye(3), np.array([40.0, 160.0, 1.0]), 4.0, 0.1, held=False)
    assert step.scale == pytest.approx(3.2, rel=0.1)


@pytest.mark.parametrize(
    ("outlying", "before", "at_last", "settled"),
    [
        (1.8, 9.0, False, 0.12),
        (2.2, 9.0, False, 0.0),
        (2.2, 1.25, False, 0.02),
        (2.2, 1.35, False, 0.0),
        (2.2, 1.25, True, 0.12),
    ],
)
def test_a_tag_that_is_covered_in_part_has_to_settle(outlying, before, at_last, settled) -> None:
    """Beyond two per cent of outliers; `before` is the last noise level over the new one."""
    found = _settled_at(a_pass(outlying), before, 1.0, at_last)
    assert found == pytest.approx(settled, rel=0.1)


VIEW = SimpleNamespace(name="cam0")


def base_tag(monkeypatch, shift_px: float = 0.0, noise_px: float = 0.0):
    """A surveyed tag seen twice, the second time beside the first."""
    corners = 50.0 * np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    seen = {0: [(corners, noise_px), (corners + np.array([shift_px, 0.0]), noise_px)]}
    monkeypatch.setattr(base_tags, "_tags_of_camera", lambda *_: seen)
    tag = SimpleNamespace(family="tag36h11", id=1, corners_base_m=np.zeros((4, 3)), std_m=None)
    return base_tags.find_base_tags((VIEW,), [[]], [tag], np.array([0.5]))


@pytest.mark.parametrize(("shift_px", "moved"), [(0.95, False), (1.05, True)])
def test_a_surveyed_tag_that_moved(monkeypatch, shift_px, moved) -> None:
    assert bool(base_tag(monkeypatch, shift_px).moved) == moved


def test_corners_of_many_stills_and_their_survey(monkeypatch) -> None:
    fixed = base_tag(monkeypatch).fixed
    np.testing.assert_allclose(fixed.std_scale, 0.003 / 0.5, rtol=0.1)
    np.testing.assert_allclose(fixed.std_m, 3e-4, rtol=0.1)
