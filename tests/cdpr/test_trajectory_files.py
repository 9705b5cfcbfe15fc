from pathlib import Path
from time import perf_counter

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cdpr.documents import DataError, InputError
from cdpr.marker_recording import MarkerRecording, marker_position, recording_from_poses
from cdpr.robot import Cable, Robot
from cdpr.robot_file import read_robot
from cdpr.target import Marker, Target, read_target
from cdpr.trajectory import Trajectory
from cdpr.trajectory_files import (
    read_recording,
    read_trajectory,
    write_c3d,
    write_csv,
    write_trc,
    write_tum,
)

BOLOGNA = Path(__file__).parents[3] / "shared" / "real" / "bologna-2020"
POSE = ("x", "y", "z", "phi", "theta", "chi")
POSITIONS = [[0, 0, 0], [-0.18, -0.15, 0.04], [0.19, -0.14, 0.04], [0.2, 0.14, 0.05]]
TARGET = Target(markers=tuple(Marker(n, p) for n, p in zip("PABC", POSITIONS, strict=True)))


def robot(free):
    cables = tuple(Cable(str(i), np.zeros(3), 0.0, np.zeros(3)) for i in range(4))
    return Robot("r", cables, free_coordinates=free)


def swing(coordinates=POSE, n=60, seed=0, with_noise=True, missing=True):
    rng = np.random.default_rng(seed)
    times = rng.uniform(-1, 1) + 0.01 * np.arange(n)
    rates = rng.uniform(3, 9, len(coordinates))
    values = 0.4 * rng.normal(size=len(coordinates)) + 0.5 * np.sin(np.outer(times, rates))
    roots = 1e-3 * rng.normal(size=(n, len(coordinates), len(coordinates)))
    covariances = roots @ roots.swapaxes(1, 2) if with_noise else None
    if missing:
        hidden = rng.random(n) < 0.2
        values[hidden] = np.nan
        covariances = (
            None if covariances is None else np.where(hidden[:, None, None], np.nan, covariances)
        )
    return Trajectory(times, coordinates, values, covariances, "test")


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


def read(tmp_path, text, name="a.csv", free=None):
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_trajectory(path, robot(free) if free is not None else None, TARGET)


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
        ("t_s,x_m,std_x_m\n0,1,-1\n", "line 2: std_x_m is -1, must be >= 0"),
        ("t_s,x_m,y_m,std_x_m,std_y_m,corr_x_y\n0,1,1,1,1,2\n", "corr_x_y is 2, must be -1 to 1"),
        (
            "t_s,x_m,y_m,z_m,qw,qx,qy,qz\n0,1,1,1,1,1,0,0\n",
            "line 2: the quaternion's length is 1.4",
        ),
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


def recording(seed=0, n=40, n_markers=5, first=0):
    rng = np.random.default_rng(seed)
    positions = rng.uniform(-3, 3, size=(n, n_markers, 3))
    positions[rng.random((n, n_markers)) < 0.3] = np.nan
    names = tuple(f"M {i}é" for i in range(n_markers))
    return MarkerRecording((first + np.arange(n)) / 100.0, names, positions, "a")


@pytest.mark.parametrize("unit", ["m", "cm", "mm"])
@given(seed=st.integers(0, 2**32 - 1))
def test_trc_round_trip(tmp_path_factory, unit, seed):
    made = recording(seed, n=1 + seed % 30, n_markers=1 + seed % 4)
    path = tmp_path_factory.mktemp("trc") / "a.trc"
    write_trc(path, made, unit)
    found = read_recording(path)
    assert found.names == made.names
    assert np.allclose(found.times_s, made.times_s, rtol=0, atol=1e-12)
    assert np.allclose(found.positions_m, made.positions_m, atol=1e-15, equal_nan=True)


@pytest.mark.parametrize("unit", ["m", "cm", "mm"])
@settings(max_examples=25)
@given(seed=st.integers(0, 2**32 - 1))
def test_c3d_round_trip_to_float32_and_as_ezc3d_reads(tmp_path_factory, unit, seed):
    import ezc3d

    made = recording(seed, n=2 + seed % 30, n_markers=1 + seed % 4, first=seed % 50)
    path = tmp_path_factory.mktemp("c3d") / "a.c3d"
    write_c3d(path, made, unit)
    found = read_recording(path)
    assert found.names == made.names
    assert np.allclose(found.times_s, made.times_s, rtol=0, atol=1e-9)
    assert np.allclose(found.positions_m, made.positions_m, rtol=1e-6, equal_nan=True)
    oracle = ezc3d.c3d(str(path))["data"]["points"][:3].transpose(2, 1, 0)
    scale = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}[unit]
    assert np.allclose(found.positions_m, scale * oracle, rtol=1e-12, equal_nan=True)


