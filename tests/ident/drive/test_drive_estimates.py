"""Estimates of driven robots against the truth and their own deviations."""

import json

import numpy as np
import pytest

from freeswing.cdpr.driven.model import build_driven
from freeswing.cdpr.driven.motion import simulate_driven
from freeswing.cdpr.driven.sensitivity import N_POSE, state_slopes
from freeswing.cdpr.driven.slopes import length_slope, moved, pose_map
from freeswing.cdpr.driven.statics import CENTRE, static_pose
from freeswing.cdpr.files.robot_file import read_robot
from freeswing.cdpr.model.batch import evaluate
from freeswing.ident.drive.direct_kinematics import poses_from_turns
from freeswing.ident.drive.inverse_dynamics import inverse_dynamics
from freeswing.ident.drive.kinematics import StaticPoses, as_published, most_likely, zero_turns
from freeswing.ident.drive.run_problem import DriveRun
from freeswing.ident.drive.unknowns import Asked, Group
from freeswing.main import main
from tests.cdpr.driven_robots import inca
from tests.ident.drive.made_sessions import (
    STD,
    STEP_RAD,
    recording,
    static_readings,
    write_session,
)
from tests.places import SAMPLES

KINEMATIC = ("Lx_m", "Ly_m", "Lz_m", "arm_m", "theta_xy_rad", "theta_xz_rad", "drum_m")
SINGLE = ("mass_kg", "Ixx_kg_m2", "motor_inertia_kg_m2", "viscous_N_m_s", "spring_N_m")
TIED = Group("Iyy_kg_m2", ("Iyy_kg_m2", "Izz_kg_m2"))
GEOMETRY = Asked(tuple(Group(name, (name,)) for name in KINEMATIC), 7)
DYNAMICS = Asked((*(Group(name, (name,)) for name in (*SINGLE, "coulomb_N_m")), TIED), 0)
# Cramer and Rao's bound for nine poses of 100 samples, in per cent, as the deviations say it.
BOUND = np.array([0.027, 0.024, 0.0135, 0.079, 0.0605, 0.153, 0.0117])


def initial():
    return build_driven(read_robot(SAMPLES / "inca-6d" / "robot-initial.toml"))


def readings(seed):
    return StaticPoses(*static_readings(seed), STD / 10.0, STEP_RAD / np.sqrt(12.0))


def test_kinematics_come_with_the_deviations_that_they_have():
    model, true_model = initial(), inca()
    truth = GEOMETRY.read(true_model, true_model.declared)
    scores, errors, old = [], [], []
    for seed in range(12):
        found = most_likely(model, model.declared, GEOMETRY, readings(seed), CENTRE)
        published = as_published(model, model.declared, GEOMETRY, readings(seed), CENTRE)
        std = np.sqrt(np.diag(found.covariance))
        assert np.allclose(100 * std / truth, BOUND, rtol=0.05), 100 * std / truth
        scores.append((found.values - truth) / std)
        errors.append(100 * (found.values / truth - 1))
        old.append(100 * (published.values / truth - 1))
    rms = np.sqrt(np.mean(np.square(errors), axis=0))
    # 12 seeds: the rms of one parameter scatters by a fifth; 1.7 is three such away.
    assert (rms < 1.7 * BOUND).all(), rms / BOUND
    inside = np.mean(np.abs(scores) < 1.96)
    assert 0.88 < inside <= 1.0, f"{inside:.3f} of the 95 % intervals hold the truth"
    worse = np.sqrt(np.mean(np.square(old), axis=0)) / rms
    assert worse.mean() > 1.1, f"(18) is {worse} times the likelihood's error"


@pytest.mark.slow
def test_intervals_of_the_geometry_hold_the_truth_as_often_as_they_say():
    """A hundred seeds that nothing was built with: 90 to 98 of 100, the issue's bounds."""
    model, true_model = initial(), inca()
    truth, inside = GEOMETRY.read(true_model, true_model.declared), []
    for seed in range(100, 200):
        found = most_likely(model, model.declared, GEOMETRY, readings(seed), CENTRE)
        std = np.sqrt(np.diag(found.covariance))
        inside.append(np.abs(found.values - truth) < 1.96 * std)
    share = np.mean(inside, axis=0)
    assert 0.90 < share.mean() < 0.98, share
    # Counts at rest are the same in every seed, and act as an error that does not average out.
    assert share.min() > 0.85, share


