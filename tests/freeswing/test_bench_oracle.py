"""Benches by an independent simulator: the object's inertia, with what the files do not say."""

from __future__ import annotations

from pathlib import Path

import pytest

from freeswing.cdpr.files.trajectory_csv import read_csv, write_csv
from freeswing.ident.bench.identify_bench import identify_bench
from freeswing.session.load_bench import load_bench
from freeswing.session.load_swings import load_robot
from freeswing.session.session_file import read_session
from tests.oracle.recorded.benches import DECLARED_KG, make_bench


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
def test_the_objects_izz_by_poses_on_three_wires(tmp_path: Path, seed: int) -> None:
    """Undeclared: drag, a wire 2 mm long, a platform 5 % heavy. The object within 0.5 %.

    One sample has zeros for its pose, which is said.
    """
    truth = make_bench(tmp_path, seed, wires=3, seen="poses", duration_s=6.0)
    session = read_session(tmp_path)
    unseen = session.runs[0].trajectory
    assert unseen is not None
    write_csv(unseen, read_csv(unseen))  # with quaternions
    lines = unseen.read_text("utf-8").splitlines()
    lines[100] = ",".join([lines[100].split(",")[0], *["0"] * 7])
    unseen.write_text("\n".join(lines), "utf-8")
    robot = load_robot(session)
    told = identify_bench(load_bench(session, robot, None), robot).document()
    bodies = {
        one["name"]: {row["name"]: row for row in one["parameters"]} for one in told["objects"]
    }
    gap = "the quaternion 0 0 0 0 is taken as a gap in 1 sample, first in line 101"
    assert f"run {session.runs[0].name}: {gap}" in told["notes"]
    found = bodies["object"]["Izz_kg_m2"]
    off = found["value"] / truth.load_izz - 1.0
    assert abs(off) < 0.005, off
    assert abs(found["value"] - truth.load_izz) < 3.0 * found["std"], found
    mass = bodies["platform"]["mass_kg"]
    assert abs(mass["value"] - truth.platform_kg) < 3.0 * mass["std"], mass
    said = f"contradict mass_kg = {DECLARED_KG:g} kg"
    assert any(said in note for note in told["notes"]), told["notes"]
