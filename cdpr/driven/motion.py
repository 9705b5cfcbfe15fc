"""A driven robot moved by held current references: rigid cables, one step a sample or finer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.compiled.native import Native, native
from freeswing.cdpr.driven.kernels.rigid_kernels import Machine, Pace, all_samples, one_sample
from freeswing.cdpr.driven.model import N_STATE, DrivenModel
from freeswing.cdpr.model.batch import evaluate

Array = NDArray[np.float64]

# A step of RK4 follows a decay of this many time constants to 2e-4 of its size, well inside its
# limit of stability (2.78); the fastest decay is smoothed Coulomb friction about standstill.
MOST_DECAY = 1.2
# Steps of 1 ms drift by 1.1e-9 of the kinetic energy in 5 s, these by a sixteenth of that.
LONGEST_STEP_S = 5e-4
MOST_SUBSTEPS = 64
# Between motors that turn round within a step and ones that do so in 20, the pose differs by
# 0.01 mm after 5 s of PRBS: as much as an encoder step.
MOST_TURN = 0.1
MOST_REFINED = 16
# A platform that leaves its frame by this factor is lost: cables push there in earnest.
LARGEST_REACH = 3.0


@dataclass(frozen=True, slots=True)
class DrivenMotion:
    """A simulated motion at the sample times.

    Attributes:
        model: the equations.
        theta: their numbers.
        times_s: sample times, (n_t,).
        states: (n_t, 13).
        currents_A: what flows at each sample, (n_t, n).
        references_A: held from each sample to the next, (n_t, n).
        tensions_N: at each sample with rigid cables, negative where one would have pushed,
            (n_t, n).
        steps: integration steps taken from each sample to the next, (n_t - 1,).
        lengths_out_m: unstretched cable let out where cables are elastic, (n_t, n); None: rigid.
    """

    model: DrivenModel
    theta: Array
    times_s: Array
    states: Array
    currents_A: Array
    references_A: Array
    tensions_N: Array
    steps: NDArray[np.intp]
    lengths_out_m: Array | None = None

    @property
    def turns(self) -> Array:
        """Length let out over drum radius, of which motor angles are the change, (n_t, n)."""
        out = self.lengths_out_m
        out = evaluate(self.model.lengths, self.poses, self.theta)[0] if out is None else out
        return out / evaluate(self.model.drums, self.theta)[0]

    @property
    def poses(self) -> Array:
        """Position and quaternion, (n_t, 7)."""
        return self.states[:, :7]

    @property
    def slack(self) -> NDArray[np.bool_]:
        """Where a cable does not pull, (n_t, n).

        A rigid one would have had to push there, and what follows is wrong; an elastic one hangs.
        """
        return self.tensions_N < 0.0 if self.lengths_out_m is None else self.tensions_N <= 0.0

    def angles_rad(self, zero_pose: Array) -> Array:
        """Motor angles that are zero at a pose and grow with winding (2), (n_t, n)."""
        zero = evaluate(self.model.lengths, zero_pose, self.theta)[0]
        return zero / evaluate(self.model.drums, self.theta)[0] - self.turns


def motor_angles(model: DrivenModel, poses: Array, zero_pose: Array, theta: Array) -> Array:
    """The inverse position kinematic model (2): (..., 7) and (7,) -> (..., n).

    Source:
        INCA 2016, eq. (2).
    """
    lengths = evaluate(model.lengths, poses, theta)[0]
    zero = evaluate(model.lengths, zero_pose, theta)[0]
    return (zero - lengths) / evaluate(model.drums, theta)[0]


def substeps_for(model: DrivenModel, period_s: float, theta: Array) -> int:
    """Steps a sample, of `LONGEST_STEP_S` at most, each within `MOST_DECAY` of friction's decay.

    Raises:
        ValueError: when friction is so large for its inertia that it would need too many.
    """
    motors = evaluate(model.decays, theta)[0]
    count = int(np.ceil(period_s * float(motors.max()) / MOST_DECAY))
    if count > MOST_SUBSTEPS:
        raise ValueError(
            f"friction against motor inertia decays at {motors.max():.3g} 1/s: {count} steps a "
            f"sample of {period_s:g} s, more than {MOST_SUBSTEPS}; check coulomb_N_m, "
            "viscous_N_m_s, motor_inertia_kg_m2"
        )
    return max(count, int(np.ceil(period_s / LONGEST_STEP_S * (1.0 - 1e-9))))


class Stepper:
    """Advances a state by one period after another, as machine code.

    A period in which a motor turns round, and its friction with it, is taken again in steps so
    fine that the smoothed sign changes by at most `MOST_TURN` in each.

    Args:
        model: the equations.
        theta: their numbers, (len(model.names),).
        period_s: how long references are held.
        least: integration steps a period at least; None for what `substeps_for` asks.
    """

    def __init__(
        self, model: DrivenModel, theta: Array, period_s: float, least: int | None = None
    ) -> None:
        self._code = native(model.motion)  # a machine holds its address alone
        self.machine = machine_of(model, theta)
        self.pace = pace_of(model, theta, period_s, least)
        self._unused = np.empty(model.n_cables)

    def advance(self, state: Array, currents: Array, references: Array) -> tuple[Array, Array, int]:
        """State (13,) and currents (n,) after one period of held references (n,); steps taken."""
        after, flowing = np.array(state), np.array(currents)
        count = one_sample(self.machine, self.pace, after, flowing, references, self._unused)
        return after, flowing, count


def machine_of(model: DrivenModel, theta: Array) -> Machine:
    """The model's equations as machine code with memory of its own."""
    code = native(model.motion)
    inputs = np.zeros(code.n_in)
    inputs[N_STATE + model.n_cables :] = theta
    return Machine(*memory_for(code, inputs, evaluate(model.lags, theta)[0], N_STATE))


