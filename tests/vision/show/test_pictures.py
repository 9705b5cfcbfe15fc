"""Overlay videos and recordings for the viewer, made of a tracked run."""

from __future__ import annotations

import sys

import av
import numpy as np
import pytest

from freeswing.cdpr.files.documents import InputError
from freeswing.main import main
from freeswing.results.tracking import Tracking
from freeswing.session.load_tracking import found_in
from freeswing.vision.show.overlay import projected_outlines, sighted, write_overlay
from freeswing.vision.show.rerun_view import require_viewer, write_view
from freeswing.vision.tracked_runs import tracked_run
from tests.vision.films import BASE, FRAMES, TARGET, cameras
from tests.vision.loops import small_cameras, write_looped_session


@pytest.fixture(scope="module")
def run(session):
    folder, filmed, document = session
    found = found_in(Tracking.from_json(document))
    return tracked_run(filmed, cameras(), TARGET, found, results=folder / "results", base_tags=BASE)


@pytest.mark.parametrize("index", [0, 1, 2])
def test_what_is_drawn_lies_on_what_was_seen(run, index) -> None:
    """Also of the knocked and the late camera: drawn is the rig that tracking found."""
    seen, distances = run.cameras[index], []
    for piece, row in list(seen.frames())[5:-5:5]:
        stamp = float(piece.stamps_s[row])
        outlines = projected_outlines(run.watch, run.trajectory, seen, stamp)
        centres = np.array([outline.mean(axis=0) for outline in outlines])
        for thing, corners in sighted(piece, row, seen):
            if thing < run.watch.first_base:
                nearest = np.argmin(np.linalg.norm(centres - corners.mean(axis=0), axis=1))
                distances.append(np.abs(outlines[nearest] - corners).max())
    assert len(distances) > 20, f"{len(distances)} tags"
    median, worst = np.median(distances), np.max(distances)
    assert median < 0.05, f"median {median:.3f} px"
    assert worst < 0.5, f"worst {worst:.3f} px"


def test_an_overlay_video_shows_every_frame_enlarged(run, tmp_path) -> None:
    path = tmp_path / "overlay" / "cam0.mp4"
    write_overlay(path, run, run.cameras[0])
    with av.open(str(path)) as container:
        pictures = [frame.to_ndarray(format="bgr24") for frame in container.decode(video=0)]
    assert len(pictures) == FRAMES, f"{len(pictures)} frames"
    assert pictures[0].shape == (864, 1080, 3), pictures[0].shape
    blue, green, red = pictures[20][60:].reshape(-1, 3).astype(int).T
    drawn = int(np.sum((green - red > 25) & (green - blue > 25)))
    assert drawn > 300, f"{drawn} green pixels"
    assert list(tmp_path.rglob(".*")) == [], "a draft is left"


def test_without_the_extra_it_says_what_to_install(monkeypatch, tmp_path, capsys) -> None:
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(InputError, match=r"freeswing\[view\]"):
        require_viewer()
    folder = write_looped_session(tmp_path, small_cameras(1), 4)
    assert main(["track", str(folder), "--view"]) == 2
    assert "pip install 'freeswing[view]'" in capsys.readouterr().err
    assert not (folder / "results" / "tracking.json").exists(), "refused after the work"


def test_overlays_by_the_command_line(tmp_path) -> None:
    folder = write_looped_session(tmp_path, small_cameras(1), 12)
    assert main(["track", str(folder), "--overlay", "--quiet"]) == 0
    assert (folder / "results" / "overlay" / "long" / "cam0.mp4").stat().st_size > 1000


def test_the_viewer_gets_a_recording(run, tmp_path) -> None:
    pytest.importorskip("rerun", reason="the extra view is not installed")
    path = tmp_path / "tracking.rrd"
    write_view(path, [run])
    assert path.read_bytes()[:3] == b"RRF", path.read_bytes()[:8]
    assert path.stat().st_size > 10_000, f"{path.stat().st_size} bytes"
