"""Whether a camera reads its rows one after the other: a rolling shutter that stands out."""

from __future__ import annotations

LINE_TIME_SIGMAS = 5.0  # one global shutter in two million seems to roll by chance
LEAST_READOUT_S = 5e-4  # at 1 m/s the platform moves by half a millimetre while rows are read


def reads_in_lines(line_time_s: float, std_s: float, rows: int) -> bool:
    """Whether a line time stands out, and from the first row to the last makes a difference."""
    stands_out = abs(line_time_s) > LINE_TIME_SIGMAS * std_s
    return stands_out and rows * abs(line_time_s) > LEAST_READOUT_S
