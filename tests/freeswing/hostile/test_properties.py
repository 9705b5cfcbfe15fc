"""What must not matter: the order of columns and markers, the unit of length, separators."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from freeswing.calib.verdict.plumb_line_file import read_plumb_line
from freeswing.cdpr.files.drive_csv import read_drive_run, run_columns
from freeswing.cdpr.files.mocap.text_exports import read_mocap_text
from freeswing.cdpr.files.signal_csv import read_signals
from freeswing.cdpr.files.trajectory_c3d import read_c3d, write_c3d
from freeswing.cdpr.files.trajectory_files import read_trajectory, write_csv
from freeswing.cdpr.files.trajectory_trc import read_trc, write_trc
from freeswing.cdpr.measured.marker_recording import MarkerRecording
from freeswing.cdpr.mesh.nominal_inertia import platform_from_mesh
from freeswing.homing.homing_files import read_homing
from freeswing.servo.files.wrench_file import COLUMNS, read_wrenches
from tests.freeswing.hostile.more_files import PLUMB
from tests.places import SAMPLES

FEW = settings(
    max_examples=12,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}


def head(name: str) -> list[list[str]]:
    """The first lines of a sample's table, as cells."""
    lines = (SAMPLES / name).read_text(encoding="utf-8").splitlines()[:25]
    return [line.split(",") for line in lines]


def rows_of(columns: tuple[str, ...], count: int) -> list[list[str]]:
    """A table of made-up numbers; quaternions are no turn."""
    rng = np.random.default_rng(2)
    rows = [[f"{value:.6f}" for value in rng.normal(size=len(columns))] for _ in range(count)]
    for k, row in enumerate(rows):
        for name, value in {
            "t_s": f"{k / 1000}",
            "qw": "1",
            "qx": "0",
            "qy": "0",
            "qz": "0",
        }.items():
            if name in columns:
                row[columns.index(name)] = value
    return [list(columns), *rows]


def free_table(folder: Path) -> list[list[str]]:
    """Free coordinates with deviations of their own."""
    motion = read_trajectory(SAMPLES / "two-cables/runs/swing-01.csv").take(np.arange(20))
    noise = np.tile(np.diag(np.arange(1.0, 7.0) ** 2 * 1e-8), (20, 1, 1))
    write_csv(folder / "made.csv", replace(motion, covariances=noise))
    return [line.split(",") for line in (folder / "made.csv").read_text().splitlines()]


def plain(found: object) -> list[np.ndarray]:
    """All numbers of a result."""
    if isinstance(found, np.ndarray):
        return [found]
    if isinstance(found, dict):
        return [part for key in sorted(found) for part in plain(found[key])]
    if isinstance(found, tuple | list):
        return [part for one in found for part in plain(one)]
    if hasattr(found, "__dataclass_fields__"):
        return [part for name in found.__dataclass_fields__ for part in plain(getattr(found, name))]
    return []


TABLES = {
    "poses": (free_table, read_trajectory),
    "signals": (lambda folder: head("two-cables/runs/swing-01.csv"), read_signals),
    "driven run": (
        lambda folder: rows_of(run_columns(3), 12),
        lambda path: read_drive_run(path, 3),
    ),
    "wrenches": (
        lambda folder: [list(COLUMNS), *[row for row in rows_of(COLUMNS, 4)[1:]]],
        lambda path: read_wrenches(path, np.full(3, 9.0), 1e3),
    ),
    "plumb line": (
        lambda folder: [line.split(",") for line in PLUMB.splitlines()],
        lambda path: read_plumb_line(path, ("left", "right")),
    ),
    "homing": (
        lambda folder: head("homing/readings.csv"),
        lambda path: read_homing(path.with_name("homing.toml")),
    ),
}


@pytest.mark.parametrize("kind", TABLES)
def test_the_order_of_columns_does_not_matter(kind: str, tmp_path: Path) -> None:
    make, read = TABLES[kind]
    cells = make(tmp_path)
    for name in ("robot.toml", "homing.toml"):
        shutil.copy(SAMPLES / "homing" / name, tmp_path / name)
    path = tmp_path / "readings.csv"

    def read_in_order(order: list[int], separator: str) -> list[np.ndarray]:
        comma = "," if separator == ";" else "."
        lines = [
            separator.join(row[k].replace(".", comma) if n else row[k] for k in order)
            for n, row in enumerate(cells)
        ]
        path.write_text("\n".join([*lines, ""]), encoding="utf-8")
        return plain(read(path))

    whole = read_in_order(list(range(len(cells[0]))), ",")
    assert len(whole) > 0

    @FEW
    @given(st.permutations(range(len(cells[0]))), st.sampled_from([",", ";"]))
    def shuffled(order: list[int], separator: str) -> None:
        found = read_in_order(order, separator)
        assert len(found) == len(whole)
        for one, other in zip(whole, found, strict=True):
            np.testing.assert_array_equal(one, other)

    shuffled()


