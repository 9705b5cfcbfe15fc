"""What a session's files may say, and which runs check: both sides of each number."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.cdpr.files.problems import InputError, Problems
from freeswing.cdpr.files.table_reader import Reader
from freeswing.cdpr.simulation.parallel_wires import hangs_parallel
from freeswing.session import drive_session, exchanged_lengths
from freeswing.session.bench_keys import _read_place
from freeswing.session.drive_session import read_drive_session
from freeswing.session.new_recordings import next_role
from freeswing.starter.markers import role
from freeswing.vision.planar.axes_at_rest import check_hangs_straight


def two_wires(**changes) -> SimpleNamespace:
    """A beam of two metres on two parallel wires."""
    beam = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    usual = {
        "n_cables": 2, "radii_m": np.zeros(2), "gravity_m_s2": np.array([0.0, 0.0, -9.8]),
        "entries_m": beam, "attachments_m": beam,
    }  # fmt: skip
    return SimpleNamespace(**(usual | changes))


@pytest.mark.parametrize(("off", "parallel"), [(0.019, True), (0.021, False)])
def test_wires_that_lean_by_a_fiftieth_hang_parallel(off, parallel) -> None:
    """Towards each other, away from each other, or from entries that are not level."""
    beam = two_wires().entries_m
    tilted = beam @ np.array([[1.0, 0.0, off], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    assert hangs_parallel(two_wires(attachments_m=beam * (1.0 - off))) == parallel
    assert hangs_parallel(two_wires(attachments_m=beam * (1.0 + off))) == parallel
    assert hangs_parallel(two_wires(entries_m=tilted)) == parallel


@pytest.mark.parametrize(("turn", "refused"), [(0.048, False), (0.052, True)])
def test_wires_that_are_turned_by_three_degrees(turn, refused) -> None:
    for way in (turn, -turn):
        c, s = np.cos(way), np.sin(way)
        beam = two_wires().entries_m
        robot = two_wires(entries_m=beam @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]))
        if refused:
            with pytest.raises(InputError, match="upper ends are turned"):
                check_hangs_straight(Path("robot.toml"), robot)
        else:
            check_hangs_straight(Path("robot.toml"), robot)


@pytest.mark.parametrize(("off", "refused"), [(0.019, False), (0.021, True)])
def test_a_rounded_quaternion_is_still_one(off, refused) -> None:
    for length in (1.0 - off, 1.0 + off):
        problems = Problems()
        table = {"name": "disc", "q_platform_load": [0.0, 0.0, length, 0.0]}
        found = _read_place(Reader(table, problems, "loads"))
        assert (found is None) == refused


@pytest.mark.parametrize(("latency_s", "refused"), [(0.98, False), (1.02, True)])
def test_poses_are_late_by_a_second_at_most(tmp_path, latency_s, refused) -> None:
    numbers = {
        "pose_latency_s": latency_s, "encoder_step_rad": 1e-3, "position_std_m": 1e-3,
        "angle_std_rad": 1e-3, "current_std_A": 0.1,
    }  # fmt: skip
    problems = Problems()
    drive_session._noise(Reader(numbers, problems, ""))
    if refused:
        with pytest.raises(InputError, match="pose_latency_s"):
            problems.raise_if_any(tmp_path / "drive.toml")
    else:
        problems.raise_if_any(tmp_path / "drive.toml")


@pytest.mark.parametrize(("rows", "enough"), [(49, False), (50, True)])
def test_a_driven_run_of_fifty_rows(monkeypatch, tmp_path, rows, enough) -> None:
    (tmp_path / "drive.toml").write_text(
        'format = "freeswing-drive/1"\nname = "d"\nrobot = "robot.toml"\nsample_rate_hz = 1000.0\n'
        "encoder_step_rad = 1e-3\nposition_std_m = 1e-3\nangle_std_rad = 1e-3\n"
        'current_std_A = 0.1\n[unknown]\nkinematic = []\ndynamic = ["mass_kg"]\n'
        '[[runs]]\nname = "a"\nrole = "identify"\nfile = "a.csv"\n'
        '[[runs]]\nname = "b"\nrole = "validate"\nfile = "b.csv"\n'
    )
    run = SimpleNamespace(times_s=np.arange(rows) / 1000.0)
    monkeypatch.setattr(drive_session, "_model", lambda *_: (SimpleNamespace(n_cables=2), ()))
    monkeypatch.setattr(drive_session, "_check_zero", lambda *_: None)
    monkeypatch.setattr(drive_session, "inside", lambda folder, name, _: folder / name)
    monkeypatch.setattr(drive_session, "read_drive_run", lambda *_: run)
    if enough:
        assert read_drive_session(tmp_path / "drive.toml").name == "d"
    else:
        with pytest.raises(InputError, match="49 rows, at least 50 are needed"):
            read_drive_session(tmp_path / "drive.toml")


@pytest.mark.parametrize(("next_best", "exchanged"), [(1.9, False), (2.1, True)])
def test_an_order_that_rests_hardly_nearer_than_another(monkeypatch, next_best, exchanged) -> None:
    """Swapping the first two lengths leaves 10 mm, the first and the last so many times that."""
    stated = np.array([1.0, 1.1, 1.2])
    off = {(1.0, 1.1, 1.2): 0.2, (1.1, 1.0, 1.2): 0.01, (1.2, 1.1, 1.0): 0.01 * next_best}
    part = SimpleNamespace(coordinates=("x", "y"))
    robot = SimpleNamespace(n_cables=3, cables=[SimpleNamespace(name=k) for k in "abc"])
    monkeypatch.setattr(exchanged_lengths, "_free_part", lambda _: part)
    monkeypatch.setattr(exchanged_lengths, "_swinging", lambda _: part)
    monkeypatch.setattr(exchanged_lengths, "build_model", lambda _: None)
    monkeypatch.setattr(
        exchanged_lengths, "_off_at_rest", lambda model, part, one: off.get(tuple(one), 0.3)
    )
    swing = SimpleNamespace(lengths_m=stated)
    order, said = exchanged_lengths.exchanged_at_rest(swing, robot)
    assert (order is not None) == bool(said) == exchanged, said


def test_a_third_of_the_runs_checks() -> None:
    """Of recordings that come one by one, and of those that are there at once."""
    roles: list[str] = []
    for _ in range(9):
        roles.append(next_role(roles))
    assert roles == ["identify", "identify", "validate"] * 3
    assert [role(index, 9) for index in range(9)] == roles
    assert [role(index, 2) for index in range(2)] == ["identify"] * 2
