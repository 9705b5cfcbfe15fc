"""Bench sessions: keys, files and refusals, through the reader and the command line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from freeswing.cdpr.files.documents import InputError
from freeswing.cdpr.files.robot_file import read_robot
from freeswing.cdpr.files.signal_csv import read_signals
from freeswing.cdpr.files.trajectory_csv import read_csv
from freeswing.cdpr.simulation.parallel_wires import hangs_parallel
from freeswing.ident.bench.runs import Bench
from freeswing.main import main
from freeswing.session.load_bench import is_bench, load_bench
from freeswing.session.session_file import read_session

ROBOT = """format = "freeswing-robot/1"
name = "bench"
free_coordinates = ["x", "y", "chi"]
[platform]
mass_kg = 1.0
mass_std_kg = 0.02
"""
SESSION = """format = "freeswing-session/1"
name = "bench"
robot = "robot.toml"
[[channels]]
name = "dot"
column = "dot_px"
coordinates = ["chi", "x"]
order = 3
gains = { chi = 3800.0 }
gains_std = { chi = 400.0 }
[[loads]]
name = "cube"
mass_kg = 0.5
com_m = [0.0, 0.0, 0.05]
com_std_m = 0.002
[[runs]]
name = "tare"
role = "identify"
cable_lengths_m = [1.2, 1.2, 1.2]
trajectory = "tare.csv"
payload = [{ mass_kg = 0.1, position_m = [0, 0, 0] },
  { mass_kg = 0.2, position_m = [0.1, 0, 0], inertia_kg_m2 = [1e-4, 1e-4, 2e-4, 0, 0, 0] }]
