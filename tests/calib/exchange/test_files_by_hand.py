"""Files by hand after other programs' formats: what is odd in them is read right or said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from freeswing.calib.camera.cameras_file import read_cameras
from freeswing.main import main

CHAIN = """cam{number}:
  camera_model: pinhole
  distortion_coeffs: [-0.28, 0.07, 0.0002, 1.8e-05]
  distortion_model: radtan
  intrinsics: {intrinsics}
  resolution: [752, 480]
"""
PINHOLE = "[458.7, 457.3, 367.2, 248.4]"
K = "800., {skew}, 319.5, 0., 801., 239.5, 0., 0., {last}"
ROS = """image_width: 640
image_height: 480
camera_name: left
camera_matrix: {{rows: 3, cols: 3, data: [800.0, 0.0, 319.5, 0.0, 801.0, 239.5, 0.0, 0.0, 1.0]}}
distortion_model: {model}
distortion_coefficients: {{rows: 1, cols: 5, data: [0.9, 0.0, 0.0, 0.0, 0.0]}}
{more}
"""
QTM = """<calibration type="regular"><cameras>
 <camera active="1" viewrotation="90" serial="26578" model="Miqus Video">
  <fov_video left="0" top="0" right="1919" bottom="1087"/>
  <transform x="1000" y="0" z="2000" r11="1" r12="0" r13="0" r21="0" r22="1" r23="0" r31="0"
   r32="0" r33="1"/>
  <intrinsic focalLengthU="96000" focalLengthV="96000" centerPointU="61440" centerPointV="34816"
   skew="{skew}" radialDistortion1="0" radialDistortion2="0" radialDistortion3="0"
   tangentalDistortion1="0" tangentalDistortion2="0"/>
 </camera></cameras></calibration>
