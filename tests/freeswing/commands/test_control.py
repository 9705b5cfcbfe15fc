"""design, servo, tensions: the files they write, what they say, what they refuse."""

import json
import re
import shutil
import subprocess

import numpy as np
import pytest
from scipy.io import loadmat

from freeswing.commands.control import servo
from freeswing.main import main
from freeswing.results.control import ControllerResult, Robustness, ServoResult
from freeswing.servo.design import robustness
from freeswing.servo.driven_file import read_driven
from freeswing.servo.files.controller_file import read_controller
from freeswing.servo.robot_now import Survey, motors_of
from tests.places import SAMPLES
from tests.servo.plants import cables

INCA = SAMPLES / "inca-6d"
COLUMNS = "x_m,y_m,z_m,qw,qx,qy,qz,fx_N,fy_N,fz_N,mx_N_m,my_N_m,mz_N_m"


@pytest.fixture(scope="module")
def designed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("designed")
    weights = INCA / "weights.toml"
    assert main(["design", str(INCA), "--weights", str(weights), "--results", str(folder)]) == 0
    return folder


def test_design_writes_the_papers_controller(designed):
    found = json.loads((designed / "controller.json").read_text())
    assert found["format"] == "freeswing-controller/1"
    assert ControllerResult.from_json(found).to_json() == found
    assert 0.93 < found["gamma"] <= 0.945, found["gamma"]
    assert (found["order"], found["sample_rate_hz"]) == (30, 1000)
    assert found["margins"]["position"] == pytest.approx(0.55, abs=0.02)
    assert found["bandwidth_rad_s"]["orientation"] == pytest.approx(1.8, abs=0.1)
    assert found["delay_margin_s"] == pytest.approx(0.031, abs=0.002)
    assert found["warnings"] == []
    assert np.abs(np.linalg.eigvals(found["A"])).max() < 1.0
    for name in ("controller-gains.svg", "controller-templates.svg"):
        assert (designed / name).read_text().startswith("<?xml")


def test_every_form_of_the_controller_says_the_same(designed):
    stored = read_controller(designed / "controller.json").system
    npz, mat = np.load(designed / "controller.npz"), loadmat(designed / "controller.mat")
    for key in "ABCD":
        np.testing.assert_array_equal(npz[key], getattr(stored, key))
        np.testing.assert_array_equal(mat[key], getattr(stored, key))


def test_the_c_header_steps_as_the_matrices_do(designed, tmp_path):
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        pytest.skip("no C compiler here")
    (tmp_path / "run.c").write_text(
        '#include <stdio.h>\n#include "controller.h"\n'
        "int main(void) { static double x[FREESWING_ORDER]; double e[6], w[6]; int k, i;\n"
        "for (k = 0; k < 50; ++k) { for (i = 0; i < 6; ++i) e[i] = 0.001 * (k % (i + 2));\n"
        'freeswing_step(x, e, w); } for (i = 0; i < 6; ++i) printf("%.17g\\n", w[i]); return 0; }'
    )
    program = tmp_path / "run"
    words = [compiler, "-Wall", "-Werror", "-std=c99", f"-I{designed}", "-o", program]
    subprocess.run([*words, tmp_path / "run.c"], check=True)
    printed = subprocess.run([program], capture_output=True, check=True, text=True).stdout
    stored = read_controller(designed / "controller.json")
    k, x = stored.system, np.zeros(stored.system.order)
    for step in range(50):
        error = 0.001 * (step % (np.arange(6) + 2))
        wrench = stored.wrench + k.C @ x + k.D @ error
        x = k.A @ x + k.B @ error
    np.testing.assert_allclose([float(v) for v in printed.split()], wrench, rtol=1e-9)


def test_the_printed_weights_are_warned_of(tmp_path, capsys):
    weights = INCA / "weights-printed.toml"
    assert main(["design", str(INCA), "--weights", str(weights), "--results", str(tmp_path)]) == 0
    found = json.loads((tmp_path / "controller.json").read_text())
    assert found["gamma"] == pytest.approx(0.5, abs=1e-3)
    assert "the disturbance template is met by the open loop: 200 m/N" in found["warnings"][0]
    assert "ask for nothing" in capsys.readouterr().err


