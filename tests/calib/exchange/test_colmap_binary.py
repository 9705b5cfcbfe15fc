"""COLMAP's binary models: there and back, rigs, damaged files; COLMAP itself is the other side."""

from __future__ import annotations

import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from freeswing.calib import exchange
from freeswing.calib.exchange import colmap_binary
from freeswing.cdpr.files.documents import InputError
from freeswing.main import main
from tests.calib.rigs import rig

pycolmap = pytest.importorskip("pycolmap")


def same(one, other) -> None:
    assert [camera.name for camera in one] == [camera.name for camera in other]
    for a, b in zip(one, other, strict=True):
        assert (a.size_px, a.model) == (b.size_px, b.model)
        assert np.abs(a.params - b.params).max() < 1e-9
        assert np.abs(a.T_camera_base - b.T_camera_base).max() < 1e-12


def test_there_and_back(tmp_path) -> None:
    cameras = rig(3)
    exchange.write(tmp_path, cameras, "colmap-binary")
    model = pycolmap.Reconstruction(str(tmp_path))
    assert model.num_images() == 3
    assert exchange.guess(tmp_path) == "colmap-binary"
    same(cameras, exchange.read(tmp_path))


def test_the_command_converts_it(tmp_path) -> None:
    exchange.write(tmp_path / "model", rig(2), "colmap-binary")
    assert main(["convert", str(tmp_path / "model"), str(tmp_path / "cameras.toml")]) == 0
    same(rig(2), exchange.read(tmp_path / "cameras.toml"))


def test_images_of_a_rig_have_its_poses(tmp_path) -> None:
    """Two cameras fixed to each other, moved once: COLMAP keeps the rig's pose and the offset."""
    first, second = rig(2)
    model = pycolmap.Reconstruction()
    for number, camera in enumerate((first, second), start=1):
        params = camera.params + np.array([0, 0, 0.5, 0.5, 0, 0, 0, 0])
        width, height = camera.size_px
        model.add_camera(
            pycolmap.Camera(
                model="OPENCV", width=width, height=height, params=params, camera_id=number
            )
        )
    T_second_first = second.T_camera_base @ np.linalg.inv(first.T_camera_base)
    one = pycolmap.Rig(rig_id=1)
    one.add_ref_sensor(pycolmap.sensor_t(type=pycolmap.SensorType.CAMERA, id=1))
    one.add_sensor(
        pycolmap.sensor_t(type=pycolmap.SensorType.CAMERA, id=2),
        pycolmap.Rigid3d(T_second_first[:3]),
    )
    model.add_rig(one)
    frame = pycolmap.Frame(frame_id=1, rig_id=1)
    frame.rig_from_world = pycolmap.Rigid3d(first.T_camera_base[:3])
    images = [
        pycolmap.Image(name=f"{camera.name}.png", camera_id=number, image_id=number, frame_id=1)
        for number, camera in enumerate((first, second), start=1)
    ]
    for image in images:
        frame.add_data_id(image.data_id)
    model.add_frame(frame)
    for image in images:
        model.add_image(image)
    model.register_frame(1)
    model.write_binary(str(tmp_path))
    same((first, second), exchange.read(tmp_path))


def test_a_damaged_model_ends_in_a_sentence(tmp_path) -> None:
    exchange.write(tmp_path, rig(2), "colmap-binary")
    path = tmp_path / "images.bin"
    path.write_bytes(path.read_bytes()[:40])
    with pytest.raises(InputError, match="COLMAP cannot read its binary model"):
        exchange.read(tmp_path)


SLEEPS = """
import sys
from pathlib import Path
from freeswing.calib.exchange import colmap_binary
told = "import os, time; open(sys.argv[2], 'w').write(str(os.getpid()));"
colmap_binary._CONVERT = told + "time.sleep(600)"
colmap_binary._converted(Path(sys.argv[1]), Path(sys.argv[1], "pid"), "text")
"""


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere it lasts for its time limit")
def test_colmap_ends_with_a_killed_command(tmp_path) -> None:
    with subprocess.Popen([sys.executable, "-c", SLEEPS, str(tmp_path)]) as process:
        until = time.monotonic() + 60.0
        while not (tmp_path / "pid").is_file() or not (tmp_path / "pid").read_text():
            assert time.monotonic() < until
            time.sleep(0.02)
        process.send_signal(signal.SIGKILL)
    pid = (tmp_path / "pid").read_text()
    state = ["ps", "-o", "stat=", "-p", pid]
    while time.monotonic() < until:
        told = subprocess.run(state, capture_output=True, text=True).stdout.strip()
        if told[:1] in ("", "Z"):
            return
        time.sleep(0.05)
    pytest.fail("COLMAP's process lives on")


def test_a_model_that_grows_without_end_is_refused(tmp_path, monkeypatch) -> None:
    write = "open(sys.argv[2] + '/a', 'wb').write(bytes(2**24))"
    monkeypatch.setattr(colmap_binary, "_CONVERT", write)
    (tmp_path / "images.bin").write_bytes(bytes(100))
    with pytest.raises(InputError, match="COLMAP cannot read its binary model"):
        colmap_binary.read(tmp_path, str)
