"""Runs with a payload, made by the independent simulator: the mass, and an inertia not spoilt."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from freeswing.cdpr.files.documents import dump_toml
from freeswing.cdpr.files.robot_file import write_robot
from freeswing.cdpr.files.trajectory_csv import write_csv
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.robot import INERTIA_NAMES, POSE_COORDINATES, Array, Platform
from freeswing.cdpr.rotation import angles_from_matrix
from freeswing.ident.likelihood.payload_runs import Loads, mass_of, point_inertia
from freeswing.ident.runs import Payload
from freeswing.main import main
from tests.ident.swings import TRUE_INERTIA
from tests.oracle.mechanics.world import Body
from tests.oracle.recorded.sessions import make_scene
from tests.oracle.scenes.robots import declared_robot, true_body
from tests.oracle.scenes.runs import TrueRun, draw_run

ROBOT = declared_robot("bologna-4")
PAYLOAD = Payload(1.5, np.array([0.15, -0.1, 0.05]))
CUBE_M = 0.1  # its side: a payload is no point
NOISE_M = 1e-4
DURATION_S = 5.0


def with_payload(body: Body) -> Body:
    """The body with a cube on."""
    own = np.r_[np.zeros(3), np.full(3, CUBE_M**2 / 6.0), np.zeros(3)]
    cube = point_inertia(PAYLOAD.position_m) + own
    platform = np.concatenate([body.com_m, body.specific_inertia_m2])
    mass = body.mass_kg + PAYLOAD.mass_kg
    both = (body.mass_kg * platform + PAYLOAD.mass_kg * cube) / mass
    return Body(mass, both[:3], both[3:])


def trajectory_of(run: TrueRun, generator: np.random.Generator) -> Trajectory:
    angles = angles_from_matrix(run.motion.rotations)
    values = np.column_stack([run.motion.positions_m, angles])
    std = NOISE_M * np.array([1, 1, 1, 5, 5, 5])
    noisy = values + std * generator.standard_normal(values.shape)
    return Trajectory(run.motion.times_s, POSE_COORDINATES, noisy)


@pytest.fixture(scope="module")
def weighed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Body, dict]:
    """The true body and what the command line makes of four runs without and three with it."""
    folder, generator = tmp_path_factory.mktemp("payload"), np.random.default_rng(21)
    body = true_body("bologna-4", generator)
    runs = []
    for k in range(7):
        loaded = k >= 4
        scene = make_scene(ROBOT, with_payload(body) if loaded else body, {}, generator)
        run = draw_run(scene, generator, DURATION_S, 100.0)
        write_csv(folder / f"swing-{k}.csv", trajectory_of(run, generator))
        row = {"name": f"swing-{k}", "role": "identify", "trajectory": f"swing-{k}.csv"}
        row |= {"cable_lengths_m": run.world.length, "cable_lengths_std_m": 5e-4}
        row |= {"window_s": [0.0, DURATION_S]}
        if loaded:
            row["payload"] = {"mass_kg": PAYLOAD.mass_kg, "position_m": PAYLOAD.position_m}  # pyright: ignore[reportArgumentType]
        runs.append(row)
    write_robot(folder / "robot.toml", replace(ROBOT, platform=Platform()))
    session = {"format": "freeswing-session/1", "name": "p", "robot": "robot.toml", "runs": runs}
    dump_toml(folder / "session.toml", session)
    status = main(["identify", str(folder), "--quiet"])
    assert status == 0, f"status {status}"
    text = (folder / "results" / "identification.json").read_text(encoding="utf-8")
    return body, json.loads(text)["estimates"]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ml_full", "ml_free"])
def test_the_mass_and_the_inertia_are_within_their_deviations(weighed, name: str):
    body, estimates = weighed
    rows = {row["name"]: row for row in estimates[name]["parameters"]}
    assert list(rows) == [*INERTIA_NAMES, "mass_kg"], f"{list(rows)}"
    truth = np.r_[body.com_m, body.specific_inertia_m2, body.mass_kg]
    values, std = (np.array([row[key] for row in rows.values()]) for key in ("value", "std"))
    z = (values - truth) / std
    assert np.abs(z).max() < 4.0, f"z-scores {np.round(z, 2)}"
    assert std[-1] < 0.01 * truth[-1], f"mass {values[-1]:.3f} +- {std[-1]:.3f} kg"


@pytest.mark.slow
def test_the_likelihood_weighs_better_than_the_published_way(weighed):
    body, estimates = weighed
    stds = {name: estimates[name]["parameters"][-1]["std"] for name in ("ml_full", "fidim_full")}
    off = abs(estimates["ml_full"]["parameters"][-1]["value"] - body.mass_kg)
    assert stds["ml_full"] < stds["fidim_full"], f"{stds}"
    assert off < 3.0 * stds["fidim_full"], f"{off} kg off, {stds}"


def test_slopes_of_the_loaded_inertia_are_those_of_differences():
    other = Payload(2.0, np.array([0.0, 0.1, 0.05]))
    loads = Loads.of([None, PAYLOAD, other, PAYLOAD])
    assert loads.of_run == (-1, 0, 1, 0), f"{loads.of_run}"
    unknowns = loads.start(8.0) + 1e-3 * np.arange(loads.count)
    everything = np.concatenate([TRUE_INERTIA, unknowns])
    for run in range(4):
        steps = 1e-6 * np.eye(len(everything))
        ends = [
            _loaded(loads, run, everything + s) - _loaded(loads, run, everything - s) for s in steps
        ]
        slopes = np.hstack(loads.slopes(run, TRUE_INERTIA, unknowns))
        gap = np.abs(np.array(ends).T / 2e-6 - slopes).max()
        assert gap < 1e-8, f"run {run}: off by {gap}"


def _loaded(loads: Loads, run: int, everything: Array) -> Array:
    return loads.inertia(run, everything[:9], everything[9:])


def test_a_mass_that_does_not_stand_out_is_refused():
    with pytest.raises(ValueError, match="no usable mass"):
        mass_of(0.1, 0.08)
    found = mass_of(0.125, 0.001)
    assert found.mass_kg == pytest.approx(8.0), found
    assert found.std_kg == pytest.approx(0.064), found
