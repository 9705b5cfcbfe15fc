"""Motion-capture exports as programs write them, through `freeswing convert` and `check`.

One second of the sample's swing is written as Motive, Vicon, Qualisys and others do, by code of
this file; poses out of each must be those out of the plain file.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from freeswing.cdpr.files.trajectory_files import read_recording, read_trajectory
from freeswing.cdpr.measured.target import read_target
from freeswing.main import main
from tests.places import SAMPLES

SAMPLE = SAMPLES / "mocap-trc"
NAMES = ("P", "left", "front", "right")
RATE_HZ = 100
GAP = (40, 2)  # a sample and a marker


def swing() -> np.ndarray:
    """Positions in m, (100, 4, 3)."""
    return np.array(read_recording(SAMPLE / "runs" / "swing-01.trc").positions_m[:RATE_HZ])


def cells(points: np.ndarray, scale: float, gap: str = "") -> list[str]:
    digits = 6 if scale > 1.0 else 9
    values = [f"{scale * v:.{digits}f}" for v in points.ravel()]
    return [gap if "nan" in value else value for value in values]


def motive(points: np.ndarray, gap: str = "", names=NAMES, units: str = "Meters") -> str:
    head = f"Format Version,1.23,Take Name,T,Export Frame Rate,{RATE_HZ}.000000"
    head += f",Rotation Type,Quaternion,Length Units,{units}"
    rows = [
        ["", "Type", *["Marker"] * 3 * len(names)],
        ["", "Name", *[f"Rig:{name}" for name in names for _ in "XYZ"]],
        ["", "ID", *["1"] * 3 * len(names)],
        ["", "", *["Position"] * 3 * len(names)],
        ["Frame", "Time (Seconds)", *"XYZ" * len(names)],
    ]
    rows += [[str(k), f"{k / RATE_HZ:.6f}", *cells(p, 1.0, gap)] for k, p in enumerate(points)]
    return "\n".join([head, "", *map(",".join, rows)]) + "\n"


def unlabelled(points: np.ndarray) -> str:
    """Two more columns of what no label was given to, seen in half of the frames."""
    other = np.stack([points[:, 0] + 0.5, points[:, 1] - 0.3], axis=1)
    other[::2] = np.nan
    more = np.concatenate([points, other], axis=1)
    return motive(more, names=(*NAMES, "Unlabeled 1023", "Unlabeled 1024"))


def vicon(points: np.ndarray, separator: str = ",", names=NAMES) -> str:
    rows = [
        ["Trajectories"],
        [str(RATE_HZ)],
        ["", "", *[cell for name in names for cell in (f"rig:{name}", "", "")]],
        ["Frame", "Sub Frame", *"XYZ" * len(names)],
        ["", "", *["mm"] * 3 * len(names)],
        *([str(k + 1), "0", *cells(p, 1e3)] for k, p in enumerate(points)),
    ]
    text = "\n".join(separator.join(row) for row in rows) + "\n"
    return text.replace(".", ",") if separator == ";" else text


def qualisys(points: np.ndarray) -> str:
    head = f"NO_OF_FRAMES\t{len(points)}\nNO_OF_CAMERAS\t8\nNO_OF_MARKERS\t{len(NAMES)}\n"
    head += f"FREQUENCY\t{RATE_HZ}\nDATA_INCLUDED\t3D\nMARKER_NAMES\t" + "\t".join(NAMES) + "\n"
    columns = "\t".join(f"{name} {axis}" for name in NAMES for axis in "XYZ")
    rows = ["\t".join(["Frame", "Time"]) + "\t" + columns]
    rows += ["\t".join([str(k + 1), f"{k / RATE_HZ:.5f}", *cells(p, 1e3)])
             for k, p in enumerate(points)]  # fmt: skip
    return head + "\n".join(rows) + "\n"


def trc(points: np.ndarray, separator: str = "\t") -> str:
    top = ["PathFileType", "4", "(X/Y/Z)", "a.trc"]
    titles = ["DataRate", "CameraRate", "NumFrames", "NumMarkers", "Units"]
    values = [f"{RATE_HZ}.00", f"{RATE_HZ}.00", str(len(points)), str(len(NAMES)), "mm"]
    names = ["Frame#", "Time", *[cell for name in NAMES for cell in (name, "", "")]]
    axes = ["", "", *[f"{axis}{k + 1}" for k in range(len(NAMES)) for axis in "XYZ"]]
    rows = [[str(k + 1), f"{k / RATE_HZ:.2f}", *cells(p, 1e3)] for k, p in enumerate(points)]
    return "\n".join(separator.join(row) for row in (top, titles, values, names, axes, [], *rows))


EXPORTS: dict[str, tuple[str, Callable[[np.ndarray], str]]] = {
    "Motive": ("a.csv", motive),
    "Motive, labels in capitals": ("a.csv", lambda p: motive(p, names=[n.upper() for n in NAMES])),
    "Motive, unlabelled": ("a.csv", unlabelled),
    "Vicon": ("a.csv", vicon),
    "Vicon, decimal commas": ("a.csv", lambda p: vicon(p, ";")),
    "Qualisys": ("a.tsv", qualisys),
    "TRC": ("a.trc", trc),
    "TRC, commas": ("a.trc", lambda p: trc(p, ",")),
    "TRC, decimal commas": ("a.trc", lambda p: trc(p).replace(".", ",")),
    "TRC, spaces": ("a.trc", lambda p: trc(p).replace("\t\t\t", "\t").replace("\t", " ")),
}


def poses(folder: Path, name: str, text: str) -> tuple[np.ndarray, np.ndarray]:
    """Times and poses that the command makes of an export, (n,) and (n, 6)."""
    (folder / name).write_text(text, encoding="utf-8")
    result = folder / "poses.csv"
    target = str(SAMPLE / "target.toml")
    assert main(["convert", str(folder / name), str(result), "--target", target]) == 0
    found = read_trajectory(result)
    return found.times_s, found.values


@pytest.mark.parametrize("kind", EXPORTS)
def test_poses_of_every_export_are_those_of_the_plain_file(tmp_path: Path, kind: str) -> None:
    points = swing()
    _, wanted = poses(tmp_path, "plain.trc", trc(points))
    name, write = EXPORTS[kind]
    times, found = poses(tmp_path, name, write(points))
    np.testing.assert_allclose(times, np.arange(RATE_HZ) / RATE_HZ, atol=1e-5)
    assert np.abs(found - wanted).max() < 2e-8, np.abs(found - wanted).max()  # the print's digits


def placed_by_three(points: np.ndarray) -> np.ndarray:
    """The pose of one sample by the three markers that it shows, by scipy's rigid fit, (6,)."""
    stated = np.array([one.position_m for one in read_target(SAMPLE / "target.toml").markers])
    seen = np.isfinite(points[:, 0])
    a, b = stated[seen], points[seen]
    turn = Rotation.align_vectors(b - b.mean(axis=0), a - a.mean(axis=0))[0]
    place = b.mean(axis=0) - turn.apply(a.mean(axis=0))
    return np.concatenate([place, turn.as_euler("XYZ")])


