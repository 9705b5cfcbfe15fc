"""Exports of Motive, Vicon and Qualisys, written by hand as those programs write them."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from freeswing.cdpr.files.problems import InputError
from freeswing.cdpr.files.trajectory_files import (
    holds_markers,
    read_recording,
    read_trajectory,
    write_c3d,
)
from freeswing.cdpr.measured.marker_recording import MarkerRecording

PLACES = np.array([[[1.1, 0.2, -0.3], [0.9, 0.1, -0.4], [1.3, 0.4, -0.2]], [[1.2, 0.2, -0.3]] * 3])
PLACES[1] += [[0, 0, 0], [0.1, 0.1, 0], [0.2, 0, 0.1]]


def cells(values, scale=1.0, blank=""):
    return [blank if np.isnan(v) else f"{v * scale:.4f}" for v in np.ravel(values)]


def motive(body="", kind="Marker"):
    names = ["Rig:P", "Rig:A", "Rig:B"]
    head = "Format Version,1.23,Take Name,T,Export Frame Rate,120.000000,Rotation Type,Quaternion"
    head += ",Length Units,Meters"
    types = ["", "Type", *[kind] * 9]
    labels = ["", "Name", *[n for n in names for _ in range(3)]]
    ids = ["", "ID", *["1"] * 9]
    kinds = ["", "", *["Position"] * 9]
    axes = ["Frame", "Time (Seconds)", *"XYZ" * 3]
    rows = [[str(k), f"{k / 120:.6f}", *cells(p)] for k, p in enumerate(PLACES)]
    return "\n".join([head, "", *(",".join(r) for r in (types, labels, ids, kinds, axes, *rows))])


def vicon(separator=","):
    axes = ["Frame", "Sub Frame", *"XYZ" * 3]
    rows = [[str(k + 1), "0", *cells(p, 1e3)] for k, p in enumerate(PLACES)]
    lines = [
        ["Trajectories"],
        ["120"],
        ["", "", "Rig:P", "", "", "Rig:A", "", "", "Rig:B", "", ""],
        axes,
        ["", "", *["mm"] * 9],
        *rows,
    ]
    text = "\n".join(separator.join(line) for line in lines)
    if separator == ";":
        text = text.replace(".", ",")
    return text + "\n\nModel Outputs\n120\n"


def qualisys(with_time=True):
    head = (
        "NO_OF_FRAMES\t2\nNO_OF_CAMERAS\t8\nNO_OF_MARKERS\t3\nFREQUENCY\t120\nDATA_INCLUDED\t3D\n"
    )
    head += "TIME_STAMP\t2020-05-01, 10:00:00\t100.1\nMARKER_NAMES\tP\tA\tB\n"
    rows = [cells(p, 1e3) for p in PLACES]
    if with_time:
        head += "Frame\tTime\t" + "\t".join(f"{n} {a}" for n in "PAB" for a in "XYZ") + "\n"
        rows = [[str(k + 1), f"{k / 120:.5f}", *row] for k, row in enumerate(rows)]
    return head + "\n".join("\t".join(row) for row in rows) + "\n"


EXPORTS = {
    "motive.csv": motive(),
    "vicon.csv": vicon(),
    "vicon_semicolon.csv": vicon(";"),
    "qtm.tsv": qualisys(),
    "qtm_bare.tsv": qualisys(with_time=False),
}


@pytest.mark.parametrize("name", EXPORTS)
def test_markers_of_each_program_are_read_in_metres_and_seconds(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_text(EXPORTS[name], encoding="utf-8")
    assert holds_markers(path)
    found = read_recording(path)
    assert np.abs(found.positions_m - PLACES).max() < 1e-6
    assert found.times_s == pytest.approx([0.0, 1 / 120], abs=1e-5)
    assert [found.column(n) for n in "PAB"] == [0, 1, 2]


@pytest.mark.parametrize("fill", ["", "0.0000", "9999999.0", "NaN"])
def test_gaps_are_gaps_however_they_are_written(tmp_path: Path, fill: str) -> None:
    text = motive()
    row = ",".join(cells(PLACES[1, 1]))
    assert row in text
    (tmp_path / "a.csv").write_text(text.replace(row, f"{fill},{fill},{fill}"), encoding="utf-8")
    found = read_recording(tmp_path / "a.csv")
    assert np.isnan(found.positions_m[1, 1]).all()
    assert np.isfinite(np.delete(found.positions_m.reshape(6, 3), 4, axis=0)).all()
    said = [note for note in found.notes if "is taken as a gap in 1 samples of Rig:A" in note]
    assert bool(said) == fill.startswith(("0", "9"))


def body():
    """A rigid body of Motive, two frames."""
    half = np.sqrt(0.5)
    head = motive().split("\n")[0].replace("120.0", "100.0")
    kinds = ["Rotation"] * 4 + ["Position"] * 3
    lines = [
        ["", "Type", *["Rigid Body"] * 7],
        ["", "Name", *["Platform"] * 7],
        ["", "", *kinds],
        ["Frame", "Time (Seconds)", *"XYZWXYZ"],
        ["0", "0.0", "0", "0", "0", "1", "1.0", "2.0", "3.0"],
        ["1", "0.01", "0", "0", str(half), str(half), "1.1", "2.0", "3.0"],
    ]
    return "\n".join([head, "", *(",".join(line) for line in lines)])


def test_a_rigid_body_of_motive_is_a_pose_with_the_quaternion_as_motive_writes_it(
    tmp_path: Path,
) -> None:
    path = tmp_path / "body.csv"
    path.write_text(body(), encoding="utf-8")
    assert not holds_markers(path)
    found = read_trajectory(path)
    wanted = [[1.0, 2.0, 3.0, 0, 0, 0], [1.1, 2.0, 3.0, 0, 0, np.pi / 2]]
    assert np.abs(found.values - wanted).max() < 1e-9
    path.write_text(path.read_text().replace("X,Y,Z,W,X,Y,Z", "X,Y,Z,,X,Y,Z"), encoding="utf-8")
    with pytest.raises(InputError, match="export with Rotation Type Quaternion"):
        read_trajectory(path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("Length Units,Meters", "Length Units,Furlongs", "its unit is 'Furlongs'"),
        ("120.000000", "fast", "the frame rate is 'fast'"),
        ("Rig:A", "Rig:P", "'Rig:P' stands twice"),
        ("Frame,Time", "Frames,Time", "no rows Type, Name, Frame"),
    ],
)
def test_what_is_wrong_in_an_export_is_named(tmp_path: Path, old, new, message) -> None:
    text = motive()
    assert old in text
    (tmp_path / "a.csv").write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(InputError, match=message):
        read_recording(tmp_path / "a.csv")


@pytest.mark.parametrize("name", EXPORTS)
@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_damaged_exports_are_read_or_refused(tmp_path_factory, name, data) -> None:
    content = bytearray(EXPORTS[name].encode())
    for _ in range(data.draw(st.integers(1, 5))):
        at = data.draw(st.integers(0, len(content) - 1))
        content[at] = data.draw(st.sampled_from([*b"0129-.,;\t\n e_Xx", 0, 1, 127, 128, 255]))
    end = data.draw(st.integers(0, len(content)) | st.just(len(content)))
    path = tmp_path_factory.mktemp("damaged") / name
    path.write_bytes(bytes(content[:end]))
    try:
        found = read_recording(path)
    except InputError:
        return
    assert found.positions_m.shape == (len(found.times_s), len(found.names), 3)


TRC = """PathFileType\t4\t(X/Y/Z)\ta.trc
DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits
{rate}\t{rate}\t4\t2\tmm
Frame#\tTime\tP\t\t\tA\t\t
\t\tX1\tY1\tZ1\tX2\tY2\tZ2

