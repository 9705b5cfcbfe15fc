"""L D L^T factors of small symmetric matrices as expressions: few operations, no pivots."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from freeswing.cdpr.model.body import Expression


@dataclass(frozen=True, slots=True)
class Factors:
    """L D L^T of a symmetric positive definite matrix, as expressions."""

    lower: list[list[Expression]]
    inverse_diagonal: list[Expression]

    @classmethod
    def of(cls, matrix: Expression) -> Factors:
        """Factors of the matrix, of which the lower triangle is read."""
        lower: list[list[Expression]] = []
        inverse: list[Expression] = []
        diagonal: list[Expression] = []
        for i in range(matrix.shape[0]):
            scaled: list[Expression] = []
            for j in range(i):
                rest = matrix[i, j] - sum(scaled[k] * lower[j][k] for k in range(j))
                scaled.append(rest)
            row = [scaled[j] * inverse[j] for j in range(i)]
            diagonal.append(matrix[i, i] - sum(scaled[k] * row[k] for k in range(i)))
            inverse.append(1 / diagonal[i])
            lower.append(row)
        return cls(lower, inverse)

    def solved(self, right: Expression) -> Expression:
        """Solution (n,) of the system with this matrix."""
        n = len(self.lower)
        x = [right[i] for i in range(n)]
        for i in range(n):
            x[i] = x[i] - sum(self.lower[i][k] * x[k] for k in range(i))
        x = [value * inverse for value, inverse in zip(x, self.inverse_diagonal, strict=True)]
        for i in reversed(range(n)):
            x[i] = x[i] - sum(self.lower[k][i] * x[k] for k in range(i + 1, n))
        return ca.vertcat(*x)
