"""Starts of two cameras held against each other: what is wrong with one has no excuse."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.cdpr.files.trajectory_files import read_trajectory
from freeswing.cdpr.rotation import invert
from freeswing.vision.look.follow import REPEATED, USED
from freeswing.vision.render.render_scene import motion_of
from freeswing.vision.rig.correct_rig import _missed
from freeswing.vision.rig.lag_accepted import (
    SURE_SIGMAS,
    _suspects,
    deviations_apart,
    own_track,
)
from freeswing.vision.rig.lag_search import pair_of
from tests.vision.footage.sessions import FILMED, START_S
from tests.vision.rig.made_views import NOISE_PX, Recorded, made_views

LATE_S = 0.7


@pytest.mark.parametrize("wrong_s", [pytest.param(-0.5, marks=pytest.mark.slow), 1.9])
def test_a_wrong_start_is_no_unknown_motion(tmp_path, wrong_s) -> None:
    """Poses of a wrong start scatter, so that the motion between them is known to little.

    Were that taken for noise, a start of 40 px would disagree by as little as the right one.
    """
    own = Recorded(dropped=0.04, jitter_s=2e-4)
    (left, right), watch = made_views(tmp_path, (own, replace(own, late_s=LATE_S)))
    missed = [
        _missed([left, right.believed(replace(right.camera, clock_offset_s=start))], watch, 3e-4)
        for start in (LATE_S - 0.012, wrong_s)
    ]
    assert missed[0].offset_s == pytest.approx(LATE_S, abs=1e-3)
    assert missed[0].size_px < 3.0 * NOISE_PX
    seen_px = np.sqrt(np.mean(list(missed[1].squares_px2.values())))
    assert missed[1].size_px > 0.5 * seen_px > 1.0
    assert deviations_apart(*missed) > 10.0


@pytest.mark.parametrize("turned_rad", [pytest.param(0.0, marks=pytest.mark.slow), 0.004])
@pytest.mark.parametrize(("late_s", "looked_for"), [(0.0, False), (0.7, True)])
def test_a_start_by_a_whole_period_is_looked_for(tmp_path, turned_rad, late_s, looked_for) -> None:
    """A swing of 0.7 s a period nearly repeats itself, and a knock is off by as much at any start.

    Poses are 6.5 mm apart as stamped and 2.4 mm at the right start, 9.8 and 8.4 after a knock.
    """
    truth = motion_of(read_trajectory(FILMED / "truth" / "swing-01.csv"))
    own = Recorded(), Recorded(late_s, turned_rad=turned_rad)
    views, _ = made_views(
        tmp_path, own, seconds=5.4, motion=lambda times_s: truth(times_s + START_S)
    )
    left, right = (view.camera.T_camera_base for view in views)
    first, second = (own_track(view) for view in views)
    pair = pair_of(first, second, left @ invert(right))
    assert pair is not None
    assert (pair.at_zero_sigmas > SURE_SIGMAS) == looked_for, pair.at_zero_sigmas
    assert min(abs(lag - late_s) for lag in (pair.lag_s, *(at for at, _ in pair.rivals))) < 0.02


@pytest.mark.parametrize(
    ("copies", "said"), [(0, "filmed different swings"), (3, "repeats 3 frames")]
)
def test_where_no_start_fits_what_else_it_may_be_is_said(copies, said) -> None:
    status = np.full(40, USED)
    status[:copies] = REPEATED
    views: Any = [
        SimpleNamespace(camera=SimpleNamespace(name=name), status=own)
        for name, own in (("left", np.full(40, USED)), ("right", status))
    ]
    text = _suspects(views)
    assert said in text, text
    assert "lost" in text, text
