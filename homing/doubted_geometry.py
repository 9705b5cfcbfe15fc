"""Whether declared geometry explains the readings, or its errors are estimated as well."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from freeswing.homing.fit_start_pose import StartFit, StartProblem
from freeswing.homing.homing_files import GeometryNoise, Homing
from freeswing.homing.misfit import is_beyond_doubt
from freeswing.homing.rest_readings import RestModel


def with_geometry_in_doubt(homing: Homing, model: RestModel, fit: StartFit) -> StartFit:
    """The fit, or one that estimates errors of the geometry where they explain far more.

    Args:
        homing: the readings.
        model: of the rest poses.
        fit: with the geometry as declared.

    Source:
        Schwarz 1978, Estimating the Dimension of a Model.
    """
    if is_beyond_doubt(fit.chi_square, fit.degrees):
        return fit
    doubted = StartProblem(homing, model, GeometryNoise())
    first = doubted.solve(homing.noise, fit.poses, doubted.start_border(fit.poses[0]))
    wider = doubted.finish(first, replace(homing.noise, stated=True))
    return wider if fit.cost - wider.cost > _information_price(wider, doubted) else fit


def _information_price(fit: StartFit, problem: StartProblem) -> float:
    """Fall of the cost that as many newly known offsets must bring (Bayesian information)."""
    if fit.geometry_std is None:
        return np.inf
    known = 1 - (fit.geometry_std / GeometryNoise().stack(problem.n)) ** 2
    return float(np.clip(known, 0, 1).sum() * np.log(problem.present.sum()))
