"""How a driven motion answers to its start pose and to chosen numbers, by its own steps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.compiled.native import native
from freeswing.cdpr.driven.kernels.slope_kernels import N_POSE, STAGES, Slope, all_slopes
from freeswing.cdpr.driven.model import N_STATE, DrivenModel
from freeswing.cdpr.driven.motion import DrivenMotion, machine_of
from freeswing.cdpr.driven.slopes import directed_slope, pose_map

Array = NDArray[np.float64]

__all__ = ["N_POSE", "state_slopes"]


def state_slopes(motion: DrivenMotion, chosen: tuple[str, ...]) -> Array:
    """Derivatives of all states by start pose, start currents and numbers, (n_t, 13, 6 + n + k).

    Exact for the steps that were taken: Runge and Kutta's stages are differentiated one by one.
    The start pose changes by a small translation and turn. Numbers of the current loop are not
    among those that may be chosen.
    """
    model, n = motion.model, motion.model.n_cables
    result = np.zeros((len(motion.times_s), N_STATE, N_POSE + n + len(chosen)))
    result[0, :7, :N_POSE] = pose_map(motion.states[0, :7])
    all_slopes(
        machine_of(model, motion.theta),
        _slope_of(model, motion.theta, chosen),
        motion.times_s[1] - motion.times_s[0],
        motion.states,
        motion.currents_A,
        motion.references_A,
        motion.steps,
        result,
    )
    return result


def _slope_of(model: DrivenModel, theta: Array, chosen: tuple[str, ...]) -> Slope:
    code = native(directed_slope(model, chosen), STAGES)
    n = model.n_cables
    inputs = np.zeros((code.n_in, STAGES))
    inputs[N_STATE + n : N_STATE + n + len(theta)] = theta[:, None]
    outputs, by = np.zeros((code.n_out, STAGES)), np.zeros((STAGES, 6, code.n_out))
    return Slope(code.address, inputs, outputs, by)