def test_c3d_as_integers_with_analogue_channels_and_lost_points(tmp_path):
    """Bytes laid out by hand from the format's guide: what ezc3d does not write."""

    def parameter(group, name, kind, dims, data):
        body = bytes([kind & 0xFF, len(dims), *dims]) + data + b"\0"
        head = bytes([len(name), group]) + name.encode()
        return head + (len(body) + 2).to_bytes(2, "little") + body

    def float32(value):
        return np.float32(value).tobytes()

    group = bytes([5, 0xFF]) + b"POINT" + (3).to_bytes(2, "little") + b"\0"
    parameters = group + b"".join(
        [
            parameter(1, "USED", 2, (), np.int16(2).tobytes()),
            parameter(1, "SCALE", 4, (), float32(0.1)),
            parameter(1, "RATE", 4, (), float32(50.0)),
            parameter(1, "LABELS", -1, (4, 2), b"P   A   "),
            parameter(1, "UNITS", -1, (2, 1), b"mm"),
        ]
    )
    block = (bytes([1, 0x50, 1, 84]) + parameters).ljust(512, b"\0")
    header = np.zeros(256, np.int16)
    header[:12] = [2 | 0x50 << 8, 2, 3, 11, 12, 0, 0, 0, 3, 0, 0, 0]
    frames = np.array(
        [[10, 20, 30, 1, 1, 2, 3, -1, 7, 7, 7], [40, 50, 60, 0, -10, 0, 5, 0, 7, 7, 7]], np.int16
    )
    path = tmp_path / "a.c3d"
    path.write_bytes(header.tobytes() + block + frames.tobytes())
    found = read_recording(path)
    nan = np.nan
    wanted = [[[1, 2, 3], [nan, nan, nan]], [[4, 5, 6], [-1, 0, 0.5]]]
    assert np.allclose(found.positions_m, 1e-3 * np.array(wanted), equal_nan=True)
    assert found.times_s.tolist() == [0.2, 0.22]
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(InputError, match="cut short"):
        read_recording(path)


def trc_text(tmp_path):
    write_trc(tmp_path / "a.trc", recording(n=20))
    return (tmp_path / "a.trc").read_text()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("PathFileType", "Path", "line 1: not a TRC file"),
        ("\tmm\t", "\tinch\t", "line 3: Units: 'inch' must be one of"),
        ("Units", "Unit", "line 2: Units: missing"),
        ("\t5\tmm", "\t6\tmm", "line 4: 5 labels .* NumMarkers is 6"),
        ("\t20\t5", "\t21\t5", "NumFrames is 21, but 20 rows follow"),
        ("\n100.0\t", "\n120.0\t", "line 3: DataRate 120, but the Time column steps at 100 Hz"),
        ("M 1", "M 0", "line 4: label 'M 0é' stands twice"),
        ("\n3\t0.02\t", "\n3\t0.01\t", "line 9: Time is 0.01 after 0.01"),
        ("\n3\t0.02\t", "\n3\t0.02\t1\t", "line 9: 18 columns, the header has 17"),
        ("\n3\t0.02\t", "\n3\tx\t", "line 9: Time is 'x', not a number"),
        ("\tTime", "\tTimes", "line 4: must start with Frame# and Time"),
    ],
)
def test_trc_mistakes_are_named(tmp_path, old, new, message):
    text = trc_text(tmp_path)
    assert old in text
    with pytest.raises(InputError, match=message):
        read(tmp_path, text.replace(old, new, 1), "a.trc")


def test_trc_with_stripped_row_ends_and_no_blank_line(tmp_path):
    path = tmp_path / "a.trc"
    made = recording(n=20)
    write_trc(path, made)
    lines = [line.rstrip() for line in path.read_text().split("\n") if line.strip()]
    path.write_text("\r\n".join(lines))
    found = read_recording(path)
    assert np.allclose(found.positions_m, made.positions_m, atol=1e-15, equal_nan=True)


def test_trc_times_rounded_for_print_are_put_back_on_the_grid(tmp_path):
    made = MarkerRecording(np.arange(500) / 240.0, ("P",), np.zeros((500, 1, 3)))
    write_trc(tmp_path / "a.trc", made)
    lines = (tmp_path / "a.trc").read_text().split("\n")
    rows = [line.split("\t") for line in lines[6:-1]]
    rounded = ["\t".join([r[0], f"{float(r[1]):.3f}", *r[2:]]) for r in rows]
    (tmp_path / "a.trc").write_text("\n".join([*lines[:6], *rounded]))
    error = np.abs(read_recording(tmp_path / "a.trc").times_s - made.times_s).max()
    assert error < 1e-8, error


