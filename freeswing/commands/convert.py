"""Convert a trajectory from one format to another (.csv .tum .trc .c3d)."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from freeswing.console import Console

SUFFIXES = (".csv", ".tum", ".trc", ".c3d")


def add_arguments(parser: ArgumentParser) -> None:
    """Source, destination and what a change between poses and markers needs."""
    kinds = ", ".join(SUFFIXES)
    parser.add_argument("source", metavar="FROM", help=f"trajectory to read: {kinds}")
    parser.add_argument("result", metavar="TO", help=f"file to write: {kinds}")
    parser.add_argument("--robot", metavar="FILE", help="robot.toml, names the free coordinates")
    parser.add_argument("--target", metavar="FILE", help="target.toml, places the markers")


def run(options: Namespace, console: Console) -> None:
    """Read, convert, write; markers stay markers where both formats hold markers."""
    from cdpr.documents import InputError

    source, result = Path(options.source), Path(options.result)
    for path in (source, result):
        if path.suffix.lower() not in SUFFIXES:
            known = ", ".join(SUFFIXES)
            raise InputError(f"{path}: {path.suffix or 'no ending'!r} is not one of {known}")
    if result.exists() and source.exists() and result.samefile(source):
        raise InputError(f"{result}: source and result are the same file; name another")
    if result.suffix.lower() in (".trc", ".c3d"):
        _write_markers(source, result, options)
    else:
        _write_poses(source, result, options)
    console.say(str(result))
    console.say_json({"format": "freeswing-conversion/1", "result": str(result)})


def _write_poses(source: Path, result: Path, options: Namespace) -> None:
    from cdpr.trajectory_files import read_trajectory, write_csv, write_tum

    trajectory = read_trajectory(source, _robot(options), _target(options))
    write = write_csv if result.suffix.lower() == ".csv" else write_tum
    write(result, trajectory)


def _write_markers(source: Path, result: Path, options: Namespace) -> None:
    from cdpr.documents import InputError
    from cdpr.marker_recording import recording_from_poses
    from cdpr.trajectory_files import read_recording, read_trajectory, write_c3d, write_trc

    if source.suffix.lower() in (".trc", ".c3d"):
        recording = read_recording(source)
    else:
        target = _target(options)
        if target is None:
            raise InputError(f"{source}: holds poses; --target says where the markers are")
        trajectory = read_trajectory(source, _robot(options), target)
        if not trajectory.is_pose:
            raise InputError(f"{source}: holds no full poses, so markers cannot be placed")
        recording = recording_from_poses(trajectory, target)
    write = write_trc if result.suffix.lower() == ".trc" else write_c3d
    write(result, recording)


def _robot(options: Namespace):
    from cdpr.robot_file import read_robot

    return read_robot(options.robot) if options.robot else None


def _target(options: Namespace):
    from cdpr.target import read_target

    return read_target(options.target) if options.target else None
