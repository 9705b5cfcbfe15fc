"""The pattern fit against rendered truth: accuracy, bias and honesty of the covariance."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from freeswing.calib.tags.corners import fit_tag, lens_rays, pixel_rays, rimmed_cells, to_pixels
from freeswing.cdpr.rotation import exp_rotation
from freeswing.vision.render.patterns import tag_patch
from freeswing.vision.render.render_scene import Look, Renderer, Scene, still
from tests.vision.scenes import camera, facing

VIEW = camera()
RAYS = lens_rays(VIEW)
DRAWS = 25


def true_corners(patch, size_m) -> np.ndarray:
    h = size_m / 2
    local = np.array([[-h, h, 0, 1], [h, h, 0, 1], [h, -h, 0, 1], [-h, -h, 0, 1]])
    return VIEW.to_camera((local @ patch.T_parent_patch.T)[:, :3])


def fits(size_m, look, draws=DRAWS, guess_px=0.7, tilt=0.5):
    """Errors (n, 8) in px and covariances (n, 8, 8) of fits to seeded views of a tag."""
    random = np.random.default_rng(5)
    errors, covariances = [], []
    renderer = Renderer(VIEW, Scene((), still()), look)
    for k in range(draws):
        pose = facing((random.uniform(-0.5, 0.5), 0.0, random.uniform(-0.3, 0.3)))
        pose[:3, :3] = exp_rotation(random.uniform(-tilt, tilt, 3)) @ pose[:3, :3]
        patch = tag_patch("tag36h11", k, size_m, pose)
        renderer.scene = Scene((patch,), still())
        image = renderer.frame(0.0, k)
        truth = VIEW.project(true_corners(patch, size_m))
        guess = truth + random.normal(0.0, guess_px, (4, 2))
        cells = rimmed_cells("tag36h11", k)
        found = fit_tag(image, RAYS, VIEW.normalise(guess), guess, cells)
        assert found is not None, f"draw {k} was not found"
        pixels, covariance = to_pixels(VIEW, found.rays, found.rays_covariance)
        errors.append((pixels - truth).ravel())
        covariances.append(covariance)
    return np.array(errors), np.array(covariances)


@pytest.mark.parametrize(("size_m", "limit_px"), [(0.21, 0.006), (0.09, 0.009)])
def test_corners_of_80_and_35_px_tags(size_m, limit_px) -> None:
    errors, covariances = fits(size_m, Look(noise=2.0))
    rms = np.sqrt((errors**2).mean())
    bias = errors.reshape(-1, 2).mean(axis=0)
    assert rms < limit_px, f"rms {rms:.4f} px per axis"
    assert np.abs(bias).max() < 0.003, f"bias {bias} px"
    total = np.einsum("ni,nij,nj->", errors, np.linalg.inv(covariances), errors)
    low, high = chi2.ppf([0.0005, 0.9995], errors.size)
    assert low < total < 1.15 * high, f"chi-square {total:.0f}, expected {low:.0f} to {high:.0f}"


def test_strong_blur_and_noise_stay_honest() -> None:
    errors, covariances = fits(0.21, Look(noise=6.0, psf_px=2.0), draws=12)
    ratio = np.einsum("ni,nij,nj->", errors, np.linalg.inv(covariances), errors) / errors.size
    assert 0.6 < ratio < 1.6, f"normalised error squared {ratio:.2f}"
    assert np.sqrt((errors**2).mean()) < 0.04, f"rms {np.sqrt((errors**2).mean()):.4f} px"


def test_a_cable_across_the_tag_does_little_harm() -> None:
    size = 0.21
    patch = tag_patch("tag36h11", 4, size, facing())
    image = Renderer(VIEW, Scene((patch,), still()), Look()).frame(0.0).copy()
    truth = VIEW.project(true_corners(patch, size))
    row = int(truth[:, 1].mean()) + 9
    image[row : row + 3] = 25
    found = fit_tag(image, RAYS, VIEW.normalise(truth), truth, rimmed_cells("tag36h11", 4))
    pixels = to_pixels(VIEW, found.rays, found.rays_covariance)[0]
    worst = np.abs(pixels - truth).max()
    assert worst < 0.05, f"corner off by {worst:.3f} px"


@pytest.mark.parametrize("wrong", ["other tag", "background"])
def test_what_is_not_the_tag_is_refused(wrong) -> None:
    size = 0.21
    patch = tag_patch("tag36h11", 4, size, facing())
    image = Renderer(VIEW, Scene((patch,), still())).frame(0.0)
    truth = VIEW.project(true_corners(patch, size))
    guess, tag_id = (truth, 5) if wrong == "other tag" else (truth + 150.0, 4)
    found = fit_tag(image, RAYS, VIEW.normalise(guess), guess, rimmed_cells("tag36h11", tag_id))
    assert found is None, f"explained {getattr(found, 'explained', None)}"


def test_plain_pixel_coordinates_serve_before_the_lens_is_known() -> None:
    view = camera(model="PINHOLE", params=[900.0, 900.0, 359.5, 287.5])
    size = 0.21
    patch = tag_patch("tag36h11", 9, size, facing(yaw=0.3))
    image = Renderer(view, Scene((patch,), still())).frame(0.0)
    h = size / 2
    local = np.array([[-h, h, 0, 1], [h, h, 0, 1], [h, -h, 0, 1], [-h, -h, 0, 1]])
    truth = view.project(view.to_camera((local @ patch.T_parent_patch.T)[:, :3]))
    grid = pixel_rays(view.size_px)
    found = fit_tag(image, grid, truth + 0.5, truth + 0.5, rimmed_cells("tag36h11", 9))
    worst = np.abs(found.rays - truth).max()
    assert worst < 0.02, f"corner off by {worst:.4f} px"
