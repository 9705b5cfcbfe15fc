"""cameras.toml: the round trip is exact and nonsense is named."""

import numpy as np
import pytest

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.cameras_file import read_cameras, write_cameras
from freeswing.cdpr.files.documents import InputError
from freeswing.cdpr.rotation import exp_rotation, transform


def test_round_trip(tmp_path):
    pose = transform(exp_rotation(np.array([0.3, -2.0, 0.7])), np.array([0.1, 1 / 3, 2.0]))
    fisheye = np.array([2000, 2001, 2240, 1680, 0.1, 0.02, -0.03, 0.004]) / 7
    written = (
        Camera("left", (1280, 1024), "PINHOLE", np.array([1e3, 1 / 3 + 999, 640, 512]), pose),
        Camera("right", (640, 480), "OPENCV_FISHEYE", fisheye, pose, -1.5e-4, 1e-5),
    )
    write_cameras(tmp_path / "cameras.toml", written)
    read = read_cameras(tmp_path / "cameras.toml")
    for a, b in zip(written, read, strict=True):
        assert (a.name, a.size_px, a.model) == (b.name, b.size_px, b.model)
        assert (a.clock_offset_s, a.line_time_s) == (b.clock_offset_s, b.line_time_s)
        np.testing.assert_array_equal(a.params, b.params)
        np.testing.assert_allclose(a.T_camera_base, b.T_camera_base, atol=1e-15)


GOOD = """format = "freeswing-cameras/1"
[[cameras]]
name = "a"
size_px = [1280, 1024]
model = "PINHOLE"
params = [1000.0, 1000.0, 639.5, 511.5]
q_camera_base = [1.0, 0.0, 0.0, 0.0]
t_camera_base_m = [0.0, 0.0, 0.0]
"""


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("PINHOLE", "BROWN", "BROWN"),
        ("1000.0, 1000.0, 639.5", "1000.0, 639.5", "fx fy cx cy"),
        ("1000.0, 1000.0, 639.5", "-1000.0, 1000.0, 639.5", "focal"),
        ("[1.0, 0.0, 0.0, 0.0]", "[1.0, 1.0, 0.0, 0.0]", "length is 1.41"),
        ("[0.0, 0.0, 0.0]", "[0.0, 0.0, inf]", "t_camera_base_m"),
        ("[1280, 1024]", "[1280.5, 1024]", "size_px"),
        ("1000.0, 1000.0, 639.5", "127.0, 1000.0, 639.5", "expected 0.1 to 100 times"),
        ("1000.0, 1000.0, 639.5", "1000.0, 128001.0, 639.5", "expected 0.1 to 100 times"),
        ("639.5, 511.5", "639.5, 1537.0", "far outside the image"),
        ("639.5, 511.5", "-641.0, 511.5", "far outside the image"),
        (
            '"PINHOLE"\nparams = [1000.0, 1000.0, 639.5, 511.5]',
            '"OPENCV"\nparams = [1000.0, 1000.0, 639.5, 511.5, -3.0, 0.0, 0.0, 0.0]',
            "folds the image over",
        ),
        (
            '"PINHOLE"\nparams = [1000.0, 1000.0, 639.5, 511.5]',
            '"OPENCV"\nparams = [1000.0, 1000.0, 639.5, 511.5, 160.0, 0.0, 0.0, 0.0]',
            "% of the angle that half of the image's diagonal sees",
        ),
        ('name = "a"', 'title = "a"', "title"),
        ("cameras/1", "cameras/2", "cameras/2"),
        ("[[cameras]]", "[[kameras]]", "cameras: missing"),
    ],
)
def test_nonsense_is_named(tmp_path, old, new, named):
    path = tmp_path / "cameras.toml"
    path.write_text(GOOD.replace(old, new))
    with pytest.raises(InputError, match=named):
        read_cameras(path)


@pytest.mark.parametrize(
    "lens",
    [
        'PINHOLE"\nparams = [129.0, 127999.0, 1919.0, -511.0]',
        'OPENCV"\nparams = [1000.0, 1000.0, 639.5, 511.5, -0.45, 0.2, 0.0, 0.0]',
        'OPENCV"\nparams = [1000.0, 1000.0, 639.5, 511.5, 140.0, 0.0, 0.0, 0.0]',
        'OPENCV_FISHEYE"\nparams = [330.0, 330.0, 639.5, 511.5, 0.1, -0.02, 0.0, 0.0]',
    ],
)
def test_unusual_lenses_are_believed(tmp_path, lens):
    path = tmp_path / "cameras.toml"
    path.write_text(GOOD.replace('PINHOLE"\nparams = [1000.0, 1000.0, 639.5, 511.5]', lens))
    assert read_cameras(path)[0].model == lens.partition('"')[0]


def test_all_problems_at_once_and_twins(tmp_path):
    path = tmp_path / "cameras.toml"
    path.write_text(GOOD + GOOD.partition("\n")[2].replace("PINHOLE", "WIDE"))
    with pytest.raises(InputError, match="WIDE"):
        read_cameras(path)
    path.write_text(GOOD + GOOD.partition("\n")[2])
    with pytest.raises(InputError, match="two cameras"):
        read_cameras(path)
