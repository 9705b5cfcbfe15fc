"""drive.toml: a session of a driven robot, read with every error at once."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.model import DrivenModel, build_driven
from freeswing.cdpr.files.documents import InputError, Problems, Reader, inside, load_toml
from freeswing.cdpr.files.drive_csv import read_drive_run, read_static
from freeswing.cdpr.files.robot_file import read_robot
from freeswing.cdpr.system.confine import results_folder
from freeswing.ident.drive.asked_session import DriveSession
from freeswing.ident.drive.kinematics import StaticPoses
from freeswing.ident.drive.run_problem import DriveRun, Noise
from freeswing.ident.drive.unknowns import Asked, Group
from freeswing.session.session_file import ROLES

Array = NDArray[np.float64]

POINTS = {"entries": "anchor_offset", "attachments": "attachment_offset"}
NOT_ASKED = ("current_time_constant_s", "coulomb_width_rad_s")
LARGEST_LATENCY_S = 1.0  # cameras need tenths of it; what is above is written in ms
SHORTEST_RUN = 50  # samples: less holds no motion of any platform at 1 kHz


@dataclass(frozen=True, slots=True)
class DriveFile:
    """A session with where it lies.

    Attributes:
        path: drive.toml.
        name: the session's.
        results: folder of results.
        inputs: every file that was read.
        session: what was recorded.
    """

    path: Path
    name: str
    results: Path
    inputs: tuple[Path, ...]
    session: DriveSession


def drive_path(session: Path | str) -> Path | None:
    """The drive.toml that a session argument names, None where it is another session's.

    A folder that also holds session.toml is a session of free swings, unless the file is named.
    """
    path = Path(session)
    if path.is_dir():
        both = (path / "session.toml").is_file()
        path = path / "drive.toml"
        return path if path.is_file() and not both else None
    return path if path.name == "drive.toml" or _says_drive(path) else None


def _says_drive(path: Path) -> bool:
    try:
        return 'freeswing-drive/1"' in path.read_text(encoding="utf-8")[:200]
    except (OSError, UnicodeDecodeError):
        return False


def read_drive_session(path: Path | str, results: Path | str | None = None) -> DriveFile:
    """Read drive.toml and everything that it names.

    Raises:
        InputError: naming every problem of the file, or the first of another file.
    """
    path = Path(path)
    folder, problems = path.parent, Problems()
    reader = Reader(load_toml(path, "drive", problems), problems)
    name, robot = reader.string("name"), reader.string("robot")
    rate = reader.number("sample_rate_hz", above=0.0)
    noise = _noise(reader)
    zero = _zero_pose(reader.child("encoder_zero", required=False))
    asked = reader.child("unknown")
    wanted = [() if asked is None else asked.strings(key) for key in ("kinematic", "dynamic")]
    if asked is not None:
        asked.finish()
    static, samples = _static_table(reader.child("static", required=False))
    runs = [_run_table(child) for child in reader.children("runs")]
    _check_roles(reader, runs)
    reader.finish()
    problems.raise_if_any(path)
    model, groups = _model(path, inside(folder, robot, "robot"), *wanted)
    _check_zero(path, model, zero)
    files = [inside(folder, run[2], "runs.file") for run in runs]
    records = [read_drive_run(file, model.n_cables) for file in files]
    for file, record in zip(files, records, strict=True):
        if len(record.times_s) < SHORTEST_RUN:
            raise InputError(
                f"{file}: {len(record.times_s)} rows, at least {SHORTEST_RUN} are needed"
            )
    inputs = [path, inside(folder, robot, "robot"), *files]
    poses = None
    if static:
        inputs.append(inside(folder, static, "static.file"))
        read = read_static(inputs[-1], model.n_cables)
        poses = StaticPoses(*read, noise.pose_std / np.sqrt(samples), noise.angle_std_rad)
        _check_static(inputs[-1], poses)
    session = DriveSession(
        model,
        groups,
        tuple(
            DriveRun(run[0], run[1], record, rate)
            for run, record in zip(runs, records, strict=True)
        ),
        poses,
        noise,
        zero,
    )
    written = results_folder(folder, results)
    return DriveFile(path, name, written, tuple(inputs), session)


def _noise(reader: Reader) -> Noise:
    latency = reader.optional_number("pose_latency_s", minimum=0.0, maximum=LARGEST_LATENCY_S)
    step = reader.number("encoder_step_rad", above=0.0)
    position = reader.number("position_std_m", above=0.0)
    angle = reader.number("angle_std_rad", above=0.0)
    current = reader.number("current_std_A", above=0.0)
    return Noise(step / np.sqrt(12.0), np.repeat([position, angle], 3), latency or 0.0, current)


def _zero_pose(reader: Reader | None) -> Array | None:
    if reader is None:
        return None
    position, quaternion = reader.vector("position_m", 3), reader.unit_vector("q", 4)
    reader.finish()
    return np.concatenate([position, quaternion])


def _static_table(reader: Reader | None) -> tuple[str, int]:
    if reader is None:
        return "", 1
    found = reader.string("file"), reader.integer("samples", minimum=1)
    reader.finish()
    return found


def _run_table(reader: Reader) -> tuple[str, str, str]:
    found = reader.string("name"), reader.string("role", choices=ROLES), reader.string("file")
    reader.finish()
    return found


def _check_roles(reader: Reader, runs: list[tuple[str, str, str]]) -> None:
    roles, names = [run[1] for run in runs], [run[0] for run in runs]
    for role, why in (
        ("identify", "there is nothing to estimate from"),
        ("validate", "a fit without a run kept apart says nothing; record one more"),
    ):
        if role not in roles:
            reader.add("runs", f'no run has role = "{role}": {why}')
    for name in {name for name in names if names.count(name) > 1}:
        reader.add("runs", f"two runs are called {name!r}")


def _model(
    path: Path, robot_path: Path, kinematic: tuple[str, ...], dynamic: tuple[str, ...]
) -> tuple[DrivenModel, Asked]:
    robot = read_robot(robot_path)
    if robot.drive is None:
        raise InputError(f"{robot_path}: has no [drive]: this session is of a driven robot")
    model = build_driven(robot, tuple(POINTS[name] for name in kinematic if name in POINTS))
    groups = [
        group for name in kinematic for group in unknown_groups(path, model, "kinematic", name)
    ]
    n_kinematic = len(groups)
    groups += [group for name in dynamic for group in unknown_groups(path, model, "dynamic", name)]
    members = [name for group in groups for name in group.members]
    twice = sorted({name for name in members if members.count(name) > 1})
    if twice:
        raise InputError(f"{path}: unknown: {', '.join(twice)} is asked for twice")
    if len(groups) == n_kinematic:
        raise InputError(f"{path}: unknown.dynamic: is empty; name at least one number")
    return model, Asked(tuple(groups), n_kinematic)


def unknown_groups(path: Path, model: DrivenModel, key: str, text: str) -> list[Group]:
    """The unknowns of one entry: a name, names tied by =, or all points.

    Args:
        path: of the file that has the entry.
        model: the robot.
        key: kinematic or dynamic.
        text: the entry.

    Raises:
        InputError: for a name that there is not, or that belongs to the other list.
    """
    if key == "kinematic" and text in POINTS:
        prefix = f"{POINTS[text]}."
        return [Group(name, (name,)) for name in model.names if name.startswith(prefix)]
    drive = model.robot.drive
    shape = () if drive is None else drive.shape.free
    members = tuple(part.strip() for part in text.split("="))
    for member in members:
        is_geometry = member in shape or member.startswith("drum_radius_m")
        known = [
            name
            for name in model.numbers.names
            if (name in shape or name.startswith("drum_radius_m")) == (key == "kinematic")
            and name not in NOT_ASKED
        ]
        if member not in known:
            more = ", entries, attachments" if key == "kinematic" else ""
            other = "; it belongs to the other list" if is_geometry != (key == "kinematic") else ""
            other = other if member in model.numbers.names else ""
            raise InputError(
                f"{path}: unknown.{key}: {member[:60]!r} is not one of {', '.join(known)}{more}"
                f"{other}"
            )
    return [Group(members[0], members)]


def _check_zero(path: Path, model: DrivenModel, zero: Array | None) -> None:
    if zero is None:
        return
    low, high = model.robot.entries_m.min(axis=0), model.robot.entries_m.max(axis=0)
    if ((zero[:3] <= low) | (zero[:3] >= high)).any():
        raise InputError(
            f"{path}: encoder_zero.position_m: {zero[:3].tolist()} is outside the robot's frame, "
            f"{low.round(3).tolist()} to {high.round(3).tolist()} m"
        )


def _check_static(path: Path, poses: StaticPoses) -> None:
    empty = np.flatnonzero(~np.isfinite(poses.poses).all(axis=1))
    if len(empty):
        raise InputError(f"{path}: static pose {empty[0] + 1} has no pose: every row needs one")
