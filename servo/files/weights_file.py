"""Read weights.toml."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from freeswing.cdpr.files.documents import load_toml
from freeswing.cdpr.files.problems import Problems
from freeswing.cdpr.files.table_reader import Reader
from freeswing.servo.synthesis.weights import Filter, Part, Weights

# The filters of (24) as corrected: what the command designs with when nothing else is said.
USUAL = Weights(
    Part(Filter(0.5), Filter(40.0, 1e-2, 1e4, 2), Filter(10.0, 10.0, 1e-4, 1)),
    Part(Filter(0.5), Filter(100.0, 1e-2, 1e4, 2), Filter(1.0, 10.0, 1e-4, 1)),
)
PLACEHOLDER = Filter(1.0)


@dataclass(frozen=True, slots=True)
class Camera:
    """When poses come: one every `period_s`, each true `latency_s` earlier."""

    period_s: float
    latency_s: float

    @property
    def delay_s(self) -> float:
        """The mean age of the pose that a controller holds."""
        return self.latency_s + self.period_s / 2


@dataclass(frozen=True, slots=True)
class Goals:
    """What weights.toml says: the weights, and the camera where its delay is designed in."""

    weights: Weights
    camera: Camera | None


def read_weights(path: Path | str) -> Goals:
    """Read and check a weights file.

    Raises:
        InputError: unreadable, or naming every key that is wrong.
    """
    problems = Problems()
    reader = Reader(load_toml(path, "weights", problems), problems)
    halves = []
    for key in ("position", "orientation"):
        part = reader.child(key)
        halves.append(_part(part) if part is not None else Part(*[PLACEHOLDER] * 3))
    table = reader.child("camera", required=False)
    camera = None if table is None else _camera(table)
    reader.finish()
    problems.raise_if_any(path)
    return Goals(Weights(*halves), camera)


def _part(reader: Reader) -> Part:
    filters = [_filter(reader, key) for key in ("w1", "w2", "w3")]
    reader.finish()
    return Part(*filters)


def _filter(reader: Reader, key: str) -> Filter:
    value = reader.raw(key)
    if value is None:
        return PLACEHOLDER
    if isinstance(value, list):
        reader.add(
            key,
            f"a list of {len(value)}: one filter serves all three axes of its half; "
            "write one number or one table",
        )
        return PLACEHOLDER
    if not isinstance(value, dict):
        gain = reader.number(key, above=0.0)
        return Filter(gain) if gain > 0.0 else PLACEHOLDER
    table = reader.child(key)
    if table is None:
        return PLACEHOLDER
    return _dynamic(table)


def _dynamic(table: Reader) -> Filter:
    gain = table.number("gain", above=0.0)
    order = table.integer("order", minimum=0, maximum=4) if "order" in table else 1
    zero, pole = 0.0, 0.0
    if "pole_rad_s" in table:
        pole = table.number("pole_rad_s")
        if pole == 0.0:
            table.add(
                "pole_rad_s",
                "0 is on the imaginary axis, where no finite gamma exists; write 1e-4 (an "
                "integrator for every purpose of this design)",
            )
        elif pole < 0.0:
            table.add("pole_rad_s", f"{pole:g} would make the weight unstable; must be > 0")
    elif order:
        table.add(
            "pole_rad_s",
            "missing: without it the filter grows without end (improper); give it a pole",
        )
    if "zero_rad_s" in table:
        zero = table.number("zero_rad_s", minimum=0.0)
    elif order:
        table.add("zero_rad_s", "missing")
    table.finish()
    usable = gain > 0.0 and (order == 0 or (pole > 0.0 and zero >= 0.0)) and 0 <= order <= 4
    return Filter(gain, zero, pole, order) if usable else PLACEHOLDER


def _camera(table: Reader) -> Camera:
    # A second between poses or of age leaves nothing to control.
    camera = Camera(
        table.number("period_s", above=0.0, maximum=1.0),
        table.number("latency_s", minimum=0.0, maximum=1.0),
    )
    table.finish()
    return camera
