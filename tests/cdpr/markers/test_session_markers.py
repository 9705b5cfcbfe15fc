from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from freeswing.cdpr.files.problems import DataError, InputError
from freeswing.cdpr.markers.session_markers import common_layout, examine, fit_session
from tests.cdpr.markers.made import LAYOUT, NAMES, drift, recording, target

NOISE = 2e-5


def fit(recordings, layout=LAYOUT):
    found, runs = fit_session(target(layout), recordings)
    return found, runs


def changed(made, points):
    return replace(made, positions_m=points)


def pose_error(run, R, t):
    turn = Rotation.from_matrix(R @ run.trajectory.rotations().swapaxes(1, 2)).as_rotvec()
    return np.concatenate([t - run.trajectory.positions(), turn], axis=1)


def test_noise_and_covariance_are_those_of_the_data():
    made, R, t = recording(noise_m=2e-4, n=1500)
    points = np.array(made.positions_m)
    points[:500, 3] = np.nan
    _, (run,) = fit([changed(made, points)])
    assert run.examined.rigidity.kept_m == pytest.approx(2e-4, rel=0.05)
    error = pose_error(run, R, t)
    chi2 = np.einsum("ti,tij,tj->t", error, np.linalg.inv(run.trajectory.covariances), error).mean()
    # 6 +- five deviations of the mean, and 3 % for the variances that are estimated
    assert abs(chi2 - 6.0) < 5.0 * np.sqrt(12.0 / 1500) + 0.4, chi2
    assert run.trajectory.slow.correlation_s == 0.0
    assert not run.trajectory.slow.drift_covariance.any()


def test_a_layout_wrong_by_a_millimetre_makes_no_jump_where_a_marker_hides():
    layout = LAYOUT + 1e-3 * np.random.default_rng(5).normal(size=LAYOUT.shape)
    made, R, t = recording(layout)
    points = np.array(made.positions_m)
    points[::2, 4] = np.nan
    _, (run,) = fit([changed(made, points)])
    error = pose_error(run, R, t)
    body = np.einsum("tji,tj->ti", R, error[:, :3])
    jump = np.linalg.norm(body[::2].mean(axis=0) - body[1::2].mean(axis=0))
    assert jump < 1e-5, jump


@pytest.mark.parametrize(("size_m", "is_out"), [(3e-4, True), (2e-5, False)])
def test_a_drifting_marker_is_left_out_where_the_others_agree_twice_as_well(size_m, is_out):
    made, R, t = recording()
    points = np.array(made.positions_m)
    points[:, 2] += size_m * drift(len(points), 3)
    _, (run,) = fit([changed(made, points)])
    found = run.examined.rigidity
    assert found.left_out == ((2,) if is_out else ())
    assert found.kept_m == pytest.approx(NOISE, rel=0.3), found
    if is_out:
        assert found.std_m[2] == pytest.approx(size_m, rel=0.3), found.std_m
        assert found.all_m > 2.0 * found.kept_m
    error = pose_error(run, R, t)
    claimed = np.sqrt(np.diagonal(run.trajectory.covariances, axis1=1, axis2=2))
    assert np.sqrt(np.mean((error / claimed) ** 2)) < 1.6


def test_slow_noise_is_in_the_covariances_with_its_time():
    made, R, t = recording(n=1500)
    points = np.array(made.positions_m)
    for k in range(5):
        points[:, k] += 1e-4 * drift(len(points), 10 + k)
    _, (run,) = fit([changed(made, points)])
    slow = run.trajectory.slow
    assert run.examined.rigidity.left_out == ()
    assert slow.correlation_s == pytest.approx(0.8, rel=0.5)
    error = pose_error(run, R, t)
    claimed = np.sqrt(np.diagonal(run.trajectory.covariances, axis1=1, axis2=2))
    size = np.sqrt(np.mean((error / claimed) ** 2, axis=0))
    assert (size > 0.6).all(), size
    assert (size < 1.5).all(), size
    share = np.diag(slow.drift_covariance)[:3] / np.mean(claimed[:, :3] ** 2, axis=0)
    assert share == pytest.approx(0.96, abs=0.05)


def test_labels_exchanged_for_ten_frames_are_put_right():
    made, R, t = recording()
    points = np.array(made.positions_m)
    points[300:310, [1, 2]] = points[300:310, [2, 1]]
    _, (run,) = fit([changed(made, points)])
    (exchange,) = run.examined.faults.exchanges
    assert exchange.markers == (1, 2)
    assert exchange.frames.tolist() == list(range(300, 310))
    assert np.abs(pose_error(run, R, t)[:, :3]).max() < 6 * NOISE


