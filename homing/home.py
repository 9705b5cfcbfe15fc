"""Homing: where an underactuated robot stands when it is switched on, from incremental encoders.

Ida, Merlet, Carricato 2019: static poses are visited by raising one cable tension after another;
the changes of swivel angles and cable lengths, with the equilibrium of each pose, give the start.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.files.documents import DataError, write_json
from freeswing.cdpr.robot import Robot
from freeswing.homing.arrow_least_squares import ArrowSolution
from freeswing.homing.fit_start_pose import LOSS_LIMIT, StartFit, StartProblem
from freeswing.homing.guess_from_tensions import (
    TensionEnergy,
    acquisition_tensions,
    free_indices,
    stable_starts,
)
from freeswing.homing.homing_files import GeometryNoise, Homing, ReadingNoise, read_homing
from freeswing.homing.many_starts import far_rows, many_starts, rank_starts
from freeswing.homing.reading_mistakes import likely_mistake
from freeswing.homing.rest_readings import RestModel, geometry_labels

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

_GOOD_FIT = 9.0
_DOUBTFUL_FIT = 4.0
# Mean squares over the noise's: a geometry that is some millimetres off leaves tens to thousands,
# a wrong start, unit or sign a million and more.
_FAR_OFF = 1e4
_SUSPECT_WEIGHT = 0.6
_WEIGHTS_OF_A_GUESS = 1.5


def home(
    path: Path | str, progress: Progress | None = None, results: Path | str | None = None
) -> dict:
    """Find the start pose that homing.toml's readings tell and write results/homing.json beside it.

    Args:
        path: homing.toml, or the folder that holds it.
        progress: told a label and a fraction from 0 to 1.
        results: the folder to write to instead.

    Returns:
        What was written: the document of FORMATS, "Start pose and excitation".

    Raises:
        InputError: a file is wrong.
        DataError: the readings do not determine the start pose.
    """
    path = Path(path)
    path = path / "homing.toml" if path.is_dir() else path
    say = progress or (lambda _label, _fraction: None)
    say("reading", 0.0)
    homing = read_homing(path)
    say("start pose", 0.2)
    begun = time.perf_counter()
    fit = find_start(homing)
    document = homing_document(homing.robot, fit, time.perf_counter() - begun)
    results = path.parent / "results" if results is None else Path(results)
    write_json(results / "homing.json", document)
    say("start pose", 1.0)
    return document


def find_start(homing: Homing) -> StartFit:
    """Start pose, swivel angles and cable lengths from static readings.

    Where the noise is stated and the declared geometry does not explain the readings, or where
    homing.toml says how well the geometry is known, its errors are estimated as well.

    Raises:
        DataError: too few poses, no stable guess, or readings that do not determine the start.
    """
    count, n = homing.readings.sigma_rad.shape
    if count < 3:
        raise DataError(f"{count} static poses, at least 3 are needed ({6 + n} readings each)")
    if homing.robot.platform.com_m is None:
        raise DataError("platform.com_m is missing in the robot file: equilibrium needs it")
    energy = TensionEnergy(homing.robot)
    guesses = guess_poses(homing, energy)
    guesses = guesses or [
        np.tile(pose, (count, 1)) for pose in many_starts(energy, homing.robot.n_cables)[:1]
    ]
    if not guesses:
        raise DataError(
            f"{homing.robot.name} hangs at no stable pose, whatever the tensions: correct "
            "platform.com_m, gravity_m_s2 or the cables' entry_m and attachment_m"
        )
    model = _model_for(homing, guesses[0][0])
    fit = _best_fit(StartProblem(homing, model, homing.geometry), homing, guesses, energy)
    if homing.geometry is not None or fit.chi_square < _DOUBTFUL_FIT * fit.degrees:
        return fit
    doubted = StartProblem(homing, model, GeometryNoise())
    first = doubted.solve(homing.noise, fit.poses, doubted.start_border(fit.poses[0]))
    wider = doubted.finish(first, replace(homing.noise, stated=True))
    return wider if fit.cost - wider.cost > _information_price(wider, doubted) else fit


def guess_poses(homing: Homing, energy: TensionEnergy) -> list[Array]:
    """First guesses of all poses, (N, 6) each: one for every stable rest at the start tensions.

    Tensions that were read serve where there are any, else the set-points of the procedure. There
    is no guess where the platform cannot rest at the start tensions.
    """
    robot, readings = homing.robot, homing.readings
    count = len(readings.sigma_rad)
    tensions = acquisition_tensions(homing.start_tensions_N, homing.max_tensions_N, count)
    if readings.tension_N is not None:
        tensions = np.where(np.isfinite(readings.tension_N), readings.tension_N, tensions)
    pulls = tensions / _weight_N(robot, homing.start_tensions_N)
    guesses = []
    for start in stable_starts(energy, pulls[0])[:4]:
        rest = energy.settle(np.tile(start, (count, 1)), pulls)
        guesses.append(np.where(rest.settled[:, None], rest.poses, start))
    return guesses


def homing_document(robot: Robot, fit: StartFit, seconds: float) -> dict:
    """results/homing.json as a dictionary."""
    std = np.sqrt(np.diag(fit.pose_covariance))
    offsets_std = np.sqrt(np.diag(fit.offsets_covariance))
    n = robot.n_cables
    start = fit.poses[0]
    return {
        "format": "freeswing-homing/1",
        "start_pose": {
            "position_m": start[:3].tolist(),
            "angles_rad": _wrapped(start[3:]).tolist(),
        },
        "start_pose_std": {"position_m": std[:3].tolist(), "angles_rad": std[3:].tolist()},
        "cable_lengths_m": fit.length_m.tolist(),
        "cable_lengths_std_m": offsets_std[n:].tolist(),
        "swivel_angles_rad": fit.sigma_rad.tolist(),
        "swivel_angles_std_rad": offsets_std[:n].tolist(),
        "residual_rms": {
            "sigma_rad": _rms(fit, "sigma"),
            "length_m": _rms(fit, "length"),
            "statics": _rms(fit, "statics"),
        },
        "conditioning": fit.conditioning,
        "seconds": seconds,
        "poses": len(fit.poses),
        "noise": {
            "sigma_rad": fit.noise.sigma_rad,
            "length_m": fit.noise.length_m,
            "stated": fit.noise.stated,
        },
        "chi_square_over_degrees": fit.chi_square / fit.degrees,
        "suspect_readings": _suspects(fit),
        "geometry": _geometry(robot, fit),
    }


def _model_for(homing: Homing, pose: Array) -> RestModel:
    return RestModel(
        homing.robot,
        free_indices(homing.robot, pose),
        with_tensions=homing.readings.tension_N is not None and homing.noise.tension_N is not None,
        with_tilt=homing.readings.tilt_rad is not None,
    )


def guess_widely(homing: Homing, starts: Array) -> list[Array]:
    """Every pose as the best of many starts has it, (N, 6); nothing where none can be computed."""
    if not len(starts):
        return []
    model = _model_for(homing, starts[0])
    few = replace(homing, readings=homing.readings.rows(far_rows(homing.readings)))
    problem = StartProblem(few, model, None)
    best = _solve_from(problem, homing.noise, rank_starts(problem, homing.noise, starts), ROBUST)
    if best is None:
        return []
    return rank_starts(StartProblem(homing, model, None), homing.noise, best.blocks[:1])


def _best_fit(
    problem: StartProblem, homing: Homing, guesses: list[Array], energy: TensionEnergy
) -> StartFit:
    """The fit of the guess that explains the readings best; the first good one ends the search.

    Raises:
        DataError: where none is found, with a mistake in the readings that would explain it.
    """
    best = _solve_from(problem, homing.noise, guesses, PLAIN)
    if PLAIN.explains(best, problem):
        return problem.finish(best, homing.noise)
    begun = [best.blocks] if best is not None and best.converged else []
    near = _solve_from(problem, homing.noise, begun, ROBUST)
    if ROBUST.explains(near, problem):
        return problem.finish(near, homing.noise)
    if near is not None and near.converged and 2 * near.cost < _FAR_OFF * problem.degrees:
        return problem.finish(near, homing.noise)
    starts = many_starts(energy, homing.robot.n_cables)
    wide = _solve_from(problem, homing.noise, guess_widely(homing, starts), ROBUST)
    if ROBUST.explains(wide, problem):
        return problem.finish(wide, homing.noise)
    suspect = likely_mistake(homing, lambda changed: _explained(changed, starts))
    if suspect or best is None:
        raise DataError(f"the readings come from no start pose{suspect and ', but do '}{suspect}")
    return problem.finish(best, homing.noise)


def _explained(homing: Homing, starts: Array) -> bool:
    """Whether these readings come from some start pose."""
    guesses = guess_widely(homing, starts)
    if not guesses:
        return False
    problem = StartProblem(homing, _model_for(homing, guesses[0][0]), None)
    return ROBUST.explains(_solve_from(problem, homing.noise, guesses, ROBUST), problem)


@dataclass(frozen=True, slots=True)
class Judgement:
    """When a solution explains the readings.

    Attributes:
        loss_limit: of Huber's loss in the fit, standard deviations; begun where plain squares end,
            since its slopes are too flat to lead there from afar.
        share: of the static poses that must be explained; the worst others are left out.
    """

    loss_limit: float
    share: float

    def explains(self, solution: ArrowSolution | None, problem: StartProblem) -> bool:
        """Whether the squares of that share of the poses are what noise leaves."""
        if solution is None or not solution.converged:
            return False
        squares = np.sort((solution.linearization.residuals**2).sum(axis=1))
        kept = squares[: int(np.ceil(self.share * len(squares)))]
        return float(kept.sum()) < _GOOD_FIT * problem.degrees


PLAIN = Judgement(np.inf, 1.0)
ROBUST = Judgement(LOSS_LIMIT, 0.9)  # a mistyped row in ten is told as suspect, not as no start


def _solve_from(
    problem: StartProblem, noise: ReadingNoise, guesses: list[Array], judgement: Judgement
) -> ArrowSolution | None:
    """The best solution, or the first good one; None without guesses that can be computed."""
    best = None
    for poses in guesses:
        border = problem.start_border(poses[0])
        if not np.isfinite(problem.linearize(noise, poses, border).residuals).all():
            continue
        solution = problem.solve(noise, poses, border)
        if np.isfinite(judgement.loss_limit) and solution.converged:
            blocks, shared = solution.blocks, solution.border
            solution = problem.solve(noise, blocks, shared, judgement.loss_limit)
        best = min((best, solution), key=_rank_of_solution)
        if judgement.explains(best, problem):
            break
    return best


def _rank_of_solution(solution: ArrowSolution | None) -> tuple[bool, float]:
    return (True, np.inf) if solution is None else (not solution.converged, solution.cost)


def _information_price(fit: StartFit, problem: StartProblem) -> float:
    """Fall of the cost that as many newly known offsets must bring (Bayesian information)."""
    if fit.geometry_std is None:
        return np.inf
    known = 1 - (fit.geometry_std / GeometryNoise().stack(problem.n)) ** 2
    return float(np.clip(known, 0, 1).sum() * np.log(problem.present.sum()))


def _weight_N(robot: Robot, start_tensions_N: Array) -> float:
    """The platform's weight; unknown, that which the start tensions would lift comfortably."""
    gravity = float(np.linalg.norm(robot.gravity_m_s2))
    if robot.platform.mass_kg is not None:
        return robot.platform.mass_kg * gravity
    return float(np.sum(start_tensions_N)) / _WEIGHTS_OF_A_GUESS


