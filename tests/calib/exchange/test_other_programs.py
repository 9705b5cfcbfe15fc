"""Camera files of other programs as they come, through `freeswing convert`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.cameras_file import read_cameras
from freeswing.calib.exchange.matrix_and_distortion import turned
from freeswing.cdpr.rotation import exp_rotation, transform
from freeswing.main import main

FILES = Path(__file__).parent / "files"


def imported(source: Path, folder: Path, capsys) -> tuple[dict[str, Camera], str]:
    result = folder / "cameras.toml"
    assert main(["convert", str(source), str(result), "--to", "freeswing"]) == 0
    return {camera.name: camera for camera in read_cameras(result)}, capsys.readouterr().err


def test_a_chain_is_followed_by_number(tmp_path, capsys) -> None:
    cameras, _ = imported(FILES / "chain12.yaml", tmp_path, capsys)
    assert list(cameras) == [f"c{k}" for k in range(12)]
    pose = np.eye(4)
    for k in range(1, 12):  # the file's own numbers: a turn about z and a shift that grow with k
        turn = exp_rotation(np.array([0.0, 0.0, 0.02 * (k + 1)]))
        pose = transform(turn, np.array([0.1 * (k + 1), 0.01 * k, 0.0])) @ pose
        off = np.abs(cameras[f"c{k}"].T_camera_base - pose).max()
        assert off < 1e-9, f"c{k}: {off}"


def test_a_link_that_is_missing_is_said(tmp_path, capsys) -> None:
    text = (FILES / "rs3.yaml").read_text()
    start = text.index("  T_cn_cnm1", text.index("cam2:"))
    (tmp_path / "chain.yaml").write_text(text[:start])
    cameras, said = imported(tmp_path / "chain.yaml", tmp_path, capsys)
    assert list(cameras) == ["camera1", "camera2"]
    assert "cam2" in said, said
    assert "left out" in said, said


def test_topics_name_cameras_by_what_differs(tmp_path, capsys) -> None:
    cameras, _ = imported(FILES / "rs3.yaml", tmp_path, capsys)
    assert list(cameras) == ["camera1", "camera2", "camera3"]
    text = (
        (FILES / "rs3.yaml").read_text().replace("camera/color/image_raw", "image_raw/compressed")
    )
    (tmp_path / "chain.yaml").write_text(text)
    cameras, _ = imported(tmp_path / "chain.yaml", tmp_path, capsys)
    assert list(cameras) == ["camera1", "camera2", "camera3"]


def test_opencv_marks_a_fisheye(tmp_path, capsys) -> None:
    cameras, _ = imported(FILES / "ocv_fisheye.yml", tmp_path, capsys)
    camera = cameras["ocv_fisheye"]
    assert camera.model == "OPENCV_FISHEYE"
    assert camera.params.tolist() == [610.0, 610.0, 639.5, 511.5, -0.02, 0.01, -0.004, 0.0007]


def test_opencv_xml_and_a_stereo_pair(tmp_path, capsys) -> None:
    def matrix(name: str, rows: int, data: str) -> str:
        cols = len(data.split()) // rows
        return (
            f'<{name} type_id="opencv-matrix"><rows>{rows}</rows><cols>{cols}</cols><dt>d</dt>'
            f"<data>{data}</data></{name}>"
        )

    lens = "800. 0. 319.5 0. 801. 239.5 0. 0. 1."
    parts = [
        '<?xml version="1.0"?><opencv_storage>',
        "<image_width>640</image_width><image_height>480</image_height>",
        matrix("M1", 3, lens),
        matrix("D1", 1, "-0.1 0.02 0. 0. 0."),
        matrix("M2", 3, lens),
        matrix("D2", 1, "-0.2 0.02 0. 0. 0."),
        matrix("R", 3, "1. 0. 0. 0. 1. 0. 0. 0. 1."),
        matrix("T", 3, "-0.2 0. 0."),
        "</opencv_storage>",
    ]
    (tmp_path / "intrinsics.xml").write_text("".join(parts))
    cameras, _ = imported(tmp_path / "intrinsics.xml", tmp_path, capsys)
    assert np.allclose(cameras["right"].position_base_m, [0.2, 0.0, 0.0])
    assert cameras["right"].params[4] == -0.2
    (tmp_path / "intrinsics.xml").write_text("".join([*parts[:1], *parts[2:]]))
    assert main(["convert", str(tmp_path / "intrinsics.xml"), str(tmp_path / "c.toml")]) == 2
    assert "no image size" in capsys.readouterr().err


def test_colmap_lines_of_points_are_no_images(tmp_path, capsys) -> None:
    cameras, _ = imported(FILES / "colmap_int", tmp_path, capsys)
    assert list(cameras) == ["left", "right"]
    assert np.allclose(cameras["right"].T_camera_base[:3, 3], [1.0, 0.0, 2.0])


@pytest.mark.parametrize("blank", ["\n", ""])
def test_colmap_images_of_one_name_are_named_by_their_folders(tmp_path, capsys, blank) -> None:
    (tmp_path / "cameras.txt").write_text("1 PINHOLE 640 480 500 500 320 240\n")
    lines = [f"{k} 1 0 0 0 {k} 0 2 1 rig/cam{k}/000001.png\n{blank}" for k in (1, 2, 3)]
    (tmp_path / "images.txt").write_text("".join(lines))
    cameras, _ = imported(tmp_path, tmp_path / "out", capsys)
    assert list(cameras) == ["cam1", "cam2", "cam3"]


def test_a_camera_without_a_pose_is_left_out_and_millimetres_are_seen(tmp_path, capsys) -> None:
    cameras, said = imported(FILES / "noposes.toml", tmp_path, capsys)
    assert list(cameras) == ["c0"]
    assert "c1 has no pose: left out" in said, said
    assert "taken for millimetres" in said, said
    assert np.allclose(cameras["c0"].T_camera_base[:3, 3], [-0.0015, 0.02, 2.4])


def test_a_turned_picture_is_refused_by_name(tmp_path, capsys) -> None:
    assert main(["convert", str(FILES / "rotcount.toml"), str(tmp_path / "c.toml")]) == 2
    assert "rotation_count = 1" in capsys.readouterr().err


def test_qualisys_portrait_and_binned(tmp_path, capsys) -> None:
    cameras, said = imported(FILES / "qportrait.qca.txt", tmp_path, capsys)
    assert cameras["1"].size_px == (1088, 1920)
    assert np.allclose(cameras["1"].centre_px, [1087.0 - 544.0, 960.0])
    assert "viewrotation 90" in said, said
    cameras, said = imported(FILES / "qbinned.qca.txt", tmp_path, capsys)
    assert cameras["1"].size_px == (960, 540)
    assert np.allclose(cameras["1"].centre_px, [(960.0 - 0.5) / 2, (544.0 - 0.5) / 2])
    assert np.allclose(cameras["1"].focal_px, 110000.0 / 64.0 / 2.0)
    assert "bins 2 x 2" in said, said


@pytest.mark.parametrize("model", ["OPENCV", "OPENCV_FISHEYE"])
def test_a_turned_camera_sees_the_same_turned(model) -> None:
    params = [500.0, 510.0, 300.0, 220.0, -0.1, 0.03, 0.002, -0.003]
    pose = transform(exp_rotation(np.array([0.1, -0.2, 0.3])), np.array([0.1, 0.2, 2.0]))
    camera = Camera("c", (640, 480), model, np.array(params), pose)
    points = np.random.default_rng(3).uniform(-0.4, 0.4, (30, 3))
    before = camera.project(camera.to_camera(points))
    after = turned(camera)
    wanted = np.stack([479.0 - before[:, 1], before[:, 0]], axis=1)
    off = np.abs(after.project(after.to_camera(points)) - wanted).max()
    assert off < 1e-9, f"{off} px"
