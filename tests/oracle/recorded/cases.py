"""The list of sealed benchmark sessions: none, one or two effects, and effects of no catalogue."""

from __future__ import annotations

import zlib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from tests.oracle.recorded.lab_days import EFFECTS as OF_LAB_DAYS
from tests.oracle.recorded.lab_days import make_lab_day
from tests.oracle.recorded.sessions import SessionTruth, make_session
from tests.oracle.scenes.effects import EFFECTS, SIZES
from tests.oracle.scenes.outside import OUTSIDE

TIERS = ("quick", "standard", "full", "lab")
LAB_DAYS = 8
ROBOTS = ("bologna-4", "three-cable")
POSE_ONLY = ("clock_offset",)
PAIRS = (
    ("translational_drag", "attachment_offset"),
    ("swivel_friction", "gravity_tilt"),
    ("cable_length_bias", "rotational_drag"),
    ("tether", "swivel_viscous"),
    ("harmonic_force", "anchor_offset"),
    ("winch_creep", "translational_drag"),
    ("cable_elasticity", "rotational_drag"),
    ("torsion_spring", "pulley_friction"),
    ("marker_offset", "quadratic_drag"),
    ("pulley_radius", "swivel_friction"),
    ("gravity_tilt", "harmonic_force"),
    ("anchor_offset", "cable_length_bias"),
)


@dataclass(frozen=True, slots=True)
class Case:
    """One session of the benchmark.

    Attributes:
        name: folder name, unique in the list.
        kind: "clean", "single", "pair", "outside"; "lab" and "quiet lab" at the level of markers.
        robot: "bologna-4" or "three-cable".
        pose: full poses, or the free coordinates alone.
        effects: (name, size) of each.
        draw: which of the sessions of this name; the first is 0.
        seed: of the session, from name and draw alone.
    """

    name: str
    kind: str
    robot: str
    pose: bool
    effects: tuple[tuple[str, object], ...]
    draw: int = 0

    @property
    def seed(self) -> int:
        """A number that only name and draw decide, so that lists can grow."""
        told = f"{self.name}#{self.draw}" if self.draw else self.name
        return zlib.crc32(told.encode())

    def make(self, root: Path | str, **options: Any) -> SessionTruth:
        """The session in `root/name`; options go to `make_session`."""
        folder = Path(root) / self.name
        if self.kind.endswith("lab"):
            return make_lab_day(folder, self.seed, self.robot, dict(self.effects), **options)
        settings: dict[str, Any] = {"pose": self.pose, **options}
        return make_session(folder, self.seed, self.robot, dict(self.effects), **settings)


def manifest(tier: str = "standard", draw: int = 0) -> tuple[Case, ...]:
    """The cases of a tier; each tier holds the one before it, each draw has seeds of its own.

    quick: 8 clean, every effect once, 4 pairs, 4 outside (37 cases). standard: 40 clean, every
    effect at three sizes with robot and measurement taking turns, 12 pairs, every outside effect
    twice (133). full: everything on both robots and with both measurements. lab, by itself: marker
    recordings with five effects at once, every fourth with none (8).

    Raises:
        ValueError: another tier.
    """
    if tier not in TIERS:
        raise ValueError(f"tier {tier!r} must be one of {TIERS}")
    if tier == "lab":
        cases = [_lab_day(k) for k in range(LAB_DAYS)]
    else:
        cases = [*_clean(tier), *_single(tier), *_pairs(tier), *_outside(tier)]
    return tuple({case.name: replace(case, draw=draw) for case in cases}.values())


def _case(kind: str, robot: str, pose: bool, effects: tuple[tuple[str, str], ...], tag: str = ""):
    names = "+".join(f"{name}.{size}" for name, size in effects) or tag
    kind_of_data = "pose" if pose else "free"
    return Case(f"{kind}-{names}-{robot}-{kind_of_data}", kind, robot, pose, effects)


def _turns(count: int) -> tuple[str, bool]:
    """Robot and measurement, taking turns."""
    return ROBOTS[count % 2], count % 4 < 2


def _lab_day(k: int) -> Case:
    robot, quiet = ROBOTS[k % 2], k % 4 == 3
    kind = "quiet lab" if quiet else "lab"
    effects = () if quiet else tuple((name, size) for name, size in OF_LAB_DAYS.items())
    return Case(f"{kind.replace(' ', '-')}-{k:02d}-{robot}", kind, robot, True, effects)


def _clean(tier: str) -> list[Case]:
    count = 8 if tier == "quick" else 40
    return [_case("clean", *_turns(k), (), f"{k:02d}") for k in range(count)]


def _single(tier: str) -> list[Case]:
    cases = []
    for k, name in enumerate(EFFECTS):
        for j, size in enumerate(SIZES):
            robot, pose = _turns(k + j)
            pose = pose or name in POSE_ONLY
            if tier != "quick" or size == "medium":
                cases.append(_case("single", robot, pose, ((name, size),)))
            if tier == "full":
                cases += [
                    _case("single", other, seen, ((name, size),))
                    for other in ROBOTS
                    for seen in (True, False)
                    if seen or name not in POSE_ONLY
                ]
    return cases


def _pairs(tier: str) -> list[Case]:
    cases = []
    for k, (first, second) in enumerate(PAIRS[: 4 if tier == "quick" else None]):
        effects = ((first, "medium"), (second, "medium"))
        cases.append(_case("pair", *_turns(k), effects))
        if tier == "full":
            large = ((first, "large"), (second, "large"))
            cases += [_case("pair", robot, True, large) for robot in ROBOTS]
    return cases


def _outside(tier: str) -> list[Case]:
    cases = []
    for k, name in enumerate(OUTSIDE):
        for j, size in enumerate(SIZES[::-1]):
            if (tier == "quick" and (j > 0 or k >= 4)) or (tier == "standard" and j > 1):
                continue
            cases.append(_case("outside", *_turns(k + j), ((name, size),)))
    return cases
