"""A rendered platform without tags through the command line, against its true motion."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

from freeswing.cdpr.files.trajectory_files import read_trajectory
from freeswing.cdpr.measured.pose_errors import read_pose_errors
from freeswing.cdpr.rotation import log_rotation, matrix_from_angles
from freeswing.main import main
from tests.vision.untagged import boxes

pytestmark = pytest.mark.slow
pytest.importorskip("pycolmap")
FRAMES = 24


@pytest.fixture(scope="module")
def tracked(tmp_path_factory):
    """Errors of position (m) and rotation (rad), (n, 6), their covariances, and the document."""
    folder = tmp_path_factory.mktemp("box")
    boxes.make(folder, FRAMES)
    assert main(["track", str(folder), "--no-tags", "--workers", "1"]) == 0
    found = read_trajectory(folder / "results/tracks/a.csv")
    places, turns = boxes.swing(found.times_s)
    off = matrix_from_angles(found.values[:, 3:]) @ np.swapaxes(turns, 1, 2)
    errors = np.concatenate([found.values[:, :3] - places, log_rotation(off)], axis=1)
    document = json.loads((folder / "results/tracking.json").read_text())
    return errors, found.covariances, document


def test_poses_are_right_to_what_is_asked(tracked) -> None:
    errors, _, document = tracked
    assert document["runs"][0]["known"] == FRAMES
    rms = np.sqrt(np.mean(errors**2, axis=0))
    assert 1e3 * rms[:3].max() < 0.3, rms
    assert 1e3 * rms[3:].max() < 1.0, rms


def test_claimed_covariances_hold(tracked) -> None:
    """Scatter about what all poses share, 24 of 6 numbers: a third to twice of what is claimed."""
    errors, covariances, _ = tracked
    scatter = errors - errors.mean(axis=0)
    chi2 = np.einsum("ni,nij,nj->n", scatter, np.linalg.inv(covariances), scatter) / 6.0
    assert 0.3 < chi2.mean() < 2.0, chi2


def test_the_frame_is_as_good_as_is_told(tracked) -> None:
    """What all poses share: within three of the deviations that the result states."""
    errors, _, document = tracked
    said = " ".join(document["runs"][0]["problems"])
    told = re.search(r"known to ([\d.]+) mm and ([\d.]+) mrad", said)
    assert told is not None, said
    common = np.abs(1e3 * errors.mean(axis=0))
    assert common[:3].max() < 3.0 * float(told[1]), (common, told[0])
    assert common[3:].max() < 3.0 * float(told[2]), (common, told[0])


def test_identify_is_told_how_the_frame_may_be_off(tracked) -> None:
    """Six causes that no calibration tells of: within three deviations of what all poses share."""
    errors, _, document = tracked
    told = read_pose_errors(document["runs"][0]["calibration_errors"])
    assert len(told.modes) >= 6
    places, turns = boxes.swing(np.arange(FRAMES) / boxes.RATE_HZ)
    shifts = told.at(places, turns, np.zeros((FRAMES, 6)))
    deviations = np.sqrt((shifts**2).sum(axis=2)).mean(axis=0)
    assert (np.abs(errors.mean(axis=0)) < 3.0 * deviations).all(), (errors.mean(axis=0), deviations)
    assert deviations[:3].max() < 1e-3, deviations