1\t0.00\t1.5\t2\t3\t4\t5\t6
2\t0.01\t1.6\t2\t3\t4\t5\t6
{third}\t0.02\t1.7\t2\t3\t4\t5\t6
4\t0.03\t1.8\t2\t3\t4\t5\t6
"""


@pytest.mark.parametrize(
    "text",
    [
        TRC.format(rate="100.00", third=3).replace(".", ","),
        TRC.format(rate="100.00", third=3).replace("\t", ","),
        TRC.format(rate="100.00", third=3).replace("\t\t\t", "\t").replace("\t", " "),
    ],
)
def test_trc_with_decimal_commas_with_commas_and_with_spaces(tmp_path: Path, text: str) -> None:
    (tmp_path / "a.trc").write_text(text, encoding="utf-8")
    found = read_recording(tmp_path / "a.trc")
    assert found.times_s == pytest.approx([0.0, 0.01, 0.02, 0.03])
    assert found.positions_m[:, 0, 0] == pytest.approx([1.5e-3, 1.6e-3, 1.7e-3, 1.8e-3])


def test_trc_frame_numbers_that_begin_again_are_said_and_the_times_used(tmp_path: Path) -> None:
    (tmp_path / "a.trc").write_text(TRC.format(rate=100, third=1), encoding="utf-8")
    found = read_recording(tmp_path / "a.trc")
    assert found.times_s == pytest.approx([0.0, 0.01, 0.02, 0.03])
    assert "begin again at line 9" in found.notes[0]


def long_trc(rate: float) -> str:
    lines = TRC.format(rate=rate, third=3).replace("\t4\t2\tmm", "\t400\t2\tmm").split("\n")[:6]
    rows = [f"{k + 1}\t{k / 100:.3f}\t{k}\t2\t3\t4\t5\t6" for k in range(400)]
    return "\n".join([*lines, *rows, ""])


def test_trc_rate_and_stamps_one_percent_apart_are_named_and_a_tenth_of_rounding_is_not(
    tmp_path: Path,
) -> None:
    (tmp_path / "a.trc").write_text(long_trc(101), encoding="utf-8")
    with pytest.raises(InputError, match="DataRate 101, but the Time column steps at 100 Hz"):
        read_recording(tmp_path / "a.trc")
    (tmp_path / "a.trc").write_text(long_trc(100.02), encoding="utf-8")
    assert len(read_recording(tmp_path / "a.trc").times_s) == 400


def c3d(tmp_path: Path) -> tuple[Path, bytearray]:
    rng = np.random.default_rng(0)
    points = rng.normal(size=(300, 3, 3))
    points[10, 1] = np.nan
    path = tmp_path / "a.c3d"
    write_c3d(path, MarkerRecording(np.arange(300) / 100.0, ("P", "A", "B"), points))
    return path, bytearray(path.read_bytes())


def test_c3d_writes_a_gap_as_residual_minus_one(tmp_path: Path) -> None:
    import ezc3d

    path, _ = c3d(tmp_path)
    residuals = ezc3d.c3d(str(path))["data"]["meta_points"]["residuals"][0]
    assert residuals[1, 10] == -1.0
    assert (np.delete(residuals.ravel(), 300 + 10) >= 0.0).all()
    assert np.isnan(read_recording(path).positions_m[10, 1]).all()


def test_c3d_counts_that_contradict_each_other_are_named(tmp_path: Path) -> None:
    path, content = c3d(tmp_path)
    content[8:10] = (1).to_bytes(2, "little")  # the header's last frame
    path.write_bytes(content)
    assert len(read_recording(path).times_s) == 300  # POINT:FRAMES and the length agree
    at = content.index(b"FRAMES")
    number = content.index(np.float32(300).tobytes(), at) if content[at + 8] == 4 else None
    place, new = (
        (number, np.float32(7).tobytes())
        if number
        else (
            content.index((300).to_bytes(2, "little"), at),
            (7).to_bytes(2, "little"),
        )
    )
    content[place : place + len(new)] = new
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"contradiction: .*header 1.*POINT:FRAMES 7.*holds 30"):
        read_recording(path)


def test_c3d_without_a_unit_or_without_points_is_named(tmp_path: Path) -> None:
    path, content = c3d(tmp_path)
    path.write_bytes(bytes(content).replace(b"UNITS", b"UNUTS", 1))
    with pytest.raises(InputError, match="states no unit"):
        read_recording(path)
    at = content.index(b"USED") + 4
    used = content.index((3).to_bytes(2, "little"), at + 3)
    content[used : used + 2] = b"\0\0"
    path.write_bytes(content)
    with pytest.raises(InputError, match="holds no points, analogue channels alone"):
        read_recording(path)
