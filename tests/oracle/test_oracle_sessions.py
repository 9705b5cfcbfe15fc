"""Sessions made by the independent simulator: readable, repeatable, taut, and noisy as told."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from freeswing.cdpr.files.robot_file import read_robot
from freeswing.cdpr.files.trajectory_files import read_trajectory
from freeswing.cdpr.measured.target import read_target
from freeswing.session.session_file import read_session
from tests.oracle.recorded.sessions import SessionTruth, make_scene, make_session
from tests.oracle.scenes.effects import EFFECTS, MAGNITUDES, SIZES
from tests.oracle.scenes.outside import OUTSIDE, OUTSIDE_MAGNITUDES
from tests.oracle.scenes.robots import declared_robot, true_body
from tests.oracle.scenes.runs import LEAST_TENSION_N, draw_run


@pytest.fixture(scope="module")
def poses(tmp_path_factory: pytest.TempPathFactory) -> SessionTruth:
    folder = tmp_path_factory.mktemp("poses")
    return make_session(folder, 11, "three-cable", {"marker_offset": "large"}, n_runs=3)


def test_product_reads_poses(poses: SessionTruth) -> None:
    session = read_session(poses.folder)
    robot = read_robot(session.robot)
    read_target(session.target)  # pyright: ignore[reportArgumentType]
    declared = declared_robot("three-cable")
    assert [run.role for run in session.runs] == ["identify", "identify", "validate"]
    assert robot.entries_m == pytest.approx(declared.entries_m)
    assert robot.swivel_axes == pytest.approx(declared.swivel_axes)
    assert robot.inertia == pytest.approx(declared.inertia)
    for run, true in zip(session.runs, poses.runs, strict=True):
        trajectory = read_trajectory(run.trajectory, robot)  # pyright: ignore[reportArgumentType]
        offset = true.motion.rotations @ poses.scene.marker_offset_m
        errors = trajectory.positions() - true.motion.positions_m - offset
        std = float(np.std(errors))
        assert std == pytest.approx(1e-4, rel=0.05), f"{std:.3g} m of noise"
        between = trajectory.rotations() @ true.motion.rotations.transpose(0, 2, 1)
        small = between[:, [2, 0, 1], [1, 2, 0]] - between[:, [1, 2, 0], [2, 0, 1]]
        std = float(np.std(0.5 * small))
        assert std == pytest.approx(5e-4, rel=0.05), f"{std:.3g} rad of noise"
        wrong = run.cable_lengths_m - true.world.length  # pyright: ignore[reportOptionalOperand]
        assert np.max(np.abs(wrong)) < 5 * 5e-4, f"lengths told wrong by {wrong} m"


def test_product_reads_free_coordinates_with_gaps(tmp_path: Path) -> None:
    truth = make_session(
        tmp_path, 12, "three-cable", pose=False, n_runs=2, missing_share=0.1, std_columns=True
    )
    session = read_session(tmp_path)
    trajectory = read_trajectory(session.runs[0].trajectory, read_robot(session.robot))  # pyright: ignore[reportArgumentType]
    assert trajectory.coordinates == ("x", "y", "chi")
    missing = float(np.mean(np.isnan(trajectory.values[:, 0])))
    assert 0.1 <= missing < 0.13, f"{missing:.3f} missing"
    R = truth.runs[0].motion.rotations
    chi = np.arctan2(-R[:, 0, 1], R[:, 0, 0])
    worst = float(np.nanmax(np.abs(trajectory.values[:, 2] - chi)))
    assert worst < 6 * 5e-4, f"chi off by {worst:.2e} rad"


def test_same_seed_same_files(tmp_path: Path) -> None:
    for name in ("a", "b"):
        make_session(tmp_path / name, 5, "bologna-4", {"tether": "small"}, n_runs=2, duration_s=1.0)
    files = sorted(p.relative_to(tmp_path / "a") for p in (tmp_path / "a").rglob("*.*"))
    different = [
        f for f in files if (tmp_path / "a" / f).read_bytes() != (tmp_path / "b" / f).read_bytes()
    ]
    assert different == []
    assert len(files) == 6, files


def test_truth_tells_everything(poses: SessionTruth) -> None:
    truth = json.loads((poses.folder / "truth" / "truth.json").read_text())
    assert [entry["effect"] for entry in truth["effects"]] == ["marker_offset"]
    assert truth["effects"][0]["distance_m"] == 0.015
    assert truth["in_catalogue"] is True
    tension = min(run["least_tension_n"] for run in truth["runs"])
    assert tension >= LEAST_TENSION_N, f"{tension} N"
    told = read_robot(poses.folder / "robot.toml").platform
    off = truth["mass_kg"] / told.mass_kg - 1.0
    assert 0.001 < abs(off) < 0.05, f"mass {off:.3f} off its nominal value"


def test_held_before_release_without_a_window(tmp_path: Path) -> None:
    make_session(tmp_path, 6, n_runs=2, duration_s=1.0, window=False)
    run = read_session(tmp_path).runs[0]
    moved = read_trajectory(run.trajectory).positions()  # pyright: ignore[reportArgumentType]
    still = float(np.max(np.std(moved[:100], axis=0)))
    assert run.window_s is None
    assert len(moved) == 201
    assert still < 1.3e-4, f"{still:.2e} m while held"


@pytest.mark.parametrize("name", [*EFFECTS, *OUTSIDE])
def test_every_effect_makes_a_run(name: str) -> None:
    """In every size; what is seen or told must differ from the same draw without the effect."""
    table = OUTSIDE_MAGNITUDES if name in OUTSIDE else MAGNITUDES
    declared = declared_robot("bologna-4")
    body = true_body("bologna-4", np.random.default_rng(2))
    plain = make_scene(declared, body, {}, np.random.default_rng(3))
    for size in SIZES:
        scene = make_scene(declared, body, {name: size}, np.random.default_rng(3))
        run = draw_run(scene, np.random.default_rng(8), 0.5, 100.0)
        changed = [key for key in scene.world._fields if not _same(scene.world, plain.world, key)]
        changed += [
            key
            for key in ("marker_offset_m", "length_bias_m", "orientation_delay_s", "clock_rate")
            if np.any(getattr(scene, key) != getattr(plain, key))
        ]
        assert changed, f"{name} {size} changes nothing"
        assert scene.record[0][table[name][0]] == table[name][1 + SIZES.index(size)]
        assert run.motion.tensions_n.min() >= LEAST_TENSION_N


def _same(a: object, b: object, key: str) -> bool:
    return np.array_equal(getattr(a, key), getattr(b, key))


def test_unknown_names_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="not known"):
        make_session(tmp_path, 1, effects={"ghost": "small"})
    with pytest.raises(ValueError, match="must be a number"):
        make_session(tmp_path, 1, effects={"tether": "huge"})
    with pytest.raises(ValueError, match="not known"):
        make_session(tmp_path, 1, robot="octopus")
