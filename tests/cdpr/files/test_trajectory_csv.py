import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from freeswing.cdpr.files.documents import InputError
from freeswing.cdpr.files.trajectory_files import read_trajectory, write_csv, write_tum
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.rotation import log_rotation, matrix_from_quaternion
from tests.cdpr.made_motions import POSE, read, swing


def assert_same(a, b, tolerance):
    assert a.coordinates == b.coordinates
    assert np.array_equal(a.times_s, b.times_s)
    assert np.allclose(a.values, b.values, rtol=0.0, atol=tolerance, equal_nan=True)
    assert (a.covariances is None) == (b.covariances is None)
    known = [np.zeros(1) if t.covariances is None else t.covariances for t in (a, b)]
    assert np.allclose(*known, rtol=1e-9, atol=1e-18, equal_nan=True)


@given(st.permutations(POSE), st.integers(1, 6), st.integers(0, 2**32 - 1), st.booleans())
def test_csv_round_trip(tmp_path_factory, order, count, seed, with_noise):
    coordinates = tuple(order[:count]) if count < 6 else POSE
    trajectory = swing(coordinates, 12, seed, with_noise)
    path = tmp_path_factory.mktemp("csv") / "a.csv"
    write_csv(path, trajectory)
    found = read_trajectory(path)
    turns = np.round((found.values - trajectory.values) / (2 * np.pi))
    whole = np.where(np.isnan(turns), 0.0, turns)[:, :] * 2 * np.pi
    shifted = Trajectory(found.times_s, found.coordinates, found.values - whole, found.covariances)
    assert_same(shifted, trajectory, 1e-13)


def test_csv_header_is_the_contract(tmp_path):
    write_csv(tmp_path / "p.csv", swing(with_noise=False))
    first = (tmp_path / "p.csv").read_text().split("\n")[0]
    assert first == "t_s,x_m,y_m,z_m,qw,qx,qy,qz"
    write_csv(tmp_path / "f.csv", swing(("x", "phi")))
    first = (tmp_path / "f.csv").read_text().split("\n")[0]
    assert first == "t_s,x_m,phi_rad,std_x_m,std_phi_rad,corr_x_phi"


def test_csv_takes_semicolons_decimal_commas_marks_and_empty_cells(tmp_path):
    plain = read(tmp_path, "t_s,x_m,y_m\n0,1.5,2\n\n0.01,,3\n0.02,1,nan\n")
    assert np.array_equal(plain.values, [[1.5, 2], [np.nan, 3], [1, np.nan]], equal_nan=True)
    for text in (
        "\ufefft_s;x_m;y_m\r\n0;1,5;2\r\n0,01;;3\r\n0,02;1;nan\r\n",
        't_s; "x_m" ;y_m;\r0;1.5;2;\r0.01;;3;\r0.02;1;NaN;\r',
    ):
        found = read(tmp_path, text)
        assert np.array_equal(found.values, plain.values, equal_nan=True), text
        assert np.array_equal(found.times_s, plain.times_s), text


def test_csv_follows_the_robot(tmp_path):
    text = "t_s,z_m,y_m,x_m\n0,3,2,1\n"
    assert read(tmp_path, text, free=("x", "y")).values.tolist() == [[1.0, 2.0]]
    assert read(tmp_path, text).coordinates == ("z", "y", "x")
    with pytest.raises(InputError, match=r"phi_rad missing; .* header t_s,x_m,phi_rad"):
        read(tmp_path, text, free=("x", "phi"))
    six = "t_s,chi_rad,theta_rad,phi_rad,z_m,y_m,x_m\n0,6,5,4,3,2,1\n"
    assert read(tmp_path, six, free=("x", "y")).values.tolist() == [[1, 2, 3, 4, 5, 6]]


