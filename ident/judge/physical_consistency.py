"""Whether a body can have an inertia, and the nearest one that a body can have.

The 4 x 4 pseudo-inertia of a body, [[E[p p^T], E[p]], [E[p]^T, 1]] over its mass, is positive
definite (Wensing, Kim, Slotine 2018, eq. 12); equivalently the second moments of mass about the
centre of mass are. It is linear in the nine parameters, so the possible inertias are a convex set,
and the nearest one in any metric is a convex problem: solved here by a logarithmic barrier.
Triangular factors of the pseudo-inertia (Rucker, Wensing 2022) would need no constraint, but their
best fit runs off to infinity where the free optimum lies outside, which is the case in question.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from freeswing.cdpr.robot import INERTIA_NAMES, Array

LEAST_EXTENT_M = 1e-3  # root mean square, from a plane: a sheet of 3.5 mm; platforms are thicker
_BARRIERS = 10.0 ** np.arange(1, -9, -1)
_NEWTON_STEPS = 60
_SIGNIFICANT = 3.0  # standard deviations


@dataclass(frozen=True, slots=True)
class Consistency:
    """Whether a body can have an estimated inertia.

    Attributes:
        least_moment_m2: least second moment of mass about the centre of mass, over the mass;
            negative for no body.
        std_m2: its standard deviation to first order.
        cost: rise of -2 log likelihood (or of the weighted distance, for FIDIM) by holding the
            inertia to what a body can have; None where it was not held.
    """

    least_moment_m2: float
    std_m2: float
    cost: float | None = None

    @property
    def is_possible(self) -> bool:
        """Whether the pseudo-inertia is positive definite."""
        return self.least_moment_m2 > 0.0

    @property
    def is_refuted(self) -> bool:
        """Whether no body has the inertia that the samples ask for, beyond its uncertainty."""
        if self.cost is not None:
            return self.cost > _SIGNIFICANT**2
        return self.least_moment_m2 < -_SIGNIFICANT * self.std_m2

    def size(self) -> str:
        """How far inside or outside the possible it is."""
        return f"least second moment of mass {self.least_moment_m2:.2g} +- {self.std_m2:.2g} m2"

    def sentence(self) -> str:
        """For people; empty where a body can have the inertia as it was found.

        What samples do not tell may have any value: two or three wires leave most of a tensor open.
        """
        if self.cost is not None:
            return (
                "held to the inertia of a possible body, which raises the weighted squared error "
                f"by {self.cost:.3g}; standard deviations are those of the free estimate, which "
                "the nearest possible inertia is never farther from the truth than"
            )
        if self.is_possible:
            return ""
        if not self.is_refuted:
            return (
                f"no body can have this inertia to the last digit ({self.size()}), but one within "
                "its deviations can: what is told to less than itself is told by chance, all else "
                "stands (--consistent holds it to possible bodies)"
            )
        return (
            f"no body can have this inertia ({self.size()}): hold it to possible bodies "
            "(--consistent), or look for what the model misses (diagnose)"
        )

    def document(self) -> dict[str, Any]:
        """The entry `consistency` of an estimate in results/identification.json."""
        return {
            "possible": self.is_possible,
            "held": self.cost is not None,
            "least_second_moment_m2": self.least_moment_m2,
            "least_second_moment_std_m2": self.std_m2 if np.isfinite(self.std_m2) else None,
            **({} if self.cost is None else {"cost": self.cost}),
        }


def pseudo_inertia(inertia: Array) -> Array:
    """Specific pseudo-inertia about P of `INERTIA_NAMES` values (9,), (4, 4).

    Source:
        Wensing, Kim, Slotine 2018, Linear matrix inequalities for rigid-body inertia, eq. (12).
    """
    com, (xx, yy, zz, xy, xz, yz) = inertia[:3], inertia[3:]
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    found = np.ones((4, 4))
    found[:3, :3] = 0.5 * np.trace(tensor) * np.eye(3) - tensor
    found[:3, 3] = found[3, :3] = com
    return found


def least_moment(inertia: Array) -> tuple[float, Array]:
    """Least second moment of mass about the centre of mass, m2, and its slope by inertia, (9,).

    Source:
        Wensing, Kim, Slotine 2018, Linear Matrix Inequalities for Physically-Consistent
        Inertial Parameter Identification: the pseudo-inertia.
    """
    whole = pseudo_inertia(inertia)
    com = whole[:3, 3]
    sizes, axes = np.linalg.eigh(whole[:3, :3] - np.outer(com, com))
    # u^T J u with u = [v; -v . com] is v^T (E[p p^T] - com com^T) v, and stationary in u's last.
    direction = np.append(axes[:, 0], -axes[:, 0] @ com)
    slope = np.einsum("a,iab,b->i", direction, _SLOPES, direction)
    return float(sizes[0]), slope


def is_possible(inertia: Array) -> bool:
    """Whether a body can have this specific inertia: its pseudo-inertia is positive definite.

    Args:
        inertia: `INERTIA_NAMES` values, (9,).
    """
    return least_moment(inertia)[0] > 0.0


def consistency(inertia: Array, covariance: Array, cost: float | None = None) -> Consistency:
    """How an estimate (9,) with its covariance (9, 9) stands to possible bodies."""
    least, slope = least_moment(inertia)
    return Consistency(least, float(np.sqrt(slope @ covariance @ slope)), cost)


def nearest_possible(target: Array, covariance: Array) -> Array:
    """The inertia of a body at least 1 mm thick that is nearest in the metric of a covariance.

    Being the projection onto a convex set that holds the truth, it is never farther from the truth
    in that metric than the target is.

    Args:
        target: `INERTIA_NAMES` values, (9,).
        covariance: positive definite, (9, 9).

    Raises:
        ValueError: when the covariance is not positive definite.

    Source:
        Boyd, Vandenberghe 2004, Convex Optimization, sec. 11.3: the barrier method, on the
        pseudo-inertia of Wensing, Kim, Slotine 2018.
    """
    if _thickness(target) >= 0.0:
        return np.array(target, dtype=np.float64)
    try:
        root = np.linalg.cholesky(covariance)
    except np.linalg.LinAlgError as error:
        raise ValueError("the covariance of the inertia is not positive definite") from error
    slopes = np.einsum("iab,ij->jab", _SLOPES, root)
    place = np.linalg.solve(root, _inside(target) - target)
    for barrier in _BARRIERS:
        place = _centred(place, barrier, _gap(target), slopes)
    return target + root @ place


def _centred(place: Array, barrier: float, gap: Array, slopes: Array) -> Array:
    """Minimum of |place|^2 / 2 - barrier log det(gap + place . slopes), by damped Newton steps."""

    def value(at: Array) -> float:
        sign, log = np.linalg.slogdet(gap + np.einsum("i,iab->ab", at, slopes))
        inside = sign > 0 and np.linalg.eigvalsh(gap + np.einsum("i,iab->ab", at, slopes))[0] > 0
        return 0.5 * float(at @ at) - barrier * float(log) if inside else np.inf

    for _ in range(_NEWTON_STEPS):
        inverse = np.linalg.inv(gap + np.einsum("i,iab->ab", place, slopes))
        pulled = inverse @ slopes
        slope = place - barrier * np.trace(pulled, axis1=1, axis2=2)
        curve = np.eye(len(place)) + barrier * np.einsum("iab,jba->ij", pulled, pulled)
        step = -np.linalg.solve(curve, slope)
        decrement = -float(slope @ step)
        if decrement < 1e-9 * barrier:
            break
        share, now = 1.0, value(place)
        while share > 1e-12 and value(place + share * step) > now - 0.1 * share * decrement:
            share *= 0.5
        place = place + share * step
    return place


def _gap(inertia: Array) -> Array:
    """Pseudo-inertia less that of the thinnest body allowed: positive definite inside, (4, 4)."""
    return pseudo_inertia(inertia) - LEAST_EXTENT_M**2 * np.diag([1.0, 1.0, 1.0, 0.0])


def _thickness(inertia: Array) -> float:
    return least_moment(inertia)[0] - LEAST_EXTENT_M**2


def _inside(inertia: Array) -> Array:
    """An inertia well inside the possible ones, about the same centre of mass, (9,)."""
    com = inertia[:3]
    size = max(float(np.abs(inertia[3:6]).max()) / 3.0, (10.0 * LEAST_EXTENT_M) ** 2)
    tensor = 2.0 * size * np.eye(3) + com @ com * np.eye(3) - np.outer(com, com)
    return np.concatenate([com, tensor[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]])


_SLOPES = np.array([pseudo_inertia(row) for row in np.eye(len(INERTIA_NAMES))]) - pseudo_inertia(
    np.zeros(len(INERTIA_NAMES))
)
