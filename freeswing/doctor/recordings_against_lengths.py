"""Recordings and cables that were meant otherwise: units, axes, orders, ends of other cables.

Every turn is a turn and every number a length, so no file tells it. Locked cables do: they keep
their length, and the one that is stated, where a recording is read as it was meant. Mistakes come
together, so every unit is tried with all axes and orders.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import permutations, product

import numpy as np
from scipy.optimize import linear_sum_assignment

from freeswing.cdpr.files.problems import DataError
from freeswing.cdpr.measured.quaternion_readings import LEFT_OVER, READINGS
from freeswing.cdpr.measured.recording_to_base_frame import UP_TURNS, moved_trajectory
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.model.batch import evaluate
from freeswing.cdpr.model.equations import Model, build_model
from freeswing.cdpr.robot import Array, Robot
from freeswing.cdpr.rotation import matrix_from_quaternion, quaternion_from_matrix, transform
from freeswing.doctor.finding import named_runs
from freeswing.ident.runs import SwingRun

# Geometry known to a centimetre moves lengths by some mm along a swing: more is another matter,
# and a reading that leaves more is not the one that was meant.
LENGTHS_OFF_M = 0.02
LEFT_BY_A_SLIP = 0.05
"""Of what is wrong as recorded: geometry that is right leaves some millimetres of 20 and more."""
UNITS_M = {"millimetres": 1e-3, "centimetres": 1e-2, "inches": 0.0254, "feet": 0.3048}
SAMPLES_TRIED = 200
"""Looked at of a run; cables that keep their length keep it in any of them."""
QUARTERS = tuple(
    turn
    for order in permutations(range(3))
    for signs in product((1.0, -1.0), repeat=3)
    if np.linalg.det(turn := np.diag(signs)[:, order]) > 0.0 and not np.array_equal(turn, np.eye(3))
)
"""All 23 turns of a frame that put its axes on axes."""
MOST_ORDERED = 4
"""Cables of which every order of ends is tried: 23 others."""
ENDS = {
    "attachment_offset": ("attachment_m", "put each attachment with its entry and its length"),
    "anchor_offset": (
        "entry_m",
        "put each entry with its swivel axes, its attachment and its length",
    ),
}
"""By what moves them: the key of a cable, and what to do."""


@dataclass(frozen=True, slots=True)
class _Reading:
    """Poses and cables as they may have been meant, with what each mistake is and its remedy."""

    poses: Trajectory
    model: Model
    said: tuple[str, ...]
    remedies: tuple[str, ...]
    values: Array | None = None
    is_slip: bool = False


def mistaken_recording(run: SwingRun, robot: Robot) -> tuple[str, str]:
    """How a run was meant, and what to do; empty where it is read right.

    Of readings that leave nearly as little the one with the fewest mistakes is told; of those that
    are one, as on a platform that looks alike once it is turned, the first.

    Source:
        Murray, Li, Sastry 1994, A Mathematical Introduction to Robotic Manipulation, ch. 2: unit
        quaternions, their order and conjugate.
    """
    part = run.known_poses()
    if part is None:
        return "", ""
    model = build_model(robot)
    found = _lengths_off(model, part, run.lengths_m)
    if found < LENGTHS_OFF_M:
        return "", ""
    few = part.take(np.arange(len(part))[:: max(1, len(part) // SAMPLES_TRIED)])
    readings = [*_readings(few, model), *_orders(few, robot), *_turns(few, model)]
    readings += _slips(few, robot)
    stated = run.lengths_m
    off = np.array([_lengths_off(one.model, one.poses, stated, one.values) for one in readings])
    # An end that is really elsewhere may come near one of many slips, but not that near.
    slips = np.array([one.is_slip for one in readings])
    off[slips & (off > LEFT_BY_A_SLIP * found)] = np.inf
    most = min(LEFT_OVER * found, LENGTHS_OFF_M)
    if off.min() > most:
        return "", ""
    nearly = [k for k in range(len(off)) if off[k] <= min(off.min() / LEFT_OVER, most)]
    best = min(nearly, key=lambda k: (len(readings[k].said), round(off[k], 6)))
    told = (
        f"cable lengths are off by {1e3 * found:.0f} mm" if np.isfinite(found) else "no cable fits"
    )
    said, remedy = ", ".join(readings[best].said), "; ".join(readings[best].remedies)
    return f"{said}: {told} as recorded, by {1e3 * off[best]:.1f} mm so", remedy


def _readings(part: Trajectory, model: Model) -> Iterator[_Reading]:
    """All other ways to read some of a run's poses."""
    q = quaternion_from_matrix(part.rotations())
    # q and -q are one turn, but not once w stands elsewhere: signs follow the sample before.
    signs = np.cumprod(np.where(np.sum(q[1:] * q[:-1], axis=1) < 0.0, -1.0, 1.0))
    q[1:] *= signs[:, None]
    orders = [("", (lambda same: same), ""), *((name, *how) for name, how in READINGS.items())]
    units = [("", 1.0), *UNITS_M.items()]
    for (order, mend, do), (unit, size_m), up, hand in product(
        orders, units, UP_TURNS, (1.0, -1.0)
    ):
        # Seen in a mirror that turns y round a turn goes the other way about x and z.
        rotations = matrix_from_quaternion(mend(q) * np.array([1.0, hand, 1.0, hand]))
        positions = size_m * part.positions() * np.array([1.0, hand, 1.0])
        poses = Trajectory.from_poses(part.times_s, positions, rotations)
        if up != "z":
            poses = moved_trajectory(poses, transform(UP_TURNS[up], np.zeros(3)))
        mistakes = [
            (order, do),
            (f"positions are in {unit}" if unit else "", "write metres"),
            (
                f"its axis {up} points up" if up != "z" else "",
                f'say so in session.toml: [mocap] up = "{up}"',
            ),
            (
                "its axes are left-handed" if hand < 0.0 else "",
                "turn the signs of y_m, qx and qz",
            ),
        ]
        made = [one for one in mistakes if one[0]]
        if made:
            yield _Reading(poses, model, tuple(m[0] for m in made), tuple(m[1] for m in made))


