"""A whole recorded session: trajectories against truth, effects of the cameras, resumption."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from freeswing.cdpr.files.documents import InputError
from freeswing.cdpr.files.trajectory_files import read_trajectory
from freeswing.cdpr.measured.target import Target
from freeswing.vision.look import pieces, sightings
from freeswing.vision.settings import Settings
from tests.vision.films import (
    BASE,
    FRAMES,
    KNOCK_RAD,
    LATE_S,
    TARGET,
    cameras,
    errors,
    track,
    tracked,
)


def test_poses_scatter_as_they_claim(session) -> None:
    folder, _, _ = session
    trajectory = read_trajectory(folder / "results" / "tracks" / "swing.csv")
    error = errors(trajectory)
    bias_mm = 1e3 * np.abs(error[:, :3].mean(axis=0)).max()
    scatter_mm = 1e3 * error[:, :3].std(axis=0).max()
    scatter_mrad = 1e3 * error[:, 3:].std(axis=0).max()
    assert len(trajectory) >= FRAMES - 1, f"{len(trajectory)} samples"
    assert bias_mm < 0.1, f"bias {bias_mm:.3f} mm"
    assert scatter_mm < 0.05, f"scatter {scatter_mm:.4f} mm"
    assert scatter_mrad < 0.2, f"scatter {scatter_mrad:.3f} mrad"
    inner = slice(3, -3)
    total = np.einsum(
        "ni,nij,nj->",
        error[inner],
        np.linalg.inv(np.asarray(trajectory.covariances)[inner]),
        error[inner],
    )
    # Errors are no larger than claimed, within chance; and claims no more than a third too large:
    # 231 of 324 were measured, corners of these clean small images being better than their floor.
    count = error[inner].size
    high = chi2.ppf(1 - 1e-4, count)
    assert count / 1.33**2 < total < high, f"chi-square {total:.0f} of {count}, at most {high:.0f}"


def test_the_late_and_the_knocked_camera_are_found(session) -> None:
    document = session[2]
    found = {(e["effect"], e["camera"]): e for e in document["effects"]}
    assert set(found) == {("clock_offset", "cam2"), ("camera_moved", "cam1")}, sorted(found)
    clock = found["clock_offset", "cam2"]["parameters"][0]
    assert abs(clock["value"] - LATE_S) < 5e-5, f"{clock['value'] * 1e3:.3f} ms"
    assert clock["std"] < 5e-5, f"std {clock['std'] * 1e3:.4f} ms"
    turn = found["camera_moved", "cam1"]["parameters"][0]
    assert abs(turn["value"] - np.linalg.norm(KNOCK_RAD)) < 1e-4, f"{turn['value']} rad"
    before, after = (
        found["camera_moved", "cam1"][k]["consistency_mm"] for k in ("before", "after")
    )
    assert after < 0.1 * before, f"consistency {before:.3f} -> {after:.3f} mm"


def test_tracking_json_counts_every_frame(session) -> None:
    folder, _, document = session
    written = json.loads((folder / "results" / "tracking.json").read_text())
    assert written["format"] == "freeswing-tracking/1"
    for camera in written["runs"][0]["cameras"]:
        total = camera["frames_used"] + sum(camera["frames_rejected"].values())
        assert camera["frames_seen"] == FRAMES == total, f"{camera['camera']}: {total}"
        assert camera["reprojection_px"] < 0.05, camera["reprojection_px"]
    assert written["runs"] == json.loads(json.dumps(document["runs"])), "document differs"


def test_killed_damaged_and_resumed_gives_the_same_bytes(session, tmp_path, monkeypatch) -> None:
    _, run, _ = session
    monkeypatch.setattr(pieces, "FRAMES_A_PIECE", 16)
    monkeypatch.setattr(sightings, "FRAMES_A_PIECE", 16)
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    track(run, whole)
    saved = sightings.save_piece
    count = 0

    def dies(path, piece, follower) -> None:
        nonlocal count
        count += 1
        if count > 5:
            raise KeyboardInterrupt
        saved(path, piece, follower)

    monkeypatch.setattr(sightings, "save_piece", dies)
    with pytest.raises(KeyboardInterrupt):
        track(run, cut)
    assert len(list((cut / "results").rglob("*.npz"))) == 5
    monkeypatch.setattr(sightings, "save_piece", saved)
    damaged = sorted((cut / "results").rglob("*.npz"))[1]
    damaged.write_bytes(damaged.read_bytes()[:-400])
    track(run, cut)
    for name in ("tracking.json", "tracks/swing.csv"):
        one = (whole / "results" / name).read_bytes()
        other = (cut / "results" / name).read_bytes()
        assert one == other, f"{name} differs"


def test_one_camera_alone_gives_poses_at_its_own_covariance(session, tmp_path) -> None:
    _, run, _ = session
    track(run, tmp_path, view=cameras()[:1])
    trajectory = read_trajectory(tmp_path / "results" / "tracks" / "swing.csv")
    error = errors(trajectory)
    claimed = trajectory.standard_deviations()
    ratio = np.sqrt(np.mean((error / claimed) ** 2))
    assert len(trajectory) == FRAMES, f"{len(trajectory)} poses"
    assert 0.5 < ratio < 1.6, f"errors are {ratio:.2f} times what is claimed"


def test_a_recording_of_another_size_is_refused(session, tmp_path) -> None:
    _, run, _ = session
    wrong = tuple(replace(c, size_px=(640, 480)) for c in cameras())
    with pytest.raises(InputError, match=r"360 x 288 pixels, but cameras\.toml has 640 x 480"):
        track(run, tmp_path, view=wrong)


@pytest.mark.slow
def test_a_tag_that_sits_elsewhere_is_measured_and_put_right(session, tmp_path) -> None:
    """The recordings' tag 3 sits 2 mm from where the target file has it."""
    _, run, _ = session
    moved = np.array([0.0014, 0.0, -0.0014])
    tags = list(TARGET.tags)
    pose = tags[3].T_platform_tag.copy()
    pose[:3, 3] += moved
    tags[3] = replace(tags[3], T_platform_tag=pose)
    document = tracked(
        [run],
        cameras(),
        Target(tuple(tags)),
        results=tmp_path / "results",
        base_tags=BASE,
        workers=1,
        settings=Settings(refine_layout=True),
    )
    mismatch = {tag["id"]: tag["mismatch_mm"] for tag in document["layout"]["tags"]}
    assert max(mismatch, key=mismatch.get) == 3, mismatch
    assert 1.2 < mismatch[3] < 2.5, f"mismatch {mismatch[3]:.2f} mm"
    error = errors(read_trajectory(tmp_path / "results" / "tracks" / "swing.csv"))
    scatter_mm = 1e3 * error[:, :3].std(axis=0).max()
    assert scatter_mm < 0.06, f"scatter {scatter_mm:.3f} mm"
