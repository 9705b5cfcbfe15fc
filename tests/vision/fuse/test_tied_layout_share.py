"""Tags that tied the cameras are off together with them: what that does to poses is told."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from freeswing.calib.verdict.platform_layout import tag_entries
from freeswing.cdpr.rotation import exp_rotation, log_rotation
from freeswing.vision.fuse.calibration_share import (
    pose_slopes,
    read_calibration_noise,
    run_share,
    share_instants,
)
from freeswing.vision.fuse.fuse_cameras import fuse
from freeswing.vision.fuse.run_views import instants_of
from tests.vision.rig.made_views import Recorded, made_views

SECONDS = 1.5


@pytest.fixture(scope="module")
def swing(tmp_path_factory):
    views, watch = made_views(
        tmp_path_factory.mktemp("swing"), (Recorded(), Recorded()), seconds=SECONDS
    )
    return views, watch, *fuse(views, watch, instants_of(views))


def moved_tag(watch, tag: int, by: np.ndarray):
    corners = watch.tag_corners_m.copy()
    middle = corners[tag].mean(axis=0)
    corners[tag] = (corners[tag] - middle) @ exp_rotation(by[3:]).T + middle + by[:3]
    return replace(watch, tag_corners_m=corners)


def turned_camera(views, by: np.ndarray):
    T = views[0].camera.T_camera_base.copy()
    T[:3, :3], T[:3, 3] = exp_rotation(by[3:]) @ T[:3, :3], T[:3, 3] + by[:3]
    return [views[0].believed(replace(views[0].camera, T_camera_base=T)), *views[1:]]


@pytest.mark.parametrize("what", ["tag", "camera"])
@pytest.mark.parametrize("number", range(6))
def test_slopes_are_how_poses_move_when_a_place_is_changed(swing, what, number) -> None:
    """A tag's place and a camera's have the same sign: both are of what is believed."""
    views, watch, poses, fit = swing
    by = np.zeros(6)
    by[number] = 5e-5
    if what == "tag":
        names = tag_entries(*watch.tags[2])
        after, _ = fuse(views, moved_tag(watch, 2, by), poses.times_s, start=poses)
    else:
        names = [
            f"{views[0].camera.name}.{entry.rpartition('.')[2]}" for entry in tag_entries("", 0)
        ]
        after, _ = fuse(turned_camera(views, by), watch, poses.times_s, start=poses)
    slopes = pose_slopes(poses, fit, views, watch, tuple(names))[:, :, number]
    at = share_instants(poses)
    turns = log_rotation(after.rotations[at] @ np.swapaxes(poses.rotations[at], 1, 2))
    moved = np.concatenate([after.positions_m[at] - poses.positions_m[at], turns], axis=1) / 5e-5
    off = np.sqrt(np.mean((moved - slopes) ** 2) / np.mean(slopes**2))
    assert off < 0.1, off  # weights follow residuals, slopes hold them


def test_a_layout_joins_the_cameras_in_what_poses_share(swing, tmp_path) -> None:
    """All tags shifted alike by 1 mm shift all poses by 1 mm, about which cameras say nothing."""
    views, watch, poses, fit = swing
    tags = [entry for tag in watch.tags for entry in tag_entries(*tag)]
    alike = 1e-3 * np.array([entry.endswith("tx_m") for entry in tags])
    camera = f"{views[0].camera.name}.fx"
    matrix = np.zeros((len(tags) + 1, len(tags) + 1))
    matrix[1:, 1:] = np.outer(alike, alike)
    path = tmp_path / "calibration.json"
    layout = {
        "tags": [
            {
                "family": family,
                "id": number,
                "corners_platform_m": corners.tolist(),
                "target_corners_m": corners.tolist(),
            }
            for (family, number), corners in zip(watch.tags, watch.tag_corners_m, strict=True)
        ],
        "covariance": {"names": [camera, *tags], "matrix": matrix.tolist()},
    }
    document = {
        "format": "freeswing-calibration/1",
        "covariance": {"names": [camera], "matrix": [[0.0]]},
        "layout": layout,
    }
    path.write_text(json.dumps(document), encoding="utf-8")
    share = run_share(poses, fit, views, watch, read_calibration_noise(path))
    assert share is not None
    assert np.linalg.norm(share.std[:3]) == pytest.approx(1e-3, rel=0.05), share.std
    untied = run_share(poses, fit, views, watch, read_calibration_noise(path, tied=False))
    assert untied is not None
    assert not untied.std.any(), untied.std
    matrix[0, 0] = np.nan
    layout["covariance"] = {"names": [camera, *tags], "matrix": matrix.tolist()}
    path.write_text(json.dumps(document), encoding="utf-8")
    own = read_calibration_noise(path)
    assert own is not None, "what a layout does not tell took the cameras' share with it"
    assert own.names == (camera,)
