"""When frames were taken: containers, csv files, gaps, copies, half pictures, starts by hand."""

from __future__ import annotations

import json
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from freeswing.calib.camera.cameras_file import read_cameras
from freeswing.calib.footage.container_times import evened
from freeswing.cdpr.rotation import exp_rotation, transform
from freeswing.main import main
from tests.vision.footage.sessions import (
    RATE_HZ,
    START_S,
    errors_m,
    frames_of,
    track,
    without_clocks,
    write_frames,
    write_session,
)

EVEN = np.arange(108) / RATE_HZ


def findings(folder, capsys) -> list[str]:
    main(["check", str(folder)])
    return capsys.readouterr().out.splitlines()


def tracking(folder) -> dict:
    return json.loads((folder / "results" / "tracking.json").read_text())


def one_camera(folder, frames, stamps, **more):
    """A session of the left camera alone, its stamps in the container."""
    write_session(folder, lambda cameras: cameras[:1], **more)
    write_frames(folder / "runs" / "swing-01" / "left.mp4", frames, stamps)
    for path in (folder / "runs" / "swing-01").glob("right.*"):
        path.unlink()
    return folder


def test_a_missing_frame_keeps_its_gap_and_a_wrong_rate_is_named(tmp_path, capsys) -> None:
    keep = np.delete(np.arange(108), 59)
    frames = frames_of("left")
    folder = one_camera(
        tmp_path,
        [frames[k] for k in keep],
        EVEN[keep],
        text=lambda text: text.replace("frame_rate_hz = 20.0", "frame_rate_hz = 20.02"),
    )
    said = findings(folder, capsys)
    assert any("1 of 108 frames are missing" in line for line in said), said
    assert any("20 frames a second, the session says 20.02" in line for line in said), said
    assert track(folder) == 0
    rms = np.sqrt(np.mean(errors_m(folder, START_S) ** 2, axis=0)).max()
    assert rms < 7e-4, f"{1e3 * rms:.3f} mm"  # one camera, 1 m a second: a frame is 50 mm
    assert any("20.02" in text for text in tracking(folder)["runs"][0]["problems"])


def test_rates_that_cannot_both_be_true_are_refused(tmp_path, capsys) -> None:
    folder = one_camera(
        tmp_path,
        frames_of("left")[:20],
        EVEN[:20],
        text=lambda text: text.replace("frame_rate_hz = 20.0", "frame_rate_hz = 25.0"),
    )
    assert track(folder) == 1
    said = capsys.readouterr().err
    assert "20 frames a second, the session says 25" in said, said


@pytest.mark.parametrize(
    ("tick", "jitter_s", "even"), [(1e-3, 0.0, True), (1e-3, 3e-3, False), (1 / 90000, 5e-4, False)]
)
def test_rounded_times_become_even_and_uneven_ones_stay(tick, jitter_s, even) -> None:
    true = np.delete(np.arange(300), [40, 41, 99]) * 1001 / 30000
    true = true + np.random.default_rng(1).uniform(-jitter_s, jitter_s, len(true))
    found, beat_s, is_even, missing = evened(np.round(true / tick) * tick, tick)
    assert is_even is even
    assert missing == 3
    assert abs(beat_s * 30000 / 1001 - 1.0) < 1e-4
    off = np.abs(found - true - np.mean(found - true)).max()
    # a beat fitted to 300 times rounded by 0.29 ticks is off by 0.03 ticks at the ends
    assert off < (0.15 if even else 1.0) * tick, f"{off}"


@pytest.mark.slow
def test_copies_are_found_and_left_out(tmp_path, capsys) -> None:
    frames = frames_of("left")
    for k in range(8, 108, 8):
        frames[k] = frames[k - 1]
    folder = one_camera(tmp_path, frames, EVEN)
    said = findings(folder, capsys)
    assert any("12 of the first 100 frames repeat" in line for line in said), said
    assert track(folder) == 0
    rejected = tracking(folder)["runs"][0]["cameras"][0]["frames_rejected"]
    assert rejected == {"repeated frame": 13}, rejected
    worst = np.abs(errors_m(folder, START_S)).max()
    assert worst < 3e-3, f"{1e3 * worst:.2f} mm"  # a copy is 50 ms old: up to 50 mm


def test_half_pictures_are_refused_by_name(tmp_path, capsys) -> None:
    frames = frames_of("left")
    woven = []
    for first, second in zip(frames[::2], frames[1::2], strict=True):
        picture = first.copy()
        picture[1::2] = second[1::2]
        woven.append(picture)
    folder = one_camera(tmp_path, woven, EVEN[: len(woven)])
    assert any("interlaced" in line for line in findings(folder, capsys))
    assert track(folder) == 1
    said = capsys.readouterr().err
    assert "left.mp4: interlaced" in said, said


