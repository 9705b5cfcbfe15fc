"""The texts of target.toml and session.toml."""

from __future__ import annotations

from collections.abc import Sequence

from freeswing.starter.markers import Recorded, role

TAGS = 4
TAG_FAMILY = "tag36h11"


def marker_target(found: Recorded) -> str:
    """target.toml of recorded markers."""
    lines = [
        'format = "freeswing-target/1"',
        f"# Platform frame: origin at marker {found.names[0]}, axes as the base's while it hangs",
        "# at rest. Measure attachment_m in robot.toml from that marker along those axes.",
    ]
    for name, place in zip(found.names, found.positions_m, strict=True):
        at = ", ".join(f"{value:.6f}" for value in place + 0.0)
        lines += ["", "[[markers]]", f'name = "{name}"', f"position_m = [{at}]"]
    return "\n".join([*lines, ""])


def marker_session(name: str, found: Recorded) -> str:
    """session.toml of recorded markers: a run a file, a third of them kept apart."""
    lines = [
        'format = "freeswing-session/1"',
        f'name = "{name}"',
        'robot = "robot.toml"',
        'target = "target.toml"',
        f"frame_rate_hz = {found.rate_hz:g}",
    ]
    for k, file in enumerate(found.files):
        lines += [
            "",
            "[[runs]]",
            f'name = "{file.stem}"',
            f'role = "{role(k, len(found.files))}"      # identify, or validate: never fitted',
            f'trajectory = "runs/{file.name}"',
            "# window_s = [2.0, 12.0]   # the free motion; absent: the program finds it",
            "# cable_lengths_m = []     # as held; absent: from the poses",
        ]
    return "\n".join([*lines, ""])


def tag_target(size_m: float) -> str:
    """target.toml of printed tags."""
    lines = [
        'format = "freeswing-target/1"',
        "# Platform frame: wherever you like on the platform. Print with `freeswing board`, glue",
        "# flat, and measure each tag's centre and turn (w, x, y, z) in that frame.",
    ]
    for k in range(TAGS):
        lines += [
            "",
            "[[tags]]",
            f'family = "{TAG_FAMILY}"',
            f"id = {k}",
            f"size_m = {size_m:g}          # side of the black border, as printed: measure it",
            "q_platform_tag = [1.0, 0.0, 0.0, 0.0]",
            "t_platform_tag_m = [nan, nan, nan]",
        ]
    return "\n".join([*lines, ""])


def filmed_session(name: str, runs: Sequence[tuple[str, str]]) -> str:
    """session.toml of cameras: recordings to be put where it says."""
    lines = [
        'format = "freeswing-session/1"',
        f'name = "{name}"',
        'robot = "robot.toml"',
        'target = "target.toml"',
        "",
        "[calibration]                    # film the printed board with all cameras at once",
        'recordings = "calibration"       # calibration/<camera>.mp4',
        'board = { kind = "charuco", squares = [9, 6], square_m = 0.03, marker_m = 0.022, '
        'dictionary = "DICT_5X5_100" }',
        "# [[calibration.base_tags]]      # a surveyed tag on the frame ties cameras to it",
    ]
    for run, kind in runs:
        lines += ["", "[[runs]]", f'name = "{run}"', f'role = "{kind}"', f'video = "runs/{run}"']
    return "\n".join([*lines, ""])
