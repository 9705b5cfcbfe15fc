"""Files: lossless video, stamps with gaps and repeats, image folders, cameras of other rates."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from freeswing.calib.board.recordings import find_recordings, read_frames
from freeswing.calib.footage.frame_times import frame_times
from freeswing.cdpr.files.documents import DataError, InputError
from freeswing.cdpr.files.trajectory_files import read_trajectory
from freeswing.cdpr.measured.target import Target
from freeswing.vision.look.video import write_stamps, write_video
from freeswing.vision.render.record import record
from freeswing.vision.render.render_scene import Renderer
from tests.vision.films import tracked
from tests.vision.scenes import OPENCV_PARAMS, arc_of_cameras, platform_tags, scene_of, swing

TARGET = Target(platform_tags())
SCENE = scene_of(TARGET.tags)
CAMERAS = arc_of_cameras(
    2, 1.9, size_px=(360, 288), params=[v / 2 for v in OPENCV_PARAMS[:4]] + OPENCV_PARAMS[4:]
)


@dataclass
class FilmedRun:
    name: str
    video: Path


def track(folder, frame_rate_hz=None, workers=1):
    document = tracked(
        [FilmedRun("run", folder / "run")],
        CAMERAS,
        TARGET,
        results=folder / "results",
        frame_rate_hz=frame_rate_hz,
        workers=workers,
    )
    return document, read_trajectory(folder / "results" / "tracks" / "run.csv")


def worst_mm(trajectory) -> float:
    known = trajectory.is_known
    truth = swing(trajectory.times_s)[0]
    return 1e3 * float(np.abs((trajectory.positions() - truth)[known]).max())


@pytest.mark.parametrize(("codec", "suffix"), [("ffv1", ".mkv"), ("magicyuv", ".avi")])
def test_videos_come_back_bit_by_bit(tmp_path, codec, suffix) -> None:
    frames = list(Renderer(CAMERAS[0], SCENE).frames(np.arange(4) / 50.0))
    write_video(tmp_path / f"cam0{suffix}", iter(frames), np.arange(4) / 50.0, codec=codec)
    back = [image for _, _, image in read_frames(find_recordings(tmp_path)[0])]
    assert len(back) == 4
    assert all((a == b).all() for a, b in zip(frames, back, strict=True))


def test_dropped_repeated_and_slower_frames(tmp_path) -> None:
    """One camera at half the rate; the other drops three frames and stores one twice."""
    stamps = np.delete(np.arange(40) / 50.0, [11, 12, 25])
    place = tmp_path / "run"
    record(place, CAMERAS[1:], SCENE, np.arange(0.004, 0.8, 0.04))
    frames = list(Renderer(CAMERAS[0], SCENE).frames(stamps))
    frames.insert(20, frames[19])
    doubled = np.insert(stamps, 20, stamps[19] + 1e-4)
    write_video(place / "cam0.mkv", iter(frames), doubled)
    write_stamps(place / "cam0.csv", doubled)
    document, trajectory = track(tmp_path)
    counts = {c["camera"]: c for c in document["runs"][0]["cameras"]}
    assert counts["cam0"]["frames_rejected"] == {"repeated frame": 1}, counts["cam0"]
    assert counts["cam0"]["frames_dropped"] == 3, counts["cam0"]
    assert counts["cam1"]["frames_used"] == counts["cam1"]["frames_seen"], counts["cam1"]
    steps = np.diff(trajectory.times_s)
    assert np.allclose(steps, 0.02, atol=1e-6), f"steps {steps.min()} to {steps.max()}"
    assert worst_mm(trajectory) < 1.0, f"{worst_mm(trajectory):.3f} mm"


def test_image_folders_and_a_nominal_rate(tmp_path) -> None:
    record(tmp_path / "run", CAMERAS, SCENE, np.arange(12) / 50.0, images=True, stamps_file=False)
    _, trajectory = track(tmp_path, frame_rate_hz=50.0)
    assert len(trajectory) == 12, f"{len(trajectory)} samples"
    assert worst_mm(trajectory) < 0.5, f"{worst_mm(trajectory):.3f} mm"
    with pytest.raises(InputError, match="no frame_rate_hz"):
        track(tmp_path)


def test_no_platform_in_view_is_told_with_a_remedy(tmp_path) -> None:
    empty = replace(SCENE, patches=())
    record(tmp_path / "run", CAMERAS, empty, np.arange(6) / 50.0)
    with pytest.raises(DataError, match=r"run run: no pose .* Check target.toml"):
        track(tmp_path)


def test_stamps_that_go_back_are_left_out(tmp_path) -> None:
    record(tmp_path, CAMERAS[:1], SCENE, np.arange(5) / 50.0)
    (tmp_path / "cam0.csv").write_text("frame,t_s\n0,0.0\n1,0.02\n2,0.02\n3,0.06\n4,0.05\n")
    found = frame_times(find_recordings(tmp_path)[0], None)
    assert found.stamps == {0: 0.0, 1: 0.02, 3: 0.06}, found
    assert any("2 of 5 rows" in remark.text for remark in found.remarks), found.remarks
    (tmp_path / "cam0.csv").write_text("frame,t_s\n0,zero\n")
    with pytest.raises(InputError, match="line 2"):
        frame_times(find_recordings(tmp_path)[0], None)


@pytest.mark.slow
def test_two_processes_write_the_same_bytes(tmp_path) -> None:
    record(tmp_path / "run", CAMERAS, SCENE, np.arange(12) / 50.0)
    track(tmp_path)
    names = ("tracking.json", "tracks/run.csv")
    alone = [(tmp_path / "results" / n).read_bytes() for n in names]
    for piece in (tmp_path / "results").rglob("*.npz"):
        piece.unlink()
    track(tmp_path, workers=2)
    assert alone == [(tmp_path / "results" / n).read_bytes() for n in names]
