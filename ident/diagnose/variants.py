"""Candidates of a search: an effect, or one cable's part of an effect ("attachment_offset:2").

What one cable alone has wrong needs a fraction of the unknowns; an effect that is given all cables
spends the others on whatever else the model lacks.
"""

from __future__ import annotations

import numpy as np

from freeswing.cdpr.effects import effect_named
from freeswing.cdpr.robot import Robot


def effect_of(key: str) -> str:
    """The effect's name."""
    return key.partition(":")[0]


def variants(robot: Robot, name: str) -> list[str]:
    """The keys of an effect: the whole of it, then each cable's part where it has several."""
    parts = dict.fromkeys(p.part for p in effect_named(name).parameters(robot) if p.part)
    return [name, *(f"{name}:{part}" for part in parts)] if len(parts) > 1 else [name]


def inside(robot: Robot, key: str) -> np.ndarray:
    """Which of its effect's parameters a key estimates, (k,) booleans."""
    name, _, part = key.partition(":")
    return np.array([part in ("", p.part) for p in effect_named(name).parameters(robot)])
