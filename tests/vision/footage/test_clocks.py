"""Stamps and starts as recorders make them, through `freeswing track` and `check`."""

from __future__ import annotations

import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.main import main
from freeswing.vision.render.record import record
from freeswing.vision.render.render_scene import Scene, motion_of
from tests.oracle.recorded.sessions import make_scene
from tests.oracle.scenes.robots import declared_robot, true_body
from tests.oracle.scenes.runs import draw_run
from tests.samples import make_filmed as filmed
from tests.vision.footage.sessions import (
    RATE_HZ,
    START_S,
    errors_m,
    track,
    without_base_tags,
    without_clocks,
    write_session,
)
from tests.vision.footage.test_times import findings, tracking


def rewritten(folder: Path, camera: str, change, separator: str = ",") -> None:
    """A camera's stamps, changed."""
    path = folder / "runs" / "swing-01" / f"{camera}.csv"
    rows = [line.split(",") for line in path.read_text().splitlines()[1:]]
    rows = [[frame, repr(float(change(float(stamp))))] for frame, stamp in rows]
    text = "\n".join(separator.join(row) for row in [["frame", "t_s"], *rows])
    path.write_text(text.replace(".", ",") if separator == ";" else text)


def seconds_since_1970(stamp: float) -> float:
    return 1.7e9 + stamp


@pytest.mark.parametrize(
    ("factor", "unit"), [(1e3, "milliseconds"), (1e6, "microseconds"), (1e9, "nanoseconds")]
)
def test_stamps_in_another_unit_are_named(tmp_path, capsys, factor, unit) -> None:
    folder = write_session(tmp_path)
    rewritten(folder, "left", lambda t: factor * t)
    assert track(folder) == 2
    said = capsys.readouterr().err
    assert unit in said, said
    assert "left.csv" in said, said


@pytest.mark.slow
def test_stamps_since_1970_serve_as_they_are(tmp_path) -> None:
    folder = write_session(tmp_path)
    for camera in ("left", "right"):
        rewritten(folder, camera, seconds_since_1970)
    assert track(folder) == 0
    worst = np.abs(errors_m(folder, -1.7e9)).max()
    assert worst < 5e-4, f"{1e3 * worst:.3f} mm"


@pytest.mark.slow
def test_stamps_with_semicolons_and_decimal_commas_give_the_same_track(tmp_path) -> None:
    plain, other = write_session(tmp_path / "a"), write_session(tmp_path / "b")
    for camera in ("left", "right"):
        rewritten(plain, camera, float)
        rewritten(other, camera, float, ";")
    tracks = []
    for folder in (plain, other):
        assert track(folder) == 0
        tracks.append((folder / "results" / "tracks" / "swing-01.csv").read_bytes())
    assert tracks[0] == tracks[1]


def test_stamps_one_percent_off_the_videos_own_times_are_named(tmp_path, capsys) -> None:
    folder = write_session(tmp_path)
    rewritten(folder, "left", lambda t: 1.01 * t)
    (said,) = [line for line in findings(folder, capsys) if "times as fast" in line]
    assert "left.csv runs 1.01 times as fast as the video's own presentation times" in said, said
    assert said.startswith("warning"), said


def long_session(folder: Path, late_s: float, seconds: float) -> Trajectory:
    """One swing of so many seconds, the right camera started later; gives the truth.

    Stamps count from each camera's first frame, as in two recorders that know nothing of another.
    """
    write_session(folder, without_clocks)
    place = folder / "runs" / "swing-01"
    shutil.rmtree(place)
    rng = np.random.default_rng(11)
    scene = make_scene(declared_robot("bologna-4"), true_body("bologna-4", rng), {}, rng)
    motion = filmed._trajectory(draw_run(scene, rng, seconds + 0.4, filmed.SPLINE_HZ))
    world = Scene((*filmed._still(), *filmed._platform()), motion_of(motion))
    for camera in filmed.cameras():
        start = START_S + (late_s if camera.name == "right" else 0.0)
        stamps = np.arange(round((seconds - start) * RATE_HZ)) / RATE_HZ
        own = replace(camera, clock_offset_s=start)
        record(place, (own,), world, stamps, filmed.LOOK, filmed.SEED)
    return motion


@pytest.mark.slow
@pytest.mark.parametrize("late_s", [0.1034, 1.717, 9.4561])
def test_a_start_by_hand_is_found_from_a_tenth_of_a_second_to_ten(tmp_path, late_s) -> None:
    long_session(tmp_path, late_s, 22.0 if late_s > 5.0 else 8.0)
    assert track(tmp_path) == 0
    (effect,) = tracking(tmp_path)["effects"]
    assert (effect["effect"], effect["camera"]) == ("clock_offset", "right"), effect
    offset = effect["parameters"][0]
    wrong = offset["value"] - late_s
    assert abs(wrong) < max(5.0 * offset["std"], 2e-4), f"{1e3 * wrong:.3f} ms, {offset}"


@pytest.mark.slow
@pytest.mark.parametrize("text", [str, without_base_tags])
def test_cameras_that_filmed_different_swings_are_refused(tmp_path, capsys, text) -> None:
    folder = write_session(tmp_path, text=text, runs=2)
    for name in ("right.mkv", "right.csv"):
        shutil.copy(folder / "runs" / "swing-02" / name, folder / "runs" / "swing-01" / name)
    assert track(folder) == 1
    said = capsys.readouterr().err
    assert re.search("camera (left|right) sees the platform|different swings", said), said
    assert main(["identify", str(folder), "--quiet"]) != 0
