"""Mistakes in files that no mounted camera can make: each is named, none is explained away."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from freeswing.calib.camera.camera import Camera
from freeswing.cdpr.files.trajectory_files import read_trajectory
from freeswing.cdpr.measured.pose_errors import read_pose_errors
from freeswing.cdpr.measured.target import read_target, write_target
from freeswing.cdpr.rotation import exp_rotation, invert, transform
from tests.vision.footage.sessions import (
    RATE_HZ,
    errors_m,
    frames_of,
    track,
    without_base_tags,
    write_frames,
    write_session,
)

UPSIDE_DOWN = np.diag([-1.0, -1.0, 1.0, 1.0])


def posed(camera: Camera, T_camera_base: np.ndarray) -> Camera:
    return replace(camera, T_camera_base=T_camera_base)


def in_millimetres(camera: Camera) -> Camera:
    pose = camera.T_camera_base
    return posed(camera, transform(pose[:3, :3], 1e3 * pose[:3, 3]))


RIGS = {
    "exchanged": (
        lambda c: [posed(c[0], c[1].T_camera_base), posed(c[1], c[0].T_camera_base)],
        "left and right are exchanged",
    ),
    "upside down": (
        lambda c: [c[0], posed(c[1], UPSIDE_DOWN @ c[1].T_camera_base)],
        "turned by 180 degrees for right",
    ),
    "millimetres": (lambda c: [in_millimetres(camera) for camera in c], "in millimetres"),
    "inverted": (
        lambda c: [posed(camera, invert(camera.T_camera_base)) for camera in c],
        "the pose is inverted",
    ),
}
SLOW = pytest.mark.slow


@pytest.mark.parametrize("with_base_tags", [True, pytest.param(False, marks=SLOW)])
@pytest.mark.parametrize(
    "mistake", ["exchanged", *(pytest.param(m, marks=SLOW) for m in list(RIGS)[1:])]
)
def test_cameras_that_cannot_stand_so(tmp_path, capsys, mistake, with_base_tags) -> None:
    change, words = RIGS[mistake]
    text = str if with_base_tags else without_base_tags
    folder = write_session(tmp_path, change, text=text)
    assert track(folder) == 1
    said = capsys.readouterr().err
    assert words in said, said
    assert not (folder / "results" / "tracks" / "swing-01.csv").exists()


@pytest.mark.slow
@pytest.mark.parametrize("turn_rad", [0.02, 0.1])
def test_a_knock_without_base_tags_is_refused(tmp_path, capsys, turn_rad) -> None:
    def knocked(cameras):
        turn = transform(exp_rotation(np.array([0.0, turn_rad, 0.0])), np.zeros(3))
        return [cameras[0], posed(cameras[1], turn @ cameras[1].T_camera_base)]

    folder = write_session(tmp_path, knocked, text=without_base_tags)
    assert track(folder) == 1
    assert "moved" in capsys.readouterr().err


@pytest.mark.slow
def test_a_small_knock_without_base_tags_widens(tmp_path) -> None:
    """Two milliradians: which camera is right is not told, how far poses may be off is."""

    def knocked(cameras):
        turn = transform(exp_rotation(np.array([0.0, 0.002, 0.0])), np.zeros(3))
        return [cameras[0], posed(cameras[1], turn @ cameras[1].T_camera_base)]

    folder = write_session(tmp_path, knocked, text=without_base_tags)
    assert track(folder) == 0
    run = json.loads((folder / "results" / "tracking.json").read_text())["runs"][0]
    assert any("right is not where its calibration has it" in p for p in run["problems"]), run
    modes = read_pose_errors(run["calibration_errors"]).modes[:, :3, 0]
    claimed = np.sqrt(np.sum(modes**2, axis=0))
    off = np.abs(np.median(errors_m(folder, 0.0), axis=0))
    assert np.all(off < 3.0 * claimed + 2e-4), (off, claimed)
    assert np.linalg.norm(claimed) < 2.0 * np.linalg.norm(off) + 2e-4, (off, claimed)


def exchanged_ids(text: str) -> str:
    swapped = {"0": "1", "1": "0"}
    return re.sub(r"^id = ([01])$", lambda m: f"id = {swapped[m[1]]}", text, flags=re.M)


@pytest.mark.slow
def test_exchanged_ids_are_put_right_from_the_first_frame(tmp_path) -> None:
    folder = write_session(tmp_path, target=exchanged_ids)
    assert track(folder) == 0
    run = json.loads((folder / "results" / "tracking.json").read_text())["runs"][0]
    assert any("exchanged they fit" in text for text in run["problems"]), run["problems"]
    worst = np.abs(errors_m(folder, 0.0)).max()
    assert worst < 5e-4, f"{1e3 * worst:.3f} mm"


def test_a_wrong_tag_size_is_named_with_the_right_one(tmp_path, capsys) -> None:
    def larger(text: str) -> str:
        return re.sub(r"size_m = ([\d.]+)", lambda m: f"size_m = {1.13 * float(m[1])}", text)

    assert track(write_session(tmp_path, target=larger)) == 1
    found = re.search(r"with size_m ([\d.]+) times as large they fit", capsys.readouterr().err)
    assert found is not None
    assert abs(float(found[1]) - 1.0 / 1.13) < 0.012, found[0]


@pytest.mark.slow
def test_millimetres_are_named_beside_a_late_start_and_dropped_frames(tmp_path, capsys) -> None:
    """Kilometres away nothing weighs, and the search for the start divided by it."""
    folder = write_session(
        tmp_path, lambda c: [replace(in_millimetres(one), clock_offset_s=0.0) for one in c]
    )
    for seed, camera in enumerate(("left", "right")):
        keep = np.random.default_rng(seed).random(108) > 0.05
        keep[: 14 * seed] = False
        stamps = np.flatnonzero(keep) / RATE_HZ
        frames = [image for image, is_kept in zip(frames_of(camera), keep, strict=True) if is_kept]
        write_frames(folder / "runs" / "swing-01" / f"{camera}.mp4", frames, stamps - stamps[0])
    assert track(folder) == 1
    assert "t_camera_base_m is in millimetres" in capsys.readouterr().err


@pytest.mark.slow
def test_exchanged_ids_and_a_wrong_size_are_both_named(tmp_path, capsys) -> None:
    def mistaken(text: str) -> str:
        larger = re.sub(r"size_m = ([\d.]+)", lambda m: f"size_m = {1.13 * float(m[1])}", text)
        return exchanged_ids(larger)

    assert track(write_session(tmp_path, target=mistaken)) == 1
    said = capsys.readouterr().err
    assert re.search(r"tag36h11 [01] and tag36h11 [01] exchanged they fit", said), said
    assert re.search(r"with size_m 0\.8[89] times as large they fit", said), said


@pytest.mark.slow
def test_tags_in_another_convention_are_named(tmp_path, capsys) -> None:
    folder = write_session(tmp_path)
    target = read_target(folder / "target.toml")
    down = np.diag([1.0, -1.0, -1.0, 1.0])  # y down, z into the face
    tags = tuple(replace(tag, T_platform_tag=tag.T_platform_tag @ down) for tag in target.tags)
    write_target(folder / "target.toml", replace(target, tags=tags))
    assert track(folder) == 1
    assert "target.toml's x, -y, -z" in capsys.readouterr().err


@pytest.mark.parametrize("cameras", [("right",), ("left", "right")])
def test_mirrored_pictures_are_named(tmp_path, capsys, cameras) -> None:
    """A webcam that shows itself as a mirror does: its tags are none."""
    folder = write_session(tmp_path)
    for camera in cameras:
        frames = [np.ascontiguousarray(image[:, ::-1]) for image in frames_of(camera)[:40]]
        place = folder / "runs" / "swing-01"
        stamps = (place / f"{camera}.csv").read_text()
        write_frames(place / f"{camera}.mkv", frames, np.arange(40) / RATE_HZ)
        (place / f"{camera}.csv").write_text(stamps)
    assert track(folder) == 1
    said = capsys.readouterr().err
    assert "mirror" in said, said
    assert cameras[0] in said, said


def test_a_camera_that_saw_nothing_is_said_and_the_other_serves(tmp_path) -> None:
    """A cap on the lens: poses of the left camera alone, at its own deviations."""
    folder = write_session(tmp_path)
    place = folder / "runs" / "swing-01"
    for camera in ("left", "right"):
        frames = frames_of(camera)[:40]
        stamps = (place / f"{camera}.csv").read_text().splitlines()[:41]
        if camera == "right":
            noise = np.random.default_rng(1)
            frames = [noise.integers(10, 30, image.shape, np.uint8) for image in frames]
        write_frames(place / f"{camera}.mkv", frames, np.arange(40) / RATE_HZ)
        (place / f"{camera}.csv").write_text("\n".join(stamps))
    assert track(folder) == 0
    run = json.loads((folder / "results" / "tracking.json").read_text())["runs"][0]
    assert any("right: 40 of 40 frames: nothing found" in text for text in run["problems"]), run
    found = read_trajectory(folder / "results" / "tracks" / "swing-01.csv")
    deviations = found.standard_deviations()
    assert deviations is not None
    z = errors_m(folder, 0.0) / deviations[found.is_known, :3]
    assert np.sqrt(np.mean(z**2)) < 2.0, np.sqrt(np.mean(z**2, axis=0))
