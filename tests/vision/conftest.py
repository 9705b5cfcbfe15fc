"""What several tests of tracking share."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from freeswing.vision.rig.moved_cameras import moved_by
from tests.vision.films import KNOCK_RAD, LATE_S, cameras, film, track


@pytest.fixture(scope="session")
def session(tmp_path_factory):
    """One camera 6 ms late, one knocked by 0.35 degrees after the calibration."""
    folder = tmp_path_factory.mktemp("session")
    first, second, third = cameras()
    truth = (
        first,
        moved_by(second, np.concatenate([np.zeros(3), KNOCK_RAD])),
        replace(third, clock_offset_s=LATE_S),
    )
    run = film(folder, truth)
    return folder, run, track(run, folder)
