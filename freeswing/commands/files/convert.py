"""Convert a trajectory or cameras from one program's format to another's."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from freeswing.console import Console

SUFFIXES = (".csv", ".tum", ".trc", ".c3d")
READ = (*SUFFIXES, ".tsv")
CAMERA_FORMATS = (
    "freeswing", "opencv", "kalibr", "ros", "anipose", "colmap", "colmap-binary", "qualisys",
)  # fmt: skip


def add_arguments(parser: ArgumentParser) -> None:
    """Source, destination and what a change between poses and markers needs."""
    kinds, cameras = ", ".join(READ), ", ".join(CAMERA_FORMATS)
    parser.add_argument("source", metavar="FROM", help=f"trajectory ({kinds}) or cameras")
    parser.add_argument("result", metavar="TO", help="what to write; its ending tells a trajectory")
    parser.add_argument(
        "--to", choices=CAMERA_FORMATS, metavar="FORMAT", help=f"of the new cameras: {cameras}"
    )
    parser.add_argument(
        "--from",
        choices=CAMERA_FORMATS,
        metavar="FORMAT",
        dest="source_format",
        help="of the cameras that are there, where their file does not tell",
    )
    parser.add_argument("--robot", metavar="FILE", help="robot.toml, names the free coordinates")
    parser.add_argument("--target", metavar="FILE", help="target.toml, places the markers")


def run(options: Namespace, console: Console) -> None:
    """Read, convert, write; markers stay markers where both formats hold markers."""
    from freeswing.cdpr.files.documents import InputError

    source, result = Path(options.source), Path(options.result)
    if result.exists() and source.exists() and result.samefile(source):
        raise InputError(f"{result}: source and result are the same file; name another")
    if _is_of_cameras(source, options):
        from freeswing.export.camera_conversion import convert_cameras

        _refuse_trajectory(result)
        losses = convert_cameras(source, result, options.source_format, options.to)
    else:
        losses = _convert_trajectory(source, result, options)
    console.say(str(result))
    for loss in losses:
        console.complain(f"{result}: {loss}")
    console.say_json({"format": "freeswing-conversion/1", "result": str(result), "losses": losses})


def _is_of_cameras(source: Path, options: Namespace) -> bool:
    told = options.source_format is not None or options.to is not None
    return told or source.suffix.lower() not in READ


def _refuse_trajectory(result: Path) -> None:
    from freeswing.cdpr.files.documents import InputError

    if result.suffix.lower() in SUFFIXES:
        raise InputError(f"{result}: cameras do not become a trajectory; its ending says it is one")


def _convert_trajectory(source: Path, result: Path, options: Namespace) -> list[str]:
    from freeswing.cdpr.files.documents import InputError

    if result.suffix.lower() not in SUFFIXES:
        known = ", ".join(SUFFIXES)
        ending = result.suffix or "no ending"
        raise InputError(f"{result}: {ending!r} is not one of a trajectory: {known}")
    if result.suffix.lower() in (".trc", ".c3d"):
        return _write_markers(source, result, options)
    _write_poses(source, result, options)
    return []


def _write_poses(source: Path, result: Path, options: Namespace) -> None:
    from freeswing.cdpr.files.trajectory_files import read_trajectory, write_csv, write_tum

    trajectory = read_trajectory(source, _robot(options), _target(options))
    write = write_csv if result.suffix.lower() == ".csv" else write_tum
    write(result, trajectory)


def _write_markers(source: Path, result: Path, options: Namespace) -> list[str]:
    from freeswing.cdpr.files.documents import InputError
    from freeswing.cdpr.files.trajectory_files import (
        holds_markers,
        read_recording,
        read_trajectory,
        write_c3d,
        write_trc,
    )
    from freeswing.cdpr.markers.marker_units import far_apart
    from freeswing.cdpr.measured.marker_recording import recording_from_poses

    if holds_markers(source):
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
    return far_apart(recording)


def _robot(options: Namespace):
    from freeswing.cdpr.files.robot_file import read_robot

    return read_robot(options.robot) if options.robot else None


def _target(options: Namespace):
    from freeswing.cdpr.measured.target import read_target

    return read_target(options.target) if options.target else None
