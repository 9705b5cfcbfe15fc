"""Poses as a camera gives them: now and then, late, and noisy."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from freeswing.servo.files.task_file import Watch
from freeswing.servo.synthesis.state_space import Array


@dataclass(frozen=True, slots=True)
class Sighting:
    """One pose.

    Attributes:
        taken_s: when it was true.
        due_s: when it reaches the controller.
        pose: [x y z roll pitch yaw] with noise, (6,).
        angles_rad: motor angles at `taken_s`, (n,).
    """

    taken_s: float
    due_s: float
    pose: Array
    angles_rad: Array


class CameraFeed:
    """Takes poses at its own period and hands each over when its latency is past.

    Args:
        watch: period, latency, noise.
        first: what the controller holds at the start.
        rng: of the noise.
    """

    def __init__(self, watch: Watch, first: Sighting, rng: np.random.Generator) -> None:
        self._watch = watch
        self._std = np.repeat([watch.position_std_m, watch.angle_std_rad], 3)
        self._rng = rng
        self._next_s = 0.0
        self._waiting: deque[Sighting] = deque()
        self.latest = first

    def look(self, time_s: float, pose: Array, angles_rad: Array) -> bool:
        """Take a pose where one is due; whether a new one has reached the controller."""
        # Clocks of 1 kHz and 200 Hz drift apart by rounding alone: a microsecond is the same time.
        if time_s >= self._next_s - 1e-6:
            camera = self._watch.camera
            seen = pose + self._std * self._rng.standard_normal(6)
            self._waiting.append(Sighting(time_s, time_s + camera.latency_s, seen, angles_rad))
            self._next_s += camera.period_s
        arrived = False
        while self._waiting and self._waiting[0].due_s <= time_s + 1e-6:
            self.latest = self._waiting.popleft()
            arrived = True
        return arrived