def test_csv_noise_of_a_part_is_not_used(tmp_path):
    assert read(tmp_path, "t_s,x_m,y_m,std_x_m\n0,1,2,0.1\n").covariances is None
    both = read(tmp_path, "t_s,x_m,y_m,std_y_m,std_x_m\n0,1,2,0.2,0.1\n")
    assert np.allclose(both.covariances[0], np.diag([0.01, 0.04]))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "t_s: missing column"),
        ("t_s,x_m\n", "holds no sample"),
        ("t_s,x_mm\n0,1\n", "line 1: 'x_mm': unknown column"),
        ("t_s,x_m,x_m\n0,1,1\n", "2 columns of this name"),
        ("t_s,qw,qx\n0,1,1\n", "line 1: x_m: missing column"),
        ("t_s\n0\n", "no coordinate"),
        ("t_s,x_m\n0,1\n1,1,1\n", "line 3: 3 columns, the header has 2"),
        ("t_s,x_m\n0,0,1,5\n", "decimal commas"),
        ("t_s,x_m\n0,abc\n", "line 2: x_m is 'abc', not a number"),
        ("t_s,x_m\n0,inf\n", "line 2: x_m is inf"),
        ("t_s,x_m\n0,1e300\n", "line 2: x_m is 1e.300"),
        ("t_s,x_m\n0,1_0\n", "line 2: '0,1_0' is not"),
        ("t_s,x_m\n\n0,1\n0,2\n", "line 4: t_s is 0 after 0; times must increase"),
        ("t_s,x_m\n,1\n", "line 2: t_s is empty"),
        ("t_s,x_m,std_x_m\n0,1,-1\n", "line 2: std_x_m is -1, must be > 0"),
        ("t_s,x_m,y_m,std_x_m,std_y_m,corr_x_y\n0,1,1,1,1,2\n", "corr_x_y is 2, must be -1 to 1"),
        (
            "t_s,x_m,y_m,z_m,qw,qx,qy,qz\n0,1,1,1,1,1,0,0\n",
            "line 2: the quaternion's length is 1.4",
        ),
        ("t_s,x_m,std_x_m\n0,1,1\n1,1,\n", "line 3: std_x_m is empty, but the sample is not"),
        ("t_s,x_m,std_x_m\n0,1,1\n1,1,0\n", "line 3: std_x_m is 0, must be > 0"),
        (b"t_s,x_m\n0,\xff\n", "line 2: not UTF-8"),
    ],
)
def test_csv_mistakes_are_named(tmp_path, text, message):
    with pytest.raises(InputError, match=message) as caught:
        read(tmp_path, text)
    assert "a.csv" in str(caught.value)


@given(st.integers(0, 2**32 - 1))
def test_tum_round_trip_without_missing_samples(tmp_path_factory, seed):
    trajectory = swing(seed=seed, with_noise=False, missing=seed % 2 == 1)
    path = tmp_path_factory.mktemp("tum") / "a.tum"
    write_tum(path, trajectory)
    found, known = read_trajectory(path), trajectory.take(trajectory.is_known)
    assert np.array_equal(found.times_s, known.times_s)
    assert np.allclose(found.rotations(), known.rotations(), atol=1e-13)
    assert np.array_equal(found.positions(), known.positions())


def test_tum_order_is_x_y_z_w(tmp_path):
    found = read(tmp_path, "# t x y z qx qy qz qw\n1.5 1 2 3 0.6 0 0 0.8\n", "a.tum")
    assert found.values[0] == pytest.approx([1, 2, 3, 2 * np.arcsin(0.6), 0, 0])


def test_csv_noise_of_zero_throughout_is_unknown(tmp_path):
    assert read(tmp_path, "t_s,x_m,std_x_m\n0,1,0\n1,1,0\n").covariances is None


def test_csv_noise_of_quaternions_becomes_that_of_the_rotation_vector(tmp_path):
    rng, sigma, n = np.random.default_rng(0), 1e-3, 40_000
    q, std = np.array([0.5, -0.1, 0.7, 0.5]), sigma * np.array([1.0, 2.0, 0.5, 0.0])
    q /= np.linalg.norm(q)
    header = "t_s,x_m,y_m,z_m,qw,qx,qy,qz,std_x_m,std_y_m,std_z_m,std_qw,std_qx,std_qy,std_qz"
    row = ",".join(map(repr, [0.0, 1.0, 2.0, 3.0, *q.tolist(), 0.1, 0.2, 0.3, *std.tolist()]))
    told = read(tmp_path, f"{header}\n{row}\n").covariances[0]
    assert np.allclose(told[:3, :3], np.diag([0.01, 0.04, 0.09]))
    turned = matrix_from_quaternion(q + std * rng.normal(size=(n, 4)))
    seen = np.cov(log_rotation(turned @ matrix_from_quaternion(q).T).T)
    error = np.abs(seen - told[3:, 3:]).max()
    assert error < 6.0 * np.sqrt(2.0 / n) * seen.max(), (error, seen)
