"""Result documents as the commands write them, for the report's tests."""

from __future__ import annotations

from typing import Any

import numpy as np

from freeswing.cdpr.robot import INERTIA_NAMES
from freeswing.report.material import Material
from freeswing.results.calibration import Calibration
from freeswing.results.check import Check, Found
from freeswing.results.diagnosis import Diagnosis
from freeswing.results.identification import Identification
from freeswing.results.motion import Motion
from freeswing.results.tracking import Tracking
from tests.oracle.scenes.robots import declared_robot

VALUES = (0.0016, -0.0025, 0.2, 0.0563, 0.0627, 0.0322, 1e-4, -3e-4, 2e-4)
HOSTILE = "<script>alert('x')</script> & \"quotes\""


def whole_material(title: str = "lab-day-1") -> Material:
    """Every result that a session can have."""
    rng = np.random.default_rng(0)
    kinds = {"fidim_free": 2.0, "fidim_full": 1.5, "ml_free": 0.2, "ml_full": 0.1}
    return Material(
        title,
        calibration=Calibration.from_json(_calibration()),
        tracking=Tracking.from_json(_tracking()),
        identification=Identification.from_json(
            {
                "format": "freeswing-identification/1",
                "estimates": {name: _estimate(spread, rng) for name, spread in kinds.items()},
                "comparison": {
                    kind: [{"name": n, "difference_percent": 1.2, "z": 0.4} for n in INERTIA_NAMES]
                    for kind in ("fidim", "ml")
                },
                "validation": [_validation(f"check-{k:02d}", rng) for k in range(8)],
                "swings": [_swing(k, rng) for k in range(12)],
                "entries_m": [[0.2, -1.3, 0.5], [2.3, -1.2, 0.5], [2.2, 1.0, 0.6], [0.1, 0.8, 0.5]],
                "markers": _markers(),
                "provenance": {
                    "versions": {"freeswing": "0.1.0"},
                    "settings": {},
                    "inputs": {"robot.toml": "ab" * 32},
                },
            }
        ),
        diagnosis=Diagnosis.from_json(_diagnosis()),
        motion=Motion.from_json(
            {"format": "freeswing-motion/1", "runs": [_motion(k, rng) for k in range(5)]}
        ),
        fitted=Motion.from_json(
            {
                "format": "freeswing-motion/1",
                "fitted": [_fitted(k, rng) for k in range(3)],
            }
        ),
        check=Check(
            findings=(Found(level="warning", subject="run swing-03", text="12 % missing"),)
        ),
        robot=declared_robot("bologna-4"),
    )


def _markers() -> dict[str, Any]:
    runs = [
        {
            "run": f"swing-{k:02d}",
            "rigidity_um": [12.0 + k, 20.0, 740.0 if k == 1 else 25.0, None],
            "left_out": ["front"] if k == 1 else [],
            "all_um": 368.0 if k == 1 else 22.0,
            "kept_um": 21.0,
            "frame_std_mm": [0.06, 0.07, 0.05],
            "frame_std_mrad": [0.5, 0.4, 0.3],
            "correlation_s": 0.4,
        }
        for k in range(3)
    ]
    names = ["P", "left", "front", "right"]
    off = [0.08, 0.2, 0.24, None]
    return {"names": names, "off_target_mm": off, "run_std_mm": 0.16, "runs": runs}


def _estimate(spread: float, rng: np.random.Generator) -> dict[str, Any]:
    return {
        "parameters": [
            {
                "name": name,
                "value": value + spread * abs(value) * 0.02 * rng.normal(),
                "std": spread * abs(value) * 0.02,
                "std_percent": 2 * spread,
                "essential": abs(value) > 1e-3,
            }
            for name, value in zip(INERTIA_NAMES, VALUES, strict=True)
        ],
        "sigma_W": 0.1,
        "cost_C": 8.4,
        "samples": 15000,
        "correlation": _correlation(rng),
        "dropped_runs": [{"run": "swing-03", "why": f"12 % of the samples are missing {HOSTILE}"}],
    }


def _correlation(rng: np.random.Generator) -> list[list[float]]:
    rows = rng.normal(size=(40, 9)) @ rng.normal(size=(9, 9))
    return np.corrcoef(rows, rowvar=False).tolist()  # pyright: ignore[reportReturnType]


def _fitted(k: int, rng: np.random.Generator) -> dict[str, Any]:
    """Full poses, one sample missing."""
    times = np.arange(0.0, 6.0, 0.02)
    shape = np.array([0.1, 0.05, 0.01, 0.05, 0.04, 0.02])
    rates = np.array([4.0, 3.3, 8.0, 4.0, 3.3, 5.0])
    exact = np.array([1.2, -0.2, -0.9, 0, 0, 0]) + shape * np.sin(np.outer(times, rates) + k)
    measured = (exact + 1e-4 * rng.normal(size=exact.shape)).tolist()
    measured[50] = [None] * 6
    return {
        "run": f"swing-{k:02d}",
        "role": "identify",
        "times_s": times.tolist(),
        "coordinates": ["x", "y", "z", "phi", "theta", "chi"],
        "measured": measured,
        "before": exact.tolist(),
    }


def _validation(run: str, rng: np.random.Generator) -> dict[str, Any]:
    sigma = 0.2 + 0.1 * rng.random()
    return {
        "run": run,
        "sigma_perp": sigma,
        "prediction_rmse_m": 0.004,
        "noise_floor_m": 0.0001,
    }


