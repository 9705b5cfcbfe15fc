"""What is wrong with recordings of a driven robot before anything is fitted to them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.slopes import length_slope, pose_map
from freeswing.cdpr.measured.quaternion_readings import LEFT_OVER, READINGS
from freeswing.cdpr.model.batch import evaluate
from freeswing.ident.drive.asked_session import DriveSession
from freeswing.ident.drive.inverse_dynamics import flowing
from freeswing.ident.drive.kinematics import StaticPoses, most_likely
from freeswing.ident.drive.run_problem import DriveRun

Array = NDArray[np.float64]

JUMP = 0.5  # of a sample period: a time stamp that far off is another row's
WRONG_RATE = 0.01  # another rate is off by a factor, a clock by 1e-4
# Units: milliampere are 1000 times the current that flows, and between 1 and 1000 lies no unit.
MILLI = 30.0
UNLIKE_CURRENT = 0.5  # of the current's own scatter: the loop follows its reference to 1 %
# Slope of angles against those of the poses: 57.3 for degrees, where geometry is 30 % off 40 to 82.
LEAST_DEGREES = 30.0
MOST_DEGREES = 110.0
COUNTS = 150.0  # 4096 counts a turn are 652 a radian; 1024 are 163
ALIKE = 0.9  # correlation of a motor's angle with its own cable's: 0.99 with geometry 30 % off
STRANGER = 0.97  # with another's cable, where columns are swapped
CLEAR = 5.0  # times what the poses' noise makes: correlation of a right cable is above 0.98 then
LATENCY_S = 0.003  # 1 mm and 5 mrad of noise over one second tell it to 0.3 ms
START_S = 0.004  # long enough for counts to tell a motion, short enough for currents to cause none
START_COUNTS = 3.0  # an encoder at rest between two counts shows one, noise of its edge another
LEAST_MOTION = 20.0  # encoder steps: below, a run excites nothing
ODD_ROW = 60.0  # chi-square of 8 angles and 6 pose coordinates: 1e-8 by chance


def findings(session: DriveSession) -> list[str]:
    """Everything that is wrong, one sentence each: what, where, what to do."""
    found = [text for run in session.runs for text in _times(run)]
    if found:
        return found
    found = [text for run in session.runs for text in _orientations(session, run)]
    if found:
        return found
    found = _static_units(session)
    for run in session.runs:
        found += _currents(session, run) + _angles(session, run)
    if found:
        return list(dict.fromkeys(found))
    for run in session.runs:
        found += _start(session, run) + _still(session, run) + _latency(session, run)
    return found + _static(session)


def _times(run: DriveRun) -> list[str]:
    times, period = run.record.times_s, 1.0 / run.rate_hz
    gaps = np.diff(times)
    usual = float(np.median(gaps))
    if abs(usual / period - 1.0) > WRONG_RATE:
        return [
            f"run {run.name}: time stamps are {usual:.6g} s apart, sample_rate_hz says "
            f"{period:.6g} s; correct one of them"
        ]
    odd = np.flatnonzero(np.abs(gaps - period) > JUMP * period)
    if len(odd):
        k = int(odd[0])
        return [
            f"run {run.name}: time jumps by {gaps[k]:.6g} s after {times[k]:.6g} s (row {k + 1}) "
            f"where rows are {period:g} s apart; record again, or cut the run there"
        ]
    return []


def _currents(session: DriveSession, run: DriveRun) -> list[str]:
    """Measured currents against what the references make flow."""
    flows = flowing(session.model, session.model.declared, run)
    limit = session.model.drive.current_limits_A[:, 1].max()
    for what, values in (("I", run.record.currents_A), ("Iref", run.record.references_A)):
        if np.abs(values).max() > MILLI * limit:
            return [
                f"run {run.name}: {what} columns reach {np.abs(values).max():.4g} A with limits of "
                f"{limit:g} A: these look like mA; write A"
            ]
    names = [cable.name for cable in session.model.robot.cables]
    between = run.record.currents_A[:, :, None] - flows[:, None, :]
    gaps = np.sqrt(np.mean(between**2, axis=0))  # measured by asked
    spread, found = flows.std(axis=0), []
    for k, name in enumerate(names):
        if gaps[k, k] <= UNLIKE_CURRENT * spread[k] or spread[k] <= 0.05 * limit:
            continue
        other = int(np.argmin(gaps[k]))
        swapped = other != k and np.argmin(gaps[other]) == k
        if swapped and max(gaps[k, other], gaps[other, k]) < UNLIKE_CURRENT * spread[k]:
            pair = " and ".join(sorted((name, names[other])))
            found.append(
                f"run {run.name}: the currents of motors {pair} follow each other's references: "
                "their columns are swapped"
            )
            continue
        found.append(
            f"run {run.name}: the current of motor {name} does not follow its reference "
            f"(rms {gaps[k, k]:.3g} A apart): columns swapped, or a drive that was off"
        )
    return list(dict.fromkeys(found))


@dataclass(frozen=True, slots=True)
class _Told:
    """What encoders and poses tell of the angles at the poses' times.

    Attributes:
        read: by the encoders, (n_p, n).
        told: by the poses and the declared geometry, up to a constant, (n_p, n).
        speed: rates of the read ones, (n_p, n).
        noise: what the poses' own noise makes of the told ones, (n,).
    """

    read: Array
    told: Array
    speed: Array
    noise: Array


def _told(session: DriveSession, run: DriveRun) -> _Told:
    record, rows = run.record, run.record.seen
    when = record.times_s[rows] - session.noise.latency_s
    inside = when >= record.times_s[0]
    rows, when = rows[inside], when[inside]
    read = np.array([np.interp(when, record.times_s, column) for column in record.angles_rad.T]).T
    rates = np.gradient(record.angles_rad, record.times_s, axis=0)
    wide = max(1, round(0.02 * run.rate_hz))
    kernel = np.ones(wide) / wide
    rates = np.array([np.convolve(column, kernel, "same") for column in rates.T]).T
    speed = np.array([np.interp(when, record.times_s, column) for column in rates.T]).T
    model, poses = session.model, record.poses[rows]
    turns, slope = evaluate(length_slope(model), poses, model.declared)[:2]
    by_pose = slope[0] @ pose_map(poses[0])
    noise = np.sqrt((by_pose * session.noise.pose_std) ** 2 @ np.ones(6))
    return _Told(read, -turns, speed, noise)


def _orientations(session: DriveSession, run: DriveRun) -> list[str]:
    """Quaternions in another order, or of the inverse turn: encoders agree with one reading."""
    if len(run.record.seen) < 10:
        return []
    seen = _told(session, run)
    found = _apart(seen)
    if found <= CLEAR * float(np.sqrt(np.mean(seen.noise**2))):
        return []
    off = {}
    for reading, (mend, _) in READINGS.items():
        poses = run.record.poses.copy()
        poses[:, 3:] = mend(poses[:, 3:])
        other = replace(run, record=replace(run.record, poses=poses))
        off[reading] = _apart(_told(session, other))
    best = min(off, key=off.__getitem__)
    if not off[best] <= LEFT_OVER * found:
        return []
    return [
        f"run {run.name}: {best}: angles by poses and encoders are {found:.2g} rad apart as "
        f"recorded, {off[best]:.2g} rad so; {READINGS[best][1]}"
    ]


def _apart(seen: _Told) -> float:
    """Root mean square of what encoders and poses tell apart, their offset left out, rad."""
    between = seen.read - seen.told
    return float(np.sqrt(np.mean((between - between.mean(axis=0)) ** 2)))


def _angles(session: DriveSession, run: DriveRun) -> list[str]:
    """Units, signs and columns of the angles, by what the poses say of every cable."""
    if len(run.record.seen) < 10:
        return []
    seen = _told(session, run)
    read, told = seen.read - seen.read.mean(axis=0), seen.told - seen.told.mean(axis=0)
    least = np.maximum(LEAST_MOTION * session.noise.angle_std_rad, CLEAR * seen.noise)
    moving = told.std(axis=0) >= least
    if not moving.any():
        return []
    norms = np.outer(np.linalg.norm(read, axis=0), np.linalg.norm(told, axis=0))
    alike = (read.T @ told) / np.maximum(norms, 1e-300)
    slopes = np.sum(read * told, axis=0) / np.sum(told**2, axis=0)
    names, found = [cable.name for cable in session.model.robot.cables], []
    unit = _unit(f"run {run.name}", float(np.median(np.abs(slopes[moving]))))
    if unit:
        return unit
    for k in np.flatnonzero(moving):
        name = names[k]
        if alike[k, k] < -ALIKE:
            found.append(
                f"run {run.name}: the angle of motor {name} falls where its cable is wound: angles "
                "grow with winding; turn its sign"
            )
        elif alike[k, k] < ALIKE:
            other = int(np.argmax(alike[k]))
            if other != k and alike[k, other] > STRANGER and alike[other, k] > STRANGER:
                pair = " and ".join(sorted((name, names[other])))
                found.append(
                    f"run {run.name}: the angles of motors {pair} follow each other's cables: "
                    "their columns are swapped"
                )
            elif alike[k, other] < STRANGER:
                found.append(
                    f"run {run.name}: the angle of motor {name} does not follow its cable "
                    f"(correlation {alike[k, k]:.2f}): an encoder that slips or jumped, or "
                    "another column"
                )
    return found


def _unit(where: str, size: float) -> list[str]:
    """What angles are in that move so many times as far as the poses' own."""
    if size > COUNTS:
        return [f"{where}: angles are {size:.0f} times those of the poses: counts? write rad"]
    if LEAST_DEGREES < size < MOST_DEGREES:
        return [f"{where}: angles are {size:.1f} times those of the poses: degrees? write rad"]
    return []


