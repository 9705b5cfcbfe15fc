"""FIDIM and maximum likelihood against the Cramer-Rao bound on the paper's robot.

Twelve equilibria (FIDIM 2022, Table 2), x and y at 100 Hz for 10 s with 0.1 mm of noise, cable
lengths as stated or each wrong by an unknown 0.5 mm. Prints a table and a JSON line.

    python benchmarks/identify/identify_monte_carlo.py --draws 100 --length-error-mm 0.5

With `--record draws.jsonl` every draw is written down as it is done, and a run that was cut short
goes on from there.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from freeswing.cdpr.model.regressor import regressor
from freeswing.cdpr.robot import INERTIA_NAMES, Array
from freeswing.cdpr.simulation.free_swing import Motion
from freeswing.ident.fidim.fidim import fidim
from freeswing.ident.likelihood.blocks import first_unknowns
from freeswing.ident.likelihood.fit import fit
from freeswing.ident.likelihood.fit_swings import FreeSwing, Swings
from freeswing.ident.likelihood.guess_run_start import first_state
from freeswing.ident.likelihood.samples_and_noise import prepare
from freeswing.ident.runs import SwingRun
from freeswing.ident.signals.derivatives import SignalSettings
from freeswing.ident.signals.usable_runs import prepare_runs
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
    unknowns = first_unknowns(model, start, starts, [None] * len(samples))
    swings = Swings(model, tuple(samples), np.ones(2))
    return fit(swings, unknowns, FreeSwing(grow=at is None, own_noise=at is None))


def bound_of(motions: list[Motion], error_m: float) -> Array:
    """Cramer-Rao standard deviations of the nine parameters, (9,)."""
    return np.sqrt(np.diag(covariance_bound_of(motions, error_m)))


def covariance_bound_of(motions: list[Motion], error_m: float) -> Array:
    """Cramer-Rao covariance of the nine parameters, (9, 9).

    Taken at a fit from the truth to noisy samples: without noise the residuals are the
    integrator's, whose colour the fit would take for a model error and enlarge its covariance.
    """
    runs = runs_of(motions, np.random.default_rng(0), NOISE_M, 0.0)
    told = [replace(run, lengths_std_m=error_m or KNOWN_LENGTHS_STD_M) for run in runs]
    return likelihood(told, TRUE_INERTIA, motions).covariance[:9, :9]


def one_draw(motions: list[Motion], seed: int, draw: int, error_m: float) -> dict[str, Any]:
    """Both methods on one set of noisy runs, JSON-ready."""
    worked = time.process_time()
    runs = runs_of(motions, np.random.default_rng([seed, draw]), NOISE_M, error_m)
    prepared = prepare_runs(runs, paper_model(), SignalSettings())
    usable = [run.free for run in prepared.runs if run.free is not None]
    published = fidim([regressor(paper_model(), motion) for motion in usable])
    found = likelihood(runs, published.values)
    return {
        "seed": seed,
        "draw": draw,
        "length_error_mm": 1e3 * error_m,
        "ml": found.inertia.tolist(),
        "ml_std": found.stds.tolist(),
        "fidim": published.values.tolist(),
        "fidim_std": published.std.tolist(),
        "noise_m": found.noise[0],
        "correlation": found.correlation,
        "steps": found.steps,
        "reason": found.reason,
        "processor_s": time.process_time() - worked,
    }


def recorded_draws(record: Path, seed: int, error_mm: float) -> dict[int, dict[str, Any]]:
    """Draws already in the record, by number."""
    if not record.exists():
        return {}
    rows = [json.loads(line) for line in record.read_text().splitlines() if line.strip()]
    same = [r for r in rows if r["seed"] == seed and abs(r["length_error_mm"] - error_mm) < 1e-9]
    return {row["draw"]: row for row in same}


def main() -> None:
    """Run the draws that the record lacks, and report on all that were asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=100)
    parser.add_argument("--length-error-mm", type=float, default=0.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--record", type=Path, help="JSON lines, a draw each: added to, resumed")
    options = parser.parse_args()
    error_m = 1e-3 * options.length_error_mm
    motions = [tilted_swing(k) for k in range(len(PAPER_LENGTHS_M))]
    bound = bound_of(motions, error_m)
    done: dict[int, dict[str, Any]] = {}
    if options.record:
        done = recorded_draws(options.record, options.seed, options.length_error_mm)
    for draw in range(options.draws):
        if draw in done:
            continue
        done[draw] = one_draw(motions, options.seed, draw, error_m)
        if options.record:
            with options.record.open("a") as file:
                file.write(json.dumps(done[draw]) + "\n")
        seconds = done[draw]["processor_s"]
        print(f"draw {draw + 1}: {seconds:.1f} s of processor", file=sys.stderr, flush=True)
    report([done[draw] for draw in range(options.draws)], bound, options.length_error_mm)


def report(rows: list[dict[str, Any]], bound: Array, error_mm: float) -> None:
    """Table and JSON line."""
    summary = {}
    for method in ("ml", "fidim"):
        error = np.array([row[method] for row in rows]) - TRUE_INERTIA
        std = np.array([row[f"{method}_std"] for row in rows])
        summary[method] = {
            "rmse_over_bound": (np.sqrt(np.mean(error**2, axis=0)) / bound).round(3).tolist(),
            "coverage_95": np.mean(np.abs(error) < 1.96 * std, axis=0).round(3).tolist(),
        }
    percent = 100.0 * bound / np.abs(TRUE_INERTIA)
    seconds = float(np.mean([row["processor_s"] for row in rows]))
    print(f"{len(rows)} draws, lengths off by {error_mm} mm, {seconds:.1f} s of processor a draw")
    print("parameter  bound %   ML rmse/bound  cover   FIDIM rmse/bound  cover")
    for i, name in enumerate(NAMES):
        ml, tls = summary["ml"], summary["fidim"]
        print(
            f"{name:9} {percent[i]:8.4f} {ml['rmse_over_bound'][i]:12.2f} "
            f"{ml['coverage_95'][i]:9.2f} {tls['rmse_over_bound'][i]:14.1f} "
            f"{tls['coverage_95'][i]:9.2f}"
        )
    covered = [float(np.mean(summary[method]["coverage_95"])) for method in ("ml", "fidim")]
    print(f"all nine: intervals hold the truth {covered[0]:.3f} (ML), {covered[1]:.3f} (FIDIM)")
    out = {"bound_percent": percent.tolist(), **summary, "draws": len(rows)}
    print(json.dumps({**out, "length_error_mm": error_mm, "processor_s_a_draw": seconds}))


if __name__ == "__main__":
    main()