def test_a_marker_away_for_five_frames_is_left_out_there_with_its_millimetres():
    made, R, t = recording()
    points = np.array(made.positions_m)
    points[200:205, 3] += [0.08, 0.0, 0.0]
    _, (run,) = fit([changed(made, points)])
    (jump,) = run.examined.faults.jumps
    assert (jump.marker, jump.frames.tolist()) == (3, list(range(200, 205)))
    assert 0.03 < jump.most_m < 0.081, jump
    assert np.abs(pose_error(run, R, t)[:, :3]).max() < 6 * NOISE


def test_labels_exchanged_throughout_a_run_are_taken_as_the_target_has_them():
    made, R, t = recording()
    turned = [0, 2, 3, 1, 4]
    _, (run,) = fit([replace(made, names=tuple(NAMES[k] for k in turned))])
    assert run.examined.order is not None
    assert np.abs(pose_error(run, R, t)[:, :3]).max() < 6 * NOISE


def test_labels_of_a_symmetric_layout_are_not_guessed():
    square = np.array([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]]) * 0.1
    made, _, _ = recording(square)
    found = examine(replace(made, names=("A", "P", "B", "C")), target(square))
    assert found.order is None


@pytest.mark.parametrize("k", range(5))
def test_one_marker_that_target_toml_has_20_mm_off_is_named_and_the_frame_stays(k):
    wrong = LAYOUT.copy()
    wrong[k] += [0.012, 0.0, 0.016]
    made, R, t = recording()
    layout, (run,) = fit([made], wrong)
    size = np.linalg.norm(layout.change_m, axis=1)
    assert size[k] == pytest.approx(0.02, abs=1e-4)
    assert np.delete(size, k).max() < 1e-4
    assert np.abs(pose_error(run, R, t)[:, :3]).max() < 2e-4


def test_which_of_two_markers_is_off_is_not_guessed():
    """Moved across a plane, one corner of a square is like the other two: half as far, turned."""
    square = np.array([[0, 0, 0], [0.3, 0, 0], [0.3, 0.3, 0], [0, 0.3, 0]])
    wrong = square.copy()
    wrong[0, 2] += 0.02
    rough = wrong + 2e-3 * np.random.default_rng(0).normal(size=wrong.shape)
    made, _, _ = recording(square)
    with pytest.raises(
        DataError, match=r"do not lie as target.toml says: .* by .* mm or .* mm off"
    ):
        common_layout(target(rough), [examine(made, target(rough))])


@pytest.mark.parametrize(
    ("of_file", "of_target", "message"),
    [
        (1.0, 1000.0, r"target.toml: position_m: .* 1000 times .* metres"),
        (1000.0, 1.0, r"run: its markers are 1000 times as far apart"),
        (1.0, 39.37, r"target.toml: position_m: .* 39.37"),
    ],
)
def test_another_unit_in_the_target_or_the_file_is_named(of_file, of_target, message):
    made, _, _ = recording()
    points = changed(made, of_file * made.positions_m)
    with pytest.raises(InputError, match=message):
        examine(points, target(of_target * LAYOUT))


def test_one_layout_for_all_runs_and_a_frame_as_uncertain_as_the_markers_move():
    rng = np.random.default_rng(2)
    true = LAYOUT + 1e-3 * rng.normal(size=LAYOUT.shape)
    spread, errors, claimed = 3e-4, [], []
    made = [
        recording(true + spread * rng.normal(size=true.shape), n=60, seed=seed, name=f"r{seed}")
        for seed in range(12)
    ]
    layout, runs = fit([m[0] for m in made], true)
    assert layout.run_std_m == pytest.approx(spread, rel=0.35)
    for run, (_, R, t) in zip(runs, made, strict=True):
        error = pose_error(run, R, t)
        body = np.concatenate(
            [np.einsum("tji,tj->ti", R, error[:, :3]), np.einsum("tji,tj->ti", R, error[:, 3:])], 1
        ).mean(axis=0)
        errors.append(body)
        claimed.append(np.sqrt(np.diag(run.trajectory.slow.frame_covariance)))
    z = np.array(errors) / np.array(claimed)
    assert 0.6 < np.sqrt(np.mean(z**2)) < 1.5, np.sqrt(np.mean(z**2, axis=0))


def test_too_few_markers_are_said():
    made, _, _ = recording()
    points = np.array(made.positions_m)
    points[:, 2:] = np.nan
    with pytest.raises(DataError, match="at most 2 at once"):
        fit([changed(made, points)])