def _static_units(session: DriveSession) -> list[str]:
    """Units of the static poses: currents in mA, angles in degrees or counts."""
    static = session.static
    if static is None or len(static.poses) < 2:
        return []
    limit, most = session.model.drive.current_limits_A[:, 1].max(), np.abs(static.currents_A).max()
    if most > MILLI * limit:
        return [
            f"static poses: currents reach {most:.4g} A with limits of {limit:g} A: these look "
            "like mA; write A"
        ]
    model = session.model
    told = -evaluate(length_slope(model), static.poses, model.declared)[0]
    told, read = told - told.mean(axis=0), static.angles_rad - static.angles_rad.mean(axis=0)
    spread = np.sqrt(np.sum(told**2, axis=0))
    moving = spread > 0.0
    if not moving.any():
        return []
    slopes = np.sum(read * told, axis=0)[moving] / spread[moving] ** 2
    return _unit("static poses", float(np.median(np.abs(slopes))))


def _start(session: DriveSession, run: DriveRun) -> list[str]:
    """A record that starts in motion: angles change by more than its currents can have done."""
    model, count = session.model, max(2, round(START_S * run.rate_hz))
    numbers = dict(zip(model.names, model.declared, strict=True))
    ratios = [
        torque / numbers[name.replace("torque_constant_N_m_A", "motor_inertia_kg_m2")]
        for name, torque in numbers.items()
        if name.startswith("torque_constant_N_m_A")
        and name.replace("torque_constant_N_m_A", "motor_inertia_kg_m2") in numbers
    ]
    step = 12**0.5 * session.noise.angle_std_rad
    changed = np.abs(run.record.references_A[0] - run.record.currents_A[0]).max()
    caused = 0.5 * max(ratios, default=0.0) * changed * START_S**2 + START_COUNTS * step
    moved = np.abs(run.record.angles_rad[count] - run.record.angles_rad[0])
    worst = int(np.argmax(moved))
    if moved[worst] <= caused:
        return []
    return [
        f"run {run.name}: starts in motion (motor {model.robot.cables[worst].name} turns by "
        f"{moved[worst]:.2g} rad in the first {1e3 * START_S:g} ms, from rest it would be "
        f"{caused:.2g} at most): cut it to where the platform still stands"
    ]


