"""Recordings that hold less than they seem to, and tags that are not where they are said to be."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from freeswing.calib.board.recordings import Recording
from freeswing.calib.footage.frame_times import frame_times
from freeswing.cdpr.files.problems import InputError
from freeswing.vision.fuse.fuse_cameras import fuse
from freeswing.vision.fuse.run_views import instants_of
from freeswing.vision.fuse.tag_layout import LayoutSums, layout_sums, never_seen
from freeswing.vision.look.video import write_stamps, write_video
from freeswing.vision.look.watched_target import Watch
from freeswing.vision.track_run import CameraCount, left_out_text
from tests.vision.loops import TARGET
from tests.vision.rig.made_views import Recorded, made_views

STAMPS_S = np.arange(30) / 20.0


def film(folder: Path) -> Recording:
    """Thirty frames of noise at 20 Hz with their stamps."""
    rng = np.random.default_rng(0)
    images = rng.integers(0, 256, (30, 48, 64), dtype=np.uint8)
    path = folder / "cam.mkv"
    write_video(path, images, STAMPS_S)
    write_stamps(folder / "cam.csv", STAMPS_S)
    return Recording("cam", path, ())


def test_a_film_whose_head_alone_was_copied_is_refused(tmp_path: Path) -> None:
    """It had been tracked by the other cameras without a word."""
    recording = film(tmp_path)
    recording.path.write_bytes(recording.path.read_bytes()[:1500])
    with pytest.raises(InputError, match="not one frame can be decoded"):
        frame_times(recording, 20.0)


def test_a_film_cut_short_is_a_warning(tmp_path: Path) -> None:
    recording = film(tmp_path)
    assert frame_times(recording, 20.0).remarks == ()
    write_stamps(tmp_path / "cam.csv", np.arange(33) / 20.0)
    (remark,) = frame_times(recording, 20.0).remarks
    assert remark.is_warning
    assert "33 stamps, the video 30 frames: cut short, or frames were lost" in remark.text


@pytest.mark.parametrize(("number", "wrong"), [(49, False), (51, True)])
def test_what_is_left_out_mostly_is_not_as_stated(number: int, wrong: bool) -> None:
    count = CameraCount("left", 110, 100, {}, 0)
    said = left_out_text(count, "tag36h11 0", (number, 3, 1.5))
    assert said.startswith(f"left: tag36h11 0 left out {number} times, first in frame 3")
    assert said.endswith("or it came loose") == wrong


def test_a_tag_that_no_run_shows_is_named() -> None:
    watch = Watch.of(TARGET)
    n = len(watch.tags)
    shown = np.ones((2, n), dtype=bool)
    shown[:, 1] = False
    told = [LayoutSums(np.zeros((6 * n, 6 * n)), np.zeros(6 * n), one) for one in shown]
    assert never_seen(told, watch) == [watch.name(1)]
    shown[1, 1] = True
    assert never_seen(told, watch) == []


def test_a_tag_far_off_its_place_is_not_called_hidden(tmp_path: Path) -> None:
    """What is left out, or seen alone, had been said to be seen in no run."""
    views, watch = made_views(tmp_path, (Recorded(), Recorded()), seconds=1.0)
    corners = watch.tag_corners_m.copy()
    corners[0] += 0.02
    watch = replace(watch, tag_corners_m=corners)
    poses, fit = fuse(views, watch, instants_of(views))
    sums = layout_sums(poses, fit, views, watch)
    assert not sums.normal[:6].any()
    assert never_seen([sums], watch) == []
