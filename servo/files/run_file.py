"""One run of the loop as a table."""

from __future__ import annotations

import numpy as np

from freeswing.servo.loop.closed_loop import Run

POSE = ("x_m", "y_m", "z_m", "roll_rad", "pitch_rad", "yaw_rad")
WRENCH = ("fx_N", "fy_N", "fz_N", "mx_N_m", "my_N_m", "mz_N_m")


def run_csv(run: Run, names: tuple[str, ...]) -> bytes:
    """One row a control sample: time, pose asked for, pose, wrench, references, currents, tensions.

    Args:
        run: what happened.
        names: of the cables.
    """
    header = ["t_s", *(f"asked_{name}" for name in POSE), *POSE, *WRENCH]
    for pattern in ("Iref{}_A", "I{}_A", "T{}_N"):
        header += [pattern.format(name) for name in names]
    header.append("scale")
    columns = np.column_stack(
        [
            run.times_s,
            run.asked,
            run.poses,
            run.wrenches,
            run.references_A,
            run.currents_A,
            run.tensions_N,
            run.scales,
        ]
    )
    rows = "\n".join(",".join(f"{value:.9g}" for value in row) for row in columns)
    return f"{','.join(header)}\n{rows}\n".encode()
