"""Recordings that must never be reported as a fit, through the command line."""

import json

import numpy as np
import pytest

from freeswing.cdpr.driven.behaviour import rest_pose, simulate
from freeswing.cdpr.driven.record import observed
from freeswing.cdpr.driven.statics import CENTRE
from freeswing.cdpr.files.drive_csv import write_drive_run
from freeswing.ident.drive.records.mistaken_records import findings
from freeswing.main import main
from freeswing.session.drive_session import read_drive_session
from tests.cdpr.driven_robots import inca
from tests.ident.drive.made_sessions import INSTRUMENTS, TOML, write_session


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    return write_session(tmp_path_factory.mktemp("made"), seed=40, seconds=1.2)


def spoiled(made, tmp_path, run=None, static=None, toml=None):
    """A copy with a table of one file changed by a function of (names, values)."""
    for file in made.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    for name, change in (("ident.csv", run), ("static.csv", static)):
        if change is not None:
            rows = [row.split(",") for row in (made / name).read_text().splitlines()]
            values = np.array([[float(c) if c else np.nan for c in row] for row in rows[1:]])
            values = change(rows[0], values)
            lines = [",".join(rows[0])]
            lines += [",".join("" if np.isnan(v) else f"{v:.12g}" for v in row) for row in values]
            (tmp_path / name).write_text("\n".join(lines))
    if toml is not None:
        old, new = toml
        (tmp_path / "drive.toml").write_text(TOML.replace(old, new, 1))
    return tmp_path


def scaled(prefix, factor):
    def change(names, values):
        columns = [k for k, name in enumerate(names) if name.startswith(prefix)]
        values[:, columns] *= factor
        return values

    return change


def swapped(names, values):
    a, b = names.index("theta2_rad"), names.index("theta5_rad")
    values[:, [a, b]] = values[:, [b, a]]
    return values


def swapped_currents(names, values):
    a, b = names.index("I1_A"), names.index("I5_A")
    values[:, [a, b]] = values[:, [b, a]]
    return values


def off(names, values):
    values[:, names.index("I6_A")] = 0.0
    return values


def jumping(_, values):
    values[700:, 0] += 0.25
    return values


def cut(_, values):
    values = values[400:]
    values[:, 0] -= values[0, 0]
    return values


def moving(names, values):
    values[4, names.index("theta3_rad")] += 0.2
    return values


def test_a_sound_session_has_no_finding(made, tmp_path):
    assert findings(read_drive_session(made / "drive.toml").session) == []
    assert main(["check", str(made), "--results", str(tmp_path), "--quiet"]) == 0
    assert json.loads((tmp_path / "check.json").read_text())["findings"] == []


def test_commands_of_free_swings_say_which_take_it(made, capsys):
    assert main(["identify", str(made)]) == 2
    assert "drive, check, diagnose, export and run take it" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ({"run": scaled("theta", 57.29578)}, ["run ident", "degrees? write rad"]),
        ({"run": scaled("theta", 4096 / 6.2832)}, ["run ident", "counts? write rad"]),
        ({"run": scaled("theta4", -1.0)}, ["run ident", "motor 4 falls where its cable is wound"]),
        ({"run": scaled("I", 1000.0)}, ["run ident", "look like mA"]),
        ({"run": swapped}, ["motors 2 and 5", "columns are swapped"]),
        ({"run": swapped_currents}, ["currents of motors 1 and 5", "columns are swapped"]),
        ({"run": off}, ["current of motor 6 does not follow its reference"]),
        ({"static": scaled("theta", 57.29578)}, ["static poses: angles are 57", "degrees?"]),
        ({"static": scaled("theta", 4096 / 6.2832)}, ["static poses: angles are", "counts?"]),
        ({"static": scaled("I", 1000.0)}, ["static poses: currents reach", "look like mA"]),
        ({"run": jumping}, ["run ident", "time jumps by 0.251 s after 0.699 s"]),
        ({"run": cut}, ["run ident", "starts in motion"]),
        ({"run": scaled("theta", 1e-4)}, ["encoder steps: nothing is excited"]),
        ({"static": moving}, ["static pose 5 contradicts the others"]),
        ({"toml": ("pose_latency_s = 0.0107", "pose_latency_s = 0.03")},
         ["10.", "ms before their rows", "says 30.0 ms"]),
        ({"toml": ("sample_rate_hz = 1000", "sample_rate_hz = 500")},
         ["time stamps are 0.001 s apart"]),
    ],
)  # fmt: skip
def test_spoiled_recordings_end_with_1(made, tmp_path, capsys, how, words):
    folder = spoiled(made, tmp_path, **how)
    assert main(["drive", str(folder), "--quiet"]) == 1
    said = capsys.readouterr().err
    missing = [word for word in words if word not in said]
    assert not missing, f"{missing} not in: {said}"
    assert not (folder / "results").exists()


@pytest.mark.slow
def test_what_no_run_excites_is_named_and_has_no_value(tmp_path, capsys):
    """All motors alike: the platform goes up and down, and nothing tells its inertia."""
    folder = write_session(tmp_path, 40, 0.06, robot="robot.toml")
    model, still = inca(), np.zeros(8)
    state = np.concatenate([rest_pose(model, still), np.zeros(6)])
    references = np.zeros((601, 8))
    references[100:300] = references[450:] = 1.0
    motion = simulate(model, state, references, 1000.0, currents_A=still)
    for name in ("ident", "check"):
        record = observed(motion, CENTRE, INSTRUMENTS, np.random.default_rng(len(name)))
        write_drive_run(folder / f"{name}.csv", record)
    head, _, tail = TOML.partition("[unknown]")
    few = '[unknown]\nkinematic = ["drum_m"]\ndynamic = ["mass_kg", "Ixx_kg_m2"]\n[static]'
    (folder / "drive.toml").write_text(head + few + tail.partition("[static]")[2])
    assert main(["drive", str(folder), "--quiet"]) == 0
    assert "Ixx_kg_m2 is not determined by these recordings" in capsys.readouterr().err
    document = json.loads((folder / "results" / "drive.json").read_text())
    found = {one["name"]: one for one in document["estimates"]["joint"]["parameters"]}
    assert found["Ixx_kg_m2"]["value"] is None
    assert abs(found["mass_kg"]["value"] - 0.289) < 4.0 * found["mass_kg"]["std"]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (('role = "validate"', 'role = "identify"'), ['no run has role = "validate"']),
        (('"Lx_m"', '"Lq_m"'), ["unknown.kinematic", "Lq_m", "Lx_m, Ly_m"]),
        (('"mass_kg"', '"arm_m"'), ["unknown.dynamic", "it belongs to the other list"]),
        (('"mass_kg"', '"mass_kg", "mass_kg"'), ["mass_kg is asked for twice"]),
        (("[0, 0, 0], q", "[0, 0, 9], q"), ["outside the robot's frame"]),
        (("q = [1, 0, 0, 0]", "q = [1, 1, 0, 0]"), ["encoder_zero.q"]),
        (('file = "static.csv"', 'file = "../static.csv"'), ["leads out of"]),
        (("encoder_step_rad", "encoder_steps_rad"), ["encoder_step_rad: missing", "unknown key"]),
    ],
)
def test_a_wrong_session_ends_with_2(made, tmp_path, capsys, change, words):
    folder = spoiled(made, tmp_path, toml=change)
    assert main(["drive", str(folder), "--quiet"]) == 2
    said = capsys.readouterr().err
    missing = [word for word in words if word not in said]
    assert not missing, f"{missing} not in: {said}"