def test_a_short_task_is_run_and_told(designed, tmp_path, capsys):
    task = tmp_path / "task.toml"
    task.write_text(
        'format = "freeswing-task/1"\nend_s = 1.2\n[[steps]]\nt_s = 0.0\nposition_m = [0, 0, 0]\n'
        "[[steps]]\nt_s = 0.1\nposition_m = [0.05, 0.0, 0.0]\n"
    )
    words = ["servo", str(INCA), "--task", str(task), "--results", str(tmp_path)]
    assert main([*words, "--controller", str(designed / "controller.json")]) == 0
    document = json.loads((tmp_path / "servo.json").read_text())
    assert ServoResult.from_json(document).to_json() == document
    assert [t["trial"] for t in document["trials"]] == ["no Coulomb friction", "Coulomb friction"]
    assert all(trial["held"] for trial in document["trials"])
    assert "held" in capsys.readouterr().out
    rows = (tmp_path / "servo.csv").read_text().splitlines()
    assert len(rows) == 1201
    assert rows[0].startswith("t_s,asked_x_m")
    assert (tmp_path / "servo-friction.svg").is_file()


def test_a_predictive_controller_without_daqp_is_refused(tmp_path, monkeypatch, capsys):
    words = ["--results", str(tmp_path)]
    assert main(["design", str(INCA), "--method", "mpc", *words]) == 0
    assert "mpc: speeds" in capsys.readouterr().out
    monkeypatch.setattr(servo, "find_spec", lambda name: None)
    assert main(["servo", str(INCA), "--task", str(INCA / "task.toml"), *words]) == 2
    assert "pip install 'freeswing[control]'" in capsys.readouterr().err


def test_a_task_outside_the_workspace_is_refused(designed, tmp_path, capsys):
    task = tmp_path / "task.toml"
    task.write_text(
        'format = "freeswing-task/1"\n[[steps]]\nt_s = 0.0\nposition_m = [0, 0, 0]\n'
        "[[steps]]\nt_s = 2.5\nposition_m = [1.1, 0.0, 0.0]\n"
    )
    words = ["servo", str(INCA), "--task", str(task), "--results", str(designed)]
    assert main(words) == 2
    assert "at 2.5 s it leaves the feasible workspace at (0." in capsys.readouterr().err


def test_a_driven_robots_report_shows_controllers_runs_and_pictures(designed, tmp_path, capsys):
    results = tmp_path / "results"
    shutil.copytree(designed, results)
    task = tmp_path / "task.toml"
    task.write_text(
        'format = "freeswing-task/1"\nend_s = 0.3\n[[steps]]\nt_s = 0.0\nposition_m = [0, 0, 0]\n'
        "[[steps]]\nt_s = 0.1\nposition_m = [0.01, 0.0, 0.0]\n"
    )
    assert main(["servo", str(INCA), "--task", str(task), "--results", str(results)]) == 0
    assert main(["report", str(INCA), "--results", str(results)]) == 0
    page = (results / "report.html").read_text()
    assert page.count("data:image/svg+xml;base64,") == 4
    for text in ("Under control", "0.940", "no Coulomb friction", "Fig. 12", "Fig. 15"):
        assert text in page, text
    wrong = {"format": "freeswing-servo/1", "task": "task.toml", "trials": [{}]}
    (results / "servo.json").write_text(json.dumps(wrong))
    assert main(["report", str(INCA), "--results", str(results)]) == 2
    assert "trials[0] lacks controller" in capsys.readouterr().err
    (results / "servo.json").write_text("{}")
    assert main(["report", str(INCA), "--results", str(results)]) == 2
    assert "must be 'freeswing-servo/1'; delete it and run again" in capsys.readouterr().err
    empty = tmp_path / "empty"
    empty.mkdir()
    assert main(["report", str(INCA), "--results", str(empty)]) == 2
    assert "nothing to show of a driven robot yet: freeswing design" in capsys.readouterr().err


