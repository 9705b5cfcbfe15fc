import numpy as np
import pytest

from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.measured.trajectory import Trajectory, angle_noise, rotation_noise
from freeswing.cdpr.rotation import exp_rotation, log_rotation, matrix_from_angles


def swing(n=200, seed=0):
    rng = np.random.default_rng(seed)
    times = 0.01 * np.arange(n)
    values = rng.normal(size=6) + 0.3 * np.sin(np.outer(times, rng.uniform(3, 9, 6)))
    roots = 1e-3 * rng.normal(size=(n, 6, 6))
    covariances = roots @ roots.swapaxes(1, 2)
    return Trajectory(times, ("x", "y", "z", "phi", "theta", "chi"), values, covariances, "test")


def test_arrays_are_copied_and_read_only():
    times = np.arange(3.0)
    trajectory = Trajectory(times, ("x",), np.zeros((3, 1)))
    times[0] = -5.0
    assert trajectory.times_s[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        trajectory.values[0] = 1.0


@pytest.mark.parametrize(
    ("times", "coordinates", "values", "message"),
    [
        ([0.0, 0.0], ("x",), np.zeros((2, 1)), "times must increase"),
        ([0.0, np.nan], ("x",), np.zeros((2, 1)), "not finite"),
        ([], ("x",), np.zeros((0, 1)), "n_t >= 1"),
        ([0.0, 1.0], ("x",), np.zeros((2, 2)), "values: shape"),
        ([0.0, 1.0], ("w",), np.zeros((2, 1)), "must be different names"),
        ([0.0, 1.0], ("x", "x"), np.zeros((2, 2)), "must be different names"),
        ([0.0, 1.0], ("x",), [[np.inf], [0.0]], "infinite"),
    ],
)
def test_wrong_values_are_refused(times, coordinates, values, message):
    with pytest.raises(ValueError, match=message):
        Trajectory(np.array(times), coordinates, np.array(values))


def test_poses_go_in_and_out_and_angles_are_continuous():
    angles = np.linspace([0.0, -0.5, 0.0], [9.0, 0.5, -9.0], 300)
    angles[40:60] = np.nan
    trajectory = Trajectory.from_poses(
        np.arange(300.0), np.zeros((300, 3)), matrix_from_angles(angles)
    )
    assert trajectory.is_pose
    assert trajectory.is_known.sum() == 280
    assert np.allclose(trajectory.values[:, 3:], angles, atol=1e-12, equal_nan=True)
    R = matrix_from_angles(angles)
    assert np.allclose(trajectory.rotations(), R, atol=1e-12, equal_nan=True)


def test_a_window_holds_its_ends():
    window = swing().window(0.5, 1.0)
    assert window.times_s[[0, -1]].tolist() == [0.5, 1.0]
    assert len(window) == 51
    assert window.covariances.shape == (51, 6, 6)
    with pytest.raises(DataError, match=r"no sample from 5 to 6 s; it lasts from 0 to 1\.99 s"):
        swing().window(5.0, 6.0)


def test_select_reorders_values_and_covariances():
    trajectory = swing()
    chosen = trajectory.select(("z", "x"))
    assert np.array_equal(chosen.values, trajectory.values[:, [2, 0]])
    assert np.allclose(chosen.covariances, trajectory.covariances[:, [2, 0]][:, :, [2, 0]])
    with pytest.raises(ValueError, match="z not measured; it holds x, y"):
        trajectory.select(("x", "y")).select(("z",))


def test_noise_of_angles_and_of_rotations_are_inverse():
    trajectory = swing()
    args = trajectory.coordinates, trajectory.values
    there = angle_noise(*args, trajectory.covariances)
    back = rotation_noise(*args, there)
    error = np.abs(back - trajectory.covariances).max()
    assert error < 1e-15, error


def test_noise_of_angles_is_what_perturbed_rotations_show():
    rng = np.random.default_rng(3)
    angles, sigma, n = np.array([0.4, 0.7, -0.3]), 1e-3, 40_000
    R = exp_rotation(sigma * rng.normal(size=(n, 3))) @ matrix_from_angles(angles)
    sampled = Trajectory.from_poses(np.arange(float(n)), np.zeros((n, 3)), R).values[:, 3:]
    one = np.concatenate([np.zeros(3), angles])[None]
    covariance = np.diag([0, 0, 0, 1, 1, 1])[None] * sigma**2
    trajectory = Trajectory(np.zeros(1), swing().coordinates, one, covariance)
    told = trajectory.select(("phi", "theta")).covariances[0]
    seen = np.cov(sampled[:, :2].T)
    error = np.abs(seen / sigma**2 - told / sigma**2).max()
    assert error < 6.0 * np.sqrt(2.0 / n) * told.max() / sigma**2, (error, told, seen)
    spread = np.std(log_rotation(R @ matrix_from_angles(angles).T), axis=0)
    assert np.allclose(spread, sigma, rtol=0.03), spread
