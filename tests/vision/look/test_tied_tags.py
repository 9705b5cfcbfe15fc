"""Tags that tied the cameras: tracking takes them where the calibration has them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from freeswing.cdpr.files.documents import InputError
from freeswing.cdpr.measured.target import Target
from freeswing.vision.look.tied_tags import tied_watch
from freeswing.vision.look.watched_target import Watch
from tests.vision.scenes import platform_tags

TARGET = Target(platform_tags())
WATCH = Watch.of(TARGET)
SHIFT_M = np.array([3e-4, -2e-4, 1e-4])


def calibration(folder: Path, stated_off_m: float = 0.0, **changes) -> Path:
    """What calibrate writes of tags that sit `SHIFT_M` from where target.toml has them."""
    tags = []
    for tag in reversed(TARGET.tags):
        corners = tag.corners_platform_m
        entry = {
            "family": tag.family,
            "id": tag.id,
            "corners_platform_m": (corners + SHIFT_M).tolist(),
            "target_corners_m": (corners + stated_off_m).tolist(),
        }
        tags.append(entry | changes)
    path = folder / "calibration.json"
    document = {"format": "freeswing-calibration/1", "layout": {"tags": tags}}
    path.write_text(json.dumps(document), encoding="utf-8")
    return path


def test_tags_are_taken_from_where_they_tied_the_cameras(tmp_path) -> None:
    watch, said = tied_watch(WATCH, calibration(tmp_path))
    assert said == []
    assert np.abs(watch.tag_corners_m - WATCH.tag_corners_m - SHIFT_M).max() < 1e-12


def test_without_a_layout_they_stay(tmp_path) -> None:
    path = tmp_path / "calibration.json"
    assert tied_watch(WATCH, path) == (WATCH, [])
    path.write_text('{"format": "freeswing-calibration/1"}', encoding="utf-8")
    assert tied_watch(WATCH, path) == (WATCH, [])


@pytest.mark.parametrize(("off_m", "same"), [(0.8e-6, True), (1.2e-6, False)])
def test_a_target_that_was_changed_since_is_named(tmp_path, off_m, same) -> None:
    watch, said = tied_watch(WATCH, calibration(tmp_path, off_m))
    assert (watch is WATCH) != same
    assert any("calibrate again" in text for text in said) != same


@pytest.mark.parametrize(
    "changes", [{"corners_platform_m": 3}, {"id": "x"}, {"target_corners_m": [[np.nan] * 3] * 4}]
)
def test_a_layout_that_is_none_is_named(tmp_path, changes) -> None:
    with pytest.raises(InputError, match="layout"):
        tied_watch(WATCH, calibration(tmp_path, **changes))
