"""Two and three faults at once in a measured session: named, or used rightly."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from freeswing.cdpr.robot import INERTIA_NAMES
from freeswing.main import main
from tests.places import SAMPLES

Change = Callable[[int, np.ndarray], np.ndarray]
Fault = Callable[[Path], None]
Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # recorded = Y_UP @ base


def lab(folder: Path, *faults: Fault, sample: str = "two-cables") -> Path:
    shutil.copytree(SAMPLES / sample, folder, ignore=shutil.ignore_patterns("truth", "results"))
    for fault in faults:
        fault(folder)
    return folder


def runs(change: Change, only: tuple[str, ...] = ()) -> Fault:
    """Each run's table, t x y z and w x y z a row, through `change`."""

    def fault(folder: Path) -> None:
        for number, path in enumerate(sorted((folder / "runs").glob("*.csv"))):
            if only and path.stem not in only:
                continue
            head, *rows = path.read_text(encoding="utf-8").strip().split("\n")
            table = np.array([[float(cell) for cell in row.split(",")] for row in rows])
            made = change(number, table)
            text = "\n".join(",".join(repr(float(v)) for v in row) for row in made)
            path.write_text(f"{head}\n{text}\n", encoding="utf-8")

    return fault


def with_decimal_commas(folder: Path) -> None:
    for path in (folder / "runs").glob("*.csv"):
        text = path.read_text(encoding="utf-8")
        path.write_text(text.replace(",", ";").replace(".", ","), encoding="utf-8")


def in_unit(metres: float) -> Change:
    return lambda _, table: table * np.array([1.0, *[1.0 / metres] * 3, *[1.0] * 4])


def y_up(_: int, table: np.ndarray) -> np.ndarray:
    turned = Rotation.from_matrix(Y_UP) * Rotation.from_quat(table[:, [5, 6, 7, 4]])
    return np.column_stack([table[:, 0], table[:, 1:4] @ Y_UP.T, turned.as_quat()[:, [3, 0, 1, 2]]])


def x_y_z_w(_: int, table: np.ndarray) -> np.ndarray:
    return table[:, [0, 1, 2, 3, 5, 6, 7, 4]]


def inverse(_: int, table: np.ndarray) -> np.ndarray:
    return table * np.array([1.0] * 5 + [-1.0] * 3)


def left_handed(_: int, table: np.ndarray) -> np.ndarray:
    return table * np.array([1.0, 1.0, -1.0, 1.0, 1.0, -1.0, 1.0, -1.0])


def dropped(share: float, *, counted_on: bool = False) -> Change:
    def change(number: int, table: np.ndarray) -> np.ndarray:
        keep = np.random.default_rng(50 + number).random(len(table)) >= share
        keep[0] = True
        made = table[keep]
        if counted_on:
            made[:, 0] = table[: len(made), 0]
        return made

    return change


def every_eighth_again(_: int, table: np.ndarray) -> np.ndarray:
    made = table.copy()
    made[8::8, 1:] = table[7:-1:8, 1:]
    return made


def drawn_twice_as_often(_: int, table: np.ndarray) -> np.ndarray:
    at = np.arange(2 * len(table) - 1) / 2.0
    return np.stack([np.interp(at, np.arange(len(table)), c) for c in table.T], axis=1)


def origin_in_gaps(number: int, table: np.ndarray) -> np.ndarray:
    rng = np.random.default_rng(number)
    for first in rng.choice(len(table) - 40, 4, replace=False):
        table[first : first + rng.integers(6, 15), 1:] = [0, 0, 0, 1, 0, 0, 0]
    return table


def zeros_in_gaps(number: int, table: np.ndarray) -> np.ndarray:
    rng = np.random.default_rng(number)
    for first in rng.choice(len(table) - 40, 4, replace=False):
        table[first : first + rng.integers(6, 15), 1:] = 0.0
    return table


def times(factor: float) -> Change:
    return lambda _, table: table * np.array([factor] + [1.0] * 7)


def attachments_exchanged(folder: Path) -> None:
    path = folder / "robot.toml"
    text = path.read_text(encoding="utf-8")
    first, second = re.findall(r"attachment_m = .*", text)[:2]
    text = text.replace(first, "@").replace(second, first).replace("@", second)
    path.write_text(text, encoding="utf-8")


def lengths_exchanged(folder: Path) -> None:
    path = folder / "session.toml"
    text = path.read_text(encoding="utf-8")
    turned = re.sub(r"cable_lengths_m = \[(.*), (.*)\]", r"cable_lengths_m = [\2, \1]", text)
    path.write_text(turned, encoding="utf-8")


