"""Small systems of equations inside compiled code.

`np.linalg.solve` would do the same; compiled, each of its uses carries along the text of an error
about shapes, and makes what holds it several times as long to compile.
"""

from __future__ import annotations

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
