"""The published experiment's recordings: times and the table of estimates.

    python benchmarks/identify/identify_bologna.py ../shared/real/bologna-2020

FIDIM with the authors' processing, with ours, with free coordinates chosen by the program, and
everything together with maximum likelihood. Prints a table and a JSON line.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from freeswing.ident.identify import IdentifySettings, identify
from freeswing.ident.likelihood.cable_ends import GeometryPriors
from freeswing.ident.signals.derivatives import SignalSettings
from freeswing.session.load_swings import load_robot, load_swings, load_target
from freeswing.session.session_file import read_session


def main() -> None:
    """Run every variant once."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--fidim-only", action="store_true")
    options = parser.parse_args()
    session = read_session(options.folder / "session.toml")
    robot = load_robot(session)
    begun = time.perf_counter()
    runs = list(load_swings(session, robot, load_target(session)))
    print(f"reading {len(runs)} runs: {time.perf_counter() - begun:.2f} s")
    alone = IdentifySettings(maximum_likelihood=False, predict=False)
    authors = replace(alone, signals=SignalSettings(processing="authors"))
    by_981 = replace(robot, gravity_m_s2=np.array([0.0, 0.0, -9.81]))
    chosen = replace(robot, free_coordinates=None)
    variants = {
        "authors' processing, g = 9.81": (by_981, authors),
        "ours, x and y": (robot, alone),
        "ours, x and y, weighted": (robot, replace(alone, weighting="covariance")),
        "ours, chosen coordinates": (chosen, alone),
    }
    if not options.fidim_only:
        variants["both methods, x and y"] = (robot, IdentifySettings())
        two_mm = GeometryPriors(entry_std_m=0.002, attachment_std_m=0.002)
        variants["both, cable ends to 2 mm"] = (robot, IdentifySettings(geometry=two_mm))
    summary = {}
    print("times in s: wall / processor; com in mm; inertia in 1e-3 m2; +- one std")
    for title, (one, settings) in variants.items():
        begun, worked = time.perf_counter(), time.process_time()
        found = identify(runs, one, settings)
        wall, worked = time.perf_counter() - begun, time.process_time() - worked
        print(f"\n{title}: {wall:.1f} / {worked:.1f} s")
        for name, entry in found.estimates.items():
            numbers = zip(1e3 * entry.values, 1e3 * entry.std, strict=True)
            cost = "" if entry.cost_C is None else f"C {entry.cost_C:.2f}"
            print(f"  {name:10} {cost:8}", *(f"{v:.2f}+-{s:.2f}" for v, s in numbers))
        for method, rows in found.comparison.items():
            told = (f"{r.name} {r.difference_percent:.2f} % z {r.z:.1f}" for r in rows)
            print(f"  {method}, full against free:", ", ".join(told))
        sigma = [run.sigma_perp for run in found.validation]
        print("  sigma_perp:", *(f"{r.run} {r.sigma_perp:.3g}" for r in found.validation))
        print(f"  sigma_perp of {found.best}: median {np.median(sigma):.3f}, max {max(sigma):.3f}")
        rmse = [1e3 * run.prediction_rmse_m for run in found.validation if run.prediction_rmse_m]
        if rmse:
            print(f"  predictions off by {np.median(rmse):.2f} mm, at most {max(rmse):.2f} mm")
        estimates = {
            name: {"values": entry.values.tolist(), "std": entry.std.tolist()}
            for name, entry in found.estimates.items()
        }
        summary[title] = {"wall_s": wall, "processor_s": worked, "estimates": estimates}
    print(json.dumps(summary))


if __name__ == "__main__":
    main()