def recording(seed: int) -> MarkerRecording:
    """Markers of four names; one is hidden for a while."""
    positions = np.random.default_rng(seed).normal(size=(20, 4, 3))
    positions[5:8, 2] = np.nan
    return MarkerRecording(np.arange(20) / 100.0, ("a", "b", "c", "d"), positions)


FORMATS = {
    "trc": (write_trc, read_trc, 1e-12),
    "c3d": (write_c3d, read_c3d, 2e-7),  # of single precision
}


@pytest.mark.parametrize("kind", FORMATS)
def test_neither_unit_nor_order_of_markers_matters(kind: str, tmp_path: Path) -> None:
    write, read, rounding = FORMATS[kind]
    whole = recording(1)

    @FEW
    @given(st.permutations(range(4)), st.sampled_from(sorted(METRES)))
    def written(order: list[int], unit: str) -> None:
        names = tuple(whole.names[k] for k in order)
        shuffled = MarkerRecording(whole.times_s, names, whole.positions_m[:, order])
        write(tmp_path / f"a.{kind}", shuffled, unit)
        found = read(tmp_path / f"a.{kind}").select(whole.names)
        np.testing.assert_allclose(found.positions_m, whole.positions_m, rtol=rounding, atol=1e-12)
        np.testing.assert_allclose(found.times_s, whole.times_s, atol=1e-9)

    written()


UNITS = {"Meters": 1.0, "Centimeters": 1e-2, "Millimeters": 1e-3}


@FEW
@given(st.permutations(range(3)), st.sampled_from(sorted(UNITS)))
def test_the_same_of_motive(tmp_path: Path, order: list[int], unit: str) -> None:
    positions = np.random.default_rng(4).normal(size=(10, 3, 3))
    names = [f"body:{name}" for name in ("m1", "m2", "m3")]
    told = positions[:, order].reshape(10, 9) / UNITS[unit]
    lines = [
        f"Format Version,1.23,Capture Frame Rate,100,Export Frame Rate,100,Length Units,{unit}",
        "",
        ",Type" + 9 * ",Marker",
        ",Name," + ",".join(names[k] for k in order for _ in range(3)),
        ",ID" + 9 * ",A",
        ",," + ",".join(9 * ["Position"]),
        "Frame,Time (Seconds)," + ",".join(3 * ["X", "Y", "Z"]),
        *(f"{k},{k / 100}," + ",".join(map(repr, row.tolist())) for k, row in enumerate(told)),
    ]
    (tmp_path / "take.csv").write_text("\n".join([*lines, ""]), encoding="utf-8")
    found = read_mocap_text(tmp_path / "take.csv")
    assert found is not None
    for k, name in enumerate(names):
        place = found.names.index(name)
        np.testing.assert_allclose(found.positions_m[:, place], positions[:, k], rtol=1e-12)


@FEW
@given(
    st.sampled_from(["mm", "cm", "in", "m"]),
    st.sampled_from(["stl", "ply", "obj", "off"]),
    st.tuples(*[st.floats(0.05, 0.8)] * 3),
)
def test_the_unit_of_a_mesh(tmp_path: Path, unit: str, kind: str, sides: tuple) -> None:
    """A box: its inertia over its mass is known."""
    metres = {"mm": 1e-3, "cm": 1e-2, "in": 0.0254, "m": 1.0}[unit]
    box = trimesh.creation.box(np.array(sides) / metres)
    data = box.export(file_type=kind)
    path = tmp_path / f"body.{kind}"
    path.write_bytes(data.encode() if isinstance(data, str) else data)
    found = platform_from_mesh(path, unit)
    squares = np.array(sides) ** 2
    expected = (squares.sum() - squares) / 12.0
    assert found.specific_inertia_m2 is not None
    np.testing.assert_allclose(found.specific_inertia_m2[:3], expected, rtol=1e-5)
