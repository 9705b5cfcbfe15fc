"""FIDIM and maximum likelihood against the Cramer-Rao bound on the paper's robot.

Twelve equilibria (FIDIM 2022, Table 2), x and y at 100 Hz for 10 s with 0.1 mm of noise, cable
lengths as stated or each wrong by an unknown 0.5 mm. Prints a table and a JSON line.

    python benchmarks/identify_monte_carlo.py --draws 100 --length-error-mm 0.5
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from cdpr.robot import INERTIA_NAMES, Array
from cdpr.simulation import Motion
from ident.fidim import fidim
from ident.guess import first_state
from ident.joint import State
from ident.likelihood import fit
from ident.motion import regressor
from ident.prepare import prepare_runs
from ident.runs import SwingRun
from ident.samples import prepare
from ident.signals import SignalSettings
from tests.ident.swings import PAPER_LENGTHS_M, TRUE_INERTIA, paper_model, recorded, tilted_swing

NOISE_M = 1e-4
KNOWN_LENGTHS_STD_M = 1e-6
NAMES = [name.split("_")[0] if name[0] == "I" else name[:5] for name in INERTIA_NAMES]


def runs_of(
    motions: list[Motion], generator: np.random.Generator, noise_m: float, error_m: float
) -> list[SwingRun]:
    """The motions recorded with noise, lengths told with independent errors."""
    found = []
    for k, motion in enumerate(motions):
        error = error_m * generator.standard_normal(4)
        run = recorded(motion, f"swing-{k:02d}", generator, noise_m, length_error_m=error)
        stated = np.broadcast_to(NOISE_M**2 * np.eye(2), (len(run.trajectory.times_s), 2, 2))
        std = error_m or KNOWN_LENGTHS_STD_M
        trajectory = replace(run.trajectory, covariances=stated)
        found.append(replace(run, trajectory=trajectory, lengths_std_m=std))
    return found


def likelihood(runs: list[SwingRun], start: Array, at: list[Motion] | None = None):
    """The fit, from the samples or from true states."""
    model = paper_model()
    samples = [prepare(run, run.window_s or (0.0, 10.0)) for run in runs]
    if at is None:
        starts = np.array([first_state(model, one, start) for one in samples])
    else:
        starts = np.array([np.concatenate([m.zetas[0], m.rates[0]]) for m in at])
    state = State(start, model.start_values, starts, np.ones(2))
    return fit(model, samples, state, estimate_scales=at is None, grow=at is None)


def main() -> None:
    """Run the draws."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=100)
    parser.add_argument("--length-error-mm", type=float, default=0.0)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    error_m = 1e-3 * options.length_error_mm
    motions = [tilted_swing(k) for k in range(len(PAPER_LENGTHS_M))]
    quiet = runs_of(motions, np.random.default_rng(0), 0.0, 0.0)
    bound_runs = [replace(run, lengths_std_m=error_m or KNOWN_LENGTHS_STD_M) for run in quiet]
    bound = likelihood(bound_runs, TRUE_INERTIA, motions).std
    rows: dict[str, list[Array]] = {"ml": [], "ml_std": [], "fidim": [], "fidim_std": []}
    begun = time.perf_counter()
    for draw in range(options.draws):
        generator = np.random.default_rng([options.seed, draw])
        runs = runs_of(motions, generator, NOISE_M, error_m)
        prepared = prepare_runs(runs, paper_model(), SignalSettings())
        usable = [run.free for run in prepared.runs if run.free is not None]
        published = fidim([regressor(paper_model(), motion) for motion in usable])
        found = likelihood(runs, published.values)
        for key, value in (
            ("ml", found.inertia),
            ("ml_std", found.std),
            ("fidim", published.values),
            ("fidim_std", published.std),
        ):
            rows[key].append(value)
        print(f"draw {draw + 1}: {time.perf_counter() - begun:.0f} s", file=sys.stderr, flush=True)
    report(rows, bound, options, time.perf_counter() - begun)


def report(rows: dict[str, list[Array]], bound: Array, options, seconds: float) -> None:
    """Table and JSON line."""
    summary = {}
    for method in ("ml", "fidim"):
        error = np.array(rows[method]) - TRUE_INERTIA
        std = np.array(rows[f"{method}_std"])
        summary[method] = {
            "rmse_over_bound": (np.sqrt(np.mean(error**2, axis=0)) / bound).round(3).tolist(),
            "coverage_95": np.mean(np.abs(error) < 1.96 * std, axis=0).round(3).tolist(),
        }
    percent = 100.0 * bound / np.abs(TRUE_INERTIA)
    print(f"{options.draws} draws, lengths off by {options.length_error_mm} mm, {seconds:.0f} s")
    print("parameter  bound %   ML rmse/bound  cover   FIDIM rmse/bound  cover")
    for i, name in enumerate(NAMES):
        ml, tls = summary["ml"], summary["fidim"]
        print(
            f"{name:9} {percent[i]:8.4f} {ml['rmse_over_bound'][i]:12.2f} "
            f"{ml['coverage_95'][i]:9.2f} {tls['rmse_over_bound'][i]:14.1f} "
            f"{tls['coverage_95'][i]:9.2f}"
        )
    out = {"bound_percent": percent.tolist(), **summary, "draws": options.draws}
    print(json.dumps({**out, "length_error_mm": options.length_error_mm, "seconds": seconds}))


if __name__ == "__main__":
    main()
