"""The four-block problem of the paper's Fig. 11: [r, d] to [e, u], weighted."""

from __future__ import annotations

import numpy as np

from freeswing.servo.synthesis.riccati import StandardProblem
from freeswing.servo.synthesis.state_space import StateSpace, append, gain, series
from freeswing.servo.synthesis.weights import Weights


def bare(plant: StateSpace) -> StandardProblem:
    """[r, d, u] to [e, u, e] with e = r - G (u + d), without weights."""
    n_y, n_u = plant.n_outputs, plant.n_inputs
    B = np.hstack([np.zeros((plant.order, n_y)), plant.B, plant.B])
    C = np.vstack([-plant.C, np.zeros((n_u, plant.order)), -plant.C])
    error = np.hstack([np.eye(n_y), -plant.D, -plant.D])
    control = np.hstack([np.zeros((n_u, n_y + n_u)), np.eye(n_u)])
    return StandardProblem(StateSpace(plant.A, B, C, np.vstack([error, control, error])), n_y, n_u)


def weighted(plant: StateSpace, weights: Weights) -> StandardProblem:
    """The same with W3 on d, W1 on e and W2 on u."""
    n_y, n_u = plant.n_outputs, plant.n_inputs
    inputs = append(gain(np.eye(n_y)), weights.disturbance(), gain(np.eye(n_u)))
    outputs = append(weights.error(), weights.control(), gain(np.eye(n_y)))
    return StandardProblem(series(series(inputs, bare(plant).plant), outputs), n_y, n_u)