@pytest.mark.parametrize("fill", ["", "0.000000000", "9999999.0", "NaN"])
def test_a_gap_stays_one_however_it_is_written(tmp_path: Path, fill: str) -> None:
    """The pose is that of the three markers that are left, not one that jumps."""
    points = swing()
    _, whole = poses(tmp_path, "whole.csv", motive(points))
    points[GAP] = np.nan
    _, found = poses(tmp_path, "a.csv", motive(points, fill))
    off = np.abs(found[GAP[0]] - placed_by_three(points[GAP[0]])).max()
    assert off < 5e-4, f"{off}: markers weigh by their noise here, alike there"
    assert np.abs(np.delete(found - whole, GAP[0], axis=0)).max() < 2e-5  # weights


def test_a_marker_file_becomes_another_one(tmp_path: Path) -> None:
    """What holds markers needs no target to be written as markers; a gap of C3D is residual -1."""
    import ezc3d

    points = swing()
    points[GAP] = np.nan
    (tmp_path / "a.tsv").write_text(qualisys(points), encoding="utf-8")
    assert main(["convert", str(tmp_path / "a.tsv"), str(tmp_path / "a.c3d")]) == 0
    residuals = ezc3d.c3d(str(tmp_path / "a.c3d"))["data"]["meta_points"]["residuals"][0]
    assert residuals[GAP[1], GAP[0]] == -1.0
    assert (np.delete(residuals.T.ravel(), GAP[0] * len(NAMES) + GAP[1]) >= 0.0).all()
    found = read_recording(tmp_path / "a.c3d").positions_m
    assert np.array_equal(np.isnan(found), np.isnan(points))
    assert np.nanmax(np.abs(found - points)) < 1e-6


