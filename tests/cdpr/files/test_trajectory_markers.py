import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from freeswing.cdpr.files.documents import InputError
from freeswing.cdpr.files.trajectory_files import read_recording, write_c3d, write_trc
from freeswing.cdpr.measured.marker_recording import MarkerRecording
from tests.cdpr.made_motions import read, recording


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
