"""Homing: where an underactuated robot stands when it is switched on, from incremental encoders.

Ida, Merlet, Carricato 2019: static poses are visited by raising one cable tension after another;
the changes of swivel angles and cable lengths, with the equilibrium of each pose, give the start.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.system.progress import Progress
from freeswing.homing.best_fit import best_fit, model_for
from freeswing.homing.doubted_geometry import with_geometry_in_doubt
from freeswing.homing.fit_start_pose import StartFit, StartProblem
from freeswing.homing.guess_from_tensions import (
    TensionEnergy,
    guess_poses,
)
from freeswing.homing.homing_document import homing_document
from freeswing.homing.homing_files import Homing, read_homing
from freeswing.homing.many_starts import many_starts

Array = NDArray[np.float64]


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
    return fit if homing.geometry is not None else with_geometry_in_doubt(homing, model, fit)
