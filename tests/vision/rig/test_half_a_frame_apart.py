"""Cameras that take their frames between each other's, before a mode of four frames a period."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from freeswing.cdpr.files.trajectory_files import read_trajectory
from freeswing.vision.render.record import record
from freeswing.vision.render.render_scene import Scene
from tests.samples import make_filmed as filmed
from tests.vision.footage.sessions import RATE_HZ, START_S, track, without_clocks, write_session
from tests.vision.footage.test_times import tracking
from tests.vision.rig.made_views import MODES, damped

FRAMES = 70


def session(folder: Path, late_s: float, fast_hz: float) -> None:
    """The right camera takes its frames so much later, and says nothing of it."""
    write_session(folder, without_clocks)
    place = folder / "runs" / "swing-01"
    shutil.rmtree(place)
    world = Scene(
        (*filmed._still(), *filmed._platform()),
        damped((*MODES[:2], (fast_hz, (0.003, 0.002, 0.004), (0.01, 0.02, 0.01)))),
    )
    stamps = np.arange(FRAMES) / RATE_HZ
    for camera in filmed.cameras():
        start = START_S + (late_s if camera.name == "right" else 0.0)
        own = replace(camera, clock_offset_s=start)
        record(place, (own,), world, stamps, filmed.LOOK, filmed.SEED)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("late_s", "fast_hz"), [(0.023, 5.2), (0.003, 5.2), (0.0125, 7.0), (-0.02, 3.0)]
)
def test_cameras_between_each_others_frames(tmp_path, late_s, fast_hz) -> None:
    session(tmp_path, late_s, fast_hz)
    assert track(tmp_path) == 0
    (effect,) = tracking(tmp_path)["effects"]
    assert (effect["effect"], effect["camera"]) == ("clock_offset", "right"), effect
    offset = effect["parameters"][0]
    wrong = (offset["value"] - late_s) / offset["std"]
    assert abs(wrong) < 3.5, f"{wrong:.1f} deviations, {offset}"
    assert offset["std"] < 1e-4, offset
    found = read_trajectory(tmp_path / "results" / "tracks" / "swing-01.csv")
    true, _ = damped((*MODES[:2], (fast_hz, (0.003, 0.002, 0.004), (0.01, 0.02, 0.01))))(
        found.times_s + START_S
    )
    error = (found.values[:, :3] - true)[found.is_known]
    deviations = found.standard_deviations()
    assert deviations is not None
    claimed = deviations[found.is_known, :3]
    size = np.sqrt(np.mean((error / claimed) ** 2, axis=0))
    assert size.max() < 1.5, f"errors are {np.round(size, 2)} times what is claimed"
    assert np.sqrt(np.mean(error**2, axis=0)).max() < 1e-4, "no farther than 0.1 mm"
