"""Total least squares of the homogeneous system W chi = 0 with chi_1 = 1 (FIDIM 2022, sec. 3.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from freeswing.cdpr.robot import Array, frozen_array

LEAST_GAP = 2.0  # with less, noise decides which of two directions is the solution
SMALLEST_RATIO = 1e-9  # of the largest: rounding alone leaves some 1e-15


@dataclass(frozen=True, slots=True)
class TotalLeastSquares:
    """Solution of W chi = 0.

    Attributes:
        values: chi without its leading 1, (p,).
        covariance: of `values` (eq. 32), (p, p).
        sigma_W: standard deviation of the regressor's entries (eq. 31).
        cost_C: (s_1 + 1) / s_p (eq. 40) of the regressor made compatible.
        singular_values: s_1 .. s_{p+1} of W, (p + 1,).
        blind: the direction of chi's p entries that W hardly sees: of s_p, unit length, (p,).
        n_equations: rows of W.
    """

    values: Array
    covariance: Array
    sigma_W: float
    cost_C: float
    singular_values: Array
    blind: Array
    n_equations: int

    @property
    def std(self) -> Array:
        """Standard deviations (eq. 33), (p,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def std_percent(self) -> Array:
        """Relative to the magnitude of the values (eq. 34), (p,)."""
        with np.errstate(divide="ignore"):
            return 100.0 * self.std / np.abs(self.values)

    @property
    def gap(self) -> float:
        """s_p / s_{p+1}: how far the solution stands out from the next direction."""
        last = self.singular_values[-1]
        return float(self.singular_values[-2] / last) if last > 0.0 else float("inf")

    @property
    def loses_rank(self) -> bool:
        """Whether W sees fewer than p directions, so that the solution is arbitrary."""
        ratio = self.singular_values[-2] / self.singular_values[0]
        return bool(self.gap < LEAST_GAP or ratio < SMALLEST_RATIO)


def total_least_squares(W: Array) -> TotalLeastSquares:
    """Solve W chi = 0, chi_1 = 1, by SVD (eqs. 28-34, 40).

    The sums need not the left vectors of W: they come from its triangular factor, which has the
    same singular values and right vectors.

    Args:
        W: regressor, (m, p + 1) with m > p + 1.

    Raises:
        ValueError: with too few rows, numbers that are not finite, or chi_1 = 0.
    """
    rows, columns = W.shape
    if rows <= columns:
        raise ValueError(f"{rows} equations for {columns - 1} unknowns: more samples are needed")
    if not np.isfinite(W).all():
        raise ValueError("the regressor holds numbers that are not finite")
    values, sizes, right = _decomposed(W)
    sigma = float(sizes[-1] / np.sqrt(rows - columns))
    # W-hat^T W-hat = V diag(s_1^2 .. s_p^2, 0) V^T, without its first row and column (eq. 32).
    kept = right[:-1, 1:]
    normal = (kept.T * sizes[:-1] ** 2) @ kept
    scale = sigma**2 * (1.0 + values @ values)
    covariance = scale * np.linalg.pinv(normal, rcond=1e-18, hermitian=True)
    blind = right[-2, 1:]
    return TotalLeastSquares(
        values=frozen_array(values, values.shape, "values"),
        covariance=frozen_array(covariance, covariance.shape, "covariance"),
        sigma_W=sigma,
        cost_C=float((sizes[0] + 1.0) / sizes[-2]) if sizes[-2] > 0.0 else float("inf"),
        singular_values=frozen_array(sizes, sizes.shape, "singular values"),
        blind=frozen_array(blind / np.linalg.norm(blind), blind.shape, "blind direction"),
        n_equations=rows,
    )


def values_alone(W: Array) -> Array:
    """The values that `total_least_squares` gives, (p,); of triangular factors as well.

    Args:
        W: regressor, or runs' triangular factors one below the other, (m, p + 1) with m > p.

    Raises:
        ValueError: when rank is lost.
    """
    return _decomposed(W)[0]


def least_by_noise(rows: Array, noise: Array) -> tuple[Array, float]:
    """The values of which the squares are fewest times those that noise makes, and how many times.

    Args:
        rows: W, or runs' triangular factors one below the other, (m, p + 1) with m > p.
        noise: what W^T W owes to noise, to a common factor, (p + 1, p + 1).

    Returns:
        The values, (p,), and the factor.

    Raises:
        ValueError: when rank is lost.

    Source:
        Van Huffel, Vandewalle 1991, The Total Least Squares Problem, sec. 8.4: errors of unequal
        covariance; the generalised eigenproblem.
    """
    factor = np.linalg.qr(rows, mode="r")
    scale = 1.0 / np.maximum(np.linalg.norm(factor, axis=0), 1e-300)
    try:
        inverse = np.linalg.inv(factor * scale)
    except np.linalg.LinAlgError as error:
        raise ValueError("the equations lose rank") from error
    sizes, vectors = np.linalg.eigh(inverse.T @ (noise * scale[:, None] * scale) @ inverse)
    chi = scale * (inverse @ vectors[:, -1])
    if not sizes[-1] > 0.0 or abs(chi[0]) < 1e-12 * np.abs(chi).max():
        raise ValueError("the noise explains nothing of the equations: rank is lost")
    return chi[1:] / chi[0], float(1.0 / sizes[-1])


def _decomposed(W: Array) -> tuple[Array, Array, Array]:
    """Values (p,), singular values and right vectors of W, by its triangular factor."""
    _, sizes, right = np.linalg.svd(np.linalg.qr(W, mode="r"))
    chi = right[-1]
    if abs(chi[0]) < 1e-12 * np.abs(chi).max():
        raise ValueError("the solution has no share of the mass column: rank is lost")
    return chi[1:] / chi[0], sizes, right
