"""What `design` and `servo` left in a results folder, for the page."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from freeswing.cdpr.files.documents import load_json, read_text

FORMATS = {
    "controller.json": "freeswing-controller/1",
    "controllers.json": "freeswing-controllers/1",
    "robustness.json": "freeswing-robustness/1",
    "servo.json": "freeswing-servo/1",
}
# The paper's Figs. 12 to 15, with what they show.
PICTURES = {
    "controller-gains.svg": "Gains of the controller (the paper's Fig. 12).",
    "controller-templates.svg": "The closed loop under its templates (Fig. 13).",
    "servo-task.svg": "The task: position, wrench, currents, tensions (Fig. 14).",
    "servo-friction.svg": "One step with and without Coulomb friction (Fig. 15).",
}
LARGEST_BYTES = 64 * 2**20


@dataclass(frozen=True, slots=True)
class ControlResults:
    """The documents by file name, and the pictures as addresses that hold them.

    Attributes:
        documents: those of `FORMATS` that are there.
        pictures: caption and `data:` address, in the order of `PICTURES`.
    """

    documents: Mapping[str, dict[str, Any]] = field(default_factory=dict)
    pictures: tuple[tuple[str, str], ...] = ()


def read_control(results: Path) -> ControlResults | None:
    """What is there; None where neither a controller nor a run is.

    Raises:
        InputError: for a document that is not what its name says.
    """
    documents = {
        name: load_json(results / name, format_, LARGEST_BYTES, "delete it and run again")
        for name, format_ in FORMATS.items()
        if (results / name).is_file()
    }
    if not {"controller.json", "servo.json"} & set(documents):
        return None
    pictures = []
    for name, caption in PICTURES.items():
        if (results / name).is_file():
            # As an image's address the drawing stays one: nothing in it can act on the page.
            drawn = base64.b64encode(read_text(results / name, LARGEST_BYTES).encode()).decode()
            pictures.append((caption, f"data:image/svg+xml;base64,{drawn}"))
    return ControlResults(documents, tuple(pictures))
