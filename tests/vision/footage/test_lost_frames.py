"""Films that lost frames while their times were counted on: found in each, and put right."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from freeswing.cdpr.files.trajectory_files import read_trajectory
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


def filmed(folder: Path, gone: dict[str, list[int]]) -> Path:
    """A session whose films lost these frames; cameras without a list are left out."""
    write_session(folder, lambda cameras: [c for c in without_clocks(cameras) if c.name in gone])
    place = folder / "runs" / "swing-01"
    for camera in ("left", "right"):
        if camera not in gone:
            for path in place.glob(f"{camera}.*"):
                path.unlink()
            continue
        frames = frames_of(camera)
        kept = [frames[k] for k in range(len(frames)) if k not in gone[camera]]
        write_frames(place / f"{camera}.mp4", kept, np.arange(len(kept)) / RATE_HZ)
    return folder


@pytest.mark.slow
@pytest.mark.parametrize(
    "gone",
    [
        {"right": [50, 51]},
        {"left": [], "right": [50, 51]},
        {"left": [70], "right": [*range(14), 40, 41, 42, 80]},
        {"left": [50, 51, 52], "right": [50, 51, 52]},
    ],
    ids=["one camera", "one of two", "both, started apart", "both alike"],
)
def test_lost_frames_are_found_and_put_right(tmp_path, gone) -> None:
    folder = filmed(tmp_path, gone)
    assert track(folder) == 0
    document = json.loads((folder / "results" / "tracking.json").read_text())
    lost = {camera: [] for camera in gone}
    for effect in document["effects"]:
        if effect["effect"] == "lost_frames":
            told = {one["name"]: one["value"] for one in effect["parameters"]}
            lost[effect["camera"]].append((told["after_frame"], told["frames"]))
    first = {camera: next(k for k in range(108) if k not in gone[camera]) for camera in gone}
    for camera, frames in gone.items():
        inside = [k for k in frames if k > first[camera]]
        assert sum(count for _, count in lost[camera]) == len(inside), lost
        if inside:
            assert lost[camera][0][0] == inside[0] - 1 - first[camera], lost
            said = f"{camera}: {int(lost[camera][0][1])} frame"
            assert any(said in text for text in document["runs"][0]["problems"]), document["runs"]
    found = read_trajectory(folder / "results" / "tracks" / "swing-01.csv")
    deviations = found.standard_deviations()
    assert deviations is not None
    clocks = [one for one in document["effects"] if one["effect"] == "clock_offset"]
    late = 0.0031 if "left" not in gone or any(c["camera"] == "left" for c in clocks) else 0.0
    z = errors_m(folder, START_S + late) / deviations[found.is_known, :3]
    rms = np.sqrt(np.mean(z**2, axis=0))
    assert rms.max() < 2.0, rms


@pytest.mark.slow
def test_lost_frames_that_cannot_be_counted_are_refused_by_name(tmp_path, capsys) -> None:
    """More than half of the frames are gone at once: any count fits, none is none."""
    folder = filmed(tmp_path, {"left": list(range(30, 48)), "right": [20, 27, 33, 41, 47, 52, 58]})
    assert track(folder) == 1
    said = capsys.readouterr().err
    assert "frames were lost while the stamps were counted on" in said, said


@pytest.mark.slow
@pytest.mark.parametrize("gone", [[50, 51, 52], [20, 33, 34, 47, 58, 71, 90]])
def test_copies_beside_lost_frames_name_what_was_lost(tmp_path, capsys, gone) -> None:
    """A recorder that falls behind repeats frames and loses others; told as started apart."""
    folder = filmed(tmp_path, {"left": [], "right": []})
    frames = frames_of("right")
    kept = [frames[k] for k in range(len(frames)) if k not in gone]
    kept = [kept[k - 1] if k % 8 == 7 else kept[k] for k in range(len(kept))]
    path = folder / "runs" / "swing-01" / "right.mp4"
    write_frames(path, kept, np.arange(len(kept)) / RATE_HZ)
    assert track(folder) == 1
    said = capsys.readouterr().err
    assert "were lost" in said, said
    assert "stamps were counted on" in said, said