def test_robustness_is_told_with_the_identified_covariance(tmp_path, monkeypatch, capsys):
    for name, value in (("PLACES", 3), ("DRAWS", 4), ("LOOKS", 2), ("STEPS", 2)):
        monkeypatch.setattr(robustness, name, value)
    drive = tmp_path / "drive.json"
    parameters = [{"name": "mass_kg", "value": 0.289, "std": 1e-3}]
    joint = {"parameters": parameters, "correlation": [[1.0]]}
    drive.write_text(
        json.dumps({"format": "freeswing-drive-result/1", "estimates": {"joint": joint}})
    )
    words = ["design", str(INCA), "--results", str(tmp_path)]
    assert main([*words, "--robustness", "--identified", str(drive)]) == 0
    found = json.loads((tmp_path / "robustness.json").read_text())
    assert Robustness.from_json(found).to_json() == found
    assert found["method"].startswith("gridding")
    assert found["draws"]["unstable"] == found["draws"]["failing"] == 0
    assert found["draws"]["std"] == {"mass_kg": 1e-3}
    assert len(found["first_failures"]) == 12
    assert all(row["scheduled"]["stable"] for row in found["grid"])
    said = capsys.readouterr().out
    assert "places that allowed tensions hold it is stable at" in said
    assert f"robots drawn from the covariance of {drive} 0 are unstable" in said
    assert main([*words, "--identified", str(drive)]) == 2
    assert "says nothing without --robustness" in capsys.readouterr().err


def written(folder, *rows):
    path = folder / "wrenches.csv"
    path.write_text("\n".join([COLUMNS, *rows]) + "\n")
    return path


@pytest.mark.parametrize("method", ["nearest", "barycentre", "paper", "closed-form", "qp"])
def test_tensions_give_the_wrench(tmp_path, method):
    path = written(
        tmp_path,
        "0.05,0,0.05,1,0,0,0,1,-1,3,0.02,0,0",
        "0,0,0,1,0,0,0,200,0,0,0,0,0",
    )
    words = ["tensions", str(INCA), str(path), "--method", method, "--results", str(tmp_path)]
    assert main(words) == 0
    lines = (tmp_path / "tensions.csv").read_text().splitlines()
    header, first, second = (line.split(",") for line in lines)
    assert header[:2] == ["T1_N", "T2_N"]
    assert header[8] == "I1_A"
    assert header[16:] == ["status", "scale", "stopped_by"]
    # The sample numbers its cables round the upper corners, the test's plant by signs of x, y, z.
    order = [0, 4, 6, 2, 1, 5, 7, 3]
    for row, pose, wrench in (
        (first, [0.05, 0, 0.05, 0, 0, 0], [1, -1, 3, 0.02, 0, 0]),
        (second, np.zeros(6), [200, 0, 0, 0, 0, 0]),
    ):
        tensions = np.array(row[:8], dtype=float)
        _, J = cables(np.array(pose, dtype=float))
        made = -J[order].T @ tensions
        np.testing.assert_allclose(made, float(row[17]) * np.array(wrench), atol=1e-8)
        assert tensions.min() > 1.48 - 1e-9
        currents = np.array(row[8:16], dtype=float)
        assert currents.min() > -1e-9
        assert currents.max() < 3 + 1e-9
    assert (first[16], second[16]) == ("feasible", "scaled")
    assert re.fullmatch(r"[1-8] (low|high)", second[18])


