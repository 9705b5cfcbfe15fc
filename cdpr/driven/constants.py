"""A driven robot's constants as numbers, its shape's formulas and its effects worked in."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.model import DrivenModel, function
from freeswing.cdpr.model.batch import evaluate

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Constants:
    """Numbers of every cable and of the body.

    Attributes:
        entries_m: where cables leave the frame, base frame, (n, 3).
        attachments_m: where they hold the platform, platform frame, (n, 3).
        drum_radius_m: (n,).
        spring_N_m: k_sp r_pe^2, rotational, (n,).
        inertia_kg_m2: of the motors, (n,).
        viscous_N_m_s: (n,).
        coulomb_N_m: (n,).
        torque_constant_N_m_A: (n,).
        time_constant_s: of the current loops, (n,).
        body: `BODY_NAMES` values, inertia about the origin, (10,).
        gravity_m_s2: (3,).
    """

    entries_m: Array
    attachments_m: Array
    drum_radius_m: Array
    spring_N_m: Array
    inertia_kg_m2: Array
    viscous_N_m_s: Array
    coulomb_N_m: Array
    torque_constant_N_m_A: Array
    time_constant_s: Array
    body: Array
    gravity_m_s2: Array


def constants(model: DrivenModel, theta: Array) -> Constants:
    """The constants at these numbers."""
    terms, motors = model.premises.terms, model.premises.terms.motors
    outputs = {
        "matrix_entries": ca.horzcat(*terms.geometry.entries).T,
        "matrix_attachments": ca.horzcat(*terms.geometry.attachments).T,
        "drum": motors.drum_radius,
        "spring": motors.spring,
        "inertia": motors.inertia,
        "viscous": motors.viscous,
        "coulomb": motors.coulomb,
        "torque": motors.torque_constant,
        "lag": motors.time_constant,
        "body": terms.body,
        "gravity": terms.geometry.gravity,
    }
    return Constants(
        *evaluate(function("constants", {"theta": model.premises.theta}, outputs), theta)
    )
