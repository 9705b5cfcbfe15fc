"""Each input format under what must not matter to it: order of keys, columns, cameras; frames.

Units, markers and separators: `test_properties`. The table says which property holds which reader.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from freeswing.calib import exchange
from freeswing.calib.board.recordings import Recording
from freeswing.calib.footage.frame_times import frame_times
from freeswing.cdpr.files.documents import dump_toml
from freeswing.cdpr.files.drive_csv import read_static, static_columns
from freeswing.cdpr.files.robot_file import read_robot
from freeswing.cdpr.files.trajectory_csv import write_csv
from freeswing.cdpr.files.trajectory_files import (
    read_recording,
    read_trajectory,
    write_c3d,
    write_trc,
    write_tum,
)
from freeswing.cdpr.measured.target import read_target
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.mesh.nominal_inertia import platform_from_mesh
from freeswing.cdpr.robot import Array
from freeswing.cdpr.rotation import exp_rotation
from tests.freeswing.hostile.more_files import more_cases
from tests.freeswing.hostile.test_properties import FEW, plain, rows_of
from tests.freeswing.hostile.text_files import Case, cameras, text_cases
from tests.places import SAMPLES

KEYS = "test_the_order_of_keys_does_not_matter"
COLUMNS = "test_the_order_of_columns_does_not_matter"
MARKERS = "test_neither_unit_nor_order_of_markers_matters"
CAMERAS = "test_the_order_of_cameras_does_not_matter"
TURNED = "test_poses_turn_with_their_frame"
FRAMELESS = "frames of a film: no axes, columns or units"
OWN = "written and read by this program alone, as it is"

# By the first words of a case's name; the longest that fits counts.
HELD_BY = {
    "robot": KEYS, "target": KEYS, "homing": KEYS, "cameras": KEYS, "session": KEYS,
    "drive.toml": KEYS, "driven robot": KEYS, "task": KEYS, "weights": KEYS, "controller": KEYS,
    "result": KEYS, "compared": KEYS, "covariance": KEYS,
    "readings": COLUMNS, "signals": COLUMNS, "drive run": COLUMNS, "wrenches": COLUMNS,
    "plumb line": COLUMNS, "free coordinates": COLUMNS, "csv": COLUMNS,
    "stamps": "test_columns_of_stamps", "drive static": "test_columns_of_static_poses",
    "trc": MARKERS, "c3d": MARKERS,
    "export motive": "test_the_same_of_motive",
    "export vicon": "test_the_order_of_markers_in_exports",
    "export qtm": "test_the_order_of_markers_in_exports",
    "export body": "columns are told by a row of names that tests/cdpr/files shuffles",
    "tum": TURNED,
    "opencv": CAMERAS, "kalibr": CAMERAS, "anipose": CAMERAS, "qualisys": CAMERAS,
    "colmap": CAMERAS, "ros": "one camera a file",
    "mesh": "test_a_mesh_turns_with_its_inertia",
    "board": "kinds with numbers only",
    "video": FRAMELESS, "image": FRAMELESS, "piece": OWN,
}  # fmt: skip


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Case]:
    folder = tmp_path_factory.mktemp("cases")
    return {**text_cases(folder), **more_cases(folder)}


def test_every_reader_has_its_property(cases: dict[str, Case]) -> None:
    here = Path(__file__)
    text = here.read_text("utf-8") + (here.parent / "test_properties.py").read_text("utf-8")
    for name in cases:
        assert any(name.startswith(key) for key in HELD_BY), name
    for held in HELD_BY.values():
        assert not held.startswith("test_") or f"def {held}(" in text, held


def shuffled(value: Any, chance: Random) -> Any:
    """The same document, the keys of each table in another order.

    But for [shape], whose order is that in which its numbers are told.
    """
    if isinstance(value, dict):
        keys = list(value)
        chance.shuffle(keys)
        return {k: value[k] if k == "shape" else shuffled(value[k], chance) for k in keys}
    return [shuffled(one, chance) for one in value] if isinstance(value, list) else value


DOCUMENTS = ["robot", "target", "homing", "cameras", "session filmed", "session two-cables"]
DOCUMENTS += ["driven robot", "task", "weights", "controller"]


@pytest.mark.parametrize("name", DOCUMENTS)
def test_the_order_of_keys_does_not_matter(
    name: str, cases: dict[str, Case], tmp_path: Path
) -> None:
    case = cases[name]
    is_json = case.name.endswith(".json")
    document = json.loads(case.data) if is_json else tomllib.loads(case.data.decode())
    whole = case.read(case.laid(tmp_path / "a", case.data))

    @FEW
    @given(st.integers(0, 10**6))
    def in_order(seed: int) -> None:
        told = shuffled(document, Random(seed))
        path = case.laid(tmp_path / "a", b"")
        if is_json:
            path.write_text(json.dumps(told), encoding="utf-8")
        else:
            dump_toml(path, told)
        found = case.read(path)
        assert repr(found) == repr(whole)
        for one, other in zip(plain(found), plain(whole), strict=True):
            np.testing.assert_array_equal(one, other)

    in_order()


@FEW
@given(st.permutations(range(3)))
def test_columns_of_stamps(tmp_path: Path, order: list[int]) -> None:
    rows = [["frame", "t_s", "note"], *[[str(k), f"{k / 40:.3f}", "7"] for k in range(30)]]
    text = "\n".join(",".join(row[k] for k in order) for row in rows)
    (tmp_path / "cam0.csv").write_text(text + "\n", encoding="utf-8")
    files = tuple(tmp_path / f"{k:06}.png" for k in range(30))
    recording = Recording("cam0", tmp_path / "cam0", files, tuple(range(30)))
    assert frame_times(recording, None).stamps == {k: round(k / 40, 3) for k in range(30)}


@FEW
@given(st.permutations(range(len(static_columns(3)))))
def test_columns_of_static_poses(tmp_path: Path, order: list[int]) -> None:
    rows = rows_of(static_columns(3), 5)
    for name, taken in (("a.csv", range(len(order))), ("b.csv", order)):
        text = "\n".join(",".join(row[k] for k in taken) for row in rows)
        (tmp_path / name).write_text(text + "\n", encoding="utf-8")
    whole, found = (read_static(tmp_path / name, 3) for name in ("a.csv", "b.csv"))
    for one, other in zip(whole, found, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("kind", ["vicon", "qtm"])
def test_the_order_of_markers_in_exports(kind: str, tmp_path: Path) -> None:
    positions = np.random.default_rng(4).normal(size=(10, 3, 3)).round(6)

    @FEW
    @given(st.permutations(range(3)))
    def written(order: list[int]) -> None:
        names, told = [f"m{k}" for k in order], 1e3 * positions[:, order].reshape(10, 9)
        numbers = [[f"{value:.4f}" for value in row] for row in told]
        if kind == "vicon":
            lines = [["Trajectories"], ["100"], ["", "", *[c for n in names for c in (n, "", "")]]]
            lines += [["Frame", "Sub Frame", *"XYZ" * 3], ["", "", *["mm"] * 9]]
            lines += [[str(k + 1), "0", *row] for k, row in enumerate(numbers)]
            path, text = tmp_path / "a.csv", "\n".join(",".join(line) for line in lines) + "\n"
        else:
            head = "NO_OF_FRAMES\t10\nNO_OF_MARKERS\t3\nFREQUENCY\t100\nDATA_INCLUDED\t3D\n"
            head += "MARKER_NAMES\t" + "\t".join(names) + "\n"
            path, text = tmp_path / "a.tsv", head + "\n".join("\t".join(r) for r in numbers) + "\n"
        path.write_text(text, encoding="utf-8")
        found = read_recording(path)
        for k in range(3):
            place = found.names.index(f"m{k}")
            np.testing.assert_allclose(found.positions_m[:, place], positions[:, k], atol=1e-9)

    written()


EXCHANGED = {
    "opencv": "rig.yml", "kalibr": "chain.yaml", "anipose": "anipose.toml",
    "qualisys": "rig.qca.txt", "colmap": "model",
}  # fmt: skip


@pytest.mark.parametrize("kind", EXCHANGED)
def test_the_order_of_cameras_does_not_matter(kind: str, tmp_path: Path) -> None:
    """Of each camera by its name: lens, and where it is from the first."""
    made = tuple(
        replace(c, name=f"cam{k}", T_camera_base=turned_camera(c.T_camera_base, k))
        for k, c in enumerate(cameras(3))
    )
    path = tmp_path / EXCHANGED[kind]

    def read_in_order(order: list[int]) -> dict[str, Any]:
        exchange.write(path, tuple(made[k] for k in order), kind)
        return {camera.name: camera for camera in exchange.read(path, kind)}

    whole = read_in_order([0, 1, 2])
    assert sorted(whole) == ["cam0", "cam1", "cam2"]

    @FEW
    @given(st.permutations(range(3)))
    def in_order(order: list[int]) -> None:
        found = read_in_order(order)
        assert sorted(found) == sorted(whole)
        for name, camera in whole.items():
            np.testing.assert_allclose(found[name].params, camera.params, rtol=1e-9)
            apart = [
                one[name].T_camera_base @ np.linalg.inv(one["cam0"].T_camera_base)
                for one in (whole, found)
            ]
            np.testing.assert_allclose(apart[1], apart[0], atol=1e-6)

    in_order()


def turned_camera(T: Array, k: int) -> Array:
    """Another place for each."""
    moved = np.eye(4)
    moved[:3, :3], moved[:3, 3] = exp_rotation([0.0, 0.3 * k, 0.0]), [0.5 * k, 0.0, 0.1 * k]
    return moved @ T


@dataclass(frozen=True)
class Motions:
    """How a motion is written in a format and read back.

    Attributes:
        name: of the file.
        write: a motion in a frame turned by R, t.
        rounding: of the format's numbers, m and rad.
    """

    name: str
    write: Callable[[Path, Array, Array], None]
    rounding: float


POSES = read_trajectory(SAMPLES / "two-cables/runs/swing-01.csv").take(np.arange(20))
RECORDED = read_recording(SAMPLES / "mocap-trc/runs/swing-01.trc")
FIRST = replace(RECORDED, times_s=RECORDED.times_s[:20], positions_m=RECORDED.positions_m[:20])


def turned_poses(R: Array, t: Array) -> Trajectory:
    positions, rotations = POSES.positions() @ R.T + t, R @ POSES.rotations()
    return Trajectory.from_poses(POSES.times_s, positions, rotations)


MOTIONS = {
    "csv": Motions("a.csv", lambda p, R, t: write_csv(p, turned_poses(R, t)), 1e-12),
    "tum": Motions("a.tum", lambda p, R, t: write_tum(p, turned_poses(R, t)), 1e-8),
    "trc": Motions(
        "a.trc",
        lambda p, R, t: write_trc(p, replace(FIRST, positions_m=FIRST.positions_m @ R.T + t)),
        1e-9,
    ),
    "c3d": Motions(
        "a.c3d",
        lambda p, R, t: write_c3d(p, replace(FIRST, positions_m=FIRST.positions_m @ R.T + t)),
        5e-6,  # of single precision over the markers' distances
    ),
}


@pytest.mark.parametrize("kind", MOTIONS)
def test_poses_turn_with_their_frame(kind: str, tmp_path: Path) -> None:
    """Poses and their covariances, from poses or from markers by a rigid fit."""
    motions, path = MOTIONS[kind], tmp_path / MOTIONS[kind].name
    robot = read_robot(SAMPLES / "mocap-trc/robot.toml")
    target = read_target(SAMPLES / "mocap-trc/target.toml")

    def read_turned(R: Array, t: Array) -> Trajectory:
        motions.write(path, R, t)
        return read_trajectory(path, robot, target)

    whole = read_turned(np.eye(3), np.zeros(3))
    assert whole.is_known.sum() > 10

    @FEW
    @given(st.tuples(*[st.floats(-3.1, 3.1)] * 3), st.tuples(*[st.floats(-5.0, 5.0)] * 3))
    def turned(rotvec: tuple, shift: tuple) -> None:
        R, t = exp_rotation(np.array(rotvec)), np.array(shift)
        found = read_turned(R, t)
        limit = motions.rounding
        np.testing.assert_allclose(found.positions(), whole.positions() @ R.T + t, atol=limit)
        np.testing.assert_allclose(found.rotations(), R @ whole.rotations(), atol=limit)
        assert (found.covariances is None) == (whole.covariances is None)
        if whole.covariances is not None and kind == "trc":
            both = np.kron(np.eye(2), R)
            expected = both @ whole.covariances @ both.T
            size = np.abs(expected[np.isfinite(expected)]).max()
            np.testing.assert_allclose(found.covariances, expected, atol=1e-4 * size)

    turned()


@FEW
@given(
    st.sampled_from(["stl", "ply", "obj", "off"]),
    st.tuples(*[st.floats(-3.1, 3.1)] * 3),
    st.tuples(*[st.floats(-0.2, 0.2)] * 3),
)
def test_a_mesh_turns_with_its_inertia(tmp_path: Path, kind: str, turn: tuple, at: tuple) -> None:
    """A box about the platform's origin; single precision and OFF's digits round it."""
    sides, R, com = np.array([0.4, 0.3, 0.2]), exp_rotation(np.array(turn)), np.array(at)
    box = trimesh.creation.box(sides)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, com
    box.apply_transform(T)
    data = box.export(file_type=kind)
    path = tmp_path / f"body.{kind}"
    path.write_bytes(data.encode() if isinstance(data, str) else data)
    found = platform_from_mesh(path, "m")
    squares = sides**2
    tensor = R @ np.diag((squares.sum() - squares) / 12.0) @ R.T
    tensor += com @ com * np.eye(3) - np.outer(com, com)
    assert found.com_m is not None
    assert found.specific_inertia_m2 is not None
    np.testing.assert_allclose(found.com_m, com, atol=1e-6)
    flat = tensor[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    np.testing.assert_allclose(found.specific_inertia_m2, flat, atol=1e-6)
