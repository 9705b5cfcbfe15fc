"""Where the platform is between poses that err by a known noise, and what is said of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from freeswing.cdpr.rotation import exp_rotation, log_rotation
from freeswing.vision.fuse.motion.motion_from_poses import Course, course_of
from freeswing.vision.fuse.motion.motion_spectrum import BANDS, Spectrum
from freeswing.vision.fuse.poses import Poses
from freeswing.vision.fuse.settling import SETTLED, Settling

RATE_HZ, POSES = 20.0, 120
NOISE = np.array([4e-5, 4e-5, 6e-5, 1e-4, 1e-4, 2e-4])
SLOW = ((0.8, 0.06), (1.3, 0.03))


def swing(times_s: np.ndarray, modes) -> tuple[np.ndarray, np.ndarray]:
    """Positions and rotations of some oscillations of so many Hz and m, and four rad a metre."""
    places, turns = np.zeros((len(times_s), 3)), np.zeros((len(times_s), 3))
    for k, (hz, size_m) in enumerate(modes):
        phase = 2.0 * np.pi * hz * times_s[:, None] + np.array([0.3, 1.1, 2.9]) * (k + 1)
        fading = size_m * np.exp(-0.05 * times_s)[:, None]
        places += fading * np.sin(phase)
        turns += 4.0 * fading * np.cos(phase + k)
    return places, exp_rotation(turns)


def course(modes, noise=NOISE, known=None) -> Course:
    """By poses whose noise is claimed to be `NOISE`."""
    rng, times = np.random.default_rng(6), np.arange(POSES) / RATE_HZ
    places, turns = swing(times, modes)
    places = places + noise[:3] * rng.standard_normal((POSES, 3))
    turns = exp_rotation(noise[3:] * rng.standard_normal((POSES, 3))) @ turns
    known = np.ones(POSES, dtype=bool) if known is None else known
    places[~known], turns[~known] = np.nan, np.nan
    found = course_of(times, places, turns, known, NOISE)
    assert found is not None
    return found


def errors(found: Course, modes, lag_s: float, rows=slice(None)) -> tuple[np.ndarray, np.ndarray]:
    """Of the shifts so long after the known poses, and their claimed deviations, (n, 6) each."""
    instants = np.flatnonzero(found.known)[rows]
    carried = found.carried(instants, np.full(len(instants), lag_s))
    before, after = (swing(found.times_s[instants] + lag, modes) for lag in (0.0, lag_s))
    turn = log_rotation(after[1] @ np.swapaxes(before[1], 1, 2))
    turned = log_rotation(
        exp_rotation(carried.shifts[:, 3:]) @ np.swapaxes(exp_rotation(turn), 1, 2)
    )
    moved = carried.shifts[:, :3] - (after[0] - before[0])
    return np.concatenate([moved, turned], axis=1), np.sqrt(carried.variances)


@pytest.mark.parametrize("hz", [3.0, 5.2, 7.0])
@pytest.mark.parametrize("lag_s", [0.003, -0.0125, 0.025])
def test_between_poses_the_platform_is_known_as_well_as_at_them(hz, lag_s) -> None:
    modes = (*SLOW, (hz, 0.01))
    error, claimed = errors(course(modes), modes, lag_s, slice(4, -4))
    size = np.sqrt(np.mean((error / claimed) ** 2))
    assert size < 1.3, f"errors are {size:.2f} times what is claimed"
    assert claimed.max(axis=1).mean() < 1.1 * NOISE.max(), "the shift is known as a pose is"


def test_at_the_ends_of_a_recording_claims_hold() -> None:
    modes = (*SLOW, (5.2, 0.01))
    for rows, lag_s in ((slice(0, 3), -0.025), (slice(-3, None), 0.025)):
        error, claimed = errors(course(modes), modes, lag_s, rows)
        assert np.sqrt(np.mean((error / claimed) ** 2)) < 1.5


def test_velocities_are_those_of_the_swing() -> None:
    """A quartic through five poses leaves 0.95 noises a step of them, at 5.2 Hz a quarter of it."""
    modes = (*SLOW, (5.2, 0.01))
    found, dt = course(modes), 1e-5
    instants = np.arange(4, POSES - 4)
    motions = found.carried(instants, np.zeros(len(instants))).motions
    before, here, after = (swing(found.times_s[instants] + k * dt, modes) for k in (-1, 0, 1))
    true = (after[0] - before[0]) / (2.0 * dt)
    spin = log_rotation(after[1] @ np.swapaxes(before[1], 1, 2)) / (2.0 * dt)
    bend = (after[0] - 2.0 * here[0] + before[0]) / dt**2
    assert (motions[:, :3] - true).std() < 0.8 * NOISE[2] * RATE_HZ
    assert (motions[:, 3:6] - spin).std() < 0.8 * NOISE[5] * RATE_HZ
    assert (motions[:, 6:9] - bend).std() < 0.02 * bend.std()


@pytest.mark.parametrize(("hz", "told"), [(7.9, True), (8.9, False)])
def test_a_mode_that_may_be_another_ones_image_leaves_open_what_lies_between(hz, told) -> None:
    """Seen 20 times a second, 8.9 Hz look as 11.1 Hz do; both claims have to hold."""
    for true in (hz,) if told else (hz, RATE_HZ - hz):
        modes = (*SLOW, (true, 0.003))
        error, claimed = errors(course(modes), modes, 0.025, slice(4, -4))
        size = np.sqrt(np.mean((error / claimed) ** 2))
        assert size < 1.5, f"{true} Hz: errors are {size:.2f} times what is claimed"
        assert (claimed[:, 0].mean() < 2e-4) == told, f"{1e3 * claimed[:, 0].mean():.3f} mm"


@pytest.mark.parametrize(("power", "said"), [(1.9, False), (2.1, True)])
def test_an_oscillation_of_less_variance_than_the_noise_is_let_be(power, said) -> None:
    bands = np.full(BANDS, 1e-4)
    bands[-2] = power
    assert (Spectrum(1.0 / RATE_HZ, bands, 2.0).too_fast_hz is not None) == said


def test_a_mode_that_is_too_fast_is_named() -> None:
    assert course((*SLOW, (7.9, 0.01))).spectrum.too_fast_hz is None
    assert course((*SLOW, (8.9, 0.01))).spectrum.too_fast_hz == pytest.approx(8.9, abs=0.25)


def test_poses_that_are_not_known_are_bridged() -> None:
    known = np.ones(POSES, dtype=bool)
    known[[20, 21, 50, 51, 52, 80, 101]] = False
    modes = (*SLOW, (5.2, 0.01))
    error, claimed = errors(course(modes, known=known), modes, 0.02)
    assert np.sqrt(np.mean((error / claimed) ** 2)) < 1.5


def test_poses_that_scatter_more_than_they_claim_are_believed_less() -> None:
    modes = (*SLOW, (3.0, 0.01))
    error, claimed = errors(course(modes, noise=5.0 * NOISE), modes, 0.02, slice(4, -4))
    size = np.sqrt(np.mean((error / claimed) ** 2))
    assert 0.1 < size < 1.5, f"errors are {size:.2f} times what is claimed"


def test_fewer_than_two_poses_have_no_motion() -> None:
    known = np.arange(3) == 1
    assert course_of(np.arange(3.0), np.zeros((3, 3)), np.zeros((3, 3, 3)), known, NOISE) is None


def test_poses_and_their_motion_settle() -> None:
    """Turns that leave 0.8 of an oscillation, turned by a quarter, end after a few."""
    goal, turns, n = np.random.default_rng(3).normal(size=(50, 3)), 0, 50
    home = np.tile(np.eye(3), (n, 1, 1))

    def poses(places: np.ndarray) -> Poses:
        return Poses(
            np.arange(float(n)), places, home, np.zeros((0, 6, 6)), np.ones(n, bool),
            np.zeros((n, 12)),
        )  # fmt: skip

    def answer(places: np.ndarray) -> np.ndarray:
        off = places - goal
        return goal + 0.8 * np.stack([-off[:, 1], off[:, 0], 0.5 * off[:, 2]], axis=1)

    settling, start, moved = Settling(), poses(np.zeros((n, 3))), np.inf
    end = start
    while moved > SETTLED and turns < 12:
        end = poses(answer(start.positions_m))
        start, moved = settling.aim(start, end, np.full(6, 1e-4))
        turns += 1
    assert turns <= 6, f"{turns} turns, plain ones would take fifty"
    assert np.abs(start.positions_m - goal).max() < 1e-4 * SETTLED
    known = replace(end, known=np.arange(n) > 3)
    assert settling.aim(start, known, np.full(6, 1e-4))[1] == np.inf, "other poses begin anew"
