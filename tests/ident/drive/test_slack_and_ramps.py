"""Cables that would push, motors at their limits, and friction read from ramps."""

import json
from dataclasses import replace

import numpy as np
import pytest

from freeswing.cdpr.driven.behaviour import rest_pose, simulate
from freeswing.cdpr.driven.excitation import prbs, ramp
from freeswing.cdpr.driven.record import observed
from freeswing.cdpr.driven.statics import CENTRE
from freeswing.cdpr.files.drive_csv import read_drive_run, write_drive_run
from freeswing.ident.drive.identify import offsets_of
from freeswing.ident.drive.records.ramps import ramp_of
from freeswing.ident.drive.records.slack import LASTING_S, before_slack, first_slack
from freeswing.ident.drive.run_problem import DriveRun
from freeswing.main import main
from freeswing.session.drive_session import read_drive_session
from tests.cdpr.driven_robots import inca
from tests.ident.drive.made_sessions import INSTRUMENTS, TOML, write_flawed

FEW = '[unknown]\nkinematic = ["drum_m"]\ndynamic = ["coulomb_N_m", "mass_kg"]\n[static]'


def recorded(references, seed, model=None, theta=None):
    """The motion under references, and what the instruments tell of it."""
    model, still = inca() if model is None else model, np.zeros(8)
    state = np.concatenate([rest_pose(model, still, theta), np.zeros(6)])
    motion = simulate(model, state, references, 1000.0, theta, currents_A=still)
    return motion, observed(motion, CENTRE, INSTRUMENTS, np.random.default_rng(seed))


def fast(seconds):
    """The paper's Val e: at 5 Hz cables of the rigid model push."""
    generator = np.random.default_rng(3)
    return prbs(round(1000 * seconds) + 1, 8, 1000.0, (0.0, 1.0), 5.0, generator)


@pytest.fixture(scope="module")
def right(tmp_path_factory):
    """A right session of few unknowns."""
    folder = write_flawed(tmp_path_factory.mktemp("right"), 60, 0.3, {})
    head, _, tail = TOML.partition("[unknown]")
    (folder / "drive.toml").write_text(head + FEW + tail.partition("[static]")[2])
    return folder


@pytest.fixture
def folder(right, tmp_path):
    """A copy to change."""
    for file in right.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    return tmp_path


def identified(folder):
    assert main(["drive", str(folder), "--quiet"]) == 0
    return json.loads((folder / "results" / "drive.json").read_text())


def test_a_moment_is_no_slack_and_a_while_is():
    motion, _ = recorded(fast(0.05), 0)
    calm = replace(motion, tensions_N=np.ones_like(motion.tensions_N))
    rows = round(1000 * LASTING_S)
    for count, until in ((rows - 1, 51), (rows, 20)):
        tensions = np.ones_like(motion.tensions_N)
        tensions[20 : 20 + count, 3] = -0.1
        assert first_slack(replace(motion, tensions_N=tensions)) == until
    assert first_slack(calm) == 51
    assert first_slack(replace(calm, lengths_out_m=motion.tensions_N)) == 51


@pytest.mark.slow
def test_a_run_is_fitted_up_to_its_first_slack_cable(folder, capsys):
    motion, record = recorded(fast(1.5), 7)
    begins = motion.times_s[first_slack(motion)]
    assert 0.6 < begins < 1.4, begins
    write_drive_run(folder / "ident.csv", record)
    document = identified(folder)
    used = document["used"][0]
    assert not used["whole"]
    assert begins - 0.04 < used["seconds"] < begins
    assert abs(document["slack"][0]["from_s"] - begins) < 0.01
    for entry in document["estimates"]["joint"]["parameters"]:
        truth = inca().declared[inca().index(entry["name"])]
        assert abs(entry["value"] - truth) < 4.0 * entry["std"], entry
    said = capsys.readouterr().err
    assert "nothing is fitted to, or judged by, what follows" in said
    assert document["residual"]["times_noise"]["ident"] < 1.2


def test_a_run_that_is_slack_at_once_is_refused(right):
    session = read_drive_session(right / "drive.toml").session
    model, theta = session.model, session.model.declared
    zero = offsets_of(session, theta, None)
    motion, record = recorded(2.0 * fast(0.8), 8)  # twice the current of Val e
    assert 150 < first_slack(motion) < 300
    run = DriveRun("jerk", "identify", record, 1000.0)
    with pytest.raises(ValueError, match=r"run jerk: cable . is slack from 0\.2\d s on"):
        before_slack(model, theta, (run,), zero)
    kept = before_slack(model, theta, (run,), zero, at_least=True)[0]
    assert len(kept.record.times_s) == 500


@pytest.mark.slow
def test_a_motor_gives_no_more_than_its_limit(folder, capsys):
    references = np.full((301, 8), 0.5)
    references[50:150, 1] = 3.0
    _, record = recorded(references, 9)
    asked = references.copy()
    asked[50:150, 1] = 4.2
    write_drive_run(folder / "ident.csv", replace(record, references_A=asked))
    document = identified(folder)
    assert document["saturated"] == [{"run": "ident", "samples": 100, "motors": ["2"]}]
    assert document["residual"]["times_noise"]["ident"] < 1.2
    assert "asked for more than current_limits_A" in capsys.readouterr().err


def test_what_is_a_ramp(right):
    still = DriveRun("a", "validate", read_drive_run(right / "check.csv", 8), 1000.0)
    assert ramp_of(still) is None
    for slope in (1.0, 0.25):
        references = ramp(301, 8, 1000.0, (0.0, 3.0), slope, 4)
        run = replace(still, record=recorded(references, 1)[1])
        assert ramp_of(run) == (4, pytest.approx(slope))
    backwards = replace(run, record=replace(run.record, references_A=references[::-1]))
    assert ramp_of(backwards) is None


@pytest.mark.slow
def test_a_ramp_reads_what_its_estimate_reads(folder):
    """The paper's reading is later than break-away: so is that of the simulated ramp."""
    toml = (folder / "drive.toml").read_text()
    for motor in (1, 5):
        references = ramp(401, 8, 1000.0, (0.0, 3.0), 1.0, motor - 1)
        write_drive_run(folder / f"ramp{motor}.csv", recorded(references, motor)[1])
        toml += f'[[runs]]\nname = "r{motor}"\nrole = "validate"\nfile = "ramp{motor}.csv"\n'
    (folder / "drive.toml").write_text(toml)
    document = identified(folder)
    assert [one["motor"] for one in document["ramps"]] == ["1", "5"]
    for one in document["ramps"]:
        assert abs(one["slope_A_s"] - 1.0) < 1e-9
        assert abs(one["breakaway_s"] - one["estimate_N_m"] / 0.0603) < 1e-6
        assert 0.07 < one["breakaway_s"] < 0.076  # 73 ms
        # A sample and a count: 1 mA and as much of creep.
        gap = one["ramp_N_m"] - one["estimate_on_this_ramp_N_m"]
        assert abs(gap) < 3e-4, one
        assert one["slope_costs_N_m"] > 3e-4, one
        assert one["moved_s"] > one["breakaway_s"], one
