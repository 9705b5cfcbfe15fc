"""What is asked of a robot's recordings and file before anything is computed from them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from freeswing.doctor.recordings_against_lengths import refuse_mistaken_recordings
from freeswing.doctor.robot_file.mistaken_cables import refuse_mistaken_cables
from freeswing.doctor.run_samples import refuse_far_platforms
from freeswing.doctor.time_stamps import refuse_wrong_stamps
from freeswing.session.exchanged_lengths import refuse_exchanged_lengths
from freeswing.session.load_swings import measured_swings
from freeswing.session.repeated_runs import refuse_repeated

if TYPE_CHECKING:
    from freeswing.cdpr.robot import Robot
    from freeswing.ident.runs import SwingRun
    from freeswing.session.session_file import Session


def refuse_wrong_runs(session: Session, swings: Sequence[SwingRun], robot: Robot) -> None:
    """Refuse runs that stand twice, and what places, stamps, lengths or pulleys contradict.

    Raises:
        DataError: naming runs or cables, and what to do.
    """
    refuse_repeated(swings)
    refuse_mistaken_recordings(swings, robot)
    refuse_far_platforms(swings, robot)
    refuse_wrong_stamps(measured_swings(session, swings), session.frame_rate_hz)
    refuse_exchanged_lengths(swings, robot)
    refuse_mistaken_cables(swings, robot)