@pytest.mark.parametrize(
    ("row", "says"),
    [
        ("0,0,0,1,0,0,0,0,0,3,0,6000,0", "N mm"),
        ("0,0,0,1,0,0,0,0,0,3,0,41.7,0", "N mm"),
        ("900,0,0,1,0,0,0,0,0,3,0,0,0", "is this in mm"),
        ("6.3,0,0,1,0,0,0,0,0,3,0,0,0", "is this in mm"),
        ("1.3,0,0,1,0,0,0,0,0,3,0,0,0", "outside the frame"),
        ("0,0,0,2,0,0,0,0,0,3,0,0,0", "quaternion's length"),
        ("0,0,0,1,0,0,0,0,,3,0,0,0", "fy_N is empty"),
    ],
)
def test_wrong_wrenches_are_refused_by_line(tmp_path, capsys, row, says):
    path = written(tmp_path, "0,0,0,1,0,0,0,0,0,3,0,0,0", row)
    assert main(["tensions", str(INCA), str(path), "--results", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert says in said, said
    assert "line 3" in said


def test_places_and_moments_that_may_be_meant_are_no_units(tmp_path, capsys):
    path = written(tmp_path, "6.2,0,0,1,0,0,0,0,0,3,0,0,0")
    assert main(["tensions", str(INCA), str(path), "--results", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert "outside the frame" in said
    assert "mm" not in said.split("outside the frame")[1]
    path = written(tmp_path, "0,0,0,1,0,0,0,0,0,3,0,40,0")
    assert main(["tensions", str(INCA), str(path), "--results", str(tmp_path)]) == 0


@pytest.mark.parametrize("n", [6, 7, 9, 10])
def test_robots_of_other_numbers_of_cables(tmp_path, capsys, n):
    """A wrench that tensions about 10 N make; nine and ten cables by the QP."""
    head, *cables = (INCA / "robot.toml").read_text().split("[[cables]]")
    more = [
        f'\nname = "{k}"\nentry_m = ["{s}Lx_m/2", 0, "{s}Lz_m/2"]\n'
        f'attachment_m = ["{s}arm_m", "{s}0.2*arm_m", 0]\n'
        for k, s in ((9, ""), (10, "-"))
    ]
    robot = tmp_path / "robot.toml"
    robot.write_text(head + "".join("[[cables]]" + one for one in [*cables, *more][:n]))
    model = read_driven(robot)[1]
    at = Survey(model).here(np.array([0.01, 0, 0.02, 0, 0, 0]))
    pull = at.wrench_matrix / motors_of(model).tension_per_A
    meant = 10.0 + 0.2 * np.arange(n)
    wrench = ",".join(repr(float(value)) for value in pull @ meant)
    path = written(tmp_path, f"0.01,0,0.02,1,0,0,0,{wrench}")
    assert main(["tensions", str(robot), str(path), "--results", str(tmp_path)]) == 0
    row = (tmp_path / "tensions.csv").read_text().splitlines()[1].split(",")
    assert row[2 * n] == "feasible"
    found = np.array(row[:n], dtype=float)
    np.testing.assert_allclose(pull @ found, pull @ meant, atol=1e-8)
    if n == 6:
        np.testing.assert_allclose(found, meant, atol=1e-8)
    else:
        assert np.linalg.norm(found - 10.0) < np.linalg.norm(meant - 10.0), "nearest to 10 N"
    task = INCA / "task.toml"
    if n > 8:
        assert main(["servo", str(robot), "--task", str(task), "--results", str(tmp_path)]) == 2
        assert "at most 8" in capsys.readouterr().err
        words = ["--method", "barycentre", "--results", str(tmp_path)]
        assert main(["tensions", str(robot), str(path), *words]) == 2


def test_columns_in_millimetres_and_robots_without_motors_are_refused(tmp_path, capsys):
    path = tmp_path / "mm.csv"
    path.write_text(COLUMNS.replace("x_m,", "x_mm,") + "\n")
    assert main(["tensions", str(INCA), str(path)]) == 2
    assert "not mm" in capsys.readouterr().err
    still = SAMPLES / "two-cables"
    assert main(["tensions", str(still), str(written(tmp_path, "0"))]) == 2
    assert "n >= 6" in capsys.readouterr().err
    assert main(["design", str(still)]) == 2
