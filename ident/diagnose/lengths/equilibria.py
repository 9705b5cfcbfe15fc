"""Where a platform hangs, as a second witness of its geometry beside the constancy of lengths.

Averaged over a swing, the forces on the platform balance along every free direction: losses are odd
in the velocity and cancel, whatever their law. The place about which a platform swings so tells
where its cables pull, and no cable length enters. A constant force or a tilted base would move it
too: they stand beside the geometry, and so does the centre of mass. Other forces that do not cancel
(a spring, a tether) contradict the lengths, and are told by that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.special import chdtrc

from freeswing.cdpr.model.batch import evaluate, only, with_jacobian
from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.robot import Array
from freeswing.cdpr.rotation import angle_rate_matrix, matrix_from_angles
from freeswing.ident.diagnose.lengths.joint_lengths import (
    Blocks,
    Normal,
    honest_covariance,
    renewed,
    solved,
    total,
)
from freeswing.ident.diagnose.lengths.length_rows import (
    RATES_OVER_S,
    frame_root,
    measured_rates,
    usual_drift,
)
from freeswing.ident.diagnose.lengths.local_polynomials import local_derivatives
from freeswing.ident.diagnose.lengths.place_probabilities import Chances, mixed
from freeswing.ident.likelihood.run_residuals import Samples

# Instants of a run at which slopes are taken, and parts of it whose means tell the noise of all.
SLOPES_AT = 40
PARTS = 5
# What stands beside the geometry: the centre of mass is anywhere, a constant specific force is as
# large as a base that is off by two hundredths of a radian makes it.
COM_M = 0.05
FORCE_M_S2 = 0.2
BESIDE = 6  # three coordinates each
# Less probable than this by chance: two witnesses that contradict each other, or equilibria that no
# geometry explains. A torsion spring that moved a point by 4 mm left 0.08, a tether nothing.
CONTRADICTED = 0.1


@dataclass(frozen=True, slots=True)
class Witness:
    """What equilibria say of a place that lengths have found.

    Attributes:
        values: of its parameters by equilibria alone, (k,).
        std: of these, (k,).
        explained: how often chance leaves more of the equilibria than this geometry does.
        agreement: how often chance puts the two further apart.
    """

    values: Array
    std: Array
    explained: float
    agreement: float

    @property
    def agrees(self) -> bool:
        """Whether equilibria and lengths may be taken together."""
        return min(self.explained, self.agreement) > CONTRADICTED

    def document(self) -> dict[str, Any]:
        """Of `lengths` in results/diagnosis.json."""
        told = {"values": self.values.tolist(), "std": self.std.tolist()}
        return {**told, "agrees": self.agrees, "agreement": self.agreement}

    def __str__(self) -> str:
        """For a reader."""
        said = ", ".join(
            f"{1e3 * v:.1f} +- {1e3 * s:.1f}" for v, s in zip(self.values, self.std, strict=True)
        )
        place = f"the poses about which the platform swings, without any length, say {said}"
        if self.agrees:
            return f"{place} (mm or mrad): both together are told"
        return f"{place} (mm or mrad), which contradicts the lengths: a force that does not cancel"


@dataclass(frozen=True, slots=True)
class Equilibrium:
    """A run's mean balance of forces: frame u + shared v + right = noise of unit deviation.

    Attributes:
        frame: by the run's frame in standard deviations, (k, 6).
        shared: by the geometry, then the centre of mass and a constant specific force,
            (k, p + `BESIDE`).
        right: with all of them at zero, (k,).
    """

    frame: Array
    shared: Array
    right: Array


def equilibrium(model: Model, inertia: Array, samples: Samples, values: Array) -> Equilibrium:
    """A run's balance along its free directions, linearised at values of the geometry.

    Args:
        model: with all effects that displace or measure.
        inertia: of the platform, (9,).
        samples: poses of a run, with what they say of its frame.
        values: at which to linearise, (k,); those of measurement effects at zero.

    Source:
        Ida, Briot, Carricato 2022, eq. 50: the internal dynamics, here averaged over a swing.
    """
    times, zetas = samples.times_s, samples.values
    rates, accelerations = measured_rates(times, zetas), _accelerations(times, zetas)
    modelled = evaluate(only(model.acceleration, 0), times, zetas, rates, inertia, values)[0]
    missing = (_free_map(model, inertia, zetas, values) @ (accelerations - modelled)[..., None])[
        ..., 0
    ]
    few = np.unique(np.linspace(0, len(times) - 1, SLOPES_AT).astype(np.int64))
    states = times[few], zetas[few], rates[few], inertia, values
    slopes = evaluate(with_jacobian(model.acceleration, (1, 3, 4)), *states)[1]
    free = _free_map(model, inertia, zetas[few], values, zetas.mean(axis=0))
    slopes = -(free @ slopes)
    by_pose, by_com, by_values = slopes[..., :6], slopes[..., 6:9], slopes[..., 15:]
    shown = evaluate(with_jacobian(model.measured, (4,)), *states)[1]
    turn = np.linalg.inv(angle_rate_matrix(zetas[few, 3:]))
    rotations = matrix_from_angles(zetas[few, 3:])
    in_platform = np.concatenate(
        [by_pose[..., :3] @ rotations, by_pose[..., 3:] @ turn @ rotations], axis=2
    ).mean(axis=0)
    force = -_free_map(model, inertia, zetas[few], values, zetas.mean(axis=0), by_force=True)
    shared = np.concatenate([by_values - by_pose @ shown, by_com, force], axis=2).mean(axis=0)
    right = missing.mean(axis=0) - by_values.mean(axis=0) @ values
    noise = in_platform @ usual_drift() @ in_platform.T / PARTS + _of_mean(missing)
    whitener = np.linalg.inv(np.linalg.cholesky(noise))
    frame = in_platform @ frame_root(model.robot, samples)
    return Equilibrium(whitener @ frame, whitener @ shared, whitener @ right)


@dataclass(frozen=True, slots=True)
class Heard:
    """Lengths with what equilibria add, where they agree.

    Attributes:
        normal: equations to go on with.
        blocks: of their unknowns.
        witness: what equilibria say by themselves.
    """

    normal: Normal
    blocks: Blocks
    witness: Witness


def heard(
    normal: Normal,
    blocks: Blocks,
    chances: Chances,
    group: Sequence[str],
    found: Sequence[Equilibrium],
) -> Heard:
    """Confront what lengths say of a place with the equilibria.

    Which place is off lengths alone decide, whatever forces act; equilibria say by how much.

    Args:
        normal: of the lengths.
        blocks: of their unknowns.
        chances: of each set of blocks to be off, by lengths.
        group: keys of the place.
        found: balance of each run.
    """
    where = np.concatenate([blocks.columns[key] for key in group])
    by_lengths = mixed(normal, blocks, chances, group)
    alone, wider = with_equilibria(normal, blocks, found, lengths_too=False)
    spread = wider.spread(group)
    summed = total(alone)
    own = solved(summed, spread)
    covariance = honest_covariance(alone, spread, own)[np.ix_(where, where)]
    left = summed[2] + float(summed[1] @ own.values)
    apart = own.values[where] - by_lengths.values[where]
    both = covariance + by_lengths.covariance[np.ix_(where, where)]
    witness = Witness(
        own.values[where],
        np.sqrt(np.diag(covariance)),
        float(chdtrc(sum(len(one.right) for one in found), left)),
        float(chdtrc(len(where), apart @ np.linalg.solve(both, apart))),
    )
    if not witness.agrees:
        return Heard(normal, blocks, witness)
    return Heard(*with_equilibria(normal, blocks, found), witness)


def with_equilibria(
    normal: Normal, blocks: Blocks, found: Sequence[Equilibrium], lengths_too: bool = True
) -> tuple[Normal, Blocks]:
    """The normal equations of lengths with those of equilibria, over the geometry and `BESIDE`.

    A run's frame is the same in both.

    Args:
        normal: of the lengths.
        blocks: of its unknowns.
        found: of each run.
        lengths_too: False for what equilibria say by themselves.
    """
    rows = []
    for one, balance in zip(normal.rows, found, strict=True):
        b, n, p = one.shared.shape
        patterns = p - (balance.shared.shape[1] - BESIDE)
        geometry, beside = np.split(balance.shared, [p - patterns], axis=1)
        own = np.hstack([np.zeros((len(beside), n)), balance.frame])
        shared = np.hstack([geometry, np.zeros((len(beside), patterns)), beside])
        together = np.column_stack([own, shared, balance.right])
        wider = np.concatenate([one.shared, np.zeros((b, n, BESIDE))], axis=2)
        weight = float(lengths_too)
        rows.append(replace(one, shared=wider, beside=together, weight=weight))
    size = sizes_beside()
    wider_blocks = replace(
        blocks,
        tolerance=np.append(blocks.tolerance, size),
        gross=np.append(blocks.gross, size),
    )
    return renewed(tuple(rows), normal.sizes), wider_blocks


def _free_map(
    model: Model,
    inertia: Array,
    zetas: Array,
    values: Array,
    about: Array | None = None,
    by_force: bool = False,
) -> Array:
    """What accelerations (n, 6) lack along the free directions, as forces over mass, (n, 6 - c, 6).

    The directions follow the pose from an orthonormal set at the mean one.

    Args:
        model: of the geometry.
        inertia: of the platform, (9,).
        zetas: poses, (n, 6).
        values: of the geometry, (k,).
        about: the mean pose; None for that of the poses.
        by_force: by a constant specific force on the centre of mass instead, (n, 6 - c, 3).
    """
    middle = zetas.mean(axis=0) if about is None else about
    lengths = with_jacobian(model.lengths, (0,))
    _, __, right = np.linalg.svd(evaluate(lengths, middle, values)[1])
    slopes = evaluate(lengths, zetas, values)[1]
    first = right[slopes.shape[1] :].T
    free = first - np.linalg.pinv(slopes) @ (slopes @ first)
    if not by_force:
        mass = evaluate(model.mass_matrix, zetas, inertia, values)[0]
        return np.swapaxes(free, 1, 2) @ mass
    turn = angle_rate_matrix(zetas[:, 3:])
    arm = matrix_from_angles(zetas[:, 3:]) @ inertia[:3]
    twist = turn @ free[:, 3:]
    moved = free[:, :3] + np.cross(np.swapaxes(twist, 1, 2), arm[:, None]).swapaxes(1, 2)
    return np.swapaxes(moved, 1, 2)


def _of_mean(missing: Array) -> Array:
    """Covariance of the mean (k, k) of a series (n, k), from means of its parts."""
    means = np.array([part.mean(axis=0) for part in np.array_split(missing, PARTS)])
    return np.atleast_2d(np.cov(means.T)) / PARTS


def _accelerations(times_s: Array, values: Array) -> Array:
    """Second time derivatives of samples (n, c), by windows twice as long as the rates'."""
    return local_derivatives(times_s, values, 2.0 * RATES_OVER_S, 4, 2)


def sizes_beside() -> Array:
    """What the centre of mass and a constant specific force may be, each coordinate, (6,)."""
    return np.repeat([COM_M, FORCE_M_S2], 3)
