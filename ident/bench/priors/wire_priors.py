"""What is known of a bench's wires before any run: how far lengths may be off."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from freeswing.cdpr.model.batch import evaluate
from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.robot import POSE_COORDINATES, Array
from freeswing.ident.bench.runs import BenchRun
from freeswing.ident.likelihood.unknowns import Gaussian, Unknown

UNSTATED_LENGTH_STD_M = 1e-3  # by tape
EACH_LENGTH = 1e-4  # of a wire's length: what weights stretch and rehanging shifts
WRONG_LENGTH = 0.03  # of it: knots, hooks, a unit's slip; what is looked for where sway is seen

FROM_POSES_STD_M = 2e-3  # wire lengths from mean poses: as good as the wires' ends are known


def centred_block(
    name: str, values: Array, std: float, source: str, each_run: bool = False
) -> Unknown:
    """Changes of lengths that are zero but for their spread."""
    spread = np.full(values.shape[-1], std)
    return Unknown(name, values, spread, Gaussian(0.0 * spread, spread, source), each_run=each_run)


def with_lengths(model: Model, run: BenchRun) -> BenchRun:
    """A run of full poses without stated lengths gets those of its mean poses."""
    if run.lengths_m is not None:
        return run
    columns = {signal.column: signal.values for signal in run.signals}
    poses = np.stack([columns[name] for name in POSE_COORDINATES], axis=1)
    known = poses[np.isfinite(poses).all(axis=1)]
    lengths = evaluate(model.lengths, known, model.start_values)[0].mean(axis=0)
    return replace(run, lengths_m=lengths, lengths_std_m=run.lengths_std_m or FROM_POSES_STD_M)
