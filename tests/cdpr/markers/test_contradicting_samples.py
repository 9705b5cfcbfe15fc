from dataclasses import replace

import numpy as np
import pytest

from freeswing.cdpr.markers.contradicting_samples import stand_outs
from freeswing.cdpr.markers.session_markers import fit_session
from freeswing.cdpr.markers.spoiling_markers import Rigidity
from tests.cdpr.markers.made import drift, recording, target

SHORT = slice(100, 102)


def ghost(made, size_m, frames=SHORT):
    """P's reflection elsewhere for a moment, too near for distances alone to see."""
    points = np.array(made.positions_m)
    points[frames, 0] += size_m * np.array([0.8, -0.6, 0.0])
    return replace(made, positions_m=points)


def test_samples_in_which_a_marker_stands_out_have_no_pose_and_all_others_do():
    made, _, _ = recording()
    for window in (None, (0.5, 3.9)):
        _, (run,) = fit_session(target(), [ghost(made, 9e-4)], [window])
        known = run.trajectory.is_known
        assert not known[SHORT].any()
        assert known.sum() == 398
        (one,) = run.examined.stand_outs
        assert one.marker == 0
        assert one.frames.tolist() == [100, 101]
        assert 4e-4 < one.most_m < 9e-4


def test_a_third_of_a_second_does_not_turn_a_run_whose_other_marker_is_left_out():
    made, _, _ = recording(noise_m=8e-5, n=1000)
    rare = np.arange(1000) % 9 == 0
    points = np.array(ghost(made, 1.2e-3, slice(700, 730)).positions_m)
    points[:, 3] += 2e-3 * drift(1000, 5)
    points[~rare, 1] = np.nan
    _, (run,) = fit_session(target(), [replace(made, positions_m=points)])
    assert not run.trajectory.is_known[700:730][~rare[700:730]].any()
    assert run.trajectory.is_known.sum() > 930
    assert 3 in run.examined.rigidity.left_out
    assert 0 not in run.examined.rigidity.left_out


def test_what_all_samples_share_and_small_drifts_keep_their_poses():
    made, _, _ = recording()
    for size_m, frames in ((3e-4, SHORT), (9e-4, slice(None))):
        _, (run,) = fit_session(target(), [ghost(made, size_m, frames)])
        assert run.trajectory.is_known.all()
        assert run.examined.stand_outs == ()


@pytest.mark.parametrize(("size_m", "stands_out"), [(4.6e-4, False), (5.4e-4, True)])
def test_less_than_half_a_millimetre_is_the_drift_of_half_hidden_markers(size_m, stands_out):
    residuals = 2e-5 * np.random.default_rng(1).normal(size=(300, 4, 3))
    residuals[77, 2] = [0.0, size_m, 0.0]
    found = Rigidity(np.zeros((4, 3)), np.full(4, 2e-5), (), 2e-5, 2e-5, residuals)
    assert [one.frames.tolist() for one in stand_outs(found)] == ([[77]] if stands_out else [])
