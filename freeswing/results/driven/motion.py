"""`drive_motion.json`: some samples of every driven run, and what is left of them by rates."""

from __future__ import annotations

from typing import ClassVar

from freeswing.results.codec import Document, Entry, Numbers, entry

Rows = tuple[Numbers, ...]


@entry
class DrivenRunMotion(Entry):
    """Samples of one run, one row a moment and one column a motor.

    Attributes:
        run: its name.
        role: validate or identify.
        times_s: moments.
        angles_rad: measured.
        residuals_rad: predicted less measured.
        tensions_N: by the estimate.
        slack_share: of all samples, those at which each cable would have had to push.
        spectrum_hz: rates, one or more.
        spectrum_rad2_hz: power of the residuals there, motors together.
    """

    run: str
    role: str
    times_s: Numbers
    angles_rad: Rows
    residuals_rad: Rows
    tensions_N: Rows
    slack_share: Numbers
    spectrum_hz: Numbers
    spectrum_rad2_hz: Numbers


@entry
class DriveMotion(Document):
    """What the page draws of a driven robot's runs.

    Attributes:
        session: its name.
        cables: their names, in the order of all columns.
        tension_limits_N: least and greatest of each.
        angle_noise_rad: what encoder counts leave.
        runs: all of them.
    """

    kind: ClassVar[str] = "drive-motion"

    session: str = ""
    cables: tuple[str, ...]
    tension_limits_N: Rows
    angle_noise_rad: float
    runs: tuple[DrivenRunMotion, ...]

    def uneven(self) -> str:
        """Which run's columns are not as many as its moments or as the cables; empty: none."""
        for one in self.runs:
            moments, shares = len(one.times_s), len(one.slack_share)
            tables = (one.angles_rad, one.residuals_rad, one.tensions_N)
            whole = all(len(rows) == moments for rows in tables)
            wide = {shares, *(len(row) for rows in tables for row in rows)}
            spectra = len(one.spectrum_hz) == len(one.spectrum_rad2_hz)
            if not (moments and whole and spectra and wide == {len(self.cables)}):
                return one.run
        return ""
