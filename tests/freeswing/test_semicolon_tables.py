"""Tables as spreadsheets of half of Europe save them: semicolons between cells, decimal commas."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from freeswing.calib.board.recordings import stamp_rows
from freeswing.cdpr.files.drive_csv import read_drive_run
from freeswing.cdpr.files.number_table import comma_separated
from freeswing.homing.homing_files import read_readings
from freeswing.servo.files.wrench_file import COLUMNS, read_wrenches
from tests.places import SAMPLES


def semicolons(path: Path) -> Path:
    """The same table beside it, as such a spreadsheet writes it."""
    text = path.read_text(encoding="utf-8").replace(",", ";").replace(".", ",")
    result = path.with_name(f"semicolons_{path.name}")
    result.write_text(text, encoding="utf-8")
    return result


def test_a_header_with_commas_is_left_as_it_is() -> None:
    text = 'a,b\n1,"2;5"\n'
    assert comma_separated(text) == text


def test_static_readings(tmp_path: Path) -> None:
    path = tmp_path / "readings.csv"
    path.write_bytes((SAMPLES / "homing" / "readings.csv").read_bytes())
    plain = read_readings(path, 3)
    other = read_readings(semicolons(path), 3)
    for name in plain.__slots__:
        assert np.array_equal(getattr(plain, name), getattr(other, name)), name


def test_stamps(tmp_path: Path) -> None:
    path = tmp_path / "cam0.csv"
    path.write_text("frame,t_s\n0,0.5\n1,0.525\n", encoding="utf-8")
    assert list(stamp_rows(semicolons(path))) == [(2, 0, 0.5), (3, 1, 0.525)]


def test_wrenches_and_drive_records(tmp_path: Path) -> None:
    path = tmp_path / "wrenches.csv"
    row = [0.01, -0.02, 0.03, 1.0, 0.0, 0.0, 0.0, 1.5, 2.5, -3.5, 0.1, 0.2, 0.3]
    path.write_text(",".join(COLUMNS) + "\n" + ",".join(map(str, row)) + "\n", encoding="utf-8")
    found = read_wrenches(semicolons(path), np.ones(3), 10.0)
    plain = read_wrenches(path, np.ones(3), 10.0)
    for name in plain.__slots__:
        assert np.array_equal(getattr(plain, name), getattr(found, name)), name
    path = tmp_path / "drive.csv"
    head = "t_s,I1_A,Iref1_A,theta1_rad,x_m,y_m,z_m,qw,qx,qy,qz"
    rows = [f"{k / 100},0.5,0.5,{0.1 * k},0.1,0.2,0.3,1.0,0.0,0.0,0.0" for k in range(5)]
    path.write_text("\n".join([head, *rows, ""]), encoding="utf-8")
    plain_run, run = read_drive_run(path, 1), read_drive_run(semicolons(path), 1)
    assert np.array_equal(plain_run.times_s, run.times_s)
