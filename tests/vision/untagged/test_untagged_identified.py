"""A platform without tags that swings on its cables: from frames to inertia and report."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from freeswing.cdpr.files.trajectory_files import read_trajectory
from freeswing.cdpr.rotation import log_rotation
from freeswing.main import main
from tests.vision.untagged import swinging

pytestmark = pytest.mark.slow
pytest.importorskip("pycolmap")
MOMENTS = ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")


@pytest.fixture(scope="module")
def swung(tmp_path_factory):
    """The folder, the true body and motions, tracked without tags."""
    folder = tmp_path_factory.mktemp("swung")
    body, motions = swinging.make(folder, ("identify", "validate"), 0.1, 4)
    assert main(["track", str(folder), "--no-tags", "--workers", "1", "--quiet"]) == 0
    return folder, body, motions


def test_poses_are_right_to_what_is_asked_away_from_rest(swung) -> None:
    """The second run hangs 0.6 m from where the platform was at rest."""
    folder, _, motions = swung
    for name, motion in motions.items():
        found = read_trajectory(folder / "results" / "tracks" / f"{name}.csv")
        assert found.is_known.all()
        places, turns = motion(found.times_s)[:2]
        rms = np.sqrt(np.mean((found.values[:, :3] - places) ** 2, axis=0))
        assert 1e3 * rms.max() < 0.3, (name, rms)
        off = log_rotation(found.rotations() @ np.swapaxes(turns, 1, 2))
        rms = np.sqrt(np.mean(off**2, axis=0))
        assert 1e3 * rms.max() < 1.0, (name, rms)


def test_scatter_is_what_is_claimed(swung) -> None:
    """About what all poses of a run share; 1.5 is what the worst of six numbers may reach."""
    folder, _, motions = swung
    for name, motion in motions.items():
        found = read_trajectory(folder / "results" / "tracks" / f"{name}.csv")
        places, turns = motion(found.times_s)[:2]
        off = log_rotation(found.rotations() @ np.swapaxes(turns, 1, 2))
        errors = np.concatenate([found.values[:, :3] - places, off], axis=1)
        scatter = errors - errors.mean(axis=0)
        assert found.covariances is not None
        z2 = np.einsum("ni,nij,nj->n", scatter, np.linalg.inv(found.covariances), scatter) / 6.0
        assert np.sqrt(z2.mean()) < 1.5, (name, np.sqrt(z2.mean()))


def deviations_off(folder: Path, body) -> tuple[np.ndarray, np.ndarray]:
    """How far all nine numbers are off, in their deviations: as told, and without the geometry's.

    Poses that are all turned look like a robot file that is wrong, and that share would hold both.
    """
    assert main(["identify", str(folder), "--quiet"]) == 0
    found = json.loads((folder / "results" / "identification.json").read_text())
    rows = {row["name"]: row for row in found["estimates"]["ml_full"]["parameters"]}
    names = [f"com_{axis}_m" for axis in "xyz"] + [f"{name}_m2" for name in MOMENTS]
    true = [*body.com_m, *body.specific_inertia_m2]
    off = np.array([rows[n]["value"] - v for n, v in zip(names, true, strict=True)])
    told = np.array([rows[n]["std"] for n in names])
    geometry = np.array(found["estimates"]["ml_full"].get("geometry_std") or np.zeros(9))
    return off / told, off / np.sqrt(told**2 - geometry**2)


def test_what_is_identified_counts_the_frame(swung) -> None:
    """Without what all poses have wrong together some number would be wrong and sure."""
    folder, body, _ = swung
    off, _ = deviations_off(folder, body)
    assert np.abs(off).max() < 3.0, off
    path = folder / "results" / "tracking.json"
    whole = path.read_text()
    document = json.loads(whole)
    for run in document["runs"]:
        del run["calibration_errors"]
    path.write_text(json.dumps(document))
    _, alone = deviations_off(folder, body)
    path.write_text(whole)
    assert np.abs(alone).max() > 4.0, alone


def test_the_report_says_how_well_the_frame_is_known(swung) -> None:
    folder, _, _ = swung
    assert main(["identify", str(folder), "--quiet"]) == 0
    assert main(["report", str(folder), "--quiet"]) == 0
    page = (folder / "results" / "report.html").read_text(encoding="utf-8")
    assert "its frame is known to" in page
    assert "px for good" in page