@pytest.mark.parametrize("write", [write_trc, write_c3d])
def test_markers_give_the_poses_back(tmp_path, write):
    rest = swing(with_noise=False, missing=False)
    trajectory = Trajectory(0.01 * np.arange(60), POSE, rest.values)
    made = recording_from_poses(trajectory, TARGET)
    path = tmp_path / ("a.trc" if write is write_trc else "a.c3d")
    write(path, made)
    found = read_trajectory(path, robot(("x", "y")), TARGET)
    assert found.is_pose
    assert np.allclose(found.positions(), trajectory.positions(), atol=1e-6)
    assert np.allclose(found.rotations(), trajectory.rotations(), atol=1e-5)
    assert "rigid fit of 4 markers" in found.provenance


def test_the_reference_marker_alone_gives_the_free_coordinates(tmp_path):
    positions = np.random.default_rng(0).normal(size=(20, 1, 3))
    made = MarkerRecording(np.arange(20) / 50.0, ("robot:P",), positions)
    write_trc(tmp_path / "a.trc", made)
    found = read_trajectory(tmp_path / "a.trc", robot(("y", "x")), TARGET)
    assert found.coordinates == ("y", "x")
    assert np.allclose(found.values, positions[:, 0, [1, 0]], atol=1e-15)
    assert read_trajectory(tmp_path / "a.trc").coordinates == ("x", "y", "z")
    assert np.array_equal(marker_position(made), positions[:, 0])
    with pytest.raises(InputError, match="a pose needs 3"):
        read_trajectory(tmp_path / "a.trc", robot(("x", "phi")), TARGET)
    lost = MarkerRecording(made.times_s, ("Q",), positions)
    with pytest.raises(InputError, match="no marker 'P'"):
        marker_position(lost, TARGET)


def test_markers_never_seen_together_are_a_data_error(tmp_path):
    positions = np.full((20, 4, 3), np.nan)
    positions[:, 0] = 0.0
    made = MarkerRecording(np.arange(20) / 50.0, tuple("PABC"), positions)
    write_trc(tmp_path / "a.trc", made)
    with pytest.raises(DataError, match="at most 1 at once"):
        read_trajectory(tmp_path / "a.trc", None, TARGET)


def test_files_that_are_too_large_or_of_no_known_form_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"one of \.csv, \.trc"):
        read(tmp_path, "", "a.txt")
    for name in ("a.csv", "a.tum", "a.trc", "a.c3d"):
        with (tmp_path / name).open("wb") as file:
            file.truncate(2**40)
        with pytest.raises(InputError, match="more than the"):
            read_trajectory(tmp_path / name)


def survives(path):
    """Whether reading gives a trajectory or one of the two errors for users."""
    try:
        return len(read_trajectory(path, robot(("x", "y")), TARGET)) > 0
    except (InputError, DataError):
        return True


@pytest.mark.parametrize("name", ["a.csv", "a.tum", "a.trc", "a.c3d"])
@settings(max_examples=150, suppress_health_check=[HealthCheck.too_slow])
@given(data=st.data())
def test_damaged_files_read_or_are_refused(tmp_path_factory, name, data):
    path = tmp_path_factory.mktemp("damaged") / name
    made = MarkerRecording(
        np.arange(8) / 100.0, tuple("PABC"), recording(n=8, n_markers=4).positions_m
    )
    trajectory = swing(n=8)
    write = {"a.csv": write_csv, "a.tum": write_tum, "a.trc": write_trc, "a.c3d": write_c3d}[name]
    write(path, trajectory if name in ("a.csv", "a.tum") else made)
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 8))):
        at = data.draw(st.integers(0, len(content) - 1))
        content[at] = data.draw(st.sampled_from([*b"0129-.,;\t\n e_", 0, 1, 127, 128, 255]))
    end = data.draw(st.integers(0, len(content)) | st.just(len(content)))
    path.write_bytes(bytes(content[:end]))
    assert survives(path)


@pytest.mark.parametrize("name", ["a.csv", "a.tum", "a.trc", "a.c3d"])
@given(data=st.binary(max_size=300))
def test_any_bytes_read_or_are_refused(tmp_path_factory, name, data):
    path = tmp_path_factory.mktemp("any") / name
    path.write_bytes(data)
    assert survives(path)


@pytest.mark.skipif(not BOLOGNA.exists(), reason=f"the recorded session {BOLOGNA} is absent")
def test_recorded_runs_load_fast_and_fit_to_their_noise():
    target, geometry = read_target(BOLOGNA / "target.toml"), read_robot(BOLOGNA / "robot.toml")
    seconds = {}
    for path in sorted((BOLOGNA / "runs").glob("*.trc")):
        start = perf_counter()
        trajectory = read_trajectory(path, geometry, target)
        seconds[path.name] = perf_counter() - start
        assert trajectory.is_known.all(), path
        std = trajectory.standard_deviations()[:, :3].max()
        assert std < 1e-3, (path, std)
    assert len(seconds) == 36
    assert np.median(list(seconds.values())) < 0.3, seconds
