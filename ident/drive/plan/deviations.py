"""How exactly a planned record and planned poses would tell what is asked for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.behaviour import rest_pose, simulate
from freeswing.cdpr.driven.model import DrivenModel
from freeswing.cdpr.driven.motion import DrivenMotion
from freeswing.cdpr.driven.record import Instruments, observed
from freeswing.cdpr.driven.statics import CENTRE
from freeswing.ident.drive.joint import Premise, Problem
from freeswing.ident.drive.kinematics import StaticPoses, zero_turns
from freeswing.ident.drive.run_problem import DriveRun, Noise
from freeswing.ident.drive.solver import covariance_of
from freeswing.ident.drive.unknowns import Asked

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Bench:
    """The robot as it is declared, its instruments and what is to be known.

    Attributes:
        model: the equations; its declared numbers are taken for the truth.
        asked: the unknowns.
        instruments: how a motion is measured.
        rate_hz: samples a second.
    """

    model: DrivenModel
    asked: Asked
    instruments: Instruments
    rate_hz: float

    @property
    def noise(self) -> Noise:
        """Of the readings."""
        told = self.instruments
        pose = np.repeat([told.position_std_m, told.angle_std_rad], 3)
        step = told.encoder_step_rad / np.sqrt(12.0)
        return Noise(step, pose, told.latency_s, told.current_std_A)

    @property
    def sizes(self) -> Array:
        """Declared values of the unknowns, (k,).

        Raises:
            ValueError: see `refuse_zero`.
        """
        self.refuse_zero()
        return np.abs(self.asked.read(self.model, self.model.declared))

    def refuse_zero(self) -> None:
        """Every unknown has a size.

        Raises:
            ValueError: for one that is declared zero: its deviation has nothing to be compared to.
        """
        values = self.asked.read(self.model, self.model.declared)
        empty = [name for name, value in zip(self.asked.names, values, strict=True) if not value]
        if empty:
            raise ValueError(f"{empty[0]} is declared 0: no deviation is small beside it")


def moved_by(bench: Bench, references: Array) -> DrivenMotion:
    """The motion under references from rest without current.

    Raises:
        ValueError: when the platform is lost.
    """
    model, still = bench.model, np.zeros(bench.model.n_cables)
    state = np.concatenate([rest_pose(model, still), np.zeros(6)])
    return simulate(model, state, references, bench.rate_hz, currents_A=still)


def relative_deviations(bench: Bench, motion: DrivenMotion, static: StaticPoses) -> Array:
    """Standard deviation of each unknown over its value, (k,); infinite where nothing tells it.

    Cramer and Rao's bound of the joint estimate: start pose, start currents and the true poses at
    rest are unknown too.

    Source:
        Ljung 1999, System Identification, sec. 7.4; start and poses are eliminated as there.
    """
    model, asked = bench.model, bench.asked
    exact = Instruments(bench.instruments.pose_rate_hz, bench.instruments.latency_s)
    record = observed(motion, CENTRE, exact, np.random.default_rng(0))
    run = DriveRun("plan", "identify", record, bench.rate_hz)
    zero = zero_turns(model, model.declared, CENTRE, Asked((), 0))[0]
    given = Premise(model, model.declared, (run,), bench.noise, CENTRE, zero, static)
    problem = Problem(given, asked)
    inverse, known = covariance_of(problem.normal(problem.start()).matrix)
    k = len(asked.groups)
    std = np.sqrt(np.maximum(np.diag(inverse)[:k], 0.0))
    return np.where(known[:k], std, np.inf) / bench.sizes
