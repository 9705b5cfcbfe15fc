"""A laboratory placed by distances and marked points, the walk a video; and a lost camera."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.cameras_file import read_cameras
from freeswing.calib.rig.triangulation import triangulate
from freeswing.calib.verdict.halves_and_lengths import rigidly_fitted
from freeswing.cdpr.rotation import invert
from freeswing.main import main
from freeswing.vision.look.video import write_video
from freeswing.vision.render.render_scene import Renderer
from tests.calib.scene import rooms
from tests.places import ROOT

pytestmark = pytest.mark.slow
pytest.importorskip("pycolmap")
# On walls and floor, not on one line; the first four are ends of the distances.
POINTS = {
    "A": (-1.999, -0.7, 0.9), "B": (1.999, 0.8, 1.1), "C": (0.4, -1.999, 0.6),
    "D": (-0.5, 1.999, 1.2), "E": (0.8, -0.6, 0.001), "F": (-0.9, 0.5, 0.001),
    "G": (-1.2, -0.9, 0.001), "H": (1.1, 1.0, 0.001),
}  # fmt: skip
CLICK_PX, MOST_CLICKS = 0.3, 8
HEAD = 'clicks = "scene/clicks.csv"\n'


@pytest.fixture(scope="module")
def filmed(tmp_path_factory) -> Path:
    """A room without tags, its walk a video, and clicks in stills and frames."""
    folder = tmp_path_factory.mktemp("room")
    scene, walk = rooms.room(tags=False), rooms.walk(24)
    rooms.film(folder / "scene/rig", rooms.rig(), scene, walk=False)
    frames = (Renderer(camera, scene, rooms.LOOK).frame(0.0) for camera in walk)
    write_video(folder / "scene/walk.mkv", frames, np.arange(len(walk)) / 30.0)
    images = [(c.name, c) for c in rooms.rig()] + [(f"{k:06d}", c) for k, c in enumerate(walk)]
    (folder / "scene/clicks.csv").write_text(clicks(images))
    shutil.copy(ROOT / "samples/filmed/robot.toml", folder / "robot.toml")
    return folder


def clicks(images: list[tuple[str, Camera]]) -> str:
    rng, rows = np.random.default_rng(3), ["image,point,u_px,v_px,std_px"]
    for name, place in POINTS.items():
        shown = 0
        for image, camera in images:
            inside = camera.to_camera(np.array(place)[None])
            pixel = camera.project(inside)[0]
            edge = min(pixel.min(), (np.array(camera.size_px) - pixel).min())
            if camera.sees(inside)[0] and edge > 5.0 and shown < MOST_CLICKS:
                u, v = pixel + CLICK_PX * rng.normal(size=2)
                rows.append(f"{image},{name},{u:.2f},{v:.2f},{CLICK_PX}")
                shown += 1
    return "\n".join(rows) + "\n"


def calibrated(folder: Path, more: str, capsys) -> tuple[int, str]:
    path = rooms.session(folder, [], HEAD + more)
    path.write_text(path.read_text().replace("scene/walk", "scene/walk.mkv"))
    return main(["calibrate", str(folder), "--scene"]), capsys.readouterr().err


def errors_m(folder: Path, true: tuple[Camera, ...]) -> tuple[float, float, float]:
    """Rms error of points of the volume as they are, after a rigid fit, and as it is claimed."""
    side = np.linspace(-0.5, 0.5, 5)
    points = np.stack(np.meshgrid(side, side, side + 1.0), axis=-1).reshape(-1, 3)
    T = invert(true[0].T_camera_base) @ rooms.rig()[0].T_camera_base
    points = points @ T[:3, :3].T + T[:3, 3]
    pixels = []
    for camera in true:
        inside = camera.to_camera(points)
        pixels.append(np.where(camera.sees(inside)[:, None], camera.project(inside), np.nan))
    found = triangulate(read_cameras(folder / "cameras.toml"), np.stack(pixels))
    assert np.isfinite(found).all()
    document = json.loads((folder / "results/calibration.json").read_text())
    shape = found - rigidly_fitted(points, found)
    return rms(found - points), rms(shape), document["checks"]["volume_std_m"]


def rms(off: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum(off**2, axis=1))))


def test_surveyed_points_that_a_person_marked(filmed, capsys) -> None:
    rng, rows = np.random.default_rng(4), []
    for name, place in POINTS.items():
        told = (np.array(place) + 5e-4 * rng.normal(size=3)).round(6).tolist()
        rows.append(f'[[calibration.scene.surveyed]]\nname = "{name}"\nposition_base_m = {told}')
        rows.append("std_m = 0.0005")
    status, said = calibrated(filmed, "\n".join(rows), capsys)
    assert status == 0, said
    whole, shape, claimed = errors_m(filmed, rooms.rig())
    assert shape < 1e-3, f"{1e3 * shape:.2f} mm"
    assert whole < min(2.5 * claimed, 1.5e-3), f"{1e3 * whole:.2f} mm, claimed {1e3 * claimed:.2f}"


def two_distances(folder: Path) -> str:
    """Of four of the points, 0.3 mm long each; clicks of the others are taken out."""
    rows = []
    for a, b in (("A", "B"), ("C", "D")):
        length = np.linalg.norm(np.subtract(POINTS[a], POINTS[b]))
        rows.append(f'[[calibration.scene.distances]]\nbetween = ["{a}", "{b}"]')
        rows.append(f"distance_m = {length + 3e-4:.6f}\nstd_m = 0.0005")
    table = folder / "scene/clicks.csv"
    kept = [row for row in table.read_text().splitlines() if row.split(",")[1] not in "EFGH"]
    table.write_text("\n".join(kept) + "\n")
    return "\n".join(rows)


def test_two_distances_give_the_scale(filmed, capsys) -> None:
    status, said = calibrated(filmed, two_distances(filmed), capsys)
    assert status == 0, said
    assert "camera cam0 is the base frame" in said
    first = rooms.rig()[0].T_camera_base
    true = [replace(c, T_camera_base=c.T_camera_base @ invert(first)) for c in rooms.rig()]
    whole, shape, claimed = errors_m(filmed, tuple(true))
    assert shape < 1e-3, f"{1e3 * shape:.2f} mm"
    assert whole < 2.5 * claimed, f"{1e3 * whole:.2f} mm, claimed {1e3 * claimed:.2f}"


def test_a_camera_before_a_bare_wall_is_named_with_what_would_tie_it(filmed, capsys) -> None:
    bare = np.random.default_rng(1).integers(118, 124, (720, 960)).astype(np.uint8)
    cv2.imwrite(str(filmed / "scene/rig/cam3/0.png"), bare)
    status, said = calibrated(filmed, two_distances(filmed), capsys)
    assert status == 1, said
    assert "camera cam3 could not be tied in" in said
    assert "walk with the hand-held camera from what that camera sees" in said
    assert "posters on bare walls" in said
    assert not [name for name in ("cam0", "cam1", "cam2") if f"camera {name} could" in said]
