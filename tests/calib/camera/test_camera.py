"""Camera models against OpenCV, differences and their own inverse."""

import cv2
import numpy as np
import pytest

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.lens_models import PARAMETER_NAMES, radius_limit

PARAMS = {
    "SIMPLE_PINHOLE": [1000.0, 640.0, 500.0],
    "PINHOLE": [1000.0, 1010.0, 640.0, 500.0],
    "SIMPLE_RADIAL": [1000.0, 640.0, 500.0, -0.15],
    "RADIAL": [1000.0, 640.0, 500.0, -0.15, 0.05],
    "OPENCV": [1000.0, 1010.0, 640.0, 500.0, -0.2, 0.06, 1e-3, -2e-3],
    "FULL_OPENCV": [
        *[1000.0, 1010.0, 640.0, 500.0, -0.2, 0.06, 1e-3, -2e-3],
        *[0.01, 0.02, 0.015, -0.01],
    ],
    "OPENCV_FISHEYE": [600.0, 605.0, 640.0, 500.0, -0.02, 0.01, -0.003, 0.001],
}


def camera(model: str) -> Camera:
    return Camera("cam", (1280, 1024), model, np.array(PARAMS[model]), np.eye(4))


def points(seed: int = 3) -> np.ndarray:
    rng = np.random.default_rng(seed)
    xy = rng.uniform(-0.55, 0.55, (5, 40, 2))
    z = rng.uniform(0.5, 4.0, (5, 40, 1))
    return np.concatenate([xy * z, z], -1)


@pytest.mark.parametrize("model", PARAMETER_NAMES)
def test_jacobians_match_differences(model):
    cam, p = camera(model), points()
    pixels, d_point, d_params = cam.project_jacobian(p)
    np.testing.assert_allclose(pixels, cam.project(p), atol=1e-12)
    for axis in range(3):
        step = np.zeros(3)
        step[axis] = 1e-6
        slope = (cam.project(p + step) - cam.project(p - step)) / 2e-6
        np.testing.assert_allclose(d_point[..., axis], slope, atol=2e-5, rtol=1e-6)
    for k, value in enumerate(cam.params):
        change = 1e-6 * max(1.0, abs(value))
        step = np.zeros(len(cam.params))
        step[k] = change
        ahead = Camera("c", (1, 1), model, cam.params + step, np.eye(4)).project(p)
        behind = Camera("c", (1, 1), model, cam.params - step, np.eye(4)).project(p)
        np.testing.assert_allclose(
            d_params[..., k], (ahead - behind) / (2 * change), atol=2e-5, rtol=1e-6
        )


@pytest.mark.parametrize("model", PARAMETER_NAMES)
def test_normalise_inverts_project(model):
    cam, p = camera(model), points()
    back = cam.normalise(cam.project(p))
    np.testing.assert_allclose(back, p[..., :2] / p[..., 2:], atol=1e-9)


@pytest.mark.parametrize("model", ["OPENCV", "FULL_OPENCV", "OPENCV_FISHEYE"])
def test_projection_is_opencvs(model):
    cam, p = camera(model), points().reshape(-1, 3)
    fx, fy, cx, cy, *rest = cam.params
    matrix = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])
    zero = np.zeros(3)
    if model == "OPENCV_FISHEYE":
        expected, _ = cv2.fisheye.projectPoints(p[:, None], zero, zero, matrix, np.array(rest))
    else:
        expected, _ = cv2.projectPoints(p[:, None], zero, zero, matrix, np.array(rest))
    np.testing.assert_allclose(cam.project(p), expected.reshape(-1, 2), atol=1e-8)


def test_on_axis_and_behind():
    for model in PARAMETER_NAMES:
        cam = camera(model)
        pixels, d_point, _ = cam.project_jacobian(np.array([0.0, 0.0, 2.0]))
        np.testing.assert_allclose(pixels, cam.centre_px)
        assert d_point[0, 0] == pytest.approx(cam.focal_px[0] / 2.0), model
        assert not cam.sees(np.array([0.0, 0.0, -2.0])), model
    assert np.isnan(camera("OPENCV").project(np.array([0.1, 0.1, -1.0]))).all()


def test_folded_lens_is_refused():
    """Past the turning radius of r (1 - 0.5 r^2) a point reappears in the image."""
    cam = Camera("c", (1280, 1024), "SIMPLE_RADIAL", np.array([900.0, 640, 512, -0.5]), np.eye(4))
    limit = radius_limit(cam.model, cam.params)
    assert limit == pytest.approx(np.sqrt(1 / 1.5))
    ghost = np.array([1.35, 0.0, 1.0])
    assert abs(cam.project(ghost)[0] - 640) < 640, "the ghost does land inside the image"
    assert not cam.sees(ghost)
    beyond = 640 + 900 * 0.6  # no ray is bent that far: the largest is limit * 2/3 = 0.544
    assert np.isnan(cam.normalise(np.array([beyond, 512.0]))).all()
    assert np.isfinite(cam.normalise(np.array([640 + 900 * 0.54, 512.0]))).all()


def test_camera_refuses_nonsense():
    with pytest.raises(ValueError, match="THIN_PRISM"):
        Camera("a", (10, 10), "THIN_PRISM", np.zeros(4), np.eye(4))
    with pytest.raises(ValueError, match="takes 4 params"):
        Camera("a", (10, 10), "PINHOLE", np.zeros(5), np.eye(4))
    with pytest.raises(ValueError, match="not finite"):
        Camera("a", (10, 10), "PINHOLE", np.full(4, np.nan), np.eye(4))
