"""Stamps that jitter: seen against the other camera's, and counted in what is claimed."""

from __future__ import annotations

import json

import numpy as np
import pytest

from freeswing.cdpr.files.trajectory_files import read_trajectory
from tests.vision.footage.sessions import errors_m, track, write_session

JITTER_S = 4e-3


@pytest.mark.slow
def test_jitter_is_measured_and_widens_the_poses(tmp_path) -> None:
    folder = write_session(tmp_path)
    path = folder / "runs" / "swing-01" / "right.csv"
    rows = [line.split(",") for line in path.read_text().splitlines()[1:]]
    late = JITTER_S * np.random.default_rng(4).standard_normal(len(rows))
    lines = [f"{frame},{float(t) + dt:.9f}" for (frame, t), dt in zip(rows, late, strict=True)]
    path.write_text("\n".join(["frame,t_s", *lines]))
    assert track(folder) == 0
    run = json.loads((folder / "results" / "tracking.json").read_text())["runs"][0]
    (said,) = [text for text in run["problems"] if "right: its stamps jitter" in text]
    found = 1e-3 * float(said.split("jitter by ")[1].split(" ms")[0])
    assert 0.5 * JITTER_S < found < 1.5 * JITTER_S, said
    track_csv = read_trajectory(folder / "results" / "tracks" / "swing-01.csv")
    deviations = track_csv.standard_deviations()
    assert deviations is not None
    claimed = deviations[:, :3]
    wrong = errors_m(folder, 0.0)
    size = np.sqrt(np.mean(wrong**2) / np.nanmean(claimed**2))
    assert 0.7 < size < 1.4, f"errors are {size:.2f} times what is claimed"


@pytest.mark.slow
def test_jitter_that_all_stamps_share_is_counted(tmp_path) -> None:
    """Cameras of one trigger that jitters by 1 ms, and one of them alone: 4 and 5 times claimed."""
    for cameras in (("left", "right"), ("left",)):
        folder = write_session(tmp_path / "-".join(cameras))
        for path in sorted((folder / "runs" / "swing-01").iterdir()):
            if path.stem not in cameras:
                path.unlink()
        for camera in cameras:
            path = folder / "runs" / "swing-01" / f"{camera}.csv"
            rows = [line.split(",") for line in path.read_text().splitlines()[1:]]
            late = 1e-3 * np.random.default_rng(4).standard_normal(len(rows))
            lines = [f"{n},{float(t) + dt:.9f}" for (n, t), dt in zip(rows, late, strict=True)]
            path.write_text("\n".join(["frame,t_s", *lines]))
        assert track(folder) == 0
        run = json.loads((folder / "results" / "tracking.json").read_text())["runs"][0]
        assert any("lie along their motion" in text for text in run["problems"]), run["problems"]
        track_csv = read_trajectory(folder / "results" / "tracks" / "swing-01.csv")
        deviations = track_csv.standard_deviations()
        assert deviations is not None
        claimed = deviations[:, :3]
        size = np.sqrt(np.mean(errors_m(folder, 0.0) ** 2) / np.nanmean(claimed**2))
        assert 0.7 < size < 1.3, f"{cameras}: errors are {size:.2f} times what is claimed"
