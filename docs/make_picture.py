"""Draws docs/swing.svg, README's picture, from a diagnosed session: `make_picture.py RESULTS`."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

from freeswing.report.motion import run_figure

COORDINATES = ("x", "chi")


def main(results: Path) -> None:
    """The first held-out run, two of its coordinates."""
    run = json.loads((results / "diagnosis_motion.json").read_text(encoding="utf-8"))["runs"][0]
    kept = [run["coordinates"].index(name) for name in COORDINATES]
    for key in ("measured", "before", "after"):
        run[key] = [[row[k] for k in kept] for row in run[key]]
    run["coordinates"] = list(COORDINATES)
    svg = re.search(r"<svg.*</svg>", str(run_figure(run)), re.DOTALL)
    if svg is None:
        raise SystemExit("the report drew no figure")
    namespaced = svg.group(0).replace("<svg", '<svg style="background:#fff"', 1)
    (Path(__file__).parent / "swing.svg").write_text(namespaced, encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