def _wrapped(angles: Array) -> Array:
    return np.remainder(angles + np.pi, 2 * np.pi) - np.pi


def _rms(fit: StartFit, kind: str) -> float:
    columns = [k for k, row in enumerate(fit.rows) if row == kind]
    return float(np.sqrt(np.nanmean(fit.residuals[:, columns] ** 2)))


def _suspects(fit: StartFit) -> list[dict]:
    """Readings that the robust loss took weight from, the worst first, twenty at the most."""
    n = len(fit.length_m)
    names = [f"dsigma{i + 1}_rad" for i in range(n)] + [f"dl{i + 1}_m" for i in range(n)]
    where = np.argwhere(fit.weights[:, : 2 * n] < _SUSPECT_WEIGHT)
    found = [
        {"row": int(k), "column": names[j], "residual": float(fit.residuals[k, j])}
        for k, j in where[np.argsort([fit.weights[k, j] for k, j in where])]
    ]
    return found[:20]


def _geometry(robot: Robot, fit: StartFit) -> list[dict]:
    """Geometry offsets that were estimated, the best known first."""
    if fit.geometry_std is None:
        return []
    labels = geometry_labels(robot)
    order = np.argsort(fit.geometry_std)
    return [
        {"name": labels[k], "offset": float(fit.geometry[k]), "std": float(fit.geometry_std[k])}
        for k in order
    ]