@pytest.mark.slow
@pytest.mark.parametrize("late", [6, 14])
def test_a_start_by_hand_is_found(tmp_path, late, capsys) -> None:
    """The right camera was started 0.3 or 0.7 s later; its clock is off by 3.1 ms besides."""
    folder = write_session(tmp_path, without_clocks)
    place = folder / "runs" / "swing-01"
    write_frames(place / "left.mp4", frames_of("left"), EVEN)
    right = frames_of("right")[late:]
    write_frames(place / "right.mkv", right, EVEN[: len(right)], Fraction(1, 1000))
    assert track(folder) == 0
    (effect,) = tracking(folder)["effects"]
    assert (effect["effect"], effect["camera"]) == ("clock_offset", "right"), effect
    offset = effect["parameters"][0]
    wrong = offset["value"] - late / RATE_HZ - 0.0031
    assert abs(wrong) < max(5.0 * offset["std"], 2e-4), f"{1e3 * wrong:.3f} ms, {offset}"
    rms = np.sqrt(np.mean(errors_m(folder, START_S) ** 2, axis=0)).max()
    assert rms < 2e-4, f"{1e3 * rms:.3f} mm"
    problems = tracking(folder)["runs"][0]["problems"]
    assert any("next best start" in text for text in problems), problems


@pytest.mark.slow
def test_a_start_by_hand_is_found_beside_repeated_frames(tmp_path) -> None:
    """Every eighth frame of both is a copy: less than half of the frames have no gap near them."""
    folder = write_session(tmp_path, without_clocks)
    for camera, late in (("left", 0), ("right", 14)):
        frames = frames_of(camera)[late:]
        for k in range(8, len(frames), 8):
            frames[k] = frames[k - 1]
        place = folder / "runs" / "swing-01" / f"{camera}.mp4"
        write_frames(place, frames, EVEN[: len(frames)])
    assert track(folder) == 0
    (effect,) = tracking(folder)["effects"]
    assert (effect["effect"], effect["camera"]) == ("clock_offset", "right"), effect
    assert abs(effect["parameters"][0]["value"] - 14 / RATE_HZ - 0.0031) < 1e-3, effect
    rms = np.sqrt(np.mean(errors_m(folder, START_S) ** 2, axis=0)).max()
    assert rms < 3e-4, f"{1e3 * rms:.3f} mm"


@pytest.mark.slow
def test_a_start_by_hand_of_a_knocked_camera_is_found(tmp_path) -> None:
    """0.7 s are a period of this swing, 4 mrad as much as it moves: neither looks like much."""

    def knocked(cameras):
        left, right = without_clocks(cameras)
        turn = transform(exp_rotation(np.array([0.0, 0.004, 0.0])), np.zeros(3))
        return [left, replace(right, T_camera_base=turn @ right.T_camera_base)]

    folder = write_session(tmp_path, knocked)
    rng = np.random.default_rng(7)
    for camera, late in (("left", 0), ("right", 14)):
        frames = frames_of(camera)[late:]
        keep = np.flatnonzero(rng.random(len(frames)) > 0.05)
        keep = np.union1d(keep, [0, 1])
        place = folder / "runs" / "swing-01" / f"{camera}.mp4"
        write_frames(place, [frames[k] for k in keep], EVEN[keep])
    assert track(folder) == 0
    effects = {effect["effect"]: effect for effect in tracking(folder)["effects"]}
    assert set(effects) == {"clock_offset", "camera_moved"}, effects
    offset = effects["clock_offset"]["parameters"][0]["value"]
    assert abs(offset - 14 / RATE_HZ - 0.0031) < 1e-3, effects
    rms = np.sqrt(np.mean(errors_m(folder, START_S) ** 2, axis=0)).max()
    assert rms < 3e-4, f"{1e3 * rms:.3f} mm"


@pytest.mark.slow
def test_a_clock_goes_back_into_the_cameras_on_request(tmp_path) -> None:
    folder = write_session(
        tmp_path,
        lambda cameras: [cameras[0], replace(cameras[1], clock_offset_s=-0.01)],
    )
    assert track(folder, "--write-clocks") == 0
    clock = {c.name: c.clock_offset_s for c in read_cameras(folder / "cameras.toml")}
    assert abs(clock["right"] - 0.0031) < 2e-4, clock
    assert track(folder) == 0
    assert tracking(folder)["effects"] == []