def _still(session: DriveSession, run: DriveRun) -> list[str]:
    travel = np.ptp(run.record.angles_rad, axis=0).max() / (12**0.5 * session.noise.angle_std_rad)
    if travel >= LEAST_MOTION:
        return []
    return [
        f"run {run.name}: no motor turns by more than {travel:.0f} encoder steps: nothing is "
        "excited; raise the currents"
    ]


def _latency(session: DriveSession, run: DriveRun) -> list[str]:
    """Poses earlier or later than the session says, by the angles' own motion."""
    if len(run.record.seen) < 50:
        return []
    seen = _told(session, run)
    scatter = seen.noise / np.maximum(seen.speed.std(axis=0), 1e-300) / np.sqrt(len(seen.told))
    moving = np.flatnonzero(CLEAR * scatter < LATENCY_S)
    if len(moving) == 0:
        return []
    delays = []
    for k in moving:
        columns = np.column_stack([seen.told[:, k], np.ones(len(seen.told)), seen.speed[:, k]])
        delays.append(np.linalg.lstsq(columns, seen.read[:, k], rcond=None)[0][2])
    delay = float(np.median(delays))
    if abs(delay) < LATENCY_S:
        return []
    return [
        f"run {run.name}: poses are true {1e3 * (session.noise.latency_s + delay):.1f} ms before "
        f"their rows, pose_latency_s says {1e3 * session.noise.latency_s:.1f} ms; correct it"
    ]


def _static(session: DriveSession) -> list[str]:
    """A static row that contradicts the others."""
    asks = bool(session.asked.kinematic.groups)
    if session.static is None or len(session.static.poses) < 4 or not asks:
        return []
    squares = _static_squares(session, session.static)
    worst = int(np.argmax(squares))
    rest = float(np.median(squares))
    if squares[worst] < ODD_ROW or squares[worst] < 4.0 * rest:
        return []
    others = np.arange(len(squares)) != worst
    static = session.static
    alone = replace(
        static,
        currents_A=static.currents_A[others],
        angles_rad=static.angles_rad[others],
        poses=static.poses[others],
    )
    if np.median(_static_squares(session, alone)) > ODD_ROW:
        return []  # they contradict each other without it too: the model is wrong, not the row
    return [
        f"static pose {worst + 1} contradicts the others (chi-square {squares[worst]:.0f}, the "
        f"others' median {rest:.0f}): not at rest, or an encoder that jumped; record it again"
    ]


def _static_squares(session: DriveSession, static: StaticPoses) -> Array:
    """Chi-square of every static pose's angles and coordinates, (n_p,)."""
    model = session.model
    best = most_likely(model, model.declared, session.asked.kinematic, static, session.zero_pose)
    theta = session.asked.kinematic.put(model, model.declared, best.values)
    turns = evaluate(length_slope(model), best.poses, theta)[0]
    gaps = (best.offsets_rad - turns - static.angles_rad) / static.angle_std_rad
    shifts = best.found.values[-6 * len(static.poses) :].reshape(-1, 6) / static.pose_std
    return np.sum(gaps**2, axis=1) + np.sum(shifts**2, axis=1)
