"""One estimate of the inertial parameters, however made, and its place in the result file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.frozen import freeze
from freeswing.cdpr.robot import INERTIA_NAMES, Array
from freeswing.ident.fidim.fidim import FidimEstimate
from freeswing.ident.fidim.payload_mass import MassEstimate
from freeswing.ident.fidim.shares import Share
from freeswing.ident.fidim.weighted_least_squares import WeightedSolution
from freeswing.ident.judge.physical_consistency import Consistency, consistency
from freeswing.ident.runs import DroppedRun


@dataclass(frozen=True, slots=True)
class Estimate:
    """The nine parameters with their uncertainty.

    Attributes:
        values: in the order of `INERTIA_NAMES`, (9,).
        covariance: (9, 9).
        essential: which are well determined or not near zero, (9,).
        samples: how many time samples they rest on.
        sigma_W: standard deviation of the regressor (FIDIM only).
        cost_C: excitation cost (FIDIM only).
        dropped: runs left out.
        notes: sentences that a reader must see beside the numbers.
        mass: from payload runs.
        held_cost: see `Consistency.cost`; None where the inertia was free.
        reduced: essential parameters solved again alone: names, values, standard deviations.
        calibration: amplitudes of the cameras' calibration errors that go with the values
            (`ident.likelihood.calibration_modes`), (r,); empty where none were fitted.
        extra: more numbers for the result file, JSON-ready.
        without_run: the values without each run, by its name (FIDIM only).
    """

    values: Array
    covariance: Array
    essential: NDArray[np.bool_]
    samples: int
    sigma_W: float | None = None
    cost_C: float | None = None
    dropped: tuple[DroppedRun, ...] = ()
    notes: tuple[str, ...] = ()
    mass: MassEstimate | None = None
    held_cost: float | None = None
    reduced: dict[str, Any] | None = None
    calibration: Array = field(default_factory=lambda: np.zeros(0))
    extra: dict[str, Any] = field(default_factory=dict)
    without_run: dict[str, Array] = field(default_factory=dict)

    def __post_init__(self) -> None:
        freeze(self, "values", "covariance", "essential", "calibration")

    @property
    def std(self) -> Array:
        """Standard deviations, (9,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def correlation(self) -> Array | None:
        """Correlations of the nine values, (9, 9); None where a deviation is zero or unknown."""
        std = self.std
        if not (np.isfinite(std) & (std > 0.0)).all():
            return None
        return self.covariance / np.outer(std, std)

    @property
    def consistency(self) -> Consistency:
        """Whether a body can have this inertia."""
        return consistency(self.values, self.covariance, self.held_cost)

    def document(self) -> dict[str, Any]:
        """The entry of `estimates` in results/identification.json."""
        rows = [
            _row(name, value, std, bool(essential))
            for name, value, std, essential in zip(
                INERTIA_NAMES, self.values, self.std, self.essential, strict=True
            )
        ]
        if self.mass is not None:
            rows.append(_row("mass_kg", self.mass.mass_kg, self.mass.std_kg, True))
        numbers = {"sigma_W": self.sigma_W, "cost_C": self.cost_C}
        return {
            "parameters": rows,
            **{key: number for key, number in numbers.items() if number is not None},
            "samples": self.samples,
            "dropped_runs": [{"run": run.run, "why": run.why} for run in self.dropped],
            "notes": list(self.notes),
            "consistency": self.consistency.document(),
            **({} if self.correlation is None else {"correlation": self.correlation.tolist()}),
            **({"reduced": self.reduced} if self.reduced is not None else {}),
            **self.extra,
        }


def fidim_entry(
    found: FidimEstimate,
    dropped: tuple[DroppedRun, ...],
    notes: tuple[str, ...],
    weighted: WeightedSolution | None = None,
    shares: Sequence[Share] = (),
    scatter: Array | None = None,
) -> Estimate:
    """An estimate from FIDIM's result.

    Args:
        found: the published total least squares.
        dropped: runs left out.
        notes: beside those of `found`.
        weighted: the covariance-weighted form, to be taken in its place.
        shares: what errors beside the scatter add to the covariance.
        scatter: covariance by the equations' scatter, (9, 9); None for that of the solution.
    """
    solution = found.solution
    values, covariance = solution.values, solution.covariance
    extra: dict[str, Any] = {}
    if weighted is not None:
        values, covariance = weighted.values, weighted.covariance
        extra["weighting"] = "covariance"
        extra["noise_ratio"] = weighted.noise_ratio
    raised = np.ones(9)
    if scatter is not None:
        raised, covariance = np.sqrt(np.diag(scatter) / np.diag(covariance)), scatter
        extra["scatter_std"] = np.sqrt(np.diag(scatter)).tolist()
    names = [name for name, kept in zip(INERTIA_NAMES, found.essential, strict=True) if kept]
    reduced = found.reduced
    reduced_std = reduced.std * raised[found.essential]
    for share in shares:
        covariance = covariance + share.covariance
        reduced_std = np.sqrt(reduced_std**2 + np.diag(share.reduced))
        extra.update(share.document())
    return Estimate(
        values=values,
        covariance=covariance,
        essential=found.essential,
        samples=found.n_samples,
        sigma_W=solution.sigma_W,
        cost_C=solution.cost_C,
        dropped=dropped,
        notes=found.verdicts + notes,
        reduced={
            "parameters": [
                _row(name, value, std, True)
                for name, value, std in zip(names, reduced.values, reduced_std, strict=True)
            ],
            "sigma_W": reduced.sigma_W,
            "cost_C": reduced.cost_C,
        },
        extra=extra,
    )


def _row(name: str, value: float, std: float, essential: bool) -> dict[str, Any]:
    percent = 100.0 * float(std) / abs(float(value)) if value else None
    return {
        "name": name,
        "value": float(value),
        "std": float(std) if np.isfinite(std) else None,
        "std_percent": percent if percent is not None and np.isfinite(percent) else None,
        "essential": essential,
    }