def test_poses_come_back_from_their_angles():
    model, generator = inca(), np.random.default_rng(3)
    poses = moved(CENTRE, generator.normal(size=(50, 6)) * np.repeat([0.2, 0.15], 3))
    turns = evaluate(length_slope(model), poses, model.declared)[0]
    found, left = poses_from_turns(model, model.declared, turns, CENTRE)
    assert np.abs(found[:, :3] - poses[:, :3]).max() < 1e-9
    assert np.abs(left).max() < 1e-9
    with pytest.raises(ValueError, match="no pose fits the motor angles of sample"):
        poses_from_turns(model, model.declared, -turns, CENTRE)


def test_inverse_dynamics_starts_within_three_per_cent_from_the_encoders_alone():
    model = inca()
    # Numbers that are 33 times wrong do not matter: the regression does not start from them.
    wrong = DYNAMICS.put(model, model.declared, 33.0 * DYNAMICS.read(model, model.declared))
    run = DriveRun("ident", "identify", recording(seed=9, seconds=4.0), 1000.0)
    zero = zero_turns(model, model.declared, CENTRE, Asked((), 0))[0]
    found = inverse_dynamics(model, wrong, DYNAMICS, [run], zero)
    error = found.values / DYNAMICS.read(model, model.declared) - 1.0
    assert np.abs(error).max() < 0.03, dict(zip(DYNAMICS.names, error, strict=True))


def test_slopes_of_a_motion_are_its_differences():
    model, still = inca(), np.zeros(8)
    chosen = ("arm_m", "coulomb_N_m", "Ixx_kg_m2")
    pose = static_pose(model, still).pose
    references = np.repeat(np.random.default_rng(2).integers(0, 2, (3, 8)), 100, axis=0) * 1.0

    # Friction so smooth that no step is refined: differences would see the refinement switch.
    smooth = {"coulomb_width_rad_s": 20.0}

    def run(changes=smooth, pose=pose, currents=still):
        theta = model.theta(smooth | changes)
        state = np.concatenate([pose, np.zeros(6)])
        return simulate_driven(model, state, references, 1000.0, theta, currents_A=currents)

    slopes = state_slopes(run(), chosen)
    shift, unit = np.array([0, 0, 0, 1e-6, 0, 0]), np.eye(8)[2]
    ends = [run(pose=moved(pose, s * shift)).states for s in (1, -1)]
    pairs = [(slopes[..., 3], (ends[0] - ends[1]) / 2e-6)]
    ends = [run(currents=s * 1e-4 * unit).states for s in (1, -1)]
    pairs.append((slopes[..., N_POSE + 2], (ends[0] - ends[1]) / 2e-4))
    for k, name in enumerate(chosen):
        value = model.declared[model.index(name)]
        ends = [run({name: value * (1 + s * 1e-5)}).states for s in (1, -1)]
        pairs.append((slopes[..., N_POSE + 8 + k], (ends[0] - ends[1]) / (2e-5 * value)))
    for found, expected in pairs:
        worst = np.abs(found - expected).max() / np.abs(expected).max()
        assert worst < 1e-5, f"{worst:.1e} apart"
    assert np.allclose(slopes[0, :7, :6], pose_map(pose))


@pytest.mark.slow
@pytest.mark.parametrize("seed", [70, 71])
def test_a_session_through_the_command_line(tmp_path, seed):
    """From Table 1's initial robot; 5 s of PRBS; every interval of 4 deviations holds the truth."""
    folder = write_session(tmp_path, seed, seconds=5.0)
    assert main(["drive", str(folder), "--quiet"]) == 0
    document = json.loads((folder / "results" / "drive.json").read_text())
    model = inca()
    limits = dict.fromkeys(KINEMATIC, 1.5e-4) | {"Ixx_kg_m2": 1e-3, "Iyy_kg_m2": 1e-3}
    limits |= dict.fromkeys(("viscous_N_m_s", "coulomb_N_m"), 2e-4)
    for entry in document["estimates"]["joint"]["parameters"]:
        truth = model.declared[model.index(entry["name"])]
        error = entry["value"] - truth
        assert abs(error) < 4.0 * entry["std"], (entry, truth)
        assert abs(error / truth) < limits.get(entry["name"], 1e-4), (entry, truth)
    assert document["estimates"]["output_error"]["second_start_z"] < 0.1
    held_out = [fit for fit in document["fit_percent"] if fit["role"] == "validate"]
    assert min(held_out[0]["matlab"]) > 99.9, held_out
