"""An identified robot as far as robustness needs it: numbers, covariance, what stays unknown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from freeswing.cdpr.driven.model import DrivenModel
from freeswing.servo.synthesis.state_space import Array

# Eigenvalues of a correlation matrix written with 16 digits are negative by rounding alone.
NEGATIVE = -1e-8


class Estimated(Protocol):
    """One number: its value and deviation (None: not determined), and names held equal to it."""

    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def value(self) -> float | None: ...  # noqa: D102
    @property
    def std(self) -> float | None: ...  # noqa: D102
    @property
    def tied(self) -> tuple[str, ...]: ...  # noqa: D102


@dataclass(frozen=True, slots=True)
class Identified:
    """The joint estimate of a driven robot.

    Attributes:
        members: names of the model's numbers that each unknown moves, (k,).
        values: (k,).
        covariance: (k, k).
        unknown: names that the data did not determine.
    """

    members: tuple[tuple[str, ...], ...]
    values: Array
    covariance: Array
    unknown: tuple[str, ...]


def identified(numbers: Sequence[Estimated], correlation: Array, model: DrivenModel) -> Identified:
    """The estimate, checked against the robot that is to be controlled.

    Args:
        numbers: of the joint estimate, (n,).
        correlation: of them, (n, n).
        model: the robot.

    Raises:
        ValueError: of another robot, nothing determined, or no covariance.

    Source:
        Bishop 2006, Pattern Recognition and Machine Learning, sec. 2.3: a Gaussian's covariance.
    """
    strange = [one.name for one in numbers if one.name not in model.names]
    if strange:
        raise ValueError(f"{', '.join(strange)}: no numbers of robot {model.robot.name}")
    known = [k for k, one in enumerate(numbers) if one.value is not None]
    if not known:
        raise ValueError("nothing is determined")
    std = np.array([numbers[k].std for k in known], dtype=np.float64)
    if correlation.shape != (len(numbers), len(numbers)):
        raise ValueError(f"correlation of shape {correlation.shape} for {len(numbers)} numbers")
    own = correlation[np.ix_(known, known)]
    least = float(np.linalg.eigvalsh(own)[0]) if np.isfinite(own).all() else -np.inf
    if not np.isfinite(std).all() or (std < 0.0).any() or least < NEGATIVE:
        raise ValueError("std and correlation make no covariance")
    return Identified(
        tuple((numbers[k].name, *numbers[k].tied) for k in known),
        np.array([numbers[k].value for k in known], dtype=np.float64),
        own * np.outer(std, std),
        tuple(one.name for one in numbers if one.value is None),
    )