def body_text() -> str:
    """A rigid body of Motive that turns by 90 degrees about z."""
    half = float(np.sqrt(0.5))
    rows = [
        motive(swing()).split("\n")[0],
        "",
        ",Type" + ",Rigid Body" * 7,
        ",Name" + ",Platform" * 7,
        "," + ",Rotation" * 4 + ",Position" * 3,
        "Frame,Time (Seconds),X,Y,Z,W,X,Y,Z",
        "0,0.0,0,0,0,1,1.0,2.0,3.0",
        f"1,0.01,0,0,{half},{half},1.1,2.0,3.0",
    ]
    return "\n".join(rows) + "\n"


def test_a_rigid_body_of_motive_is_a_pose(tmp_path: Path) -> None:
    (tmp_path / "body.csv").write_text(body_text(), encoding="utf-8")
    assert main(["convert", str(tmp_path / "body.csv"), str(tmp_path / "poses.csv")]) == 0
    found = read_trajectory(tmp_path / "poses.csv").values
    wanted = [[1.0, 2.0, 3.0, 0.0, 0.0, 0.0], [1.1, 2.0, 3.0, 0.0, 0.0, np.pi / 2.0]]
    assert np.abs(found - wanted).max() < 1e-9, found


def test_another_rotation_type_is_refused_by_name(tmp_path: Path, capsys) -> None:
    text = body_text().replace("X,Y,Z,W,X,Y,Z", "X,Y,Z,,X,Y,Z")
    (tmp_path / "body.csv").write_text(text, encoding="utf-8")
    assert main(["convert", str(tmp_path / "body.csv"), str(tmp_path / "poses.csv")]) == 2
    assert "export with Rotation Type Quaternion" in capsys.readouterr().err


def session(folder: Path, name: str, text: str) -> Path:
    """The sample with one run of such an export."""
    (folder / "runs").mkdir(parents=True)
    for file in ("robot.toml", "target.toml"):
        (folder / file).write_text((SAMPLE / file).read_text(encoding="utf-8"), encoding="utf-8")
    (folder / "runs" / name).write_text(text, encoding="utf-8")
    (folder / "session.toml").write_text(
        'format = "freeswing-session/1"\nname = "lab"\nrobot = "robot.toml"\n'
        f'target = "target.toml"\nframe_rate_hz = {RATE_HZ}.0\n[[runs]]\nname = "a"\n'
        f'role = "identify"\ntrajectory = "runs/{name}"\n',
        encoding="utf-8",
    )
    return folder


def test_millimetres_under_metres_are_named(tmp_path: Path, capsys) -> None:
    folder = session(tmp_path / "lab", "a.csv", motive(1e3 * swing()))
    assert main(["check", str(folder)]) == 1
    assert "1000 times as far apart as in target.toml: the unit" in capsys.readouterr().out
    command = ["convert", str(folder / "runs" / "a.csv"), str(tmp_path / "poses.csv")]
    for refused in (["identify", str(folder)], [*command, "--target", str(folder / "target.toml")]):
        assert main(refused) == 2
        assert "1000 times as far apart" in capsys.readouterr().err


@pytest.mark.parametrize(("rate", "status"), [("101.00", 2), ("100.02", 0)])
def test_a_stated_rate_one_percent_off_the_stamps_is_named(tmp_path, capsys, rate, status) -> None:
    text = trc(np.tile(swing(), (4, 1, 1))).replace("100.00\t100.00", f"{rate}\t{rate}")
    (tmp_path / "a.trc").write_text(text, encoding="utf-8")
    command = ["convert", str(tmp_path / "a.trc"), str(tmp_path / "b.csv")]
    assert main([*command, "--target", str(SAMPLE / "target.toml")]) == status
    assert ("the Time column steps at 100 Hz" in capsys.readouterr().err) == bool(status)