def memory_for(
    code: Native, inputs: Array, lags: Array, size: int
) -> tuple[int, Array, Array, Array, Array, Array, Array]:
    """What a machine of `size` states is made of: its code and memory for the four stages.

    Args:
        code: of the equations.
        inputs: of the code, its constants in place.
        lags: time constant of each current loop, (n,).
        size: how many states.
    """
    outputs, stages = np.zeros(code.n_out), np.zeros((4, size))
    return code.address, inputs, outputs, lags, stages, np.zeros((4, len(lags))), stages.copy()


def pace_of(model: DrivenModel, theta: Array, period_s: float, least: int | None) -> Pace:
    """How steps are chosen for these numbers."""
    least = substeps_for(model, period_s, theta) if least is None else least
    reach = LARGEST_REACH * float(np.abs(model.robot.entries_m).max())
    return Pace(period_s, least, MOST_TURN, MOST_REFINED, reach)


def simulate_driven(
    model: DrivenModel,
    state: Array,
    references_A: Array,
    rate_hz: float,
    theta: Array | None = None,
    *,
    currents_A: Array | None = None,
    least: int | None = None,
) -> DrivenMotion:
    """The motion under current references, each held for one sample.

    Cables are rigid: where one would have to push it does, and `slack` tells so.

    Args:
        model: the equations.
        state: at the first sample, (13,).
        references_A: (n_t, n); the last row is never reached.
        rate_hz: samples a second.
        theta: the model's numbers; None as declared.
        currents_A: what flows at the start, (n,); None: the first references.
        least: integration steps a sample at least; None for what the friction asks.

    Raises:
        ValueError: for wrong shapes or numbers, and when the platform leaves its frame for good.
    """
    theta = model.declared if theta is None else np.asarray(theta, dtype=np.float64)
    references = np.array(references_A, dtype=np.float64, order="C")  # kernels want it writable
    start = references[0] if currents_A is None else np.asarray(currents_A, dtype=np.float64)
    _check(model, state, references, start, rate_hz)
    pace = pace_of(model, theta, 1.0 / rate_hz, least)
    states, currents = np.empty((len(references), N_STATE)), np.empty_like(references)
    states[0], currents[0] = state, start
    tensions, steps = np.empty_like(references), np.ones(len(references) - 1, dtype=np.intp)
    machine = machine_of(model, theta)
    lost = all_samples(machine, pace, states, currents, references, tensions, steps)
    if lost > 0:
        raise ValueError(
            f"at {lost / rate_hz:.3f} s the platform is at {states[lost, :3]} m, more than "
            f"{LARGEST_REACH:g} frames away: the currents pull it out; take smaller ones"
        )
    times = np.arange(len(references)) / rate_hz
    return DrivenMotion(model, theta, times, states, currents, references, tensions, steps)


def _check(
    model: DrivenModel, state: Array, references: Array, start: Array, rate_hz: float
) -> None:
    n = model.n_cables
    if np.shape(state) != (N_STATE,) or not np.isfinite(state).all():
        raise ValueError(f"state has shape {np.shape(state)}, must be {N_STATE} finite numbers")
    if references.ndim != 2 or references.shape[1] != n or len(references) < 2:
        raise ValueError(f"references_A has shape {references.shape}, must be (2 or more, {n})")
    if not (np.isfinite(references).all() and start.shape == (n,) and np.isfinite(start).all()):
        raise ValueError("references_A and currents_A must be finite, one number a motor")
    if not rate_hz > 0.0:
        raise ValueError(f"rate_hz is {rate_hz}, must be > 0")
    norm = float(np.linalg.norm(state[3:7]))
    if abs(norm - 1.0) > 1e-6:
        raise ValueError(f"the start's quaternion has norm {norm:.6f}, must be 1 within 1e-6")
