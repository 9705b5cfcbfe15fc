"""Small systems of equations inside compiled code.

`np.linalg.solve` would do the same; compiled, each of its uses carries along the text of an error
about shapes, and makes what holds it several times as long to compile.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.compiled.kernels import kernel

Array = NDArray[np.float64]
_Singular = np.linalg.LinAlgError


@kernel
def eliminate(matrix: Array, right: Array) -> Array:
    """The solution of matrix (n, n) @ x = right (n, m), in the place of `right`.

    The matrix is used up. Raises LinAlgError where it is singular.

    Source:
        Golub, Van Loan 2013, Matrix Computations, sec. 3.4: elimination, each pivot the
        largest of its column.
    """
    n, m = right.shape
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > abs(matrix[best, k]):
                best = i
        if matrix[best, k] == 0.0:
            raise _Singular("Matrix is singular to machine precision.")
        for j in range(k, n):
            matrix[k, j], matrix[best, j] = matrix[best, j], matrix[k, j]
        for j in range(m):
            right[k, j], right[best, j] = right[best, j], right[k, j]
        for i in range(k + 1, n):
            factor = matrix[i, k] / matrix[k, k]
            for j in range(k + 1, n):
                matrix[i, j] -= factor * matrix[k, j]
            for j in range(m):
                right[i, j] -= factor * right[k, j]
    for k in range(n - 1, -1, -1):
        for j in range(m):
            for i in range(k + 1, n):
                right[k, j] -= matrix[k, i] * right[i, j]
            right[k, j] /= matrix[k, k]
    return right


@kernel
def inverse_factor(matrix: Array) -> Array:
    """Lower triangular W with W'W the inverse of a positive definite matrix (n, n).

    Only the matrix's lower triangle is read. Raises LinAlgError where it is not positive definite.

    Source:
        Golub, Van Loan 2013, Matrix Computations, sec. 4.2: the Cholesky factor, and sec. 3.1:
        forward substitution.
    """
    n = len(matrix)
    factor, inverse = matrix.T.copy(), np.zeros((n, n))  # upper triangular, row by row
    for k in range(n):
        if not factor[k, k] > 0.0:
            raise _Singular("Matrix is not positive definite.")
        scale = 1.0 / math.sqrt(factor[k, k])
        for j in range(k, n):
            factor[k, j] *= scale
        for i in range(k + 1, n):
            share = factor[k, i]
            for j in range(i, n):
                factor[i, j] -= share * factor[k, j]
    for i in range(n):
        scale = 1.0 / factor[i, i]
        for k in range(i):
            share = -scale * factor[k, i]
            for j in range(k + 1):
                inverse[i, j] += share * inverse[k, j]
        inverse[i, i] = scale
    return inverse


@kernel
def inverse_factors(matrices: Array) -> Array:
    """`inverse_factor` of each of some positive definite matrices, (k, n, n).

    Source:
        Golub, Van Loan 2013, Matrix Computations, sec. 4.2: the Cholesky factor.
    """
    found = np.empty_like(matrices)
    for k in range(len(matrices)):
        one = inverse_factor(matrices[k])
        for i in range(len(one)):
            for j in range(len(one)):
                found[k, i, j] = one[i, j]
    return found
