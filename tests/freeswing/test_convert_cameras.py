"""Cameras through every other program's file and back, through the command line."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.cameras_file import read_cameras, write_cameras
from freeswing.cdpr.rotation import exp_rotation, transform
from freeswing.main import main

LENS = np.array([1100.0, 1101.0, 640.25, 511.125, -0.1, 0.05, 1e-3, -2e-3])
RICH = np.concatenate([LENS, [0.01, 0.2, 0.03, 0.004]])
FISHEYE = np.array([600.0, 601.0, 640.25, 511.125, -0.02, 0.01, -0.003, 0.001])
RESULTS = {
    "opencv": "rig.yml",
    "kalibr": "chain.yaml",
    "anipose": "anipose.toml",
    "colmap": "colmap",
    "qualisys": "rig.qca.txt",
    "ros": "infos",
}


def rig(model: str = "OPENCV", params: np.ndarray = LENS) -> tuple[Camera, ...]:
    poses = [
        transform(exp_rotation(np.array(turn)), np.array(shift))
        for turn, shift in (([0.1, 0.2, 0.3], [1, 2, 3.5]), ([-2.0, 0.5, 1.0], [0.1, -0.2, 2.0]))
    ]
    return tuple(
        Camera(name, (1280, 1024), model, params, pose)
        for name, pose in zip(("left", "right"), poses, strict=True)
    )


@pytest.fixture
def source(tmp_path: Path) -> Path:
    """cameras.toml of two cameras."""
    write_cameras(tmp_path / "cameras.toml", rig())
    return tmp_path / "cameras.toml"


def convert(source: Path, result: Path, *more: str) -> int:
    return main(["convert", str(source), str(result), *more])


@pytest.mark.parametrize("kind", RESULTS)
def test_there_and_back(
    source: Path, kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    middle, back = tmp_path / "out" / RESULTS[kind], tmp_path / "back" / "cameras.toml"
    assert convert(source, middle, "--to", kind) == 0
    said = capsys.readouterr().err
    assert ("holds no poses" in said) == (kind == "ros"), said
    assert convert(middle, back) == 0, "the file is not recognised"
    points = np.random.default_rng(1).uniform([-0.4, -0.4, 1.6], [0.4, 0.4, 2.4], (50, 3))
    for before, after in zip(read_cameras(source), read_cameras(back), strict=True):
        assert (after.name, after.size_px) == (before.name, before.size_px)
        np.testing.assert_allclose(after.project(points), before.project(points), atol=1e-8)
        pose = np.eye(4) if kind == "ros" else before.T_camera_base
        np.testing.assert_allclose(after.T_camera_base, pose, atol=1e-11)


def test_names_that_tell_the_format(source: Path, tmp_path: Path) -> None:
    for name in ("a.qca.txt", "camchain.yaml", "calibration.toml"):
        assert convert(source, tmp_path / "b" / name) == 0, name
        assert convert(tmp_path / "b" / name, tmp_path / "c" / "cameras.toml") == 0, name


def test_clocks_and_shutters_that_are_lost_are_said(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    left, right = rig()
    late = replace(right, clock_offset_s=0.0025, line_time_s=1e-5)
    write_cameras(source, (left, late))
    assert convert(source, tmp_path / "rig.yml", "--to", "opencv") == 0
    said = capsys.readouterr().err
    assert "offsets of up to 2.5 ms are left out" in said
    assert "line times are left out" in said
    assert convert(source, tmp_path / "chain.yaml", "--to", "kalibr") == 0
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    ("model", "params", "kind", "why"),
    [
        ("FULL_OPENCV", RICH, "kalibr", "8 distortion coefficients"),
        ("FULL_OPENCV", RICH, "qualisys", "8 distortion coefficients"),
        ("OPENCV_FISHEYE", FISHEYE, "qualisys", "fisheye"),
    ],
)
def test_a_lens_that_the_format_cannot_hold(
    source: Path,
    model: str,
    params: np.ndarray,
    kind: str,
    why: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    write_cameras(source, rig(model, params))
    assert convert(source, tmp_path / "out.x", "--to", kind) == 2
    assert why in capsys.readouterr().err
    assert not (tmp_path / "out.x").exists()


@pytest.mark.parametrize(
    ("result", "more", "why"),
    [
        ("rig.yaml", (), "its name does not tell the camera format"),
        ("rig.csv", (), "cameras do not become a trajectory"),
        ("rig.yaml", ("--to", "ros"), "ros of 2 cameras is a folder"),
        ("model.txt", ("--to", "colmap"), "is a folder"),
        ("folder", ("--to", "opencv"), "is a folder; opencv is one file"),
        ("cameras.toml", (), "the same file"),
    ],
)
def test_what_cannot_be_written(
    source: Path,
    result: str,
    more: tuple[str, ...],
    why: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (tmp_path / "folder").mkdir()
    assert convert(source, tmp_path / result, *more) == 2
    assert why in capsys.readouterr().err


@pytest.mark.parametrize("name", ["x.yaml", "x.xml", "x.toml", "x.txt", "x"])
def test_what_is_no_camera_file(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / name).write_text("hello: world\n", encoding="utf-8")
    assert convert(tmp_path / name, tmp_path / "out" / "cameras.toml") == 2
    assert "not a camera file known here" in capsys.readouterr().err
    assert convert(tmp_path / "absent.yaml", tmp_path / "out" / "cameras.toml") == 2
    assert "no such file" in capsys.readouterr().err


def test_a_trajectory_is_not_taken_for_cameras(
    session: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    swing = session / "runs" / "swing-01.csv"
    assert convert(swing, tmp_path / "cameras.toml") == 2
    assert "'.toml' is not one of a trajectory" in capsys.readouterr().err
