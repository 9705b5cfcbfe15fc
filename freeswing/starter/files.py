"""The texts of target.toml and session.toml for recordings that exist."""

from __future__ import annotations

from freeswing.cdpr.files.toml_text import toml_string
from freeswing.starter.bench_signals import bench_of_poses
from freeswing.starter.markers import Recorded, role


def marker_target(found: Recorded) -> str:
    """target.toml of recorded markers."""
    lines = [
        'format = "freeswing-target/1"',
        f"# Platform frame: origin at marker {found.names[0]}, axes as the base's while it hangs",
        "# at rest. Measure attachment_m in robot.toml from that marker along those axes.",
    ]
    for name, place in zip(found.names, found.positions_m, strict=True):
        at = ", ".join(f"{value:.6f}" for value in place + 0.0)
        lines += ["", "[[markers]]", f"name = {toml_string(name)}", f"position_m = [{at}]"]
    return "\n".join([*lines, ""])


def recorded_session(name: str, found: Recorded, bench_cables: int | None = None) -> str:
    """session.toml of recordings: a run a swing, a third of them kept apart.

    Args:
        name: of the session.
        found: in the recordings.
        bench_cables: how many wires a bench has, on which something may lie; else None.
    """
    lines = [
        'format = "freeswing-session/1"',
        f"name = {toml_string(name)}",
        'robot = "robot.toml"',
        *(['target = "target.toml"'] if found.names else []),
        f"frame_rate_hz = {found.rate_hz:g}",
        "# Where the recordings' axes are not the base frame's (another axis points up, say):",
        "# [mocap]",
        '# up = "y"                 # or three points measured in both frames: docs/formats.md',
    ]
    load, carried = ([], []) if bench_cables is None else bench_of_poses(bench_cables)
    lines += load
    for k, run in enumerate(found.runs):
        lines += [
            "",
            "[[runs]]",
            f"name = {toml_string(run.name)}",
            f'role = "{role(k, len(found.runs))}"      # identify, or validate: never fitted',
            f"trajectory = {toml_string(f'runs/{run.file.name}')}",
        ]
        if run.window_s is None and carried:  # of parallel wires, or loaded, all of it is fitted
            lines.append("# window_s = [2.0, 32.0]   # from after the hand has let go")
        elif run.window_s is None:
            lines.append("# window_s = [2.0, 12.0]   # the free motion; absent: it is found")
        else:
            start, end = run.window_s
            lines.append(f"window_s = [{start:.2f}, {end:.2f}]    # a free swing that was found")
        lines += carried or ["# cable_lengths_m = []     # as held; absent: from the poses"]
    return "\n".join([*lines, ""])
