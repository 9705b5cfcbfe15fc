"""What forces that a model lacks do to an inertia: as much as they leave in the residuals.

A base that is not level, a drag or a twisted cable moves what all runs say alike: no scatter
between runs tells. Residuals are far from white then, and to first order they say which forces
would be needed, and how large. What forces of that size do to the inertia belongs to its
deviations. Which one it is `diagnose` finds by fits in earnest; here none is named as the cause.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from freeswing.cdpr.effects import effect_named
from freeswing.cdpr.robot import Array
from freeswing.ident.estimate import Estimate
from freeswing.ident.judge.wider_estimate import wider

# Power over white noise's that errors of measurement may leave where platforms swing; what is more
# is of the model. Clean films, markers and lab days leave 0.8 to 1.1, a bob on a string 5 and 6:
# with all of that for noise an inertia was told 3.5 deviations off, with twice white noise 1.9.
FAR_FROM_WHITE = 2.0


@dataclass(frozen=True, slots=True)
class MissingForces:
    """Forces, and errors of what is measured, as large as residuals ask for.

    Attributes:
        sizes: of those that they ask for, in their typical size.
        moved: what each cause of its typical size does to the inertia, (9, q) by name.
        left: power of what none follows, over that of white noise, at most `FAR_FROM_WHITE`.
    """

    sizes: dict[str, float] = field(default_factory=dict)
    moved: dict[str, Array] = field(default_factory=dict)
    left: float = 1.0

    def changes(self, sizes: Mapping[str, float]) -> Array:
        """What causes of some sizes do to the inertia, each number by itself, (q, 9)."""
        known = [sizes[name] * moved.T for name, moved in self.moved.items() if name in sizes]
        return np.vstack([np.zeros((0, 9)), *known])


def together(several: list[MissingForces]) -> dict[str, float]:
    """What several fits of one session ask for, each cause as large as any of them needs it.

    Free coordinates show less than poses do, of the same forces.
    """
    sizes: dict[str, float] = {}
    for one in several:
        for name, size in one.sizes.items():
            sizes[name] = max(size, sizes.get(name, 0.0))
    return sizes


def with_missing_forces(
    entry: Estimate, missing: MissingForces, sizes: Mapping[str, float]
) -> Estimate:
    """The estimate with deviations that hold what missing forces of some sizes do."""
    changes = missing.changes(sizes)
    if not len(changes):
        return entry
    return wider(entry, changes.T @ changes, "forces_std", lambda growth: _sentence(sizes, growth))


def unreliable(missing: MissingForces) -> str:
    """That nothing of what may be missing follows the residuals, a sentence; empty where it does.

    Args:
        missing: what they ask for.
    """
    if missing.left < FAR_FROM_WHITE:
        return ""
    return (
        "do not rely on these values before freeswing diagnose has found what is missing: to first "
        "order no force or geometry that it knows follows the residuals to within "
        f"{FAR_FROM_WHITE:g} times the power of white noise; deviations are as if they did"
    )


def _sentence(sizes: Mapping[str, float], growth: float) -> str:
    told = ", ".join(f"{name} ({effect_named(name).summary})" for name in sizes)
    return (
        f"the residuals are as if there were {told}: standard deviations hold what that would do "
        f"to the inertia, and are up to {growth:.1f} times as large for it; freeswing diagnose "
        "asks what it is"
    )
