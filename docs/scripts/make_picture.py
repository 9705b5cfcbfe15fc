"""Draws README's picture, docs/pictures/swing.svg, of a diagnosed session's RESULTS (argument)."""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from freeswing.report.figures import AFTER, BEFORE, MEASURED, figure_style, plain_log_axes
from freeswing.report.motion import amplitude_spectrum
from freeswing.results.files import read_document
from freeswing.results.motion import Motion

SHOWN = (("x", "mm"), ("chi", "mrad"))


def main(results: Path) -> None:
    """The first held-out run, two of its coordinates: motion, what is left, its spectrum."""
    motion = read_document(results / "diagnosis_motion.json", Motion)
    if motion is None or not motion.runs or motion.runs[0].after is None:
        raise SystemExit(f"{results}: no held-out run with an effect accepted")
    run = motion.runs[0]
    times = np.array(run.times_s, dtype=float)
    measured, before, after = (
        1e3 * np.array(rows, dtype=float) for rows in (run.measured, run.before, run.after)
    )
    lines = ((before, BEFORE, "--", "before"), (after, AFTER, "-", "after"))
    with mpl.rc_context({**figure_style(), "savefig.facecolor": "white", "svg.hashsalt": "swing"}):
        sheet = Figure(figsize=(10.0, 4.2), layout="constrained")
        cells = sheet.subplots(len(SHOWN), 3)
        for row, (name, unit) in zip(cells, SHOWN, strict=True):
            k = run.coordinates.index(name)
            row[0].plot(times, measured[:, k], color=MEASURED, lw=1.6, label="measured")
            for values, colour, dash, label in lines:
                left = measured[:, k] - values[:, k]
                style = {"color": colour, "ls": dash, "lw": 0.9}
                row[0].plot(times, values[:, k], label=label, **style)
                row[1].plot(times, left, **style)
                row[2].loglog(*amplitude_spectrum(times, left), **style)
            plain_log_axes(row[2])
            row[0].set_ylabel(f"{name} ({unit})")
            row[1].set_ylabel(f"left over ({unit})")
            row[2].set_ylabel(f"its amplitude ({unit})")
        for axes, label in zip(cells[-1], ("time (s)", "time (s)", "frequency (Hz)"), strict=True):
            axes.set_xlabel(label)
        cells[0, 0].legend(fontsize=7, ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.0))
        sheet.savefig(Path(__file__).parents[1] / "pictures" / "swing.svg", metadata={"Date": None})


if __name__ == "__main__":
    main(Path(sys.argv[1]))
