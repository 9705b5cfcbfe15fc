"""Rendered sessions through calibrate and track: errors of the poses against truth.

Four 720 x 576 cameras at 2.3 m, six tags of 13 cm on three faces of the platform, four surveyed
tags behind it, a ChArUco board filmed for the calibration; noise 2 grey levels. Scenarios: as it
should be, 30 % of the tags hidden, one camera 6 ms late, one knocked by 0.35 degrees after the
calibration, and the true cameras in place of the calibrated ones.

    python benchmarks/cameras/vision_session.py [--frames 200] [--folder DIR] [SCENARIO ...]
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from freeswing.calib.calibrate import calibrate_session
from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.cameras_file import read_cameras, write_cameras
from freeswing.cdpr.files.documents import write_json
from freeswing.cdpr.files.trajectory_files import read_trajectory
from freeswing.cdpr.measured.target import Target
from freeswing.cdpr.rotation import exp_rotation, log_rotation
from freeswing.vision.render.patterns import charuco_patch, plain_patch
from freeswing.vision.render.record import record
from freeswing.vision.rig.moved_cameras import moved_by
from tests.vision.films import tracked
from tests.vision.scenes import (
    SurveyedTag,
    arc_of_cameras,
    facing,
    platform_tags,
    scene_of,
    standing_tags,
    swing,
)

BOARD = {
    "kind": "charuco",
    "squares": [9, 6],
    "square_m": 0.06,
    "marker_m": 0.045,
    "dictionary": "DICT_5X5_100",
}
KNOCK_RAD = np.array([0.0035, -0.0045, 0.002])
SCENARIOS = ("plain", "true-cameras", "occluded", "late", "knocked")


@dataclass
class FilmedRun:
    """A run as tracking needs it."""

    name: str
    video: Path


def carried(times_s):
    """A board moved slowly through the working volume, tilted every way."""
    t = np.asarray(times_s)[:, None]
    way = np.array([0.4, 0.3, 0.3]) * np.sin(t * [1.3, 0.9, 2.1] + [0.0, 1.0, 0.5])
    tilt = np.array([0.5, 0.3, 0.55]) * np.sin(t * [1.7, 1.1, 0.8] + [0.0, 2.0, 0.3])
    return way - [0.0, 0.2, 0.0], exp_rotation(tilt)


def film_calibration(folder: Path, cameras: tuple[Camera, ...]) -> None:
    """The board and the surveyed tags."""
    board = charuco_patch((9, 6), 0.06, 0.045, "DICT_5X5_100").moved(facing(), "platform")
    scene = scene_of((), standing_tags(), motion=carried, extra=(board,))
    record(folder, cameras, scene, np.arange(60) / 10.0, seed=11)


def hiding_patches(share: float, seconds: float, seed: int):
    """Grey patches in front of each tag, each there for the given share of the time."""
    random = np.random.default_rng(seed)
    patches = []
    for tag in platform_tags():
        pose = tag.T_platform_tag.copy()
        pose[:3, 3] += 0.01 * pose[:3, 2] + random.uniform(-0.03, 0.03) * pose[:3, 0]
        windows = tuple(
            (0.1 * k, 0.1 * k + 0.1)
            for k in range(int(seconds * 10) + 1)
            if random.random() < share
        )
        patches.append(plain_patch(0.4, (0.12, 0.17), pose, "platform", windows))
    return tuple(patches)


def film_run(folder: Path, cameras: tuple[Camera, ...], scenario: str, frames: int) -> FilmedRun:
    """One swing as the scenario has it."""
    truth = list(cameras)
    if scenario == "late":
        truth[2] = replace(truth[2], clock_offset_s=-0.006)
    if scenario == "knocked":
        truth[1] = moved_by(truth[1], np.concatenate([np.zeros(3), KNOCK_RAD]))
    extra = hiding_patches(0.3, frames / 100.0, 3) if scenario == "occluded" else ()
    place = folder / "runs" / ("plain" if scenario == "true-cameras" else scenario)
    if not place.is_dir():
        scene = scene_of(platform_tags(), standing_tags(), extra=extra)
        record(place, truth, scene, np.arange(frames) / 100.0, seed=5)
    return FilmedRun(scenario, place)


def figures(folder: Path, scenario: str, document: dict) -> dict:
    """Errors of a tracked run."""
    trajectory = read_trajectory(folder / scenario / "tracks" / f"{scenario}.csv")
    known = trajectory.is_known
    positions, rotations = swing(trajectory.times_s)
    turn = log_rotation(trajectory.rotations()[known] @ np.swapaxes(rotations[known], 1, 2))
    error = np.concatenate([(trajectory.positions() - positions)[known], turn], axis=1)
    covariances = np.asarray(trajectory.covariances)[known]
    scatter = error - error.mean(axis=0)
    score = np.einsum("ni,nij,nj->n", scatter, np.linalg.inv(covariances), scatter).mean() / 6
    return {
        "scenario": scenario,
        "poses": int(known.sum()),
        "bias_mm": float(1e3 * np.linalg.norm(error[:, :3].mean(axis=0))),
        "scatter_mm": float(1e3 * error[:, :3].std(axis=0).max()),
        "scatter_mrad": float(1e3 * error[:, 3:].std(axis=0).max()),
        "worst_mm": float(1e3 * np.linalg.norm(error[:, :3], axis=1).max()),
        "scatter_squared_over_claim": float(score),
        "calibration_std_mm": document["runs"][0]["calibration_std_mm"],
        "reprojection_px": document["runs"][0]["reprojection_px"],
        "effects": [
            {"effect": e["effect"], "camera": e["camera"], **e["parameters"][0]}
            for e in document["effects"]
        ],
    }


def main() -> None:
    """Films, calibrates, tracks and prints."""
    parser = argparse.ArgumentParser(description="Rendered sessions through calibrate and track.")
    parser.add_argument("scenarios", nargs="*", default=SCENARIOS)
    parser.add_argument("--frames", type=int, default=200)
    parser.add_argument("--folder", type=Path)
    options = parser.parse_args()
    folder = options.folder or Path(tempfile.mkdtemp())
    truth = arc_of_cameras()
    base = [SurveyedTag(tag) for tag in standing_tags()]
    if not (folder / "cameras.toml").is_file():
        film_calibration(folder / "calibration", truth)
        start = time.perf_counter()
        found = calibrate_session(folder / "calibration", BOARD, base)
        write_cameras(folder / "cameras.toml", found.cameras)
        write_json(folder / "calibration.json", found.document)
        print(f"calibrated in {time.perf_counter() - start:.1f} s")
    rows = []
    for scenario in options.scenarios:
        run = film_run(folder, truth, scenario, options.frames)
        cameras = truth if scenario == "true-cameras" else read_cameras(folder / "cameras.toml")
        if scenario != "true-cameras":
            (folder / scenario).mkdir(exist_ok=True)
            shutil.copy(folder / "calibration.json", folder / scenario)
        start = time.perf_counter()
        document = tracked(
            [run], cameras, Target(platform_tags()), results=folder / scenario, base_tags=base,
            workers=1,
        )  # fmt: skip
        seconds = time.perf_counter() - start
        rows.append({**figures(folder, scenario, document), "seconds": seconds})
        row = rows[-1]
        print(
            f"{scenario:13s} {row['poses']} poses, bias {row['bias_mm']:.3f} mm, scatter "
            f"{row['scatter_mm']:.4f} mm {row['scatter_mrad']:.4f} mrad, worst "
            f"{row['worst_mm']:.3f} mm, scatter^2/claim {row['scatter_squared_over_claim']:.2f}, "
            f"calibration may shift {row['calibration_std_mm'] or 0.0:.3f} mm an axis, "
            f"{row['reprojection_px']:.3f} px, {seconds:.0f} s"
        )
        for effect in row["effects"]:
            print(
                f"    {effect['effect']} {effect['camera']}: {effect['name']} "
                f"{effect['value']:.6g} +- {effect['std']:.2g}"
            )
    print(json.dumps(rows))


if __name__ == "__main__":
    main()
