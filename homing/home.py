"""Homing: where an underactuated robot stands when it is switched on, from incremental encoders.

Ida, Merlet, Carricato 2019: static poses are visited by raising one cable tension after another;
the changes of swivel angles and cable lengths, with the equilibrium of each pose, give the start.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.robot import Robot
from freeswing.homing.best_fit import best_fit, model_for
from freeswing.homing.fit_start_pose import StartFit, StartProblem
from freeswing.homing.guess_from_tensions import (
    TensionEnergy,
    acquisition_tensions,
    stable_starts,
)
from freeswing.homing.homing_document import homing_document
from freeswing.homing.homing_files import GeometryNoise, Homing, read_homing
from freeswing.homing.many_starts import many_starts

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

# Chi-square a degree of freedom: more than unlucky readings leave.
_DOUBTFUL_FIT = 4.0
# Start tensions together, by the weight: what `default_tensions` asks for too. Cables that lean by
# about 48 degrees.
_WEIGHTS_OF_A_GUESS = 1.5


def home(path: Path | str, progress: Progress | None = None) -> dict:
    """Find the start pose that homing.toml's readings tell.

    Args:
        path: homing.toml, or the folder that holds it.
        progress: told a label and a fraction from 0 to 1.

    Returns:
        The content of homing.json: the document of FORMATS, "Start pose and excitation".

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
    model = model_for(homing, guesses[0][0])
    fit = best_fit(StartProblem(homing, model, homing.geometry), homing, guesses, energy)
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

    Source:
        Ida, Merlet, Carricato 2019, eqs. (9), (29).
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
