import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from freeswing.cdpr.rotation import (
    angle_rate_matrix,
    angles_from_matrix,
    exp_rotation,
    invert,
    log_rotation,
    log_slope,
    matrix_from_angles,
    matrix_from_quaternion,
    nearest_rotation,
    quaternion_from_matrix,
    skew,
    transform,
)

number = st.floats(-10.0, 10.0)
triple = st.tuples(number, number, number).map(np.array)


@given(triple)
def test_exp_agrees_with_scipy(rotvec):
    error = np.abs(exp_rotation(rotvec) - Rotation.from_rotvec(rotvec).as_matrix()).max()
    assert error < 1e-13, error


@given(triple)
def test_log_undoes_exp(rotvec):
    R = exp_rotation(rotvec)
    error = np.abs(exp_rotation(log_rotation(R)) - R).max()
    assert error < 1e-12, error


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-6, 1e-3, 2e-3, 1.0, np.pi - 1e-9, np.pi])
def test_log_length_is_the_angle_also_at_its_branches(angle):
    axis = np.array([0.6, -0.64, 0.48])
    found = np.linalg.norm(log_rotation(exp_rotation(angle * axis)))
    assert found == pytest.approx(angle, abs=1e-15, rel=1e-9), found


@given(triple)
def test_angles_are_those_of_intrinsic_xyz(angles):
    error = np.abs(
        matrix_from_angles(angles) - Rotation.from_euler("XYZ", angles).as_matrix()
    ).max()
    assert error < 1e-13, error


@given(triple)
def test_angles_round_trip(rotvec):
    R = exp_rotation(rotvec)
    error = np.abs(matrix_from_angles(angles_from_matrix(R)) - R).max()
    assert error < 1e-8, error


@pytest.mark.parametrize("theta", [np.pi / 2, -np.pi / 2])
def test_angles_round_trip_at_gimbal_lock(theta):
    R = matrix_from_angles([0.3, theta, 0.4])
    error = np.abs(matrix_from_angles(angles_from_matrix(R)) - R).max()
    assert error < 1e-12, error


@given(triple)
def test_quaternion_round_trip_and_order(rotvec):
    R = exp_rotation(rotvec)
    q = quaternion_from_matrix(R)
    error = np.abs(matrix_from_quaternion(q) - R).max()
    assert error < 1e-14, error
    assert q[0] >= 0.0, q
    half = Rotation.from_matrix(R).as_quat(scalar_first=True)
    assert abs(abs(half @ q) - 1.0) < 1e-14, (half, q)


def test_quaternion_of_every_branch():
    turns = [0.0, np.pi - 1e-12]
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    R = exp_rotation(np.array([turn * axis for turn in turns for axis in axes]))
    error = np.abs(matrix_from_quaternion(quaternion_from_matrix(R)) - R).max()
    assert error < 1e-14, error


def test_quaternion_length_does_not_matter_and_zero_is_unknown():
    q = np.array([0.5, -0.1, 0.3, 0.2])
    assert np.allclose(matrix_from_quaternion(3.0 * q), matrix_from_quaternion(q), atol=1e-15)
    assert np.isnan(matrix_from_quaternion(np.zeros(4))).all()


@given(triple, triple)
def test_angle_rates_give_the_angular_velocity_in_the_base_frame(angles, rates):
    h = 1e-6
    after, before = (matrix_from_angles(angles + s * h * rates) for s in (1.0, -1.0))
    omega = log_rotation(after @ before.T) / (2.0 * h)
    error = np.abs(angle_rate_matrix(angles) @ rates - omega).max()
    assert error < 1e-6, error


def test_missing_samples_stay_missing_and_alone():
    rotvec = np.array([[0.1, 0.2, 0.3], [np.nan, 0.0, 0.0], [0.0, 0.0, 0.0]])
    R = exp_rotation(rotvec)
    for found in (log_rotation(R), angles_from_matrix(R), quaternion_from_matrix(R)):
        assert np.isnan(found[1]).all(), found
        assert np.isfinite(found[[0, 2]]).all(), found


def test_batch_equals_loop():
    rotvec = np.random.default_rng(1).normal(size=(4, 5, 3))
    R = exp_rotation(rotvec)
    for f, values in (
        (exp_rotation, rotvec),
        (skew, rotvec),
        (matrix_from_angles, rotvec),
        (angle_rate_matrix, rotvec),
    ):
        loop = np.array([[f(v) for v in row] for row in values])
        assert np.array_equal(f(values), loop), f
    for f in (log_rotation, angles_from_matrix, quaternion_from_matrix):
        assert np.array_equal(f(R), np.array([[f(r) for r in row] for row in R])), f


@given(triple, triple)
def test_skew_is_the_cross_product(v, w):
    error = np.abs(skew(v) @ w - np.cross(v, w)).max()
    assert error < 1e-12, error


def test_invert_undoes_transform():
    rng = np.random.default_rng(2)
    T = transform(exp_rotation(rng.normal(size=(7, 3))), rng.normal(size=(7, 3)))
    error = np.abs(invert(T) @ T - np.eye(4)).max()
    assert error < 1e-14, error


@pytest.mark.parametrize("angle", [0.0, 1e-6, 1.9e-3, 2.1e-3, 0.5, 3.0])
def test_slope_of_the_log_is_its_difference_quotient(angle):
    rotvec, h = angle * np.array([0.6, -0.64, 0.48]), 1e-6
    steps = h * np.concatenate([np.eye(3), -np.eye(3)])
    moved = log_rotation(exp_rotation(steps) @ exp_rotation(rotvec))
    quotient = (moved[:3] - moved[3:]).T / (2.0 * h)
    error = np.abs(log_slope(rotvec) - quotient).max()
    assert error < 1e-8, error


def test_the_nearest_rotation_is_scipys() -> None:
    """Of points turned and disturbed, some so flat that a mirror image would do better."""
    rng = np.random.default_rng(4)
    a, turns = rng.normal(size=(40, 6, 3)), Rotation.random(40, rng=rng)
    a[::2, :, 2] *= 1e-2
    b = np.einsum("tij,tnj->tni", turns.as_matrix(), a) + 0.2 * rng.normal(size=a.shape)
    found = nearest_rotation(np.einsum("tni,tnj->tij", b, a))
    for one, x, y in zip(found, a, b, strict=True):
        expected = Rotation.align_vectors(y, x)[0].as_matrix()
        assert np.abs(one - expected).max() < 1e-9
        np.testing.assert_array_equal(nearest_rotation(y.T @ x).shape, (3, 3))
    assert np.linalg.det(found) == pytest.approx(1.0)
    assert min(np.linalg.det(y.T @ x) for x, y in zip(a, b, strict=True)) < 0.0, "a mirror image"