NAMED: dict[str, tuple[tuple[Fault, ...], tuple[str, ...]]] = {
    "millimetres, decimal commas": (
        (runs(in_unit(1e-3)), with_decimal_commas),
        ("run swing-01 (and 6 more runs): positions are in millimetres: cable lengths",),
    ),
    "one run in millimetres, dropped": (
        (runs(in_unit(1e-3), ("check-02",)), runs(dropped(0.05))),
        ("run check-02: positions are in millimetres: cable lengths",),
    ),
    "centimetres, y up, x y z w": (
        (runs(y_up), runs(in_unit(1e-2)), runs(x_y_z_w)),
        ("x y z w, positions are in centimetres, its axis y points up:", '[mocap] up = "y"'),
    ),
    "inches, inverse": (
        (runs(in_unit(0.0254)), runs(inverse)),
        ("of the base in the platform, positions are in inches:",),
    ),
    "millimetres, lengths exchanged": (
        (runs(in_unit(1e-3)), lengths_exchanged),
        ("positions are in millimetres: cable lengths",),
    ),
    "attachments exchanged, dropped": (
        (attachments_exchanged, runs(dropped(0.05))),
        ("robot.toml has attachment_m of cables left, right in each other's place",),
    ),
    "lost rows counted on, repeated": (
        (runs(dropped(0.05, counted_on=True)), runs(every_eighth_again)),
        ("rows were lost and the stamps counted on", "export the capture's own stamps"),
    ),
    "one per cent slow, dropped": (
        (runs(times(1.01)), runs(dropped(0.05))),
        ("samples come at 99.01 Hz, the session says 100 Hz", "frame_rate_hz or the time stamps"),
    ),
    "milliseconds, decimal commas": (
        (runs(times(1e3)), with_decimal_commas),
        ("swing-01.csv: its times step by 10 s", "as milliseconds that is 100 Hz"),
    ),
}


@pytest.mark.parametrize("name", NAMED)
def test_faults_together_are_named(tmp_path: Path, capsys, name: str) -> None:
    faults, words = NAMED[name]
    folder = lab(tmp_path / "lab", *faults)
    assert main(["identify", str(folder), "--quiet"]) != 0
    said = capsys.readouterr().err
    assert all(text in said for text in words), said
    assert not (folder / "results" / "identification.json").exists()
    assert main(["check", str(folder)]) == 1
    shown = capsys.readouterr().out
    assert all(words[0].rpartition("): ")[2].split(":")[0] in text for text in [shown]), shown


def test_left_handed_axes_are_named(tmp_path: Path, capsys) -> None:
    """Of three cables: what hangs on two looks the same in a mirror."""
    folder = lab(tmp_path / "lab", runs(left_handed), runs(dropped(0.05)), sample="three-cables")
    assert main(["identify", str(folder), "--quiet"]) == 1
    said = capsys.readouterr().err
    assert "its axes are left-handed: cable lengths are off by" in said, said
    assert "turn the signs of y_m, qx and qz" in said, said


USED: dict[str, tuple[tuple[Fault, ...], str]] = {
    "repeated, dropped": (
        (runs(every_eighth_again), runs(dropped(0.05))),
        "repeat the one before to the last digit",
    ),
    "repeated, drawn at twice the rate": (
        (runs(every_eighth_again), runs(drawn_twice_as_often)),
        "200 Hz interpolated from 100 Hz",
    ),
    "gaps as the origin, dropped": (
        (runs(origin_in_gaps), runs(dropped(0.05))),
        "it fills a gap and is left out",
    ),
    "gaps as zeros, dropped": (
        (runs(zeros_in_gaps), runs(dropped(0.05))),
        "the quaternion 0 0 0 0 is taken as a gap",
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", USED)
def test_faults_together_are_used_rightly(tmp_path: Path, name: str) -> None:
    """Within three deviations and half of one, of 36 values; told as well as without faults."""
    faults, words = USED[name]
    folder = lab(tmp_path / "lab", *faults)
    assert main(["identify", str(folder), "--quiet"]) == 0
    found = json.loads((folder / "results" / "identification.json").read_text(encoding="utf-8"))
    assert any(words in note for note in found["notes"]), found["notes"]
    truth = json.loads((SAMPLES / "two-cables" / "truth" / "truth.json").read_text())
    true = dict(zip(INERTIA_NAMES, [*truth["com_m"], *truth["specific_inertia_m2"]], strict=True))
    assert set(found["estimates"]) == {"ml_full", "ml_free", "fidim_full", "fidim_free"}
    for kind, estimate in found["estimates"].items():
        rows = {row["name"]: row for row in estimate["parameters"]}
        z = [(rows[n]["value"] - v) / rows[n]["std"] for n, v in true.items()]
        assert np.abs(z).max() < 3.5, f"{kind}: {np.round(z, 1)}"
    best = {row["name"]: row["std"] for row in found["estimates"]["ml_full"]["parameters"]}
    assert best["com_x_m"] < 5e-6, f"{1e6 * best['com_x_m']:.1f} um"
