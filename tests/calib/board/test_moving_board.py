"""A board waved before free-running cameras: clocks, line times and an honest covariance."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from freeswing.calib.board.declared_board import Board
from freeswing.calib.board.sightings import Sightings, gather
from freeswing.calib.calibrate import rig_from_sightings
from tests.calib import rigs

BOARD = Board("chessboard", 9, 6, 0.07)
CLOCKS = ((0.0, 0.0), (0.0043, 0.0), (-0.0068, 1.2e-5))
SIGMA_PX = 0.02


def free_running(seed):
    return tuple(
        replace(c, clock_offset_s=offset, line_time_s=line)
        for c, (offset, line) in zip(rigs.rig(3, seed, 0.9), CLOCKS, strict=True)
    )


def sighted(camera, motion, stamps_s, rng, jump_s=0.0):
    """Noisy corners; from the middle on the board is `jump_s` ahead."""
    ahead = np.where(np.arange(len(stamps_s)) >= len(stamps_s) // 2, jump_s, 0.0)
    pixels = rigs.film_points(camera, motion, stamps_s + ahead, BOARD.points_m)
    pixels += SIGMA_PX * rng.normal(size=pixels.shape)
    found = np.flatnonzero(np.isfinite(pixels[..., 0]).sum(axis=1) >= 12)
    alike = np.tile(np.eye(2), (len(found), len(BOARD.points_m), 1, 1))
    labels = tuple(f"{camera.name}.mkv frame {k}" for k in found)
    return Sightings(
        camera.name, camera.size_px, len(stamps_s), found, stamps_s[found], labels, pixels[found],
        alike,
    )  # fmt: skip


def recorded(cameras, seed, rate_hz, count, jump_s=0.0):
    rng, motion = np.random.default_rng(seed + 9), rigs.hand_motion(cameras, seed)
    stamps = np.arange(count) / rate_hz
    return tuple(sighted(camera, motion, stamps, rng, jump_s) for camera in cameras)


@pytest.mark.parametrize("rate_hz", [100.0, 30.0])
def test_clocks_lines_and_covariance(rate_hz):
    """Offsets of parts of a frame and a rolling shutter: all errors are as large as claimed."""
    total, freedom = 0.0, 0
    for seed in range(3):
        cameras = free_running(seed)
        rig, _ = rig_from_sightings(recorded(cameras, seed, rate_hz, 60), BOARD, rate_hz)
        square, count = rigs.error_square(rig, cameras)
        total, freedom = total + square, freedom + count
        for found, true in zip(rig.cameras, cameras, strict=True):
            error_ms = 1e3 * (found.clock_offset_s - true.clock_offset_s)
            assert abs(error_ms) < 0.1, f"seed {seed} {true.name}: {error_ms} ms"
            assert found.line_time_s == pytest.approx(true.line_time_s, abs=1e-7), true.name
    low, high = chi2.ppf([0.001, 0.999], freedom)
    assert low < total < high, f"{total:.0f} outside {low:.0f} to {high:.0f}"


def test_a_cut_ends_a_motion():
    """Frames on both sides of a jump of the board are no part of one motion."""
    cameras = free_running(0)
    sightings = recorded(cameras, 0, 100.0, 40, jump_s=3.0)
    line = gather(sightings, 100.0).line
    assert line is not None
    before = set(line.piece[line.times_s < 0.195].tolist()) - {-1}
    after = set(line.piece[line.times_s > 0.205].tolist()) - {-1}
    assert len(before) >= 3, before
    assert not before & after, f"pieces {before & after} run across the cut"
