"""Recorded runs that one marker spoils, and one that none does."""

import numpy as np
import pytest

from freeswing.cdpr.files.trajectory_files import read_recording
from freeswing.cdpr.markers.session_markers import examine
from freeswing.cdpr.measured.target import read_target
from tests.places import REAL, needs_real

BOLOGNA = REAL / "bologna-2020"


@needs_real("bologna-2020")
@pytest.mark.parametrize(
    ("run", "marker", "all_um", "kept_um"),
    [("nat-01", None, 19, 19), ("nat-10", "M3", 136, 49), ("nat-35", "M5", 120, 38)],
)
def test_the_marker_that_spoils_a_run_is_left_out(run, marker, all_um, kept_um) -> None:
    target = read_target(BOLOGNA / "target.toml")
    found = examine(read_recording(BOLOGNA / "runs" / f"{run}.trc"), target, (8.0, 18.0)).rigidity
    names = [target.marker_names[k] for k in found.left_out]
    assert names == ([] if marker is None else [marker])
    assert 1e6 * np.array([found.all_m, found.kept_m]) == pytest.approx([all_um, kept_um], rel=0.1)
