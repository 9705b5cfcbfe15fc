"""How a driven motion answers to its start pose and to chosen numbers, by its own steps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.model import N_STATE
from freeswing.cdpr.driven.motion import DrivenMotion
from freeswing.cdpr.driven.slopes import motion_slope, pose_map
from freeswing.cdpr.model.batch import evaluate

Array = NDArray[np.float64]

N_POSE = 6  # small translation and turn of the start pose


@dataclass(frozen=True, slots=True)
class _Steps:
    """Every integration step of a motion: where it began, and its length."""

    states: Array
    currents: Array
    references: Array
    periods: Array
    samples: NDArray[np.intp]


def state_slopes(motion: DrivenMotion, chosen: tuple[str, ...]) -> Array:
    """Derivatives of all states by start pose, start currents and numbers, (n_t, 13, 6 + n + k).

    Exact for the steps that were taken: Runge and Kutta's stages are differentiated one by one.
    Numbers of the current loop are not among those that may be chosen.
    """
    steps = _all_steps(motion)
    model, theta = motion.model, motion.theta
    looks = evaluate(
        model.stages, steps.states, steps.currents, steps.references, steps.periods, theta
    )
    states, currents = (np.moveaxis(part, -1, 1) for part in looks)  # (m, 4, ..)
    found = evaluate(motion_slope(model, chosen), states, currents, theta)
    flows = _flows(states, found[1])
    n = model.n_cables
    sources = np.zeros((*states.shape, n + len(chosen)))
    sources[..., 7:, :n] = found[2] * _of_start_currents(motion, steps)[..., None, :]
    if chosen:
        sources[..., 7:, n:] = found[3]
    transitions = _transitions(flows, sources, steps.periods)
    return _chained(motion, steps, transitions)


def _all_steps(motion: DrivenMotion) -> _Steps:
    """The steps within each sample, taken again where there were several."""
    counts, model = motion.steps, motion.model
    samples = np.repeat(np.arange(len(counts)), counts)
    period = motion.times_s[1] - motion.times_s[0]
    periods = period / counts[samples]
    states, currents = motion.states[samples].copy(), motion.currents_A[samples].copy()
    firsts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    several = np.flatnonzero(counts > 1)
    for k in range(1, int(counts.max())):
        several = several[counts[several] > k]
        at = firsts[several] + k
        before = at - 1
        states[at], currents[at], _ = evaluate(
            model.step,
            states[before],
            currents[before],
            motion.references_A[several],
            periods[at],
            motion.theta,
        )
    return _Steps(states, currents, motion.references_A[samples], periods, samples)


def _of_start_currents(motion: DrivenMotion, steps: _Steps) -> Array:
    """What is left of a unit start current at every stage of every step, (m, 4, n)."""
    model, theta, n = motion.model, motion.theta, motion.model.n_cables
    ones, zeros = np.ones(n), np.zeros(n)
    periods, place = np.unique(steps.periods, return_inverse=True)
    state = motion.states[0]
    looks = evaluate(model.stages, state, ones, zeros, periods, theta)[1]
    ends = evaluate(model.step, state, ones, zeros, periods, theta)[1]
    left = ends[place]
    before = np.vstack([ones[None], np.cumprod(left, axis=0)[:-1]])
    left_over = before[:, None, :] * np.moveaxis(looks, -1, 1)[place]
    return np.asarray(left_over, dtype=np.float64)


def _flows(states: Array, by_state: Array) -> Array:
    """Derivative of the state's rate by the state at every stage, (m, 4, 13, 13)."""
    flows = np.zeros((*states.shape, N_STATE))
    flows[..., 0:3, 7:10] = np.eye(3)
    quaternion, omega = states[..., 3:7], states[..., 10:]
    x, y, z = np.moveaxis(omega, -1, 0)
    zero = np.zeros_like(x)
    spin = [[zero, -x, -y, -z], [x, zero, z, -y], [y, -z, zero, x], [z, y, -x, zero]]
    flows[..., 3:7, 3:7] = 0.5 * np.stack([np.stack(row, axis=-1) for row in spin], axis=-2)
    poses = np.concatenate([np.zeros_like(states[..., :3]), quaternion], axis=-1)
    flows[..., 3:7, 10:] = pose_map(poses)[..., 3:, 3:]
    flows[..., 7:, :] = by_state
    return flows


def _transitions(flows: Array, sources: Array, periods: Array) -> Array:
    """What each step does to changes of state and of numbers, (m, 13, 13 + k)."""
    h = periods[:, None, None]
    both = np.concatenate([flows, sources], axis=-1)
    start = np.zeros(both.shape[2:])
    start[:, :N_STATE] = np.eye(N_STATE)
    slope, total = both[:, 0], both[:, 0].copy()
    for stage, part, weight in ((1, 0.5, 2.0), (2, 0.5, 2.0), (3, 1.0, 1.0)):
        slope = flows[:, stage] @ (start + part * h * slope)
        slope[..., N_STATE:] += sources[:, stage]
        total += weight * slope
    return start + h / 6.0 * total


def _chained(motion: DrivenMotion, steps: _Steps, transitions: Array) -> Array:
    """The transitions one after another, quaternions normalised as the steps do."""
    n_more = transitions.shape[2] - N_STATE
    result = np.zeros((len(motion.times_s), N_STATE, N_POSE + n_more))
    result[0, :7, :N_POSE] = pose_map(motion.states[0, :7])
    now = result[0].copy()
    # A step's end is the next one's start; its quaternion is of unit length there.
    ends = np.vstack([steps.states[1:, 3:7], motion.states[-1:, 3:7]])
    for k, transition in enumerate(transitions):
        now = transition[:, :N_STATE] @ now
        now[:, N_POSE:] += transition[:, N_STATE:]
        q = ends[k]
        now[3:7] -= np.outer(q, q @ now[3:7])
        result[steps.samples[k] + 1] = now
    return result
