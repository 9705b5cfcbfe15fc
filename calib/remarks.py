"""What a reader of a calibration should know, in words."""

from __future__ import annotations

import numpy as np

from freeswing.calib.board.board_unlike_seen import marker_warning
from freeswing.calib.board.declared_board import Board
from freeswing.calib.rig.reprojection import board_size
from freeswing.calib.rig.solve_rig import Rig
from freeswing.calib.rig.tie_by_shared_boards import board_groups


def moved_warnings(moved: tuple[tuple[str, float], ...]) -> list[str]:
    """Says whose base tags moved, and by how many px."""
    return [
        f"camera {name}: its base tags moved by {drift:.1f} px during the recording; fasten it and "
        "record again"
        for name, drift in moved
    ]


def clock_warnings(rig: Rig) -> list[str]:
    """Says which cameras' clocks were not measured, or searched from their stamps alone."""
    if len(rig.cameras) < 2:
        return []
    if rig.adjustment.scene.motion.any():
        return [
            f"camera {name}: the board does not tell whether its recording was started with the "
            "others (it is seen too seldom together, or moves alike again and again): its stamps "
            "are taken to be of one clock with theirs; if they are not, wave the board for 10 s "
            "where all cameras see it"
            for name in rig.guessed_clocks
        ]
    return [
        "the board moved too little for the cameras' clocks: they are taken to agree here, and "
        "`track` measures them from the swing; wave the board about to have them calibrated"
    ]


def marker_said(board: Board, rig: Rig) -> str | None:
    """Says when the board's markers are not as large as stated."""
    return marker_warning(board, float(rig.adjustment.scene.warp_m[2]))


def group_warnings(rig: Rig) -> list[str]:
    """Says which cameras no board joins, and what does."""
    n_board = board_size(rig.problem.board_points_m)
    views = rig.problem.views
    on_board = np.asarray(views.seen[:, :n_board].any(axis=1))
    groups = board_groups(len(rig.cameras), views.select(on_board))
    if not groups.any():
        return []
    parts = [
        " ".join(c.name for c, own in zip(rig.cameras, groups, strict=True) if own == group)
        for group in np.unique(groups)
    ]
    apart = f"no board view joins these cameras: {' | '.join(parts)}"
    if not on_board.all():
        tags = " and the base tags" if rig.problem.fixed is not None else ""
        return [
            f"{apart}. The platform's tags in the swings{tags} do: target.toml's places of the "
            "tags are then as good as the cameras' distances"
        ]
    return [
        f"{apart}. The base tags and points do: best where those of a camera are not in one plane, "
        "one tag a third nearer than the other; clocks are measured within each group alone, "
        "between groups `track` finds them from the swing"
    ]


def no_base_warning(reference: str) -> str:
    """Says what the base frame is without base tags."""
    return (
        f"no base tags: camera {reference} is the base frame, so gravity and cable anchors in "
        "robot.toml do not fit it; survey tags on the frame and name them in session.toml"
    )


def rig_warnings(rig: Rig, spread: float) -> list[str]:
    """What is to be said of the rig, and of how far its halves are apart."""
    return [*spread_warnings(spread), *group_warnings(rig), *clock_warnings(rig)]


def spread_warnings(spread: float) -> list[str]:
    """Says when the halves of the footage differ by more than corners' noise makes them."""
    if spread == 1.0:
        return []
    return [
        f"lenses from two halves of the footage differ {np.sqrt(spread):.1f} times as much as the "
        "corners' noise lets them (a board that is not flat, a lens that is not the model's, a "
        "shutter that rolls): all deviations are that much larger"
    ]
