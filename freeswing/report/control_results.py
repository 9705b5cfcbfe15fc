"""What `design` and `servo` left in a results folder, for the page."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from freeswing.cdpr.files.documents import InputError, load_json, read_text
from freeswing.results.codec import Document
from freeswing.results.control import ControllerResult, Controllers, Robustness, ServoResult

D = TypeVar("D", bound=Document)
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
        controller: `controller.json`, None where it is not there, like the others.
        controllers: `controllers.json`.
        robustness: `robustness.json`.
        servo: `servo.json`.
        pictures: caption and `data:` address, in the order of `PICTURES`.
    """

    controller: ControllerResult | None = None
    controllers: Controllers | None = None
    robustness: Robustness | None = None
    servo: ServoResult | None = None
    pictures: tuple[tuple[str, str], ...] = ()


def read_control(results: Path) -> ControlResults | None:
    """What is there; None where neither a controller nor a run is.

    Raises:
        InputError: for a document that is not what its name says.
    """
    controller, servo = _read(results, ControllerResult), _read(results, ServoResult)
    if controller is None and servo is None:
        return None
    pictures = []
    for name, caption in PICTURES.items():
        if (results / name).is_file():
            # As an image's address the drawing stays one: nothing in it can act on the page.
            drawn = base64.b64encode(read_text(results / name, LARGEST_BYTES).encode()).decode()
            pictures.append((caption, f"data:image/svg+xml;base64,{drawn}"))
    return ControlResults(
        controller,
        _read(results, Controllers),
        _read(results, Robustness),
        servo,
        tuple(pictures),
    )


def _read(results: Path, kind: type[D]) -> D | None:
    path = results / f"{kind.kind}.json"
    if not path.is_file():
        return None
    table = load_json(path, kind.format(), LARGEST_BYTES, "delete it and run again")
    try:
        return kind.from_json(table)
    except ValueError as error:
        raise InputError(f"{path}: {error}; delete it and run again") from error