[[runs]]
name = "cube"
role = "identify"
cable_lengths_m = [1.2, 1.2, 1.2]
trajectory = "cube.csv"
loads = [{ name = "cube", q_platform_load = [0.707107, 0.707107, 0.0, 0.0] }]
"""


def make(folder: Path, session: str = SESSION, scale: float = 1.0) -> Path:
    cables = ""
    for k in range(3):
        x, y = 0.25 * np.cos(2.1 * k), 0.25 * np.sin(2.1 * k)
        cables += f'[[cables]]\nname = "{k}"\nentry_m = [{x}, {y}, 1.2]\n'
        cables += f"pulley_radius_m = 0.0\nattachment_m = [{x}, {y}, 0.0]\n"
    folder.mkdir(exist_ok=True)
    (folder / "robot.toml").write_text(ROBOT + cables)
    (folder / "session.toml").write_text(session)
    times = np.arange(200) / 50.0
    chi = scale * 0.1 * np.cos(5.0 * times)
    rows = "\n".join(f"{t:.3f},{c:.6f}" for t, c in zip(times, chi, strict=True))
    (folder / "tare.csv").write_text("t_s,chi_rad\n" + rows + "\n")
    rows = "\n".join(f"{t:.3f},{900.0 * c:.6f}" for t, c in zip(times, chi, strict=True))
    (folder / "cube.csv").write_text("t_s,dot_px\n" + rows + "\n")
    return folder


def test_keys_are_read(tmp_path: Path) -> None:
    session = read_session(make(tmp_path))
    assert session.channels[0].gains["chi"] == 3800.0
    assert session.channels[0].order == 3
    assert session.runs[0].payloads[1].inertia_kg_m2[2] == 2e-4
    np.testing.assert_allclose(session.runs[1].loads[0].turn @ [0, 1, 0], [0, 0, 1], atol=1e-6)
    robot = read_robot(session.robot)
    assert is_bench(session, robot)
    assert hangs_parallel(robot)
    bench = load_bench(session, robot, None)
    assert bench.mass_std_kg == 0.02
    assert [run.coordinates for run in bench.runs] == [("chi",), ()]
    assert bench.loads[0].com_std_m is not None
    np.testing.assert_allclose(bench.loads[0].com_std_m, 0.002)


def loaded(folder: Path) -> Bench:
    session = read_session(folder)
    return load_bench(session, read_robot(session.robot), None)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('loads = [{ name = "cube"', 'loads = [{ name = "cup"', "run cube carries 'cup'"),
        ('["chi", "x"]', '["chi", "q"]', "q is no coordinate; there are x y z phi theta chi"),
        ("mass_kg = 0.5\n", "", "mass_kg"),
        ('"dot_px"', '"spot_px"', "unknown column"),
        ("order = 3", "order = 4", "order"),
        ("gains = { chi = 3800.0 }", "gains = { chi = 0.0 }", "gains of chi is 0"),
        ("gains = { chi = 3800.0 }", "", "gains_std of chi without gains"),
        ("gains_std = { chi = 400.0 }", "gains_std = { chi = 0.0 }", "must be above 0"),
    ],
)
def test_wrong_keys_are_named(tmp_path: Path, old: str, new: str, said: str) -> None:
    make(tmp_path, SESSION.replace(old, new))
    with pytest.raises(InputError, match=said):
        loaded(tmp_path)


def test_a_load_twice_in_a_run_is_refused(tmp_path: Path) -> None:
    twice = SESSION.replace(
        'loads = [{ name = "cube", q_platform_load = [0.707107, 0.707107, 0.0, 0.0] }]',
        'loads = ["cube", "cube"]',
    )
    with pytest.raises(InputError, match="'cube' is there 2 times"):
        read_session(make(tmp_path, twice))


def test_gaps_of_a_benchs_poses_are_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    make(tmp_path)
    times, turns = np.arange(200) / 50.0, 0.05 * np.cos(0.1 * np.arange(200))
    rows = [
        f"{t:.3f},{0.01 * c:.6f},0,0,{np.cos(c):.9f},0,0,{np.sin(c):.9f}"
        for t, c in zip(times, turns, strict=True)
    ]
    rows[50] = "1.000,0,0,0,0,0,0,0"
    (tmp_path / "tare.csv").write_text("\n".join(["t_s,x_m,y_m,z_m,qw,qx,qy,qz", *rows]))
    said = "the quaternion 0 0 0 0 is taken as a gap in 1 sample, first in line 52"
    bench = loaded(tmp_path)
    assert bench.runs[0].notes == (said,)
    assert np.isnan([one.values[50] for one in bench.runs[0].signals]).all()
    main(["check", str(tmp_path)])
    assert f"run tare: {said}" in capsys.readouterr().out


def test_a_partial_run_without_lengths_names_itself(
    tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    make(tmp_path, SESSION.replace("cable_lengths_m = [1.2, 1.2, 1.2]\n", "", 1))
    assert main(["identify", str(tmp_path)]) == 1
    assert "run tare: it measures chi alone and cable_lengths_m" in capsys.readouterr().err


def test_check_reads_a_bench_as_identify_does(
    tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    """Yaw alone and a channel are no errors there; a mass in g and a still run are."""
    folder = make(tmp_path / "right")
    assert main(["check", str(folder)]) == 0
    assert "role validate" not in capsys.readouterr().out
    folder = make(tmp_path / "grams", SESSION.replace("mass_kg = 0.5\n", "mass_kg = 500.0\n"))
    assert main(["check", str(folder)]) == 1
    assert "is it in g?" in capsys.readouterr().out
    folder = make(tmp_path / "still", scale=0.0)
    assert main(["check", str(folder)]) == 1
    assert "run tare: column chi is the same number" in capsys.readouterr().out


def test_a_still_channel_names_run_and_channel(
    tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    make(tmp_path)
    rng = np.random.default_rng(0)
    rows = "\n".join(f"{k / 50.0:.3f},{rng.normal():.4f}" for k in range(200))
    (tmp_path / "cube.csv").write_text("t_s,dot_px\n" + rows + "\n")
    assert main(["identify", str(tmp_path)]) == 1
    assert "run cube: channel column dot_px never moves above its noise" in capsys.readouterr().err


@pytest.mark.parametrize(("scale", "refused"), [(12.0, False), (13.0, True)])
def test_degrees_are_questioned_by_name(tmp_path: Path, scale: float, refused: bool) -> None:
    """2.5 rad from side to side is where no swing is left: 0.2 x 12 = 2.4 rad is one."""
    make(tmp_path, scale=scale)
    for read in (lambda path: read_csv(path), lambda path: read_signals(path)):
        if refused:
            with pytest.raises(InputError, match=r"chi_rad swings over .* in degrees"):
                read(tmp_path / "tare.csv")
        else:
            read(tmp_path / "tare.csv")


STATED = "cable_lengths_m = [1.2, 1.2, 1.2]"


@pytest.mark.parametrize(
    ("old", "new", "status", "said"),
    [
        (STATED, f"{STATED}\nwindow_s = [20, 30]", 1, "from 0 to 3.98 s: correct window_s, or"),
        (STATED, f"{STATED}\nwindow_s = [3, 1]", 2, "window_s: [3.0, 1.0]: its end must follow"),
        (STATED, f"{STATED}\ncable_lengths_std_m = 1.0", 2, "cable_lengths_std_m = 1 m on wires"),
    ],
)
def test_a_session_that_cannot_be_meant(
    tmp_path: Path, capsys, old: str, new: str, status: int, said: str
) -> None:
    """Wrong input is 2, data that cannot give a result 1, and both say what to do."""
    make(tmp_path, SESSION.replace(old, new, 1))
    assert main(["identify", str(tmp_path)]) == status
    assert said in capsys.readouterr().err


def test_gravity_that_points_upwards_is_refused(tmp_path: Path, capsys) -> None:
    make(tmp_path)
    robot = tmp_path / "robot.toml"
    upwards = "gravity_m_s2 = [0.0, 0.0, 9.81]\n[platform]"
    robot.write_text(robot.read_text().replace("[platform]", upwards, 1))
    assert main(["identify", str(tmp_path)]) == 2
    assert "turn its sign" in capsys.readouterr().err


def test_a_run_in_which_nothing_moves(tmp_path: Path, capsys) -> None:
    make(tmp_path)
    noise = np.random.default_rng(1).normal(0.0, 5e-4, 200)
    rows = "".join(f"{k / 50:.3f},{c:.6f}\n" for k, c in enumerate(noise))
    (tmp_path / "tare.csv").write_text("t_s,chi_rad\n" + rows)
    assert main(["identify", str(tmp_path)]) == 1
    assert "run tare: nothing moves above its noise in chi: twist" in capsys.readouterr().err


def test_a_report_without_a_session_says_how_one_starts(tmp_path: Path, capsys) -> None:
    make(tmp_path)
    (tmp_path / "session.toml").unlink()
    assert main(["report", str(tmp_path)]) == 2
    told = capsys.readouterr().err
    assert "lacks a session.toml, which freeswing new writes" in told