def _swing(k: int, rng: np.random.Generator) -> dict[str, Any]:
    place = [1.0 + 0.5 * rng.random(), rng.random() - 0.5, -0.9]
    return {
        "run": f"swing-{k:02d}",
        "role": "identify" if k % 3 else "validate",
        "equilibrium": {"position_m": place, "angles_rad": [0.01, 0.02, 0.3]},
        "frequencies_hz": [0.61, 0.77],
        "conditioning": 3.2,
    }


def _candidate(effect: str, verdict: str, gain: float | None, others: list[str]) -> dict[str, Any]:
    bic = None if gain is None else -800.0 * gain
    return {
        "effect": effect,
        "verdict": verdict,
        "delta_bic": bic,
        "held_out_gain": gain,
        "confounded_with": others,
    }


def _diagnosis() -> dict[str, Any]:
    drag = {"name": "rate_1_s", "value": 0.05, "std": 0.001}
    return {
        "format": "freeswing-diagnosis/1",
        "before": {"sigma_perp": 0.9, "prediction_rmse_m": 0.011, "noise_floor_m": 1e-4},
        "after": {"sigma_perp": 0.11, "prediction_rmse_m": 2e-4, "noise_floor_m": 1e-4},
        "candidates": [
            _candidate("translational_drag", "accepted", 0.93, []),
            _candidate("quadratic_drag", "confounded", 0.4, ["translational_drag"]),
            _candidate("tether", "rejected", -0.01, []),
            _candidate("winch_creep", "not_identifiable", None, []),
        ],
        "accepted": [{"effect": "translational_drag", "parameters": [drag]}],
        "parameters_before": [],
        "parameters_after": [],
        "unexplained": {
            "present": True,
            "signature": f"chi swings by 0.4 mrad at 7.3 Hz {HOSTILE}",
            "evidence": {"frequency_hz": 7.3, "coordinate": "chi"},
        },
        "lengths": _lengths(),
        "decay": [
            {
                "run": f"swing-{k}",
                "times_s": [1.0, 3.0, 5.0],
                "measured_m_s": [0.1 * (k + 1), 0.08 * (k + 1), 0.07 * (k + 1)],
                "before_m_s": [0.1 * (k + 1)] * 3,
                "after_m_s": [0.1 * (k + 1), 0.081 * (k + 1), None],
            }
            for k in range(8)
        ],
    }


def _lengths() -> dict[str, Any]:
    place = {"values": [2.3e-3, -5.4e-3, -4e-3], "std": [1.9e-3, 3e-3, 1.7e-3]}
    return {
        "wrong": [
            {
                "part": "attachment_offset:2",
                "probability": 0.997,
                **place,
                "rivals": [{"part": "anchor_offset:2", "probability": 0.1, **place}],
            }
        ],
        "probabilities": {"attachment_offset:2": 0.92, "anchor_offset:2": 0.1, HOSTILE: 0.01},
        "runs": [
            {"run": f"swing-{k}", "before_m": 1e-4, "after_m": 2e-5, "slow_errors": 1.0 + 8.0 * k}
            for k in range(2)
        ],
        "besides": {"cable_elasticity": {"values": [1e-4], "std": [3e-5]}},
    }


def _motion(k: int, rng: np.random.Generator) -> dict[str, Any]:
    times = np.arange(0.0, 10.0, 0.01)
    exact = np.stack([0.1 * np.sin(4 * times), 0.08 * np.cos(3.3 * times)], axis=1)
    measured = (exact + 1e-4 * rng.normal(size=exact.shape)).tolist()
    measured[100] = [None, None]
    return {
        "run": f"check-{k:02d}",
        "role": "validate",
        "times_s": times.tolist(),
        "coordinates": ["x", "y"],
        "measured": measured,
        "before": (exact * (1 + 0.02 * times[:, None])).tolist(),
        "after": exact.tolist(),
    }


def _calibration() -> dict[str, Any]:
    camera = {
        "q_camera_base": [0.7, 0.7, 0.1, 0.1],
        "frames": 50,
        "frames_with_board": 30,
        "coverage": 0.87,
        "reprojection_px": 0.031,
        "held_out_px": 0.033,
        "position_std_m": [1e-4, 2e-4, 1e-4],
        "rotation_std_rad": [5e-5, 6e-5, 3e-5],
        "clock_offset_s": 0.0031,
        "clock_offset_std_s": 1e-5,
    }
    places = {"cam0": [0.0, 0.0, 2.0], "cam1": [-1.0, 0.0, 1.5]}
    return {
        "format": "freeswing-calibration/1",
        "verdict": {"usable": True, "reasons": [], "warnings": [f"few views {HOSTILE}"]},
        "cameras": [{**camera, "name": n, "t_camera_base_m": t} for n, t in places.items()],
        "checks": {"length_rms_m": 1e-5, "survey_rms_m": 2e-5},
        "dropped_views": ["cam1/000012.png: 68 px from any board"],
    }


def _tracking() -> dict[str, Any]:
    cameras = [{"camera": name, "consistency_mm": 0.05} for name in ("cam0", "cam1")]
    run = {
        "samples": 200,
        "known": 198,
        "reprojection_px": 0.03,
        "consistency_mm": 0.06,
        "position_std_mm": 0.007,
        "rotation_std_mrad": 0.02,
        "cameras": cameras,
        "problems": ["cam1: tag36h11 2 left out 31 times"],
    }
    late = {
        "effect": "clock_offset",
        "run": "swing-01",
        "camera": "cam1",
        "parameters": [{"name": "offset_s", "value": 6e-5, "std": 1e-6}],
        "before": {"consistency_mm": 0.2},
        "after": {"consistency_mm": 0.06},
    }
    runs = [{**run, "run": name} for name in ("swing-01", "check-01")]
    return {"format": "freeswing-tracking/1", "runs": runs, "effects": [late]}
