"""Cameras survive a journey through every other program's file."""

import cv2
import numpy as np
import pytest

from freeswing.calib import exchange
from freeswing.calib.camera.camera import Camera
from freeswing.cdpr.files.documents import InputError
from freeswing.cdpr.rotation import exp_rotation, transform
from tests.places import REAL


def rig(model: str = "OPENCV") -> tuple[Camera, ...]:
    lens = {
        "PINHOLE": [1100.0, 1 / 3 + 1101, 640.25, 511.125],
        "OPENCV": [1100.0, 1 / 3 + 1101, 640.25, 511.125, -0.1, 0.05, 1e-3, -2e-3],
        "FULL_OPENCV": [1100.0, 1101, 640.25, 511, -0.1, 0.05, 1e-3, -2e-3, 0.01, 0.2, 0.03, 0.004],
        "OPENCV_FISHEYE": [600.0, 601.0, 640.25, 511.125, -0.02, 0.01, -0.003, 0.001],
    }[model]
    poses = [
        transform(exp_rotation(np.array(turn)), np.array(shift))
        for turn, shift in (([0.1, 0.2, 0.3], [1, 2, 3.5]), ([-2.0, 0.5, 1.0], [0.1, -0.2, 2.0]))
    ]
    return tuple(
        Camera(name, (1280, 1024), model, np.array(lens), pose, offset)
        for name, pose, offset in zip(("left", "right"), poses, (0.0, 2.5e-4), strict=True)
    )


CAN_HOLD = [
    ("freeswing", "cameras.toml", ("PINHOLE", "OPENCV", "FULL_OPENCV", "OPENCV_FISHEYE")),
    ("opencv", "cameras.yml", ("OPENCV", "FULL_OPENCV", "OPENCV_FISHEYE")),
    ("kalibr", "camchain.yaml", ("OPENCV", "OPENCV_FISHEYE")),
    ("ros", "infos", ("OPENCV", "FULL_OPENCV", "OPENCV_FISHEYE")),
    ("anipose", "calibration.toml", ("OPENCV", "FULL_OPENCV", "OPENCV_FISHEYE")),
    ("colmap", "model", ("PINHOLE", "OPENCV", "FULL_OPENCV", "OPENCV_FISHEYE")),
    ("qualisys", "rig.qca.txt", ("OPENCV",)),
]


@pytest.mark.parametrize(
    ("kind", "name", "model"), [(k, n, model) for k, n, models in CAN_HOLD for model in models]
)
def test_round_trip(tmp_path, kind, name, model):
    cameras = rig(model)
    exchange.write(tmp_path / name, cameras, kind)
    assert exchange.guess(tmp_path / name) == kind
    back = exchange.read(tmp_path / name)
    points = np.random.default_rng(1).uniform([-0.4, -0.4, 1.6], [0.4, 0.4, 2.4], (50, 3))
    assert [c.name for c in back] == [c.name for c in cameras]
    for before, after in zip(cameras, back, strict=True):
        assert after.size_px == before.size_px
        np.testing.assert_allclose(after.project(points), before.project(points), atol=1e-9)
        expected = np.eye(4) if kind == "ros" else before.T_camera_base
        np.testing.assert_allclose(after.T_camera_base, expected, atol=1e-12)


def test_kalibr_keeps_the_clock(tmp_path):
    exchange.write(tmp_path / "chain.yaml", rig(), "kalibr")
    assert exchange.read(tmp_path / "chain.yaml")[1].clock_offset_s == 2.5e-4


def test_colmap_is_shifted_by_half_a_pixel(tmp_path):
    """COLMAP's own reader must see the same ray at a pixel whose coordinates are 0.5 larger."""
    pycolmap = pytest.importorskip("pycolmap")
    cameras = rig()
    exchange.write(tmp_path, cameras, "colmap")
    model = pycolmap.Reconstruction(str(tmp_path))
    theirs = model.cameras[1]
    point = np.array([0.2, -0.1, 1.5])
    expected = cameras[0].project(point) + 0.5
    found = np.ravel(theirs.img_from_cam(point[None]))
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_opencv_reads_what_is_written(tmp_path):
    cameras = rig()
    exchange.write(tmp_path / "c.yml", cameras, "opencv")
    storage = cv2.FileStorage(str(tmp_path / "c.yml"), cv2.FILE_STORAGE_READ)
    k = storage.getNode("cameras").at(0).getNode("camera_matrix").mat()
    assert k[0, 2] == 640.25


def test_lens_too_rich_for_the_format(tmp_path):
    with pytest.raises(InputError, match="8 distortion coefficients"):
        exchange.write(tmp_path / "chain.yaml", rig("FULL_OPENCV"), "kalibr")
    with pytest.raises(InputError, match="fisheye"):
        exchange.write(tmp_path / "q.txt", rig("OPENCV_FISHEYE"), "qualisys")


def test_garbage_is_refused(tmp_path):
    path = tmp_path / "x.yaml"
    path.write_text("hello: world\n")
    with pytest.raises(InputError, match="not a camera file"):
        exchange.read(path)
    for kind in ("kalibr", "ros", "anipose", "qualisys", "opencv"):
        with pytest.raises(InputError):
            exchange.read(path, kind)


@pytest.mark.skipif(not REAL.is_dir(), reason="needs ../shared/real")
def test_real_qualisys_file():
    """Four cameras about a person: all look at the middle of the room, from about 2 m up."""
    cameras = exchange.read(REAL / "pose2sim_qualisys4" / "Calib.qca.txt")
    assert [c.name for c in cameras] == ["cam01", "cam02", "cam03", "cam04"]
    assert cameras[0].size_px == (1088, 1920)
    assert cameras[0].focal_px[0] == pytest.approx(1681.24, abs=0.01)
    middle = np.mean([c.position_base_m for c in cameras], axis=0)
    for camera in cameras:
        pixel = camera.project(camera.to_camera(middle * [1, 1, 0.5]))
        assert np.abs(pixel - camera.centre_px).max() < 600, f"{camera.name} sees it at {pixel}"


@pytest.mark.skipif(not REAL.is_dir(), reason="needs ../shared/real")
def test_real_kalibr_like_file():
    cameras = exchange.read(REAL / "tagslam_aviary8" / "cameras.yaml", "kalibr")
    assert len(cameras) == 8
    assert cameras[0].model == "OPENCV"
    assert cameras[0].name == "cam0"
