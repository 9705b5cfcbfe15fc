"""Benches by an independent simulator: the object's inertia, with what the files do not say."""

from __future__ import annotations

from pathlib import Path

import pytest

from freeswing.ident.bench.identify_bench import identify_bench
from freeswing.session.load_bench import load_bench
from freeswing.session.load_swings import load_robot
from freeswing.session.session_file import read_session
from tests.oracle.recorded.benches import DECLARED_KG, make_bench


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
def test_the_objects_izz_by_poses_on_three_wires(tmp_path: Path, seed: int) -> None:
    """Undeclared: drag, a wire 2 mm long, a platform 5 % heavy. The object within 0.5 %."""
    truth = make_bench(tmp_path, seed, wires=3, seen="poses", duration_s=6.0)
    session = read_session(tmp_path)
    robot = load_robot(session)
    told = identify_bench(load_bench(session, robot, None), robot).document()
    bodies = {
        one["name"]: {row["name"]: row for row in one["parameters"]} for one in told["objects"]
    }
    found = bodies["object"]["Izz_kg_m2"]
    off = found["value"] / truth.load_izz - 1.0
    assert abs(off) < 0.005, off
    assert abs(found["value"] - truth.load_izz) < 3.0 * found["std"], found
    mass = bodies["platform"]["mass_kg"]
    assert abs(mass["value"] - truth.platform_kg) < 3.0 * mass["std"], mass
    said = f"contradict mass_kg = {DECLARED_KG:g} kg"
    assert any(said in note for note in told["notes"]), told["notes"]