def _turns(part: Trajectory, model: Model) -> Iterator[_Reading]:
    """The platform's frame turned by quarters: attachments turned alike are poses turned back."""
    said = "robot.toml has all attachment_m in a frame that is turned against the recorded one"
    do = "give them in the frame of the platform that the poses are of"
    for turn in QUARTERS:
        turned = part.rotations() @ turn
        poses = Trajectory.from_poses(part.times_s, part.positions(), turned)
        yield _Reading(poses, model, (said,), (do,))


def _orders(part: Trajectory, robot: Robot) -> Iterator[_Reading]:
    """The cables with ends of each other."""
    cables = robot.cables
    if len(cables) > MOST_ORDERED:
        return
    model = build_model(robot, tuple(ENDS))
    for effect, (key, do) in ENDS.items():
        ends = np.array([getattr(cable, key) for cable in cables])
        for order in permutations(range(len(cables))):
            moved = [k for k, own in enumerate(order) if k != own]
            if not moved:
                continue
            values = _moved(model, effect, ends[list(order)] - ends)
            names = ", ".join(cables[k].name for k in moved)
            said = f"robot.toml has {key} of cables {names} in each other's place"
            yield _Reading(part, model, (said,), (do,), values)


def _slips(part: Trajectory, robot: Robot) -> Iterator[_Reading]:
    """One end of one cable with a sign turned, two numbers exchanged or a decimal point moved.

    None where cables keep their length: what is stated may be wrong by what one of many slips does.
    """
    if _lengths_off(build_model(robot), part, None) < LENGTHS_OFF_M:
        return
    model = build_model(robot, tuple(ENDS))
    for effect, (key, _) in ENDS.items():
        for k, cable in enumerate(robot.cables):
            own = np.array(getattr(cable, key))
            for said, meant in _slipped(own):
                moved = np.zeros((robot.n_cables, 3))
                moved[k] = meant - own
                values = _moved(model, effect, moved)
                said = f"robot.toml has {said} in {key} of cable {cable.name}"
                yield _Reading(part, model, (said,), ("correct it",), values, is_slip=True)


def _moved(model: Model, effect: str, ends_m: Array) -> Array:
    """A model's values where ends of cables are moved by so much, (n, 3), and all else is right."""
    values = np.zeros(len(model.parameters))
    values[model.place_of(effect)] = ends_m.ravel()
    return values


def _slipped(point: Array) -> Iterator[tuple[str, Array]]:
    """How a point may have been meant, (3,), and what then was done wrong."""
    for k, axis in enumerate("xyz"):
        for said, factor in (
            ("the sign of {} turned", -1.0),
            ("{} ten times too large", 0.1),
            ("{} ten times too small", 10.0),
        ):
            meant = point.copy()
            meant[k] *= factor
            yield said.format(axis), meant
        following = (k + 1) % 3
        order = list(range(3))
        order[k], order[following] = order[following], order[k]
        yield f"{axis} and {'xyz'[following]} exchanged", point[order]


def refuse_mistaken_recordings(swings: Sequence[SwingRun], robot: Robot) -> None:
    """Refuse runs that fit the cables once they are read another way.

    Raises:
        DataError: naming the runs, and what to do.
    """
    told = [(swing.name, *mistaken_recording(swing, robot)) for swing in swings]
    wrong = [one for one in told if one[1]]
    if wrong:
        _, said, remedy = wrong[0]
        raise DataError(f"{named_runs([one[0] for one in wrong])}: {said}; {remedy}")


def _lengths_off(
    model: Model, poses: Trajectory, stated_m: Array | None, values: Array | None = None
) -> float:
    """What cables change along a run (98 % of its samples) or are off what is stated, m.

    In whatever order it is stated: lengths of other cables are another mistake, said elsewhere.
    """
    values = model.start_values if values is None else values
    lengths = evaluate(model.lengths, poses.values, values)[0].reshape(len(poses), -1)
    if not np.isfinite(lengths).all():
        return np.inf
    spread = float(np.ptp(np.percentile(lengths, [1.0, 99.0], axis=0), axis=0).max())
    if stated_m is None or len(stated_m) != lengths.shape[1]:
        return spread
    apart = np.abs(lengths.mean(axis=0)[:, None] - stated_m)
    return max(spread, float(apart[linear_sum_assignment(apart)].max()))
