"""Where maximum likelihood may start: FIDIM's results, then the nominal inertia."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.model.free_motion import choose_free_coordinates
from freeswing.cdpr.model.regressor import regressor
from freeswing.cdpr.robot import Array
from freeswing.ident.fidim.fidim import fidim
from freeswing.ident.judge.physical_consistency import is_possible
from freeswing.ident.signals.usable_runs import PreparedRuns, guessed_inertia, usable

_POSES_A_RUN = 10


def likelihood_starts(
    model: Model, prepared: PreparedRuns, by_fidim: tuple[Array, ...]
) -> list[Array]:
    """Inertias to start from, in the order in which to try them, each (9,).

    Where poses were measured, FIDIM projected on the free coordinates that serve best comes first:
    those declared may be near a singularity, which spoils every projection on them.

    Args:
        model: the robot.
        prepared: the runs.
        by_fidim: FIDIM's results.
    """
    candidates = [*_by_best_coordinates(model, prepared), *by_fidim]
    nominal = model.robot.inertia
    if nominal is not None:
        candidates.append(nominal)
    possible = [one for one in candidates if is_possible(one)]
    return possible or [guessed_inertia(model.robot), *candidates]


def _by_best_coordinates(model: Model, prepared: PreparedRuns) -> list[Array]:
    """FIDIM by full poses on the best conditioned free coordinates; empty where it cannot be."""
    motions = [run.full for run in usable(prepared, True, None) if run.full is not None]
    if not motions:
        return []
    poses = [m.zetas[:: max(1, len(m.zetas) // _POSES_A_RUN)] for m in motions]
    free, _ = choose_free_coordinates(model, np.concatenate(poses))
    try:
        found = fidim([regressor(model, replace(m, free=free)) for m in motions])
    except (ValueError, np.linalg.LinAlgError):
        return []
    return [found.values]