"""


def shift(key: str, x: float) -> str:
    return f"  {key}: [[1, 0, 0, {x}], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n"


def camera(number: int, more: str = "", intrinsics: str = PINHOLE) -> str:
    return CHAIN.format(number=number, intrinsics=intrinsics) + more


def matrix(name: str, rows: int, data: str) -> str:
    cols = len(data.split(",")) // rows
    return f"{name}: !!opencv-matrix\n  rows: {rows}\n  cols: {cols}\n  dt: d\n  data: [{data}]\n"


def stereo(across: str) -> str:
    parts = ["%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\n"]
    for side in "12":
        parts.append(matrix(f"M{side}", 3, K.format(skew="0.", last="1.")))
        parts.append(matrix(f"D{side}", 1, "-.1, .01, 0., 0., 0."))
    parts.append(matrix("R", 3, "1., 0., 0., 0., 1., 0., 0., 0., 1."))
    return "".join([*parts, matrix("T", 3, f"{across}, 0., 0.")])


def opencv(skew: str, last: str) -> str:
    head = "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\n"
    lens = matrix("camera_matrix", 3, K.format(skew=skew, last=last))
    return head + lens + matrix("distortion_coefficients", 1, "-.1, .01, 0., 0., 0.")


def status(folder: Path, name: str, text: str) -> int:
    (folder / name).write_text(text)
    return main(["convert", str(folder / name), str(folder / "c.toml"), "--to", "freeswing"])


def places(folder: Path) -> dict[str, list[float]]:
    found = read_cameras(folder / "c.toml")
    return {c.name: np.round(c.position_base_m, 9).tolist() for c in found}


def test_the_imu_of_one_camera_is_the_base_of_all(tmp_path) -> None:
    link = shift("T_cn_cnm1", -0.1)
    text = camera(0) + camera(1, shift("T_cam_imu", 0.5) + link) + camera(2, link)
    assert status(tmp_path, "chain.yaml", text) == 0
    assert places(tmp_path) == {"cam0": [-0.6, 0, 0], "cam1": [-0.5, 0, 0], "cam2": [-0.4, 0, 0]}


def test_a_link_to_a_camera_that_is_not_in_the_file_joins_nothing(tmp_path, capsys) -> None:
    link = shift("T_cn_cnm1", -0.1)
    text = camera(10, link) + camera(1, link) + camera(0)
    assert status(tmp_path, "chain.yaml", text) == 0
    assert list(places(tmp_path)) == ["cam0", "cam1"]
    assert "cam10: nothing joins it" in capsys.readouterr().err


def test_a_stereo_pair_in_millimetres(tmp_path, capsys) -> None:
    assert status(tmp_path, "pair.yml", stereo("-120.")) == 0
    assert places(tmp_path)["right"] == [0.12, 0, 0]
    assert "taken for millimetres" in capsys.readouterr().err
    assert status(tmp_path, "pair.yml", stereo("-3.5")) == 0
    assert "states no unit: its cameras are taken to stand 3.5 m apart" in capsys.readouterr().err


def test_colmap_says_what_it_leaves_out(tmp_path, capsys) -> None:
    (tmp_path / "model").mkdir()
    lenses = "1 PINHOLE 640 480 500 501 320 240\n2 PINHOLE 640 480 500 501 320 240\n"
    images = "1 1 0 0 0 0 0 0 1 a.png\n\n2 1 0 0 0 -1 0 0 7 b.png\n1.5 2.5 -1\n"
    (tmp_path / "model/cameras.txt").write_text(lenses)
    (tmp_path / "model/images.txt").write_text(images)
    words = ["convert", str(tmp_path / "model"), str(tmp_path / "c.toml"), "--to", "freeswing"]
    assert main(words) == 0
    assert list(places(tmp_path)) == ["a"]
    said = capsys.readouterr().err
    assert "image b.png: its camera 7 is not in cameras.txt" in said
    assert "camera 2 of cameras.txt took no image" in said


def test_cameras_without_poses_are_said_to_stand_at_the_origin(tmp_path, capsys) -> None:
    (tmp_path / "ros").mkdir()
    for name in ("left", "right"):
        text = ROS.format(model="plumb_bob", more="").replace("left", name)
        (tmp_path / "ros" / f"{name}.yaml").write_text(text)
    words = ["convert", str(tmp_path / "ros"), str(tmp_path / "c.toml"), "--to", "freeswing"]
    assert main(words) == 0
    assert "holds no poses" in capsys.readouterr().err


def test_a_picture_stated_as_the_sensor_has_it_is_turned_as_well(tmp_path) -> None:
    assert status(tmp_path, "lab.qca.txt", QTM.format(skew="0")) == 0
    (one,) = read_cameras(tmp_path / "c.toml")
    assert one.size_px == (1088, 1920)
    assert np.allclose(one.centre_px, [1087.0 - 544.0, 960.0])


@pytest.mark.parametrize(
    ("name", "text", "why"),
    [
        ("chain.yaml", camera(0, intrinsics="[458.7, 457.3, 367.2, 248.4, 0.3]"), "pinhole"),
        ("cv.yml", opencv("0.5", "1."), "skew of 0.5"),
        ("cv.yml", opencv("0.", "2."), "last row"),
        ("ros.yaml", ROS.format(model="field_of_view", more=""), "field_of_view"),
        ("ros.yaml", ROS.format(model="plumb_bob", more="binning_x: 2"), "binning"),
        ("ros.yaml", ROS.format(model="plumb_bob", more="roi: {x_offset: 8}"), "roi"),
        ("lab.qca.txt", QTM.format(skew="64"), "skew of 64"),
    ],
)
def test_what_no_camera_here_can_hold_is_refused(tmp_path, capsys, name, text, why) -> None:
    assert status(tmp_path, name, text) == 2
    assert why in capsys.readouterr().err
    assert not (tmp_path / "c.toml").exists()


@pytest.mark.parametrize(("skew", "wanted"), [("7.6e-4", 0), ("8.4e-4", 2)])
def test_a_skew_of_rounding_is_none(tmp_path, skew, wanted) -> None:
    """A millionth of a focal length of 800 px, on both sides."""
    assert status(tmp_path, "cv.yml", opencv(skew, "1.")) == wanted
