"""Read task.toml: where the platform is asked to be, and with what it is watched."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from freeswing.cdpr.files.documents import load_toml
from freeswing.cdpr.files.problems import Problems
from freeswing.cdpr.files.table_reader import Reader
from freeswing.cdpr.frozen import freeze
from freeswing.servo.files.weights_file import Camera
from freeswing.servo.synthesis.state_space import Array

# The paper's camera (its section 2.2) and encoder; what it leaves open is said in the sample.
USUAL_CAMERA = Camera(0.005, 0.0107)
POSITION_STD_M = 0.0017
ANGLE_STD_RAD = 0.005
ENCODER_STEP_RAD = 2.0 * np.pi / 4096
# The last step is held as long as the steps before it, or so long where there is none.
LAST_HOLD_S = 2.0
# Beyond this a robot of some metres is meant in millimetres.
LARGEST_POSITION_M = 100.0
LONGEST_S = 600.0


@dataclass(frozen=True, slots=True)
class Watch:
    """What the control loop sees.

    Attributes:
        camera: when poses come.
        position_std_m: of each coordinate of each pose.
        angle_std_rad: the same of each angle.
        encoder_step_rad: 0 for exact encoders.
    """

    camera: Camera = USUAL_CAMERA
    position_std_m: float = POSITION_STD_M
    angle_std_rad: float = ANGLE_STD_RAD
    encoder_step_rad: float = ENCODER_STEP_RAD


@dataclass(frozen=True, slots=True)
class Task:
    """Poses to be held one after another.

    Attributes:
        times_s: when each begins, (n,), the first 0.
        poses: [x y z roll pitch yaw] of eq. (1), (n, 6).
        end_s: when the last one ends.
        watch: what the control loop sees.
    """

    times_s: Array
    poses: Array
    end_s: float
    watch: Watch

    def __post_init__(self) -> None:
        freeze(self, "times_s", "poses")

    def at(self, times_s: Array) -> Array:
        """The pose asked for at each time, (n_t, 6)."""
        # A sample computed as 2.9999999999996 belongs to the step at 3.
        step = np.searchsorted(self.times_s, np.asarray(times_s) + 1e-9, side="right") - 1
        return self.poses[np.maximum(step, 0)]


def read_task(path: Path | str) -> Task:
    """Read and check a task file.

    Raises:
        InputError: unreadable, or naming every key that is wrong.
    """
    problems = Problems()
    reader = Reader(load_toml(path, "task", problems), problems)
    steps = [_step(child) for child in reader.children("steps")]
    if not steps:
        reader.add("steps", "none: write at least one [[steps]]")
    end = reader.optional_number("end_s", above=0.0, maximum=LONGEST_S)
    watch = _watch(reader)
    reader.finish()
    times = np.array([time for time, _ in steps])
    _check_times(reader, times, end)
    problems.raise_if_any(path)
    poses = np.array([pose for _, pose in steps])
    hold = float(np.diff(times)[-1]) if len(times) > 1 else LAST_HOLD_S
    return Task(times, poses, float(times[-1] + hold) if end is None else end, watch)


def _check_times(reader: Reader, times: Array, end: float | None) -> None:
    if len(times) == 0 or np.isnan(times).any():
        return
    if times[0] != 0.0:
        reader.add("steps[1].t_s", f"{times[0]:g}: the first step begins at 0")
    late = np.flatnonzero(np.diff(times) <= 0.0)
    if len(late):
        i = int(late[0]) + 1
        reader.add(f"steps[{i + 1}].t_s", f"{times[i]:g} after {times[i - 1]:g}: must increase")
    if end is not None and end <= times[-1]:
        reader.add("end_s", f"{end:g} is not after the last step at {times[-1]:g}")


def _step(reader: Reader) -> tuple[float, Array]:
    time = reader.number("t_s", minimum=0.0, maximum=LONGEST_S)
    position = reader.vector("position_m", 3)
    angles = reader.optional_vector("angles_rad", 3)
    angles = np.zeros(3) if angles is None else angles
    if (np.abs(position) > LARGEST_POSITION_M).any():
        far = np.abs(position).max()
        reader.add("position_m", f"{far:g} m: is this in millimetres? write metres")
    if (np.abs(angles) > np.pi).any():
        far = np.abs(angles).max()
        reader.add("angles_rad", f"{far:g} rad: is this in degrees? write radians")
    elif abs(abs(angles[1]) - np.pi / 2) < 0.05:
        reader.add("angles_rad", "pitch near 90 degrees, where roll and yaw cannot be told apart")
    reader.finish()
    return time, np.concatenate([position, angles])


def _watch(reader: Reader) -> Watch:
    table = reader.child("watch", required=False)
    if table is None:
        return Watch()

    def given(key: str, usual: float, maximum: float) -> float:
        number = table.optional_number(key, minimum=0.0, maximum=maximum)
        return usual if number is None else number

    period = given("period_s", USUAL_CAMERA.period_s, 1.0)
    if period == 0.0:
        table.add("period_s", "0: the time between two poses must be positive")
    camera = Camera(period, given("latency_s", USUAL_CAMERA.latency_s, 1.0))
    watch = Watch(
        camera,
        given("position_std_m", POSITION_STD_M, 1.0),
        given("angle_std_rad", ANGLE_STD_RAD, 1.0),
        given("encoder_step_rad", ENCODER_STEP_RAD, 1.0),
    )
    table.finish()
    return watch