def c3d(folder: Path) -> Path:
    (folder / "a.trc").write_text(trc(np.tile(swing(), (3, 1, 1))), encoding="utf-8")
    assert main(["convert", str(folder / "a.trc"), str(folder / "a.c3d")]) == 0
    return folder / "a.c3d"


def overwritten(path: Path, at: int, old: bytes, new: bytes) -> None:
    content = bytearray(path.read_bytes())
    place = content.index(old, at)
    content[place : place + len(new)] = new
    path.write_bytes(content)


def test_c3d_counts_are_held_against_each_other(tmp_path: Path, capsys) -> None:
    """Header, POINT:FRAMES and the file's length: two that agree serve, three apart are refused."""
    path = c3d(tmp_path)
    target = str(SAMPLE / "target.toml")
    command = ["convert", str(path), str(tmp_path / "b.csv"), "--target", target]
    content = bytearray(path.read_bytes())
    content[8:10] = (1).to_bytes(2, "little")  # the header's last frame
    path.write_bytes(content)
    assert main(command) == 0
    assert len(read_trajectory(tmp_path / "b.csv").times_s) == 300
    at = content.index(b"FRAMES")
    old = np.float32(300).tobytes() if content[at + 8] == 4 else (300).to_bytes(2, "little")
    new = np.float32(7).tobytes() if content[at + 8] == 4 else (7).to_bytes(2, "little")
    overwritten(path, at, old, new)
    assert main(command) == 2
    said = capsys.readouterr().err
    assert "contradiction" in said, said
    assert "header 1" in said, said
    assert "POINT:FRAMES 7" in said, said


@pytest.mark.slow
def test_c3d_of_more_frames_than_its_numbers_can_count(tmp_path: Path, capsys) -> None:
    """70,000 frames as ezc3d writes them: all its counts end at 65,535, the length tells."""
    import ezc3d

    file = ezc3d.c3d()
    for key, value in (("UNITS", ["mm"]), ("RATE", [float(RATE_HZ)]), ("LABELS", list(NAMES))):
        file["parameters"]["POINT"][key]["value"] = value
    points = np.ones((4, len(NAMES), 70_000))
    points[:3] = 1e3 * np.moveaxis(np.tile(swing(), (700, 1, 1)), 0, 2).transpose(1, 0, 2)
    file["data"]["points"] = points
    file.write(str(tmp_path / "a.c3d"))
    target = str(SAMPLE / "target.toml")
    command = ["convert", str(tmp_path / "a.c3d"), str(tmp_path / "b.csv"), "--target", target]
    assert main(command) == 0
    found = read_trajectory(tmp_path / "b.csv")
    assert len(found.times_s) == 70_000
    assert np.isfinite(found.values).all()


def test_c3d_that_is_cut_short_is_refused_with_both_counts(tmp_path: Path, capsys) -> None:
    path = c3d(tmp_path)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    assert main(["convert", str(path), str(tmp_path / "b.trc")]) == 2
    said = capsys.readouterr().err
    assert "300 frames of 4 points need" in said, said
    assert f"the file has {len(content) // 2}: it is cut short" in said, said


def test_c3d_of_analogue_channels_alone_is_named(tmp_path: Path, capsys) -> None:
    path = c3d(tmp_path)
    at = path.read_bytes().index(b"USED") + 7
    overwritten(path, at, (4).to_bytes(2, "little"), b"\0\0")
    assert main(["convert", str(path), str(tmp_path / "b.trc")]) == 2
    assert "holds no points, analogue channels alone" in capsys.readouterr().err


@pytest.mark.parametrize("times", [2, 3])
def test_up_sampled_captures_are_told_and_thinned(tmp_path: Path, times: int) -> None:
    points = np.repeat(swing(), times, axis=0)[: RATE_HZ * 2]
    folder = session(tmp_path / "lab", "a.trc", trc(points))
    main(["check", str(folder), "--quiet"])
    found = json.loads((folder / "results" / "check.json").read_text(encoding="utf-8"))["findings"]
    said = " ".join(finding["text"] for finding in found)
    assert f"every sample stands {times} times" in said, said
