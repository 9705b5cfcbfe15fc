"""The least-squares problem (21): swivel angles, lengths and statics of all poses at once.

The start's swivel angles and cable lengths, and the geometry where it is doubted, are shared by all
poses; each pose has its own six coordinates. Rows are weighted by their noise, Huber's loss takes
the weight from wrong readings, and noise that nobody stated is scaled to what the readings show.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.files.documents import DataError
from freeswing.homing.arrow_least_squares import (
    ArrowCovariance,
    ArrowSolution,
    Linearization,
    covariance,
    huber_weights,
    solve_arrow,
)
from freeswing.homing.homing_files import GeometryNoise, Homing, ReadingNoise
from freeswing.homing.misfit import is_good
from freeswing.homing.rest_readings import RestModel

Array = NDArray[np.float64]

LOSS_LIMIT = 3.0  # deviations: Huber's loss keeps 95 % of efficiency at 1.3, all of it at 3
_SMALLEST_NOISE = 1e-7
_SCALE_ROUNDS = 3


@dataclass(frozen=True, slots=True)
class StartFit:
    """Result of one fit.

    Attributes:
        poses: all poses, the start first, (N, 6).
        pose_covariance: of the start pose, (6, 6).
        sigma_rad: swivel angles that a reading of zero stands for, (n,).
        length_m: cable lengths that a reading of zero stands for, (n,).
        offsets_covariance: of sigma_rad and length_m, (2 n, 2 n).
        geometry: offsets of d, a, r and the centre of mass, (7 n + 3,); zero where not fitted.
        geometry_std: their standard deviations; the prior's where the readings show nothing.
        noise: of the readings, as used.
        residuals: in the units of the readings, (N, m), NaN where nothing was read.
        rows: the kind of each residual column.
        weights: robust weights, (N, m).
        chi_square: weighted sum of squares, without the prior.
        cost: twice what was minimised, prior included.
        degrees: degrees of freedom.
        conditioning: largest over smallest singular value of the start angles' and lengths' part.
        iterations: of the last solve.
        stop: why it stopped.
    """

    poses: Array
    pose_covariance: Array
    sigma_rad: Array
    length_m: Array
    offsets_covariance: Array
    geometry: Array
    geometry_std: Array | None
    noise: ReadingNoise
    residuals: Array
    rows: tuple[str, ...]
    weights: Array
    chi_square: float
    cost: float
    degrees: int
    conditioning: float
    iterations: int
    stop: str


class StartProblem:
    """Readings beside the model that predicts them.

    Args:
        homing: what was read.
        model: predicts the same readings, with tensions where their noise is stated and with
            tilt where an inclinometer was read.
        prior: how well the geometry is known; None holds it at what the robot file declares.
    """

    def __init__(self, homing: Homing, model: RestModel, prior: GeometryNoise | None) -> None:
        self.model, self.n = model, model.n_cables
        self.data = _stack_readings(homing, model)
        self.present = np.isfinite(self.data)
        self._filled = np.where(self.present, self.data, 0.0)
        self._prior_std = None if prior is None else prior.stack(self.n)
        self.n_border = 2 * self.n + (0 if prior is None else model.n_geometry)
        self._angular = model.columns("sigma")
        self._offset_rows = np.concatenate([self._angular, model.columns("length")])

    @property
    def degrees(self) -> int:
        """Readings less unknowns; geometry is held by its prior and counts for nothing."""
        return int(self.present.sum()) - 6 * len(self.data) - 2 * self.n

    def start_border(self, pose: Array) -> Array:
        """The border's first guess for a guessed start pose: eq. (29)."""
        values = self.model.evaluate(pose[None]).values[0]
        rest = np.zeros(self.n_border - 2 * self.n)
        return np.concatenate([values[self._offset_rows], rest])

    def row_std(self, noise: ReadingNoise) -> Array:
        """Standard deviation of each row, (m,)."""
        platform = self.model.robot.platform
        gravity = float(np.linalg.norm(self.model.robot.gravity_m_s2))
        weight = (platform.mass_kg or 1.0) * gravity
        by_kind = {
            "sigma": noise.sigma_rad,
            "length": noise.length_m,
            "statics": noise.statics,
            "tension": (noise.tension_N or 1.0) / weight,
            "tilt": noise.tilt_rad,
        }
        return np.array([by_kind[kind] for kind in self.model.rows])

    def linearize(self, noise: ReadingNoise, poses: Array, border: Array) -> Linearization:
        """Whitened residuals of eq. (20) and their derivatives (22)."""
        n, std = self.n, self.row_std(noise)
        fits_geometry = self._prior_std is not None
        offsets = border[2 * n :] if fits_geometry else None
        found = self.model.evaluate(poses, offsets, by_geometry=fits_geometry)
        residuals = found.values - self._filled
        residuals[:, self._offset_rows] -= border[: 2 * n]
        angles = residuals[:, self._angular]
        residuals[:, self._angular] = np.remainder(angles + np.pi, 2 * np.pi) - np.pi
        by_border = np.zeros((*residuals.shape, self.n_border))
        by_border[:, self._offset_rows, np.arange(2 * n)] = -1.0
        if found.by_geometry is not None:
            by_border[..., 2 * n :] = found.by_geometry
        scale = self.present / std
        prior_weight = np.zeros(self.n_border)
        if self._prior_std is not None:
            prior_weight[2 * n :] = 1 / self._prior_std
        return Linearization(
            residuals * scale,
            found.by_pose * scale[..., None],
            by_border * scale[..., None],
            border * prior_weight,
            prior_weight,
        )

    def whitened_readings(self, noise: ReadingNoise) -> Array:
        """Swivels and lengths over their noise, (N, 2 n); zero where nothing was read."""
        return (self._filled / self.row_std(noise))[:, self._offset_rows]

    def one_row(
        self, noise: ReadingNoise, row: int, poses: Array, borders: Array
    ) -> tuple[Array, Array]:
        """Whitened residuals (k, m) of one row at poses (k, 6), and their derivatives (k, m, 6).

        Args:
            noise: of the readings.
            row: which of the static poses.
            poses: guesses of it, (k, 6).
            borders: the start's swivels and lengths that belong to each guess, (k, 2 n).
        """
        found = self.model.evaluate(poses)
        residuals = found.values - self._filled[row]
        residuals[:, self._offset_rows] -= borders
        angles = residuals[:, self._angular]
        residuals[:, self._angular] = np.remainder(angles + np.pi, 2 * np.pi) - np.pi
        scale = self.present[row] / self.row_std(noise)
        return residuals * scale, found.by_pose * scale[:, None]

    def solve(
        self, noise: ReadingNoise, poses: Array, border: Array, loss_limit: float = np.inf
    ) -> ArrowSolution:
        """Minimise from a guess."""
        return solve_arrow(
            lambda blocks, shared: self.linearize(noise, blocks, shared),
            poses,
            border,
            loss_limit=loss_limit,
        )

    def finish(self, first: ArrowSolution, noise: ReadingNoise) -> StartFit:
        """Robust weights, noise scaled where it was not stated, and the covariance.

        Raises:
            DataError: when the readings do not determine the start, or nothing converged.
        """
        solution = first
        rounds = 1 if noise.stated or self.degrees < 3 * self.n else _SCALE_ROUNDS
        for count in range(rounds):
            if rounds > 1:
                noise = self._scaled(noise, solution)
            solution = self.solve(noise, solution.blocks, solution.border, LOSS_LIMIT)
            if count and np.allclose(solution.border, first.border, rtol=0, atol=1e-13):
                break
        spread = self._spread(solution)
        return self._result(solution, spread, noise)

    def _scaled(self, noise: ReadingNoise, solution: ArrowSolution) -> ReadingNoise:
        """Noise of swivel angles and lengths as the residuals show it, wrong readings aside."""
        part = self.linearize(noise, solution.blocks, solution.border)
        weights = huber_weights(part.residuals, LOSS_LIMIT)
        left = 1 - self._judged(solution, part, weights).predicted(part.by_block, part.by_border)
        ratio = {}
        for kind in ("sigma", "length"):
            columns = self.model.columns(kind)
            present = self.present[:, columns]
            sizes = np.abs(part.residuals[:, columns][present])
            redundancy = float(np.clip(left[:, columns][present], 1e-6, 1).mean())
            ratio[kind] = 1.4826 * float(np.median(sizes)) / np.sqrt(redundancy)
        return replace(
            noise,
            sigma_rad=max(noise.sigma_rad * ratio["sigma"], _SMALLEST_NOISE),
            length_m=max(noise.length_m * ratio["length"], _SMALLEST_NOISE),
        )

    def _spread(self, solution: ArrowSolution) -> ArrowCovariance:
        """The covariance, where there is one."""
        if not solution.converged:
            squares = (solution.weights * solution.linearization.residuals**2).sum(axis=1)
            raise self._not_found(solution, squares)
        return self._judged(solution, solution.linearization, solution.weights)

    def _judged(
        self, solution: ArrowSolution, linearization: Linearization, weights: Array
    ) -> ArrowCovariance:
        """The covariance; where there is none, whether readings are too few or wrong is said."""
        try:
            return self._determined(linearization, weights)
        except DataError as few:
            squares = (weights * linearization.residuals**2).sum(axis=1)
            if is_good(float(squares.sum()), self.degrees):
                raise
            raise self._not_found(solution, squares) from few

    def _not_found(self, solution: ArrowSolution, squares: Array) -> DataError:
        rows = ", ".join(str(k + 2) for k in np.argsort(squares)[:-4:-1])
        return DataError(
            f"the start pose was not found: {solution.stop}; the readings in lines {rows} fit "
            "worst: look at their signs and units, and at the robot's cables"
        )

    def _determined(self, linearization: Linearization, weights: Array) -> ArrowCovariance:
        """The covariance of what all poses determine."""
        try:
            spread = covariance(linearization, weights)
            rank = spread.rank
        except np.linalg.LinAlgError:  # a pose whose own readings leave it undetermined
            spread, rank = None, 0
        if spread is None or rank < self.n_border:
            raise DataError(
                f"{len(self.data)} static poses determine {rank} of the "
                f"{2 * self.n} start angles and lengths; record more, with every cable tightened"
            )
        return spread

    def _result(
        self, solution: ArrowSolution, spread: ArrowCovariance, noise: ReadingNoise
    ) -> StartFit:
        n, linear = self.n, solution.linearization
        chi_square = float((solution.weights * linear.residuals**2).sum())
        inflation = max(1.0, chi_square / self.degrees) if noise.stated else 1.0
        std = None
        if self._prior_std is not None:
            std = np.sqrt(np.diag(spread.border)[2 * n :] * inflation)
        values = 1 / np.sqrt(np.linalg.eigvalsh(spread.border[: 2 * n, : 2 * n]))
        return StartFit(
            poses=solution.blocks,
            pose_covariance=spread.block(0) * inflation,
            sigma_rad=np.remainder(solution.border[:n] + np.pi, 2 * np.pi) - np.pi,
            length_m=solution.border[n : 2 * n],
            offsets_covariance=spread.border[: 2 * n, : 2 * n] * inflation,
            geometry=solution.border[2 * n :] if std is not None else np.zeros(7 * n + 3),
            geometry_std=std,
            noise=noise,
            residuals=np.where(self.present, linear.residuals * self.row_std(noise), np.nan),
            rows=self.model.rows,
            weights=solution.weights,
            chi_square=chi_square,
            cost=2 * solution.cost,
            degrees=self.degrees,
            conditioning=float(values.max() / values.min()),
            iterations=solution.iterations,
            stop=solution.stop,
        )


def _stack_readings(homing: Homing, model: RestModel) -> Array:
    """Readings in the order of the model's rows, (N, m); statics are read as zero."""
    readings, count = homing.readings, len(homing.readings.sigma_rad)
    data = np.zeros((count, len(model.rows)))
    data[:, model.columns("sigma")] = readings.sigma_rad
    data[:, model.columns("length")] = readings.length_m
    if model.columns("tension").size and readings.tension_N is not None:
        mass = homing.robot.platform.mass_kg
        if mass is None:
            raise DataError("platform.mass_kg is missing: tensions are used as readings; give it")
        weight = mass * float(np.linalg.norm(homing.robot.gravity_m_s2))
        data[:, model.columns("tension")] = readings.tension_N / weight
    if model.columns("tilt").size and readings.tilt_rad is not None:
        data[:, model.columns("tilt")] = readings.tilt_rad
    return data
