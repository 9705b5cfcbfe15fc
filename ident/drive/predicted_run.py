"""A driven run predicted from its start and its references alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.behaviour import stretch_of
from freeswing.cdpr.driven.motion import DrivenMotion
from freeswing.cdpr.driven.sensitivity import N_POSE
from freeswing.cdpr.driven.slopes import moved
from freeswing.ident.drive.asked_session import DriveSession
from freeswing.ident.drive.records.slack import first_slack
from freeswing.ident.drive.run_problem import (
    DriveRun,
    compared,
    given_A,
    head_of,
    simulated,
    start_pose,
)
from freeswing.ident.drive.unknowns import NOTHING

Array = NDArray[np.float64]


HEAD_S = 0.3  # of a run: what a wrong start does is largest there
ELASTIC_STEPS = 4  # of Gauss and Newton; millimetres of stretch become micrometres in three


@dataclass(frozen=True, slots=True)
class RunFit:
    """How well a run is predicted from its start and its references.

    Attributes:
        run: which.
        equation_22: by motor, per cent (22), of the whole run.
        matlab: by motor, 1 - |e| / |y - mean| in per cent, likewise.
        rms_rad: of all angles up to where a cable would first have had to push.
        until: samples up to there; all of them where none would.
        slack: samples at which each cable would have had to push, (n,).
        saturated: samples at which each motor was asked for more than its limits, (n,).
        motion: the prediction.
        gaps_rad: motor angles predicted less read, (n_t, n).
        pose_gaps: poses predicted less measured, small translation and turn, (n_p, 6).
    """

    run: DriveRun
    equation_22: Array
    matlab: Array
    rms_rad: float
    until: int
    slack: NDArray[np.intp]
    saturated: NDArray[np.intp]
    motion: DrivenMotion
    gaps_rad: Array
    pose_gaps: Array


def predict(session: DriveSession, run: DriveRun, theta: Array, zero: Array) -> RunFit:
    """The run from its start and its references alone; the start is told by its first 0.3 s."""
    model = session.model
    motion = simulated(model, theta, run, *_start(session, run, theta, zero))
    seen = compared(run, motion, zero, session.noise, None)
    gaps, angles = seen.angles * session.noise.angle_std_rad, run.record.angles_rad
    spread = np.sum((angles - angles.mean(axis=0)) ** 2, axis=0)
    share = np.sum(gaps**2, axis=0) / np.where(spread > 0.0, spread, np.nan)
    until = max(first_slack(motion), len(head_of(run, HEAD_S).record.times_s))
    return RunFit(
        run,
        100.0 * (1.0 - share),
        100.0 * (1.0 - np.sqrt(share)),
        float(np.sqrt(np.mean(gaps[:until] ** 2))),
        until,
        motion.slack.sum(axis=0),
        (run.record.references_A != given_A(model, run)).sum(axis=0),
        motion,
        gaps,
        seen.poses * session.noise.pose_std,
    )


def _start(session: DriveSession, run: DriveRun, theta: Array, zero: Array) -> tuple[Array, Array]:
    """Pose and currents at the start, by the first angles and one step of least squares.

    Elastic cables start some steps farther off, for the first angles tell lengths let out.
    """
    model, short = session.model, head_of(run, HEAD_S)
    pose, flowing = start_pose(model, theta, run, zero), run.record.currents_A[0]
    n_start = N_POSE + model.n_cables
    known, more = np.zeros(n_start), np.zeros(model.n_cables)
    known[N_POSE:] = session.noise.current_std_A**-2.0
    for _ in range(1 if stretch_of(model, theta) is None else ELASTIC_STEPS):
        motion = simulated(model, theta, short, pose, flowing + more)
        seen = compared(short, motion, zero, session.noise, NOTHING)
        columns = np.vstack([part.reshape(-1, n_start) for part in seen.slopes])
        gaps = np.concatenate([seen.angles.reshape(-1), seen.poses.reshape(-1)])
        gradient = columns.T @ gaps
        gradient[N_POSE:] += known[N_POSE:] * more
        shift = -np.linalg.solve(columns.T @ columns + np.diag(known), gradient)
        pose, more = moved(pose, shift[:N_POSE]), more + shift[N_POSE:]
    return pose, flowing + more
