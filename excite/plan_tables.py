"""A plan of swings as documents: excitation.json, and the tables to take to the robot."""

from __future__ import annotations

import numpy as np

from freeswing.cdpr.robot import INERTIA_NAMES, Array
from freeswing.excite.plan import ExcitationOptions, Plan
from freeswing.excite.swing import Bench, Swing
from freeswing.excite.winch_release import WinchRelease

_GOOD_COST = 10.0  # FIDIM 2022, after eq. (42): optimal below


def plan_document(bench: Bench, options: ExcitationOptions, plan: Plan) -> dict:
    """results/excitation.json as a dictionary."""
    document = {
        "format": "freeswing-excitation/1",
        "cost_C": plan.cost,
        "equilibria": [
            _entry(bench, swing, k, plan.releases) for k, swing in enumerate(plan.swings)
        ],
        "criterion": options.criterion,
        "free_coordinates": list(bench.free),
        "samples_per_swing": bench.n_samples,
        "duration_s": bench.duration_s,
        "limits": {
            "tension_N": list(options.limits.tension_N),
            "reach_m": options.limits.reach_m,
            "amplification": options.limits.amplification,
        },
        "mass_kg": bench.mass_kg,
        "predicted_std": dict(zip(INERTIA_NAMES, plan.std.tolist(), strict=True)),
        "starts": {"count": len(plan.start_costs), "costs": list(plan.start_costs)},
        "refinement": list(plan.history),
        "seconds": dict(zip(("library", "starts", "refinement"), plan.seconds, strict=True)),
        "random_plans": None,
    }
    if len(plan.random):
        quantiles = np.quantile(plan.random, [0.0, 0.1, 0.5, 0.9, 1.0]).tolist()
        document["random_plans"] = {
            "count": len(plan.random),
            "quantiles": dict(zip(("0", "10", "50", "90", "100"), quantiles, strict=True)),
            "share_below_10": float((plan.random < _GOOD_COST).mean()),
        }
    return document


def plan_table(bench: Bench, plan: Plan) -> str:
    """The table to take to the robot: one swing a row, as CSV."""
    names = [cable.name for cable in bench.model.robot.cables]
    free = bench.free_indices
    header = ["swing", *(f"l_{name}_m" for name in names)]
    header += [f"rest_{c}" for c in bench.free] + [f"displace_{c}" for c in bench.free]
    header += ["lowest_tension_N", "highest_tension_N"]
    header += [f"frequency_{k + 1}_hz" for k in range(len(free))]
    rows = [",".join(header)]
    for k, swing in enumerate(plan.swings):
        rest = swing.equilibrium
        away = (swing.release - rest.zeta)[free]
        numbers = [*rest.lengths_m, *rest.zeta[free], *away]
        tail = [*swing.tension_N, *swing.frequencies_hz]
        cells = [str(k + 1), *(f"{v:.4f}" for v in numbers), *(f"{v:.2f}" for v in tail)]
        rows.append(",".join(cells))
    return "\n".join([*rows, ""])


def release_table(bench: Bench, release: WinchRelease) -> str:
    """What each winch is told, as CSV: t_s and one length a cable."""
    names = [f"l_{cable.name}_m" for cable in bench.model.robot.cables]
    rows = [",".join(["t_s", *names])]
    for moment, lengths in zip(release.times_s, release.lengths_m, strict=True):
        rows.append(",".join([f"{moment:.3f}", *(f"{length:.6f}" for length in lengths)]))
    return "\n".join([*rows, ""])


def _entry(
    bench: Bench, swing: Swing, index: int, releases: tuple[WinchRelease | None, ...]
) -> dict:
    rest = swing.equilibrium
    entry = {
        "cable_lengths_m": rest.lengths_m.tolist(),
        "equilibrium": _pose_entry(rest.zeta),
        "release": _pose_entry(swing.release),
        "tension_range_N": list(swing.tension_N),
        "frequencies_hz": swing.frequencies_hz.tolist(),
        "conditioning": swing.amplification,
        "reach": dict(zip(bench.free, swing.reach.tolist(), strict=True)),
    }
    if releases:
        entry["winch_release"] = _release_entry(releases[index], index)
    return entry


def _release_entry(release: WinchRelease | None, index: int) -> dict | None:
    if release is None:
        return None
    return {
        "file": f"excitation-release/{index + 1:02d}.csv",
        "duration_s": release.duration_s,
        "phase_s": release.phase_s,
        "tension_range_N": list(release.tension_N),
        "fastest_m_s": release.fastest_m_s,
        "miss": list(release.miss),
    }


def _pose_entry(pose: Array) -> dict:
    return {"position_m": pose[:3].tolist(), "angles_rad": pose[3:].tolist()}
